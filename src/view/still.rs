//! The still: a mission in one window. Nothing in it changes, so everything that was ever there is drawn as it was
//! while it ran, with the times at which it was there.
//!
//! In a film, a node that ended in a window is drawn as ended. In a still of a mission of an hour, that would make
//! a planner that ran for 59 minutes grey.

use std::collections::BTreeSet;

use super::stable::Lengths;
use super::union::whole;
use super::{Counts, Frame, Item, ItemId, Looks, Mark, Phrase, View};
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

/// All windows of a view as one.
pub(super) fn still(mut view: View, mission: &Mission) -> View {
    let lengths = Lengths::new(view.frames.iter().map(|f| f.span));
    let rows = view.rows.iter_mut().map(|row| &mut row.shown);
    let also = view.also.iter_mut().flat_map(|also| &mut also.shown);
    let items = view.items_shown.iter_mut();
    let boxes = items.chain(view.arrows_shown.iter_mut());
    for looks in rows.chain(also).chain(boxes) {
        *looks = Looks::of([whole(looks, &lengths).as_ref()]);
    }
    let presences: ById<ItemId, Presence> = view
        .items
        .iter()
        .map(|item| presence(item, mission))
        .collect();
    if presences.iter().any(|presence| !presence.marks.is_empty()) {
        view.presences = presences;
    }
    let headlines = view.frames.iter_mut();
    let headlines: Vec<_> = headlines
        .flat_map(|f| std::mem::take(&mut f.headlines))
        .collect();
    let mut frame = Frame {
        messages: mission.messages,
        counts: Counts::of(&headlines),
        caption: headline(mission, roles(&view, mission)),
        headlines,
        ..Frame::empty(0, mission.span)
    };
    if !view.presences.is_empty() {
        "under each node: when it ran".clone_into(&mut frame.note);
    }
    view.frames = vec![frame];
    view
}

/// The times of the nodes in a box; none for a box of topics.
fn presence(item: &Item, mission: &Mission) -> Presence {
    let nodes = || item.members.iter().filter(|what| what.is_node());
    let whole = mission.span;
    let part =
        |at: Stamp| (at.since(whole.start) as f64 / whole.nanos().max(1) as f64).clamp(0.0, 1.0);
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
        times: times
            .iter()
            .map(|life| (part(life.start), part(life.end)))
            .collect(),
        marks: events.filter_map(mark).collect(),
    }
}

/// The number of nodes in boxes and in words; the runs of an anonymous node are one.
fn roles(view: &View, mission: &Mission) -> usize {
    let in_words = view.also.iter().flat_map(|also| &also.items);
    let members = view
        .items
        .iter()
        .chain(in_words)
        .flat_map(|item| &item.members);
    let role = |what: &Element| match what {
        Element::Node(id) => mission.elements.nodes.get(*id).map(|node| &*node.role),
        _ => None,
    };
    members.filter_map(role).collect::<BTreeSet<&str>>().len()
}

/// The headline: `31 nodes, 7 phases, 2 restarts, 2 topics change hands`.
fn headline(mission: &Mission, nodes: usize) -> Vec<Phrase> {
    let many = |kind: Kind| {
        let events = mission.log.headlines(mission.span);
        events.filter(|(_, event)| event.kind == kind).count()
    };
    let (phases, restarts) = (mission.log.phases.len(), many(Kind::Restarted));
    let hands = many(Kind::HandedOver);
    let change = if hands == 1 { "changes" } else { "change" };
    let parts = [
        (true, words::count(nodes, "node")),
        (phases > 1, words::count(phases, "phase")),
        (restarts > 0, words::count(restarts, "restart")),
        (
            hands > 0,
            format!("{} {change} hands", words::count(hands, "topic")),
        ),
    ];
    let parts = parts.into_iter().filter(|(is_told, _)| *is_told);
    let parts: Vec<String> = parts.map(|(_, words)| words).collect();
    vec![Phrase {
        sign: ' ',
        lead: parts.join(", "),
        ..Phrase::default()
    }]
}
