//! The choice of visible nodes and topics, in the order of `rqt_graph`'s own steps and by its lists of names; and the viewed
//! part of a mission as a separate mission.

use super::items::Viewed;
use super::options::ViewOptions;
use super::state::shows_node;
use crate::base::name::is_quiet;
use crate::graph::history::{Sender, Sending};
use crate::graph::{
    ById, Edge, Element, ElementState, Elements, Graph, Id, Node, NodeId, PerElement, TopicId,
};
use crate::mission::event_log::{Detail, Event};
use crate::mission::{Change, EventId, EventLog, Mission, Window};

/// The reason for leaving a node or topic out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Reason {
    NsFilter,
    TopicFilter,
    /// A topic with all of its nodes filtered out.
    Orphan,
    Leaf,
    Dead,
    Tf,
    Params,
    Services,
    Debug,
    Quiet,
    Recorder,
}

/// Per node and topic of the mission, the reason for leaving it out; `None` for a visible one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Selection {
    pub(crate) nodes: ById<NodeId, Option<Reason>>,
    pub(crate) topics: ById<TopicId, Option<Reason>>,
}

/// The steps up to the grouping of topics: filters, leaf and dead, tf and parameters. Hidden recorders and players are no
/// connections of a topic.
pub(crate) fn select(elements: &Elements, options: &ViewOptions) -> Selection {
    let hide = options.hide;
    let is_tool = |node: &Node| hide.quiet && node.records();
    let tools: ById<NodeId, bool> = elements.nodes.iter().map(is_tool).collect();
    let nodes = elements.nodes.iter().zip(&tools).map(|(node, is_tool)| {
        let is_outside = !options.ns_filter.passes(node.name.as_str());
        let outside = is_outside.then_some(Reason::NsFilter);
        outside.or(is_tool.then_some(Reason::Recorder))
    });
    let exists =
        |other: &str| elements.topic(other).is_some() && options.topic_filter.passes(other);
    let wiring = elements.wiring(|_, _| true);
    let others = |nodes: &[NodeId]| nodes.iter().filter(|id| !tools[**id]).count();
    let topics = elements.topics.with_ids().map(|(id, topic)| {
        let name = topic.name.as_str();
        let (from, to) = (&wiring.publishers[id], &wiring.subscribers[id]);
        let (publishers, subscribers) = (others(from), others(to));
        let connected = publishers + subscribers;
        let is_recorded = connected == 0 && !(from.is_empty() && to.is_empty());
        let reasons = [
            (Reason::TopicFilter, !options.topic_filter.passes(name)),
            (Reason::Dead, hide.dead && subscribers == 0),
            (Reason::Leaf, hide.leaf && connected < 2),
            (Reason::Tf, hide.tf && is_tf(name)),
            (Reason::Params, hide.params && is_params(name, exists)),
            (Reason::Quiet, hide.quiet && is_quiet(name)),
            (Reason::Services, hide.services && topic.is_service()),
            // Only they subscribe to it, and it has no message.
            (
                Reason::Recorder,
                is_recorded && !topic.seen.evidence.has("connection"),
            ),
        ];
        let reason = reasons.into_iter().find(|(_, is_one)| *is_one);
        reason.map(|(reason, _)| reason)
    });
    Selection {
        nodes: nodes.collect(),
        topics: topics.collect(),
    }
}

/// The last steps, after the grouping: separate topics with all of their nodes filtered out, then "Debug". Nodes hidden for
/// another reason than the filter still keep their topics visible. `grouped` marks topics that are in a group, which these
/// steps do not affect.
pub(crate) fn finish(
    selection: &mut Selection,
    elements: &Elements,
    options: &ViewOptions,
    grouped: &ById<TopicId, bool>,
) {
    let wiring = elements.wiring(|_, _| true);
    let hides_debug = options.hide.debug && !options.mode.is_direct();
    for (id, topic) in elements.topics.with_ids().filter(|(id, _)| !grouped[*id]) {
        let mut ends = wiring.publishers[id]
            .iter()
            .chain(&wiring.subscribers[id])
            .peekable();
        let is_outside = |node: &NodeId| selection.nodes[*node] == Some(Reason::NsFilter);
        let reason = &mut selection.topics[id];
        if ends.peek().is_some() && ends.all(is_outside) {
            reason.get_or_insert(Reason::Orphan);
        } else if hides_debug && is_debug(topic.name.as_str()) {
            reason.get_or_insert(Reason::Debug);
        }
    }
    for (node, reason) in elements.nodes.iter().zip(selection.nodes.iter_mut()) {
        let name = node.name.as_str();
        if options.hide.debug && is_debug(name) {
            reason.get_or_insert(Reason::Debug);
        } else if options.hide.quiet && is_quiet(name) {
            reason.get_or_insert(Reason::Quiet);
        }
    }
}

/// Whether `rqt_graph`'s "Debug" leaves out this node or topic (`_quiet_filter` of its `dotcode.py`).
fn is_debug(name: &str) -> bool {
    const PARTS: [&str; 12] = [
        "/diag_agg",
        "/runtime_logger",
        "/pr2_dashboard",
        "/rviz",
        "/rosout",
        "/cpu_monitor",
        "/monitor",
        "/hd_monitor",
        "/rxloggerlevel",
        "/clock",
        "/rqt",
        "/statistics",
    ];
    let last = name.rsplit('/').next().unwrap_or(name);
    PARTS.iter().any(|part| name.contains(part)) || last.starts_with('_')
}

/// Whether `rqt_graph`'s "Debug" leaves out an arrow from node to node over this topic.
pub(crate) fn is_debug_label(topic: &str) -> bool {
    matches!(topic, "/time" | "/clock" | "/rosout" | "/statistics")
}

/// Whether it is a topic that every system has and nearly every node is connected to: it is irrelevant to what a robot
/// does.
pub(crate) fn is_infrastructure(topic: &str) -> bool {
    const LAST: [&str; 9] = [
        "tf",
        "tf_static",
        "diagnostics",
        "diagnostics_agg",
        "diagnostics_toplevel_state",
        "bond",
        "rosout",
        "rosout_agg",
        "clock",
    ];
    LAST.contains(&topic.rsplit('/').next().unwrap_or(topic))
}

/// Whether it is a topic of the transform tree at the root, which `rqt_graph` hides or groups.
pub(crate) fn is_tf(topic: &str) -> bool {
    matches!(topic, "/tf" | "/tf_static")
}

/// Whether `rqt_graph`'s "Params" leaves out this topic. Its rule for `parameter_updates` compares the wrong
/// part of the name and so hides nothing; as in its first version, we hide them if `parameter_descriptions`
/// exists beside them.
pub(crate) fn is_params(topic: &str, exists: impl Fn(&str) -> bool) -> bool {
    let beside = |this: &str, other: &str| {
        topic
            .strip_suffix(this)
            .is_some_and(|prefix| exists(&format!("{prefix}{other}")))
    };
    topic.ends_with("/parameter_events")
        || beside("/parameter_updates", "/parameter_descriptions")
        || beside("/parameter_descriptions", "/parameter_updates")
}

// The viewed part of a mission as a separate mission, for data files.

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
    use crate::view::{Hide, Mode, NameFilter, outline};

    /// The names of the remaining boxes.
    fn left(window: &str, options: &ViewOptions) -> String {
        let view = outline(&mission(&[window]), options);
        let names: Vec<&str> = view.items.iter().map(|i| i.name.as_ref()).collect();
        names.join(" ")
    }

    fn hiding(list: &str) -> ViewOptions {
        ViewOptions {
            hide: Hide::parse(list).unwrap(),
            ..ViewOptions::default()
        }
    }

    const GRAPH: &str = "/a>/dead /c>/dead /a>/leaf /b</alone /a>/t /b</t =/unknown";

    #[test]
    fn dead_topics_have_no_subscriber_and_leaves_less_than_two_ends() {
        assert_eq!(
            left(GRAPH, &hiding("none")),
            "/a /b /c /alone /dead /leaf /t /unknown"
        );
        assert_eq!(left(GRAPH, &hiding("dead")), "/a /b /c /alone /t");
        assert_eq!(left(GRAPH, &hiding("leaf")), "/a /b /c /dead /t");
        assert_eq!(left(GRAPH, &hiding("dead,leaf")), "/a /b /c /t");
    }

    #[test]
    fn topics_go_with_the_last_of_their_nodes_unless_they_never_had_one() {
        let ns_filter = NameFilter::parse("/b").unwrap();
        let options = ViewOptions {
            ns_filter,
            ..hiding("none")
        };
        assert_eq!(left(GRAPH, &options), "/b /alone /t /unknown");
    }

    #[test]
    fn debug_spares_groups_and_the_topics_between_nodes() {
        let graph = "/a>/tf /b</tf /rviz</tf /a>/rviz/x /b</rviz/x /rqt>/y /b</y";
        assert_eq!(left(graph, &hiding("debug")), "/a /b /y /tf");
        let nodes = ViewOptions {
            mode: Mode::Nodes,
            ..hiding("debug")
        };
        let view = outline(&mission(&[graph]), &nodes);
        assert_eq!((view.items.len(), view.arrows.len()), (2, 2));
    }

    #[test]
    fn a_topic_that_only_the_hidden_recorder_waits_for_is_hidden_with_it() {
        let graph = "/a>/t /record_1</t /record_1</never";
        assert_eq!(left(graph, &ViewOptions::default()), "/a /t");
        assert_eq!(left(graph, &hiding("none")), "/a /record_1 /never /t");
    }

    #[test]
    fn a_hidden_recorder_does_not_keep_dead_topics_alive() {
        let graph = "/a>/t /record_1</t";
        assert_eq!(left(graph, &hiding("quiet,dead")), "/a");
        assert_eq!(left(graph, &hiding("dead")), "/a /record_1 /t");
    }

    #[test]
    fn quiet_matches_exact_names() {
        for name in ["/clock", "/a/parameter_updates", "/events/write_split"] {
            assert!(is_quiet(name), "{name}");
        }
        for name in [
            "/a/clock",
            "/clock2",
            "/rviz",
            "/a/parameter_events",
            "/events",
        ] {
            assert!(!is_quiet(name), "{name}");
        }
    }

    #[test]
    fn debug_looks_inside_names() {
        for name in [
            "/robot/rviz2",
            "/monitoring",
            "/a/_hidden",
            "/rosout_agg",
            "/x/clock",
        ] {
            assert!(is_debug(name), "{name}");
        }
        for name in ["/talker", "/diagnostics", "/_ns/b"] {
            assert!(!is_debug(name), "{name}");
        }
    }

    #[test]
    fn parameter_updates_need_their_descriptions() {
        let both =
            |name: &str| name == "/a/parameter_updates" || name == "/a/parameter_descriptions";
        assert!(is_params("/a/parameter_updates", both));
        assert!(is_params("/a/parameter_descriptions", both));
        assert!(!is_params("/b/parameter_updates", both));
        assert!(is_params("/b/parameter_events", both));
    }

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
