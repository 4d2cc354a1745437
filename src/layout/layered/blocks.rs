//! A part as blocks: the contents of each outermost namespace are laid out by themselves, then the namespaces as boxes.
//!
//! Layers that run through all namespaces spread each over as many columns as lie between its first box and its last; a
//! block is as compact as its own contents allow.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::parts::Subplan;
use super::{Draft, PlacedPart};
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
/// on pages of one shape, and for a drawing that fills the page, each in its own. `None` if it has no
/// namespace or only one around everything, or something is too large.
pub(crate) fn best(task: PartTask<'_>) -> Option<(f64, PlacedPart)> {
    let blocks = Blocks::new(task)?;
    let judged = |shapes: Vec<usize>| {
        let placed = blocks.placed(&shapes)?;
        Some((task.judged(&placed), placed, shapes))
    };
    let better = |best: (f64, PlacedPart, Vec<usize>), next: (f64, PlacedPart, Vec<usize>)| {
        if next.0 > best.0 { next } else { best }
    };
    let many = blocks.contents.len();
    let equal = (0..SHAPES.len()).map(|shape| vec![shape; many]);
    let mut best = equal.filter_map(judged).reduce(better)?;
    for at in (0..many).filter(|_| task.options.is_tight) {
        for shape in 0..SHAPES.len() {
            let mut shapes = best.2.clone();
            if blocks.contents[at][shape].layout.size != blocks.contents[at][shapes[at]].layout.size
            {
                shapes[at] = shape;
                best = judged(shapes).into_iter().fold(best, better);
            }
        }
    }
    Some((best.0, best.1))
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

    /// The part with the contents of each namespace in one of the shapes; `None` if a route is blocked.
    fn placed(&self, shapes: &[usize]) -> Option<PlacedPart> {
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
        let mut placed = placed.on_page(self.task.orientation);
        let routes = placed.routes.clone();
        let turns = cut.connect(plan, part, &mut placed, &[])?;
        // Around words as well, if nothing is in the way there: that is no reason to prefer another drawing.
        let words = self.words(&placed);
        let through = std::mem::replace(&mut placed.routes, routes);
        if words.is_empty() || cut.connect(plan, part, &mut placed, &words).is_none() {
            placed.routes = through;
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
        // The ports of lines inside of a namespace, on each side of its boxes.
        let mut taken: BTreeMap<(usize, bool), Vec<f64>> = BTreeMap::new();
        let inside = (0..part.ends.len()).filter(|link| self.between.binary_search(link).is_err());
        for (route, (from, to)) in inside.map(|link| (&placed.routes[link], part.ends[link])) {
            let end = route.points().next_back().unwrap_or(route.start);
            for (v, port) in [(from, route.start), (to, end)] {
                let centre = placed.boxes[v].centre();
                let ports = taken.entry((v, port.x > centre.x)).or_default();
                ports.push(port.y - centre.y);
            }
        }
        for is_end in [true, false] {
            let mut sides: BTreeMap<(usize, bool), Vec<usize>> = BTreeMap::new();
            for &link in &self.between {
                let (from, to) = part.ends[link];
                let v = if is_end { to } else { from };
                placed.routes[link] = placed.routes[link].backwards();
                if self.space[v] != 0 {
                    let is_after = placed.routes[link].start.x > placed.boxes[v].centre().x;
                    sides.entry((v, is_after)).or_default().push(link);
                }
            }
            for ((v, is_after), mut links) in sides {
                let y = |link: &usize| placed.routes[*link].start.y;
                links.sort_by(|a, b| y(a).total_cmp(&y(b)).then(a.cmp(b)));
                let end = End {
                    at: v,
                    rect: placed.boxes[v],
                    outline: plan.vertices[part.vertices[v]].outline,
                };
                let taken = taken.get(&(v, is_after)).map_or(&[][..], Vec::as_slice);
                let ports = ports(links.len(), taken, end.rect.h * PORTS);
                for (link, aside) in links.into_iter().zip(ports) {
                    let (route, is_level) = map.led_on(&placed.routes[link], end, aside)?;
                    placed.routes[link] = route;
                    turns += u64::from(!is_level);
                }
            }
        }
        Some(turns)
    }
}

/// The distances of new ports from the middle of a side, on the part of it for ports, which is `long`: side by side, or where
/// those that are `taken` are in the way, the places closest to the middle.
fn ports(many: usize, taken: &[f64], long: f64) -> Vec<f64> {
    let step = PORT_STEP.min(long / (many + taken.len()) as f64);
    let beside = (0..many).map(|nth| (nth as f64 - (many as f64 - 1.0) / 2.0) * step);
    let is_free = |all: &[f64], at: f64| all.iter().all(|port| (port - at).abs() >= step);
    let is_clear = beside.clone().all(|at| is_free(taken, at));
    let near = (0..40_u32).map(|nth| f64::from(nth) * step / 4.0);
    let near = near
        .flat_map(|at| [at, -at])
        .filter(|at| at.abs() <= long / 2.0 && !is_clear);
    let mut all = taken.to_vec();
    for at in near {
        if all.len() < many + taken.len() && is_free(&all, at) {
            all.push(at);
        }
    }
    let mut ports = all.split_off(taken.len());
    ports.sort_by(f64::total_cmp);
    if ports.len() == many {
        ports
    } else {
        beside.collect()
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
