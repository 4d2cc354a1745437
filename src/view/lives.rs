//! The lives of elements by the ledger: one without a beginning in it was there before, one without an end stays.
//!
//! The picture follows from these and not from the messages that fall into a window, so that nothing comes, goes or
//! changes its look without an entry that says so.

use crate::base::time::{Span, Stamp};
use crate::graph::{Edge, Element, Elements};
use crate::mission::Mission;
use crate::mission::ledger::Kind;

/// Beginnings and ends in continuous time.
pub(crate) struct ItemTurns<'a> {
    elements: &'a Elements,
    /// Per element, the times at which it began (true) and ended (false), sorted.
    turns: PerElement<(Stamp, bool)>,
    /// Per element, the times in which it was silent or away.
    pauses: PerElement<Span>,
}

/// A list per element, by id; most are empty, and all are looked at in many windows.
struct PerElement<T>([Vec<Vec<T>>; 4]);

impl<T> PerElement<T> {
    fn new(elements: &Elements) -> Self {
        fn lists<E, T>(all: &[E]) -> Vec<Vec<T>> {
            all.iter().map(|_| Vec::new()).collect()
        }
        Self([
            lists(&elements.nodes),
            lists(&elements.topics),
            lists(&elements.publishes),
            lists(&elements.subscribes),
        ])
    }

    fn place(what: Element) -> (usize, usize) {
        match what {
            Element::Node(id) => (0, id as usize),
            Element::Topic(id) => (1, id as usize),
            Element::Publish(id) => (2, id as usize),
            Element::Subscribe(id) => (3, id as usize),
        }
    }

    fn of(&self, what: Element) -> &[T] {
        let (kind, id) = Self::place(what);
        self.0[kind].get(id).map_or(&[], Vec::as_slice)
    }

    fn add(&mut self, what: Element, one: T) {
        let (kind, id) = Self::place(what);
        if let Some(list) = self.0[kind].get_mut(id) {
            list.push(one);
        }
    }
}

/// Whether each element lives, per id.
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
            turns: PerElement::new(&mission.elements),
            pauses: PerElement::new(&mission.elements),
        };
        let entries = &mission.ledger.entries;
        for entry in entries {
            // A part is told with its whole, so that it comes and goes with it. What restarts keeps its parts; of a role
            // one run ends there and the next one begins, without which each of them would live all the time.
            let whole = entry.part_of.and_then(|id| entries.get(id as usize));
            let is_kept = whole.is_some_and(|whole| whole.kind == Kind::Restarted);
            if is_kept && !matches!(entry.what, Element::Node(_)) {
                continue;
            }
            let begins = match entry.kind {
                Kind::Started | Kind::Appeared => true,
                Kind::Stopped | Kind::Vanished => false,
                Kind::Restarted | Kind::Silent => {
                    let (start, end) = (entry.time, entry.until.unwrap_or(entry.time));
                    lives.pauses.add(entry.what, Span { start, end });
                    continue;
                }
                _ => continue,
            };
            let turn = (whole.unwrap_or(entry).time, begins);
            lives.turns.add(entry.what, turn);
        }
        for turns in lives.turns.0.iter_mut().flatten() {
            turns.sort_by_key(|turn| turn.0);
        }
        lives
    }

    /// The elements that live just before a moment.
    pub(crate) fn before(&self, at: Stamp) -> Alive {
        self.alive(|turns| lives_at(turns, turns.partition_point(|t| t.0 < at)))
    }

    /// The elements that live at any time of a window.
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
            let covers = |pause: &Span| pause.start <= span.start && span.end <= pause.end;
            self.pauses.of(element).iter().any(covers)
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
        let mut sent: Vec<Option<bool>> = vec![None; self.elements.topics.len()];
        let states = alive.publishes.iter().zip(&paused.publishes);
        for (edge, (_, is_paused)) in self
            .elements
            .publishes
            .iter()
            .zip(states)
            .filter(|s| *s.1.0)
        {
            if let Some(all) = sent.get_mut(edge.topic as usize) {
                *all = Some(all.unwrap_or(true) && *is_paused);
            }
        }
        for (slot, all) in paused.topics.iter_mut().zip(sent) {
            *slot |= all == Some(true);
        }
        let topic = |edge: &Edge| paused.topics.get(edge.topic as usize) == Some(&true);
        paused.subscribes = self.elements.subscribes.iter().map(topic).collect();
        paused
    }

    /// `own` tells whether an element lives by its own beginnings and ends. An edge lives with its node; a topic that
    /// nothing tells of lives with its edges.
    fn alive(&self, own: impl Fn(&[(Stamp, bool)]) -> bool) -> Alive {
        let own = |element| {
            let turns = self.turns.of(element);
            (!turns.is_empty()).then(|| own(turns))
        };
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

/// Whether an element lives after the first `done` of its turns: before the first one, if that is not a beginning.
fn lives_at(turns: &[(Stamp, bool)], done: usize) -> bool {
    match done.checked_sub(1).and_then(|last| turns.get(last)) {
        Some((_, begins)) => *begins,
        None => turns.first().is_none_or(|(_, begins)| !begins),
    }
}

fn ids<T>(all: &[T]) -> impl Iterator<Item = u32> {
    (0..).take(all.len())
}
