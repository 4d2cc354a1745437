//! Rows while they are being sorted: sweeps, swaps of neighbours, and the number of crossings.
//!
//! Members of a cluster stay side by side between its borders, like words in brackets, and two clusters keep their
//! order in all layers that they share, so that their boxes can be drawn apart.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::layout::{LayerItem, LayerRows, Layers, monotone};

/// A unit that moves as one inside its cluster: an item, or a whole cluster from its top to its bottom border.
#[derive(Clone, Copy)]
struct Unit {
    start: usize,
    end: usize,
    cluster: Option<usize>,
}

/// The rows while they are being sorted.
pub(crate) struct CrossingReducer<'a> {
    layers: &'a Layers,
    pub(crate) rows: LayerRows,
    /// The place of each item in its row.
    place: Vec<usize>,
    /// The wanted place of each item; NaN for one without a wish.
    key: Vec<f64>,
    /// The sorted places of the neighbours of each item, before and after; filled where needed.
    near: Vec<[Vec<usize>; 2]>,
    /// The clusters met in this sweep, in their order; and the place of each in it.
    clusters: Vec<usize>,
    turn: Vec<Option<usize>>,
}

impl<'a> CrossingReducer<'a> {
    pub(crate) fn new(layers: &'a Layers, key: &[f64]) -> Self {
        let n = layers.rank.len();
        let mut flat = vec![Vec::new(); layers.ranks];
        for v in 0..n {
            flat[layers.rank[v]].push(v);
        }
        let mut sorter = Self {
            layers,
            rows: flat
                .into_iter()
                .map(|row| bracketed(layers, 0, row))
                .collect(),
            place: vec![0; n],
            key: key.to_vec(),
            near: vec![Default::default(); n],
            clusters: Vec::new(),
            turn: vec![None; layers.parent.len()],
        };
        for rank in 0..layers.ranks {
            sorter.sort_row(rank);
        }
        sorter
    }

    /// Sorts every row by its neighbours in the row before it, in the direction of the sweep.
    pub(crate) fn sweep(&mut self, downwards: bool, median: bool) {
        self.clusters.clear();
        self.turn.fill(None);
        let side = usize::from(!downwards);
        for step in 0..self.layers.ranks {
            let rank = if downwards {
                step
            } else {
                self.layers.ranks - 1 - step
            };
            self.look(rank, side);
            for &v in &self.rows[rank] {
                self.key[v] = centre(&self.near[v][side], median);
            }
            self.sort_row(rank);
        }
    }

    /// Fills in the places of the neighbours of a row on one side.
    fn look(&mut self, rank: usize, side: usize) {
        let neighbours = if side == 0 {
            &self.layers.up
        } else {
            &self.layers.down
        };
        for &v in &self.rows[rank] {
            let near = &mut self.near[v][side];
            near.clear();
            near.extend(neighbours[v].iter().map(|&u| self.place[u]));
            near.sort_unstable();
        }
    }

    fn sort_row(&mut self, rank: usize) {
        let mut row = std::mem::take(&mut self.rows[rank]);
        self.sort(&mut row);
        for (i, &v) in row.iter().enumerate() {
            self.place[v] = i;
        }
        self.rows[rank] = row;
    }

    /// Sorts the units that stand directly in one cluster by key, and the inside of those that are clusters themselves.
    fn sort(&mut self, items: &mut [usize]) {
        let units = units(self.layers, items);
        let mut keys = Vec::with_capacity(units.len());
        let mut last = -1.0;
        for unit in &units {
            if unit.cluster.is_some() {
                self.sort(&mut items[unit.start + 1..unit.end - 1]);
            }
            // Without a wish, a unit stays behind the one before it.
            let wishes = items[unit.start..unit.end].iter().map(|&v| self.key[v]);
            last = mean(wishes.filter(|key| !key.is_nan())).unwrap_or(last);
            keys.push(last);
        }
        let old = items.to_vec();
        let mut at = 0;
        for i in self.sorted(&units, &mut keys) {
            let unit = &old[units[i].start..units[i].end];
            items[at..at + unit.len()].copy_from_slice(unit);
            at += unit.len();
        }
    }

    /// The units by key, after the keys of clusters met before have been made to grow in their order.
    fn sorted(&mut self, units: &[Unit], keys: &mut [f64]) -> Vec<usize> {
        let turn = |i: usize| units[i].cluster.and_then(|c| self.turn[c]);
        let mut known: Vec<usize> = (0..units.len()).filter(|&i| turn(i).is_some()).collect();
        known.sort_unstable_by_key(|&i| turn(i));
        let wishes: Vec<f64> = known.iter().map(|&i| keys[i]).collect();
        for (&i, key) in known
            .iter()
            .zip(monotone(&wishes, &vec![1.0; wishes.len()]))
        {
            keys[i] = key;
        }
        // Ties: items first, then known clusters in their order, each new cluster behind those that it does not precede.
        let mut tie: Vec<usize> = (0..units.len()).map(|_| 0).collect();
        for (order, &i) in known.iter().enumerate() {
            tie[i] = 2 * order + 2;
        }
        for i in (0..units.len()).filter(|&i| units[i].cluster.is_some() && turn(i).is_none()) {
            tie[i] = 1 + 2 * known.partition_point(|&k| keys[k] <= keys[i]);
        }
        let mut order: Vec<usize> = (0..units.len()).collect();
        order.sort_by(|&a, &b| {
            keys[a]
                .total_cmp(&keys[b])
                .then(tie[a].cmp(&tie[b]))
                .then(a.cmp(&b))
        });
        self.learn(order.iter().filter_map(|&i| units[i].cluster).collect());
        order
    }

    /// Enters clusters that are new into the order, each behind the one before it.
    fn learn(&mut self, row: Vec<usize>) {
        if row.iter().all(|&c| self.turn[c].is_some()) {
            return;
        }
        let first = row.iter().find_map(|&c| self.turn[c]);
        let mut at = first.unwrap_or(self.clusters.len());
        for cluster in row {
            if let Some(turn) = self.turn[cluster] {
                at = turn + 1;
                continue;
            }
            self.clusters.insert(at, cluster);
            at += 1;
            for (turn, &c) in self.clusters.iter().enumerate() {
                self.turn[c] = Some(turn);
            }
        }
    }

    /// Swaps neighbours in a row while that saves crossings.
    pub(crate) fn transpose(&mut self) {
        for _ in 0..3 {
            let mut better = false;
            for rank in 0..self.layers.ranks {
                self.look(rank, 0);
                self.look(rank, 1);
                let mut row = std::mem::take(&mut self.rows[rank]);
                if self.transpose_in(&mut row) {
                    better = true;
                    for (i, &v) in row.iter().enumerate() {
                        self.place[v] = i;
                    }
                }
                self.rows[rank] = row;
            }
            if !better {
                break;
            }
        }
    }

    /// Swaps neighbours that stand directly in one cluster, and inside clusters; two clusters are never swapped.
    fn transpose_in(&self, items: &mut [usize]) -> bool {
        let mut better = false;
        let mut before: Option<Unit> = None;
        for unit in units(self.layers, items) {
            if unit.cluster.is_some() {
                better |= self.transpose_in(&mut items[unit.start + 1..unit.end - 1]);
            }
            let left = before.filter(|left| left.cluster.is_none() || unit.cluster.is_none());
            if let Some(left) = left.filter(|left| {
                self.saves(&items[left.start..left.end], &items[unit.start..unit.end])
            }) {
                items[left.start..unit.end].rotate_left(left.end - left.start);
                // The left unit now stands behind this one and may move on.
                let start = left.start + unit.end - unit.start;
                before = Some(Unit {
                    start,
                    end: unit.end,
                    ..left
                });
                better = true;
            } else {
                before = Some(unit);
            }
        }
        better
    }

    /// Whether swapping two neighbours saves crossings.
    fn saves(&self, first: &[usize], second: &[usize]) -> bool {
        let (mut now, mut then) = (0, 0);
        for side in 0..2 {
            let (first, second) = (self.places(first, side), self.places(second, side));
            now += inversions(&first, &second);
            then += inversions(&second, &first);
        }
        then < now
    }

    /// The sorted places of all neighbours of these items on one side.
    fn places(&self, items: &[usize], side: usize) -> Cow<'_, [usize]> {
        if let [item] = items {
            return Cow::Borrowed(&self.near[*item][side]);
        }
        let mut places: Vec<usize> = items
            .iter()
            .flat_map(|&v| self.near[v][side].iter().copied())
            .collect();
        places.sort_unstable();
        Cow::Owned(places)
    }

    pub(crate) fn crossings(&mut self) -> u64 {
        let mut sum = 0;
        for rank in 1..self.layers.ranks {
            self.look(rank - 1, 1);
            sum += self.crossings_before(rank);
        }
        sum
    }

    /// The crossings between a layer and the one before it, counted with a Fenwick tree (Barth, Jünger, Mutzel 2002).
    fn crossings_before(&self, rank: usize) -> u64 {
        let width = self.rows[rank].len();
        let mut tree = vec![0_u64; width + 1];
        let (mut total, mut sum) = (0, 0);
        for &v in &self.rows[rank - 1] {
            for &place in &self.near[v][1] {
                let (mut at, mut before) = (place + 1, 0);
                while at > 0 {
                    before += tree[at];
                    at &= at - 1;
                }
                sum += total - before;
            }
            for &place in &self.near[v][1] {
                let mut at = place + 1;
                while at <= width {
                    tree[at] += 1;
                    at += at & at.wrapping_neg();
                }
                total += 1;
            }
        }
        sum
    }
}

/// A row in which each cluster is one stretch, from its top border to its bottom border.
fn bracketed(layers: &Layers, around: usize, items: Vec<usize>) -> Vec<usize> {
    let mut row = Vec::with_capacity(items.len());
    let mut inside: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for v in items {
        match layers.child(around, v) {
            Some(cluster) => inside.entry(cluster).or_default().push(v),
            None => row.push(v),
        }
    }
    for (cluster, members) in inside {
        let border = |v: &usize, kind| layers.home[*v] == cluster && layers.kind[*v] == kind;
        row.extend(
            members
                .iter()
                .copied()
                .filter(|v| border(v, LayerItem::Top)),
        );
        let (borders, rest): (Vec<usize>, _) = members
            .into_iter()
            .partition(|v| border(v, LayerItem::Top) || border(v, LayerItem::Bottom));
        row.extend(bracketed(layers, cluster, rest));
        row.extend(borders.into_iter().filter(|v| border(v, LayerItem::Bottom)));
    }
    row
}

/// The units that move as one in a stretch of a row.
fn units(layers: &Layers, items: &[usize]) -> Vec<Unit> {
    let mut units = Vec::new();
    let mut start = 0;
    while start < items.len() {
        let cluster =
            (layers.kind[items[start]] == LayerItem::Top).then(|| layers.home[items[start]]);
        let closes =
            |v: &usize| layers.kind[*v] == LayerItem::Bottom && Some(layers.home[*v]) == cluster;
        let length = cluster
            .and_then(|_| items[start..].iter().position(closes))
            .unwrap_or(0)
            + 1;
        units.push(Unit {
            start,
            end: start + length,
            cluster,
        });
        start += length;
    }
    units
}

/// The number of pairs of which the first is greater than the second; both lists are sorted.
fn inversions(first: &[usize], second: &[usize]) -> u64 {
    let (mut below, mut sum) = (0, 0);
    for &a in first {
        while below < second.len() && second[below] < a {
            below += 1;
        }
        sum += below as u64;
    }
    sum
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    (count > 0.0).then(|| sum / count)
}

/// The barycentre or the weighted median (Gansner and others 1993) of sorted places; NaN for none.
fn centre(places: &[usize], median: bool) -> f64 {
    let n = places.len();
    let at = |i: usize| places[i] as f64;
    if n == 0 {
        f64::NAN
    } else if !median {
        places.iter().sum::<usize>() as f64 / n as f64
    } else if n % 2 == 1 {
        at(n / 2)
    } else if n == 2 {
        f64::midpoint(at(0), at(1))
    } else {
        let (left, right) = (at(n / 2 - 1) - at(0), at(n - 1) - at(n / 2));
        if left + right > 0.0 {
            (at(n / 2 - 1) * right + at(n / 2) * left) / (left + right)
        } else {
            at(n / 2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inversions_are_pairs_out_of_order() {
        assert_eq!(inversions(&[1, 3], &[0, 2]), 3);
        assert_eq!(inversions(&[0, 1], &[1, 2]), 0);
    }

    #[test]
    fn the_median_leans_to_the_crowded_side() {
        assert!((centre(&[0, 4, 5, 20], true) - 4.2).abs() < 0.1);
        assert!(centre(&[], true).is_nan());
    }
}
