//! Starts, ends and restarts: of nodes and roles, with their edges and topics as parts.
//!
//! For example, `/planner_17` ends at 60 s and `/planner_23`, of the same role, begins at 64 s: the role `/planner` restarted and
//! was away for 4 s. `/planner_23` publishes `/plan` from 66 s on, which is a part of that restart.

use std::collections::BTreeMap;

use super::drafts::{Drafts, LogInput};
use super::{EventId, Kind};
use crate::base::rhythm::{STEADY, STEADY_NS, TOGETHER_NS};
use crate::base::time::{Span, Stamp};
use crate::graph::history::{Bound, Life};
use crate::graph::{Element, NodeId, TopicId};

/// The events about starts and stops in the making, by node and topic.
struct Starts<'a, 'd> {
    context: &'a LogInput<'a>,
    drafts: &'d mut Drafts,
    nodes: BTreeMap<(NodeId, Kind), Vec<(Bound, EventId)>>,
    topics: BTreeMap<(TopicId, Kind, Stamp), EventId>,
}

/// Adds the events of all lifetimes.
pub(super) fn add(context: &LogInput<'_>, drafts: &mut Drafts) {
    let mut starts = Starts {
        context,
        drafts,
        nodes: BTreeMap::new(),
        topics: BTreeMap::new(),
    };
    for limits in limits_by_role(context).values() {
        starts.add_role(limits);
    }
    let elements = context.elements;
    let recorded = || {
        let all = elements.all();
        all.filter(|what| !elements.evidence(*what).is_timeless())
    };
    for what in recorded() {
        if let (Some(node), Some(topic)) = elements.ends(what) {
            starts.add_edge(what, node, topic);
        }
    }
    for what in recorded() {
        let Element::Topic(id) = what else { continue };
        for (kind, at) in limits(context.lives(what)) {
            let mut event = context.event(of_edge(kind), what, at);
            event.part_of = starts.topics.get(&(id, kind, at.time)).copied();
            event.quiet |= event.part_of.is_none() && is_by_chance(context, id, kind, at.time);
            starts.drafts.add(event);
        }
    }
}

/// Whether a topic of unnamed publishers begins or ends without a rhythm that shows it: the last key that somebody presses.
fn is_by_chance(context: &LogInput<'_>, topic: TopicId, kind: Kind, time: Stamp) -> bool {
    let senders = context.history.sending.of_topic(topic);
    let [sender] = senders else { return false };
    let mut stretches = sender.stretches.chunk_by(|_, next| next.is_joined);
    let run = stretches.find(|run| match kind {
        Kind::Started => run[0].first == time,
        _ => run[run.len() - 1].last == time,
    });
    let Some(run) = run.filter(|_| sender.node.is_none() && !sender.is_latched) else {
        return false;
    };
    let span = Span::new(run[0].first, run[run.len() - 1].last);
    let usual = run.iter().map(|s| s.period).max().unwrap_or(0);
    let pauses = context.history.sending.pauses.of(topic).iter();
    let mut inside = pauses.filter(|pause| span.start <= pause.start && pause.end <= span.end);
    let count: u64 = run.iter().map(|s| s.count).sum();
    count < STEADY || span.nanos() < STEADY_NS || inside.any(|pause| pause.nanos() > usual / 2 * 5)
}

/// The starts and stops of an element, in order.
fn limits(lives: &[Life]) -> impl Iterator<Item = (Kind, Bound)> + '_ {
    lives.iter().flat_map(|life| {
        let began = life.began.map(|at| (Kind::Started, at));
        let ended = life.ended.map(|at| (Kind::Stopped, at));
        began.into_iter().chain(ended)
    })
}

/// The kind of a start or stop of an edge or topic.
fn of_edge(kind: Kind) -> Kind {
    match kind {
        Kind::Started => Kind::Appeared,
        _ => Kind::Vanished,
    }
}

/// A start or stop of a node.
struct NodeLimit {
    node: NodeId,
    kind: Kind,
    at: Bound,
    /// The order of several at one time.
    rank: u8,
}

/// The starts and stops of all nodes by role, in order: anonymous nodes share a role, any other node is its own. At one
/// time, one ends before the next begins; a node known from a single moment begins before it ends.
fn limits_by_role<'a>(context: &LogInput<'a>) -> BTreeMap<&'a str, Vec<NodeLimit>> {
    let mut all: BTreeMap<&str, Vec<NodeLimit>> = BTreeMap::new();
    let nodes = context.elements.nodes.with_ids();
    for (node, of) in nodes.filter(|(_, node)| !node.seen.evidence.is_timeless()) {
        let own = all.entry(&*of.role).or_default();
        for life in context.lives(Element::Node(node)) {
            let ends = life.began.zip(life.ended);
            let is_moment = ends.is_some_and(|(b, e)| b.time == e.time);
            let limits = limits(std::slice::from_ref(life));
            own.extend(limits.map(|(kind, at)| NodeLimit {
                node,
                kind,
                at,
                rank: match kind {
                    _ if is_moment => 1,
                    Kind::Started => 2,
                    _ => 0,
                },
            }));
        }
    }
    for limits in all.values_mut() {
        limits.sort_by_key(|one| (one.at.time, one.rank, one.node));
    }
    all
}

impl Starts<'_, '_> {
    /// Adds the events of one role: an end followed by a beginning is a restart.
    fn add_role(&mut self, mut limits: &[NodeLimit]) {
        let context = self.context;
        while let Some((one, after)) = limits.split_first() {
            let is_back =
                |next: &&NodeLimit| (one.kind, next.kind) == (Kind::Stopped, Kind::Started);
            let next = after.first().filter(is_back);
            limits = &after[usize::from(next.is_some())..];
            let kind = next.map_or(one.kind, |_| Kind::Restarted);
            let mut event = context.event(kind, Element::Node(next.unwrap_or(one).node), one.at);
            event.until = next.map(|next| next.at.time);
            let id = self.drafts.add(event);
            let is_other = next.is_some_and(|next| next.node != one.node);
            for limit in [Some(one), next].into_iter().flatten() {
                let of = self.nodes.entry((limit.node, limit.kind)).or_default();
                of.push((limit.at, id));
                if is_other {
                    let mut part = context.event(limit.kind, Element::Node(limit.node), limit.at);
                    part.part_of = Some(id);
                    self.drafts.add(part);
                }
            }
        }
    }

    /// Adds the event of an edge: as a part of its node's event at that time, or alone.
    fn add_edge(&mut self, what: Element, node: NodeId, topic: TopicId) {
        for (kind, at) in limits(self.context.lives(what)) {
            let of_node = self.nodes.get(&(node, kind)).into_iter().flatten();
            // Near its node's start or stop, within the uncertainty.
            let may = |node: &Bound| {
                let since = node.time.plus(TOGETHER_NS);
                kind == Kind::Started && at.earliest <= since && node.time <= at.time
            };
            let near = of_node
                .map(|(node, id)| (at.time.since(node.time).abs(), node, *id))
                .filter(|(far, node, _)| *far <= TOGETHER_NS || may(node))
                .min_by_key(|(far, _, _)| *far)
                .map(|(_, _, id)| id);
            let mut event = self.context.event(of_edge(kind), what, at);
            event.part_of = near;
            let id = self.drafts.add(event);
            let whole = near.unwrap_or(id);
            let of_topic = self.topics.entry((topic, kind, at.time)).or_insert(whole);
            // One that is shown.
            if self.drafts.get(*of_topic).quiet {
                *of_topic = whole;
            }
        }
    }
}
