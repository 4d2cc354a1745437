//! The choice of visible nodes and topics, in the order of `rqt_graph`'s own steps and by its lists of names.

use crate::base::name::is_quiet;

use super::options::ViewOptions;
use crate::graph::{ById, Elements, Node, NodeId, TopicId};

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
        // Only they subscribe to it, and it has no message.
        let is_silent = !topic.seen.evidence.has("connection");
        let is_recorded = connected == 0 && !(from.is_empty() && to.is_empty()) && is_silent;
        let reasons = [
            (Reason::TopicFilter, !options.topic_filter.passes(name)),
            (Reason::Dead, hide.dead && subscribers == 0),
            (Reason::Leaf, hide.leaf && connected < 2),
            (Reason::Tf, hide.tf && is_tf(name)),
            (Reason::Params, hide.params && is_params(name, exists)),
            (Reason::Quiet, hide.quiet && is_quiet(name)),
            (Reason::Services, hide.services && topic.is_service()),
            (Reason::Recorder, is_recorded),
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
        let (from, to) = (&wiring.publishers[id], &wiring.subscribers[id]);
        let mut ends = from.iter().chain(to).peekable();
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
pub(crate) fn is_debug(name: &str) -> bool {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
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
}
