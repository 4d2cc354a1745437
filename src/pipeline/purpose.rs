//! The medium of a picture, and a page with legible text for it.

use crate::base::geometry::Size;
use crate::base::words::worded;
use crate::draw::picture::PageOptions;

worded! {
    /// The medium of a picture.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Purpose {
        /// On a repository's front page, which is at most 830 pixels wide.
        Readme = "readme",
        /// On a screen or a wall, 1280 × 720.
        Slide = "slide",
        /// In a column of a paper, 88 mm.
        Column = "column",
        /// On a page of a paper, 181 mm.
        Page = "page",
    }
}

/// Pixels per millimetre on paper, 96 to the inch.
const PX_PER_MM: f64 = 96.0 / 25.4;
/// The largest height of a drawing on paper, in millimetres.
const HIGHEST: f64 = 225.0;
/// The smallest text of the style's decorations, in its pixels.
const DECORATIONS: f64 = 10.5;

impl Purpose {
    /// The width on paper in millimetres, if printed.
    fn width_mm(self) -> Option<f64> {
        match self {
            Self::Readme | Self::Slide => None,
            Self::Column => Some(88.0),
            Self::Page => Some(181.0),
        }
    }

    /// The smallest legible text, in pixels: 9, or 6 pt.
    pub(crate) fn readable(self) -> f64 {
        match self.width_mm() {
            None => 9.0,
            Some(_) => 8.0,
        }
    }

    /// The pages to try, the lowest first.
    pub(crate) fn sizes(self) -> Vec<Size> {
        let of = |w: f64, heights: &[f64]| heights.iter().map(|h| Size::new(w, *h)).collect();
        match (self, self.width_mm()) {
            (_, Some(mm)) => {
                let (w, most) = (mm * PX_PER_MM, HIGHEST * PX_PER_MM);
                of(w, &[most * 0.4, most * 0.6, most * 0.8, most])
            }
            (Self::Readme, _) => of(830.0, &[467.0, 560.0, 680.0, 830.0]),
            _ => of(1280.0, &[720.0]),
        }
    }

    /// The page with legible decorations: only a slide has room for a legend.
    pub(crate) fn page(self, page: PageOptions) -> PageOptions {
        let is_slide = self == Self::Slide;
        PageOptions {
            size: self.sizes().first().copied().unwrap_or(page.size),
            width_mm: self.width_mm(),
            unit: (!is_slide).then(|| self.readable() / DECORATIONS),
            has_legend: is_slide,
            ..page
        }
    }

    /// The advice if the graph cannot be made legible.
    pub(crate) fn advice(self) -> &'static str {
        match self {
            Self::Readme | Self::Slide => {
                "draw less with `--ns-filter`, `--hide dead,leaf` or `--mode nodes`"
            }
            Self::Column | Self::Page => {
                "use `bagreel figure`, which is made for paper, or draw less with `--ns-filter` or `--mode nodes`"
            }
        }
    }
}
