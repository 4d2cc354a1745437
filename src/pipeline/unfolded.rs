//! The view with all elements expanded, on a page of a screen's shape, for pages and reports.

use super::Drawing;
use crate::base::error::{Error, Result};
use crate::base::geometry::Size;
use crate::draw::picture::also::MOST_LISTED;
use crate::draw::picture::{Measured, PageOptions, Picture};
use crate::draw::scene::Scene;
use crate::draw::timeline::Timeline;
use crate::export::Output;
use crate::export::sequence::{Drawings, UnionDrawings};
use crate::mission::Mission;
use crate::view::{AlsoHere, View, view};
use crate::view::{DrawnPart, drawn_part};

/// The part of a screen that the graph of a page has: 3 : 2.
const SCREEN: Size = Size::new(1200.0, 800.0);

/// The most boxes and arrows of a page: with four kilobytes each, half a gigabyte; browsers are slow long before.
const MOST_DRAWN: usize = 120_000;

/// The view with everything expanded; `None` if no output needs it. `picture` is the view of the picture, if that is a
/// graph.
///
/// # Errors
/// [`Error::Usage`] if a page would have more than [`MOST_DRAWN`] boxes and arrows.
pub(super) fn opened(
    mission: &Mission,
    drawing: &Drawing,
    picture: Option<&View>,
    outputs: &[Output],
) -> Result<Option<View>> {
    if !outputs.iter().any(|o| o.format.is_unfolded) {
        return Ok(None);
    }
    let opened = view(mission, &drawing.view.opened(&mission.elements)).0;
    let folded = picture.filter(|view| view.is_folded());
    let views = folded.into_iter().chain([&opened]);
    let drawn: usize = views.map(|v| v.items.len() + v.arrows.len()).sum();
    if picture.is_some() && drawn > MOST_DRAWN && outputs.iter().any(is_page) {
        return Err(Error::usage(
            format!("a page of {drawn} boxes and arrows is too large; the limit is {MOST_DRAWN}"),
            "omit some with `--ns-filter`, `--hide dead,leaf` or `--mode nodes`",
        ));
    }
    Ok(Some(opened))
}

fn is_page(output: &Output) -> bool {
    output.format.word == "html"
}

/// The part of that view that a page draws; `None` for all of it, or if no output is a page.
pub(super) fn part(
    view: &View,
    mission: &Mission,
    drawing: &Drawing,
    outputs: &[Output],
) -> Option<DrawnPart> {
    let part = outputs.iter().any(is_page).then(|| {
        let options = drawing.view.opened(&mission.elements);
        drawn_part(view, mission, &options)
    });
    let is_listed = |also: &AlsoHere| also.items.len() <= MOST_LISTED;
    part.flatten()
        .filter(|part| part.view.also.iter().all(is_listed))
}

/// The picture of that view; `None` if no output is a page.
pub(super) fn drawn<'a>(
    (whole, part): (&'a View, Option<&'a DrawnPart>),
    drawing: &'a Drawing,
    outputs: &[Output],
) -> Option<OpenedDrawings<'a>> {
    if !outputs.iter().any(is_page) {
        return None;
    }
    let view = part.map_or(whole, |part| &part.view);
    let page = PageOptions {
        size: SCREEN,
        bare: true,
        width_mm: None,
        timeline: Timeline::default(),
        ..drawing.page.clone()
    };
    let measured = Measured::new(view, &drawing.style, &drawing.fonts, page);
    Some(OpenedDrawings {
        picture: measured.laid_out(drawing.engine),
        whole,
        part,
    })
}

/// The picture of a view, or of the part of it that is not listed as words.
pub(super) struct OpenedDrawings<'a> {
    picture: Picture<'a>,
    whole: &'a View,
    part: Option<&'a DrawnPart>,
}

impl Drawings for OpenedDrawings<'_> {
    fn scene(&self, window: usize) -> Scene {
        self.picture.scene(window)
    }

    fn graph(&self) -> Option<UnionDrawings<'_>> {
        let drawings = self.picture.graph()?;
        Some(match self.part {
            Some(part) => UnionDrawings {
                union: self.picture.union_with_words(self.whole, part),
                ..drawings
            },
            None => drawings,
        })
    }
}
