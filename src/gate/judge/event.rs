//! The events of the event log that match an event of a rule.

use super::Judge;
use crate::gate::expectation::{EventKind, ExpectedEvent};
use crate::gate::pattern::Pattern;
use crate::graph::{Element, NodeId};
use crate::mission::event_log::{Detail, Event, Kind};

impl Judge<'_> {
    /// The events that match an event, in order.
    pub(super) fn events(&self, wanted: &ExpectedEvent) -> Vec<&Event> {
        let all = self.facts.mission.log.events.iter();
        all.filter(|event| self.is_event(wanted, event)).collect()
    }

    fn is_event(&self, wanted: &ExpectedEvent, event: &Event) -> bool {
        let kinds: &[Kind] = match wanted.kind {
            EventKind::Added => &[Kind::Started, Kind::Appeared],
            EventKind::Removed => &[Kind::Stopped, Kind::Restarted, Kind::Vanished],
            EventKind::Restarted => &[Kind::Restarted],
            EventKind::Silent => &[Kind::Silent],
            EventKind::HandedOver => &[Kind::HandedOver],
            EventKind::Rate => &[Kind::Rate],
            EventKind::Lifecycle => &[Kind::Lifecycle],
        };
        kinds.contains(&event.kind) && self.is_about(wanted, event) && self.has_ends(wanted, event)
    }

    fn is_about(&self, wanted: &ExpectedEvent, event: &Event) -> bool {
        match event.what {
            Element::Node(id) => self.facts.fits(&wanted.name, id),
            Element::Topic(id) => wanted.name.matches(self.facts.topic(id)),
            Element::Publish(id) if wanted.kind == EventKind::Rate => {
                let topic = self.facts.mission.elements.publishes[id].topic;
                wanted.name.matches(self.facts.topic(topic))
            }
            Element::Publish(_) | Element::Subscribe(_) => false,
        }
    }

    fn has_ends(&self, wanted: &ExpectedEvent, event: &Event) -> bool {
        let any = |wanted: &Option<Pattern>, nodes: &[NodeId]| {
            let fits = |p: &Pattern| nodes.iter().any(|id| self.facts.fits(p, *id));
            wanted.as_ref().is_none_or(fits)
        };
        let is = |wanted: &Option<Pattern>, value: &str| {
            wanted.as_ref().is_none_or(|p| p.matches(value))
        };
        match &event.detail {
            Detail::Senders { from, to } => any(&wanted.from, from) && any(&wanted.to, to),
            Detail::Values { from, to } => is(&wanted.from, from) && is(&wanted.to, to),
            _ => wanted.from.is_none() && wanted.to.is_none(),
        }
    }
}
