//! The graph on paper: the picture of the whole mission with the times of each node, above the band of phases.

use super::page::FigureSheet;
use crate::base::geometry::{Rect, Size};
use crate::draw::scene::Scene;
use crate::draw::timeline::Timeline;
use crate::draw::timeline::canvas::{PX_PER_MM, ink};
use crate::draw::timeline::drawer::{Density, Drawer};
use crate::draw::timeline::notes::{flow, sentence};
use crate::draw::timeline::phases;

/// The space between the graph and the band in millimetres, half a line of text.
const BELOW: f64 = 1.2;

/// The page of a picture of the mission in one window, which is as wide as the page.
pub(crate) fn page(sheet: &FigureSheet<'_>, picture: Scene) -> Scene {
    let (source, width) = (sheet.source, sheet.options.width_mm);
    let mut canvas = sheet.canvas();
    let mut y = picture.size.h / PX_PER_MM;
    if !source.phases.is_empty() {
        let timeline = Timeline::new(source, Vec::new());
        let place = Rect::new(0.0, y + BELOW, width, 0.0);
        let drawer = Drawer::new(timeline, Density::Paper, &canvas, place);
        let drawer = drawer.without_columns(width);
        y = drawer.ground(&mut canvas);
        canvas.begin("words");
        y = phases::names(&mut canvas, source, width, y);
    }
    canvas.begin("notes");
    if !sheet.options.is_bare {
        let text = "Bar in a box: when the node ran, from the start of the mission to its end; ticks: starts, ends and \
                    restarts. Line: topics with their rates, dashed if inferred.";
        y = flow(&mut canvas, width, y + 0.4, &[sentence(ink::QUIET, text)]);
    }
    let mut scene = canvas.into_scene(Size::new(width, y + 0.3), sheet.title("Graph"));
    let ground = scene.groups.drain(..).collect::<Vec<_>>();
    scene.groups = picture.groups;
    scene.groups.extend(ground);
    scene
}
