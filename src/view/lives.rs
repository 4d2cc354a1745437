//! The lifetimes of elements by the event log: an element without a beginning in it existed before, one
//! without an end stays.
//!
//! The picture is derived from these and not from the messages in a window, so that no element appears,
//! vanishes or changes its look without an event.

use std::collections::{BTreeMap, BTreeSet};

use crate::base::time::{Span, Stamp};
use crate::graph::{ById, Element, Elements, PerElement, TopicId};
use crate::mission::Mission;
use crate::mission::event_log::{Event, EventId, Kind};

/// Beginnings and ends in continuous time.
pub(crate) struct ItemTurns<'a> {
    elements: &'a Elements,
    /// Per element, the times at which it began (true) and ended (false), sorted.
    turns: PerElement<Vec<(Stamp, bool)>>,
    /// Per element, the times in which it was silent or away.
    pauses: PerElement<Vec<Span>>,
}

/// Whether each element exists.
pub(crate) type Alive = PerElement<bool>;

impl<'a> ItemTurns<'a> {
    pub(crate) fn new(mission: &'a Mission) -> Self {
        let mut lives = Self {
            elements: &mission.elements,
            turns: PerElement::new(&mission.elements, |_| Vec::new()),
            pauses: PerElement::new(&mission.elements, |_| Vec::new()),
        };
        let events = &mission.log.events;
        let kept = kept(&mission.elements, events);
        for event in events {
            // A part is reported with its whole, so it appears and vanishes with it.
            let whole = event.part_of.and_then(|id| events.get(id));
            let key = |whole| (whole, part(&mission.elements, event.what));
            if event.part_of.is_some_and(|id| kept.contains(&key(id))) {
                continue;
            }
            let begins = match event.kind {
                Kind::Started | Kind::Appeared => true,
                Kind::Stopped | Kind::Vanished => false,
                Kind::Restarted | Kind::Silent => {
                    let (start, end) = (event.time, event.until.unwrap_or(event.time));
                    if let Some(pauses) = lives.pauses.of_mut(event.what) {
                        pauses.push(Span::new(start, end));
                    }
                    continue;
                }
                _ => continue,
            };
            let whole = whole.unwrap_or(event);
            // A run of a role begins where the last one ended, away until it is back.
            let is_new = begins && whole.kind == Kind::Restarted && !event.what.is_node();
            let end = whole.until.filter(|_| is_new);
            let turn = (end.unwrap_or(whole.time), begins);
            if let Some(turns) = lives.turns.of_mut(event.what) {
                turns.push(turn);
            }
        }
        for turns in lives.turns.values_mut() {
            turns.sort_by_key(|turn| turn.0);
        }
        lives
    }

    /// The elements that exist just before a moment.
    pub(crate) fn before(&self, at: Stamp) -> Alive {
        self.alive(at, |turns| {
            lives_at(turns, turns.partition_point(|t| t.0 < at))
        })
    }

    /// The elements that exist at any time of a window.
    pub(crate) fn during(&self, span: Span) -> Alive {
        self.alive(span.end, |turns| {
            let first = turns.partition_point(|t| t.0 < span.start);
            let inside = turns[first..].iter().take_while(|t| t.0 < span.end);
            lives_at(turns, first) || inside.into_iter().any(|t| t.1)
        })
    }

    /// Elements that are silent or away during a whole window. A publication pauses with its node, a topic
    /// with all of its publications, a subscription with its topic.
    pub(crate) fn paused(&self, span: Span, alive: &Alive) -> Alive {
        let own = |what| {
            let covers = |pause: &Span| pause.start <= span.start && span.end <= pause.end;
            self.pauses
                .of(what)
                .is_some_and(|pauses| pauses.iter().any(covers))
        };
        let mut sent: ById<TopicId, Option<bool>> = ById::like(&self.elements.topics, None);
        for (id, edge) in self.elements.publishes.with_ids() {
            let what = Element::Publish(id);
            if alive.is(what) {
                let is_paused = own(what) || own(Element::Node(edge.node));
                let all = &mut sent[edge.topic];
                *all = Some(all.unwrap_or(true) && is_paused);
            }
        }
        let topic = |id: TopicId| own(Element::Topic(id)) || sent[id] == Some(true);
        PerElement::new(self.elements, |what| {
            match (what, self.elements.ends(what)) {
                (Element::Topic(_) | Element::Subscribe(_), (_, Some(id))) => topic(id),
                (_, (Some(node), _)) => own(what) || own(Element::Node(node)),
                _ => false,
            }
        })
    }

    /// `own` returns whether an element exists according to its own beginnings and ends, the last of them
    /// before `end`. An edge exists as long as its node; a topic without beginnings and ends of its own
    /// exists with its edges or, without edges, from its first message on.
    fn alive(&self, end: Stamp, own: impl Fn(&[(Stamp, bool)]) -> bool) -> Alive {
        let own = |what| {
            let turns = self.turns.of(what).filter(|turns| !turns.is_empty())?;
            Some(own(turns))
        };
        let mut alive = PerElement::new(self.elements, |what| {
            let is = |what| own(what) != Some(false);
            match self.elements.ends(what) {
                (Some(node), Some(topic)) => {
                    is(what) && is(Element::Node(node)) && is(Element::Topic(topic))
                }
                _ => is(what),
            }
        });
        let mut carried: ById<TopicId, Option<bool>> = ById::like(&self.elements.topics, None);
        for (what, edge) in self.elements.edges() {
            let carried = &mut carried[edge.topic];
            *carried = Some(carried.unwrap_or(false) || alive.is(what));
        }
        for (id, carried) in carried.with_ids() {
            let topic = Element::Topic(id);
            let first = self.elements.topics[id].seen.first;
            let lives = carried.unwrap_or(first.is_none_or(|first| first < end));
            if let (None, Some(is)) = (own(topic), alive.of_mut(topic)) {
                *is = lives;
            }
        }
        alive
    }
}

/// The topic, or the edge with its topic and its node's role, that an event is about: the same for each run of a role.
type PartKey<'a> = (bool, Option<&'a str>, Option<TopicId>);

fn part(elements: &Elements, what: Element) -> PartKey<'_> {
    let (node, topic) = elements.ends(what);
    let role = node.map(|id| &*elements.nodes[id].role);
    (matches!(what, Element::Publish(_)), role, topic)
}

/// The topics and edges that a node has before and after its restart: these stay. Nodes are not among them: for a role,
/// one run ends and the next one begins, otherwise each run would exist all the time.
fn kept<'a>(
    elements: &'a Elements,
    events: &ById<EventId, Event>,
) -> BTreeSet<(EventId, PartKey<'a>)> {
    let mut seen: BTreeMap<(EventId, PartKey<'_>), [bool; 2]> = BTreeMap::new();
    for event in events {
        let whole = event.part_of.and_then(|id| Some((id, events.get(id)?)));
        let restart = whole.filter(|(_, whole)| whole.kind == Kind::Restarted);
        if let Some((id, _)) = restart.filter(|_| !event.what.is_node()) {
            let key = (id, part(elements, event.what));
            let [ends, begins] = seen.entry(key).or_default();
            *ends |= event.kind == Kind::Vanished;
            *begins |= event.kind == Kind::Appeared;
        }
    }
    seen.retain(|_, [ends, begins]| *ends && *begins);
    seen.into_keys().collect()
}

/// Whether an element exists after the first `done` of its beginnings and ends; before all of them, it exists
/// unless the first is a beginning.
fn lives_at(turns: &[(Stamp, bool)], done: usize) -> bool {
    match done.checked_sub(1).and_then(|last| turns.get(last)) {
        Some((_, begins)) => *begins,
        None => turns.first().is_none_or(|(_, begins)| !begins),
    }
}
