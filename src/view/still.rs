//! The still: a mission in one window. Nothing in it changes, so everything that was ever there is drawn as it was
//! while it ran, with the times at which it was there.
//!
//! In a film, a node that ended in a window is drawn as ended. In a still of a mission of an hour, that would make
//! a planner that ran for 59 minutes grey.

use super::{Frame, Item, ItemId, Looks, Mark, Phrase, Shown, View};
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::graph::{ById, Element};
use crate::mission::Mission;
use crate::mission::event_log::{Event, Kind};

/// The times at which a box of a still was there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Presence {
    /// When it was there, as parts of the mission's time, 0 to 1, sorted and disjoint.
    pub times: Vec<(f64, f64)>,
    /// Its starts, ends and restarts: [`Mark::Added`], [`Mark::Removed`] and [`Mark::Restarted`], sorted by time.
    pub marks: Vec<(f64, Mark)>,
}

/// Makes a still of a view of one window.
pub(super) fn settle(view: &mut View, mission: &Mission) {
    let rows = view.rows.iter_mut().map(|row| &mut row.shown);
    let also = view.also.iter_mut().flat_map(|also| &mut also.shown);
    let items = view.items_shown.iter_mut();
    let boxes = items.chain(view.arrows_shown.iter_mut());
    for shown in rows.chain(also).chain(boxes).flat_map(Looks::each_mut) {
        unmark(shown);
    }
    let times: ById<ItemId, Presence> = view
        .items
        .iter()
        .map(|item| presence(item, mission))
        .collect();
    let is_partial = |presence: &Presence| !presence.marks.is_empty();
    if times.iter().any(is_partial) {
        view.presences = times;
    }
    let nodes = node_count(view);
    if let Some(frame) = view.frames.first_mut() {
        tell(frame, mission, nodes);
    }
}

/// The look of an element while it was there.
fn unmark(shown: &mut Shown) {
    shown.mark = None;
    shown.rates = None;
    shown.is_paused = false;
    shown.inside = None;
    shown.lifecycle = None;
    for row in &mut shown.topics {
        (row.mark, row.rates) = (None, None);
    }
}

/// The times of the nodes in a box; none for a box of topics.
fn presence(item: &Item, mission: &Mission) -> Presence {
    let nodes = || item.members.iter().filter(|what| what.is_node());
    let whole = mission.span;
    let part = |at: Stamp| (at.since(whole.start) as f64 / whole.nanos().max(1) as f64).clamp(0.0, 1.0);
    let lives = nodes().flat_map(|what| mission.elements.seen(*what).lives.iter().copied());
    let times = Span::joined(lives.collect(), 0);
    let mark = |event: &Event| {
        let mark = match event.kind {
            Kind::Started => Mark::Added,
            Kind::Stopped => Mark::Removed,
            Kind::Restarted => Mark::Restarted,
            _ => return None,
        };
        Some((part(event.time), mark))
    };
    let is_own = |event: &&Event| event.is_headline() && nodes().any(|what| *what == event.what);
    let events = mission.log.events.iter().filter(is_own);
    Presence {
        times: times.iter().map(|life| (part(life.start), part(life.end))).collect(),
        marks: events.filter_map(mark).collect(),
    }
}

/// The number of nodes in boxes and in words.
fn node_count(view: &View) -> usize {
    let in_words = view.also.iter().flat_map(|also| &also.items);
    let members = view.items.iter().chain(in_words).flat_map(|item| &item.members);
    members.filter(|what| matches!(what, Element::Node(_))).count()
}

/// Writes the headline: `31 nodes, 7 phases, 2 restarts, 2 topics change hands`.
fn tell(frame: &mut Frame, mission: &Mission, nodes: usize) {
    let many = |kind: Kind| {
        let events = mission.log.headlines(mission.span);
        events.filter(|(_, event)| event.kind == kind).count()
    };
    let hands = match many(Kind::HandedOver) {
        1 => "1 topic changes hands".to_owned(),
        more => format!("{more} topics change hands"),
    };
    let restarts = many(Kind::Restarted);
    let (phases, handed_over) = (mission.log.phases.len(), many(Kind::HandedOver));
    let parts = [
        (true, words::count(nodes, "node")),
        (phases > 1, words::count(phases, "phase")),
        (restarts > 0, words::count(restarts, "restart")),
        (handed_over > 0, hands),
    ];
    let parts = parts.into_iter().filter(|(is_told, _)| *is_told);
    let parts: Vec<String> = parts.map(|(_, words)| words).collect();
    frame.crowds.clear();
    frame.caption = vec![Phrase {
        sign: ' ',
        lead: parts.join(", "),
        ..Phrase::default()
    }];
    frame.note = String::new();
}
