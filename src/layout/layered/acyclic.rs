//! The choice of edges to reverse so that no cycle remains.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use super::rank::neighbours;

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
    sides
        .iter()
        .map(|pair| turn.get(pair).copied().unwrap_or(false))
        .collect()
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
    edges
        .iter()
        .map(|&(from, to)| place[from] > place[to])
        .collect()
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
        let end = if matches!(rank, Rank::Sink(_)) {
            &mut last
        } else {
            &mut first
        };
        end.push(v);
        for (ends, count_outgoing) in [(&before[v], true), (&after[v], false)] {
            for &u in ends {
                let was_left = left.remove(&Rank::of(u, outgoing[u], incoming[u]));
                let count = if count_outgoing {
                    &mut outgoing[u]
                } else {
                    &mut incoming[u]
                };
                *count -= 1;
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
            _ => Self::Between(
                Reverse(outgoing.cast_signed() - incoming.cast_signed()),
                vertex,
            ),
        }
    }

    fn vertex(&self) -> usize {
        let (Self::Sink(vertex) | Self::Source(vertex) | Self::Between(_, vertex)) = self;
        *vertex
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
