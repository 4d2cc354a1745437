//! The order of the items in each layer: barycentre and median sweeps with transposition, fewest crossings kept.
//!
//! Members of a cluster stay side by side between its borders, like words in brackets, and two clusters keep their
//! order in all layers that they share, so that their boxes can be drawn apart.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::{Kind, Layers, Rows, monotone};

/// How often one order is swept at most, and after how many sweeps without gain it is given up.
const SWEEPS: usize = 24;
const PATIENCE: usize = 6;
/// How often the best order is shaken at most.
const SHAKES: usize = 16;

/// The best order found and its number of crossings, borders of clusters included. `effort` counts edges swept: the
/// search begins anew, then shakes the best order, until it is spent.
pub(super) fn order(layers: &Layers, effort: usize) -> (Rows, u64) {
    let mut search = Search {
        layers,
        effort,
        best: (Rows::new(), u64::MAX),
    };
    search.improve(&depth_first(layers, true), true);
    if search.effort > 0 {
        search.improve_flat();
    }
    if search.effort > 0 {
        search.improve(&depth_first(layers, false), false);
    }
    let mut dice = Dice(1);
    for _ in 0..SHAKES {
        if search.effort == 0 || search.best.1 == 0 {
            break;
        }
        let shaken = search.shaken(&mut dice);
        search.improve(&shaken, dice.throw() > 0.0);
    }
    search.best
}

/// A search for an order with few crossings.
struct Search<'a> {
    layers: &'a Layers,
    effort: usize,
    best: (Rows, u64),
}

impl Search<'_> {
    /// Sorts by these keys and sweeps while that gains something.
    fn improve(&mut self, key: &[f64], downwards: bool) {
        let edges = self.layers.rank.len();
        let mut sorter = Sorter::new(self.layers, key);
        let mut found = (sorter.rows.clone(), sorter.crossings());
        let mut stalled = 0;
        for sweep in 0..SWEEPS {
            sorter.sweep((sweep % 2 == 0) == downwards, sweep % 4 >= 2);
            sorter.transpose();
            self.effort = self.effort.saturating_sub(edges);
            let crossings = sorter.crossings();
            stalled += 1;
            if crossings < found.1 {
                found = (sorter.rows.clone(), crossings);
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
        let mut search = Search {
            layers: &flat,
            effort: self.effort,
            best: (Rows::new(), u64::MAX),
        };
        search.improve(&depth_first(&flat, false), true);
        self.effort = search.effort;
        let mut key = vec![f64::NAN; self.layers.rank.len()];
        for row in &search.best.0 {
            for (i, &v) in row.iter().enumerate() {
                key[v] = i as f64 - row.len() as f64 / 2.0;
            }
        }
        self.improve(&key, true);
    }

    /// Keys near the places of the best rows, with some clusters and a few items thrown elsewhere.
    fn shaken(&self, dice: &mut Dice) -> Vec<f64> {
        let rows = &self.best.0;
        let widest = rows.iter().map(Vec::len).max().unwrap_or(0) as f64;
        let mut throw = |odds: f64| {
            if dice.throw() + 0.5 < odds {
                dice.throw() * widest
            } else {
                0.0
            }
        };
        let shift: Vec<f64> = self.layers.parent.iter().map(|_| throw(0.3)).collect();
        let mut key = vec![0.0; self.layers.rank.len()];
        for row in rows {
            for (i, &v) in row.iter().enumerate() {
                key[v] = i as f64 - row.len() as f64 / 2.0 + throw(0.05);
                let mut cluster = self.layers.home[v];
                while cluster != 0 {
                    key[v] += shift[cluster];
                    cluster = self.layers.parent[cluster];
                }
            }
        }
        key
    }
}

/// The same throws on every machine: Knuth's linear congruence.
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

/// When a walk through the graph meets each item; it begins at the sources, or at the sinks.
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
                stack.extend(
                    layers.down[v]
                        .iter()
                        .chain(&layers.up[v])
                        .filter(|&&u| met[u].is_nan()),
                );
            }
        }
    }
    met
}

/// What moves as one inside its cluster: an item, or a whole cluster from its top to its bottom border.
#[derive(Clone, Copy)]
struct Unit {
    start: usize,
    end: usize,
    cluster: Option<usize>,
}

/// The rows while they are being sorted.
struct Sorter<'a> {
    layers: &'a Layers,
    rows: Rows,
    /// The place of each item in its row.
    place: Vec<usize>,
    /// Where each item wants to be; NaN for anywhere.
    key: Vec<f64>,
    /// The sorted places of the neighbours of each item, before and after; filled where needed.
    near: Vec<[Vec<usize>; 2]>,
    /// The clusters met in this sweep, in their order; and where each stands in it.
    clusters: Vec<usize>,
    turn: Vec<Option<usize>>,
}

impl<'a> Sorter<'a> {
    fn new(layers: &'a Layers, key: &[f64]) -> Self {
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
    fn sweep(&mut self, downwards: bool, median: bool) {
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

    /// Sorts what stands directly in one cluster by key, and inside what is a cluster itself.
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
    fn transpose(&mut self) {
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

    fn crossings(&mut self) -> u64 {
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
        row.extend(members.iter().copied().filter(|v| border(v, Kind::Top)));
        let (borders, rest): (Vec<usize>, _) = members
            .into_iter()
            .partition(|v| border(v, Kind::Top) || border(v, Kind::Bottom));
        row.extend(bracketed(layers, cluster, rest));
        row.extend(borders.into_iter().filter(|v| border(v, Kind::Bottom)));
    }
    row
}

/// What moves as one in a stretch of a row.
fn units(layers: &Layers, items: &[usize]) -> Vec<Unit> {
    let mut units = Vec::new();
    let mut start = 0;
    while start < items.len() {
        let cluster = (layers.kind[items[start]] == Kind::Top).then(|| layers.home[items[start]]);
        let closes =
            |v: &usize| layers.kind[*v] == Kind::Bottom && Some(layers.home[*v]) == cluster;
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

/// The pairs of which the first is greater than the second; both sorted.
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
