//! The layer of each vertex: edges reversed until no cycle remains, longest paths, then a move within the slack towards the
//! side with more edges; crowded layers are folded.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use crate::base::cast;

/// The largest number of passes in which vertices move; each only shortens edges. Without any, there are 6 % more crossings; in all
/// drawings measured, the second one moves nothing.
const PASSES: usize = 30;

/// A rank for each of `n` vertices, counted from 0 and ascending along every edge. The edges must not form a
/// cycle.
pub(crate) fn ranks(n: usize, edges: &[(usize, usize)]) -> Vec<usize> {
    let (before, after) = neighbours(n, edges);
    let (mut rank, order) = longest_paths(&after, &before);
    for _ in 0..PASSES {
        let slide = |v: &&usize| slide(**v, &after, &before, &mut rank);
        if order.iter().rev().filter(slide).count() == 0 {
            break;
        }
    }
    let least = rank.iter().min().copied().unwrap_or(0);
    rank.iter().map(|r| r - least).collect()
}

/// The vertices before and after each of `n` vertices, in the order of the edges and without itself.
pub(crate) fn neighbours(n: usize, edges: &[(usize, usize)]) -> (Vec<Vec<usize>>, Vec<Vec<usize>>) {
    let (mut before, mut after) = (vec![Vec::new(); n], vec![Vec::new(); n]);
    for &(from, to) in edges.iter().filter(|(from, to)| from != to) {
        after[from].push(to);
        before[to].push(from);
    }
    (before, after)
}

/// These edges with some reversed.
pub(crate) fn turned(edges: &[(usize, usize)], reversed: &[bool]) -> Vec<(usize, usize)> {
    let turn =
        |(&(from, to), &turn): (&(usize, usize), &bool)| if turn { (to, from) } else { (from, to) };
    edges.iter().zip(reversed).map(turn).collect()
}

/// The length of the longest path to each vertex, and the vertices sorted along the edges.
fn longest_paths(after: &[Vec<usize>], before: &[Vec<usize>]) -> (Vec<usize>, Vec<usize>) {
    let n = after.len();
    let mut rank = vec![0; n];
    let mut waiting: Vec<usize> = before.iter().map(Vec::len).collect();
    let mut order: Vec<usize> = (0..n).filter(|&v| waiting[v] == 0).collect();
    let mut next = 0;
    while next < order.len() {
        let v = order[next];
        next += 1;
        for &u in &after[v] {
            rank[u] = rank[u].max(rank[v] + 1);
            waiting[u] -= 1;
            if waiting[u] == 0 {
                order.push(u);
            }
        }
    }
    (rank, order)
}

/// Moves one vertex to the end of its slack that shortens more edges; returns whether it moved.
fn slide(v: usize, after: &[Vec<usize>], before: &[Vec<usize>], rank: &mut [usize]) -> bool {
    let low = before[v].iter().map(|&u| rank[u] + 1).max();
    let high = after[v].iter().map(|&u| rank[u].saturating_sub(1)).min();
    let to = match (low, high) {
        (Some(low), Some(high)) => match before[v].len().cmp(&after[v].len()) {
            std::cmp::Ordering::Less => high,
            std::cmp::Ordering::Greater => low,
            std::cmp::Ordering::Equal => rank[v].clamp(low, high.max(low)),
        },
        (Some(low), None) => low,
        (None, Some(high)) => high,
        (None, None) => rank[v],
    };
    let moved = to != rank[v];
    rank[v] = to;
    moved
}

// The choice of edges to reverse so that no cycle remains.

/// The edges to reverse when each edge in turn is reversed if and only if it closes a cycle with those before it.
pub(crate) fn in_order(n: usize, edges: &[(usize, usize)]) -> Vec<bool> {
    let mut after: Vec<Vec<usize>> = vec![Vec::new(); n];
    let mut seen = vec![usize::MAX; n];
    let mut reversed = vec![false; edges.len()];
    for (i, &(from, to)) in edges.iter().enumerate() {
        if from == to {
            continue;
        }
        reversed[i] = reaches(&after, to, from, &mut seen, i);
        let (from, to) = if reversed[i] { (to, from) } else { (from, to) };
        after[from].push(to);
    }
    reversed
}

/// Whether a path leads from `start` to `goal`; `seen` contains the round in which an item was last visited.
fn reaches(
    after: &[Vec<usize>],
    start: usize,
    goal: usize,
    seen: &mut [usize],
    round: usize,
) -> bool {
    let mut stack = vec![start];
    seen[start] = round;
    while let Some(item) = stack.pop() {
        if item == goal {
            return true;
        }
        for &next in &after[item] {
            if seen[next] != round {
                seen[next] = round;
                stack.push(next);
            }
        }
    }
    false
}

/// The edges to reverse when all edges between two clusters must run one way; pairs with more edges choose first.
/// `home` is the innermost cluster of each item, `parent` the cluster around each, with 0 for the outside.
pub(crate) fn by_cluster(edges: &[(usize, usize)], home: &[usize], parent: &[usize]) -> Vec<bool> {
    let sides = edges.iter();
    let sides: Vec<(usize, usize)> = sides.map(|&ends| parting(ends, home, parent)).collect();
    let mut pairs: BTreeMap<(usize, usize), (Reverse<usize>, usize)> = BTreeMap::new();
    for (i, &pair) in sides.iter().enumerate() {
        pairs.entry(pair).or_insert((Reverse(0), i)).0.0 += 1;
    }
    let mut order: Vec<_> = pairs.into_iter().collect();
    order.sort_by_key(|&(_, rank)| rank);
    let pairs: Vec<(usize, usize)> = order.into_iter().map(|(pair, _)| pair).collect();
    let turns = in_order(home.len() + parent.len(), &pairs);
    let turn: BTreeMap<_, _> = pairs.into_iter().zip(turns).collect();
    let turns = sides.iter().map(|pair| turn.get(pair).copied());
    turns.map(Option::unwrap_or_default).collect()
}

/// The two units that an edge leaves and enters inside the innermost cluster around both of its ends: each a
/// vertex `v`, or a cluster `c` given as `home.len() + c`.
fn parting((from, to): (usize, usize), home: &[usize], parent: &[usize]) -> (usize, usize) {
    let (mut a, mut b) = ((from, home[from]), (to, home[to]));
    while a.1 != b.1 {
        // Parents have smaller numbers than their children.
        let deeper = if a.1 > b.1 { &mut a } else { &mut b };
        *deeper = (home.len() + deeper.1, parent[deeper.1]);
    }
    (a.0, b.0)
}

/// The edges to reverse by the greedy order of Eades, Lin and Smyth (1993): sinks last, sources first, then
/// the vertex with the largest surplus of outgoing edges.
pub(crate) fn greedy(n: usize, edges: &[(usize, usize)]) -> Vec<bool> {
    let place = greedy_order(n, edges);
    let edges = edges.iter();
    edges.map(|&(from, to)| place[from] > place[to]).collect()
}

fn greedy_order(n: usize, edges: &[(usize, usize)]) -> Vec<usize> {
    let (before, after) = neighbours(n, edges);
    let mut outgoing: Vec<usize> = after.iter().map(Vec::len).collect();
    let mut incoming: Vec<usize> = before.iter().map(Vec::len).collect();
    let (mut first, mut last) = (Vec::new(), Vec::new());
    let mut left: BTreeSet<Rank> = (0..n)
        .map(|v| Rank::of(v, outgoing[v], incoming[v]))
        .collect();
    while let Some(rank) = left.pop_first() {
        let v = rank.vertex();
        match rank {
            Rank::Sink(_) => last.push(v),
            _ => first.push(v),
        }
        for (ends, is_before) in [(&before[v], true), (&after[v], false)] {
            for &u in ends {
                let was_left = left.remove(&Rank::of(u, outgoing[u], incoming[u]));
                let counts = if is_before {
                    &mut outgoing
                } else {
                    &mut incoming
                };
                counts[u] -= 1;
                if was_left {
                    left.insert(Rank::of(u, outgoing[u], incoming[u]));
                }
            }
        }
    }
    let mut place = vec![0; n];
    for (i, v) in first.into_iter().chain(last.into_iter().rev()).enumerate() {
        place[v] = i;
    }
    place
}

/// The rank of a vertex among the remaining ones, the next one to choose first; of equal ones, the vertex
/// with the smaller number.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// No edge leaves it.
    Sink(usize),
    /// No edge enters it.
    Source(usize),
    /// The number of edges that leave it minus the number that enter it.
    Between(Reverse<isize>, usize),
}

impl Rank {
    fn of(vertex: usize, outgoing: usize, incoming: usize) -> Self {
        match (outgoing, incoming) {
            (0, _) => Self::Sink(vertex),
            (_, 0) => Self::Source(vertex),
            _ => {
                let surplus = outgoing.cast_signed() - incoming.cast_signed();
                Self::Between(Reverse(surplus), vertex)
            }
        }
    }

    fn vertex(&self) -> usize {
        let (Self::Sink(vertex) | Self::Source(vertex) | Self::Between(_, vertex)) = self;
        *vertex
    }
}

// Folds crowded layers: where few subscribers are known, most nodes would be in one layer and most topics in
// the next; sources move to later layers, more of them if the page has the space.

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
            let behind = after[v].iter().map(|&u: &usize| depth[u] + 1);
            depth[v] = behind.max().unwrap_or(0);
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
        let after = self.after[source].iter();
        after.filter(|&&v| self.is_leaf(v)).count()
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

    #[test]
    fn ranks_grow_along_every_edge() {
        let edges = [(0, 1), (1, 2), (0, 2), (3, 2), (3, 4)];
        let rank = ranks(5, &edges);
        assert!(edges.iter().all(|&(from, to)| rank[from] < rank[to]));
        assert_eq!(rank.iter().min(), Some(&0));
    }

    #[test]
    fn a_late_source_is_moved_next_to_its_reader() {
        assert_eq!(ranks(4, &[(0, 1), (1, 2), (3, 2)]), [0, 1, 2, 1]);
    }

    fn leaves_no_cycle(n: usize, edges: &[(usize, usize)], reversed: &[bool]) -> bool {
        let turned: Vec<(usize, usize)> = edges
            .iter()
            .zip(reversed)
            .filter(|((from, to), _)| from != to)
            .map(|(&(from, to), &turn)| if turn { (to, from) } else { (from, to) })
            .collect();
        in_order(n, &turned).iter().all(|turn| !turn)
    }

    /// The order as published, in time quadratic in the number of vertices.
    fn reported(n: usize, edges: &[(usize, usize)]) -> Vec<usize> {
        let mut left: BTreeSet<usize> = (0..n).collect();
        let (mut first, mut last) = (Vec::new(), Vec::new());
        while !left.is_empty() {
            let inside = |(a, b): &&(usize, usize)| a != b && left.contains(a) && left.contains(b);
            let outgoing = |v: usize| edges.iter().filter(inside).filter(|e| e.0 == v).count();
            let incoming = |v: usize| edges.iter().filter(inside).filter(|e| e.1 == v).count();
            let spare = |v: usize| outgoing(v).cast_signed() - incoming(v).cast_signed();
            if let Some(&v) = left.iter().find(|v| outgoing(**v) == 0) {
                left.remove(&v);
                last.push(v);
                continue;
            }
            let source = left.iter().find(|v| incoming(**v) == 0);
            let busiest = || left.iter().max_by_key(|v| (spare(**v), Reverse(**v)));
            let v = *source.or_else(busiest).unwrap();
            left.remove(&v);
            first.push(v);
        }
        let mut place = vec![0; n];
        for (i, v) in first.into_iter().chain(last.into_iter().rev()).enumerate() {
            place[v] = i;
        }
        place
    }

    #[test]
    fn the_greedy_order_is_returned() {
        let mut state = 7_usize;
        let mut number = |below: usize| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) % below
        };
        for round in 0..60 {
            let n = 2 + round % 13;
            let edges: Vec<(usize, usize)> =
                (0..number(3 * n)).map(|_| (number(n), number(n))).collect();
            assert_eq!(greedy_order(n, &edges), reported(n, &edges), "{edges:?}");
        }
    }

    #[test]
    fn a_ring_loses_its_last_edge() {
        assert_eq!(in_order(3, &[(0, 1), (1, 2), (2, 0)]), [false, false, true]);
    }

    #[test]
    fn both_ways_leave_no_cycle() {
        let edges = [
            (0, 1),
            (1, 0),
            (1, 2),
            (2, 2),
            (2, 3),
            (3, 1),
            (4, 0),
            (3, 4),
        ];
        assert!(leaves_no_cycle(5, &edges, &in_order(5, &edges)));
        assert!(leaves_no_cycle(5, &edges, &greedy(5, &edges)));
    }

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
