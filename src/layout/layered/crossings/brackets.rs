//! Rows in which clusters nest like brackets, each from its top border to its bottom border.

use std::collections::BTreeMap;

use crate::layout::{LayerItem, Layers};

/// A row in which each cluster is one stretch, from its top border to its bottom border.
pub(super) fn bracketed(layers: &Layers, around: usize, items: Vec<usize>) -> Vec<usize> {
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

/// The number of items from each top border to its bottom border; 1 for any other item.
pub(super) fn extents(layers: &Layers, items: &[usize]) -> Vec<usize> {
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
