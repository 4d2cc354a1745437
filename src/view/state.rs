//! The state of items and arrows in one window: existence by the event log, and states, rates and counts of their elements.
//!
//! Existence is derived from the event log and not from the messages in a window, so that no element appears, vanishes or
//! changes its look without an event: an element without a beginning in the log existed before, one without an end stays.

use std::collections::{BTreeMap, BTreeSet};

use super::items::Viewed;
use super::{
    Arrow, ArrowId, ArrowKind, Item, ItemId, ItemKind, Members, Shown, TopicRow, ViewOptions,
};
use crate::base::ids::grouped;
use crate::base::time::{Span, Stamp};
use crate::evidence::Confidence;
use crate::graph::{ById, EdgeId, Element, Elements, PerElement, Row, State, TopicId};
use crate::mission::Mission;
use crate::mission::event_log::{Event, EventId, Kind};

/// Adds an element to an item or arrow.
fn gather(slot: &mut Option<Shown>, id: u32, one: Shown) {
    // Elements that exist without publishing would dilute the rate of each.
    let each = usize::from(one.hz.is_some_and(|hz| hz > 0.0));
    match slot {
        Some(all) => {
            all.add(&one);
            all.each += each;
        }
        None => *slot = Some(Shown { id, each, ..one }),
    }
}

/// The largest ratio of the rates of equal topics in a window: half of it may be counted in the window before.
const EQUAL: f64 = 1.5;

/// The items and arrows with an existing element at a point in time.
#[derive(Default)]
pub(crate) struct LivingItems {
    pub(crate) items: ById<ItemId, bool>,
    pub(crate) arrows: ById<ArrowId, bool>,
    alive: Alive,
}

impl LivingItems {
    pub(crate) fn of(viewed: &Viewed<'_>, alive: Alive) -> Self {
        let lives = |element: &Element| alive.is(*element);
        let items = viewed.items.iter();
        let items = items.map(|item| viewed.body(item).any(lives));
        let items: ById<ItemId, bool> = items.collect();
        let arrow = |(id, arrow): (ArrowId, &Arrow)| {
            let itself = match viewed.pairs.get(id) {
                Some(pairs) => pairs.iter().any(|pair| both_live(&alive, *pair)),
                None => arrow.members.iter().any(lives),
            };
            itself && items[arrow.from] && items[arrow.to]
        };
        let arrows = viewed.arrows.with_ids().map(arrow).collect();
        Self {
            items,
            arrows,
            alive,
        }
    }

    /// Whether an element exists.
    pub(crate) fn has(&self, what: Element) -> bool {
        self.alive.is(what)
    }

    /// The topics of a bundle that exist on this line.
    pub(crate) fn topics(&self, viewed: &Viewed<'_>, id: ArrowId) -> BTreeSet<u32> {
        let (arrow, pairs) = (&viewed.arrows[id], viewed.pairs.get(id));
        let pairs = pairs.into_iter().flatten();
        let alive = pairs.filter(|pair| both_live(&self.alive, **pair));
        alive
            .filter_map(|pair| Some(viewed.row(arrow, *pair)?.0))
            .collect()
    }
}

fn both_live(alive: &Alive, (publish, subscribe): (EdgeId, EdgeId)) -> bool {
    alive.is(Element::Publish(publish)) && alive.is(Element::Subscribe(subscribe))
}

/// Whether a node in this state is shown in a window.
pub(crate) fn shows_node(state: State, options: &ViewOptions) -> bool {
    !options.hide.unreachable || matches!(state, State::Active | State::Latched)
}

/// The state of all elements in one window.
pub(crate) struct Now<'a> {
    mission: &'a Mission,
    options: &'a ViewOptions,
    pub(crate) viewed: &'a Viewed<'a>,
    /// The current window, or an earlier one of the same length.
    pub(super) span: Span,
    /// The elements that exist in it, and those that pause.
    lives: (Alive, Alive),
    /// The row of the graph for each element that is in it, by element.
    rows: PerElement<Option<Row>>,
    /// The only publication of each topic; `None` if there are several.
    sole: ById<TopicId, Option<EdgeId>>,
    /// The publications of each topic.
    senders: ById<TopicId, Vec<EdgeId>>,
    /// The times in which subscriptions receive nothing.
    starved: BTreeMap<Element, Vec<Span>>,
}

impl<'a> Now<'a> {
    /// The state before the first window, in which nothing is known.
    pub(crate) fn new(
        mission: &'a Mission,
        options: &'a ViewOptions,
        viewed: &'a Viewed<'a>,
    ) -> Self {
        let mut senders = ById::like(&mission.elements.topics, Vec::new());
        for (id, edge) in mission.elements.publishes.with_ids() {
            senders[edge.topic].push(id);
        }
        Self {
            mission,
            options,
            viewed,
            senders,
            span: Span::new(Stamp(0), Stamp(0)),
            lives: (Alive::default(), Alive::default()),
            rows: PerElement::new(&mission.elements, |_| None),
            sole: mission.elements.sole_publishers(),
            starved: grouped(starved(mission)),
        }
    }

    /// Sets the row of the graph for an element from now on; `None` if it has none.
    pub(crate) fn apply(&mut self, what: Element, row: Option<Row>) {
        if let Some(slot) = self.rows.of_mut(what) {
            *slot = row;
        }
    }

    /// Sets the elements that exist and pause from this window on.
    pub(crate) fn live(&mut self, window: Span, alive: Alive, paused: Alive) {
        (self.span, self.lives) = (window, (alive, paused));
    }

    /// The look of an element, `None` if it does not exist; silent and only declared if it exists without messages.
    pub(crate) fn one(&self, what: Element) -> Option<Shown> {
        let (alive, paused) = &self.lives;
        if !alive.is(what) {
            return None;
        }
        let row = self.rows.of(what).and_then(Option::as_ref);
        let mut one = Shown::plain(0, State::Silent, Confidence::Declared);
        if let Some(row) = row {
            one = Shown::plain(0, row.state, row.confidence);
            // Few bags count what subscribers get, so that lines to all of them look alike.
            if !matches!(what, Element::Subscribe(_)) {
                (one.hz, one.count) = (row.hz(self.span), row.count);
            }
        }
        if let (None, Some(row)) = (one.hz, self.row_of_sole(what)) {
            (one.hz, one.count) = (row.hz(self.span), row.count);
        }
        // After its last publisher ended, a topic is silent even if its messages were rare.
        let topic = self.mission.elements.ends(what).1;
        let is_left = one.state == State::Silent && topic.is_some_and(|id| self.is_left(id));
        if paused.is(what) || is_left {
            one.is_paused = true;
            one.state = one.state.max(State::Silent);
        }
        let is_now = |span: &Span| span.start < self.span.end && self.span.start < span.end;
        let starved = self.starved.get(&what);
        one.is_starved = starved.is_some_and(|spans| spans.iter().any(is_now));
        if let Some(topic) = self.waits_for(what) {
            one.is_paused = true;
            one.state = self.state_of_waiting(topic).max(one.state);
        }
        Some(one)
    }

    /// For the only publication of a topic, the row of the topic: all its messages come from there.
    fn row_of_sole(&self, what: Element) -> Option<&Row> {
        let Element::Publish(id) = what else {
            return None;
        };
        let topic = self.mission.elements.ends(what).1?;
        self.sole.get(topic)?.filter(|sole| *sole == id)?;
        self.rows.of(Element::Topic(topic))?.as_ref()
    }

    /// The topic of an element, if its first message comes after the window. A latched one needs no message.
    fn waits_for(&self, what: Element) -> Option<TopicId> {
        let (_, topic) = self.mission.elements.ends(what);
        let first = self.mission.elements.topics.get(topic?)?.seen.first;
        let row = self.rows.of(Element::Topic(topic?))?.as_ref();
        let is_latched = row.is_some_and(|row| row.state == State::Latched);
        topic.filter(|_| !is_latched && first.is_some_and(|first| first >= self.span.end))
    }

    /// Whether none of the known publishers of a topic exists.
    fn is_left(&self, topic: TopicId) -> bool {
        let is_alive = |id: &EdgeId| self.lives.0.is(Element::Publish(*id));
        let senders = self.senders.get(topic);
        senders.is_some_and(|all| !all.is_empty() && !all.iter().any(is_alive))
    }

    /// The state of a topic before its first message: only subscribed to, if no publisher is known.
    fn state_of_waiting(&self, topic: TopicId) -> State {
        let is_unknown = self.senders.get(topic).is_none_or(Vec::is_empty);
        if is_unknown || self.is_left(topic) {
            State::Declared
        } else {
            State::Silent
        }
    }

    /// The look of an item; `None` if no part of it exists. Ghosts are excluded.
    pub(crate) fn item(&self, id: ItemId) -> Option<Shown> {
        let item = self.viewed.items.get(id)?;
        if !self.viewed.body(item).any(|what| self.lives.0.is(*what)) {
            return None;
        }
        let has_nodes = item.members.first().is_some_and(Element::is_node);
        let mut slot = None;
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for member in &item.members {
            let Some(mut one) = self.one(*member) else {
                continue;
            };
            let sent = one.hz.filter(|hz| *hz > 0.0);
            (least, most) = sent.map_or((least, most), |hz| (least.min(hz), most.max(hz)));
            if member.is_topic() && has_nodes {
                // The nodes inside a collapsed namespace already count what they publish.
                one.hz = None;
            } else if member.is_node() {
                if !shows_node(one.state, self.options) {
                    continue;
                }
                // The count of a node is that of its topics' messages.
                one.count = None;
            }
            gather(&mut slot, id.0, one);
        }
        let mut shown = slot?;
        if item.is_service {
            shown.is_called();
        }
        if let [node @ Element::Node(_)] = &item.members[..]
            && item.kind != ItemKind::Namespace
        {
            let row = self.rows.of(*node).and_then(Option::as_ref);
            shown.lifecycle = row.and_then(|row| self.mission.graphs.lifecycle(row).cloned());
        }
        // Of unequal rates, the sum is true.
        if !item.is_replica || most > EQUAL * least {
            shown.each = 0;
        }
        if item.kind == ItemKind::Namespace {
            shown.members = self.members(item);
        }
        Some(shown)
    }

    /// The members of a collapsed namespace that are in the window's graph.
    fn members(&self, item: &Item) -> Members {
        let mut members = Members::default();
        let is_there = |what: &Element| self.rows.of(*what).is_some_and(Option::is_some);
        for member in item.members.iter().filter(|what| is_there(what)) {
            match member {
                Element::Node(_) => members.nodes += 1,
                _ => members.topics += 1,
            }
        }
        members
    }

    /// The look of an arrow, whether or not its ends are present.
    pub(crate) fn arrow(&self, id: ArrowId) -> Option<Shown> {
        let arrow = self.viewed.arrows.get(id)?;
        let slot = match arrow.kind {
            ArrowKind::Direct(_) | ArrowKind::Bundle => self.direct(id, arrow),
            ArrowKind::Publish | ArrowKind::Subscribe => self.edges(id, arrow),
        };
        slot.map(|mut shown| {
            if arrow.is_service {
                shown.is_called();
            }
            Shown { each: 0, ..shown }
        })
    }

    fn edges(&self, id: ArrowId, arrow: &Arrow) -> Option<Shown> {
        let mut slot = None;
        for member in &arrow.members {
            if let Element::Subscribe(_) = member {
                let topic = self.mission.elements.ends(*member).1;
                if !topic.is_some_and(|topic| self.lives.0.is(Element::Topic(topic))) {
                    continue;
                }
            }
            if let Some(one) = self.one(*member) {
                gather(&mut slot, id.0, one);
            }
        }
        slot
    }

    /// An arrow from node to node: present in a window with both the publication and the subscription, with
    /// the rate of the publication, or of the topic if that is unknown.
    fn direct(&self, id: ArrowId, arrow: &Arrow) -> Option<Shown> {
        let mut slot = None;
        let is_bundle = arrow.kind == ArrowKind::Bundle;
        let (mut last, mut carried, mut services) = (None, BTreeSet::new(), BTreeSet::new());
        let mut rows: BTreeMap<u32, (Option<Shown>, [bool; 2])> = BTreeMap::new();
        for (publish, subscribe) in self.viewed.pairs.get(id)? {
            let ends = [Element::Publish(*publish), Element::Subscribe(*subscribe)];
            let [Some(p), Some(s)] = ends.map(|end| self.one(end)) else {
                continue;
            };
            let row = self.viewed.row(arrow, (*publish, *subscribe));
            let row = row.filter(|_| is_bundle);
            if let Some((topic, way)) = row {
                rows.entry(topic).or_default().1[way] = true;
            }
            // Messages to several nodes of a box count once.
            if is_bundle && last.replace(publish) == Some(publish) {
                continue;
            }
            let received = Element::Subscribe(*subscribe);
            let topic = self.mission.elements.ends(received).1;
            let is_new = topic.is_some_and(|topic| carried.insert(topic));
            // The rate of the whole topic counts once, regardless of the number of publishers.
            let topic = topic.filter(|_| is_new || !is_bundle);
            let topic = topic.and_then(|topic| self.one(Element::Topic(topic)));
            let joined = Shown {
                state: p.state.max(s.state),
                confidence: p.confidence.max(s.confidence),
                hz: p.hz.or_else(|| topic.and_then(|t| t.hz)),
                is_starved: s.is_starved,
                ..p
            };
            gather(&mut slot, id.0, joined.clone());
            if let Some((topic, _)) = row {
                if self.mission.elements.is_service(received) {
                    services.insert(topic);
                }
                gather(&mut rows.entry(topic).or_default().0, topic, joined);
            }
        }
        let topics = rows.into_values().filter_map(|(shown, ways)| {
            let mut shown = shown?;
            if shown.is_paused {
                shown.state = shown.state.max(State::Silent);
            }
            Some(TopicRow {
                is_service: services.contains(&shown.id),
                ..TopicRow::of(shown.id, ways, &shown)
            })
        });
        let topics = topics.collect();
        slot.map(|shown| Shown { topics, ..shown })
    }

    /// An event of the log.
    pub(crate) fn event(&self, id: EventId) -> Option<&Event> {
        self.mission.log.events.get(id)
    }
}

/// The subscriptions that receive nothing according to the event log: from that event to the end of the
/// subscription.
fn starved(mission: &Mission) -> Vec<(Element, Span)> {
    let events = mission.log.events.iter();
    let events = events.filter(|event| event.kind == Kind::Starved);
    let edges = events.filter(|event| matches!(event.what, Element::Subscribe(_)));
    let lasts = |event: &Event| {
        let mut runs = mission.elements.seen(event.what).lives.iter();
        let run = runs.find(|run| run.contains(event.time));
        let end = run.map_or(mission.span.end, |run| run.end);
        (event.what, Span::new(event.time, end))
    };
    edges.map(lasts).collect()
}

/// Beginnings and ends in continuous time.
pub(crate) struct Lifetimes<'a> {
    elements: &'a Elements,
    /// Per element, the times at which it began (true) and ended (false), sorted.
    bounds: PerElement<Vec<(Stamp, bool)>>,
    /// Per element, the times in which it was silent or away.
    pauses: PerElement<Vec<Span>>,
}

/// Whether each element exists.
pub(crate) type Alive = PerElement<bool>;

impl<'a> Lifetimes<'a> {
    pub(crate) fn new(mission: &'a Mission) -> Self {
        let mut lives = Self {
            elements: &mission.elements,
            bounds: PerElement::new(&mission.elements, |_| Vec::new()),
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
            let bound = (end.unwrap_or(whole.time), begins);
            if let Some(bounds) = lives.bounds.of_mut(event.what) {
                bounds.push(bound);
            }
        }
        for bounds in lives.bounds.values_mut() {
            bounds.sort_by_key(|bound| bound.0);
        }
        lives
    }

    /// The elements that exist just before a moment.
    pub(crate) fn before(&self, at: Stamp) -> Alive {
        self.alive(at, |bounds| {
            lives_at(bounds, bounds.partition_point(|t| t.0 < at))
        })
    }

    /// The elements that exist at any time of a window.
    pub(crate) fn during(&self, span: Span) -> Alive {
        self.alive(span.end, |bounds| {
            let first = bounds.partition_point(|t| t.0 < span.start);
            let inside = bounds[first..].iter().take_while(|t| t.0 < span.end);
            lives_at(bounds, first) || inside.into_iter().any(|t| t.1)
        })
    }

    /// Whether all of some elements exist at one moment of a window: a publisher that stops before a subscriber starts has no
    /// line to it.
    pub(crate) fn meet(&self, all: &[Element], span: Span) -> bool {
        let bounds = || all.iter().filter_map(|what| self.bounds.of(*what));
        let times = bounds().flatten().map(|bound| bound.0);
        let inside = times.filter(|at| (span.start..span.end).contains(at));
        std::iter::once(span.start).chain(inside).any(|at| {
            let lives = |bounds: &Vec<_>| lives_at(bounds, bounds.partition_point(|t| t.0 <= at));
            bounds().all(lives)
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
            let bounds = self.bounds.of(what).filter(|bounds| !bounds.is_empty())?;
            Some(own(bounds))
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
fn lives_at(bounds: &[(Stamp, bool)], done: usize) -> bool {
    match done.checked_sub(1).and_then(|last| bounds.get(last)) {
        Some((_, begins)) => *begins,
        None => bounds.first().is_none_or(|(_, begins)| !begins),
    }
}
