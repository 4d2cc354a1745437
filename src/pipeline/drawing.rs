//! The options of a picture, and the medium for which it is drawn: its page, and the smallest text that is legible on it.

use crate::base::error::Result;
use crate::base::geometry::Size;
use crate::base::words::worded;
use crate::draw::figure::MOST_HEIGHT;
use crate::draw::picture::PageOptions;
use crate::draw::style::{PRINTED_NAMES, Style};
use crate::draw::text::Fonts;
use crate::draw::timeline::canvas::PX_PER_MM;
use crate::layout::Engine;
use crate::mission::Places;
use crate::view::ViewOptions;

/// The kind of picture of a mission.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Body {
    /// A graph, or a topic timeline if the publishers of most messages are unknown.
    #[default]
    Auto,
    /// The computation graph.
    Graph,
    /// The timeline of topics.
    TopicTimeline,
}

/// The options of the picture.
#[derive(Clone)]
#[non_exhaustive]
pub struct Drawing {
    /// The kind of picture: graph or topic timeline.
    pub body: Body,
    /// The choice of what is shown.
    pub view: ViewOptions,
    /// Colours, strokes and fonts.
    pub style: Style,
    /// The fonts for all text.
    pub fonts: Fonts,
    /// The page with its title and orientation.
    pub page: PageOptions,
    /// Whether the user chose the size of the page, so that it may not grow.
    pub is_sized: bool,
    /// The medium, if it determines the page: see [`Drawing::seen`].
    pub(crate) medium: Option<Medium>,
    /// Whether to enlarge the page and collapse namespaces until the text is legible.
    pub is_fitted: bool,
    /// The layout engine.
    pub engine: &'static (dyn Engine + Sync),
    /// Positions of an earlier drawing, which are kept; new elements are placed beside them.
    pub kept: Option<Places>,
}

impl Drawing {
    /// The light style on a page of 1280×720 that may grow, as on the command line.
    ///
    /// # Errors
    /// None in practice: the built-in style is valid.
    pub fn new() -> Result<Self> {
        Ok(Self {
            body: Body::default(),
            view: ViewOptions::default(),
            style: Style::builtin("light")?,
            fonts: Fonts::bundled(),
            page: PageOptions::default(),
            is_sized: false,
            medium: None,
            is_fitted: true,
            engine: crate::layout::ENGINES[0].1,
            kept: None,
        })
    }

    /// The same drawing for this medium, which overrides page, text size and decorations.
    #[must_use]
    pub fn seen(self, purpose: Purpose) -> Self {
        self.on(purpose.into())
    }

    /// The same drawing on the pages of a medium.
    pub(crate) fn on(self, medium: Medium) -> Self {
        Self {
            page: medium.page(self.page),
            style: medium.styled(self.style),
            is_sized: true,
            medium: Some(medium),
            ..self
        }
    }

    /// The smallest legible text, in pixels.
    pub(super) fn readable(&self) -> f64 {
        let medium = self.medium.as_ref();
        medium.map_or(SMALLEST, |medium| medium.readable)
    }
}

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
            Purpose::Readme => screen(830.0, &[467.0, 560.0, 680.0, 830.0, 1100.0], false),
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
}
