//! The places of the items of each layer across: as near to their neighbours as order and gaps allow.

use crate::layout::{LayerItem, LayerRows, Layers, monotone};

/// The number of times that all layers are placed.
const SWEEPS: usize = 40;

/// The middle of each item across. `half` is half the extent of each item, `gaps` the room between neighbours per row.
pub(crate) fn place(layers: &Layers, rows: &LayerRows, apart: &[Vec<f64>]) -> Vec<f64> {
    let mut y = packed(layers, rows, apart);
    for sweep in 0..SWEEPS {
        for step in 0..rows.len() {
            let rank = if sweep % 2 == 0 {
                step
            } else {
                rows.len() - 1 - step
            };
            let (goal, weight) = goals(layers, &rows[rank], &y, sweep);
            let placed = separated(&goal, &weight, &apart[rank]);
            for (&v, place) in rows[rank].iter().zip(placed) {
                y[v] = place;
            }
        }
    }
    let y = straighten_borders(layers, rows, apart, &y);
    inside_borders(layers, rows, apart, y)
}

/// Every row packed around 0.
fn packed(layers: &Layers, rows: &LayerRows, apart: &[Vec<f64>]) -> Vec<f64> {
    let mut y = vec![0.0; layers.rank.len()];
    for (row, apart) in rows.iter().zip(apart) {
        let mut at = -apart.iter().sum::<f64>() / 2.0;
        for (i, &v) in row.iter().enumerate() {
            if i > 0 {
                at += apart[i - 1];
            }
            y[v] = at;
        }
    }
    y
}

/// The goal of each item of a row, and the weight of that goal.
fn goals(layers: &Layers, row: &[usize], y: &[f64], sweep: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut goal, mut weight) = (Vec::new(), Vec::new());
    for &v in row {
        let both = sweep >= 6 && (sweep < 100 || layers.kind[v] != LayerItem::Bend);
        let before = layers.up[v]
            .iter()
            .filter(|_| both || sweep.is_multiple_of(2));
        let after = layers.down[v].iter().filter(|_| both || sweep % 2 == 1);
        let (mut sum, mut pull) = (0.0, 0.0);
        for &u in before.chain(after) {
            let w = stiffness(layers.kind[v], layers.kind[u]);
            sum += w * y[u];
            pull += w;
        }
        goal.push(if pull > 0.0 { sum / pull } else { y[v] });
        weight.push(if pull > 0.0 { pull } else { 0.05 });
    }
    (goal, weight)
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

/// Places the items anew between the borders, which stay.
fn inside_borders(
    layers: &Layers,
    rows: &LayerRows,
    apart: &[Vec<f64>],
    mut y: Vec<f64>,
) -> Vec<f64> {
    let border = |v: usize| matches!(layers.kind[v], LayerItem::Top | LayerItem::Bottom);
    for sweep in (6..14).chain([100, 102, 104]) {
        for step in 0..rows.len() {
            let rank = if sweep % 2 == 0 {
                step
            } else {
                rows.len() - 1 - step
            };
            let row = &rows[rank];
            let (goal, weight) = goals(layers, row, &y, sweep);
            let mut start = 0;
            while start < row.len() {
                if border(row[start]) {
                    start += 1;
                    continue;
                }
                let end = (start..row.len())
                    .find(|&i| border(row[i]))
                    .unwrap_or(row.len());
                let gaps = &apart[rank][start..end - 1];
                let placed = separated(&goal[start..end], &weight[start..end], gaps);
                let low = start.checked_sub(1).map(|i| y[row[i]] + apart[rank][i]);
                let high = row.get(end).map(|&v| y[v] - apart[rank][end - 1]);
                let total: f64 = gaps.iter().sum();
                let mut offset = 0.0;
                for (i, place) in placed.into_iter().enumerate() {
                    offset += if i > 0 { gaps[i - 1] } else { 0.0 };
                    let place = high.map_or(place, |high| place.min(high - (total - offset)));
                    y[row[start + i]] = low.map_or(place, |low| place.max(low + offset));
                }
                start = end;
            }
        }
    }
    y
}

/// The places that come nearest to the goals (weighted squares) with at least these gaps between neighbours.
fn separated(goal: &[f64], weight: &[f64], apart: &[f64]) -> Vec<f64> {
    let mut offset = 0.0;
    let mut offsets = Vec::with_capacity(goal.len());
    for i in 0..goal.len() {
        offset += if i > 0 { apart[i - 1] } else { 0.0 };
        offsets.push(offset);
    }
    let shifted: Vec<f64> = goal.iter().zip(&offsets).map(|(g, o)| g - o).collect();
    let mut placed = monotone(&shifted, weight);
    for (place, offset) in placed.iter_mut().zip(&offsets) {
        *place += offset;
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_kept() {
        assert_eq!(separated(&[0.0, 0.0], &[1.0, 1.0], &[10.0]), [-5.0, 5.0]);
    }
}
