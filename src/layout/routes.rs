//! The route of each edge: level through every layer, bending only in the gaps between layers, so that it
//! cannot touch any other box.

pub(crate) mod around;

use super::{LayerItem, Layers, Outline, Route};
use crate::base::geometry::{Point, Size};

/// The distance of neighbouring ports, if the side of a box is long enough: the heads of arrows are 7 px wide, and closer
/// than 9 px they look like one.
pub(crate) const PORT_STEP: f64 = 9.0;
/// The share of a side that ports may take: beyond it a capsule's end is too round for a head.
pub(crate) const PORTS: f64 = 0.8;

/// The input of a router, with x along and y across: the placed vertices and the layers' extents.
pub(crate) struct RoutingPlane<'a> {
    /// The layered graph.
    pub(crate) layers: &'a Layers,
    /// The size of each vertex: along, across.
    pub(crate) size: &'a [Size],
    /// The outline of each vertex.
    pub(crate) outline: &'a [Outline],
    /// The middle of each item across.
    pub(crate) across: &'a [f64],
    /// The extent of each layer along.
    pub(crate) columns: &'a [(f64, f64)],
}

impl RoutingPlane<'_> {
    /// The middle of a vertex.
    pub(crate) fn centre(&self, v: usize) -> Point {
        let (start, end) = self.columns[self.layers.rank[v]];
        Point::new(f64::midpoint(start, end), self.across[v])
    }

    /// A route per edge, from its first end to its second.
    pub(crate) fn routes(&self, ends: &[(usize, usize)]) -> Vec<Route> {
        let ports = self.ports();
        let mut loops = vec![0; self.layers.vertices];
        let mut routes = Vec::with_capacity(ends.len());
        for (i, (chain, &(from, _))) in self.layers.chains.iter().zip(ends).enumerate() {
            routes.push(match chain.first() {
                None => {
                    loops[from] += 1;
                    self.self_loop(from, loops[from] - 1)
                }
                Some(&first) if first == from => self.route(chain, ports[i]),
                Some(_) => self.route(chain, ports[i]).backwards(),
            });
        }
        routes
    }

    /// A small arc at the side of a vertex, the later ones around the earlier.
    fn self_loop(&self, v: usize, before: usize) -> Route {
        let (centre, size) = (self.centre(v), self.size[v]);
        let half = (size.w / 6.0).min(7.0) + 3.0 * (before.min(4)) as f64;
        let half = half.min(size.w / 2.5);
        let foot = centre.y + self.rise(v, half);
        // A cubic reaches three quarters of the way to its controls.
        let top = centre.y + size.h / 2.0 + (10.0 + 6.0 * before as f64) / 0.75;
        let end = Point::new(centre.x + half, foot);
        let curve = [
            Point::new(centre.x - half, top),
            Point::new(centre.x + half, top),
            end,
        ];
        Route::new(Point::new(centre.x - half, foot), vec![curve])
    }

    /// The reach of a vertex's outline across from its middle, at a distance along.
    fn rise(&self, v: usize, along: f64) -> f64 {
        self.outline[v].reach(self.size[v].h, self.size[v].w, along)
    }

    /// The positions across at which each chain leaves its first vertex and enters its last.
    fn ports(&self) -> Vec<(f64, f64)> {
        let mut ports = vec![(0.0, 0.0); self.layers.chains.len()];
        let n = self.layers.vertices;
        let (mut leaving, mut entering) = (vec![Vec::new(); n], vec![Vec::new(); n]);
        for (i, chain) in self.layers.chains.iter().enumerate() {
            if let [first, second, ..] = chain[..] {
                leaving[first].push((second, i));
                let before = chain[chain.len() - 2];
                entering[chain[chain.len() - 1]].push((before, i));
            }
        }
        for v in 0..n {
            for (i, port) in self.spread(v, &mut leaving[v]) {
                ports[i].0 = port;
            }
            for (i, port) in self.spread(v, &mut entering[v]) {
                ports[i].1 = port;
            }
        }
        ports
    }

    /// Ports for chains at one side of a vertex, in the order of the positions they come from; the edges of a
    /// fork come from the same item and share one.
    fn spread(&self, v: usize, chains: &mut [(usize, usize)]) -> Vec<(usize, f64)> {
        chains.sort_by(|a, b| {
            let across = self.across[a.0].total_cmp(&self.across[b.0]);
            across.then(a.1.cmp(&b.1))
        });
        let is_bend = |item: usize| self.layers.kind[item] == LayerItem::Bend;
        let shares = |a: &(usize, usize), b: &(usize, usize)| a.0 == b.0 && is_bend(a.0);
        let ports: Vec<&[(usize, usize)]> = chains.chunk_by(shares).collect();
        let n = ports.len() as f64;
        let span = (self.size[v].h * PORTS).min(n * PORT_STEP);
        let port = |i: usize| self.across[v] + ((i as f64 + 0.5) / n - 0.5) * span;
        let ports = ports.iter().enumerate();
        ports
            .flat_map(|(i, chains)| chains.iter().map(move |&(_, chain)| (chain, port(i))))
            .collect()
    }

    /// The reach of a vertex's outline along from its middle, at a position across.
    fn reach(&self, v: usize, across: f64) -> f64 {
        self.outline[v].reach(self.size[v].w, self.size[v].h, across - self.across[v])
    }

    fn route(&self, chain: &[usize], (leave, enter): (f64, f64)) -> Route {
        let [first, .., last] = chain[..] else {
            return Route::default();
        };
        let mut pen = RoutePen::at(self.centre(first).x + self.reach(first, leave), leave);
        pen.level(self.columns[self.layers.rank[first]].1);
        for &bend in &chain[1..chain.len() - 1] {
            let (start, end) = self.columns[self.layers.rank[bend]];
            pen.bend(start, self.across[bend]);
            pen.level(end);
        }
        pen.bend(self.columns[self.layers.rank[last]].0, enter);
        pen.level(self.centre(last).x - self.reach(last, enter));
        pen.route
    }
}

/// A route being drawn piece by piece.
struct RoutePen {
    at: Point,
    route: Route,
    /// Whether the last piece is level and can be lengthened.
    is_level: bool,
}

impl RoutePen {
    fn at(x: f64, y: f64) -> Self {
        let at = Point::new(x, y);
        Self {
            at,
            route: Route::new(at, Vec::new()),
            is_level: false,
        }
    }

    /// Draws a level line to `x`.
    fn level(&mut self, x: f64) {
        if (x - self.at.x).abs() < 0.05 {
            return;
        }
        if self.is_level {
            self.route.curves.pop();
        }
        let last = self.route.curves.last();
        let from = last.map_or(self.route.start, |curve| curve[2]);
        let to = Point::new(x, self.at.y);
        let third = (to.x - from.x) / 3.0;
        self.route.curves.push([
            Point::new(from.x + third, from.y),
            Point::new(to.x - third, to.y),
            to,
        ]);
        self.at = to;
        self.is_level = true;
    }

    /// Draws a curve to `(x, y)`, level at both ends.
    fn bend(&mut self, x: f64, y: f64) {
        if (y - self.at.y).abs() < 0.05 {
            return self.level(x);
        }
        let middle = f64::midpoint(self.at.x, x);
        let to = Point::new(x, y);
        self.route
            .curves
            .push([Point::new(middle, self.at.y), Point::new(middle, y), to]);
        self.at = to;
        self.is_level = false;
    }
}
