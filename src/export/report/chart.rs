//! The chart of a report: the part of the graph that changed, with its neighbours, small enough for Markdown.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use crate::base::words;
use crate::draw::style::{BUILTIN, Style};
use crate::export::{markdown, mermaid};
use crate::view::{ArrowId, ItemId, Mark, SeenWindow, Shown, ShownRuns, View};

/// The most edges that are drawn.
const MOST_EDGES: usize = 60;
/// The most boxes that are drawn.
const MOST_ITEMS: usize = 80;

/// The most characters of a chart; a longer one is left out, as GitHub's Mermaid stops at 50,000.
const MOST_CHART: usize = 45_000;
/// The most edges of an expanded chart; larger ones are collapsed.
const MOST_EDGES_OPEN: usize = 25;

/// The chart of what changed, with its legend; nothing without changes. One with many edges is of `paired`, if that is given.
pub(super) fn chart<'a>(mut view: &'a View, paired: Option<&'a View>) -> String {
    let mut found = changed(view);
    let is_large = |(seen, _): &(SeenWindow, usize)| seen.arrows.len() > mermaid::MANY;
    if let Some(paired) = paired.filter(|_| found.as_ref().is_some_and(is_large)) {
        (view, found) = (paired, changed(paired));
    }
    // The picture's style may be dark, but Markdown has any background.
    let (Some((seen, left_out)), Ok(style)) = (found, Style::builtin(BUILTIN[0].0)) else {
        return String::new();
    };
    let chart = mermaid::chart(view, &style, &seen);
    if chart.len() > MOST_CHART {
        return "The graph of the changes is too large for Markdown.\n\n".to_owned();
    }
    let mut out = markdown::block("mermaid", chart.trim_end());
    out += "\n\nSolid green: present only at the end. Dashed orange: present only at the start. Purple: changed in between.\n";
    if left_out > 0 {
        let edges = words::count(left_out, "edge");
        let _ = writeln!(out, "\n{edges} left out of the graph.");
    }
    let edges = words::count(seen.arrows.len(), "edge");
    if seen.arrows.len() > MOST_EDGES_OPEN {
        return markdown::folded(&format!("Graph of the changes ({edges})"), &out);
    }
    format!("Changed elements and their neighbours:\n\n{out}\n")
}

/// Every element that changed during the mission with its neighbours, as one window, and the number of edges
/// left out; `None` without changes. An element is marked as added or removed if it exists only at the end or
/// only at the start, else as changed if it ever changed.
pub(super) fn changed(view: &View) -> Option<(SeenWindow, usize)> {
    let last = view.frames.len().checked_sub(1)?;
    let mut items = ends(&view.items_shown, last);
    let mut arrows = ends(&view.arrows_shown, last);
    let is_changed =
        |ends: &BTreeMap<u32, Shown>, id: u32| ends.get(&id).is_some_and(|s| s.mark.is_some());
    let mut wanted: Vec<(bool, ArrowId)> = Vec::new();
    for (id, arrow) in view.arrows.with_ids() {
        let is_beside = !is_changed(&arrows, id.0);
        let mut ends = [arrow.from, arrow.to].into_iter();
        if !is_beside || ends.any(|end| is_changed(&items, end.0)) {
            wanted.push((is_beside, id));
        }
    }
    wanted.sort_unstable();
    let left_out = wanted.len().saturating_sub(MOST_EDGES);
    wanted.truncate(MOST_EDGES);
    let mut drawn: Vec<ArrowId> = wanted.iter().map(|(_, id)| *id).collect();
    drawn.sort_unstable();
    let mut boxes: BTreeSet<ItemId> = BTreeSet::new();
    for id in &drawn {
        let arrow = &view.arrows[*id];
        boxes.extend([arrow.from, arrow.to]);
    }
    // A box whose edges are left out would look unconnected.
    let linked: BTreeSet<ItemId> = view.arrows.iter().flat_map(|a| [a.from, a.to]).collect();
    let changed = items.values().filter(|shown| shown.mark.is_some());
    let unlinked = changed.map(Shown::item).filter(|id| !linked.contains(id));
    boxes.extend(unlinked.take(MOST_ITEMS.saturating_sub(boxes.len())));
    if boxes.is_empty() {
        return None;
    }
    let seen = SeenWindow {
        items: boxes.iter().filter_map(|id| items.remove(&id.0)).collect(),
        arrows: drawn.iter().filter_map(|id| arrows.remove(&id.0)).collect(),
    };
    Some((seen, left_out))
}

/// The outcome of each element up to window `last`: its last state, with a mark for the whole mission.
fn ends(all: &[ShownRuns], last: usize) -> BTreeMap<u32, Shown> {
    let ends = all.iter().filter_map(|looks| end(looks, last));
    ends.map(|shown| (shown.id, shown)).collect()
}

fn end(looks: &ShownRuns, last: usize) -> Option<Shown> {
    let is_gone = |shown: &Shown| shown.mark == Some(Mark::Removed);
    let runs = || looks.runs().filter_map(|(_, shown)| shown);
    let end = runs().rev().find(|shown| !is_gone(shown));
    let end = end.or_else(|| runs().next())?;
    let there = |k: usize| looks.at(k).is_some_and(|shown| !is_gone(shown));
    let is_marked = runs().any(|shown| shown.mark.is_some());
    Some(Shown {
        steps: Vec::new(),
        mark: match (there(0), there(last)) {
            (false, true) => Some(Mark::Added),
            (true, false) => Some(Mark::Removed),
            _ => is_marked.then_some(Mark::Changed),
        },
        ..end.clone()
    })
}
