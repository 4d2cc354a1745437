//! The events of the log in a step: elements that began, ended, or were taken over.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::StepSource;
use crate::base::time::Span;
use crate::draw::timeline::marks::Sign;
use crate::graph::{Element, NodeId, TopicId};
use crate::mission::EventId;
use crate::mission::event_log::Detail;

impl StepSource<'_> {
    /// The weight of a boundary, larger for one that changes more.
    pub(super) fn weight(&self, k: usize) -> usize {
        let turns = [Sign::Start, Sign::End].map(|sign| self.turned(k, sign).len());
        (turns[0] + turns[1]) * 4 + self.handed(k).len()
    }

    /// The time of the step into phase `k`: from the middle of the previous phase to its own.
    fn time(&self, k: usize) -> Span {
        let middle = |k: usize| {
            let span = self.sheet.source.phases[k].span;
            span.start.plus(span.nanos() / 2)
        };
        Span::new(middle(k - 1), middle(k))
    }

    /// The nodes that phase `k` adds or removes compared with the previous one, with the events by which they
    /// began or ended.
    pub(super) fn turned(&self, k: usize, sign: Sign) -> BTreeMap<usize, Vec<EventId>> {
        let (before, after) = (&self.found[k - 1].names, &self.found[k].names);
        let (old, new) = match sign {
            Sign::Start => (before, after),
            _ => (after, before),
        };
        let around = Span::new(
            self.sheet.source.phases[k - 1].span.start,
            self.sheet.source.phases[k].span.end,
        );
        let events = |track: usize| -> Vec<EventId> {
            let own = self.tracks[track].marks.iter();
            let own = own.filter(|s| s.sign == sign && around.contains(s.at));
            own.flat_map(|s| s.events.clone()).collect()
        };
        let tracks = new.difference(old).filter_map(|name| self.track(name));
        let tracks = tracks.map(|track| (track, events(track)));
        tracks.filter(|(_, events)| !events.is_empty()).collect()
    }

    /// The hand-overs of the log in the step into phase `k`: topic, before, after.
    pub(super) fn handed(&self, k: usize) -> Vec<(TopicId, Arc<str>, Arc<str>, EventId)> {
        let source = self.sheet.source;
        let role = |nodes: &[NodeId]| {
            let node = source.mission.elements.nodes.get(*nodes.first()?)?;
            Some(Arc::clone(&node.role))
        };
        let headlines = source.mission.log.headlines(self.time(k));
        let handed = headlines.filter_map(|(id, event)| match (&event.detail, event.what) {
            (Detail::Senders { from, to }, Element::Topic(topic)) => {
                let shown = source.shows(topic) && !source.is_hub(topic);
                let (from, to) = (role(from)?, role(to)?);
                shown.then_some((topic, from, to, id))
            }
            _ => None,
        });
        handed.collect()
    }

    /// The events in the step into phase `k` on the rows of a box.
    pub(super) fn events(&self, k: usize, members: &[usize]) -> BTreeSet<EventId> {
        let time = self.time(k);
        let marks = members.iter().flat_map(|at| &self.tracks[*at].marks);
        let own = marks.filter(|mark| time.contains(mark.at));
        own.flat_map(|mark| mark.events.clone()).collect()
    }
}
