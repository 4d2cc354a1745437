//! Rows while they are being sorted: sweeps, swaps of neighbours, and the number of crossings.
//!
//! Members of a cluster stay side by side between its borders, like words in brackets, and two clusters keep
//! their order in all layers that they share, so that their boxes do not overlap. A sweep changes few rows
//! once the order is stable, so values derived from a row are cached until that row or one beside it changes.

mod brackets;

use std::ops::Range;

use crate::layout::isotonic::Monotone;
use crate::layout::{LayerRows, Layers};
use brackets::{bracketed, extents};

/// A unit that moves as one inside its cluster: an item, or a whole cluster from its top to its bottom border.
#[derive(Clone, Copy)]
struct Unit {
    start: usize,
    extent: usize,
    cluster: Option<usize>,
    key: f64,
    /// The order among units of one key: items first, then known clusters in their order, each new cluster behind those
    /// that it does not precede.
    tie: usize,
}

/// The neighbours of all items on one side, item by item, and their sorted positions.
struct Side {
    /// Where the neighbours of each item begin; one more than there are items.
    first: Vec<usize>,
    places: Vec<usize>,
    /// Whether the positions of a row's neighbours are up to date.
    is_fresh: Vec<bool>,
}

impl Side {
    fn new(neighbours: &[Vec<usize>], ranks: usize) -> Self {
        let mut first = vec![0];
        for all in neighbours {
            first.push(first[first.len() - 1] + all.len());
        }
        Self {
            places: vec![0; first[neighbours.len()]],
            first,
            is_fresh: vec![false; ranks],
        }
    }

    fn of(&self, item: usize) -> &[usize] {
        &self.places[self.first[item]..self.first[item + 1]]
    }
}

/// The rows while they are being sorted.
pub(crate) struct CrossingReducer<'a> {
    layers: &'a Layers,
    /// The items of all rows, row by row; and those with which every search begins.
    items: Vec<usize>,
    begin: Vec<usize>,
    /// Where each row begins in them; one more than there are rows.
    start: Vec<usize>,
    /// The number of items from a top border to its bottom border; 1 for any other item.
    extent: Vec<usize>,
    /// The position of each item in its row.
    place: Vec<usize>,
    /// The preferred position of each item; NaN for one without a preference.
    key: Vec<f64>,
    /// The neighbours before and after.
    sides: [Side; 2],
    /// The crossings before each row, if known.
    before: Vec<Option<u64>>,
    /// Whether no swap in a row saves crossings.
    is_settled: Vec<bool>,
    /// The clusters visited in this sweep, in order; and the position of each.
    clusters: Vec<usize>,
    turn: Vec<Option<usize>>,
    /// Buffers for the units and items that are being sorted, and for counting.
    units: Vec<Unit>,
    known: Vec<usize>,
    old: Vec<usize>,
    tree: Vec<u64>,
    monotone: Monotone,
}

impl<'a> CrossingReducer<'a> {
    pub(crate) fn new(layers: &'a Layers) -> Self {
        let n = layers.rank.len();
        let mut flat = vec![Vec::new(); layers.ranks];
        for v in 0..n {
            flat[layers.rank[v]].push(v);
        }
        let (mut begin, mut start) = (Vec::with_capacity(n), vec![0]);
        for row in flat {
            begin.extend(bracketed(layers, 0, row));
            start.push(begin.len());
        }
        Self {
            layers,
            items: begin.clone(),
            extent: extents(layers, &begin),
            begin,
            start,
            place: vec![0; n],
            key: Vec::new(),
            sides: [&layers.up, &layers.down].map(|ends| Side::new(ends, layers.ranks)),
            before: vec![None; layers.ranks],
            is_settled: vec![false; layers.ranks],
            clusters: Vec::new(),
            turn: vec![None; layers.parent.len()],
            units: Vec::new(),
            known: Vec::new(),
            old: Vec::new(),
            tree: Vec::new(),
            monotone: Monotone::default(),
        }
    }

    /// Starts over, sorted by these keys.
    pub(crate) fn restart(&mut self, key: &[f64]) {
        self.items.clone_from(&self.begin);
        self.key = key.to_vec();
        self.forget_clusters();
        for rank in 0..self.layers.ranks {
            self.sort(self.row(rank));
            self.changed(rank);
        }
    }

    /// The items of all rows, row by row.
    pub(crate) fn items(&self) -> &[usize] {
        &self.items
    }

    /// These items as rows.
    pub(crate) fn rows(&self, items: &[usize]) -> LayerRows {
        let rows = 0..self.layers.ranks;
        rows.map(|rank| items[self.row(rank)].to_vec()).collect()
    }

    fn row(&self, rank: usize) -> Range<usize> {
        self.start[rank]..self.start[rank + 1]
    }

    fn forget_clusters(&mut self) {
        self.clusters.clear();
        self.turn.fill(None);
    }

    /// Records that a row changed.
    fn changed(&mut self, rank: usize) {
        let row = self.row(rank);
        for (i, &v) in self.items[row].iter().enumerate() {
            self.place[v] = i;
        }
        self.before[rank] = None;
        self.is_settled[rank] = false;
        if rank > 0 {
            self.sides[1].is_fresh[rank - 1] = false;
            self.is_settled[rank - 1] = false;
        }
        if rank + 1 < self.layers.ranks {
            self.sides[0].is_fresh[rank + 1] = false;
            self.before[rank + 1] = None;
            self.is_settled[rank + 1] = false;
        }
    }

    /// Sorts every row by its neighbours in the row before it, in the direction of the sweep.
    pub(crate) fn sweep(&mut self, downwards: bool, median: bool) {
        self.forget_clusters();
        let side = usize::from(!downwards);
        for step in 0..self.layers.ranks {
            let rank = if downwards {
                step
            } else {
                self.layers.ranks - 1 - step
            };
            self.look(rank, side);
            for at in self.row(rank) {
                let v = self.items[at];
                self.key[v] = centre(self.sides[side].of(v), median);
            }
            if self.sort(self.row(rank)) {
                self.changed(rank);
            }
        }
    }

    /// Computes the positions of the neighbours of a row on one side, in the order of that side's row.
    fn look(&mut self, rank: usize, side: usize) {
        if std::mem::replace(&mut self.sides[side].is_fresh[rank], true) {
            return;
        }
        let (beside, back) = if side == 0 {
            (rank.checked_sub(1), &self.layers.down)
        } else {
            (
                Some(rank + 1).filter(|r| *r < self.layers.ranks),
                &self.layers.up,
            )
        };
        let Some(beside) = beside else {
            return;
        };
        let Side { first, places, .. } = &mut self.sides[side];
        // The start of each item's positions advances to their end and is then reset.
        for (place, &u) in self.items[self.start[beside]..self.start[beside + 1]]
            .iter()
            .enumerate()
        {
            for &v in &back[u] {
                places[first[v]] = place;
                first[v] += 1;
            }
        }
        let neighbours = if side == 0 {
            &self.layers.up
        } else {
            &self.layers.down
        };
        for &v in &self.items[self.start[rank]..self.start[rank + 1]] {
            first[v] -= neighbours[v].len();
        }
    }

    /// Sorts the units that are directly in one cluster by key, and the inside of those that are clusters themselves.
    /// Returns whether anything moved.
    fn sort(&mut self, range: Range<usize>) -> bool {
        let mut has_moved = false;
        let base = self.units.len();
        let mut last = -1.0;
        let mut start = range.start;
        while start < range.end {
            let top = self.items[start];
            let extent = self.extent[top];
            let end = start + extent;
            if extent > 1 {
                has_moved |= self.sort(start + 1..end - 1);
            }
            // Without a preference, a unit stays behind the one before it.
            let wishes = self.items[start..end].iter().map(|&v| self.key[v]);
            last = mean(wishes.filter(|key| !key.is_nan())).unwrap_or(last);
            self.units.push(Unit {
                start,
                extent,
                cluster: (extent > 1).then(|| self.layers.home[top]),
                key: last,
                tie: 0,
            });
            start = end;
        }
        let mut units = std::mem::take(&mut self.units);
        self.arrange(&mut units[base..]);
        if !units[base..].is_sorted_by_key(|unit| unit.start) {
            has_moved = true;
            self.old.clear();
            self.old.extend(&self.items[range.clone()]);
            let mut at = range.start;
            for unit in &units[base..] {
                let from = unit.start - range.start;
                self.items[at..at + unit.extent]
                    .copy_from_slice(&self.old[from..from + unit.extent]);
                at += unit.extent;
            }
        }
        units.truncate(base);
        self.units = units;
        has_moved
    }

    /// Sorts units by key, after making the keys of known clusters ascend in their order.
    fn arrange(&mut self, units: &mut [Unit]) {
        if units.iter().any(|unit| unit.cluster.is_some()) {
            let turn = |unit: &Unit| unit.cluster.and_then(|c| self.turn[c]);
            let known = &mut self.known;
            known.clear();
            known.extend((0..units.len()).filter(|&i| turn(&units[i]).is_some()));
            known.sort_unstable_by_key(|&i| turn(&units[i]));
            self.monotone
                .pool(known.iter().map(|&i| (units[i].key, 1.0)));
            for (order, (&i, key)) in known.iter().zip(self.monotone.nearest()).enumerate() {
                (units[i].key, units[i].tie) = (key, 2 * order + 2);
            }
            for i in 0..units.len() {
                if units[i].cluster.is_some_and(|c| self.turn[c].is_none()) {
                    let key = units[i].key;
                    units[i].tie = 1 + 2 * known.partition_point(|&k| units[k].key <= key);
                }
            }
        }
        units.sort_by(|a, b| a.key.total_cmp(&b.key).then(a.tie.cmp(&b.tie)));
        self.learn(units);
    }

    /// Adds new clusters to the order, each behind the one before it.
    fn learn(&mut self, row: &[Unit]) {
        let row = || row.iter().filter_map(|unit| unit.cluster);
        if row().all(|c| self.turn[c].is_some()) {
            return;
        }
        let first = row().find_map(|c| self.turn[c]);
        let mut at = first.unwrap_or(self.clusters.len());
        for cluster in row() {
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
        // Once: 1.6 % fewer labels have a place; six times: no fewer crossings.
        for _ in 0..3 {
            let mut better = false;
            for rank in 0..self.layers.ranks {
                if self.is_settled[rank] {
                    continue;
                }
                self.look(rank, 0);
                self.look(rank, 1);
                if self.transpose_in(self.row(rank)) {
                    better = true;
                    self.changed(rank);
                } else {
                    self.is_settled[rank] = true;
                }
            }
            if !better {
                break;
            }
        }
    }

    /// Swaps neighbours that are directly in one cluster, and inside clusters; two clusters are never
    /// swapped.
    fn transpose_in(&mut self, range: Range<usize>) -> bool {
        let mut better = false;
        let mut before: Option<Range<usize>> = None;
        let mut start = range.start;
        while start < range.end {
            let extent = self.extent[self.items[start]];
            let end = start + extent;
            if extent > 1 {
                better |= self.transpose_in(start + 1..end - 1);
            }
            let left = before.filter(|left| left.len() == 1 || extent == 1);
            let left =
                left.filter(|left| self.saves(&self.items[left.clone()], &self.items[start..end]));
            before = Some(start..end);
            if let Some(left) = left {
                self.items[left.start..end].rotate_left(left.len());
                // The left unit is now behind this one and may move on.
                before = Some(left.start + extent..end);
                better = true;
            }
            start = end;
        }
        better
    }

    /// Whether swapping two neighbours saves crossings.
    fn saves(&self, first: &[usize], second: &[usize]) -> bool {
        let now = self.crossings_of(first, second);
        now > 0 && self.crossings_of(second, first) < now
    }

    /// The crossings between the edges of two neighbours.
    fn crossings_of(&self, left: &[usize], right: &[usize]) -> u64 {
        let mut sum = 0;
        for side in &self.sides {
            for &a in left {
                for &b in right {
                    sum += inversions(side.of(a), side.of(b));
                }
            }
        }
        sum
    }

    pub(crate) fn crossings(&mut self) -> u64 {
        let mut sum = 0;
        for rank in 1..self.layers.ranks {
            if self.before[rank].is_none() {
                self.look(rank - 1, 1);
                self.before[rank] = Some(self.crossings_before(rank));
            }
            sum += self.before[rank].unwrap_or(0);
        }
        sum
    }

    /// The crossings between a layer and the one before it, counted with a Fenwick tree (Barth, Jünger, Mutzel 2002).
    fn crossings_before(&mut self, rank: usize) -> u64 {
        let width = self.row(rank).len();
        let row = self.row(rank - 1);
        let tree = &mut self.tree;
        tree.clear();
        tree.resize(width + 1, 0);
        let (mut total, mut sum) = (0, 0);
        for &v in &self.items[row] {
            let places = self.sides[1].of(v);
            for &place in places {
                let (mut at, mut before) = (place + 1, 0);
                while at > 0 {
                    before += tree[at];
                    at &= at - 1;
                }
                sum += total - before;
            }
            for &place in places {
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

/// The number of pairs of which the first is greater than the second; both lists are sorted.
fn inversions(first: &[usize], second: &[usize]) -> u64 {
    // The common case: all are in order.
    if first.last() <= second.first() {
        return 0;
    }
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

/// The barycentre or the weighted median (Gansner and others 1993) of sorted positions; NaN for none.
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
mod tests;
