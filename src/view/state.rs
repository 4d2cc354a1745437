//! What of the mission one window shows: states, rates and counts gathered from the graph's elements.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::items::{Place, Viewed};
use super::{Item, ItemKind, Mode, Shown, ViewOptions};
use crate::evidence::Degree;
use crate::graph::{Element, Graph, State};

/// Items or arrows of one window by id; ghosts are not among them.
pub(crate) type States = Vec<Option<Shown>>;

/// Gathers what the elements of one window give to an item or arrow.
struct Gather(States);

impl Gather {
    fn new(size: usize) -> Self {
        Self(vec![None; size])
    }

    /// Takes in an element: the liveliest state and the strongest degree count, rates and counts are summed.
    fn add(&mut self, id: u32, state: State, degree: Degree, hz: Option<f64>, count: Option<u64>) {
        let Some(slot) = self.0.get_mut(id as usize) else {
            return;
        };
        let shown = slot.get_or_insert(Shown {
            id,
            state,
            degree,
            mark: None,
            hz: None,
            from_hz: None,
            count: None,
            lifecycle: None,
        });
        shown.state = shown.state.min(state);
        shown.degree = shown.degree.min(degree);
        shown.hz = sum(shown.hz, hz, |a, b| a + b);
        shown.count = sum(shown.count, count, u64::saturating_add);
    }
}

fn sum<T>(a: Option<T>, b: Option<T>, add: impl Fn(T, T) -> T) -> Option<T> {
    match (a, b) {
        (Some(a), Some(b)) => Some(add(a, b)),
        (a, b) => a.or(b),
    }
}

/// What of the mission one window shows.
pub(crate) fn present(graph: &Graph, options: &ViewOptions, viewed: &Viewed) -> (States, States) {
    let items = present_items(graph, options, viewed);
    let active: Vec<bool> = match options.mode {
        Mode::Active => active_topics(graph, viewed.topic.len()),
        _ => Vec::new(),
    };
    let shown = |topic: u32| active.is_empty() || active.get(topic as usize) == Some(&true);
    let mut arrows = match options.mode {
        Mode::Nodes => present_direct(graph, viewed),
        _ => present_arrows(graph, viewed, options.mode, &shown),
    };
    for (slot, arrow) in arrows.iter_mut().zip(&viewed.arrows) {
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

fn active_topics(graph: &Graph, size: usize) -> Vec<bool> {
    let mut active = vec![false; size.max(1)];
    for topic in graph.topics.iter().filter(|t| t.state == State::Active) {
        if let Some(active) = active.get_mut(topic.id as usize) {
            *active = true;
        }
    }
    active
}

fn present_items(graph: &Graph, options: &ViewOptions, viewed: &Viewed) -> States {
    let mut items = Gather::new(viewed.items.len());
    for node in &graph.nodes {
        let Some(Some(id)) = viewed.node.get(node.id as usize) else {
            continue;
        };
        if !shows_node(node.state, options) {
            continue;
        }
        items.add(*id, node.state, node.degree, node.hz, None);
        if let (true, Some(shown)) = (is_single(viewed, *id), &mut items.0[*id as usize]) {
            shown.lifecycle = node.lifecycle.as_ref().map(Arc::clone);
        }
    }
    for topic in &graph.topics {
        let Some(Some(id)) = viewed.topic.get(topic.id as usize) else {
            continue;
        };
        if !shows_topic(topic.state, options) {
            continue;
        }
        // The nodes inside a collapsed namespace count what they publish already.
        let item = viewed.items.get(*id as usize);
        let hz = topic.hz.filter(|_| !item.is_some_and(has_nodes));
        items.add(*id, topic.state, topic.degree, hz, Some(topic.count));
    }
    items.0
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
    viewed: &Viewed,
    mode: Mode,
    topic_shown: &impl Fn(u32) -> bool,
) -> States {
    let mut arrows = Gather::new(viewed.arrows.len());
    for edge in &graph.publishes {
        if mode == Mode::Active && edge.state != State::Active {
            continue;
        }
        if let Some(Place::Arrow(id)) = viewed.publish.get(edge.id as usize) {
            arrows.add(*id, edge.state, edge.degree, edge.hz, edge.count);
        }
    }
    for edge in &graph.subscribes {
        let topic = viewed.subscribed.get(edge.id as usize);
        if let Some(Place::Arrow(id)) = viewed.subscribe.get(edge.id as usize)
            && topic.is_some_and(|(_, topic)| topic_shown(*topic))
        {
            arrows.add(*id, edge.state, edge.degree, edge.hz, edge.count);
        }
    }
    arrows.0
}

/// Arrows from node to node: there in a window where both the publication and the subscription are, with the rate of
/// the publication, or of the topic where that is not known.
fn present_direct(graph: &Graph, viewed: &Viewed) -> States {
    let publishes: BTreeMap<u32, _> = graph.publishes.iter().map(|e| (e.id, e)).collect();
    let subscribes: BTreeMap<u32, _> = graph.subscribes.iter().map(|e| (e.id, e)).collect();
    let topics: BTreeMap<u32, _> = graph.topics.iter().map(|t| (t.id, t)).collect();
    let mut arrows = Gather::new(viewed.arrows.len());
    for (pairs, id) in viewed.pairs.iter().zip(0..) {
        for (publish, subscribe) in pairs {
            let (Some(p), Some(s)) = (publishes.get(publish), subscribes.get(subscribe)) else {
                continue;
            };
            let topic = viewed.subscribed.get(s.id as usize);
            let topic = topic.and_then(|(_, topic)| topics.get(topic));
            let hz = p.hz.or_else(|| topic.and_then(|t| t.hz));
            arrows.add(
                id,
                p.state.max(s.state),
                p.degree.max(s.degree),
                hz,
                p.count,
            );
        }
    }
    arrows.0
}
