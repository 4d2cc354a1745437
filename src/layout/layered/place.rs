//! The places of the items of each layer across: as near to their neighbours as order and gaps allow.

use std::ops::Range;

use crate::layout::isotonic::Monotone;
use crate::layout::{LayerItem, LayerRows, Layers};

/// The number of times that all layers are placed.
const SWEEPS: usize = 40;
/// The sweep from which items are pulled to both sides, and the one from which bends follow one side only.
const BOTH: usize = 6;
const LAST: usize = 100;

/// The middle of each item across, for rows whose neighbours must be at least so far apart.
pub(crate) fn place(layers: &Layers, rows: &LayerRows, apart: &[Vec<f64>]) -> Vec<f64> {
    let mut table = Table::new(layers, rows);
    for (rank, apart) in apart.iter().enumerate() {
        table.pack(rank, apart);
    }
    for sweep in 0..SWEEPS {
        for rank in table.ranks(sweep) {
            table.settle(
                table.start[rank]..table.start[rank + 1],
                sweep,
                |_, place| place,
            );
        }
    }
    let across = straighten_borders(layers, rows, apart, &table.by_item());
    table.inside_borders(&across, apart);
    table.by_item()
}

/// The items of all rows, row by row, while they are being placed.
struct Table<'a> {
    layers: &'a Layers,
    items: Vec<usize>,
    /// Where each row begins; one more than there are rows.
    start: Vec<usize>,
    /// Where the neighbours of each item begin in `pulls`, and those of them that are in the row after it.
    first: Vec<(usize, usize)>,
    /// The neighbours of all items by their places in `items`, with the weight with which they pull.
    pulls: Vec<(usize, f64)>,
    /// The distance of each item from the first of those that it is placed with, if they stand as near as they may.
    offset: Vec<f64>,
    /// The middle of each item across.
    across: Vec<f64>,
    monotone: Monotone,
}

impl<'a> Table<'a> {
    fn new(layers: &'a Layers, rows: &LayerRows) -> Self {
        let items = rows.concat();
        let mut start = vec![0];
        start.extend(rows.iter().scan(0, |sum, row| {
            *sum += row.len();
            Some(*sum)
        }));
        let mut place = vec![0; items.len()];
        for (at, &v) in items.iter().enumerate() {
            place[v] = at;
        }
        let (mut first, mut pulls) = (Vec::with_capacity(items.len() + 1), Vec::new());
        for &v in &items {
            let pull = |&u: &usize| (place[u], stiffness(layers.kind[v], layers.kind[u]));
            let begin = pulls.len();
            pulls.extend(layers.up[v].iter().map(pull));
            first.push((begin, pulls.len()));
            pulls.extend(layers.down[v].iter().map(pull));
        }
        first.push((pulls.len(), pulls.len()));
        Self {
            layers,
            start,
            first,
            pulls,
            offset: vec![0.0; items.len()],
            across: vec![0.0; items.len()],
            items,
            monotone: Monotone::default(),
        }
    }

    /// Packs a row around 0.
    fn pack(&mut self, rank: usize, apart: &[f64]) {
        let row = self.start[rank]..self.start[rank + 1];
        self.measure(row.clone(), apart);
        let mut at = -apart.iter().sum::<f64>() / 2.0;
        for (i, item) in row.enumerate() {
            at += if i > 0 { apart[i - 1] } else { 0.0 };
            self.across[item] = at;
        }
    }

    /// Takes the offsets of items that are placed together from the gaps between them.
    fn measure(&mut self, together: Range<usize>, apart: &[f64]) {
        let mut offset = 0.0;
        for (i, at) in together.enumerate() {
            offset += if i > 0 { apart[i - 1] } else { 0.0 };
            self.offset[at] = offset;
        }
    }

    /// The rows in the direction of a sweep.
    fn ranks(&self, sweep: usize) -> impl Iterator<Item = usize> + use<> {
        let ranks = self.start.len() - 1;
        (0..ranks).map(move |step| {
            if sweep.is_multiple_of(2) {
                step
            } else {
                ranks - 1 - step
            }
        })
    }

    /// Places items of a row together, as near to their goals (weighted squares) as the gaps between them allow, and each
    /// of them within `limits`.
    fn settle(&mut self, together: Range<usize>, sweep: usize, limits: impl Fn(f64, f64) -> f64) {
        let mut monotone = std::mem::take(&mut self.monotone);
        let wishes = together.clone().map(|at| {
            let (goal, weight) = self.goal(at, sweep);
            (goal - self.offset[at], weight)
        });
        monotone.pool(wishes);
        for (at, place) in together.zip(monotone.nearest()) {
            let offset = self.offset[at];
            self.across[at] = limits(offset, place + offset);
        }
        self.monotone = monotone;
    }

    /// The goal of an item, and the weight of that goal.
    fn goal(&self, at: usize, sweep: usize) -> (f64, f64) {
        let is_bend = || self.layers.kind[self.items[at]] == LayerItem::Bend;
        let ((before, after), end) = (self.first[at], self.first[at + 1].0);
        let near = if sweep >= BOTH && (sweep < LAST || !is_bend()) {
            before..end
        } else if sweep.is_multiple_of(2) {
            before..after
        } else {
            after..end
        };
        let (mut sum, mut pull) = (0.0, 0.0);
        for &(other, weight) in &self.pulls[near] {
            sum += weight * self.across[other];
            pull += weight;
        }
        if pull > 0.0 {
            (sum / pull, pull)
        } else {
            (self.across[at], 0.05)
        }
    }

    /// Places the items anew between the borders, which stay where they are in `across`.
    fn inside_borders(&mut self, across: &[f64], apart: &[Vec<f64>]) {
        let mut stretches = vec![Vec::new(); apart.len()];
        for (at, &v) in self.items.iter().enumerate() {
            self.across[at] = across[v];
        }
        for (rank, apart) in apart.iter().enumerate() {
            let start = self.start[rank];
            let row = &self.items[start..self.start[rank + 1]];
            let is_border =
                |v: &usize| matches!(self.layers.kind[*v], LayerItem::Top | LayerItem::Bottom);
            let mut from = 0;
            for inside in row.split(is_border) {
                let (begin, end) = (from, from + inside.len());
                from = end + 1;
                if !inside.is_empty() {
                    stretches[rank].push((
                        start + begin..start + end,
                        begin.checked_sub(1).map(|i| apart[i]),
                        apart.get(end - 1).copied(),
                    ));
                }
            }
            for (stretch, ..) in &stretches[rank] {
                let begin = stretch.start - start;
                self.measure(stretch.clone(), &apart[begin..]);
            }
        }
        for sweep in (BOTH..14).chain([LAST, LAST + 2, LAST + 4]) {
            for rank in self.ranks(sweep) {
                for (stretch, before, after) in &stretches[rank] {
                    let total = self.offset[stretch.end - 1];
                    let low = before.map(|gap| self.across[stretch.start - 1] + gap);
                    let high = after.map(|gap| self.across[stretch.end] - gap);
                    self.settle(stretch.clone(), sweep, |offset, place| {
                        let place = high.map_or(place, |high| place.min(high - (total - offset)));
                        low.map_or(place, |low| place.max(low + offset))
                    });
                }
            }
        }
    }

    fn by_item(&self) -> Vec<f64> {
        let mut across = vec![0.0; self.items.len()];
        for (&v, place) in self.items.iter().zip(&self.across) {
            across[v] = *place;
        }
        across
    }
}

/// The weight with which two linked items are pulled into line: bends most, so that long edges come out straight.
fn stiffness(a: LayerItem, b: LayerItem) -> f64 {
    match (a, b) {
        (LayerItem::Vertex, LayerItem::Vertex) => 1.0,
        (LayerItem::Vertex, _) | (_, LayerItem::Vertex) => 2.5,
        (LayerItem::Bend, _) | (_, LayerItem::Bend) => 8.0,
        _ => 24.0,
    }
}

/// Gives each border one place in all its layers: the middle of the highest and the lowest places that keep every gap.
fn straighten_borders(
    layers: &Layers,
    rows: &LayerRows,
    apart: &[Vec<f64>],
    y: &[f64],
) -> Vec<f64> {
    let n = y.len();
    let mut same: Vec<usize> = (0..n).collect();
    for (cluster, &(low, high)) in layers.span.iter().enumerate().skip(1) {
        let (top, bottom) = layers.borders[cluster];
        for step in 0..=(high - low) {
            same[top + 2 * step] = top;
            same[bottom + 2 * step] = bottom;
        }
    }
    let mut options = vec![(0.0, 0.0); n];
    for v in 0..n {
        let (sum, count) = &mut options[same[v]];
        *sum += y[v];
        *count += 1.0;
    }
    let mut edges = Vec::new();
    for (row, apart) in rows.iter().zip(apart) {
        for (pair, gap) in row.windows(2).zip(apart) {
            edges.push((same[pair[0]], same[pair[1]], *gap));
        }
    }
    let goal: Vec<f64> = options
        .iter()
        .map(|(sum, count)| sum / f64::max(*count, 1.0))
        .collect();
    let low = pushed(n, edges.iter().copied(), &goal);
    let negative: Vec<f64> = goal.iter().map(|g| -g).collect();
    let high = pushed(n, edges.iter().map(|&(a, b, gap)| (b, a, gap)), &negative);
    (0..n)
        .map(|v| (low[same[v]] - high[same[v]]) / 2.0)
        .collect()
}

/// The least places, not below the goals, that keep every gap.
fn pushed(n: usize, edges: impl Iterator<Item = (usize, usize, f64)>, goal: &[f64]) -> Vec<f64> {
    let mut after: Vec<Vec<(usize, f64)>> = vec![Vec::new(); n];
    let mut waiting = vec![0; n];
    for (a, b, gap) in edges {
        after[a].push((b, gap));
        waiting[b] += 1;
    }
    let mut y = goal.to_vec();
    let mut ready: Vec<usize> = (0..n).filter(|&v| waiting[v] == 0).collect();
    while let Some(v) = ready.pop() {
        for &(u, gap) in &after[v] {
            y[u] = y[u].max(y[v] + gap);
            waiting[u] -= 1;
            if waiting[u] == 0 {
                ready.push(u);
            }
        }
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_kept() {
        let layers = Layers {
            vertices: 2,
            kind: vec![LayerItem::Vertex; 2],
            rank: vec![0; 2],
            home: vec![0; 2],
            up: vec![Vec::new(); 2],
            down: vec![Vec::new(); 2],
            parent: vec![0],
            span: vec![(0, 0)],
            borders: vec![(0, 0)],
            ranks: 1,
            ..Layers::default()
        };
        assert_eq!(
            place(&layers, &vec![vec![1, 0]], &[vec![10.0]]),
            [5.0, -5.0]
        );
    }
}
