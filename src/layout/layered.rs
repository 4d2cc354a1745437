//! The layered engine, step by step: parts, cycles, ranks, layers, order, positions, routes, packing.
//!
//! It alone calls the other files of this folder, one after the other.

pub(crate) mod blocks;
pub(crate) mod labels;
pub(crate) mod order;
pub(crate) mod parts;
pub(crate) mod place;
pub(crate) mod rank;
pub(crate) mod wrap;

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::layers::{Lane, cut, items};
use super::spacing::{PADDING, Spacing, turned};
use super::{
    Component, Engine, Layers, Layout, LayoutOptions, Orientation, PartTask, Plan, Route, around,
    pack, routes,
};
use crate::base::error::Result;
use crate::base::geometry::{Point, Rect, Size};
use order::{LayerOrder, Search};
use parts::Subplan;

/// The space between parts: more than between boxes, so that parts are seen as such.
const PART_GAP: f64 = 20.0;
/// The most parts of which small ones are placed in the gaps of others, as the work grows with the square of their
/// number. With none, edges are 0.5 % longer; with 12, no drawing measured changes.
const MOST_NESTED: usize = 24;
/// The largest number of edges of a part that is cut in several ways; a larger one is cut only in the way that keeps it
/// small. Each way is a whole layout: with 600, 1.8 times the time for no better drawings; with 150, 1 % more crossings.
const MANY: usize = 300;
/// The largest number of items in layers that are laid out.
const MOST: usize = 150_000;
/// The number of edges that the search for good orders may sweep, in all parts together. Half: 1 % more crossings and 1 % fewer labels
/// with a place; twice: 0.6 % fewer crossings in 1.08 times the time.
const EFFORT: usize = 120_000;

/// The default engine.
pub(crate) struct Layered;

impl Engine for Layered {
    fn lay_out(&self, plan: &Plan, options: &LayoutOptions) -> Result<Layout> {
        Ok(lay_out(plan, options))
    }
}

/// The layered layout of a valid plan.
pub(crate) fn lay_out(plan: &Plan, options: &LayoutOptions) -> Layout {
    let Some(draft) = Draft::new(plan, options) else {
        let mut layout = pack::lay_out(plan, options);
        labels::place(plan, &mut layout);
        return layout;
    };
    let tried = |orientation| {
        let (crossings, mut layout) = draft.assembled(orientation);
        let length = layout.routes.iter().map(Route::length).sum();
        let quality = quality(layout.size, (crossings, length), plan.links.len(), options)
            * use_of(pack::fit(layout.size, options.page), options);
        labels::place(plan, &mut layout);
        (quality * (0.6 + 0.4 * labelled(plan, &layout)), layout)
    };
    let layouts = orientations(options).into_par_iter().map(tried);
    let layouts: Vec<(f64, Layout)> = layouts.collect();
    let best = layouts
        .into_iter()
        .reduce(|best, next| if next.0 > best.0 { next } else { best });
    let mut best = best.map_or_else(Layout::default, |best| best.1);
    labels::make_room(plan, &mut best);
    best
}

/// The share of the labels that could be placed, from 0 to 1.
fn labelled(plan: &Plan, layout: &Layout) -> f64 {
    let wanted = plan.links.iter();
    let wanted = wanted.filter(|link| link.label.is_some()).count();
    let placed = layout.routes.iter();
    let placed = placed.filter(|route| route.label.is_some()).count();
    if wanted == 0 {
        1.0
    } else {
        placed as f64 / wanted as f64
    }
}

/// The parts of a plan, each with the ways of ordering it.
struct Draft<'a> {
    plan: &'a Plan,
    options: &'a LayoutOptions,
    parts: Vec<Component>,
    orderings: Vec<Vec<Ordering>>,
}

impl<'a> Draft<'a> {
    /// The draft of a valid plan; `None` if a part is too large for layers.
    fn new(plan: &'a Plan, options: &'a LayoutOptions) -> Option<Self> {
        let parts = parts::parts(plan);
        let ways = parts.iter().map(|part| orderings(plan, part, options));
        let orderings: Vec<Vec<Ordering>> = ways.collect();
        let is_whole = !orderings.iter().any(Vec::is_empty);
        is_whole.then_some(Self {
            plan,
            options,
            parts,
            orderings,
        })
    }

    /// The best layout of every part, packed on the page; and the number of crossings.
    fn assembled(&self, orientation: Orientation) -> (u64, Layout) {
        let Self { plan, options, .. } = *self;
        let blocks = self.parts.iter().zip(&self.orderings);
        let blocks = blocks.map(|(part, orderings)| {
            let task = PartTask {
                plan,
                options,
                part,
                orientation,
            };
            (task, best_block(task, orderings))
        });
        assembled(plan, options, &blocks.collect::<Vec<_>>(), orientation)
    }
}

/// One way of cutting and ordering a part.
struct Ordering {
    layers: Layers,
    order: LayerOrder,
}

/// The drafts of a part, none if it is too large: every way of ranking, with long edges routed outside and
/// inside of clusters.
fn orderings(plan: &Plan, part: &Component, options: &LayoutOptions) -> Vec<Ordering> {
    let mut ways = rankings(part, options);
    if plan.is_labelled {
        // Labels are placed in layers between those of the boxes.
        ways.iter_mut().flatten().for_each(|rank| *rank *= 2);
    }
    ways.retain(|rank| items(part, rank) <= MOST);
    let mut lanes = vec![Lane::Inside];
    if part.ends.len() <= MANY && !part.clusters.is_empty() {
        lanes.push(Lane::Outside);
    }
    // A tight drawing is tried where a little may make it legible: with a third of the effort, they are 0.1 % smaller.
    let effort = if options.is_tight { 3 * EFFORT } else { EFFORT };
    let share = effort * part.vertices.len() / plan.vertices.len().max(1);
    let effort = share / ways.len().max(1) / lanes.len();
    let pairs = ways
        .iter()
        .flat_map(|rank| lanes.iter().map(move |lane| (rank, *lane)));
    let pairs: Vec<(&Vec<usize>, Lane)> = pairs.collect();
    let layers = pairs.into_par_iter();
    let layers: Vec<Layers> = layers
        .map(|(rank, lane)| cut(plan, part, rank, lane))
        .collect();
    let searches = layers.par_iter().map(|cut| Search::new(cut, effort));
    let searches: Vec<Search> = searches.collect();
    let (is_promising, is_useful) = promising(plan, options, part, &searches);
    let last = |search: Search<'_>| {
        if is_useful {
            search.finished()
        } else {
            search.found()
        }
    };
    let both = searches.into_par_iter().zip(is_promising);
    let found: Vec<_> = both.map(|(search, is)| is.then(|| last(search))).collect();
    let both = layers.into_iter().zip(found);
    let found = both.filter_map(|(layers, order)| order.map(|order| Ordering { layers, order }));
    found.collect()
}

/// The share of the best possible quality below which the search for an order is abandoned. Compared with
/// complete searches, this changed 10 of 392 plans, 5 of them for the better.
const PROMISING: f64 = 0.8;

/// Whether each search may lead to the best drawing in one of the orientations, and whether one of these may be of use,
/// by the orders that were found first.
fn promising(
    plan: &Plan,
    options: &LayoutOptions,
    part: &Component,
    searches: &[Search],
) -> (Vec<bool>, bool) {
    if searches.len() == 1 && options.least == 0.0 {
        return (vec![true], true);
    }
    let bounds = orientations(options).into_iter().map(|orientation| {
        let task = PartTask {
            plan,
            options,
            part,
            orientation,
        };
        let all = searches.par_iter();
        all.map(|search| bound(task, search.layers, &search.found()))
            .collect()
    });
    let bounds: Vec<Vec<Bound>> = bounds.collect();
    let mut all = bounds.iter().flatten();
    let is_useful = all.any(|bound| bound.fit >= options.least);
    let mut promising = vec![false; searches.len()];
    for bounds in bounds {
        let best = bounds.iter().map(|bound| bound.quality);
        let least = PROMISING * best.fold(0.0, f64::max);
        for (is, bound) in promising.iter_mut().zip(bounds) {
            *is |= bound.quality >= least;
        }
    }
    (promising, is_useful)
}

/// The orientations to try.
fn orientations(options: &LayoutOptions) -> Vec<Orientation> {
    let both = vec![Orientation::LeftRight, Orientation::TopBottom];
    options.orientation.map_or(both, |asked| vec![asked])
}

/// Upper bounds for the drawing of a part.
struct Bound {
    /// The scale at which it fits the page.
    fit: f64,
    quality: f64,
}

/// The upper bounds for the drawing of a part with this order.
fn bound(task: PartTask<'_>, layers: &Layers, order: &LayerOrder) -> Bound {
    let room = Spacing::new(task, layers);
    let (size, length) = room.least(&order.rows, &room.apart(&order.rows));
    let size = turned(size, task.orientation);
    Bound {
        fit: pack::fit(size, task.options.page),
        quality: task.quality(size, (order.crossings, length)) * ROUNDING,
    }
}

/// Ranks for a part: cycles broken in different ways, shallow graphs folded.
fn rankings(part: &Component, options: &LayoutOptions) -> Vec<Vec<usize>> {
    let aspect = options.page.w / options.page.h.max(1.0);
    let n = part.vertices.len();
    let ranked = |reversed: &[bool]| {
        let edges = rank::turned(&part.ends, reversed);
        (rank::ranks(n, &edges), edges)
    };
    let mut ways = vec![rank::greedy(n, &part.ends)];
    if part.ends.len() > MANY {
        return vec![ranked(&ways[0]).0];
    }
    ways.push(rank::in_order(n, &part.ends));
    ways.push(rank::by_cluster(&part.ends, &part.home, &part.parent));
    let mut rankings = Vec::new();
    for reversed in ways {
        let (rank, edges) = ranked(&reversed);
        // Without the numbers of layers beside the suitable one, tight drawings are 1.4 % smaller; with two more on each side, 1.5 %
        // larger.
        let near = if options.is_tight { 2 } else { 0 };
        let counts = rank::suitable(n, aspect)
            .into_iter()
            .flat_map(|many| many.saturating_sub(near)..=many + near);
        let folded: Vec<_> = counts
            .map(|many| rank::fold(&rank, &edges, &part.home, many))
            .collect();
        rankings.push(rank);
        rankings.extend(folded.into_iter().flatten());
    }
    let mut seen = BTreeSet::new();
    rankings.retain(|rank| seen.insert(rank.clone()));
    rankings
}

/// One part placed and routed, its top left corner at (0, 0).
#[derive(Default)]
pub(crate) struct PlacedPart {
    pub(crate) size: Size,
    pub(crate) crossings: u64,
    pub(crate) boxes: Vec<Rect>,
    pub(crate) routes: Vec<Route>,
    pub(crate) clusters: Vec<Rect>,
}

/// The weight of the length of edges in the quality of a drawing: one whose edges are half as long again is a twentieth
/// worse, as much as one that is a twentieth smaller.
const LENGTH: f64 = 0.12;

/// The weight of the crossings: a drawing in which every edge crosses another is a third worse, or a tenth if
/// filling the page is most important.
const CROSSING: f64 = 0.5;
const TIGHT_CROSSING: f64 = 0.1;

/// The quality of a drawing, larger for a better one: mostly the scale at which it fills the page, also its
/// compactness, the number of crossings and the length of its edges.
fn quality(
    size: Size,
    (crossings, length): (u64, f64),
    links: usize,
    options: &LayoutOptions,
) -> f64 {
    let links = links.max(1) as f64;
    let fit = pack::fit(size, options.page);
    if options.is_tight {
        return fit * use_of(fit, options) / (1.0 + TIGHT_CROSSING * crossings as f64 / links);
    }
    let small = (options.page.w * options.page.h / (size.w * size.h).max(1.0)).sqrt();
    let readable = libm::pow(fit, 0.8) * libm::pow(small, 0.2);
    let shortness = libm::pow((length / links).max(1.0), -LENGTH);
    readable * shortness / (1.0 + CROSSING * crossings as f64 / links)
}

impl PartTask<'_> {
    /// The quality of a drawing of the part.
    fn quality(&self, size: Size, costs: (u64, f64)) -> f64 {
        quality(size, costs, self.part.links.len(), self.options)
    }

    /// The quality of a block.
    fn judged(&self, block: &PlacedPart) -> f64 {
        let length = block.routes.iter().map(Route::length).sum();
        self.quality(block.size, (block.crossings, length))
    }
}

/// The share of the smallest useful scale below which all drawings are equally useless: a sketch has no useful scale.
const MOST_USELESS: f64 = 4.0;

/// The use of a drawing at this scale, 1 unless it is too small: it is then worse than its size alone says.
fn use_of(fit: f64, options: &LayoutOptions) -> f64 {
    let useless = (options.least / fit).clamp(1.0, MOST_USELESS);
    1.0 / (useless * useless)
}

/// The largest rounding error in the quality of a drawing.
const ROUNDING: f64 = 1.0 + 1e-9;

/// The best of all ways to place a part.
fn best_block(task: PartTask<'_>, orderings: &[Ordering]) -> PlacedPart {
    let options = task.options;
    let judged = |block: PlacedPart| (task.judged(&block), block);
    let better = |best: (f64, PlacedPart), next: (f64, PlacedPart)| {
        if next.0 > best.0 { next } else { best }
    };
    // The most promising first: most others can then be rejected before they are placed.
    let hoped = |way: &Ordering| bound(task, &way.layers, &way.order).quality;
    let mut ways: Vec<(f64, usize)> = orderings.iter().map(hoped).zip(0..).collect();
    ways.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut best: Option<(f64, usize, PlacedPart)> = None;
    for (hope, at) in ways {
        if best.as_ref().is_some_and(|best| hope < best.0) {
            break;
        }
        let (quality, block) = judged(block(task, &orderings[at]));
        let is_better = |best: &(f64, usize, PlacedPart)| {
            quality.total_cmp(&best.0).then(best.1.cmp(&at)).is_gt()
        };
        if best.as_ref().is_none_or(is_better) {
            best = Some((quality, at, block));
        }
    }
    let Some(best) = best.map(|(quality, _, block)| (quality, block)) else {
        return PlacedPart::default();
    };
    if task.part.links.len() > MANY {
        return best.1;
    }
    let is_long = wrap::is_long(best.1.size, task);
    let inside = inside(task, is_long);
    // Orders that only differ in the lanes of edges are cut into the same rows.
    let mut seen = BTreeSet::new();
    let ways = orderings.iter().filter(|_| is_long).map(|way| &way.layers);
    let ways = ways.filter(|layers| seen.insert(&layers.rank[..layers.vertices]));
    let wraps = ways.flat_map(|layers| wrap::wraps(task, layers));
    let others = inside.into_iter().chain(wraps).map(judged);
    let best = others.fold(best, better);
    // Layers show the way of the data best; blocks are for what does not fit the page in layers.
    if options.least.is_infinite() || pack::fit(best.1.size, options.page) >= 1.0 {
        return best.1;
    }
    blocks::best(task, best.0).map_or(best.1, |blocks| blocks.1)
}

fn block(task: PartTask<'_>, Ordering { layers, order }: &Ordering) -> PlacedPart {
    let room = Spacing::new(task, layers);
    let across = place::place(layers, &order.rows, &room.apart(&order.rows));
    let columns = room.columns(&order.rows, &across);
    let mut placed = routed(task, &room, &across, &columns);
    placed.crossings = order.crossings;
    placed.clusters = room.frames(&placed.boxes, &across, &columns);
    for (route, chain) in placed.routes.iter_mut().zip(&layers.chains) {
        let bend = chain.iter().find(|item| room.worded.contains_key(item));
        route.label = bend.map(|bend| room.beside(*bend, &across, &columns));
    }
    placed.on_page(task.orientation)
}

/// The boxes and routes of a part with layers at these positions, x along and y across.
pub(crate) fn routed(
    PartTask { plan, part, .. }: PartTask<'_>,
    room: &Spacing<'_>,
    across: &[f64],
    columns: &[(f64, f64)],
) -> PlacedPart {
    let outlines = part.vertices.iter().map(|&v| plan.vertices[v].outline);
    let plane = routes::RoutingPlane {
        layers: room.layers,
        size: &room.size,
        outline: &outlines.collect::<Vec<_>>(),
        across,
        columns,
    };
    let boxes = 0..room.layers.vertices;
    PlacedPart {
        boxes: boxes
            .map(|v| Rect::around(plane.centre(v), room.size[v]))
            .collect(),
        routes: plane.routes(&part.ends),
        ..PlacedPart::default()
    }
}

impl PlacedPart {
    /// This block, with x along and y across, converted to page coordinates and moved to (0, 0).
    pub(crate) fn on_page(self, orientation: Orientation) -> Self {
        let reach = Rect::of_points(self.routes.iter().flat_map(Route::points));
        let rects = self.boxes.iter().chain(&self.clusters).copied();
        let whole = rects.chain(reach).reduce(|a, b| a.union(&b));
        let whole = whole.unwrap_or_default();
        let to_page = |p: Point| match orientation {
            Orientation::LeftRight => Point::new(p.x - whole.x, p.y - whole.y),
            Orientation::TopBottom => Point::new(p.y - whole.y, p.x - whole.x),
        };
        let rect = |r: &Rect| {
            let corner = to_page(Point::new(r.x, r.y));
            let size = turned(Size::new(r.w, r.h), orientation);
            Rect::new(corner.x, corner.y, size.w, size.h)
        };
        Self {
            size: turned(Size::new(whole.w, whole.h), orientation),
            crossings: self.crossings,
            boxes: self.boxes.iter().map(rect).collect(),
            routes: self.routes.iter().map(|r| r.mapped(to_page)).collect(),
            clusters: self.clusters.iter().map(rect).collect(),
        }
    }

    /// The places that labels take: where they are placed, else probably above lines to the right and beside lines down.
    fn labels<'a>(&'a self, task: PartTask<'a>) -> impl Iterator<Item = Rect> + 'a {
        let label = move |(&i, route): (&usize, &Route)| {
            let size = task.plan.links[i].label?;
            if let Some(middle) = route.label {
                return Some(Rect::around(middle, size));
            }
            let line = Rect::of_points(route.points())?;
            let middle = line.centre();
            let (x, y) = match task.orientation {
                Orientation::LeftRight => (middle.x - size.w / 2.0, line.y - size.h),
                Orientation::TopBottom => (line.right(), middle.y - size.h / 2.0),
            };
            Some(Rect::new(x, y, size.w, size.h))
        };
        let labels = task.part.links.iter().zip(&self.routes);
        labels
            .filter(move |_| task.plan.is_labelled)
            .filter_map(label)
    }

    /// The places that its boxes, frames, lines and labels take.
    fn taken(&self, task: PartTask<'_>) -> Vec<Rect> {
        let pieces = self.routes.iter().flat_map(|route| {
            let starts = route.curves.iter().map(|curve| curve[2]);
            let starts = std::iter::once(route.start).chain(starts);
            starts
                .zip(&route.curves)
                .filter_map(|(start, curve)| Rect::of_points(std::iter::once(start).chain(*curve)))
        });
        let solid = self.boxes.iter().chain(&self.clusters).copied();
        solid.chain(pieces).chain(self.labels(task)).collect()
    }
}

/// All blocks packed, and the number of their crossings.
pub(crate) fn assembled(
    plan: &Plan,
    options: &LayoutOptions,
    blocks: &[(PartTask<'_>, PlacedPart)],
    orientation: Orientation,
) -> (u64, Layout) {
    // With the places that labels probably take, so that they do not cover the block next to it.
    let bounds = blocks.iter().map(|(task, block)| {
        let bare = Rect::new(0.0, 0.0, block.size.w, block.size.h);
        block
            .labels(*task)
            .fold(bare, |all, label| all.union(&label))
    });
    let bounds: Vec<Rect> = bounds.collect();
    let sizes: Vec<Size> = bounds.iter().map(|b| Size::new(b.w, b.h)).collect();
    let (mut corners, mut size) = pack::pack(&sizes, options.page, PART_GAP);
    if (2..=MOST_NESTED).contains(&blocks.len()) && plan.links.len() <= MANY {
        let taken = blocks.iter().zip(&bounds);
        let taken = taken.map(|((task, block), bounds)| {
            let corner = Point::new(-bounds.x, -bounds.y);
            let taken = block.taken(*task).into_iter();
            taken.map(|rect| rect.moved(corner)).collect()
        });
        let shapes: Vec<Vec<Rect>> = taken.collect();
        let nested = pack::nested(&sizes, &shapes, options.page, PART_GAP);
        if pack::fit(nested.1, options.page) > pack::fit(size, options.page) {
            (corners, size) = nested;
        }
    }
    let crossings = blocks.iter().map(|(_, block)| block.crossings).sum();
    let mut layout = Layout {
        orientation,
        size,
        boxes: vec![Rect::default(); plan.vertices.len()],
        routes: vec![Route::default(); plan.links.len()],
        clusters: vec![Rect::default(); plan.clusters.len()],
        ..Layout::default()
    };
    for (((PartTask { part, .. }, block), corner), bounds) in blocks.iter().zip(corners).zip(bounds)
    {
        let corner = Point::new(corner.x - bounds.x, corner.y - bounds.y);
        for (&v, at) in part.vertices.iter().zip(&block.boxes) {
            layout.boxes[v] = at.moved(corner);
        }
        for (&c, at) in part.clusters.iter().zip(&block.clusters) {
            layout.clusters[c] = at.moved(corner);
        }
        for (&i, route) in part.links.iter().zip(&block.routes) {
            layout.routes[i] = route.moved(corner);
        }
    }
    (crossings, layout)
}

/// The part inside one namespace like a separate page: its pieces packed inside the frames of the namespaces around all of it; `None` if there is
/// no such namespace, or no benefit: a single piece that is not `long`.
pub(crate) fn inside(task: PartTask<'_>, is_long: bool) -> Option<PlacedPart> {
    let (plan, part) = (task.plan, task.part);
    let root = part.root();
    if root == 0 {
        return None;
    }
    let inner = Subplan::new(plan, part, root, |_| true);
    if !is_long && parts::parts(&inner.plan).len() < 2 {
        return None;
    }
    let draft = Draft::new(&inner.plan, task.options)?;
    let (crossings, layout) = draft.assembled(task.orientation);
    let mut placed = PlacedPart::unplaced(part);
    inner.put(&layout, Point::default(), &mut placed);
    let mut frame = Rect::new(0.0, 0.0, layout.size.w, layout.size.h);
    for cluster in around(&part.parent, root) {
        frame = plan.clusters[part.clusters[cluster - 1]].frame(frame, PADDING);
        placed.clusters[cluster - 1] = frame;
    }
    placed.crossings = crossings;
    Some(placed.on_page(Orientation::LeftRight))
}
