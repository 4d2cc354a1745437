//! Silences without proof of an end: of nodes, and of topics whose senders all paused.
//!
//! For example, `/camera` sends `/image` at 30 Hz, pauses from 20 s to 25 s and goes on with its numbers: `/camera` was silent for
//! 5 s, and the silence of `/image` is a part of that. If `/camera` ended at 20 s, the silence is a part of its end.

use std::collections::BTreeMap;

use super::drafts::{Drafts, LogInput};
use super::{Event, EventId, Kind};
use crate::base::ids::grouped;
use crate::base::rhythm::TOGETHER_NS;
use crate::base::time::Stamp;
use crate::graph::history::{Bound, Sender, Silence};
use crate::graph::{Element, NodeId};

/// Adds all silences.
pub(super) fn add(context: &LogInput<'_>, drafts: &mut Drafts) {
    let gone = Gone::new(drafts);
    let mut of_nodes: BTreeMap<NodeId, Vec<(Silence, EventId)>> = BTreeMap::new();
    for (node, senders) in by(context, |v| v.node.filter(|_| !v.is_latched)) {
        let what = Element::Node(node);
        for silence in silences(context, what) {
            let id = drafts.add(event(context, what, *silence, &senders));
            of_nodes.entry(node).or_default().push((*silence, id));
        }
    }
    for (topic, senders) in by(context, |v| Some(v.topic).filter(|_| !v.is_latched)) {
        if context.is_by_the_way(topic) {
            continue;
        }
        for silence in silences(context, Element::Topic(topic)) {
            let mut event = event(context, Element::Topic(topic), *silence, &senders);
            let nodes = senders.iter().filter_map(|v| of_nodes.get(&v.node?));
            let is_before = |a: Silence, b: Silence| a.1.is_some_and(|end| end <= b.0);
            let meets = |of| !is_before(of, *silence) && !is_before(*silence, of);
            let whole = nodes.flatten().find(|(of, _)| meets(*of));
            let whole = whole.map(|(_, id)| *id);
            event.part_of = whole.or_else(|| gone.at(&senders, silence.0));
            drafts.add(event);
        }
    }
}

/// The ends of nodes with their times, and the events about them.
struct Gone(BTreeMap<NodeId, Vec<(Stamp, EventId)>>);

impl Gone {
    fn new(drafts: &Drafts) -> Self {
        let end = |(id, event): (EventId, &Event)| match (event.what, event.kind) {
            (Element::Node(node), Kind::Stopped | Kind::Restarted) => {
                Some((node, (event.time, event.part_of.unwrap_or(id))))
            }
            _ => None,
        };
        Self(grouped(drafts.list.with_ids().filter_map(end)))
    }

    /// The event about the end of one of these senders at that time.
    fn at(&self, senders: &[&Sender], time: Stamp) -> Option<EventId> {
        let of = senders.iter().filter_map(|v| self.0.get(&v.node?));
        let is_near = |(end, _): &&(Stamp, EventId)| end.since(time).abs() <= TOGETHER_NS;
        of.flatten().find(is_near).map(|(_, id)| *id)
    }
}

/// The senders of each node, or of each topic.
fn by<'a, I: Ord>(
    context: &LogInput<'a>,
    key: impl Fn(&Sender) -> Option<I>,
) -> BTreeMap<I, Vec<&'a Sender>> {
    let senders = context.history.sending.senders.iter();
    grouped(senders.filter_map(|sender| Some((key(sender)?, sender))))
}

/// The silences of an element.
fn silences<'a>(context: &LogInput<'a>, what: Element) -> &'a [Silence] {
    let record = context.history.records.of(what);
    record.map_or(&[], |record| &record.silences)
}

fn event(
    context: &LogInput<'_>,
    what: Element,
    (from, to): Silence,
    senders: &[&Sender],
) -> super::Event {
    let stretches = senders.iter().flat_map(|v| &v.stretches);
    let last = stretches.filter(|s| s.last == from);
    let period = last.map(|s| s.period).max().unwrap_or(0);
    let at = Bound::new(from, from, from.plus(period));
    super::Event {
        until: to,
        ..context.event(Kind::Silent, what, at)
    }
}
