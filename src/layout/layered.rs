//! The layered engine, step by step: components, cycles, ranks, order, places, routes, packing.
//!
//! It is the line through the other files of this folder, which is why it alone imports its siblings.

use super::pack::{fit, pack};
use super::route::Sheet;
use super::{Engine, Kind, Layers, Layout, Orientation, Plan, Route, Rows, Vertex, Wish};
use super::{acyclic, order, place, rank};
use crate::error::Result;
use crate::geometry::{Point, Rect, Size};

/// The room between vertices side by side, between bends, and around what a cluster holds.
const GAP: f64 = 12.0;
const BEND_GAP: f64 = 7.0;
const PADDING: f64 = 8.0;
/// The room between components.
const COMPONENT_GAP: f64 = 24.0;
/// The room that a self loop takes at its vertex.
const LOOP: f64 = 12.0;

/// The default engine.
pub(super) struct Layered;

impl Engine for Layered {
    fn lay_out(&self, plan: &Plan, wish: &Wish) -> Result<Layout> {
        Ok(lay_out(plan, wish))
    }
}

/// The layered layout of a sane plan.
pub(super) fn lay_out(plan: &Plan, wish: &Wish) -> Layout {
    let parts: Vec<Part> = components(plan)
        .into_iter()
        .map(|part| part.ordered(plan))
        .collect();
    let orientations = match wish.orientation {
        Some(orientation) => vec![orientation],
        None => vec![Orientation::LeftRight, Orientation::TopBottom],
    };
    orientations
        .into_iter()
        .map(|orientation| assemble(plan, wish, &parts, orientation))
        .map(|layout| (fit(layout.size, wish.page), layout))
        .reduce(|best, next| if next.0 > best.0 { next } else { best })
        .map_or_else(
            || assemble(plan, wish, &parts, Orientation::LeftRight),
            |best| best.1,
        )
}

/// Vertices that belong together, by links or by a shared namespace, with their links.
#[derive(Default)]
struct Part {
    vertices: Vec<usize>,
    links: Vec<usize>,
    /// The clusters of the plan that hold a vertex, parents first; cluster `i + 1` of the layers is `clusters[i]`.
    clusters: Vec<usize>,
    layers: Layers,
    rows: Rows,
    reversed: Vec<bool>,
}

fn components(plan: &Plan) -> Vec<Part> {
    let n = plan.vertices.len();
    let mut leader: Vec<usize> = (0..n + plan.clusters.len()).collect();
    let mut join = |a: usize, b: usize| {
        let (a, b) = (find(&mut leader, a), find(&mut leader, b));
        leader[a.max(b)] = a.min(b);
    };
    for i in plan.valid_links() {
        join(plan.links[i].from, plan.links[i].to);
    }
    for (v, vertex) in plan.vertices.iter().enumerate() {
        if let Some(cluster) = vertex.cluster {
            join(v, n + cluster);
        }
    }
    for (c, cluster) in plan.clusters.iter().enumerate() {
        if let Some(parent) = cluster.parent {
            join(n + c, n + parent);
        }
    }
    let mut parts: std::collections::BTreeMap<usize, Part> = std::collections::BTreeMap::new();
    for v in 0..n {
        parts
            .entry(find(&mut leader, v))
            .or_default()
            .vertices
            .push(v);
    }
    for i in plan.valid_links() {
        let part = parts
            .entry(find(&mut leader, plan.links[i].from))
            .or_default();
        part.links.push(i);
    }
    parts.into_values().collect()
}

fn find(leader: &mut [usize], mut item: usize) -> usize {
    while leader[item] != item {
        leader[item] = leader[leader[item]];
        item = leader[item];
    }
    item
}

impl Part {
    /// This part with its layers cut and sorted.
    fn ordered(mut self, plan: &Plan) -> Self {
        self.clusters = clusters_of(plan, &self.vertices);
        let mut local = vec![0; plan.vertices.len()];
        for (i, &v) in self.vertices.iter().enumerate() {
            local[v] = i;
        }
        let ends = |&i: &usize| (local[plan.links[i].from], local[plan.links[i].to]);
        let edges: Vec<(usize, usize)> = self.links.iter().map(ends).collect();
        let tries = [
            acyclic::in_order(self.vertices.len(), &edges),
            acyclic::greedy(self.vertices.len(), &edges),
        ];
        let mut best: Option<(u64, Layers, Rows, Vec<bool>)> = None;
        for reversed in tries {
            let layers = self.cut(plan, &edges, &reversed);
            let (rows, crossings) = order::order(&layers, 24);
            if best.as_ref().is_none_or(|best| crossings < best.0) {
                best = Some((crossings, layers, rows, reversed));
            }
        }
        if let Some((_, layers, rows, reversed)) = best {
            (self.layers, self.rows, self.reversed) = (layers, rows, reversed);
        }
        self
    }

    /// The layers of this part when these edges are reversed.
    fn cut(&self, plan: &Plan, edges: &[(usize, usize)], reversed: &[bool]) -> Layers {
        let turned: Vec<(usize, usize)> = edges
            .iter()
            .zip(reversed)
            .map(|(&(from, to), &turn)| if turn { (to, from) } else { (from, to) })
            .collect();
        let n = self.vertices.len();
        let place = |c: usize| {
            self.clusters
                .iter()
                .position(|&other| other == c)
                .map_or(0, |i| i + 1)
        };
        let home = |v: &usize| plan.vertices[*v].cluster.map_or(0, place);
        let parent = |c: &usize| plan.clusters[*c].parent.map_or(0, place);
        let rank = rank::ranks(n, &turned);
        let mut layers = Layers {
            vertices: n,
            kind: vec![Kind::Vertex; n],
            ranks: rank.iter().max().map_or(0, |r| r + 1),
            rank,
            home: self.vertices.iter().map(home).collect(),
            up: vec![Vec::new(); n],
            down: vec![Vec::new(); n],
            chains: Vec::new(),
            parent: std::iter::once(0)
                .chain(self.clusters.iter().map(parent))
                .collect(),
            span: Vec::new(),
            borders: Vec::new(),
        };
        layers.add_chains(&turned);
        layers.add_borders();
        layers
    }
}

/// The clusters around these vertices, in the order of the plan.
fn clusters_of(plan: &Plan, vertices: &[usize]) -> Vec<usize> {
    let mut used = std::collections::BTreeSet::new();
    for &v in vertices {
        let mut cluster = plan.vertices[v].cluster;
        while let Some(c) = cluster.filter(|&c| used.insert(c)) {
            cluster = plan.clusters[c].parent;
        }
    }
    used.into_iter().collect()
}

impl Layers {
    fn push(&mut self, kind: Kind, rank: usize, home: usize) -> usize {
        self.kind.push(kind);
        self.rank.push(rank);
        self.home.push(home);
        self.up.push(Vec::new());
        self.down.push(Vec::new());
        self.kind.len() - 1
    }

    fn link(&mut self, before: usize, after: usize) {
        self.down[before].push(after);
        self.up[after].push(before);
    }

    /// Leads every edge through the layers between its ends.
    fn add_chains(&mut self, edges: &[(usize, usize)]) {
        for &(from, to) in edges {
            let mut chain = Vec::new();
            if from != to {
                let home = self.shared_home(from, to);
                chain.push(from);
                for rank in self.rank[from] + 1..self.rank[to] {
                    let bend = self.push(Kind::Bend, rank, home);
                    self.link(chain[chain.len() - 1], bend);
                    chain.push(bend);
                }
                self.link(chain[chain.len() - 1], to);
                chain.push(to);
            }
            self.chains.push(chain);
        }
    }

    /// The innermost cluster around both.
    fn shared_home(&self, a: usize, b: usize) -> usize {
        let (mut a, mut b) = (self.home[a], self.home[b]);
        while a != b {
            // Parents have smaller numbers than their children.
            if a > b {
                a = self.parent[a];
            } else {
                b = self.parent[b];
            }
        }
        a
    }

    /// Puts a border of each cluster first and last into every layer that it spans.
    fn add_borders(&mut self) {
        self.span = vec![(usize::MAX, 0); self.parent.len()];
        for v in 0..self.vertices {
            let mut cluster = self.home[v];
            while cluster != 0 {
                let (low, high) = &mut self.span[cluster];
                *low = (*low).min(self.rank[v]);
                *high = (*high).max(self.rank[v]);
                cluster = self.parent[cluster];
            }
        }
        self.borders = vec![(0, 0)];
        for cluster in 1..self.parent.len() {
            let (low, high) = self.span[cluster];
            self.borders.push((self.kind.len(), self.kind.len() + 1));
            for rank in low..=high {
                let top = self.push(Kind::Top, rank, cluster);
                let bottom = self.push(Kind::Bottom, rank, cluster);
                if rank > low {
                    self.link(top - 2, top);
                    self.link(bottom - 2, bottom);
                }
            }
        }
    }
}

/// One part placed and routed, its top left corner at (0, 0), in the coordinates of the page.
struct Block {
    size: Size,
    boxes: Vec<Rect>,
    routes: Vec<Route>,
    clusters: Vec<Rect>,
}

fn assemble(plan: &Plan, wish: &Wish, parts: &[Part], orientation: Orientation) -> Layout {
    let blocks: Vec<Block> = parts
        .iter()
        .map(|part| Room::new(plan, part, orientation).block())
        .collect();
    let sizes: Vec<Size> = blocks.iter().map(|block| block.size).collect();
    let (corners, size) = pack(&sizes, wish.page, COMPONENT_GAP);
    let mut layout = Layout {
        orientation,
        size,
        boxes: vec![Rect::default(); plan.vertices.len()],
        routes: vec![Route::default(); plan.links.len()],
        clusters: vec![Rect::default(); plan.clusters.len()],
        remarks: Vec::new(),
    };
    for ((part, block), corner) in parts.iter().zip(blocks).zip(corners) {
        let moved = |r: &Rect| Rect::new(r.x + corner.x, r.y + corner.y, r.w, r.h);
        for (&v, at) in part.vertices.iter().zip(&block.boxes) {
            layout.boxes[v] = moved(at);
        }
        for (&c, at) in part.clusters.iter().zip(&block.clusters) {
            layout.clusters[c] = moved(at);
        }
        for (&i, route) in part.links.iter().zip(&block.routes) {
            layout.routes[i] = mapped(route, |p| Point::new(p.x + corner.x, p.y + corner.y));
        }
    }
    layout
}

fn mapped(route: &Route, f: impl Fn(Point) -> Point) -> Route {
    Route {
        start: f(route.start),
        curves: route.curves.iter().map(|curve| curve.map(&f)).collect(),
        label: route.label.map(&f),
    }
}

fn backwards(route: &Route) -> Route {
    let mut points: Vec<Point> = std::iter::once(route.start)
        .chain(route.curves.iter().flatten().copied())
        .rev()
        .collect();
    let rest = points.split_off(1);
    Route {
        start: points[0],
        curves: rest.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        label: route.label,
    }
}

/// One part on its way to coordinates: x along, y across.
struct Room<'a> {
    plan: &'a Plan,
    part: &'a Part,
    orientation: Orientation,
    size: Vec<Size>,
    /// How many self loops each vertex has.
    loops: Vec<usize>,
}

impl<'a> Room<'a> {
    fn new(plan: &'a Plan, part: &'a Part, orientation: Orientation) -> Self {
        let size = |v: &usize| turned(plan.vertices[*v].size, orientation);
        let mut loops = vec![0; part.vertices.len()];
        for (&i, chain) in part.links.iter().zip(&part.layers.chains) {
            if chain.is_empty() {
                let at = part.vertices.binary_search(&plan.links[i].from);
                loops[at.unwrap_or(0)] += 1;
            }
        }
        Self {
            plan,
            part,
            orientation,
            size: part.vertices.iter().map(size).collect(),
            loops,
        }
    }

    /// Half of what an item takes across.
    fn half(&self, item: usize) -> f64 {
        let layers = &self.part.layers;
        match layers.kind[item] {
            Kind::Vertex => self.size[item].h / 2.0 + self.loop_room(item),
            Kind::Bend => 0.5,
            Kind::Top => match self.orientation {
                Orientation::LeftRight => PADDING + self.title(layers.home[item]).h,
                Orientation::TopBottom => PADDING,
            },
            Kind::Bottom => PADDING,
        }
    }

    fn loop_room(&self, v: usize) -> f64 {
        if self.loops[v] == 0 {
            0.0
        } else {
            LOOP + 5.0 * (self.loops[v] - 1) as f64
        }
    }

    fn title(&self, cluster: usize) -> Size {
        self.plan.clusters[self.part.clusters[cluster - 1]].title
    }

    /// The distances between neighbours in every layer.
    fn apart(&self) -> Vec<Vec<f64>> {
        let layers = &self.part.layers;
        let mut apart = Vec::new();
        for row in &self.part.rows {
            let gaps = row.windows(2).map(|pair| {
                let bend = |v: usize| layers.kind[v] == Kind::Bend;
                let border = |v: usize| matches!(layers.kind[v], Kind::Top | Kind::Bottom);
                let gap = if bend(pair[0]) && bend(pair[1]) {
                    BEND_GAP
                } else if border(pair[0]) || border(pair[1]) {
                    BEND_GAP.min(4.0)
                } else {
                    GAP
                };
                self.border_half(pair[0], true) + self.border_half(pair[1], false) + gap
            });
            apart.push(gaps.collect());
        }
        if self.orientation == Orientation::TopBottom {
            self.widen_for_titles(&mut apart);
        }
        apart
    }

    /// Half of an item on one side; a border takes room only inside its cluster.
    fn border_half(&self, item: usize, after: bool) -> f64 {
        match self.part.layers.kind[item] {
            Kind::Top if !after => 0.0,
            Kind::Bottom if after => 0.0,
            _ => self.half(item),
        }
    }

    /// Keeps the borders of each cluster far enough apart for its title.
    fn widen_for_titles(&self, apart: &mut [Vec<f64>]) {
        let layers = &self.part.layers;
        for cluster in (1..layers.parent.len()).rev() {
            let row = &self.part.rows[layers.span[cluster].0];
            let (top, bottom) = layers.borders[cluster];
            let at = |item| row.iter().position(|&v| v == item);
            if let (Some(first), Some(last)) = (at(top), at(bottom)) {
                let gaps = &mut apart[layers.span[cluster].0][first..last];
                let missing = self.title(cluster).w + 2.0 * PADDING - gaps.iter().sum::<f64>();
                if let Some(gap) = gaps.last_mut() {
                    *gap += missing.max(0.0);
                }
            }
        }
    }

    /// The extent of every layer along.
    fn columns(&self, across: &[f64]) -> Vec<(f64, f64)> {
        let layers = &self.part.layers;
        let mut width = vec![0.0_f64; layers.ranks];
        for v in 0..layers.vertices {
            width[layers.rank[v]] = width[layers.rank[v]].max(self.size[v].w);
        }
        if self.orientation == Orientation::LeftRight {
            for cluster in 1..layers.parent.len() {
                let (low, high) = layers.span[cluster];
                if low == high {
                    width[low] = width[low].max(self.title(cluster).w);
                }
            }
        }
        let mut at = 0.0;
        let mut columns = Vec::new();
        for (rank, width) in width.into_iter().enumerate() {
            at += self.frames(rank, false);
            columns.push((at, at + width));
            at += width + self.frames(rank, true) + self.gap(rank, across);
        }
        columns
    }

    /// The room for cluster borders before or after a layer.
    fn frames(&self, rank: usize, after: bool) -> f64 {
        let layers = &self.part.layers;
        let mut most = 0.0_f64;
        for v in self.part.rows[rank]
            .iter()
            .filter(|&&v| v < layers.vertices)
        {
            most = most.max(self.frame_depth(layers.home[*v], rank, after));
        }
        most
    }

    /// How far the frames around `cluster` that begin (or end) in a layer stand from it.
    fn frame_depth(&self, mut cluster: usize, rank: usize, after: bool) -> f64 {
        let layers = &self.part.layers;
        let mut depth = 0.0;
        while cluster != 0 {
            let (low, high) = layers.span[cluster];
            if (after && high == rank) || (!after && low == rank) {
                depth += PADDING;
                if !after && self.orientation == Orientation::TopBottom {
                    depth += self.title(cluster).h;
                }
            }
            cluster = layers.parent[cluster];
        }
        depth
    }

    /// The room that edges need to bend after a layer.
    fn gap(&self, rank: usize, across: &[f64]) -> f64 {
        let layers = &self.part.layers;
        let (mut edges, mut steepest) = (0.0, 0.0_f64);
        for &v in &self.part.rows[rank] {
            if matches!(layers.kind[v], Kind::Vertex | Kind::Bend) {
                for &u in &layers.down[v] {
                    edges += 1.0;
                    steepest = steepest.max((across[v] - across[u]).abs());
                }
            }
        }
        30.0 + (edges * 0.6_f64).min(40.0) + (steepest * 0.1).min(60.0)
    }

    fn block(&self) -> Block {
        let layers = &self.part.layers;
        let across = place::place(layers, &self.part.rows, &self.apart());
        let columns = self.columns(&across);
        let vertex = |v: &usize| -> &Vertex { &self.plan.vertices[*v] };
        let outline: Vec<_> = self
            .part
            .vertices
            .iter()
            .map(|v| vertex(v).outline)
            .collect();
        let sheet = Sheet {
            layers,
            size: &self.size,
            outline: &outline,
            across: &across,
            columns: &columns,
        };
        let boxes: Vec<Rect> = (0..layers.vertices)
            .map(|v| Rect::around(sheet.centre(v), self.size[v]))
            .collect();
        let clusters = self.frames_around(&across, &columns);
        let routes: Vec<Route> = sheet.routes();
        self.finished(&boxes, routes, &clusters)
    }

    fn frames_around(&self, across: &[f64], columns: &[(f64, f64)]) -> Vec<Rect> {
        let layers = &self.part.layers;
        let frame = |cluster: usize| {
            let (low, high) = layers.span[cluster];
            let (top, bottom) = layers.borders[cluster];
            let depth = |rank: usize, after: bool| {
                let inside = (0..layers.vertices).filter(|&v| layers.rank[v] == rank);
                let mut most = 0.0_f64;
                for v in inside {
                    most = most.max(self.depth_within(layers.home[v], cluster, rank, after));
                }
                most
            };
            let start = columns[low].0 - depth(low, false);
            let end = columns[high].1 + depth(high, true);
            Rect::new(
                start,
                across[top],
                end - start,
                across[bottom] - across[top],
            )
        };
        (1..layers.parent.len()).map(frame).collect()
    }

    /// The depth of the frames from `inner` out to `outer`, 0 if `inner` is not inside it.
    fn depth_within(&self, inner: usize, outer: usize, rank: usize, after: bool) -> f64 {
        let layers = &self.part.layers;
        let mut cluster = inner;
        while cluster > outer {
            cluster = layers.parent[cluster];
        }
        if cluster != outer {
            return 0.0;
        }
        self.frame_depth(inner, rank, after) - self.frame_depth(layers.parent[outer], rank, after)
    }

    /// Turns everything to the page, moves it to (0, 0), and reverses the routes of reversed edges.
    fn finished(&self, boxes: &[Rect], mut routes: Vec<Route>, clusters: &[Rect]) -> Block {
        for (i, route) in routes.iter_mut().enumerate() {
            if self.part.layers.chains[i].is_empty() {
                let link = &self.plan.links[self.part.links[i]];
                let v = self.part.vertices.binary_search(&link.from).unwrap_or(0);
                *route = loop_route(&boxes[v]);
            } else if self.part.reversed[i] {
                *route = backwards(route);
            }
        }
        let everything = boxes.iter().chain(clusters).copied();
        let reach = routes.iter().flat_map(|route| {
            let points = std::iter::once(route.start).chain(route.curves.iter().flatten().copied());
            points
                .map(|p| Rect::new(p.x, p.y, 0.0, 0.0))
                .collect::<Vec<_>>()
        });
        let whole = everything
            .chain(reach)
            .reduce(|a, b| a.union(&b))
            .unwrap_or_default();
        let to_page = |p: Point| {
            let p = Point::new(p.x - whole.x, p.y - whole.y);
            match self.orientation {
                Orientation::LeftRight => p,
                Orientation::TopBottom => Point::new(p.y, p.x),
            }
        };
        let rect = |r: &Rect| {
            let corner = to_page(Point::new(r.x, r.y));
            let size = turned(Size::new(r.w, r.h), self.orientation);
            Rect::new(corner.x, corner.y, size.w, size.h)
        };
        Block {
            size: turned(Size::new(whole.w, whole.h), self.orientation),
            boxes: boxes.iter().map(rect).collect(),
            routes: routes.iter().map(|route| mapped(route, to_page)).collect(),
            clusters: clusters.iter().map(rect).collect(),
        }
    }
}

/// A small arc at the far side of its vertex across.
fn loop_route(at: &Rect) -> Route {
    let room = LOOP * 1.2;
    let (middle, bottom) = (at.centre().x, at.bottom());
    let half = (at.w / 4.0).min(10.0);
    Route {
        start: Point::new(middle - half, bottom - 0.5),
        curves: vec![[
            Point::new(middle - half, bottom + room),
            Point::new(middle + half, bottom + room),
            Point::new(middle + half, bottom - 0.5),
        ]],
        label: None,
    }
}

/// A size on the page as along and across, or back.
fn turned(size: Size, orientation: Orientation) -> Size {
    match orientation {
        Orientation::LeftRight => size,
        Orientation::TopBottom => Size::new(size.h, size.w),
    }
}
