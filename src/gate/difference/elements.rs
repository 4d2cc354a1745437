//! The nodes, topics and edges in only one mission, and the differences between those in both.

use std::collections::{BTreeMap, BTreeSet};

use super::sending::rates;
use super::{Difference, Where};
use crate::base::rhythm::CLOSING_NS;
use crate::gate::facts::Facts;
use crate::gate::pattern::Pattern;
use crate::graph::history::Bound;
use crate::graph::{NodeId, TopicId};
use crate::mission::event_log::Kind;

/// An end is certain if the silence after it is this many times its uncertainty.
const DOUBTS: i64 = 8;

/// All differences of elements.
pub(super) fn differences(a: &Facts<'_>, b: &Facts<'_>, rate_change: f64) -> Vec<Difference> {
    let (ours, theirs) = (nodes(a), nodes(b));
    let mut all: Vec<Difference> = presence("node", &keys(&ours), &keys(&theirs)).collect();
    // Whether the mission that lacks a node would name it.
    let lost = |side| all.iter().filter(|one| one.side == side).count();
    let (in_b, in_a) = (lost(Where::First), lost(Where::Second));
    let (in_b, in_a) = (b.names_nodes(in_b), a.names_nodes(in_a));
    for one in &mut all {
        one.is_known = if one.side == Where::First { in_b } else { in_a };
    }
    let (topics_a, topics_b) = (topics(a), topics(b));
    all.extend(presence("topic", &keys(&topics_a), &keys(&topics_b)));
    for (name, first) in &ours {
        if let Some(second) = theirs.get(name) {
            node(name, (a, first), (b, second), &mut all);
        }
    }
    for (name, first) in &topics_a {
        if let Some(second) = topics_b.get(name) {
            let both = |role: &str| ours.contains_key(role) && theirs.contains_key(role);
            topic(
                name,
                (a, *first),
                (b, *second),
                rate_change,
                &both,
                &mut all,
            );
        }
    }
    all
}

fn keys<'a, T>(map: &BTreeMap<&'a str, T>) -> BTreeSet<&'a str> {
    map.keys().copied().collect()
}

fn presence<'a>(
    kind: &'static str,
    first: &BTreeSet<&'a str>,
    second: &BTreeSet<&'a str>,
) -> impl Iterator<Item = Difference> + use<'a> {
    let all: BTreeSet<&str> = first.symmetric_difference(second).copied().collect();
    let first = first.clone();
    all.into_iter().map(move |name| {
        let side = Where::only(first.contains(name));
        Difference::only(kind, name, side, "present")
    })
}

/// The measured or stated roles, without tools.
fn nodes<'a, 'f>(facts: &'f Facts<'a>) -> BTreeMap<&'a str, &'f [NodeId]> {
    let sure = |nodes: &[NodeId]| facts.is_sure(nodes) && !facts.is_tool(nodes);
    facts.roles().filter(|(_, nodes)| sure(nodes)).collect()
}

/// The topics with messages, without housekeeping.
pub(super) fn topics<'a>(facts: &Facts<'a>) -> BTreeMap<&'a str, TopicId> {
    let all = facts.topics(&Pattern::new("**")).into_iter();
    let with_messages = all.filter(|id| !facts.is_housekeeping(*id) && facts.messages(*id) > 0);
    with_messages.map(|id| (facts.topic(id), id)).collect()
}

fn node(
    name: &str,
    (a, first): (&Facts<'_>, &[NodeId]),
    (b, second): (&Facts<'_>, &[NodeId]),
    all: &mut Vec<Difference>,
) {
    let restarts = |facts: &Facts<'_>, nodes: &[NodeId]| facts.events(nodes, Kind::Restarted).len();
    let (one, other) = (restarts(a, first), restarts(b, second));
    if one != other {
        all.push(Difference::changed(
            "restarts",
            name,
            one.to_string(),
            other.to_string(),
        ));
    }
    let (one, other) = (a.lifecycle(first), b.lifecycle(second));
    if let (Some(one), Some(other)) = (&one, &other)
        && one != other
    {
        all.push(Difference::changed("lifecycle", name, *one, *other));
    }
    let (one, other) = (a.ended(first, CLOSING_NS), b.ended(second, CLOSING_NS));
    // An intermittent topic may be silent at the end: it only ended if the silence far exceeds the uncertainty.
    let is_over = |facts: &Facts<'_>, end: Bound| {
        let rest = facts.mission.span.end.since(end.time);
        let doubt = end.latest.since(end.earliest);
        doubt <= CLOSING_NS || doubt.saturating_mul(DOUBTS) <= rest
    };
    let ended = match (one, other) {
        (Some(end), None) => is_over(a, end),
        (None, Some(end)) => is_over(b, end),
        _ => false,
    };
    if ended {
        let outcome = |facts: &Facts<'_>, end: Option<Bound>| match end {
            Some(end) => format!("ends at {}", facts.clock(end.time)),
            None => "stays".to_owned(),
        };
        all.push(Difference::changed(
            "end",
            name,
            outcome(a, one),
            outcome(b, other),
        ));
    }
}

fn topic(
    name: &str,
    (a, first): (&Facts<'_>, TopicId),
    (b, second): (&Facts<'_>, TopicId),
    rate_change: f64,
    in_both: &dyn Fn(&str) -> bool,
    all: &mut Vec<Difference>,
) {
    let own = |facts: &Facts<'_>, id: TopicId| {
        let topic = &facts.mission.elements.topics[id];
        let types: Vec<&str> = topic.types.iter().map(|t| &**t).collect();
        (types.join(", "), topic.qos.clone())
    };
    let ((one, qos), (other, other_qos)) = (own(a, first), own(b, second));
    if one.replace("/msg/", "/") != other.replace("/msg/", "/") {
        all.push(Difference::changed("type", name, one, other));
    }
    if let (Some(qos), Some(other)) = (qos, other_qos)
        && qos != other
    {
        all.push(Difference::changed("qos", name, &*qos, &*other));
    }
    rates(name, (a, first), (b, second), rate_change, all);
    let senders = |facts: &Facts<'_>, id| facts.sure_roles(&facts.publishers(id));
    let listeners = |facts: &Facts<'_>, id| facts.sure_roles(&facts.subscribers(id));
    let senders = (senders(a, first), senders(b, second));
    let listeners = (listeners(a, first), listeners(b, second));
    let is_observable = |side: Where, role: &str, kind: &str| {
        // Whether the edge would be observable in the mission that lacks it.
        let (facts, id) = if side == Where::First {
            (b, second)
        } else {
            (a, first)
        };
        let nodes = facts.nodes(&Pattern::new(role));
        let nodes: Vec<NodeId> = nodes
            .iter()
            .flat_map(|(_, nodes)| *nodes)
            .copied()
            .collect();
        match kind {
            "publishes" => facts.lists_publishers(id),
            _ => facts.lists_subscribers(&nodes),
        }
    };
    for (kind, (one, other)) in [("publishes", senders), ("subscribes", listeners)] {
        for role in one
            .symmetric_difference(&other)
            .filter(|role| in_both(role))
        {
            let side = Where::only(one.contains(role));
            let edge = match kind {
                "publishes" => format!("{role} → {name}"),
                _ => format!("{name} → {role}"),
            };
            let mut difference = Difference::only(kind, edge, side, "present");
            difference.is_known = is_observable(side, role, kind);
            all.push(difference);
        }
    }
}
