//! The parts of a plan: vertices joined by links, and those that share a namespace; and some vertices of a part as a plan.

use std::collections::{BTreeMap, BTreeSet};

use super::PlacedPart;
use crate::base::geometry::{Point, Rect};
use crate::layout::layers::common;
use crate::layout::{Cluster, Component, Layout, Link, Plan, Route, around};

/// The parts of a plan without links between them, in the order of their first vertices.
pub(crate) fn parts(plan: &Plan) -> Vec<Component> {
    let n = plan.vertices.len();
    let mut groups = DisjointSets::new(n + plan.clusters.len());
    for i in plan.valid_links() {
        groups.join(plan.links[i].from, plan.links[i].to);
    }
    // A second pass over the links alone finds the pieces within a part.
    let mut pieces = groups.clone();
    for (v, vertex) in plan.vertices.iter().enumerate() {
        if let Some(cluster) = vertex.cluster {
            groups.join(v, n + cluster);
        }
    }
    for (c, cluster) in plan.clusters.iter().enumerate() {
        if let Some(parent) = cluster.parent {
            groups.join(n + c, n + parent);
        }
    }
    let mut parts: BTreeMap<usize, Component> = BTreeMap::new();
    for v in 0..n {
        let part = parts.entry(groups.leader(v)).or_default();
        part.pieces.push(pieces.leader(v));
        part.vertices.push(v);
    }
    for i in plan.valid_links() {
        let leader = groups.leader(plan.links[i].from);
        parts.entry(leader).or_default().links.push(i);
    }
    let parts = parts.into_values();
    parts.map(|part| localised(plan, part)).collect()
}

/// The part with its ends, clusters and pieces as indices within it.
fn localised(plan: &Plan, mut part: Component) -> Component {
    let at = |v: usize| part.vertices.binary_search(&v).unwrap_or(0);
    let links = part.links.iter().map(|&i| &plan.links[i]);
    part.ends = links.map(|link| (at(link.from), at(link.to))).collect();
    part.pieces = part.pieces.iter().map(|&v| at(v)).collect();
    part.clusters = clusters_of(plan, &part.vertices);
    let number = |c: usize| part.clusters.binary_search(&c).map_or(0, |i| i + 1);
    let home = |&v: &usize| plan.vertices[v].cluster.map_or(0, number);
    let parent = |&c: &usize| plan.clusters[c].parent.map_or(0, number);
    part.home = part.vertices.iter().map(home).collect();
    let parents = part.clusters.iter().map(parent);
    part.parent = std::iter::once(0).chain(parents).collect();
    part
}

/// The clusters around these vertices, in the order of the plan.
fn clusters_of(plan: &Plan, vertices: &[usize]) -> Vec<usize> {
    let mut used = BTreeSet::new();
    for &v in vertices {
        let mut cluster = plan.vertices[v].cluster;
        while let Some(c) = cluster.filter(|&c| used.insert(c)) {
            cluster = plan.clusters[c].parent;
        }
    }
    used.into_iter().collect()
}

/// Disjoint sets of numbers.
#[derive(Clone)]
struct DisjointSets(Vec<usize>);

impl DisjointSets {
    fn new(n: usize) -> Self {
        Self((0..n).collect())
    }

    /// The least number in the set of `item`.
    fn leader(&mut self, mut item: usize) -> usize {
        while self.0[item] != item {
            self.0[item] = self.0[self.0[item]];
            item = self.0[item];
        }
        item
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.leader(a), self.leader(b));
        self.0[a.max(b)] = a.min(b);
    }
}

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
        let outer: BTreeSet<usize> = around(&part.parent, root).collect();
        let mut used = BTreeSet::new();
        for &v in &vertices {
            let own = around(&part.parent, part.home[v]);
            used.extend(own.filter(|c| !outer.contains(c)));
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
    /// The innermost cluster around everything; 0 if there is none.
    pub(crate) fn root(&self) -> usize {
        let homes = self.home.iter().copied();
        let root = homes.reduce(|root, home| common(&self.parent, root, home));
        root.unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::tests::{cluster, link, vertex};

    #[test]
    fn a_shared_namespace_joins_what_links_do_not() {
        let plan = Plan {
            vertices: vec![vertex(Some(0)), vertex(None), vertex(Some(1)), vertex(None)],
            links: vec![link(1, 3)],
            clusters: vec![cluster(None), cluster(Some(0))],
            ..Plan::default()
        };
        let parts = parts(&plan);
        let members: Vec<&[usize]> = parts.iter().map(|part| part.vertices.as_slice()).collect();
        assert_eq!(members, [&[0, 2][..], &[1, 3][..]]);
        assert_eq!(parts[0].pieces, [0, 1]);
        assert_eq!(parts[0].parent, [0, 0, 1]);
    }
}
