//! The viewed part of a mission as a separate mission, for data files.

use super::ViewOptions;
use super::items::Viewed;
use super::state::shows_node;
use crate::graph::history::{Sender, Sending};
use crate::graph::{
    ById, Edge, Element, ElementState, Elements, Graph, Id, NodeId, PerElement, TopicId,
};
use crate::mission::event_log::{Detail, Event};
use crate::mission::{Change, EventId, EventLog, Mission, Window};

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

/// The elements and events that stay.
struct Keep {
    /// Per element, the new one, if it stays.
    elements: PerElement<Option<Element>>,
    /// Per event of the log, its new index, if it stays.
    events: ById<EventId, Option<EventId>>,
}

impl Keep {
    fn new(elements: &Elements, options: &ViewOptions, viewed: &Viewed<'_>) -> Self {
        let is_seen = |what: Element| {
            let is_carried = || what.is_topic() && !viewed.carriers(what).is_empty();
            viewed.item_of(what).is_some() || options.mode.is_direct() && is_carried()
        };
        let mut next = [0; 4];
        let elements = PerElement::new(elements, |what| {
            let (node, topic) = elements.ends(what);
            let is_node = node.is_none_or(|id| is_seen(Element::Node(id)));
            let is_topic = topic.is_none_or(|id| is_seen(Element::Topic(id)));
            let (kind, _) = what.place();
            (is_node && is_topic).then(|| {
                next[kind] += 1;
                Element::KINDS[kind](next[kind] - 1)
            })
        });
        let events = ById::default();
        Self { elements, events }
    }

    /// The events about elements that stay. A part of an event that does not stay becomes a separate event.
    fn log(&mut self, all: &EventLog) -> EventLog {
        let stays = |event: &Event| self.element(event.what).is_some();
        let mut next = (0..).map(EventId::of);
        let new = all.events.iter();
        let new = new.map(|event| stays(event).then(|| next.next()).flatten());
        self.events = new.collect();
        let events = all.events.iter().filter_map(|event| {
            Some(Event {
                what: self.element(event.what)?,
                part_of: event.part_of.and_then(|whole| self.event(whole)),
                detail: self.detail(&event.detail),
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

    /// The values of an event without the nodes that do not stay.
    fn detail(&self, detail: &Detail) -> Detail {
        let kept = |nodes: &[NodeId]| nodes.iter().filter_map(|id| self.node(*id)).collect();
        match detail {
            Detail::Senders { from, to } => {
                let (from, to) = (kept(from), kept(to));
                Detail::Senders { from, to }
            }
            other => other.clone(),
        }
    }

    fn elements(&self, all: &Elements) -> Elements {
        let edge = |edge: &Edge| {
            Some(Edge {
                node: self.node(edge.node)?,
                topic: self.topic(edge.topic)?,
                ..edge.clone()
            })
        };
        Elements {
            nodes: kept(&all.nodes, |id| self.node(id).is_some()),
            topics: kept(&all.topics, |id| self.topic(id).is_some()),
            publishes: all.publishes.iter().filter_map(edge).collect(),
            subscribes: all.subscribes.iter().filter_map(edge).collect(),
        }
    }

    fn window(&self, window: &Window) -> Window {
        let reported = window.changes.iter().zip(&window.events);
        let kept = reported
            .filter_map(|(change, event)| Some((self.change(change)?, self.event(*event)?)));
        let (changes, events) = kept.unzip();
        Window {
            changes,
            events,
            ..window.clone()
        }
    }

    fn graph(&self, graph: &Graph, options: &ViewOptions, viewed: &Viewed<'_>) -> Graph {
        let is_shown =
            |state: &ElementState| !state.what.is_node() || shows_node(state.state, options);
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
            let node = sender.node.and_then(|id| self.node(id));
            Some(Sender {
                topic: self.topic(sender.topic)?,
                // The messages of an omitted node stay, with an unknown sender.
                node,
                ..sender.clone()
            })
        });
        let mut senders: Vec<Sender> = senders.collect();
        senders.sort_by_key(|sender| (sender.topic, sender.node));
        Sending {
            senders,
            pauses: kept(&all.pauses, |id| self.topic(id).is_some()),
        }
    }

    fn change(&self, change: &Change) -> Option<Change> {
        Some(Change {
            what: self.element(change.what)?,
            detail: self.detail(&change.detail),
            ..change.clone()
        })
    }

    fn element(&self, element: Element) -> Option<Element> {
        self.elements.of(element).copied().flatten()
    }

    fn node(&self, id: NodeId) -> Option<NodeId> {
        match self.element(Element::Node(id))? {
            Element::Node(id) => Some(id),
            _ => None,
        }
    }

    fn topic(&self, id: TopicId) -> Option<TopicId> {
        match self.element(Element::Topic(id))? {
            Element::Topic(id) => Some(id),
            _ => None,
        }
    }

    fn event(&self, id: EventId) -> Option<EventId> {
        self.events.get(id).copied().flatten()
    }
}

fn kept<I: Id, T: Clone>(all: &ById<I, T>, stays: impl Fn(I) -> bool) -> ById<I, T> {
    let kept = all.with_ids().filter(|(id, _)| stays(*id));
    kept.map(|(_, one)| one.clone()).collect()
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
