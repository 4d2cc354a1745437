//! Starts, ends and restarts: of nodes and roles, with their edges and topics as parts.

use std::collections::BTreeMap;

use super::make::{Drafts, LogInput};
use super::{EventId, Kind};
use crate::base::rhythm::TOGETHER_NS;
use crate::base::time::Stamp;
use crate::graph::history::{Bound, Life};
use crate::graph::{Element, NodeId, TopicId};

/// The kind of a turn: a beginning or an end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Turn {
    Begins,
    Ends,
}

/// The events about turns, by node and topic.
#[derive(Default)]
struct Wholes {
    nodes: BTreeMap<(NodeId, Turn), Vec<(Bound, EventId)>>,
    topics: BTreeMap<(TopicId, Turn, Stamp), EventId>,
}

/// Adds the events of all lifetimes.
pub(super) fn add(context: &LogInput<'_>, drafts: &mut Drafts) {
    let mut wholes = Wholes::default();
    for turns in turns_by_role(context).values() {
        add_role(context, drafts, &mut wholes, turns);
    }
    let recorded = || {
        context
            .elements
            .all()
            .filter(|what| !context.is_timeless(*what))
    };
    for what in recorded() {
        if let (Some(node), Some(topic)) = context.elements.ends(what) {
            add_edge(context, drafts, &mut wholes, what, (node, topic));
        }
    }
    for what in recorded() {
        let Element::Topic(id) = what else { continue };
        for (turn, at) in turns(context.lives(what)) {
            let mut event = context.event(kind(turn), what, at);
            event.part_of = wholes.topics.get(&(id, turn, at.time)).copied();
            drafts.add(event);
        }
    }
}

/// The beginnings and ends of an element, in order.
fn turns(lives: &[Life]) -> impl Iterator<Item = (Turn, Bound)> + '_ {
    lives.iter().flat_map(|life| {
        let began = life.began.map(|at| (Turn::Begins, at));
        let ended = life.ended.map(|at| (Turn::Ends, at));
        began.into_iter().chain(ended)
    })
}

fn kind(turn: Turn) -> Kind {
    match turn {
        Turn::Begins => Kind::Appeared,
        Turn::Ends => Kind::Vanished,
    }
}

/// The turns of a role, sorted: by time, rank and node.
type RoleTurns = Vec<((Stamp, u8, NodeId), (Turn, Bound))>;

/// The turns of all nodes by role: anonymous nodes share a role, any other node is its own. At one time, one ends
/// before the next begins; a node known from a single moment begins before it ends.
fn turns_by_role<'a>(context: &LogInput<'a>) -> BTreeMap<&'a str, RoleTurns> {
    let mut all: BTreeMap<&str, RoleTurns> = BTreeMap::new();
    let nodes = context.elements.nodes.with_ids();
    for (id, node) in nodes.filter(|(id, _)| !context.is_timeless(Element::Node(*id))) {
        let of = all.entry(&*node.role).or_default();
        for life in context.lives(Element::Node(id)) {
            let (began, ended) = (life.began, life.ended);
            let is_moment = began.zip(ended).is_some_and(|(b, e)| b.time == e.time);
            let turns = turns(std::slice::from_ref(life));
            of.extend(turns.map(|(turn, at)| {
                let rank = if is_moment {
                    1
                } else {
                    2 * u8::from(turn == Turn::Begins)
                };
                ((at.time, rank, id), (turn, at))
            }));
        }
    }
    for turns in all.values_mut() {
        turns.sort_by_key(|(order, _)| *order);
    }
    all
}

/// Adds the events of one role: an end followed by a beginning is a restart.
fn add_role(context: &LogInput<'_>, drafts: &mut Drafts, wholes: &mut Wholes, turns: &RoleTurns) {
    let mut rest = turns.as_slice();
    while let Some((&((.., node), (turn, at)), after)) = rest.split_first() {
        let back = after
            .first()
            .filter(|(_, next)| turn == Turn::Ends && next.0 == Turn::Begins);
        let Some(&((.., heir), (_, again))) = back else {
            let kind = match turn {
                Turn::Begins => Kind::Started,
                Turn::Ends => Kind::Stopped,
            };
            let id = drafts.add(context.event(kind, Element::Node(node), at));
            wholes.nodes.entry((node, turn)).or_default().push((at, id));
            rest = after;
            continue;
        };
        let mut event = context.event(Kind::Restarted, Element::Node(heir), at);
        event.until = Some(again.time);
        let id = drafts.add(event);
        wholes
            .nodes
            .entry((node, Turn::Ends))
            .or_default()
            .push((at, id));
        wholes
            .nodes
            .entry((heir, Turn::Begins))
            .or_default()
            .push((again, id));
        if heir != node {
            for (kind, node, at) in [(Kind::Stopped, node, at), (Kind::Started, heir, again)] {
                let mut part = context.event(kind, Element::Node(node), at);
                part.part_of = Some(id);
                drafts.add(part);
            }
        }
        rest = &after[1..];
    }
}

/// Adds the event of an edge: as a part of its node's event at that time, or alone.
fn add_edge(
    context: &LogInput<'_>,
    drafts: &mut Drafts,
    wholes: &mut Wholes,
    what: Element,
    (node, topic): (NodeId, TopicId),
) {
    for (turn, at) in turns(context.lives(what)) {
        let of_node = wholes.nodes.get(&(node, turn)).into_iter().flatten();
        // Near its node's turn, within the uncertainty.
        let may = |node: &Bound| {
            let since = node.time.plus(TOGETHER_NS);
            turn == Turn::Begins && at.earliest <= since && node.time <= at.time
        };
        let near = of_node
            .map(|(node, id)| (at.time.since(node.time).abs(), node, *id))
            .filter(|(far, node, _)| *far <= TOGETHER_NS || may(node))
            .min_by_key(|(far, _, _)| *far)
            .map(|(_, _, id)| id);
        let mut event = context.event(kind(turn), what, at);
        event.part_of = near;
        let id = drafts.add(event);
        let whole = near.unwrap_or(id);
        wholes.topics.entry((topic, turn, at.time)).or_insert(whole);
    }
}
