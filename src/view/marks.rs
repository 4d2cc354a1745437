//! What the changes of one window mean for the items and arrows that were there before and still are.

use std::collections::{BTreeMap, BTreeSet};

use super::items::{Place, Viewed};
use super::{ItemKind, Mark};
use crate::base::words;
use crate::graph::diff::Change;
use crate::graph::{Element, Elements, Graph, TopicId};

/// A mark, and the rate before where it tells of a rate.
pub(crate) type MarkedRate = (Mark, Option<f64>);

/// The marks of items and arrows by id.
pub(crate) struct News {
    pub(crate) items: BTreeMap<u32, MarkedRate>,
    pub(crate) arrows: BTreeMap<u32, MarkedRate>,
}

impl News {
    /// `alone` holds the topics with one publisher, whose own rate the diff does not tell apart from the topic's.
    pub(crate) fn new(changes: &[Change], viewed: &Viewed, alone: &BTreeSet<TopicId>) -> Self {
        let mut news = Self {
            items: BTreeMap::new(),
            arrows: BTreeMap::new(),
        };
        for change in changes {
            match change {
                Change::Added { what, .. } => news.add(viewed, *what, Mark::Added, None),
                Change::Removed { what, .. } => news.add(viewed, *what, Mark::Removed, None),
                Change::Rate {
                    what,
                    from_hz,
                    to_hz,
                } if words::number(*from_hz) != words::number(*to_hz) => {
                    let faster = to_hz > from_hz;
                    let mark = if faster { Mark::Faster } else { Mark::Slower };
                    news.add(viewed, *what, mark, Some(*from_hz));
                    let carried = match what {
                        Element::Topic(topic) => alone.contains(topic),
                        _ => !viewed.pairs.is_empty(),
                    };
                    if carried {
                        news.add_carriers(viewed, *what, mark, *from_hz);
                    }
                }
                // What reads the same is no change to a reader.
                Change::Rate { .. } => {}
                Change::HandedOver { topic, .. } => {
                    news.add(viewed, Element::Topic(*topic), Mark::HandedOver, None);
                }
                Change::Restarted { node, .. } => {
                    news.add(viewed, Element::Node(*node), Mark::Restarted, None);
                }
                Change::Value { what, .. } => news.add(viewed, *what, Mark::Changed, None),
            }
        }
        news
    }

    fn add(&mut self, viewed: &Viewed, what: Element, mark: Mark, from_hz: Option<f64>) {
        let place = |places: &[Place], id: u32| places.get(id as usize).copied();
        match what {
            Element::Node(id) => self.add_item(viewed, viewed.node.get(id as usize), mark, from_hz),
            Element::Topic(id) => {
                self.add_item(viewed, viewed.topic.get(id as usize), mark, from_hz);
            }
            Element::Publish(id) => {
                self.add_edge(viewed, place(&viewed.publish, id), mark, from_hz);
            }
            Element::Subscribe(id) => {
                self.add_edge(viewed, place(&viewed.subscribe, id), mark, from_hz);
            }
        }
    }

    fn add_item(
        &mut self,
        viewed: &Viewed,
        item: Option<&Option<u32>>,
        mark: Mark,
        from_hz: Option<f64>,
    ) {
        if let Some(Some(id)) = item {
            let reach = Reach::of_item(viewed, *id);
            keep(&mut self.items, *id, reach, mark, from_hz);
        }
    }

    fn add_edge(
        &mut self,
        viewed: &Viewed,
        place: Option<Place>,
        mark: Mark,
        from_hz: Option<f64>,
    ) {
        match place {
            Some(Place::Inside(item)) => keep(&mut self.items, item, Reach::Inside, mark, None),
            Some(Place::Arrow(id)) => {
                let reach = Reach::of_arrow(viewed, id);
                keep(&mut self.arrows, id, reach, mark, from_hz);
            }
            Some(Place::Hidden) | None => {}
        }
    }

    /// A change of rate shows on the arrows from the publisher too.
    fn add_carriers(&mut self, viewed: &Viewed, what: Element, mark: Mark, from_hz: f64) {
        for id in viewed.carriers.get(&what).into_iter().flatten() {
            let reach = Reach::of_arrow(viewed, *id);
            keep(&mut self.arrows, *id, reach, mark, Some(from_hz));
        }
    }
}

/// The topics that have exactly one publisher in a window.
pub(crate) fn alone(graph: &Graph, elements: &Elements) -> BTreeSet<TopicId> {
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

/// How what a change happened to relates to its box or arrow.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Reach {
    /// It is all there is in it.
    Whole,
    /// One of several that are drawn as one, with their rates summed.
    Part,
    /// Somewhere inside a collapsed namespace.
    Inside,
}

impl Reach {
    fn of_item(viewed: &Viewed, id: u32) -> Self {
        match viewed.items.get(id as usize) {
            Some(item) if item.kind == ItemKind::Namespace => Self::Inside,
            Some(item) if item.members.len() > 1 => Self::Part,
            _ => Self::Whole,
        }
    }

    fn of_arrow(viewed: &Viewed, id: u32) -> Self {
        let members = viewed
            .arrows
            .get(id as usize)
            .map_or(0, |a| a.members.len());
        let joined = viewed.pairs.get(id as usize).map_or(members, Vec::len);
        if joined > 1 { Self::Part } else { Self::Whole }
    }
}

/// Notes a change; of several on the same thing the more telling one stays. A single thing that came or went is told
/// by its presence; whether the summed rate of several changed is decided where it is known.
fn keep(
    all: &mut BTreeMap<u32, MarkedRate>,
    id: u32,
    reach: Reach,
    mark: Mark,
    from_hz: Option<f64>,
) {
    let new = match (reach, mark) {
        (Reach::Whole, Mark::Added | Mark::Removed) => return,
        (Reach::Whole, _) => (mark, from_hz),
        (Reach::Part, Mark::Faster | Mark::Slower) => (mark, None),
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
        Mark::Inside => 1,
        Mark::Faster | Mark::Slower | Mark::Added | Mark::Removed => 0,
    }
}
