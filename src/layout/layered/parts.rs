//! The parts of a plan: vertices joined by links, and those that share a namespace.

use std::collections::{BTreeMap, BTreeSet};

use crate::layout::{Component, Plan};

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
    parts
        .into_values()
        .map(|part| localised(plan, part))
        .collect()
}

/// The part with its ends, clusters and pieces as indices within it.
fn localised(plan: &Plan, mut part: Component) -> Component {
    let at = |v: usize| part.vertices.binary_search(&v).unwrap_or(0);
    part.ends = part
        .links
        .iter()
        .map(|&i| (at(plan.links[i].from), at(plan.links[i].to)))
        .collect();
    part.pieces = part.pieces.iter().map(|&v| at(v)).collect();
    part.clusters = clusters_of(plan, &part.vertices);
    let number = |c: usize| part.clusters.binary_search(&c).map_or(0, |i| i + 1);
    let home = |&v: &usize| plan.vertices[v].cluster.map_or(0, number);
    let parent = |&c: &usize| plan.clusters[c].parent.map_or(0, number);
    part.home = part.vertices.iter().map(home).collect();
    part.parent = std::iter::once(0)
        .chain(part.clusters.iter().map(parent))
        .collect();
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
