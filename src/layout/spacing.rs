//! The space that everything takes: distances across, columns along, and the boxes around clusters.
//!
//! Here x runs along the edges and y across; [`turned`] converts sizes in both directions.

use std::collections::BTreeMap;

use crate::base::geometry::{Point, Rect, Size};
use crate::layout::routes::{PORT_STEP, PORTS};
use crate::layout::{
    LayerItem, LayerRows, Layers, Link, Orientation, PartTask, Plan, around, first_bend, include,
};

/// The space between boxes side by side, and between edges side by side and an edge and anything else: the heads
/// of two arrows side by side are 6 pixels wide and must not touch.
const BOX_GAP: f64 = 12.0;
const EDGE_GAP: f64 = 7.0;
/// The space between a cluster's border and its contents, and outside of it: as between edges, one of which may
/// run along it.
pub(crate) const PADDING: f64 = 7.0;
/// How much higher a box may become for the edges at its sides: the heads of four lines are apart on a box of one line, and
/// it still looks like the others.
const MOST_GROWN: f64 = 2.0;
/// The space below a title for the heads of arrows from above: the title is painted over their lines.
const HEAD: f64 = 9.0;
const MARGIN: f64 = 4.0;
/// The space before and after a label between two layers: its edge is seen on both sides.
const LABEL_GAP: f64 = 12.0;
/// The space that the first self loop takes beside its vertex, and each further one.
const LOOP: (f64, f64) = (14.0, 6.0);

/// The space between a label and its edge.
const ASIDE: f64 = 4.0;
/// The space that edges need to bend twice, as a fraction of the space to bend once: the bends are half as far across.
const TWICE: f64 = 0.45;

/// The bend beside which the label of an edge is placed: about the middle one, in a layer without boxes; for
/// an edge of a fork, the first one, which all of them pass.
fn label_bend(
    plan: &Plan,
    layers: &Layers,
    (link, from): (&Link, usize),
    chain: &[usize],
) -> Option<usize> {
    let bend = if link.fork.is_some() {
        first_bend(chain, chain.first() == Some(&from))
    } else {
        let is_free = |item: &&usize| layers.rank[**item] % 2 == 1;
        let bends = chain.get(1..chain.len().checked_sub(1)?)?;
        let free: Vec<usize> = bends.iter().filter(is_free).copied().collect();
        free.get(free.len() / 2).copied()
    };
    bend.filter(|_| plan.is_labelled)
}

/// The sizes of one part in one orientation.
pub(crate) struct Spacing<'a> {
    pub(crate) layers: &'a Layers,
    orientation: Orientation,
    /// The size of each vertex.
    pub(crate) size: Vec<Size>,
    /// The number of self loops of each vertex.
    loops: Vec<usize>,
    /// The longest label, along the edges, between a layer and the next.
    label: Vec<f64>,
    /// The size of the label beside each bend, if there is one.
    pub(crate) worded: BTreeMap<usize, Size>,
    /// The size of each cluster's title; the first is that of the outside.
    title: Vec<Size>,
    /// The space for the words at the end of each cluster: along, across.
    footer: Vec<(f64, f64)>,
    /// The space below a title across the edges.
    below_title: f64,
}

impl<'a> Spacing<'a> {
    pub(crate) fn new(task: PartTask<'_>, layers: &'a Layers) -> Self {
        let (plan, part, orientation) = (task.plan, task.part, task.orientation);
        let mut loops = vec![0; part.vertices.len()];
        for &(from, _) in part.ends.iter().filter(|(from, to)| from == to) {
            loops[from] += 1;
        }
        let mut label = vec![0.0_f64; layers.ranks];
        let mut worded = BTreeMap::new();
        let links = part.links.iter().map(|&i| &plan.links[i]);
        for ((link, chain), ends) in links.zip(&layers.chains).zip(&part.ends) {
            let bend = label_bend(plan, layers, (link, ends.0), chain);
            if let (Some(size), Some(bend)) = (link.label, bend) {
                worded.insert(bend, turned(size, orientation));
                continue;
            }
            if let (Some(size), &[first, _]) = (link.label, chain.as_slice()) {
                let label = &mut label[layers.rank[first]];
                *label = label.max(turned(size, orientation).w);
            }
        }
        let size = |(at, &v): (usize, &usize)| {
            let size = turned(plan.vertices[v].size, orientation);
            let ports = layers.up[at].len().max(layers.down[at].len());
            let wanted = ports as f64 * PORT_STEP / PORTS;
            Size::new(size.w, size.h.max(wanted.min(size.h * MOST_GROWN)))
        };
        let title = |&c: &usize| {
            let cluster = &plan.clusters[c];
            turned(Size::new(cluster.words(), cluster.title.h), orientation)
        };
        let footer = |&c: &usize| match orientation {
            Orientation::LeftRight => (0.0, plan.clusters[c].footer.h),
            Orientation::TopBottom => (plan.clusters[c].footer.h, 0.0),
        };
        Self {
            layers,
            orientation,
            size: part.vertices.iter().enumerate().map(size).collect(),
            loops,
            label,
            worded,
            below_title: if task.options.is_tight { 0.0 } else { HEAD },
            footer: std::iter::once((0.0, 0.0))
                .chain(part.clusters.iter().map(footer))
                .collect(),
            title: std::iter::once(Size::default())
                .chain(part.clusters.iter().map(title))
                .collect(),
        }
    }

    /// The space that the self loops of a vertex take on each side across.
    pub(crate) fn loop_room(&self, v: usize) -> f64 {
        match self.loops[v] {
            0 => 0.0,
            n => LOOP.0 + LOOP.1 * (n - 1) as f64,
        }
    }

    /// The distances between neighbours in every row.
    pub(crate) fn apart(&self, rows: &LayerRows) -> Vec<Vec<f64>> {
        let distance = |pair: &[usize]| {
            self.reach(pair[0], true) + self.reach(pair[1], false) + self.gap(pair[0], pair[1])
        };
        let apart = rows
            .iter()
            .map(|row| row.windows(2).map(distance).collect());
        let mut apart: Vec<Vec<f64>> = apart.collect();
        for cluster in (1..self.layers.parent.len()).rev() {
            let rank = self.layers.span[cluster].0;
            self.widen_for_title(cluster, &rows[rank], &mut apart[rank]);
        }
        apart
    }

    /// The reach of an item across from its middle; borders reach inwards only.
    fn reach(&self, item: usize, onwards: bool) -> f64 {
        match self.layers.kind[item] {
            LayerItem::Vertex => self.size[item].h / 2.0 + self.loop_room(item),
            LayerItem::Top if onwards => self.headroom(self.layers.home[item]),
            LayerItem::Bottom if !onwards => PADDING + self.footer[self.layers.home[item]].1,
            LayerItem::Bend if onwards == self.is_label_onwards() => {
                self.worded.get(&item).map_or(0.0, |size| size.h + ASIDE)
            }
            _ => 0.0,
        }
    }

    /// Whether labels are on the later side of their edges: to the right of upright ones, and above level ones.
    fn is_label_onwards(&self) -> bool {
        self.orientation == Orientation::TopBottom
    }

    /// The middle of the label beside a bend.
    pub(crate) fn beside(&self, bend: usize, across: &[f64], columns: &[(f64, f64)]) -> Point {
        let (start, end) = columns[self.layers.rank[bend]];
        let (aside, is_onwards) = (self.worded[&bend].h / 2.0 + ASIDE, self.is_label_onwards());
        let aside = if is_onwards { aside } else { -aside };
        Point::new(f64::midpoint(start, end), across[bend] + aside)
    }

    fn gap(&self, a: usize, b: usize) -> f64 {
        match (self.layers.kind[a], self.layers.kind[b]) {
            (LayerItem::Vertex, LayerItem::Vertex) => BOX_GAP,
            (LayerItem::Vertex | LayerItem::Bend, LayerItem::Vertex | LayerItem::Bend) => EDGE_GAP,
            (LayerItem::Top, LayerItem::Vertex | LayerItem::Top)
            | (LayerItem::Vertex | LayerItem::Bottom, LayerItem::Bottom) => 0.0,
            _ => MARGIN,
        }
    }

    /// Keeps the borders of a cluster far enough apart for a title that runs across.
    fn widen_for_title(&self, cluster: usize, row: &[usize], apart: &mut [f64]) {
        let (top, bottom) = self.layers.borders[cluster];
        let at = |item| row.iter().position(|&v| v == item);
        if let (Some(first), Some(last)) = (at(top), at(bottom)) {
            let gaps = &mut apart[first..last];
            let missing = self.title[cluster].h + 2.0 * PADDING - gaps.iter().sum::<f64>();
            if let Some(gap) = gaps.last_mut() {
                *gap += missing.max(0.0);
            }
        }
    }

    /// The extent of every layer along.
    pub(crate) fn columns(&self, rows: &LayerRows, across: &[f64]) -> Vec<(f64, f64)> {
        let gaps = self.gaps(rows, |v, u| (across[v] - across[u]).abs());
        let mut width = self.widths();
        // The last layer of a cluster is wide enough for a title that runs along.
        for cluster in 1..self.layers.parent.len() {
            let (low, high) = self.layers.span[cluster];
            let own = width[low..=high].iter().sum::<f64>() + gaps[low..high].iter().sum::<f64>();
            width[high] += (self.title[cluster].w - own).max(0.0);
        }
        self.lined_up(&width, &gaps)
    }

    /// The least size of a drawing of these rows, along and across, and the least length of its edges: those
    /// of a drawing with level edges and without titles.
    pub(crate) fn least(&self, rows: &LayerRows, apart: &[Vec<f64>]) -> (Size, f64) {
        let columns = self.lined_up(&self.widths(), &self.gaps(rows, |_, _| 0.0));
        let reach = |v: usize| self.size.get(v).map_or(0.0, |size| size.h / 2.0);
        let is_inside =
            |v: &usize| matches!(self.layers.kind[*v], LayerItem::Vertex | LayerItem::Bend);
        let across = rows.iter().zip(apart).filter_map(|(row, apart)| {
            let first = row.iter().position(is_inside)?;
            let last = row.iter().rposition(is_inside)?;
            let between: f64 = apart[first..last].iter().sum();
            Some(reach(row[first]) + between + reach(row[last]))
        });
        let across = across.fold(0.0, f64::max);
        let along = columns.last().map_or(0.0, |last| last.1 - columns[0].0);
        let level = self.layers.chains.iter().filter_map(|chain| {
            let (first, last) = (chain.first()?, chain.last()?);
            Some(columns[self.layers.rank[*last]].0 - columns[self.layers.rank[*first]].1)
        });
        (Size::new(along, across), level.sum())
    }

    /// The space after every row: for its labels, and for edges to bend, which rise by these amounts.
    fn gaps(&self, rows: &LayerRows, rise: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let bending = rows.iter().map(|row| self.bending_room(row, &rise));
        let gaps = bending.zip(&self.label);
        gaps.map(|(room, label)| room.max(label + LABEL_GAP))
            .collect()
    }

    /// Layers of these widths, one after the other with these gaps.
    fn lined_up(&self, width: &[f64], gaps: &[f64]) -> Vec<(f64, f64)> {
        let mut at = 0.0;
        let mut columns = Vec::with_capacity(width.len());
        for ((width, gap), depth) in width.iter().zip(gaps).zip(self.depths()) {
            at += depth.0;
            columns.push((at, at + width));
            at += width + depth.1 + gap;
        }
        columns
    }

    fn widths(&self) -> Vec<f64> {
        let mut width = vec![0.0_f64; self.layers.ranks];
        let labels = self.worded.iter().map(|(&bend, size)| (bend, size));
        for (v, size) in self.size.iter().enumerate().chain(labels) {
            let width = &mut width[self.layers.rank[v]];
            *width = width.max(size.w);
        }
        width
    }

    /// The space that borders of clusters need before and after every layer.
    fn depths(&self) -> Vec<(f64, f64)> {
        let mut depth = vec![(0.0_f64, 0.0_f64); self.layers.ranks];
        for cluster in 1..self.layers.parent.len() {
            let (low, high) = self.layers.span[cluster];
            let (before, after) = (self.depth(cluster, low).0, self.depth(cluster, high).1);
            depth[low].0 = depth[low].0.max(before);
            depth[high].1 = depth[high].1.max(after);
        }
        depth
    }

    /// The space that the borders from `cluster` outwards need before and after a layer.
    fn depth(&self, cluster: usize, rank: usize) -> (f64, f64) {
        let (mut before, mut after) = (0.0, 0.0);
        for cluster in around(&self.layers.parent, cluster) {
            let (low, high) = self.layers.span[cluster];
            if low == rank {
                before += self.lead(cluster);
            }
            if high == rank {
                after += PADDING + self.footer[cluster].0;
            }
        }
        (before, after)
    }

    /// The space between the border at which a cluster begins along and its contents.
    fn lead(&self, cluster: usize) -> f64 {
        match self.orientation {
            Orientation::LeftRight => PADDING,
            Orientation::TopBottom => PADDING + self.title[cluster].w + self.below_title,
        }
    }

    /// The space between the border at which a cluster begins across and its contents.
    fn headroom(&self, cluster: usize) -> f64 {
        match self.orientation {
            Orientation::LeftRight => PADDING + self.title[cluster].h,
            Orientation::TopBottom => PADDING,
        }
    }

    /// The space that edges need to bend after a row: more for many and for steep ones.
    fn bending_room(&self, row: &[usize], rise: impl Fn(usize, usize) -> f64) -> f64 {
        let (mut edges, mut steepest) = (0.0, 0.0_f64);
        let is_edge =
            |v: &&usize| matches!(self.layers.kind[**v], LayerItem::Vertex | LayerItem::Bend);
        for &v in row.iter().filter(is_edge) {
            for &u in &self.layers.down[v] {
                edges += 1.0;
                steepest = steepest.max(rise(v, u));
            }
        }
        let room = 20.0 + (edges * 0.4_f64).min(11.0) + (steepest * 0.04).min(16.0);
        // Between two layers of boxes edges then bend twice.
        if self.worded.is_empty() {
            room
        } else {
            room * TWICE
        }
    }

    /// A box around each cluster, children inside their parents, all within their borders.
    pub(crate) fn frames(
        &self,
        boxes: &[Rect],
        across: &[f64],
        columns: &[(f64, f64)],
    ) -> Vec<Rect> {
        let mut content: Vec<Option<Rect>> = vec![None; self.layers.parent.len()];
        for (v, rect) in boxes.iter().enumerate() {
            let room = self.loop_room(v);
            let rect = Rect::new(rect.x, rect.y - room, rect.w, rect.h + 2.0 * room);
            include(&mut content[self.layers.home[v]], rect);
        }
        for (&bend, size) in &self.worded {
            let label = Rect::around(self.beside(bend, across, columns), *size);
            include(&mut content[self.layers.home[bend]], label);
        }
        let mut frames = vec![Rect::default(); self.layers.parent.len()];
        for cluster in (1..frames.len()).rev() {
            let inside = content[cluster].unwrap_or_default();
            frames[cluster] = self.frame(cluster, &inside, across, columns);
            include(&mut content[self.layers.parent[cluster]], frames[cluster]);
        }
        frames.split_off(1)
    }

    fn frame(
        &self,
        cluster: usize,
        content: &Rect,
        across: &[f64],
        columns: &[(f64, f64)],
    ) -> Rect {
        let ((top, bottom), (low, high)) =
            (self.layers.borders[cluster], self.layers.span[cluster]);
        let (lead, head) = (self.lead(cluster), self.headroom(cluster));
        let (tail, foot) = self.footer[cluster];
        let (w, h) = (
            content.w + lead + PADDING + tail,
            content.h + head + PADDING + foot,
        );
        let mut frame = Rect::new(content.x - lead, content.y - head, w, h);
        // A longer title may need the space up to the borders.
        let wanted = self.title[cluster];
        let room = (columns[low].0 - lead, columns[high].1 + PADDING + tail);
        (frame.x, frame.w) = stretched((frame.x, frame.w), wanted.w + 2.0 * PADDING, room);
        let room = (across[top], across[bottom]);
        (frame.y, frame.h) = stretched((frame.y, frame.h), wanted.h + 2.0 * PADDING, room);
        frame
    }
}

/// A stretch `(start, length)` made at least `wanted` long: to its end if there is space, else to its start
/// too.
fn stretched((start, length): (f64, f64), wanted: f64, room: (f64, f64)) -> (f64, f64) {
    if length >= wanted {
        return (start, length);
    }
    let end = room.1.max(start + length);
    (start.min(end - wanted).max(room.0.min(start)), wanted)
}

/// Converts a size on the page to along and across, or back.
pub(crate) fn turned(size: Size, orientation: Orientation) -> Size {
    match orientation {
        Orientation::LeftRight => size,
        Orientation::TopBottom => Size::new(size.h, size.w),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_extended_segment_contains_the_original() {
        assert_eq!(stretched((10.0, 30.0), 50.0, (0.0, 100.0)), (10.0, 50.0));
        assert_eq!(stretched((10.0, 30.0), 50.0, (0.0, 45.0)), (0.0, 50.0));
        assert_eq!(stretched((10.0, 30.0), 35.0, (0.0, 20.0)), (5.0, 35.0));
    }
}
