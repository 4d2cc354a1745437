//! Folds crowded layers: where few subscribers are known, most nodes would be in one layer and most topics in
//! the next; sources move to later layers, more of them if the page has the space.

use super::rank::neighbours;
use crate::base::cast;

/// The leaves of a hub that are seen at a glance in one layer.
const FEWEST_IN_LAYER: usize = 6;

/// Ranks with at least `layers` layers and the sources spread evenly over them; `None` if there is nothing to spread.
///
/// A source is a vertex without predecessors; it may move as far back as its longest path allows. `home` is
/// the cluster of each vertex: sources of one cluster move together if that has no cost. The edges must not
/// form a cycle.
pub(crate) fn fold(
    rank: &[usize],
    edges: &[(usize, usize)],
    home: &[usize],
    layers: usize,
) -> Option<Vec<usize>> {
    let deep = rank.iter().max().map_or(0, |r| r + 1);
    if deep < 2 {
        return None;
    }
    let layers = layers.max(deep);
    let graph = Adjacency::new(rank, edges);
    let mut load = vec![0_usize; layers + 1];
    for v in (0..rank.len()).filter(|&v| !graph.is_source(v) && !graph.is_leaf(v)) {
        load[rank[v]] += 1;
    }
    let mut sources: Vec<usize> = (0..rank.len()).filter(|&v| graph.is_source(v)).collect();
    sources.sort_by_key(|&v| (usize::MAX - graph.depth[v], home[v], v));
    let mut folded = vec![0; rank.len()];
    for source in sources {
        let leaves = graph.leaves(source);
        let last = layers - 1 - graph.depth[source];
        let worst = |r: usize| (load[r] + 1).max(load[r + 1] + leaves);
        let at = (0..=last).min_by_key(|&r| (worst(r), r)).unwrap_or(0);
        load[at] += 1;
        load[at + 1] += leaves;
        folded[source] = at;
    }
    for &v in graph.order.iter().filter(|&&v| !graph.is_source(v)) {
        let before = graph.before[v].iter().map(|&u| folded[u] + 1);
        folded[v] = before.max().unwrap_or(0);
    }
    // The leaves of a hub stand in several layers, as full as the others.
    let most = rank.len().div_ceil(layers - 1).max(FEWEST_IN_LAYER);
    let is_crowded = |v: &usize| graph.leaves(graph.before[*v][0]) > most;
    let leaves = (0..rank.len()).filter(|&v| graph.is_leaf(v));
    let mut filled = vec![0; layers];
    for v in leaves.filter(is_crowded) {
        let layer = (folded[v]..layers).find(|layer| filled[*layer] < most);
        folded[v] = layer.unwrap_or(folded[v]);
        filled[folded[v]] += 1;
    }
    Some(squeezed(&folded))
}

/// The suitable numbers of layers for `n` boxes on a page of this aspect ratio (width by height), with edges
/// from left to right and from top to bottom. A box with the gap behind it is about five times as long as it
/// is high, and one and a half times as wide as the distance between layers below each other.
pub(crate) fn suitable(n: usize, aspect: f64) -> [usize; 2] {
    let n = n as f64;
    let layers = |square: f64| cast::to_usize(square.clamp(1.0, 1e6).sqrt().round());
    [layers(aspect * n / 5.0), layers(1.5 * n / aspect.max(0.01))]
}

/// The edges both ways, and the longest path behind each vertex.
struct Adjacency {
    before: Vec<Vec<usize>>,
    after: Vec<Vec<usize>>,
    depth: Vec<usize>,
    /// The vertices by rank, along the edges.
    order: Vec<usize>,
}

impl Adjacency {
    fn new(rank: &[usize], edges: &[(usize, usize)]) -> Self {
        let n = rank.len();
        let (before, after) = neighbours(n, edges);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|&v| (rank[v], v));
        let mut depth = vec![0; n];
        for &v in order.iter().rev() {
            depth[v] = after[v]
                .iter()
                .map(|&u: &usize| depth[u] + 1)
                .max()
                .unwrap_or(0);
        }
        Self {
            before,
            after,
            depth,
            order,
        }
    }

    fn is_source(&self, v: usize) -> bool {
        self.before[v].is_empty()
    }

    /// Whether a vertex has a single source and no outgoing edge.
    fn is_leaf(&self, v: usize) -> bool {
        self.after[v].is_empty()
            && self.before[v].split_first().is_some_and(|(first, rest)| {
                self.is_source(*first) && rest.iter().all(|u| u == first)
            })
    }

    fn leaves(&self, source: usize) -> usize {
        self.after[source]
            .iter()
            .filter(|&&v| self.is_leaf(v))
            .count()
    }
}

/// The same ranks without empty ones.
fn squeezed(rank: &[usize]) -> Vec<usize> {
    let mut used: Vec<usize> = rank.to_vec();
    used.sort_unstable();
    used.dedup();
    rank.iter()
        .map(|r| used.partition_point(|u| u < r))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `n` sources with a leaf each, all of them with an edge to one more topic.
    fn stars(n: usize) -> (Vec<usize>, Vec<(usize, usize)>) {
        let hub = 2 * n;
        let edges = (0..n).flat_map(|k| [(k, n + k), (k, hub)]).collect();
        let rank = (0..=hub).map(|v| usize::from(v >= n)).collect();
        (rank, edges)
    }

    #[test]
    fn stars_are_spread_over_the_layers() {
        let (rank, edges) = stars(12);
        let folded = fold(&rank, &edges, &[0; 25], 6).unwrap();
        assert!(edges.iter().all(|&(from, to)| folded[from] < folded[to]));
        let widest = (0..6)
            .map(|r| folded.iter().filter(|f| **f == r).count())
            .max();
        assert!(widest <= Some(6), "{folded:?}");
        assert!(
            folded[..12]
                .iter()
                .zip(&folded[12..24])
                .all(|(node, topic)| node + 1 == *topic)
        );
    }

    #[test]
    fn leaves_of_a_hub_stand_in_several_layers() {
        let rank: Vec<usize> = (0..41).map(|v| usize::from(v > 0)).collect();
        let edges: Vec<(usize, usize)> = (1..41).map(|leaf| (0, leaf)).collect();
        let folded = fold(&rank, &edges, &[0; 41], 6).unwrap();
        let count = |layer: usize| folded.iter().filter(|f| **f == layer).count();
        let counts: Vec<usize> = (0..6).map(count).collect();
        assert_eq!(counts, [1, 9, 9, 9, 9, 4]);
        // Six are seen at a glance.
        assert_eq!(
            fold(&rank[..7], &edges[..6], &[0; 7], 6).unwrap(),
            rank[..7]
        );
    }

    #[test]
    fn a_deep_graph_is_not_wrapped() {
        let edges = [(0, 1), (1, 2), (2, 3)];
        assert_eq!(
            fold(&[0, 1, 2, 3], &edges, &[0; 4], 3),
            Some(vec![0, 1, 2, 3])
        );
        assert_eq!(fold(&[0, 0], &[], &[0; 2], 3), None);
    }

    #[test]
    fn wide_pages_suit_more_layers_from_left_to_right() {
        assert_eq!(suitable(100, 2.0), [6, 9]);
        assert_eq!(suitable(0, 0.0), [1, 1]);
    }
}
