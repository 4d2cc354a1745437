//! The medium of a picture, and a page with legible text for it.

use crate::base::geometry::Size;
use crate::base::words::worded;
use crate::draw::figure::MOST_HEIGHT;
use crate::draw::picture::PageOptions;
use crate::draw::style::{PRINTED_NAMES, Style};
use crate::draw::timeline::canvas::PX_PER_MM;

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

/// Pixels per point on paper, 96 to the inch.
const PX_PER_PT: f64 = 96.0 / 72.0;
/// The size of names on paper in points; all other text is a point smaller, and 6 pt is what journals accept at least.
const NAMES: f64 = 7.0;
/// The smallest legible text on a screen, in pixels.
const SMALLEST: f64 = 9.0;
/// The smallest text of the style's decorations, in its pixels.
const DECORATIONS: f64 = 10.5;

/// The pages that a medium has, and its sizes of text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Medium {
    /// The pages to try, the lowest first.
    pub(crate) sizes: Vec<Size>,
    /// The smallest legible text, in pixels.
    pub(crate) readable: f64,
    /// The printed width in millimetres and the size of names in points; `None` on a screen.
    pub(crate) paper: Option<(f64, f64)>,
    /// Whether it has room for a legend.
    has_legend: bool,
}

/// The scale of a graph whose names have this size in points on paper.
pub(crate) fn printed_scale(text_pt: f64) -> f64 {
    text_pt * PX_PER_PT / PRINTED_NAMES
}

impl From<Purpose> for Medium {
    fn from(purpose: Purpose) -> Self {
        let screen = |width: f64, heights: &[f64], has_legend| Self {
            sizes: heights.iter().map(|h| Size::new(width, *h)).collect(),
            readable: SMALLEST,
            paper: None,
            has_legend,
        };
        match purpose {
            Purpose::Readme => screen(830.0, &[467.0, 560.0, 680.0, 830.0], false),
            Purpose::Slide => screen(1280.0, &[720.0], true),
            Purpose::Column => Self::paper(88.0, NAMES),
            Purpose::Page => Self::paper(181.0, NAMES),
        }
    }
}

impl Medium {
    /// Paper of this width in millimetres, with names of this size in points.
    pub(crate) fn paper(width_mm: f64, text_pt: f64) -> Self {
        let (width, most) = (width_mm * PX_PER_MM, MOST_HEIGHT * PX_PER_MM);
        let parts = [0.2, 0.4, 0.6, 0.8, 1.0];
        Self {
            sizes: parts.map(|part| Size::new(width, most * part)).to_vec(),
            // Less a rounding error of the scale.
            readable: (text_pt - 1.0) * PX_PER_PT - 1e-6,
            paper: Some((width_mm, text_pt)),
            has_legend: false,
        }
    }

    /// The page with legible decorations.
    pub(crate) fn page(&self, page: PageOptions) -> PageOptions {
        PageOptions {
            size: self.sizes.first().copied().unwrap_or(page.size),
            width_mm: self.paper.map(|paper| paper.0),
            unit: (!self.has_legend).then_some(self.readable / DECORATIONS),
            has_legend: self.has_legend,
            largest: self.paper.map(|(_, text_pt)| printed_scale(text_pt)),
            ..page
        }
    }

    /// The style with the sizes of text on paper, where they are exact.
    pub(crate) fn styled(&self, style: Style) -> Style {
        match self.paper {
            Some((_, text_pt)) => style.printed((text_pt - 1.0) / text_pt),
            None => style,
        }
    }

    /// The advice if the graph cannot be made legible.
    pub(crate) fn advice(&self) -> &'static str {
        match self.paper {
            None => "draw less with `--ns-filter`, `--hide dead,leaf` or `--mode nodes`",
            Some(_) => "draw less with `--ns-filter` or `--mode nodes`, or print it wider",
        }
    }
}
