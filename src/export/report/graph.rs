//! The part of the graph that changed, with its neighbours, small enough to be drawn in Markdown.

use std::collections::{BTreeMap, BTreeSet};

use crate::view::{Counts, Frame, Mark, Shown, View};

/// The most edges that are drawn.
const MOST_EDGES: usize = 60;
/// The most boxes that are drawn.
const MOST_ITEMS: usize = 80;

/// Everything that changed during the mission with what it is connected to, as one window, and how many edges were
/// left out; `None` where nothing changed. An element is marked added or removed if it is there only at the end or
/// only at the start, else changed if it ever was.
pub(super) fn changed(view: &View) -> Option<(Frame, usize)> {
    let frame = view.frames.last()?;
    let items = fates(view, |f| &f.items);
    let arrows = fates(view, |f| &f.arrows);
    let is_changed =
        |fates: &BTreeMap<u32, Shown>, id: u32| fates.get(&id).is_some_and(|s| s.mark.is_some());
    let mut wanted: Vec<(u8, u32)> = Vec::new();
    for (arrow, id) in view.arrows.iter().zip(0..) {
        let ends = [arrow.from, arrow.to]
            .iter()
            .filter(|end| is_changed(&items, **end))
            .count();
        let own = is_changed(&arrows, id);
        match (own, ends) {
            (false, 0) => {}
            (true, _) => wanted.push((0, id)),
            (false, _) => wanted.push((1, id)),
        }
    }
    wanted.sort_unstable();
    let left_out = wanted.len().saturating_sub(MOST_EDGES);
    wanted.truncate(MOST_EDGES);
    let mut drawn: Vec<u32> = wanted.iter().map(|(_, id)| *id).collect();
    drawn.sort_unstable();
    let mut boxes: BTreeSet<u32> = BTreeSet::new();
    for id in &drawn {
        let arrow = &view.arrows[*id as usize];
        boxes.extend([arrow.from, arrow.to]);
    }
    let changed_items = items
        .iter()
        .filter(|(_, s)| s.mark.is_some())
        .map(|(id, _)| *id);
    for id in changed_items {
        if boxes.len() < MOST_ITEMS {
            boxes.insert(id);
        }
    }
    if boxes.is_empty() {
        return None;
    }
    let pick = |fates: &BTreeMap<u32, Shown>, ids: &mut dyn Iterator<Item = u32>| -> Vec<Shown> {
        ids.filter_map(|id| fates.get(&id).cloned()).collect()
    };
    let frame = Frame {
        items: pick(&items, &mut boxes.into_iter()),
        arrows: pick(&arrows, &mut drawn.into_iter()),
        headlines: Vec::new(),
        rolls: Vec::new(),
        counts: Counts::default(),
        caption: Vec::new(),
        ..*frame
    };
    Some((frame, left_out))
}

/// What became of each element: its last state, with a mark for the whole mission.
fn fates(view: &View, shown: fn(&Frame) -> &[Shown]) -> BTreeMap<u32, Shown> {
    let mut fates: BTreeMap<u32, Shown> = BTreeMap::new();
    let mut marked = BTreeSet::new();
    for one in view.frames.iter().flat_map(shown) {
        if one.mark.is_some() {
            marked.insert(one.id);
        }
        if one.mark != Some(Mark::Removed) || !fates.contains_key(&one.id) {
            fates.insert(one.id, one.clone());
        }
    }
    let there = |frame: Option<&Frame>| -> BTreeSet<u32> {
        let all = frame.map_or(&[][..], shown).iter();
        all.filter(|s| s.mark != Some(Mark::Removed))
            .map(|s| s.id)
            .collect()
    };
    let (first, last) = (there(view.frames.first()), there(view.frames.last()));
    for (id, fate) in &mut fates {
        fate.rates = None;
        fate.mark = match (first.contains(id), last.contains(id)) {
            (false, true) => Some(Mark::Added),
            (true, false) => Some(Mark::Removed),
            _ => marked.contains(id).then_some(Mark::Changed),
        };
    }
    fates
}
