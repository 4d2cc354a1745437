//! Some vertices of a part as a separate plan, and the conversion back.

use std::collections::BTreeSet;

use crate::base::geometry::{Point, Rect};
use crate::layout::layers::common;
use crate::layout::{Cluster, Component, Layout, Link, Plan, Route};

use super::PlacedPart;

/// A plan made of some vertices of a part, the links among them, and the clusters around them below a common
/// one. All indices refer to the part.
pub(crate) struct Subplan {
    pub(crate) plan: Plan,
    vertices: Vec<usize>,
    links: Vec<usize>,
    clusters: Vec<usize>,
}

impl Subplan {
    /// The vertices that `is_in` chooses, without `root` and the clusters around it.
    pub(crate) fn new(
        plan: &Plan,
        part: &Component,
        root: usize,
        is_in: impl Fn(usize) -> bool,
    ) -> Self {
        let vertices: Vec<usize> = (0..part.vertices.len()).filter(|&v| is_in(v)).collect();
        let at = |v: usize| vertices.binary_search(&v).ok();
        let ends = |(from, to): (usize, usize)| Some((at(from)?, at(to)?));
        let (mut links, mut drawn) = (Vec::new(), Vec::new());
        for (link, &both) in part.ends.iter().enumerate() {
            if let Some((from, to)) = ends(both) {
                links.push(link);
                drawn.push(Link {
                    from,
                    to,
                    ..plan.links[part.links[link]]
                });
            }
        }
        let outer: BTreeSet<usize> = part.around(root).collect();
        let mut used = BTreeSet::new();
        for &v in &vertices {
            used.extend(part.around(part.home[v]).filter(|c| !outer.contains(c)));
        }
        let clusters: Vec<usize> = used.into_iter().collect();
        let number = |c: usize| clusters.binary_search(&c).ok();
        let vertex = |&v: &usize| {
            let mut vertex = plan.vertices[part.vertices[v]].clone();
            vertex.cluster = number(part.home[v]);
            vertex
        };
        let cluster = |&c: &usize| Cluster {
            parent: number(part.parent[c]),
            ..plan.clusters[part.clusters[c - 1]]
        };
        Self {
            plan: Plan {
                vertices: vertices.iter().map(vertex).collect(),
                links: drawn,
                clusters: clusters.iter().map(cluster).collect(),
                is_labelled: plan.is_labelled,
            },
            vertices,
            links,
            clusters,
        }
    }

    /// Copies a layout of this plan into the part, moved by `by`.
    pub(crate) fn put(&self, layout: &Layout, by: Point, part: &mut PlacedPart) {
        for (&v, at) in self.vertices.iter().zip(&layout.boxes) {
            part.boxes[v] = at.moved(by);
        }
        for (&c, at) in self.clusters.iter().zip(&layout.clusters) {
            part.clusters[c - 1] = at.moved(by);
        }
        for (&link, route) in self.links.iter().zip(&layout.routes) {
            part.routes[link] = route.moved(by);
        }
    }
}

impl PlacedPart {
    /// A part without any placement yet.
    pub(crate) fn unplaced(part: &Component) -> Self {
        Self {
            boxes: vec![Rect::default(); part.vertices.len()],
            routes: vec![Route::default(); part.links.len()],
            clusters: vec![Rect::default(); part.clusters.len()],
            ..Self::default()
        }
    }
}

impl Component {
    /// A cluster and those around it, the innermost first, without the outside.
    pub(crate) fn around(&self, cluster: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(cluster), |&c| Some(self.parent[c])).take_while(|&c| c != 0)
    }

    /// The innermost cluster around everything; 0 if there is none.
    pub(crate) fn root(&self) -> usize {
        let homes = self.home.iter().copied();
        let root = homes.reduce(|root, home| common(&self.parent, root, home));
        root.unwrap_or(0)
    }
}
