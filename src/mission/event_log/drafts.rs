//! Events while they are made: their input, the growing list, and their order once all are known.

use super::{Detail, Event, EventId, Kind};
use crate::base::name::{is_feedback, is_quiet};
use crate::base::time::Stamp;
use crate::evidence::{Confidence, Evidence};
use crate::graph::history::{Bound, Life};
use crate::graph::{ById, Element, Elements, History, TopicId};

/// The data from which events are made.
#[derive(Clone, Copy)]
pub(crate) struct LogInput<'a> {
    pub(crate) elements: &'a Elements,
    pub(crate) history: &'a History,
    /// The fraction by which a rate must change, ≥ 0.
    pub(crate) rate_change: f64,
}

/// Unsorted events; a part refers to the index of its whole.
#[derive(Default)]
pub(super) struct Drafts {
    pub(super) list: ById<EventId, Event>,
}

impl Drafts {
    /// Adds an event; returns its index. It is no part of a quiet one unless it is quiet too.
    pub(super) fn add(&mut self, mut event: Event) -> EventId {
        let may = |whole: &EventId| event.quiet || !self.get(*whole).quiet;
        event.part_of = event.part_of.filter(may);
        self.list.push(event)
    }

    /// The event at this index.
    pub(super) fn get(&self, id: EventId) -> &Event {
        &self.list[id]
    }

    /// Makes a headline a part of another event, unless that is a part of it, or is quiet and would hide it.
    pub(super) fn fold(&mut self, part: EventId, whole: EventId) {
        let whole = self.root(whole);
        let is_hidden = self.get(whole).quiet && !self.get(part).quiet;
        if whole != part && !is_hidden {
            self.list[part].part_of = Some(whole);
        }
    }

    /// The headline that an event is a part of, or the event itself.
    fn root(&self, mut id: EventId) -> EventId {
        while let Some(whole) = self.get(id).part_of {
            id = whole;
        }
        id
    }

    /// Makes the parts of parts parts of their headlines.
    pub(super) fn flatten(&mut self) {
        for id in self.list.ids() {
            let part_of = self.list[id].part_of.map(|whole| self.root(whole));
            self.list[id].part_of = part_of;
        }
    }
}

/// Sorts by time, kind and name, and updates the references of parts and the weights of wholes.
pub(crate) fn sorted(mut list: ById<EventId, Event>, elements: &Elements) -> ById<EventId, Event> {
    let key = |event: &Event| (elements.ends(event.what), event.what);
    let mut order: Vec<EventId> = list.ids().collect();
    order.sort_by_key(|at| (list[*at].time, list[*at].kind, key(&list[*at])));
    let mut new = ById::like(&list, EventId::default());
    for (place, old) in list.ids().zip(&order) {
        new[*old] = place;
    }
    let mut weights = ById::like(&list, 1_u32);
    for event in list.iter_mut() {
        if let Some(whole) = event.part_of {
            weights[whole] = weights[whole].saturating_add(1);
            event.part_of = Some(new[whole]);
        }
    }
    for (event, weight) in list.iter_mut().zip(weights) {
        event.weight = weight;
    }
    let mut list: ById<EventId, Option<Event>> = list.into_iter().map(Some).collect();
    order.iter().filter_map(|at| list[*at].take()).collect()
}

impl Event {
    /// An event at a moment, with nothing else known about it.
    pub(crate) fn new(kind: Kind, what: Element, at: Bound) -> Self {
        Self {
            kind,
            what,
            time: at.time,
            earliest: at.earliest.min(at.time),
            latest: at.latest.max(at.time),
            until: None,
            detail: Detail::None,
            confidence: Confidence::Measured,
            evidence: Evidence::NONE,
            part_of: None,
            quiet: false,
            weight: 1,
        }
    }
}

impl<'a> LogInput<'a> {
    /// An event about an element at a moment.
    pub(super) fn event(&self, kind: Kind, what: Element, at: Bound) -> Event {
        let record = self.history.records.of(what);
        let (node, topic) = self.elements.ends(what);
        Event {
            confidence: record.map_or(Confidence::Declared, |record| record.confidence),
            evidence: self.elements.evidence(what),
            quiet: node.is_some_and(|id| self.elements.nodes[id].is_tool())
                || topic.is_some_and(|id| is_quiet(self.elements.topics[id].name.as_str())),
            ..Event::new(kind, what, at)
        }
    }

    /// The lifetimes of an element, in order.
    pub(super) fn lives(&self, what: Element) -> &'a [Life] {
        let record = self.history.records.of(what);
        record.map_or(&[], |record| &record.lives)
    }

    /// Whether a topic's rates and senders are irrelevant: housekeeping, and topics of actions.
    pub(super) fn is_by_the_way(&self, topic: TopicId) -> bool {
        let topic = &self.elements.topics[topic];
        let name = topic.name.as_str();
        is_quiet(name) || is_feedback(name) || topic.is_shared()
    }
}

/// An exact time.
pub(super) fn exact(time: Stamp) -> Bound {
    Bound::new(time, time, time)
}
