//! The view with all elements expanded, on a page of a screen's shape, for pages and reports.

use super::Drawing;
use crate::base::geometry::Size;
use crate::draw::picture::{Course, Measured, PageOptions, Picture};
use crate::export::Output;
use crate::mission::Mission;
use crate::view::{View, view};

/// The part of a screen that the graph of a page has: 3 : 2.
const SCREEN: Size = Size::new(1200.0, 800.0);

/// The view with everything expanded; `None` if no output needs it.
pub(super) fn opened(mission: &Mission, drawing: &Drawing, outputs: &[Output]) -> Option<View> {
    let is_asked = outputs.iter().any(|o| o.format.is_unfolded);
    is_asked.then(|| view(mission, &drawing.view.opened(&mission.elements)).0)
}

/// The picture of that view; `None` if no output is a page.
pub(super) fn drawn<'a>(
    view: &'a View,
    drawing: &'a Drawing,
    outputs: &[Output],
) -> Option<Picture<'a>> {
    let is_page = |o: &Output| o.format.word == "html";
    if !outputs.iter().any(is_page) {
        return None;
    }
    let page = PageOptions {
        size: SCREEN,
        bare: true,
        width_mm: None,
        course: Course::default(),
        ..drawing.page.clone()
    };
    let measured = Measured::new(view, &drawing.style, &drawing.fonts, page);
    Some(measured.laid_out(drawing.engine))
}
