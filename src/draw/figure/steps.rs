//! Steps: a panel per reconfiguration with only what changes and its direct partners, in order of time.

use super::FigureSheet;
use crate::base::geometry::{Point, Rect, Size};
use crate::base::words;
use crate::draw::scene::{Scene, Stroke};
use crate::draw::style::Color;
use crate::draw::timeline::canvas::{HAIRLINE, PX_PER_MM, PaperCanvas, Type, ink};
use crate::draw::timeline::notes::{Unbroken, flow, flow_at, sentence};
use crate::mission::EventId;

/// The space between two panels, inside their borders, and between the head of a panel and its graph, in millimetres: what
/// belongs together is closer.
const BETWEEN: f64 = 2.0;
const INSIDE: f64 = 1.3;
const HEAD: f64 = 0.6;

/// One reconfiguration.
pub(crate) struct StepPanel {
    /// The phases before and after: `2 → 3`.
    pub(crate) number: String,
    /// Its time and the numbers of nodes that start and stop.
    pub(crate) words: String,
    /// The namespace that its names are relative to; empty for none.
    pub(crate) home: String,
    /// The picture without anything around it, at its size on paper.
    pub(crate) picture: Scene,
    /// The number of columns that it takes.
    pub(crate) span: usize,
    /// The topics that other nodes take over: `cmd_vel: controller → dock_controller`.
    pub(crate) handovers: Vec<String>,
    /// The nodes that start (`true`) and stop, without namespaces and numbers, sorted: equal for steps that repeat each
    /// other.
    pub(crate) changes: Vec<(bool, String)>,
    /// The events of the log in it.
    pub(crate) events: Vec<EventId>,
    /// The number of nodes that are not drawn.
    pub(crate) left_out: usize,
}

/// The narrowest panel in millimetres: a name of usual length on each side of an arrow.
const NARROWEST: f64 = 42.0;
/// The columns of a page, of which a panel spans some: halves and thirds of the page are whole numbers of them.
const COLUMNS: usize = 6;

/// The numbers of columns that a panel may span on a page of this width in millimetres: a third, half, two thirds or all
/// of it.
pub(crate) fn spans(width_mm: f64) -> impl Iterator<Item = usize> {
    let spans = [2, 3, 4, COLUMNS].into_iter();
    spans.filter(move |span| *span == COLUMNS || panel_width(width_mm, *span) >= NARROWEST)
}

/// The width in millimetres of the graph of a panel over so many columns.
pub(crate) fn graph_width(width_mm: f64, span: usize) -> f64 {
    panel_width(width_mm, span) - 2.0 * INSIDE - 0.2
}

fn panel_width(width_mm: f64, span: usize) -> f64 {
    let one = (width_mm + BETWEEN) / COLUMNS as f64;
    one * span as f64 - BETWEEN
}

/// The page of these panels, each as high as possible, but for a line of text, and then as far to the left, with notes of
/// repetitions and omissions. `left_out` smaller steps have no panel; those that repeat an earlier one are a sentence unless
/// they were asked for.
pub(crate) fn page(sheet: &FigureSheet<'_>, mut panels: Vec<StepPanel>, left_out: usize) -> Scene {
    let width = sheet.options.width_mm;
    let repeated = if sheet.options.steps.is_empty() {
        fold_repeated(&mut panels)
    } else {
        Vec::new()
    };
    let mut canvas = sheet.canvas();
    let mut ends = [0.1; COLUMNS];
    let mut graphs = Vec::new();
    for (at, (panel, letter)) in panels.iter().zip('a'..='z').enumerate() {
        let end = |column: usize| {
            let under = &ends[column..column + panel.span];
            under.iter().copied().fold(0.0, f64::max)
        };
        let mut places = 0..=COLUMNS - panel.span.min(COLUMNS);
        let highest = places.clone().map(end).fold(f64::MAX, f64::min);
        let column = places
            .find(|at| end(*at) < highest + canvas.sizes.pitch())
            .unwrap_or(0);
        let left = (width + BETWEEN) / COLUMNS as f64 * column as f64;
        let corner = Point::new(left + 0.1, end(column));
        canvas.begin_step(at + 1, &panel.events);
        let wide = panel_width(width, panel.span) - 0.2;
        let (height, graph) = draw(&mut canvas, panel, letter, corner, wide);
        let to = Point::new(graph.x * PX_PER_MM, graph.y * PX_PER_MM);
        for group in &panel.picture.groups {
            let mut group = group.placed(1.0, to);
            group.id = format!("{letter}-{}", group.id);
            graphs.push(group);
        }
        ends[column..column + panel.span].fill(corner.y + height + 1.2);
    }
    canvas.begin("notes");
    let notes = notes(sheet, &panels, &repeated, left_out);
    let bottom = ends.into_iter().fold(0.0, f64::max);
    let y = flow(&mut canvas, width, bottom - 0.5, &notes);
    let mut scene = canvas.into_scene(Size::new(width, y + 0.3), sheet.title("Steps"));
    scene.groups.extend(graphs);
    scene
}

/// Draws a panel without its graph; returns its height and the corner of its graph.
fn draw(
    canvas: &mut PaperCanvas<'_>,
    panel: &StepPanel,
    letter: char,
    corner: Point,
    width: f64,
) -> (f64, Point) {
    let inner = width - 2.0 * INSIDE;
    let notes = panel.handovers.iter();
    let notes = notes.map(|text| sentence(ink::CHANGED, &**text));
    let notes: Vec<Unbroken> = notes.collect();
    let top = corner.y + INSIDE * 0.8;
    let graph = top + canvas.sizes.pitch() + HEAD;
    let graph_end = graph + panel.picture.size.h / PX_PER_MM + 0.5;
    let x = corner.x + INSIDE;
    let end = flow_at(canvas, Point::new(x, graph_end), inner, &notes) + INSIDE * 0.4;
    let border = Rect::new(corner.x, corner.y, width, end - corner.y);
    let stroke = Stroke::solid(ink::FOLDED, HAIRLINE);
    canvas.frame(border, 0.4, Color::NONE, &stroke);
    let y = top + canvas.cap(Type::Head) / 2.0 + 0.2;
    let number = format!("({letter}) {}", panel.number);
    canvas.text(x, y, Type::Head, ink::TEXT, &number);
    let home = match &*panel.home {
        "" => String::new(),
        home => format!("in {home}"),
    };
    canvas.text_end(x + inner, y, Type::Small, ink::QUIET, &home);
    let at = canvas.width(&number, Type::Head) + 1.4;
    let room = inner - at - canvas.width(&home, Type::Small) - 1.4;
    let words = canvas.cut(&panel.words, Type::Name, room);
    canvas.text(x + at, y, Type::Name, ink::TEXT, &words);
    let aside = (inner - panel.picture.size.w / PX_PER_MM).max(0.0) / 2.0;
    (border.h, Point::new(x + aside, graph))
}

/// Takes out the panels that repeat an earlier one elsewhere; returns a sentence for each: `5 → 6 as 1 → 2, in /robot2.`
fn fold_repeated(panels: &mut Vec<StepPanel>) -> Vec<String> {
    let mut seen: Vec<(Vec<(bool, String)>, String)> = Vec::new();
    let mut repeated = Vec::new();
    panels.retain(|panel| {
        let earlier = seen.iter().find(|(changes, _)| *changes == panel.changes);
        let Some((_, first)) = earlier.filter(|_| !panel.changes.is_empty()) else {
            seen.push((panel.changes.clone(), panel.number.clone()));
            return true;
        };
        let place = match &*panel.home {
            "" => "elsewhere".to_owned(),
            home => format!("in {home}"),
        };
        let handovers = panel.handovers.iter().map(String::as_str);
        let parts: Vec<&str> = std::iter::once(&*place).chain(handovers).collect();
        let parts = parts.join("; ");
        repeated.push(format!("{} as {first}, {parts}.", panel.number));
        false
    });
    repeated
}

fn notes(
    sheet: &FigureSheet<'_>,
    panels: &[StepPanel],
    repeated: &[String],
    left_out: usize,
) -> Vec<Unbroken> {
    let again = repeated.iter().map(|text| sentence(ink::TEXT, &**text));
    let mut items: Vec<Unbroken> = again.collect();
    let mut quiet = |text: String| items.push(sentence(ink::QUIET, text));
    if !sheet.options.is_bare {
        quiet(
            "Green with +: starts. Orange with −: stops. Purple: changes in another way. Others: their direct partners."
                .to_owned(),
        );
    }
    if panels.iter().any(|p| p.left_out > 0) {
        let each: Vec<String> = panels.iter().map(|p| p.left_out.to_string()).collect();
        let each = each.join(", ");
        quiet(format!("Nodes not drawn, panel by panel: {each}."));
    }
    if left_out > 0 {
        let steps = words::count(left_out, "smaller step");
        quiet(format!("{steps} left out."));
    }
    items
}
