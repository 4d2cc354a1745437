//! A part as blocks: the contents of each outermost namespace are laid out by themselves, then the namespaces as boxes.
//!
//! Layers that run through all namespaces spread each over as many columns as lie between its first box and its last; a
//! block is as compact as its own contents allow.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::parts::Subplan;
use super::{Draft, PlacedPart, ROUNDING};
use crate::base::geometry::{Point, Rect, Size, polyline};
use crate::layout::routes::around::{End, Map, meets};
use crate::layout::routes::{PORT_STEP, PORTS};
use crate::layout::spacing::{PADDING, turned};
use crate::layout::{
    Component, Layout, LayoutOptions, Link, Orientation, Outline, PartTask, Plan, Route, Vertex,
    around,
};

/// The shapes, width over height, of the pages on which the contents of namespaces are laid out: columns, squares, rows.
const SHAPES: [f64; 3] = [0.3, 1.0, 3.0];
/// The straight pieces that stand for each curve of a route when crossings are counted: with six, no drawing has fewer.
const PIECES: u32 = 3;

/// The part with its outermost namespaces as blocks, in the way that is judged best, and its quality: with all contents
/// on pages of one shape, and for a drawing that fills the page, each in its own. `None` if its quality is not above `least`, if it
/// has no namespace or only one around everything, or if something is too large.
pub(crate) fn best(task: PartTask<'_>, least: f64) -> Option<(f64, PlacedPart)> {
    let blocks = Blocks::new(task)?;
    let many = blocks.contents.len();
    let mut best = None;
    for shape in 0..SHAPES.len() {
        blocks.try_shapes(&vec![shape; many], least, &mut best);
    }
    let size = |at: usize, shape: usize| blocks.contents[at][shape].layout.size;
    for at in (0..many).filter(|_| task.options.is_tight) {
        for shape in 0..SHAPES.len() {
            let mut shapes = best.as_ref()?.shapes.clone();
            if size(at, shape) != size(at, shapes[at]) {
                shapes[at] = shape;
                blocks.try_shapes(&shapes, least, &mut best);
            }
        }
    }
    let best = best.filter(|best| best.quality > least)?;
    let placed = blocks.connected(blocks.laid_out(&best.shapes)?, true)?;
    Some((best.quality, placed))
}

/// The best way so far.
struct Best {
    quality: f64,
    /// The shape of the contents of each namespace.
    shapes: Vec<usize>,
}

/// The contents of a namespace with a layout.
struct Contents {
    sub: Subplan,
    layout: Layout,
}

/// A part with the contents of its outermost namespaces laid out in each shape.
struct Blocks<'a> {
    task: PartTask<'a>,
    cut: Cut,
    /// The contents of each namespace, in each shape.
    contents: Vec<Vec<Contents>>,
}

impl<'a> Blocks<'a> {
    fn new(task: PartTask<'a>) -> Option<Self> {
        let options = task.options;
        let cut = Cut::new(task.part)?;
        let laid_out = |space: usize, shape: f64| {
            let page = Size::new(options.page.h * shape, options.page.h);
            // On a page of its own it may be as small as it likes, unless it is a sketch.
            let is_sketch = options.least.is_infinite();
            let least = if is_sketch { options.least } else { 0.0 };
            let options = LayoutOptions {
                page,
                least,
                ..*options
            };
            let sub = Subplan::new(task.plan, task.part, space, |v| cut.space[v] == space);
            let (_, layout) = Draft::new(&sub.plan, &options)?.assembled(task.orientation);
            Some(Contents { sub, layout })
        };
        let each = |space: &usize| SHAPES.iter().map(|s| laid_out(*space, *s)).collect();
        let contents: Option<Vec<Vec<Contents>>> = cut.spaces.par_iter().map(each).collect();
        Some(Self {
            contents: contents?,
            task,
            cut,
        })
    }

    /// Keeps the drawing with the contents of each namespace in these shapes if it is better than the best so far. Many cannot be
    /// better than that or than `least`, which shows before their routes are connected.
    fn try_shapes(&self, shapes: &[usize], least: f64, best: &mut Option<Best>) {
        let old = best.as_ref().map_or(0.0, |best| best.quality);
        let draft = self.laid_out(shapes);
        let draft = draft.filter(|draft| self.hope(draft) > old.max(least));
        let placed = draft.and_then(|draft| self.connected(draft, false));
        let quality = placed.map_or(0.0, |placed| self.task.judged(&placed));
        if quality > old {
            let shapes = shapes.to_vec();
            *best = Some(Best { quality, shapes });
        }
    }

    /// The quality of a draft if no line crosses another and each is straight.
    fn hope(&self, draft: &PlacedPart) -> f64 {
        let apart = |(from, to): &(usize, usize)| {
            let (a, b) = (draft.boxes[*from], draft.boxes[*to]);
            let gap = Point::new(
                (b.x - a.right()).max(a.x - b.right()).max(0.0),
                (b.y - a.bottom()).max(a.y - b.bottom()).max(0.0),
            );
            gap.distance(Point::default())
        };
        let length = self.task.part.ends.iter().map(apart).sum();
        let size = turned(draft.size, self.task.orientation);
        self.task.quality(size, (0, length)) * ROUNDING
    }

    /// The part with the contents of each namespace in one of the shapes, x along and y across; routes between namespaces end at
    /// their frames.
    fn laid_out(&self, shapes: &[usize]) -> Option<PlacedPart> {
        let (PartTask { plan, part, .. }, cut) = (self.task, &self.cut);
        let chosen = self.contents.iter().zip(shapes);
        let chosen: Vec<&Contents> = chosen.map(|(all, shape)| &all[*shape]).collect();
        let frames = chosen.iter().zip(&cut.spaces).map(|(contents, space)| {
            let size = contents.layout.size;
            let inside = Rect::new(0.0, 0.0, size.w, size.h);
            plan.clusters[part.clusters[space - 1]].frame(inside, PADDING)
        });
        let frames: Vec<Rect> = frames.collect();
        let outer = cut.plan(plan, part, &frames);
        let draft = Draft::new(&outer, self.task.options)?;
        let (_, layout) = draft.assembled(self.task.orientation);
        let mut placed = PlacedPart::unplaced(part);
        let (spaces, free) = layout.boxes.split_at(frames.len());
        for (at, place) in spaces.iter().enumerate() {
            let by = Point::new(place.x - frames[at].x, place.y - frames[at].y);
            chosen[at].sub.put(&chosen[at].layout, by, &mut placed);
            placed.clusters[cut.spaces[at] - 1] = *place;
        }
        for (&v, at) in cut.free.iter().zip(free) {
            placed.boxes[v] = *at;
        }
        for (&link, route) in cut.between.iter().zip(layout.routes) {
            placed.routes[link] = route;
        }
        // The way between along and across and the page is the same in both directions.
        Some(placed.on_page(self.task.orientation))
    }

    /// The part with the routes between namespaces led on to their boxes, with `is_last` around words, too, if nothing is in the way
    /// there; on the page. `None` if one is blocked.
    fn connected(&self, mut placed: PlacedPart, is_last: bool) -> Option<PlacedPart> {
        let (PartTask { plan, part, .. }, cut) = (self.task, &self.cut);
        let routes = placed.routes.clone();
        let turns = cut.connect(plan, part, &mut placed, &[])?;
        let words = if is_last {
            self.words(&placed)
        } else {
            Vec::new()
        };
        if !words.is_empty() {
            let through = std::mem::replace(&mut placed.routes, routes);
            if cut.connect(plan, part, &mut placed, &words).is_none() {
                placed.routes = through;
            }
        }
        let lines: Vec<Line> = placed.routes.iter().map(Line::new).collect();
        placed.crossings = turns + crossings(&lines);
        for (at, link) in part.links.iter().enumerate() {
            let size = plan.links[*link].label;
            let size = size.map(|size| turned(size, self.task.orientation));
            let label = placed.routes[at].label.zip(size);
            let label = label.map(|(middle, size)| Rect::around(middle, size));
            let is_crossed = |label: Rect| {
                let mut others = lines.iter().enumerate();
                others.any(|(other, line)| other != at && line.meets(&label))
            };
            if label.is_some_and(is_crossed) {
                // It is placed elsewhere, once everything has its place.
                placed.routes[at].label = None;
            }
        }
        Some(placed.on_page(self.task.orientation))
    }

    /// The words at the bottom left of namespaces, x along the edges and y across.
    fn words(&self, placed: &PlacedPart) -> Vec<Rect> {
        let task = &self.task;
        let clusters = task.part.clusters.iter().zip(&placed.clusters);
        let words = clusters.map(|(&at, frame)| {
            let size = turned(task.plan.clusters[at].footer, task.orientation);
            let (x, y) = match task.orientation {
                Orientation::LeftRight => (frame.x + PADDING, frame.bottom() - size.h),
                Orientation::TopBottom => (frame.right() - size.w, frame.y + PADDING),
            };
            Rect::new(x, y, size.w, size.h)
        });
        words
            .filter(|words| words.w > 0.0 && words.h > 0.0)
            .collect()
    }
}

/// A part cut into its outermost namespaces; all indices refer to the part.
struct Cut {
    /// The outermost namespace of each vertex; 0 if it is in none.
    space: Vec<usize>,
    /// These namespaces.
    spaces: Vec<usize>,
    /// The vertices in none.
    free: Vec<usize>,
    /// The links that leave a namespace, or join vertices in none.
    between: Vec<usize>,
}

impl Cut {
    fn new(part: &Component) -> Option<Self> {
        let outermost = |home: &usize| around(&part.parent, *home).last().unwrap_or(0);
        let space: Vec<usize> = part.home.iter().map(outermost).collect();
        let spaces: BTreeSet<usize> = space.iter().copied().filter(|space| *space != 0).collect();
        let is_between = |link: &usize| {
            let (from, to) = part.ends[*link];
            space[from] == 0 || space[from] != space[to]
        };
        let between = (0..part.ends.len()).filter(is_between).collect();
        let free: Vec<usize> = (0..space.len()).filter(|v| space[*v] == 0).collect();
        let is_cut = spaces.len() > 1 || spaces.len() == 1 && !free.is_empty();
        is_cut.then(|| Self {
            spaces: spaces.into_iter().collect(),
            free,
            between,
            space,
        })
    }

    /// The plan with a box for each namespace, with these frames, then one for each vertex in none.
    fn plan(&self, plan: &Plan, part: &Component, frames: &[Rect]) -> Plan {
        let block = |frame: &Rect| Vertex {
            size: Size::new(frame.w, frame.h),
            outline: Outline::Box,
            cluster: None,
        };
        let free = self.free.iter();
        let free = free.map(|v| plan.vertices[part.vertices[*v]].clone());
        let of = |v: usize| {
            let block = self.spaces.binary_search(&self.space[v]);
            let free = |_| self.spaces.len() + self.free.partition_point(|other| *other < v);
            block.unwrap_or_else(free)
        };
        let link = |link: &usize| Link {
            from: of(part.ends[*link].0),
            to: of(part.ends[*link].1),
            ..plan.links[part.links[*link]]
        };
        Plan {
            vertices: frames.iter().map(block).chain(free).collect(),
            links: self.between.iter().map(link).collect(),
            clusters: Vec::new(),
            is_labelled: plan.is_labelled,
        }
    }

    /// Leads the routes between the blocks on to the boxes inside, around other boxes and `words`, x along the edges and y
    /// across. Returns how many turn there, which costs a reader as much as a crossing; `None` if one is blocked.
    fn connect(
        &self,
        plan: &Plan,
        part: &Component,
        placed: &mut PlacedPart,
        words: &[Rect],
    ) -> Option<u64> {
        let mut turns = 0;
        let mut map = Map::new(&[&placed.boxes, words].concat());
        let mut sides: BTreeMap<(usize, bool), Vec<Port>> = BTreeMap::new();
        for (link, &(from, to)) in part.ends.iter().enumerate() {
            let is_inner = self.between.binary_search(&link).is_err();
            for (v, is_end) in [(from, false), (to, true)] {
                let line = LineEnd { link, is_end };
                let (route, rect) = (line.route(placed), placed.boxes[v]);
                let first = route.curves.first().filter(|_| is_inner);
                let end = Port {
                    line,
                    is_inner,
                    aside: route.start.y - rect.centre().y,
                    height: first.map_or(route.start.y, |first| first[2].y),
                };
                // Lines around rows of boxes may meet their boxes from above or below.
                if self.space[v] != 0 && (!is_inner || end.aside.abs() <= rect.h * PORTS / 2.0) {
                    let is_after = route.start.x > rect.centre().x;
                    sides.entry((v, is_after)).or_default().push(end);
                }
            }
        }
        for ((v, _), mut ports) in sides {
            let end = End {
                at: v,
                rect: placed.boxes[v],
                outline: plan.vertices[part.vertices[v]].outline,
            };
            spread(&mut ports, end.rect.h * PORTS);
            for port in ports {
                let route = port.line.route(placed);
                let (route, is_level) = if port.is_inner {
                    (end.moved(&route, port.aside), true)
                } else {
                    map.led_on(&route, end, port.aside)?
                };
                port.line.set(placed, route);
                turns += u64::from(!is_level);
            }
        }
        Some(turns)
    }
}

/// An end of a line.
struct LineEnd {
    link: usize,
    /// Whether the line ends there; otherwise it begins there.
    is_end: bool,
}

impl LineEnd {
    /// The line's route from this end.
    fn route(&self, placed: &PlacedPart) -> Route {
        let route = &placed.routes[self.link];
        if self.is_end {
            route.backwards()
        } else {
            route.clone()
        }
    }

    /// Changes the line's route to this one from this end.
    fn set(&self, placed: &mut PlacedPart, route: Route) {
        placed.routes[self.link] = if self.is_end {
            route.backwards()
        } else {
            route
        };
    }
}

/// The port of a line at a box in a namespace.
struct Port {
    line: LineEnd,
    /// Whether the other end of the line is in the same namespace.
    is_inner: bool,
    /// Its distance from the middle of the side; at first, for a line from outside, that of the line at the frame.
    aside: f64,
    /// The height from which the line comes.
    height: f64,
}

/// Gives ports at one side of a box, of which the part for ports is `long`, their places: those of lines from outside side by side or,
/// where those of lines from inside are in the way, as close to the middle as possible. Only if there is no room, all move.
fn spread(ports: &mut Vec<Port>, long: f64) {
    ports.sort_by(|a, b| {
        let height = a.height.total_cmp(&b.height);
        height.then(a.aside.total_cmp(&b.aside))
    });
    // Lines that fork behind their port keep one.
    let is_one =
        |a: &Port, b: &Port| a.is_inner && b.is_inner && a.aside.total_cmp(&b.aside).is_eq();
    let many = ports.chunk_by(is_one).count();
    let step = PORT_STEP.min(long / many as f64);
    let side_by_side = |many: usize| {
        let middle = (many as f64 - 1.0) / 2.0;
        (0..many).map(move |nth| (nth as f64 - middle) * step)
    };
    let (inner, outer): (Vec<&Port>, Vec<&Port>) = ports.iter().partition(|port| port.is_inner);
    // Towards where they come from first.
    let side = outer.iter().map(|port| port.aside).sum::<f64>().signum();
    let shifts = (0..40_u32).map(|nth| f64::from(nth) * step / 4.0);
    let shifts = shifts.flat_map(|by| [by * side, -by * side]);
    let mut rows = shifts.map(|by| {
        side_by_side(outer.len())
            .map(|at| at + by)
            .collect::<Vec<f64>>()
    });
    let is_free = |at: &f64| {
        let is_apart = |port: &&Port| (port.aside - at).abs() >= step;
        at.abs() <= long / 2.0 && inner.iter().all(is_apart)
    };
    let places = if let Some(free) = rows.find(|places| places.iter().all(is_free)) {
        ports.retain(|port| !port.is_inner);
        free
    } else {
        side_by_side(many).collect()
    };
    for (same, place) in ports.chunk_by_mut(is_one).zip(places) {
        for port in same {
            port.aside = place;
        }
    }
}

/// A route in straight pieces, and its bounds.
struct Line {
    points: Vec<Point>,
    bounds: Rect,
}

impl Line {
    fn new(route: &Route) -> Self {
        let points = polyline(route.start, &route.curves, PIECES);
        let bounds = Rect::of_points(points.iter().copied()).unwrap_or_default();
        Self {
            points,
            bounds: bounds.grown(1.0),
        }
    }

    /// Its straight pieces near a rectangle.
    fn near(&self, rect: &Rect) -> impl Iterator<Item = [Point; 2]> {
        let is_near = self.bounds.overlaps(rect);
        let pieces = self.points.windows(2).map(|pair| [pair[0], pair[1]]);
        pieces.filter(move |_| is_near)
    }

    fn meets(&self, rect: &Rect) -> bool {
        self.near(rect).any(|[from, to]| meets(from, to, rect))
    }
}

/// The number of points at which lines cross each other.
fn crossings(lines: &[Line]) -> u64 {
    let mut crossings = 0;
    for (at, line) in lines.iter().enumerate() {
        for other in &lines[at + 1..] {
            for piece in line.near(&other.bounds) {
                let near = other.near(&line.bounds);
                crossings += near.filter(|other| crosses(piece, *other)).count() as u64;
            }
        }
    }
    crossings
}

/// Whether two straight pieces cross.
fn crosses([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let side = |p: Point, q: Point, r: Point| (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The places of ports for lines from these heights, inner ones at these places.
    fn spread(outer: &[f64], inner: &[(f64, f64)], long: f64) -> Vec<(bool, f64)> {
        let port = |height: f64, aside: f64, is_inner: bool| Port {
            line: LineEnd {
                link: 0,
                is_end: true,
            },
            is_inner,
            aside,
            height,
        };
        let outer = outer.iter().map(|height| port(*height, *height, false));
        let inner = inner.iter().map(|(height, at)| port(*height, *at, true));
        let mut ports = outer.chain(inner).collect();
        super::spread(&mut ports, long);
        let places = ports.iter().map(|port| (port.is_inner, port.aside));
        places.collect()
    }

    #[test]
    fn ports_of_a_box_are_apart_in_the_order_of_their_lines() {
        let free = spread(&[70.0, 20.0], &[(0.0, -20.0)], 50.0);
        assert_eq!(free, [(false, -4.5), (false, 4.5)]);
        let all = spread(&[70.0, -20.0], &[(0.0, -8.0), (90.0, 8.0)], 24.0);
        let places = [(false, -9.0), (true, -3.0), (false, 3.0), (true, 9.0)];
        assert_eq!(all, places);
        let beside = spread(&[-30.0], &[(0.0, 0.0)], 50.0);
        assert_eq!(beside, [(false, -9.0)]);
        let forked = spread(&[30.0], &[(0.0, 0.0), (5.0, 0.0)], 8.0);
        assert_eq!(forked, [(false, 4.0)]);
    }
}
