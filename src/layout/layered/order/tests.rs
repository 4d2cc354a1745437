//! The cached values of rows beside freshly computed ones, and the counts that swaps are based on.

use super::*;
use crate::layout::LayerItem;
use crate::layout::layers::{Lane, cut};
use crate::layout::tests::link;
use crate::layout::{Component, Plan};

/// All pairs of edges between two rows that cross.
fn counted(layers: &Layers, rows: &LayerRows) -> u64 {
    let pairs = rows.windows(2).map(|two| {
        let place = |u: &usize| two[1].iter().position(|v| v == u);
        let after = two[0].iter().map(|&v| layers.down[v].iter().map(place));
        let ends: Vec<_> = after
            .enumerate()
            .flat_map(|(at, ends)| ends.map(move |end| (at, end)))
            .collect();
        let crossing =
            |a: &&(usize, Option<usize>), b: &(usize, Option<usize>)| a.0 < b.0 && a.1 > b.1;
        ends.iter()
            .map(|b| ends.iter().filter(|a| crossing(a, b)).count() as u64)
            .sum::<u64>()
    });
    pairs.sum()
}

#[test]
fn cached_rows_equal_recomputed_ones() {
    let (n, mut state) = (24, 5_usize);
    let mut number = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) % below
    };
    for _ in 0..20 {
        let rank: Vec<usize> = (0..n).map(|v| if v < 6 { v } else { number(6) }).collect();
        let part = Component {
            vertices: (0..n).collect(),
            links: (0..40).collect(),
            ends: (0..40).map(|_| (number(n), number(n))).collect(),
            home: (0..n).map(|_| number(4)).collect(),
            parent: vec![0, 0, 1, 0],
            ..Component::default()
        };
        let plan = Plan {
            links: part.ends.iter().map(|&(from, to)| link(from, to)).collect(),
            ..Plan::default()
        };
        let layers = cut(&plan, &part, &rank, Lane::Inside);
        let mut kept = CrossingReducer::new(&layers);
        let keys: Vec<f64> = (0..layers.rank.len()).map(|_| number(100) as f64).collect();
        kept.restart(&keys);
        for sweep in 0..8 {
            kept.sweep(sweep % 2 == 0, sweep % 4 >= 2);
            assert_eq!(kept.crossings(), counted(&layers, &kept.rows(&kept.items)));
            kept.transpose();
            let rows = kept.rows(&kept.items);
            assert_eq!(kept.crossings(), counted(&layers, &rows));
            // A stable row ends the swaps of a fresh start.
            let settled = kept.is_settled.clone();
            kept.is_settled.fill(false);
            (0..layers.ranks).for_each(|rank| kept.changed(rank));
            for rank in (0..layers.ranks).filter(|rank| settled[*rank]) {
                kept.look(rank, 0);
                kept.look(rank, 1);
                assert!(!kept.transpose_in(kept.row(rank)), "row {rank}");
            }
        }
    }
}

#[test]
fn inversions_are_pairs_out_of_order() {
    assert_eq!(inversions(&[1, 3], &[0, 2]), 3);
    assert_eq!(inversions(&[0, 1], &[1, 2]), 0);
}

#[test]
fn the_median_is_weighted_to_the_crowded_side() {
    assert!((centre(&[0, 4, 5, 20], true) - 4.2).abs() < 0.1);
    assert!(centre(&[], true).is_nan());
}

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
