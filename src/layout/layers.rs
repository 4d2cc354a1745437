//! A part cut into layers: long edges pass through the layers between their ends, clusters have borders in
//! each layer.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use crate::layout::{Component, LayerItem, Layers, Plan, around, first_bend};

/// The cluster in which a long edge passes a layer, besides the one around both of its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lane {
    /// No other.
    Outside,
    /// The one at its end, or else the one at its start, if that spans the layer.
    Inside,
}

/// The layers of a part with these ranks; an edge that runs against them is reversed.
pub(crate) fn cut(plan: &Plan, part: &Component, rank: &[usize], lane: Lane) -> Layers {
    let n = part.vertices.len();
    let mut layers = Layers {
        vertices: n,
        kind: vec![LayerItem::Vertex; n],
        rank: rank.to_vec(),
        home: part.home.clone(),
        up: vec![Vec::new(); n],
        down: vec![Vec::new(); n],
        parent: part.parent.clone(),
        span: spans(part, rank),
        ranks: rank.iter().max().map_or(0, |r| r + 1),
        ..Layers::default()
    };
    let mut stems = BTreeMap::new();
    for (&(from, to), link) in part.ends.iter().zip(&part.links) {
        let link = &plan.links[*link];
        let lane = if link.is_outside { Lane::Outside } else { lane };
        let is_forward = rank[from] < rank[to];
        let fork = link.fork.filter(|_| plan.is_labelled);
        let fork = fork.map(|fork| (fork, is_forward));
        let stem = fork.and_then(|fork| stems.get(&fork).copied());
        let chain = match rank[from].cmp(&rank[to]) {
            Ordering::Less => layers.chain((from, to), lane, is_forward, stem),
            Ordering::Greater => layers.chain((to, from), lane, is_forward, stem),
            Ordering::Equal => Vec::new(),
        };
        if let (Some(fork), Some(bend)) = (fork, first_bend(&chain, is_forward)) {
            stems.entry(fork).or_insert(bend);
        }
        layers.chains.push(chain);
    }
    layers.add_borders();
    layers
}

/// The innermost cluster around two clusters, by the one around each.
pub(crate) fn common(parent: &[usize], mut a: usize, mut b: usize) -> usize {
    while a != b {
        // Parents have smaller numbers than their children.
        if a > b {
            a = parent[a];
        } else {
            b = parent[b];
        }
    }
    a
}

/// The number of items that the layers would have.
pub(crate) fn items(part: &Component, rank: &[usize]) -> usize {
    let long = part
        .ends
        .iter()
        .map(|&(from, to)| rank[from].abs_diff(rank[to]));
    let bends = long.map(|ranks| ranks.saturating_sub(1));
    let spans = spans(part, rank).into_iter().skip(1);
    let borders = spans.map(|(low, high)| 2 * (high - low + 1));
    part.vertices.len() + bends.chain(borders).sum::<usize>()
}

/// The first and last rank in each cluster.
fn spans(part: &Component, rank: &[usize]) -> Vec<(usize, usize)> {
    let mut span = vec![(usize::MAX, 0); part.parent.len()];
    for (&home, &rank) in part.home.iter().zip(rank) {
        for cluster in around(&part.parent, home) {
            let (low, high) = &mut span[cluster];
            (*low, *high) = ((*low).min(rank), (*high).max(rank));
        }
    }
    span
}

impl Layers {
    fn push(&mut self, kind: LayerItem, rank: usize, home: usize) -> usize {
        self.kind.push(kind);
        self.rank.push(rank);
        self.home.push(home);
        self.up.push(Vec::new());
        self.down.push(Vec::new());
        self.kind.len() - 1
    }

    /// Joins two items, once.
    fn link(&mut self, before: usize, after: usize) {
        if self.kind[before] == LayerItem::Bend && self.down[before].contains(&after)
            || self.kind[after] == LayerItem::Bend && self.up[after].contains(&before)
        {
            return;
        }
        self.down[before].push(after);
        self.up[after].push(before);
    }

    /// Routes an edge from its earlier end to its later one, with a bend in every layer between; returns the
    /// items it passes. `stem` is the first bend of the edges of its fork, if an earlier one has it: it runs through that.
    fn chain(
        &mut self,
        (from, to): (usize, usize),
        lane: Lane,
        is_forward: bool,
        stem: Option<usize>,
    ) -> Vec<usize> {
        let shared = common(&self.parent, self.home[from], self.home[to]);
        let ranks = self.rank[from] + 1..self.rank[to];
        let first = if is_forward {
            ranks.start
        } else {
            ranks.end - 1
        };
        let mut chain = vec![from];
        for rank in ranks {
            if let Some(bend) = stem.filter(|_| rank == first) {
                self.link(chain[chain.len() - 1], bend);
                chain.push(bend);
                continue;
            }
            let home = match lane {
                Lane::Outside => shared,
                Lane::Inside => {
                    let spanning = |end| self.spanning(end, rank, shared);
                    spanning(to).or_else(|| spanning(from)).unwrap_or(shared)
                }
            };
            let bend = self.push(LayerItem::Bend, rank, home);
            self.link(chain[chain.len() - 1], bend);
            chain.push(bend);
        }
        self.link(chain[chain.len() - 1], to);
        chain.push(to);
        chain
    }

    /// The innermost cluster around an end, but inside `outer`, that spans a layer.
    fn spanning(&self, end: usize, rank: usize, outer: usize) -> Option<usize> {
        let mut inside =
            around(&self.parent, self.home[end]).take_while(|&cluster| cluster != outer);
        let spans =
            |cluster: &usize| self.span[*cluster].0 <= rank && rank <= self.span[*cluster].1;
        inside.find(spans)
    }

    /// Puts a border of each cluster first and last into every layer that it spans.
    fn add_borders(&mut self) {
        self.borders = vec![(0, 0)];
        for cluster in 1..self.parent.len() {
            let (low, high) = self.span[cluster];
            self.borders.push((self.kind.len(), self.kind.len() + 1));
            for rank in low..=high {
                let top = self.push(LayerItem::Top, rank, cluster);
                let bottom = self.push(LayerItem::Bottom, rank, cluster);
                if rank > low {
                    self.link(top - 2, top);
                    self.link(bottom - 2, bottom);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::Link;
    use crate::layout::tests::link;

    #[test]
    fn a_long_edge_bends_in_every_layer_between() {
        let part = Component {
            vertices: vec![0, 1, 2],
            links: vec![0, 1, 2],
            ends: vec![(0, 1), (1, 2), (2, 0)],
            home: vec![0; 3],
            parent: vec![0],
            ..Component::default()
        };
        let plan = Plan {
            links: vec![link(0, 1), link(1, 2), link(2, 0)],
            ..Plan::default()
        };
        let layers = cut(&plan, &part, &[0, 1, 2], Lane::Outside);
        assert_eq!(layers.chains, [vec![0, 1], vec![1, 2], vec![0, 3, 2]]);
        assert_eq!(layers.kind[3], LayerItem::Bend);
    }

    #[test]
    fn edges_of_a_fork_share_the_bend_with_their_label() {
        let fork = |from, to| Link {
            fork: Some(7),
            ..link(from, to)
        };
        let plan = Plan {
            links: vec![fork(0, 1), fork(0, 2), fork(0, 3)],
            is_labelled: true,
            ..Plan::default()
        };
        let part = Component {
            vertices: vec![0, 1, 2, 3],
            links: vec![0, 1, 2],
            ends: vec![(0, 1), (0, 2), (0, 3)],
            home: vec![0; 4],
            parent: vec![0],
            ..Component::default()
        };
        let layers = cut(&plan, &part, &[2, 4, 6, 0], Lane::Outside);
        // The third runs against the ranks.
        let want = [vec![0, 4, 1], vec![0, 4, 5, 6, 2], vec![3, 7, 0]];
        assert_eq!(layers.chains, want);
        assert_eq!(layers.down[0], [4]);
        assert_eq!(layers.down[4], [1, 5]);
    }
}
