//! The view with all elements expanded, on a page of a screen's shape, for pages and reports.

use super::Drawing;
use super::compose::Composed;
use crate::base::error::{Error, Result};
use crate::base::geometry::Size;
use crate::draw::picture::Union;
use crate::draw::picture::spaces::MOST_LISTED;
use crate::draw::picture::{PageOptions, Picture};
use crate::draw::scene::Scene;
use crate::draw::style::Style;
use crate::draw::timeline::Timeline;
use crate::export::Output;
use crate::export::sequence::Drawings;
use crate::mission::Mission;
use crate::view::{AlsoHere, DrawnPart, View, drawn_part};

/// The part of a screen that the graph of a page has: 3 : 2.
const SCREEN: Size = Size::new(1200.0, 800.0);

/// The most boxes and arrows of a page: with four kilobytes each, half a gigabyte; browsers are slow long before.
const MOST_DRAWN: usize = 120_000;

/// The view with everything expanded.
pub(super) struct Opened {
    pub(super) whole: Composed,
    /// Whether a page draws it.
    is_drawn: bool,
    /// The part of it that the page draws, with the rest as words; `None` for all of it.
    part: Option<DrawnPart>,
}

impl Opened {
    /// The view with everything expanded; `None` if no output needs it. `picture` is the view of the picture, if that is
    /// a graph.
    ///
    /// # Errors
    /// [`Error::Usage`] if a page would have more than [`MOST_DRAWN`] boxes and arrows.
    pub(super) fn new(
        mission: &Mission,
        drawing: &Drawing,
        picture: Option<&View>,
        outputs: &[Output],
    ) -> Result<Option<Self>> {
        if !outputs.iter().any(|o| o.format.is_unfolded) {
            return Ok(None);
        }
        let page = PageOptions {
            size: SCREEN,
            bare: true,
            width_mm: None,
            timeline: Timeline::default(),
            ..drawing.page.clone()
        };
        let whole = Composed::new(mission, drawing.view.opened(&mission.elements), page);
        let is_drawn = picture.is_some() && outputs.iter().any(|o| o.format.word == "html");
        let folded = picture.filter(|view| view.is_folded());
        let views = folded.into_iter().chain([&whole.view]);
        let drawn: usize = views.map(|v| v.items.len() + v.arrows.len()).sum();
        if is_drawn && drawn > MOST_DRAWN {
            let what = format!(
                "a page of {drawn} boxes and arrows is too large; the limit is {MOST_DRAWN}"
            );
            let hint = "omit some with `--ns-filter`, `--hide dead,leaf` or `--mode nodes`";
            return Err(Error::usage(what, hint));
        }
        let part = is_drawn.then(|| drawn_part(&whole.view, mission, &whole.options));
        let is_listed = |also: &AlsoHere| also.items.len() <= MOST_LISTED;
        let part = part.flatten();
        Ok(Some(Self {
            part: part.filter(|part| part.view.also.iter().all(is_listed)),
            whole,
            is_drawn,
        }))
    }

    /// The picture of that view; `None` if no output is a page.
    pub(super) fn drawings<'a>(&'a self, drawing: &'a Drawing) -> Option<OpenedDrawings<'a>> {
        let part = self.part.as_ref();
        let view = part.map_or(&self.whole.view, |part| &part.view);
        self.is_drawn.then(|| {
            let measured = drawing.measured(view, self.whole.page.clone());
            let layout = drawing.laid_out(measured.plan(), &measured.layout_options(), None);
            OpenedDrawings {
                picture: measured.with(layout),
                opened: self,
            }
        })
    }
}

/// The picture of a view, or of the part of it that is not listed as words.
pub(super) struct OpenedDrawings<'a> {
    picture: Picture<'a>,
    opened: &'a Opened,
}

impl Drawings for OpenedDrawings<'_> {
    fn scene(&self, window: usize) -> Scene {
        self.picture.scene(window)
    }

    fn graph(&self) -> Option<(Union, &Style)> {
        let Opened { part, whole, .. } = self.opened;
        let union = match part {
            Some(part) => self.picture.union_with_words(&whole.view, part),
            None => self.picture.union(),
        };
        Some((union, self.picture.style()))
    }
}
