//! The order of the items in each layer: barycentre and median sweeps with transposition, fewest crossings kept.
//!
//! Members of a cluster stay side by side between its borders, and two clusters keep their order in all layers that
//! they share, so that their boxes can be drawn apart.

use super::place::monotone;
use super::{Kind, Layers, Rows};

/// The best order found from several starts, and its number of crossings. `effort` is the number of sweeps per start.
pub(super) fn order(layers: &Layers, effort: usize) -> (Rows, u64) {
    (0..2)
        .map(|start| from_start(layers, start, effort))
        .reduce(|best, next| if next.1 < best.1 { next } else { best })
        .unwrap_or_default()
}

fn from_start(layers: &Layers, start: usize, effort: usize) -> (Rows, u64) {
    let mut sorter = Sorter::new(layers, &depth_first(layers, start == 0));
    let mut best = (sorter.rows.clone(), sorter.crossings());
    let mut stalled = 0;
    for sweep in 0..effort {
        sorter.sweep(sweep % 2 == 0, sweep % 4 >= 2);
        sorter.transpose();
        let crossings = sorter.crossings();
        if crossings < best.1 {
            best = (sorter.rows.clone(), crossings);
            stalled = 0;
        } else {
            stalled += 1;
        }
        if stalled > 8 || best.1 == 0 {
            break;
        }
    }
    best
}

/// When a walk through the graph meets each item; it starts from the sources or from the sinks.
fn depth_first(layers: &Layers, sources: bool) -> Vec<f64> {
    let n = layers.rank.len();
    let ends = if sources { &layers.up } else { &layers.down };
    let mut met = vec![None; n];
    let mut clock = 0.0;
    let starts = (0..n).filter(|&v| ends[v].is_empty()).chain(0..n);
    for start in starts {
        let mut stack = vec![start];
        while let Some(v) = stack.pop() {
            if met[v].is_some() {
                continue;
            }
            met[v] = Some(clock);
            clock += 1.0;
            stack.extend(
                layers.down[v]
                    .iter()
                    .chain(&layers.up[v])
                    .filter(|&&u| met[u].is_none()),
            );
        }
    }
    met.into_iter().map(Option::unwrap_or_default).collect()
}

/// What moves as one within a cluster in a layer: an item, or a whole cluster inside.
struct Unit {
    items: Vec<usize>,
    cluster: Option<usize>,
}

/// The rows while they are being sorted.
struct Sorter<'a> {
    layers: &'a Layers,
    rows: Rows,
    /// The place of each item in its row.
    place: Vec<usize>,
    /// The order of the clusters met in this sweep; those that share a layer keep it.
    clusters: Vec<usize>,
}

impl<'a> Sorter<'a> {
    fn new(layers: &'a Layers, key: &[f64]) -> Self {
        let mut rows = vec![Vec::new(); layers.ranks];
        for v in 0..layers.rank.len() {
            rows[layers.rank[v]].push(v);
        }
        let mut sorter = Self {
            layers,
            rows,
            place: vec![0; layers.rank.len()],
            clusters: Vec::new(),
        };
        for rank in 0..layers.ranks {
            let keys: Vec<Option<f64>> = sorter.rows[rank].iter().map(|&v| Some(key[v])).collect();
            sorter.sort_row(rank, &keys);
        }
        sorter
    }

    /// Sorts every row by its neighbours in the row before (or after).
    fn sweep(&mut self, downwards: bool, median: bool) {
        self.clusters.clear();
        let neighbours = if downwards {
            &self.layers.up
        } else {
            &self.layers.down
        };
        for step in 0..self.layers.ranks {
            let rank = if downwards {
                step
            } else {
                self.layers.ranks - 1 - step
            };
            let keys: Vec<Option<f64>> = self.rows[rank]
                .iter()
                .map(|&v| centre(self.places(&neighbours[v]), median))
                .collect();
            self.sort_row(rank, &keys);
        }
    }

    /// The sorted places of these items.
    fn places(&self, items: &[usize]) -> Vec<usize> {
        let mut places: Vec<usize> = items.iter().map(|&u| self.place[u]).collect();
        places.sort_unstable();
        places
    }

    /// Sorts one row by a key per item of the row; items without a key stay behind the one before them.
    fn sort_row(&mut self, rank: usize, keys: &[Option<f64>]) {
        let row = std::mem::take(&mut self.rows[rank]);
        let mut key = std::collections::BTreeMap::new();
        for (&v, k) in row.iter().zip(keys) {
            key.insert(v, *k);
        }
        let sorted = self.sorted(0, row, &key);
        for (i, &v) in sorted.iter().enumerate() {
            self.place[v] = i;
        }
        self.rows[rank] = sorted;
    }

    fn sorted(&mut self, around: usize, items: Vec<usize>, key: &Keys) -> Vec<usize> {
        let units = units(self.layers, around, items);
        let mut last = -1.0;
        let mut keyed: Vec<(f64, Unit)> = Vec::with_capacity(units.len());
        for unit in units {
            last = mean(unit.items.iter().filter_map(|v| key[v])).unwrap_or(last);
            keyed.push((last, unit));
        }
        self.respect_clusters(&mut keyed);
        let mut result = Vec::new();
        for (_, unit) in keyed {
            match unit.cluster {
                Some(cluster) => result.extend(self.sorted_cluster(cluster, unit.items, key)),
                None => result.extend(unit.items),
            }
        }
        result
    }

    /// The items of one cluster in a row: its top border, what is inside, its bottom border.
    fn sorted_cluster(&mut self, cluster: usize, items: Vec<usize>, key: &Keys) -> Vec<usize> {
        let kind = |v: usize, kind| self.layers.home[v] == cluster && self.layers.kind[v] == kind;
        let (mut top, mut bottom, mut inside) = (Vec::new(), Vec::new(), Vec::new());
        for v in items {
            if kind(v, Kind::Top) {
                top.push(v);
            } else if kind(v, Kind::Bottom) {
                bottom.push(v);
            } else {
                inside.push(v);
            }
        }
        top.extend(self.sorted(cluster, inside, key));
        top.extend(bottom);
        top
    }

    /// Sorts units by key, after the keys of clusters have been made to grow in their order.
    fn respect_clusters(&mut self, units: &mut [(f64, Unit)]) {
        let place = |clusters: &[usize], c: usize| clusters.iter().position(|&other| other == c);
        let mut known: Vec<(usize, usize)> = units
            .iter()
            .enumerate()
            .filter_map(|(i, (_, unit))| Some((place(&self.clusters, unit.cluster?)?, i)))
            .collect();
        known.sort_unstable();
        let keys: Vec<f64> = known.iter().map(|&(_, i)| units[i].0).collect();
        for (&(_, i), key) in known.iter().zip(monotone(&keys, &vec![1.0; keys.len()])) {
            units[i].0 = key;
        }
        let mut tie: Vec<usize> = vec![0; units.len()];
        for (order, &(_, i)) in known.iter().enumerate() {
            tie[i] = 2 * order;
        }
        // A new cluster goes behind the known ones that its key does not precede.
        for (i, (key, unit)) in units.iter().enumerate() {
            if unit.cluster.is_none() || known.iter().any(|&(_, k)| k == i) {
                continue;
            }
            let before = known.iter().filter(|&&(_, k)| units[k].0 <= *key).count();
            tie[i] = (2 * before).saturating_sub(1);
        }
        let mut order: Vec<usize> = (0..units.len()).collect();
        order.sort_by(|&a, &b| {
            let class = |i: usize| (units[i].1.cluster.is_some(), tie[i], i);
            units[a]
                .0
                .total_cmp(&units[b].0)
                .then(class(a).cmp(&class(b)))
        });
        self.learn(order.iter().filter_map(|&i| units[i].1.cluster));
        let mut slots: Vec<Option<(f64, Unit)>> = Vec::new();
        for unit in units.iter_mut() {
            slots.push(Some((
                unit.0,
                std::mem::replace(
                    &mut unit.1,
                    Unit {
                        items: Vec::new(),
                        cluster: None,
                    },
                ),
            )));
        }
        for (slot, from) in units.iter_mut().zip(order) {
            if let Some(unit) = slots[from].take() {
                *slot = unit;
            }
        }
    }

    /// Enters clusters that are new into the order, each behind the one before it.
    fn learn(&mut self, row: impl Iterator<Item = usize>) {
        let mut at = None;
        let mut waiting = Vec::new();
        for cluster in row {
            if let Some(place) = self.clusters.iter().position(|&c| c == cluster) {
                self.clusters.splice(place..place, waiting.drain(..));
                at = self.clusters.iter().position(|&c| c == cluster);
            } else if let Some(place) = at {
                self.clusters.insert(place + 1, cluster);
                at = Some(place + 1);
            } else {
                waiting.push(cluster);
            }
        }
        self.clusters.extend(waiting);
    }

    /// Swaps neighbours in a row while that saves crossings.
    fn transpose(&mut self) {
        for _ in 0..3 {
            let mut better = false;
            for rank in 0..self.layers.ranks {
                let row = self.rows[rank].clone();
                let mut at = 0;
                better |= self.transpose_in(rank, 0, row, &mut at);
            }
            if !better {
                break;
            }
        }
    }

    /// Swaps neighbours that stand directly in one cluster; two clusters are never swapped.
    fn transpose_in(
        &mut self,
        rank: usize,
        around: usize,
        items: Vec<usize>,
        at: &mut usize,
    ) -> bool {
        let mut units = units(self.layers, around, items);
        let mut sides: Vec<[Vec<usize>; 2]> =
            units.iter().map(|unit| self.sides(&unit.items)).collect();
        let mut better = false;
        for i in 1..units.len() {
            let fixed = |unit: &Unit| unit.cluster.is_none() && self.is_border(unit.items[0]);
            let swappable = match (&units[i - 1], &units[i]) {
                (a, b) if a.cluster.is_some() && b.cluster.is_some() => false,
                (a, b) => !fixed(a) && !fixed(b),
            };
            if swappable && saves(&sides[i - 1], &sides[i]) {
                units.swap(i - 1, i);
                sides.swap(i - 1, i);
                better = true;
            }
        }
        for unit in units {
            match unit.cluster {
                Some(cluster) => better |= self.transpose_in(rank, cluster, unit.items, at),
                None => {
                    for v in unit.items {
                        self.rows[rank][*at] = v;
                        self.place[v] = *at;
                        *at += 1;
                    }
                }
            }
        }
        better
    }

    fn is_border(&self, item: usize) -> bool {
        matches!(self.layers.kind[item], Kind::Top | Kind::Bottom)
    }

    /// The sorted places of all neighbours of these items, before and after.
    fn sides(&self, items: &[usize]) -> [Vec<usize>; 2] {
        let side = |neighbours: &[Vec<usize>]| {
            let mut places: Vec<usize> = items
                .iter()
                .flat_map(|&v| neighbours[v].iter().map(|&u| self.place[u]))
                .collect();
            places.sort_unstable();
            places
        };
        [side(&self.layers.up), side(&self.layers.down)]
    }

    fn crossings(&self) -> u64 {
        let mut sum = 0;
        for rank in 1..self.layers.ranks {
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
            let places = self.places(&self.layers.down[v]);
            for &place in &places {
                let (mut at, mut before) = (place + 1, 0);
                while at > 0 {
                    before += tree[at];
                    at &= at - 1;
                }
                sum += total - before;
            }
            for &place in &places {
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

type Keys = std::collections::BTreeMap<usize, Option<f64>>;

/// These items, grouped into what moves as one inside `around`, in order of first appearance.
fn units(layers: &Layers, around: usize, items: Vec<usize>) -> Vec<Unit> {
    let mut units: Vec<Unit> = Vec::new();
    let mut at = std::collections::BTreeMap::new();
    for v in items {
        let cluster = layers.child(around, v);
        let known = cluster.and_then(|c| at.get(&c).copied());
        if let Some(unit) = known {
            let unit: &mut Unit = &mut units[unit];
            unit.items.push(v);
        } else {
            if let Some(c) = cluster {
                at.insert(c, units.len());
            }
            units.push(Unit {
                items: vec![v],
                cluster,
            });
        }
    }
    units
}

/// Whether swapping two neighbours saves crossings, by the sorted places of their neighbours.
fn saves(first: &[Vec<usize>; 2], second: &[Vec<usize>; 2]) -> bool {
    let now: u64 = (0..2)
        .map(|side| inversions(&first[side], &second[side]))
        .sum();
    let then: u64 = (0..2)
        .map(|side| inversions(&second[side], &first[side]))
        .sum();
    then < now
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

/// The barycentre or the weighted median (Gansner and others 1993) of sorted places.
fn centre(places: Vec<usize>, median: bool) -> Option<f64> {
    let n = places.len();
    if !median || n == 0 {
        return mean(places.into_iter().map(|place| place as f64));
    }
    let at = |i: usize| places[i] as f64;
    Some(if n % 2 == 1 {
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
    })
}
