//! What the changes of one window mean for the items and arrows that were there before and still are.

use std::collections::{BTreeMap, BTreeSet};

use super::Mark;
use super::cast::{Cast, Place};
use super::present::is_single;
use crate::diff::Change;
use crate::graph::{Element, Elements, Graph, TopicId};

/// A mark, and the rate before where it tells of a rate.
pub(super) type Told = (Mark, Option<f64>);

/// The marks of items and arrows by id.
pub(super) struct News {
    pub(super) items: BTreeMap<u32, Told>,
    pub(super) arrows: BTreeMap<u32, Told>,
}

impl News {
    /// `alone` holds the topics with one publisher, whose own rate the diff does not tell apart from the topic's.
    pub(super) fn new(changes: &[Change], cast: &Cast, alone: &BTreeSet<TopicId>) -> Self {
        let mut news = Self {
            items: BTreeMap::new(),
            arrows: BTreeMap::new(),
        };
        for change in changes {
            match change {
                Change::Added { what, .. } => news.add(cast, *what, Mark::Added, None),
                Change::Removed { what, .. } => news.add(cast, *what, Mark::Removed, None),
                Change::Rate {
                    what,
                    from_hz,
                    to_hz,
                } => {
                    let faster = to_hz > from_hz;
                    let mark = if faster { Mark::Faster } else { Mark::Slower };
                    news.add(cast, *what, mark, Some(*from_hz));
                    let carried = match what {
                        Element::Topic(topic) => alone.contains(topic),
                        _ => !cast.pairs.is_empty(),
                    };
                    if carried {
                        news.add_carriers(cast, *what, mark, *from_hz);
                    }
                }
                Change::HandedOver { topic, .. } => {
                    news.add(cast, Element::Topic(*topic), Mark::HandedOver, None);
                }
                Change::Restarted { node, .. } => {
                    news.add(cast, Element::Node(*node), Mark::Restarted, None);
                }
                Change::Value { what, .. } => news.add(cast, *what, Mark::Changed, None),
            }
        }
        news
    }

    fn add(&mut self, cast: &Cast, what: Element, mark: Mark, from_hz: Option<f64>) {
        let place = |places: &[Place], id: u32| places.get(id as usize).copied();
        match what {
            Element::Node(id) => self.add_item(cast, cast.node.get(id as usize), mark, from_hz),
            Element::Topic(id) => self.add_item(cast, cast.topic.get(id as usize), mark, from_hz),
            Element::Publish(id) => self.add_edge(cast, place(&cast.publish, id), mark, from_hz),
            Element::Subscribe(id) => {
                self.add_edge(cast, place(&cast.subscribe, id), mark, from_hz);
            }
        }
    }

    fn add_item(
        &mut self,
        cast: &Cast,
        item: Option<&Option<u32>>,
        mark: Mark,
        from_hz: Option<f64>,
    ) {
        if let Some(Some(id)) = item {
            let single = is_single(cast, *id);
            keep(&mut self.items, *id, single, mark, from_hz);
        }
    }

    fn add_edge(&mut self, cast: &Cast, place: Option<Place>, mark: Mark, from_hz: Option<f64>) {
        match place {
            Some(Place::Inside(item)) => keep(&mut self.items, item, false, mark, None),
            Some(Place::Arrow(id)) => {
                let arrow = cast.arrows.get(id as usize);
                let single = arrow.is_some_and(|a| a.members.len() == 1);
                keep(&mut self.arrows, id, single, mark, from_hz);
            }
            Some(Place::Hidden) | None => {}
        }
    }

    /// A change of rate shows on the arrows from the publisher too.
    fn add_carriers(&mut self, cast: &Cast, what: Element, mark: Mark, from_hz: f64) {
        for id in cast.carriers.get(&what).into_iter().flatten() {
            let arrow = cast.arrows.get(*id as usize);
            let single = match cast.pairs.get(*id as usize) {
                Some(pairs) => pairs.len() == 1,
                None => arrow.is_some_and(|a| a.members.len() == 1),
            };
            keep(&mut self.arrows, *id, single, mark, Some(from_hz));
        }
    }
}

/// The topics that have exactly one publisher in a window.
pub(super) fn alone(graph: &Graph, elements: &Elements) -> BTreeSet<TopicId> {
    let (mut once, mut more) = (BTreeSet::new(), BTreeSet::new());
    for state in &graph.publishes {
        if let Some(edge) = elements.publishes.get(state.id as usize)
            && !once.insert(edge.topic)
        {
            more.insert(edge.topic);
        }
    }
    once.retain(|topic| !more.contains(topic));
    once
}

/// Notes a change; of several on the same thing the more telling one stays. What stands for several elements is marked
/// as changed inside, and a single one that came or went is told by its presence.
fn keep(all: &mut BTreeMap<u32, Told>, id: u32, single: bool, mark: Mark, from_hz: Option<f64>) {
    let new = match mark {
        Mark::Added | Mark::Removed if single => return,
        _ if single => (mark, from_hz),
        _ => (Mark::Inside, None),
    };
    let old = all.entry(id).or_insert(new);
    if weight(new.0) > weight(old.0) {
        *old = new;
    }
}

fn weight(mark: Mark) -> u8 {
    match mark {
        Mark::HandedOver | Mark::Restarted => 3,
        Mark::Changed => 2,
        Mark::Faster | Mark::Slower => 1,
        Mark::Inside | Mark::Added | Mark::Removed => 0,
    }
}
