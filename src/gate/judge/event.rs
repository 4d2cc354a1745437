//! The entries of the ledger that match an event of a rule.

use super::Judge;
use crate::gate::expectation::{Event, EventKind};
use crate::gate::pattern::Pattern;
use crate::graph::{Element, NodeId};
use crate::mission::ledger::{Detail, Entry, Kind};

impl Judge<'_> {
    /// The entries that match an event, in order.
    pub(super) fn entries(&self, event: &Event) -> Vec<&Entry> {
        let all = self.facts.mission.ledger.entries.iter();
        all.filter(|entry| self.is_event(event, entry)).collect()
    }

    fn is_event(&self, event: &Event, entry: &Entry) -> bool {
        let kinds: &[Kind] = match event.kind {
            EventKind::Added => &[Kind::Started, Kind::Appeared],
            EventKind::Removed => &[Kind::Stopped, Kind::Restarted, Kind::Vanished],
            EventKind::Restarted => &[Kind::Restarted],
            EventKind::Silent => &[Kind::Silent],
            EventKind::HandedOver => &[Kind::HandedOver],
            EventKind::Rate => &[Kind::Rate],
            EventKind::Lifecycle => &[Kind::Lifecycle],
        };
        kinds.contains(&entry.kind) && self.is_about(event, entry) && self.has_ends(event, entry)
    }

    fn is_about(&self, event: &Event, entry: &Entry) -> bool {
        match entry.what {
            Element::Node(id) => self.facts.fits(&event.name, id),
            Element::Topic(id) => event.name.matches(self.facts.topic(id)),
            Element::Publish(id) if event.kind == EventKind::Rate => {
                let topic = self.facts.mission.elements.publishes[id as usize].topic;
                event.name.matches(self.facts.topic(topic))
            }
            Element::Publish(_) | Element::Subscribe(_) => false,
        }
    }

    fn has_ends(&self, event: &Event, entry: &Entry) -> bool {
        let any = |wanted: &Option<Pattern>, nodes: &[NodeId]| {
            let fits = |p: &Pattern| nodes.iter().any(|id| self.facts.fits(p, *id));
            wanted.as_ref().is_none_or(fits)
        };
        let is = |wanted: &Option<Pattern>, value: &str| {
            wanted.as_ref().is_none_or(|p| p.matches(value))
        };
        match &entry.detail {
            Detail::Senders { from, to } => any(&event.from, from) && any(&event.to, to),
            Detail::Values { from, to } => is(&event.from, from) && is(&event.to, to),
            _ => event.from.is_none() && event.to.is_none(),
        }
    }
}
