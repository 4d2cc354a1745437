//! The options of the picture, and a view with its positions.

use std::collections::BTreeMap;

use super::purpose::{Medium, Purpose};
use crate::base::geometry::Rect;
use crate::base::notice::Notices;
use crate::draw::picture::PageOptions;
use crate::draw::style::Style;
use crate::draw::text::Fonts;
use crate::layout::{Engine, Layout};
use crate::mission::phases::knows_publishers;
use crate::mission::{Mission, Place, Places};
use crate::view::{View, ViewOptions};

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

impl Body {
    /// Whether it is a topic timeline for this mission.
    pub(super) fn is_timeline(self, mission: &Mission) -> bool {
        match self {
            Self::Graph => false,
            Self::TopicTimeline => true,
            Self::Auto => !knows_publishers(&mission.elements, &mission.sending),
        }
    }
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
    pub fn new() -> crate::base::error::Result<Self> {
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
}

impl Drawing {
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
        self.medium
            .as_ref()
            .map_or(READABLE, |medium| medium.readable)
    }
}

/// The smallest text that `--fit auto` accepts, in pixels.
const READABLE: f64 = 9.0;

/// A view with its page and its layout.
pub(super) struct Composed {
    pub(super) view: View,
    pub(super) options: ViewOptions,
    pub(super) page: PageOptions,
    pub(super) layout: Layout,
    pub(super) notices: Notices,
}

/// A view that is not drawn, without positions.
pub(super) fn unplaced(view: View, drawing: &Drawing) -> Composed {
    Composed {
        view,
        options: drawing.view.clone(),
        page: drawing.page.clone(),
        layout: Layout::default(),
        notices: Notices::new(),
    }
}

/// The position of each item in an earlier drawing; `None` for new ones.
pub(super) fn known(view: &View, kept: &Places) -> Vec<Option<Rect>> {
    let places: BTreeMap<(&str, &str), Rect> = kept
        .boxes
        .iter()
        .map(|b| ((b.what.as_str(), b.name.as_str()), b.rect))
        .collect();
    view.items
        .iter()
        .map(|item| places.get(&(item.kind.word(), &*item.name)).copied())
        .collect()
}

/// The positions of a layout, for the JSON.
pub(super) fn places(view: &View, layout: &Layout) -> Places {
    let boxes = view.items.iter().zip(&layout.boxes);
    let mut boxes: Vec<Place> = boxes
        .map(|(item, rect)| Place {
            what: item.kind.word().to_owned(),
            name: item.name.to_string(),
            rect: *rect,
        })
        .collect();
    boxes.sort_by(|a, b| (&a.what, &a.name).cmp(&(&b.what, &b.name)));
    Places {
        width: layout.size.w,
        height: layout.size.h,
        orientation: layout.orientation.word().to_owned(),
        boxes,
    }
}
