//! The order of the items in each layer: barycentre and median sweeps with transposition, fewest crossings kept.
//!
//! It uses its sibling `crossings`; the two are one step, split because of their length.

use super::crossings::CrossingReducer;
use crate::layout::{LayerRows, Layers};

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
        let mut found = (sorter.items().to_vec(), sorter.crossings());
        let mut stalled = 0;
        for sweep in 0..SWEEPS {
            sorter.sweep((sweep % 2 == 0) == downwards, sweep % 4 >= 2);
            sorter.transpose();
            self.effort = self.effort.saturating_sub(edges);
            let crossings = sorter.crossings();
            stalled += 1;
            if crossings < found.1 {
                found.0.clone_from_slice(sorter.items());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::LayerItem;

    /// Three layers of two; each item leads to the one diagonally across.
    fn crossed() -> Layers {
        let mut layers = Layers {
            vertices: 6,
            kind: vec![LayerItem::Vertex; 6],
            rank: vec![0, 0, 1, 1, 2, 2],
            home: vec![0; 6],
            up: vec![Vec::new(); 6],
            down: vec![Vec::new(); 6],
            parent: vec![0],
            ranks: 3,
            ..Layers::default()
        };
        for (from, to) in [(0, 3), (1, 2), (2, 5), (3, 4)] {
            layers.down[from].push(to);
            layers.up[to].push(from);
        }
        layers
    }

    #[test]
    fn avoidable_crossings_are_removed() {
        let LayerOrder { rows, crossings } = order(&crossed(), 1000);
        assert_eq!(crossings, 0);
        assert_eq!(rows.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2, 2]);
    }
}
