//! The order of the items in each layer: barycentre and median sweeps with transposition, fewest crossings kept.

use std::collections::BTreeMap;
use std::ops::Range;

use super::place::Monotone;
use crate::layout::{LayerItem, LayerRows, Layers, around};

/// The largest number of sweeps of one order, and the number of sweeps without improvement after which it is
/// abandoned. Half as many sweeps: drawings are 0.6 % smaller; twice as many: no drawing changes. Half the patience: 0.8 % fewer
/// labels have a place; twice: no fewer crossings in 1.17 times the time (`tests/bench/layout.md`, as all numbers in this folder).
const SWEEPS: usize = 24;
const PATIENCE: usize = 6;
/// The largest number of times that the best order is perturbed. Never: 2 % more crossings; twice as often: 1.5 % fewer;
/// until the effort is spent: 11 % fewer, in drawings that are 0.6 % smaller and take 1.25 times as long.
const SHAKES: usize = 8;

/// An order of the items in each layer, and its number of crossings, borders of clusters included.
pub(crate) struct LayerOrder {
    pub(crate) rows: LayerRows,
    pub(crate) crossings: u64,
}

/// The best order found; see [`Search`].
pub(crate) fn order(layers: &Layers, effort: usize) -> LayerOrder {
    Search::new(layers, effort).finished()
}

/// A search for an order with few crossings. Its effort counts swept edges: the search restarts, then
/// perturbs the best order, until the effort is spent.
pub(crate) struct Search<'a> {
    pub(crate) layers: &'a Layers,
    sorter: CrossingReducer<'a>,
    effort: usize,
    /// The items of the best rows, row by row, and their crossings.
    best: (Vec<usize>, u64),
}

impl<'a> Search<'a> {
    /// A search that has found its first order.
    pub(crate) fn new(layers: &'a Layers, effort: usize) -> Self {
        let mut search = Self::unbegun(layers, effort);
        search.improve(&depth_first(layers, true), true);
        search
    }

    fn unbegun(layers: &'a Layers, effort: usize) -> Self {
        Self {
            layers,
            sorter: CrossingReducer::new(layers),
            effort,
            best: (Vec::new(), u64::MAX),
        }
    }

    /// The best order so far.
    pub(crate) fn found(&self) -> LayerOrder {
        LayerOrder {
            rows: self.sorter.rows(&self.best.0),
            crossings: self.best.1,
        }
    }

    /// The best order found within the effort.
    pub(crate) fn finished(mut self) -> LayerOrder {
        if self.effort > 0 {
            self.improve_flat();
        }
        if self.effort > 0 {
            self.improve(&depth_first(self.layers, false), false);
        }
        let mut dice = Dice(1);
        for _ in 0..SHAKES {
            if self.effort == 0 || self.best.1 == 0 {
                break;
            }
            let shaken = self.shaken(&mut dice);
            self.improve(&shaken, dice.throw() > 0.0);
        }
        self.found()
    }

    /// Sorts by these keys and sweeps while that is an improvement.
    fn improve(&mut self, key: &[f64], downwards: bool) {
        let edges = self.layers.rank.len();
        let sorter = &mut self.sorter;
        sorter.restart(key);
        let mut found = (sorter.items.clone(), sorter.crossings());
        let mut stalled = 0;
        for sweep in 0..SWEEPS {
            sorter.sweep((sweep % 2 == 0) == downwards, sweep % 4 >= 2);
            sorter.transpose();
            self.effort = self.effort.saturating_sub(edges);
            let crossings = sorter.crossings();
            stalled += 1;
            if crossings < found.1 {
                found.0.clone_from_slice(&sorter.items);
                found.1 = crossings;
                stalled = 0;
            }
            if stalled > PATIENCE || found.1 == 0 {
                break;
            }
        }
        if found.1 <= self.best.1 {
            self.best = found;
        }
    }

    /// Begins with the best order that disregards clusters.
    fn improve_flat(&mut self) {
        if self.layers.parent.len() < 2 {
            return;
        }
        let flat = self.layers.without_clusters();
        let mut search = Search::unbegun(&flat, self.effort);
        search.improve(&depth_first(&flat, false), true);
        self.effort = search.effort;
        let mut key = vec![f64::NAN; self.layers.rank.len()];
        for row in search.sorter.rows(&search.best.0) {
            for (i, &v) in row.iter().enumerate() {
                key[v] = i as f64 - row.len() as f64 / 2.0;
            }
        }
        self.improve(&key, true);
    }

    /// Keys near the positions of the best rows, with some clusters and a few items moved elsewhere.
    fn shaken(&self, dice: &mut Dice) -> Vec<f64> {
        let rows = self.sorter.rows(&self.best.0);
        let widest = rows.iter().map(Vec::len).max().unwrap_or(0) as f64;
        let mut throw = |odds: f64| {
            if dice.throw() + 0.5 < odds {
                dice.throw() * widest
            } else {
                0.0
            }
        };
        // One cluster in three and one item in twenty: 2 to 3 % more crossings without either; half and twice as many are as
        // good, within chance.
        let shift: Vec<f64> = self.layers.parent.iter().map(|_| throw(0.3)).collect();
        let mut key = vec![0.0; self.layers.rank.len()];
        for row in &rows {
            for (i, &v) in row.iter().enumerate() {
                key[v] = i as f64 - row.len() as f64 / 2.0 + throw(0.05);
                for cluster in around(&self.layers.parent, self.layers.home[v]) {
                    key[v] += shift[cluster];
                }
            }
        }
        key
    }
}

/// Pseudo-random numbers, identical on every machine: Knuth's linear congruential generator.
struct Dice(u64);

impl Dice {
    /// A number from -0.5 to 0.5.
    fn throw(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
    }
}

/// The position of each item in a walk through the graph, which begins at the sources or at the sinks.
fn depth_first(layers: &Layers, sources: bool) -> Vec<f64> {
    let n = layers.rank.len();
    let ends = if sources { &layers.up } else { &layers.down };
    let mut met = vec![f64::NAN; n];
    let mut clock = 0.0;
    for begin in (0..n).filter(|&v| ends[v].is_empty()).chain(0..n) {
        let mut stack = vec![begin];
        while let Some(v) = stack.pop() {
            if met[v].is_nan() {
                met[v] = clock;
                clock += 1.0;
                let beside = layers.down[v].iter().chain(&layers.up[v]);
                stack.extend(beside.filter(|&&u| met[u].is_nan()));
            }
        }
    }
    met
}

// Rows while they are being sorted: sweeps, swaps of neighbours, and the number of crossings.
//
// Members of a cluster stay side by side between its borders, like words in brackets, and two clusters keep
// their order in all layers that they share, so that their boxes do not overlap. A sweep changes few rows
// once the order is stable, so values derived from a row are cached until that row or one beside it changes.

/// A unit that moves as one inside its cluster: an item, or a whole cluster from its top to its bottom border.
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
        let ends = [&self.layers.up, &self.layers.down];
        let (neighbours, back) = (ends[side], ends[1 - side]);
        let beside = match side {
            0 => rank.checked_sub(1),
            _ => Some(rank + 1).filter(|beside| *beside < self.layers.ranks),
        };
        let Some(beside) = beside else {
            return;
        };
        let (own, beside) = (self.row(rank), self.row(beside));
        let Side { first, places, .. } = &mut self.sides[side];
        // The start of each item's positions advances to their end and is then reset.
        for (place, &u) in self.items[beside].iter().enumerate() {
            for &v in &back[u] {
                places[first[v]] = place;
                first[v] += 1;
            }
        }
        for &v in &self.items[own] {
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

// Rows in which clusters nest like brackets, each from its top border to its bottom border.

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
        let is_top = |v: &usize| border(v, LayerItem::Top);
        let is_bottom = |v: &usize| border(v, LayerItem::Bottom);
        let (top, inside): (Vec<usize>, Vec<_>) = members.into_iter().partition(is_top);
        let (bottom, rest): (Vec<usize>, _) = inside.into_iter().partition(is_bottom);
        row.extend(top);
        row.extend(bracketed(layers, cluster, rest));
        row.extend(bottom);
    }
    row
}

/// The number of items from each top border to its bottom border; 1 for any other item.
fn extents(layers: &Layers, items: &[usize]) -> Vec<usize> {
    let mut extent = vec![1; items.len()];
    let mut open = Vec::new();
    for (at, &v) in items.iter().enumerate() {
        match layers.kind[v] {
            LayerItem::Top => open.push(at),
            LayerItem::Bottom => {
                if let Some(top) = open.pop() {
                    extent[items[top]] = at + 1 - top;
                }
            }
            LayerItem::Vertex | LayerItem::Bend => {}
        }
    }
    extent
}

#[cfg(test)]
mod tests;
