//! Makes a mission's events from its lifetimes: each kind in its own file, then sorted and joined.

use super::{Detail, Event, EventId, Kind, causes, hands, incidents, lifetimes, rates, silence};
use crate::base::name::{is_feedback, is_quiet};
use crate::base::time::Stamp;
use crate::evidence::{Confidence, Evidence};
use crate::graph::history::{Bound, Life};
use crate::graph::{ById, Element, Elements, History, NodeId, TopicId};

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
pub(crate) struct Drafts {
    pub(crate) list: ById<EventId, Event>,
}

impl Drafts {
    /// Adds an event; returns its index.
    pub(crate) fn add(&mut self, event: Event) -> EventId {
        self.list.push(event)
    }

    /// The event at this index.
    pub(crate) fn get(&self, id: EventId) -> &Event {
        &self.list[id]
    }

    /// Makes a headline a part of another event, unless that is a part of it.
    pub(crate) fn fold(&mut self, part: EventId, whole: EventId) {
        let whole = self.root(whole);
        if whole != part {
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
    pub(crate) fn flatten(&mut self) {
        for id in self.list.ids() {
            let part_of = self.list[id].part_of.map(|whole| self.root(whole));
            self.list[id].part_of = part_of;
        }
    }
}

/// Every event of a mission, sorted.
pub(crate) fn make(context: &LogInput<'_>) -> ById<EventId, Event> {
    let mut drafts = Drafts::default();
    lifetimes::add(context, &mut drafts);
    silence::add(context, &mut drafts);
    hands::add(context, &mut drafts);
    rates::add(context, &mut drafts);
    lifecycles(context, &mut drafts);
    incidents::add(context, &mut drafts);
    causes::add(context, &mut drafts);
    sorted(drafts.list, context.elements).0
}

/// Events in order, and the new id of each by the old one.
pub(crate) type SortedEvents = (ById<EventId, Event>, ById<EventId, EventId>);

/// Sorts by time, kind and name, and updates the references of parts and the weights of wholes.
pub(crate) fn sorted(list: ById<EventId, Event>, elements: &Elements) -> SortedEvents {
    sorted_by(list, |event| (elements.ends(event.what), event.what))
}

/// As [`sorted`], with the order of events of one time and kind.
pub(crate) fn sorted_by<K: Ord>(
    mut list: ById<EventId, Event>,
    key: impl Fn(&Event) -> K,
) -> SortedEvents {
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
    let list = order.iter().filter_map(|at| list[*at].take()).collect();
    (list, new)
}

impl<'a> LogInput<'a> {
    /// An event about an element at a moment.
    pub(crate) fn event(&self, kind: Kind, what: Element, at: Bound) -> Event {
        Event {
            kind,
            what,
            time: at.time,
            earliest: at.earliest.min(at.time),
            latest: at.latest.max(at.time),
            until: None,
            detail: Detail::None,
            confidence: self
                .history
                .records
                .of(what)
                .map_or(Confidence::Declared, |record| record.confidence),
            evidence: self.elements.evidence(what),
            part_of: None,
            quiet: self.is_quiet(what),
            weight: 1,
        }
    }

    /// The lifetimes of an element, in order.
    pub(crate) fn lives(&self, what: Element) -> &'a [Life] {
        let record = self.history.records.of(what);
        record.map_or(&[], |record| &record.lives)
    }

    /// Whether none of the evidence for an element has times.
    pub(crate) fn is_timeless(&self, what: Element) -> bool {
        self.elements.evidence(what).is_timeless()
    }

    /// Whether an element is housekeeping or the recorder's.
    pub(crate) fn is_quiet(&self, what: Element) -> bool {
        is_housekeeping(self.elements, what)
    }

    /// Whether a topic's rates and senders are irrelevant: housekeeping, and topics of actions.
    pub(crate) fn is_by_the_way(&self, topic: TopicId) -> bool {
        let topic = &self.elements.topics[topic];
        let name = topic.name.as_str();
        is_quiet(name) || is_feedback(name) || topic.is_shared()
    }
}

/// Whether an element is housekeeping or the recorder's.
pub(crate) fn is_housekeeping(elements: &Elements, what: Element) -> bool {
    let (node, topic) = elements.ends(what);
    node.is_some_and(|id| elements.nodes[id].is_tool())
        || topic.is_some_and(|id| is_quiet(elements.topics[id].name.as_str()))
}

/// Adds the changes of nodes' lifecycle states.
fn lifecycles(context: &LogInput<'_>, drafts: &mut Drafts) {
    let mut states: std::collections::BTreeMap<NodeId, std::sync::Arc<str>> =
        std::collections::BTreeMap::new();
    for change in &context.history.transitions {
        let before = states.insert(change.node, change.state.clone());
        let from = before.unwrap_or_default();
        if from == change.state {
            continue;
        }
        let mut event = context.event(
            Kind::Lifecycle,
            Element::Node(change.node),
            exact(change.time),
        );
        event.confidence = Confidence::Stated;
        event.evidence = Evidence::of("lifecycle");
        event.detail = Detail::Values {
            from,
            to: change.state.clone(),
        };
        drafts.add(event);
    }
}

/// An exact time.
pub(crate) fn exact(time: Stamp) -> Bound {
    Bound {
        time,
        earliest: time,
        latest: time,
    }
}
