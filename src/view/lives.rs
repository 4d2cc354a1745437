//! When each element lives, by the ledger: what has no beginning in it was there before, what has no end stays.
//!
//! What the picture shows follows from this and not from what happened to be heard in a window, so that nothing comes,
//! goes or changes its look without an entry that says so.

use std::collections::BTreeMap;

use crate::base::time::{Span, Stamp};
use crate::graph::{Edge, Element, Elements};
use crate::mission::Mission;
use crate::mission::ledger::Kind;

/// Beginnings and ends in continuous time.
pub(crate) struct ItemTurns<'a> {
    elements: &'a Elements,
    /// Per element, sorted by time, when it began (true) and ended.
    turns: BTreeMap<Element, Vec<(Stamp, bool)>>,
    /// Per element, from when to when it was silent or away.
    pauses: BTreeMap<Element, Vec<Span>>,
}

/// Which elements live, per id.
#[derive(Clone, Debug, Default)]
pub(crate) struct Alive {
    pub(crate) nodes: Vec<bool>,
    pub(crate) topics: Vec<bool>,
    pub(crate) publishes: Vec<bool>,
    pub(crate) subscribes: Vec<bool>,
}

impl<'a> ItemTurns<'a> {
    pub(crate) fn new(mission: &'a Mission) -> Self {
        let mut lives = Self {
            elements: &mission.elements,
            turns: BTreeMap::new(),
            pauses: BTreeMap::new(),
        };
        let entries = &mission.ledger.entries;
        for entry in entries {
            // A part is told with its whole, so that it comes and goes with it. What restarts keeps its parts.
            let whole = entry.part_of.and_then(|id| entries.get(id as usize));
            if whole.is_some_and(|whole| whole.kind == Kind::Restarted) {
                continue;
            }
            let begins = match entry.kind {
                Kind::Started | Kind::Appeared => true,
                Kind::Stopped | Kind::Vanished => false,
                Kind::Restarted | Kind::Silent => {
                    let (start, end) = (entry.time, entry.until.unwrap_or(entry.time));
                    let pauses = lives.pauses.entry(entry.what).or_default();
                    pauses.push(Span { start, end });
                    continue;
                }
                _ => continue,
            };
            let turns = lives.turns.entry(entry.what).or_default();
            turns.push((whole.unwrap_or(entry).time, begins));
        }
        for turns in lives.turns.values_mut() {
            turns.sort_by_key(|turn| turn.0);
        }
        lives
    }

    /// What lives just before a moment.
    pub(crate) fn before(&self, at: Stamp) -> Alive {
        self.alive(|turns| lives_at(turns, turns.partition_point(|t| t.0 < at)))
    }

    /// What lives at any time of a window.
    pub(crate) fn during(&self, span: Span) -> Alive {
        self.alive(|turns| {
            let first = turns.partition_point(|t| t.0 < span.start);
            let inside = turns[first..].iter().take_while(|t| t.0 < span.end);
            lives_at(turns, first) || inside.into_iter().any(|t| t.1)
        })
    }

    /// Elements that are silent or away all through a window. A publication pauses with its node, a topic with all of
    /// its publications, a subscription with its topic.
    pub(crate) fn paused(&self, span: Span, alive: &Alive) -> Alive {
        let own = |element| {
            let pauses = self.pauses.get(&element).into_iter().flatten();
            let covers = |pause: &&Span| pause.start <= span.start && span.end <= pause.end;
            pauses.clone().any(|pause| covers(&pause))
        };
        let mut paused = Alive {
            nodes: ids(&self.elements.nodes)
                .map(|id| own(Element::Node(id)))
                .collect(),
            topics: ids(&self.elements.topics)
                .map(|id| own(Element::Topic(id)))
                .collect(),
            publishes: Vec::new(),
            subscribes: Vec::new(),
        };
        let node = |edge: &Edge| paused.nodes.get(edge.node as usize) == Some(&true);
        let edges = self.elements.publishes.iter().zip(0..);
        paused.publishes = edges
            .map(|(edge, id)| own(Element::Publish(id)) || node(edge))
            .collect();
        let mut sent: BTreeMap<u32, bool> = BTreeMap::new();
        let states = alive.publishes.iter().zip(&paused.publishes);
        for (edge, (_, is_paused)) in self
            .elements
            .publishes
            .iter()
            .zip(states)
            .filter(|s| *s.1.0)
        {
            *sent.entry(edge.topic).or_insert(true) &= is_paused;
        }
        for (topic, is_paused) in sent {
            if let Some(slot) = paused.topics.get_mut(topic as usize) {
                *slot |= is_paused;
            }
        }
        let topic = |edge: &Edge| paused.topics.get(edge.topic as usize) == Some(&true);
        paused.subscribes = self.elements.subscribes.iter().map(topic).collect();
        paused
    }

    /// `own` tells whether an element lives by its own beginnings and ends. An edge lives with its node; a topic that
    /// nothing tells of lives with its edges.
    fn alive(&self, own: impl Fn(&[(Stamp, bool)]) -> bool) -> Alive {
        let own = |element| self.turns.get(&element).map(|turns| own(turns));
        let nodes: Vec<bool> = ids(&self.elements.nodes)
            .map(|id| own(Element::Node(id)) != Some(false))
            .collect();
        let topics: Vec<Option<bool>> = ids(&self.elements.topics)
            .map(|id| own(Element::Topic(id)))
            .collect();
        let edge = |edge: &Edge, element| {
            own(element) != Some(false)
                && nodes.get(edge.node as usize) == Some(&true)
                && topics.get(edge.topic as usize) != Some(&Some(false))
        };
        let publishes = self.elements.publishes.iter().zip(0..);
        let publishes: Vec<bool> = publishes
            .map(|(e, id)| edge(e, Element::Publish(id)))
            .collect();
        let subscribes = self.elements.subscribes.iter().zip(0..);
        let subscribes: Vec<bool> = subscribes
            .map(|(e, id)| edge(e, Element::Subscribe(id)))
            .collect();
        let mut carried: Vec<Option<bool>> = vec![None; topics.len()];
        let all = self.elements.publishes.iter().zip(&publishes);
        for (edge, lives) in all.chain(self.elements.subscribes.iter().zip(&subscribes)) {
            if let Some(carried) = carried.get_mut(edge.topic as usize) {
                *carried = Some(carried.unwrap_or(false) || *lives);
            }
        }
        let topics = topics.into_iter().zip(carried);
        Alive {
            topics: topics
                .map(|(own, carried)| own.or(carried).unwrap_or(true))
                .collect(),
            nodes,
            publishes,
            subscribes,
        }
    }
}

/// Whether an element lives after the first `done` of its turns: before the first one, if that is no beginning.
fn lives_at(turns: &[(Stamp, bool)], done: usize) -> bool {
    match done.checked_sub(1).and_then(|last| turns.get(last)) {
        Some((_, begins)) => *begins,
        None => turns.first().is_none_or(|(_, begins)| !begins),
    }
}

fn ids<T>(all: &[T]) -> impl Iterator<Item = u32> {
    (0..).take(all.len())
}
