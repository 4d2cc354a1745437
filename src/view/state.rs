//! What of the mission one window shows: states, rates and counts gathered from the graph's elements.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::items::{EdgePlace, Viewed};
use super::lives::Alive;
use super::{ArrowKind, Item, ItemKind, Mode, Shown, ViewOptions};
use crate::evidence::Degree;
use crate::graph::{EdgeState, Element, Graph, State, TopicState};

/// Items or arrows of one window by id; ghosts are not among them.
pub(crate) type States = Vec<Option<Shown>>;

/// Gathers what the elements of one window give to an item or arrow.
struct StateGather(States);

impl StateGather {
    fn new(size: usize) -> Self {
        Self(vec![None; size])
    }

    /// Takes in an element: the liveliest state and the strongest degree count, rates and counts are summed.
    fn add(&mut self, id: u32, one: &One) {
        let Some(slot) = self.0.get_mut(id as usize) else {
            return;
        };
        let (state, degree) = (one.state, one.degree);
        let shown = slot.get_or_insert(Shown {
            is_paused: true,
            ..Shown::plain(id, state, degree)
        });
        let (hz, count) = (one.hz, one.count);
        // Those that are there and send nothing would water down the rate of each.
        shown.each += usize::from(one.hz.is_some_and(|hz| hz > 0.0));
        shown.is_paused &= one.is_paused;
        shown.state = shown.state.min(state);
        shown.degree = shown.degree.min(degree);
        shown.hz = sum(shown.hz, hz, |a, b| a + b);
        shown.count = sum(shown.count, count, u64::saturating_add);
    }
}

/// One element of the graph in a window.
#[derive(Clone, Copy)]
struct One {
    state: State,
    degree: Degree,
    hz: Option<f64>,
    count: Option<u64>,
    is_paused: bool,
}

impl One {
    /// Alive without a sign of it.
    const UNHEARD: Self = Self {
        state: State::Silent,
        degree: Degree::Declared,
        hz: None,
        count: None,
        is_paused: false,
    };

    fn new(state: State, degree: Degree) -> Self {
        Self {
            state,
            degree,
            ..Self::UNHEARD
        }
    }
}

/// Per element of one list that lives, what the graph of a window says of it: nothing, where it was not heard.
fn ones<'g, T>(
    alive: &'g [bool],
    paused: &'g [bool],
    states: &'g [T],
    id: impl Fn(&T) -> u32 + 'g,
    one: impl Fn(&T) -> One + 'g,
) -> impl Iterator<Item = (u32, Option<&'g T>, One)> + 'g {
    let mut states = states.iter().peekable();
    let flags = (0..).zip(alive.iter().zip(paused));
    flags.filter_map(move |(at, (is_alive, is_paused))| {
        while states.next_if(|s| id(s) < at).is_some() {}
        let state = states.next_if(|s| id(s) == at);
        is_alive.then(|| {
            let mut one = state.map_or(One::UNHEARD, &one);
            if *is_paused {
                one.is_paused = true;
                one.state = one.state.max(State::Silent);
            }
            (at, state, one)
        })
    })
}

/// Which items and arrows have a living element at a moment.
pub(crate) struct LivingItems {
    pub(crate) items: Vec<bool>,
    pub(crate) arrows: Vec<bool>,
}

impl LivingItems {
    pub(crate) fn of(viewed: &Viewed, alive: &Alive) -> Self {
        let is = |list: &[bool], id: u32| list.get(id as usize) == Some(&true);
        let lives = |element: &Element| match element {
            Element::Node(id) => is(&alive.nodes, *id),
            Element::Topic(id) => is(&alive.topics, *id),
            Element::Publish(id) => is(&alive.publishes, *id),
            Element::Subscribe(id) => is(&alive.subscribes, *id),
        };
        let items = viewed
            .items
            .iter()
            .map(|item| item.members.iter().any(lives));
        let items: Vec<bool> = items.collect();
        let pair = |(p, s): &(u32, u32)| is(&alive.publishes, *p) && is(&alive.subscribes, *s);
        let arrow = |(at, arrow): (usize, &super::Arrow)| {
            let members = || arrow.members.iter().any(lives);
            let itself = viewed
                .pairs
                .get(at)
                .map_or_else(members, |pairs| pairs.iter().any(pair));
            itself && is(&items, arrow.from) && is(&items, arrow.to)
        };
        let arrows = viewed.arrows.iter().enumerate().map(arrow).collect();
        Self { items, arrows }
    }
}

fn sum<T>(a: Option<T>, b: Option<T>, add: impl Fn(T, T) -> T) -> Option<T> {
    match (a, b) {
        (Some(a), Some(b)) => Some(add(a, b)),
        (a, b) => a.or(b),
    }
}

/// What of the mission one window shows: all that lives in it. `lives` are those that live, and those that pause.
pub(crate) fn present(
    graph: &Graph,
    options: &ViewOptions,
    viewed: &Viewed,
    lives: (&Alive, &Alive),
) -> (States, States) {
    let items = present_items(graph, options, viewed, lives);
    let mut arrows = match options.mode {
        Mode::Nodes | Mode::Bundles => present_direct(graph, viewed, lives),
        _ => present_arrows(graph, options, viewed, lives),
    };
    for (slot, arrow) in arrows.iter_mut().zip(&viewed.arrows) {
        if let Some(shown) = slot {
            shown.each = 0;
        }
        let there = |id: u32| items.get(id as usize).is_some_and(Option::is_some);
        if !(there(arrow.from) && there(arrow.to)) {
            *slot = None;
        }
    }
    (items, arrows)
}

/// Whether a node in this state is shown in a window.
pub(crate) fn shows_node(state: State, options: &ViewOptions) -> bool {
    !options.hide.unreachable || matches!(state, State::Active | State::Latched)
}

/// Whether a topic or publication in this state is shown in a window.
pub(crate) fn shows_topic(state: State, options: &ViewOptions) -> bool {
    options.mode != Mode::Active || state == State::Active
}

fn present_items(
    graph: &Graph,
    options: &ViewOptions,
    viewed: &Viewed,
    (alive, paused): (&Alive, &Alive),
) -> States {
    let mut items = StateGather::new(viewed.items.len());
    let nodes = ones(
        &alive.nodes,
        &paused.nodes,
        &graph.nodes,
        |n| n.id,
        |n| One {
            hz: n.hz,
            ..One::new(n.state, n.degree)
        },
    );
    for (at, node, one) in nodes {
        let Some(Some(id)) = viewed.node.get(at as usize) else {
            continue;
        };
        if !shows_node(one.state, options) {
            continue;
        }
        items.add(*id, &one);
        if let (true, Some(shown)) = (is_single(viewed, *id), &mut items.0[*id as usize]) {
            shown.lifecycle = node.and_then(|n| n.lifecycle.as_ref().map(Arc::clone));
        }
    }
    for (at, one) in topics(graph, (alive, paused)) {
        let Some(Some(id)) = viewed.topic.get(at as usize) else {
            continue;
        };
        if !shows_topic(one.state, options) {
            continue;
        }
        // The nodes inside a collapsed namespace count what they publish already.
        let item = viewed.items.get(*id as usize);
        let hz = one.hz.filter(|_| !item.is_some_and(has_nodes));
        items.add(*id, &One { hz, ..one });
    }
    for (slot, item) in items.0.iter_mut().zip(&viewed.items) {
        if let Some(shown) = slot.as_mut().filter(|_| !item.is_replica) {
            shown.each = 0;
        }
    }
    items.0
}

fn topics<'g>(
    graph: &'g Graph,
    (alive, paused): (&'g Alive, &'g Alive),
) -> impl Iterator<Item = (u32, One)> + 'g {
    let one = |t: &TopicState| One {
        hz: t.hz,
        count: Some(t.count),
        ..One::new(t.state, t.degree)
    };
    ones(&alive.topics, &paused.topics, &graph.topics, |t| t.id, one).map(|(at, _, one)| (at, one))
}

/// Publications, or subscriptions, of one window.
fn edges<'g>(
    alive: &'g [bool],
    paused: &'g [bool],
    states: &'g [EdgeState],
) -> impl Iterator<Item = (u32, One)> + 'g {
    let one = |e: &EdgeState| One {
        hz: e.hz,
        count: e.count,
        ..One::new(e.state, e.degree)
    };
    ones(alive, paused, states, |e| e.id, one).map(|(at, _, one)| (at, one))
}

fn has_nodes(item: &Item) -> bool {
    matches!(item.members.first(), Some(Element::Node(_)))
}

pub(crate) fn is_single(viewed: &Viewed, item: u32) -> bool {
    let item = viewed.items.get(item as usize);
    item.is_some_and(|i| i.members.len() == 1 && i.kind != ItemKind::Namespace)
}

fn present_arrows(
    graph: &Graph,
    options: &ViewOptions,
    viewed: &Viewed,
    (alive, paused): (&Alive, &Alive),
) -> States {
    let mut arrows = StateGather::new(viewed.arrows.len());
    for (at, one) in edges(&alive.publishes, &paused.publishes, &graph.publishes) {
        if let Some(EdgePlace::Arrow(id)) = viewed.publish.get(at as usize)
            && shows_topic(one.state, options)
        {
            arrows.add(*id, &one);
        }
    }
    let shown: BTreeSet<u32> = topics(graph, (alive, paused))
        .filter(|(_, topic)| shows_topic(topic.state, options))
        .map(|(at, _)| at)
        .collect();
    for (at, one) in edges(&alive.subscribes, &paused.subscribes, &graph.subscribes) {
        let topic = viewed.subscribed.get(at as usize);
        if let Some(EdgePlace::Arrow(id)) = viewed.subscribe.get(at as usize)
            && topic.is_some_and(|(_, topic)| shown.contains(topic))
        {
            arrows.add(*id, &one);
        }
    }
    arrows.0
}

/// Arrows from node to node: there in a window where both the publication and the subscription are, with the rate of
/// the publication, or of the topic where that is not known.
fn present_direct(graph: &Graph, viewed: &Viewed, lives: (&Alive, &Alive)) -> States {
    let (alive, paused) = lives;
    let publishes: BTreeMap<u32, One> =
        edges(&alive.publishes, &paused.publishes, &graph.publishes).collect();
    let subscribes: BTreeMap<u32, One> =
        edges(&alive.subscribes, &paused.subscribes, &graph.subscribes).collect();
    let topics: BTreeMap<u32, One> = topics(graph, lives).collect();
    let mut arrows = StateGather::new(viewed.arrows.len());
    for (pairs, id) in viewed.pairs.iter().zip(0..) {
        let is_bundle = viewed.arrows.get(id as usize).map(|a| &a.kind) == Some(&ArrowKind::Bundle);
        let (mut last, mut carried) = (None, BTreeSet::new());
        for (publish, subscribe) in pairs {
            let (Some(p), Some(s)) = (publishes.get(publish), subscribes.get(subscribe)) else {
                continue;
            };
            // What several nodes of a box hear comes once.
            if is_bundle && last.replace(publish) == Some(publish) {
                continue;
            }
            let topic = viewed.subscribed.get(*subscribe as usize).map(|s| s.1);
            let is_new = topic.is_some_and(|topic| carried.insert(topic));
            // The rate of the whole topic counts once, however many publish it.
            let topic = topic.filter(|_| is_new || !is_bundle);
            let topic = topic.and_then(|topic| topics.get(&topic));
            let joined = One {
                state: p.state.max(s.state),
                degree: p.degree.max(s.degree),
                hz: p.hz.or_else(|| topic.and_then(|t| t.hz)),
                count: p.count,
                is_paused: p.is_paused,
            };
            arrows.add(id, &joined);
        }
        if let Some(Some(shown)) = arrows.0.get_mut(id as usize).filter(|_| is_bundle) {
            shown.topics = carried.len();
        }
    }
    arrows.0
}
