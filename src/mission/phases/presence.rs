//! The times in which each element exists, by which phases are cut.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::ids::grouped;
use crate::base::name::is_quiet;
use crate::base::time::{Span, Stamp};
use crate::graph::history::{Sending, Stretch, silences};
use crate::graph::{Edge, Element, Elements, Existence, NodeId, TopicId};

/// The longest absence, as a part of the mission (one in so many), that is ignored inside an element's lifetime: a slow
/// topic has no message in some cells, of which there are at most 200. With a twentieth, a node that is away for a whole phase would be
/// there.
const FILLED: i64 = 50;

/// An element whose presence is recorded.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum PresentThing {
    /// A node, by role.
    Node(Arc<str>),
    /// A publication: role and topic.
    Publication(Arc<str>, Arc<str>),
    /// A topic, if publishers are unknown.
    Topic(Arc<str>),
}

impl PresentThing {
    /// The name of a node or topic; a publication's topic.
    pub(crate) fn name(&self) -> Arc<str> {
        match self {
            Self::Node(name) | Self::Publication(_, name) | Self::Topic(name) => Arc::clone(name),
        }
    }
}

/// An element, and the times in which it exists.
#[derive(Clone, Debug)]
pub(crate) struct Presence {
    pub(crate) subject: PresentThing,
    /// Sorted, without overlaps.
    spans: Vec<Span>,
}

/// Whether these times, which do not overlap, take at least half of another.
pub(crate) fn fill(times: &[Span], time: Span) -> bool {
    let there: i64 = times.iter().map(|s| s.shared(time).max(0)).sum();
    there.saturating_mul(2) >= time.nanos()
}

impl Presence {
    /// Whether it exists in each of these cells.
    pub(crate) fn cells(&self, cells: &[Span]) -> Vec<bool> {
        let mut is = vec![false; cells.len()];
        for span in &self.spans {
            let from = cells.partition_point(|cell| cell.end <= span.start);
            let to = cells.partition_point(|cell| cell.start < span.end);
            is.iter_mut().take(to).skip(from).for_each(|is| *is = true);
        }
        is
    }

    /// Whether it exists for at least half of this time.
    pub(crate) fn fills(&self, time: Span) -> bool {
        fill(&self.spans, time)
    }

    /// Whether it counts for the names of phases: nodes, or topics if there are only topics.
    pub(crate) fn counts(&self, topics: bool) -> bool {
        match self.subject {
            PresentThing::Node(_) => !topics,
            PresentThing::Topic(_) => topics,
            PresentThing::Publication(..) => false,
        }
    }
}

/// Whether phases are detected from topics.
pub(crate) fn is_topics(present: &[Presence]) -> bool {
    let mut subjects = present.iter().map(|p| &p.subject);
    subjects.any(|subject| matches!(subject, PresentThing::Topic(_)))
}

/// Every element's presence, sorted: nodes by role and their publications that carry messages; topics with messages
/// where less than half of these have a known publisher. Housekeeping and recorders are left out.
pub(crate) fn presences(elements: &Elements, sending: &Sending, whole: Span) -> Vec<Presence> {
    let mut all: BTreeMap<PresentThing, Vec<Span>> = BTreeMap::new();
    for (what, subject) in subjects(elements, knows_publishers(elements, sending)) {
        let times = match what {
            Element::Node(_) => elements.seen(what).lives.clone(),
            _ => sent(elements, sending, what),
        };
        all.entry(subject).or_default().extend(times);
    }
    let most = whole.nanos() / FILLED;
    let presence = |(subject, spans)| Presence {
        subject,
        spans: Span::joined(spans, most),
    };
    let is_there = |p: &Presence| p.spans.iter().any(|s| s.shared(whole) > 0);
    all.into_iter().map(presence).filter(is_there).collect()
}

/// The times in which a topic, or a publication with messages, is active: its lifetime without silences.
fn sent(elements: &Elements, sending: &Sending, what: Element) -> Vec<Span> {
    let stretch = |s: &Stretch| Span::new(s.first, s.last.plus(1));
    let Element::Publish(_) = what else {
        let topic = elements.ends(what).1;
        let senders = topic.map_or(&[][..], |topic| sending.of_topic(topic));
        let stretches = senders.iter().flat_map(|s| &s.stretches);
        return stretches.map(stretch).collect();
    };
    let (Some(node), Some(topic)) = elements.ends(what) else {
        return Vec::new();
    };
    let Some(sender) = sending.of_edge(node, topic) else {
        return Vec::new();
    };
    let mut times = Vec::new();
    for life in &elements.seen(what).lives {
        let mut start = life.start;
        let silent = silences(&sender.stretches, &[*life], &[]);
        for (from, to) in silent.into_iter().filter(|_| !sender.is_latched) {
            times.push(Span::new(start, from.plus(1)));
            start = to.unwrap_or(life.end);
        }
        times.push(Span::new(start, life.end));
    }
    times.retain(|time| time.start < time.end);
    times
}

/// The subjects of the activity with their elements: nodes and their publications, or topics.
fn subjects(
    elements: &Elements,
    knows_publishers: bool,
) -> impl Iterator<Item = (Element, PresentThing)> {
    let role = |id: NodeId| {
        let node = elements.nodes.get(id)?;
        (!node.is_tool()).then(|| Arc::clone(&node.role))
    };
    let name = |id: TopicId| {
        let topic = elements.topics.get(id)?;
        Some(topic.name.shared()).filter(|name| !is_quiet(name))
    };
    let subject = move |what| match (what, elements.ends(what)) {
        (Element::Topic(id), _) if !knows_publishers => name(id).map(PresentThing::Topic),
        (Element::Node(id), _) if knows_publishers => role(id).map(PresentThing::Node),
        (Element::Publish(_), (Some(node), Some(topic))) if knows_publishers => {
            Some(PresentThing::Publication(role(node)?, name(topic)?))
        }
        _ => None,
    };
    let all = elements.all();
    all.filter_map(move |what| Some((what, subject(what)?)))
}

/// Whether at least half of the messages are on topics with a known publisher.
pub(crate) fn knows_publishers(elements: &Elements, sending: &Sending) -> bool {
    let edges = elements.publishes.iter();
    let sure = edges.filter(|edge| !edge.seen.evidence.is_guess());
    let known_on = grouped(sure.map(|edge| (edge.topic, edge)));
    let (mut all, mut known) = (0_u64, 0_u64);
    for sender in &sending.senders {
        let topic = elements.topics.get(sender.topic);
        if topic.is_none_or(|topic| is_quiet(topic.name.as_str())) {
            continue;
        }
        let edges = known_on.get(&sender.topic).map_or(&[][..], Vec::as_slice);
        for stretch in &sender.stretches {
            let span = Span::new(stretch.first, stretch.last.plus(1));
            let lives = |edge: &&Edge| edge.seen.lives.iter().any(|life| life.shared(span) > 0);
            all = all.saturating_add(stretch.count);
            if edges.iter().any(lives) {
                known = known.saturating_add(stretch.count);
            }
        }
    }
    known >= all - known
}

/// The exact first and last signs of the nodes of a role, or of a topic.
pub(crate) type Ends = Vec<(Option<Stamp>, Option<Stamp>)>;

/// The exact first and last signs by role, or by topic.
pub(crate) fn ends(elements: &Elements, topics: bool) -> BTreeMap<&str, Ends> {
    let ends = |seen: &Existence| (seen.first, seen.last);
    let of_nodes = elements.nodes.iter();
    let of_topics = elements.topics.iter();
    if topics {
        grouped(of_topics.map(|topic| (topic.name.as_str(), ends(&topic.seen))))
    } else {
        grouped(of_nodes.map(|node| (&*node.role, ends(&node.seen))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_absences_inside_a_life_are_filled() {
        let span = |start: i64, end: i64| Span::new(Stamp(start), Stamp(end));
        let presence = Presence {
            subject: PresentThing::Node(Arc::from("/n")),
            spans: Span::joined(vec![span(10, 20), span(40, 50), span(80, 90)], 20),
        };
        let cells: Vec<Span> = (0..9).map(|k| span(10 * k, 10 * k + 10)).collect();
        let there: String = presence
            .cells(&cells)
            .into_iter()
            .map(|is| if is { '#' } else { '.' })
            .collect();
        assert_eq!(there, ".####...#");
        assert!(presence.fills(span(10, 90)) && !presence.fills(span(50, 90)));
    }
}
