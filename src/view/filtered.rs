//! The viewed part of a mission as a separate mission, for data files.

use super::ViewOptions;
use super::items::Viewed;
use super::state::shows_node;
use crate::graph::diff::Change;
use crate::graph::history::{Sender, Sending};
use crate::graph::{
    ById, Edge, EdgeId, Element, ElementState, Elements, Graph, Id, NodeId, TopicId,
};
use crate::mission::event_log::{Detail, Event};
use crate::mission::{EventId, EventLog, Mission, Window};

/// The mission without the elements that the view omits. Topics in groups and elements inside collapsed
/// namespaces are visible, so they stay, under their own names; changes stay as they were found in the whole
/// graph.
pub(crate) fn filtered(mission: &Mission, options: &ViewOptions) -> Mission {
    let viewed = Viewed::new(mission, options);
    let mut keep = Keep::new(&mission.elements, options, &viewed);
    let log = keep.log(&mission.log);
    let windows = mission.windows.iter();
    let graphs = mission.each();
    let graphs = graphs.map(|(window, graph)| (window.span, keep.graph(&graph, options, &viewed)));
    Mission {
        elements: keep.elements(&mission.elements),
        windows: windows.map(|w| keep.window(w)).collect(),
        graphs: graphs.collect(),
        log,
        sending: keep.sending(&mission.sending),
        ..mission.clone()
    }
}

/// Per old id, the new one, if its element stays.
type NewIds<I> = ById<I, Option<I>>;

/// The elements that stay.
struct Keep {
    nodes: NewIds<NodeId>,
    topics: NewIds<TopicId>,
    publishes: NewIds<EdgeId>,
    subscribes: NewIds<EdgeId>,
    /// Per event of the log, its new index, if it stays.
    events: NewIds<EventId>,
}

impl Keep {
    fn new(elements: &Elements, options: &ViewOptions, viewed: &Viewed<'_>) -> Self {
        let is_item = |what| viewed.item_of(what).is_some();
        let nodes = numbered(elements.nodes.ids().map(|id| is_item(Element::Node(id))));
        let topics = elements.topics.ids().map(|id| {
            let is_carried = !viewed.carriers(Element::Topic(id)).is_empty();
            is_item(Element::Topic(id)) || options.mode.is_direct() && is_carried
        });
        let topics = numbered(topics);
        let stays =
            |e: &Edge| new_id(&nodes, e.node).is_some() && new_id(&topics, e.topic).is_some();
        Self {
            publishes: numbered(elements.publishes.iter().map(stays)),
            subscribes: numbered(elements.subscribes.iter().map(stays)),
            nodes,
            topics,
            events: ById::default(),
        }
    }

    /// The events about elements that stay. A part of an event that does not stay becomes a separate event.
    fn log(&mut self, all: &EventLog) -> EventLog {
        let stays = |event: &Event| self.element(event.what).is_some();
        self.events = numbered(all.events.iter().map(stays));
        let events = all.events.iter().filter_map(|event| {
            Some(Event {
                what: self.element(event.what)?,
                part_of: event.part_of.and_then(|whole| new_id(&self.events, whole)),
                detail: match &event.detail {
                    Detail::Senders { from, to } => Detail::Senders {
                        from: self.kept_nodes(from),
                        to: self.kept_nodes(to),
                    },
                    other => other.clone(),
                },
                ..event.clone()
            })
        });
        let mut events: ById<EventId, Event> = events.collect();
        let parts = events.iter().filter_map(|event| event.part_of);
        let mut weights = ById::like(&events, 1);
        parts.for_each(|whole| weights[whole] += 1);
        for (event, weight) in events.iter_mut().zip(weights) {
            event.weight = weight.min(event.weight);
        }
        EventLog {
            events,
            phases: all.phases.clone(),
            interruptions: all.interruptions.clone(),
            compares: all.compares,
        }
    }

    fn kept_nodes(&self, nodes: &[NodeId]) -> Vec<NodeId> {
        let new = nodes.iter().filter_map(|id| new_id(&self.nodes, *id));
        new.collect()
    }

    fn elements(&self, all: &Elements) -> Elements {
        let edge = |edge: &Edge| {
            Some(Edge {
                node: new_id(&self.nodes, edge.node)?,
                topic: new_id(&self.topics, edge.topic)?,
                ..edge.clone()
            })
        };
        Elements {
            nodes: kept(&all.nodes, &self.nodes),
            topics: kept(&all.topics, &self.topics),
            publishes: all.publishes.iter().filter_map(edge).collect(),
            subscribes: all.subscribes.iter().filter_map(edge).collect(),
        }
    }

    fn window(&self, window: &Window) -> Window {
        let reported = window.changes.iter().zip(&window.events);
        let kept = reported.filter_map(|(change, event)| {
            Some((self.change(change)?, new_id(&self.events, *event)?))
        });
        let (changes, events) = kept.unzip();
        Window {
            changes,
            events,
            ..window.clone()
        }
    }

    fn graph(&self, graph: &Graph, options: &ViewOptions, viewed: &Viewed<'_>) -> Graph {
        let is_shown = |state: &ElementState| match state.what {
            Element::Node(_) => shows_node(state.state, options),
            Element::Topic(_) | Element::Publish(_) | Element::Subscribe(_) => true,
        };
        let is_there = |what: Element| graph.get(what).is_some_and(is_shown);
        let states = graph.states.iter().filter_map(|state| {
            let (node, topic) = viewed.elements.ends(state.what);
            let ends = node.map(Element::Node).into_iter();
            let mut ends = ends.chain(topic.map(Element::Topic));
            let stays = is_shown(state) && ends.all(is_there);
            let what = self.element(state.what).filter(|_| stays)?;
            Some(ElementState {
                what,
                ..state.clone()
            })
        });
        Graph {
            states: states.collect(),
        }
    }

    fn sending(&self, all: &Sending) -> Sending {
        let senders = all.senders.iter().filter_map(|sender| {
            let node = sender.node.map(|id| new_id(&self.nodes, id));
            Some(Sender {
                topic: new_id(&self.topics, sender.topic)?,
                // The messages of an omitted node stay, with an unknown sender.
                node: node.flatten(),
                ..sender.clone()
            })
        });
        let mut senders: Vec<Sender> = senders.collect();
        senders.sort_by_key(|sender| (sender.topic, sender.node));
        Sending {
            senders,
            pauses: kept(&all.pauses, &self.topics),
        }
    }

    fn change(&self, change: &Change) -> Option<Change> {
        let mut change = change.clone();
        match &mut change {
            Change::Added { what, .. }
            | Change::Removed { what, .. }
            | Change::Rate { what, .. }
            | Change::Value { what, .. } => *what = self.element(*what)?,
            Change::HandedOver { topic, from, to } => {
                *topic = new_id(&self.topics, *topic)?;
                (*from, *to) = (self.kept_nodes(from), self.kept_nodes(to));
            }
            Change::Restarted { node, .. } => *node = new_id(&self.nodes, *node)?,
        }
        Some(change)
    }

    fn element(&self, element: Element) -> Option<Element> {
        Some(match element {
            Element::Node(id) => Element::Node(new_id(&self.nodes, id)?),
            Element::Topic(id) => Element::Topic(new_id(&self.topics, id)?),
            Element::Publish(id) => Element::Publish(new_id(&self.publishes, id)?),
            Element::Subscribe(id) => Element::Subscribe(new_id(&self.subscribes, id)?),
        })
    }
}

/// New ids, counted from 0 in the old order, for the elements that stay.
fn numbered<I: Id>(stays: impl Iterator<Item = bool>) -> NewIds<I> {
    let mut next = (0..).map(I::of);
    stays
        .map(|stays| stays.then(|| next.next()).flatten())
        .collect()
}

fn new_id<I: Id>(ids: &NewIds<I>, id: I) -> Option<I> {
    ids.get(id).copied().flatten()
}

fn kept<I: Id, T: Clone>(all: &ById<I, T>, ids: &NewIds<I>) -> ById<I, T> {
    let kept = all.iter().zip(ids).filter(|(_, id)| id.is_some());
    kept.map(|(one, _)| one.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::{mission, text};
    use crate::view::{Hide, Mode, NameFilter};

    #[test]
    fn hidden_elements_lose_their_edges_and_changes() {
        let all = mission(&["/a>/t@1 /b</t", "/a>/t@1 /a>/clock@9 /c</t /b</t"]);
        let view = filtered(&all, &ViewOptions::default());
        assert_eq!(
            text(&view),
            ["/a /b =/t /a>/t /b</t", "/a /b /c =/t /a>/t /b</t /c</t"]
        );
        assert_eq!(view.windows[1].changes.len(), 2);
        let ns_filter = NameFilter::parse("-/b").unwrap();
        let view = filtered(
            &all,
            &ViewOptions {
                ns_filter,
                hide: Hide::NONE,
                ..ViewOptions::default()
            },
        );
        assert_eq!(text(&view)[1], "/a /c =/clock =/t /a>/clock /a>/t /c</t");
    }

    #[test]
    fn nodes_only_keeps_the_topics_between_nodes() {
        let all = mission(&["/a>/t /b</t /a>/lonely"]);
        let options = ViewOptions {
            mode: Mode::Nodes,
            ..ViewOptions::default()
        };
        assert_eq!(text(&filtered(&all, &options)), ["/a /b =/t /a>/t /b</t"]);
    }
}
