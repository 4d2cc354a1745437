//! A second engine: cycles, ranks and order are ours, the positions come from the crate `layout-rs`, the
//! routes are ours.
//!
//! The crate's own ordering takes exponential time on some graphs, and its router draws edges through boxes;
//! only its placement is used. Like `layered.rs`, it calls its siblings one after the other. It does not draw
//! clusters: their frames stay empty.

use std::cell::Cell;
use std::panic::{self, UnwindSafe};
use std::sync::Once;

use ::layout::core::base::Orientation as Direction;
use ::layout::core::geometry::{Point as TheirPoint, Position};
use ::layout::core::style::StyleAttr;
use ::layout::std_shapes::shapes::{Element, ShapeKind};
use ::layout::topo::layout::VisualGraph;
use ::layout::topo::placer::Placer;

use super::layered::{PlacedPart, assembled, routed};
use super::layered::{labels, order, parts, rank};
use super::layers::{Lane, cut};
use super::spacing::{Spacing, turned};
use super::{
    Engine, LayerItem, LayerRows, Layers, Layout, LayoutOptions, Orientation, PartTask, Plan,
};
use crate::base::error::{Error, Result};
use crate::base::geometry::{Rect, Size};

/// The largest number of vertices it takes; more take too long.
const MOST: usize = 150;
/// The number of edges that the search for a good order may sweep, per part.
const EFFORT: usize = 20_000;
/// The space around boxes, and around edges: along, for labels and heads, and across.
const BOX_HALO: Size = Size::new(50.0, 14.0);
const EDGE_HALO: Size = Size::new(10.0, 7.0);

/// The engine behind `--layout layout-rs`.
pub(crate) struct LayoutRs;

impl Engine for LayoutRs {
    fn lay_out(&self, plan: &Plan, options: &LayoutOptions) -> Result<Layout> {
        let hint = "use `--layout layered`, or show fewer elements";
        if plan.vertices.len() > MOST {
            let what = format!("layout-rs is too slow for more than {MOST} elements");
            return Err(Error::usage(what, hint));
        }
        let orientation = options.orientation.unwrap_or(Orientation::LeftRight);
        // It checks its preconditions with `assert!`.
        let attempt = silenced(|| lay_out(plan, options, orientation));
        attempt.unwrap_or_else(|_| Err(Error::usage("layout-rs failed on this graph", hint)))
    }
}

thread_local! {
    /// Whether a panic of this thread is caught and must not be printed.
    static IS_EXPECTED: Cell<bool> = const { Cell::new(false) };
}

/// The result of `work`, or its panic, which is not printed.
fn silenced<T>(work: impl FnOnce() -> T + UnwindSafe) -> std::thread::Result<T> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |reported| {
            if !IS_EXPECTED.get() {
                before(reported);
            }
        }));
    });
    IS_EXPECTED.set(true);
    let outcome = panic::catch_unwind(work);
    IS_EXPECTED.set(false);
    outcome
}

fn lay_out(plan: &Plan, options: &LayoutOptions, orientation: Orientation) -> Result<Layout> {
    let mut flat = plan.without_clusters();
    for link in &mut flat.links {
        link.fork = None;
    }
    let parts = parts::parts(&flat);
    let blocks = parts.iter().map(|part| {
        let task = PartTask {
            plan: &flat,
            options,
            part,
            orientation,
        };
        Some((task, block(task)?))
    });
    let blocks = blocks.collect::<Option<Vec<_>>>().ok_or_else(|| {
        let what = "layout-rs placed boxes on top of each other";
        Error::usage(what, "use `--layout layered`")
    })?;
    let (_, mut layout) = assembled(&flat, options, &blocks, orientation);
    layout.clusters = vec![Rect::default(); plan.clusters.len()];
    labels::place(&flat, &mut layout);
    if !plan.clusters.is_empty() {
        layout
            .remarks
            .push("layout-rs draws no boxes around namespaces".to_owned());
    }
    Ok(layout)
}

/// One part placed and routed; `None` if its boxes overlap.
fn block(task: PartTask<'_>) -> Option<PlacedPart> {
    let part = task.part;
    let n = part.vertices.len();
    let reversed = rank::in_order(n, &part.ends);
    let ranks = rank::ranks(n, &rank::turned(&part.ends, &reversed));
    let layers = cut(task.plan, part, &ranks, Lane::Outside);
    let order::LayerOrder { rows, crossings } = order::order(&layers, EFFORT);
    let room = Spacing::new(task, &layers);
    let places = places(&layers, &rows, &room, task.orientation);
    let across: Vec<f64> = places.iter().map(|&(_, across)| across).collect();
    let columns = rows.iter().map(|row| column(row, &layers, &room, &places));
    let columns: Vec<(f64, f64)> = columns.collect();
    let part = routed(task, &room, &across, &columns);
    let is_clear = |(v, own): (usize, &Rect)| part.boxes[..v].iter().all(|b| !b.overlaps(own));
    let are_clear = part.boxes.iter().enumerate().all(is_clear);
    are_clear.then(|| PlacedPart { crossings, ..part }.on_page(task.orientation))
}

/// The middle of each item: along, across.
fn places(
    layers: &Layers,
    rows: &LayerRows,
    room: &Spacing,
    orientation: Orientation,
) -> Vec<(f64, f64)> {
    let direction = match orientation {
        Orientation::LeftRight => Direction::LeftToRight,
        Orientation::TopBottom => Direction::TopToBottom,
    };
    let mut graph = VisualGraph::new(direction);
    graph.dag.set_validate(false);
    let point = |size: Size| {
        let size = turned(size, orientation);
        TheirPoint::new(size.w, size.h)
    };
    for item in 0..layers.kind.len() {
        let (flipped, zero) = (direction.flip(), TheirPoint::zero());
        let (mut element, size, halo) = if layers.kind[item] == LayerItem::Vertex {
            let size = room.size[item];
            let size = point(Size::new(size.w, size.h + 2.0 * room.loop_room(item)));
            let (shape, look) = (ShapeKind::new_box(""), StyleAttr::simple());
            (Element::create(shape, look, flipped, size), size, BOX_HALO)
        } else {
            let connector = Element::empty_connector(flipped);
            (connector, point(Size::new(1.0, 1.0)), EDGE_HALO)
        };
        element.pos = Position::new(zero, size, zero, point(halo));
        graph.add_node(element);
    }
    for (item, after) in layers.down.iter().enumerate() {
        for &next in after {
            graph.dag.add_edge(item.into(), next.into());
        }
    }
    let ranks = rows
        .iter()
        .map(|row| row.iter().map(|&item| item.into()).collect());
    *graph.dag.ranks_mut() = ranks.collect();
    Placer::new(&mut graph).layout(false);
    let middle = |item: usize| {
        let at = graph.pos(item.into()).center();
        let at = turned(Size::new(at.x, at.y), orientation);
        (at.w, at.h)
    };
    (0..layers.kind.len()).map(middle).collect()
}

/// The extent of a layer along.
fn column(row: &[usize], layers: &Layers, room: &Spacing, places: &[(f64, f64)]) -> (f64, f64) {
    let middle = row.iter().map(|&item| places[item].0).sum::<f64>() / row.len().max(1) as f64;
    let vertices = row
        .iter()
        .filter(|&&item| layers.kind[item] == LayerItem::Vertex);
    let half = vertices.map(|&v| room.size[v].w / 2.0).fold(0.0, f64::max);
    (middle - half, middle + half)
}

#[cfg(test)]
mod tests {
    use super::*;

    thread_local! {
        static HEARD: Cell<u32> = const { Cell::new(0) };
    }

    #[test]
    fn panics_inside_are_silenced_and_others_are_not() {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |reported| {
            HEARD.set(HEARD.get() + 1);
            before(reported);
        }));
        assert!(silenced(|| panic!("expected")).is_err());
        assert_eq!(HEARD.get(), 0);
        assert!(panic::catch_unwind(|| panic!("the test's own")).is_err());
        assert_eq!(HEARD.get(), 1);
    }
}
