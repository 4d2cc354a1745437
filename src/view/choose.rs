//! The choice of visible nodes and topics, in the order of `rqt_graph`'s own steps and by its lists of names.

use crate::base::name::is_quiet;

use super::options::ViewOptions;
use crate::graph::{ById, Elements, NodeId, Topic, TopicId};

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

/// The number of connections of a topic.
#[derive(Clone, Copy, Default)]
struct TopicDegrees {
    publishers: usize,
    subscribers: usize,
    /// The number of both that pass the filter of namespaces.
    kept: usize,
    /// Whether a hidden recorder or player is another end of it.
    is_recorded: bool,
}

/// The steps up to the grouping of topics: filters, leaf and dead, tf and parameters, topics without
/// remaining nodes.
pub(crate) fn select(elements: &Elements, options: &ViewOptions) -> Selection {
    let hide_recorder = options.hide.quiet;
    let recorders: ById<NodeId, bool> = elements
        .nodes
        .iter()
        .map(|n| hide_recorder && n.records())
        .collect();
    let nodes: ById<NodeId, Option<Reason>> = elements
        .nodes
        .iter()
        .map(|n| (!options.ns_filter.passes(n.name.as_str())).then_some(Reason::NsFilter))
        .collect();
    let ends = ends(elements, &nodes, &recorders);
    let topics = elements.topics.iter().zip(&ends);
    let topics = topics.map(|(t, ends)| {
        let reason = topic_reason(t.name.as_str(), *ends, elements, options);
        let is_hidden = options.hide.services && t.is_service();
        let reason = reason.or(is_hidden.then_some(Reason::Services));
        reason.or_else(|| is_only_recorded(t, *ends).then_some(Reason::Recorder))
    });
    let topics = topics.collect();
    let mut selection = Selection { nodes, topics };
    for (reason, is_recorder) in selection.nodes.iter_mut().zip(recorders) {
        if is_recorder {
            reason.get_or_insert(Reason::Recorder);
        }
    }
    selection
}

fn ends(
    elements: &Elements,
    nodes: &ById<NodeId, Option<Reason>>,
    recorders: &ById<NodeId, bool>,
) -> ById<TopicId, TopicDegrees> {
    let mut all = ById::like(&elements.topics, TopicDegrees::default());
    let publishes = elements.publishes.iter().map(|e| (e, true));
    let subscribes = elements.subscribes.iter().map(|e| (e, false));
    for (edge, publishes) in publishes.chain(subscribes) {
        let ends = &mut all[edge.topic];
        if recorders[edge.node] {
            ends.is_recorded = true;
            continue;
        }
        ends.publishers += usize::from(publishes);
        ends.subscribers += usize::from(!publishes);
        ends.kept += usize::from(nodes[edge.node].is_none());
    }
    all
}

/// Whether only a hidden recorder subscribes to a topic, which has no other endpoint and no message.
fn is_only_recorded(topic: &Topic, ends: TopicDegrees) -> bool {
    let connected = topic.seen.evidence.has("connection");
    ends.is_recorded && ends.publishers + ends.subscribers == 0 && !connected
}

fn topic_reason(
    name: &str,
    ends: TopicDegrees,
    elements: &Elements,
    options: &ViewOptions,
) -> Option<Reason> {
    let hide = options.hide;
    let all = ends.publishers + ends.subscribers;
    let exists =
        |other: &str| elements.topic(other).is_some() && options.topic_filter.passes(other);
    if !options.topic_filter.passes(name) {
        Some(Reason::TopicFilter)
    } else if hide.dead && ends.subscribers == 0 {
        Some(Reason::Dead)
    } else if hide.leaf && all < 2 {
        Some(Reason::Leaf)
    } else if hide.tf && is_tf(name) {
        Some(Reason::Tf)
    } else if hide.params && is_params(name, exists) {
        Some(Reason::Params)
    } else if hide.quiet && is_quiet(name) {
        Some(Reason::Quiet)
    } else {
        None
    }
}

/// The last steps, after the grouping: separate topics with all of their nodes filtered out, then "Debug".
/// `grouped` marks topics that are in a group, which these steps do not affect.
pub(crate) fn finish(
    selection: &mut Selection,
    elements: &Elements,
    options: &ViewOptions,
    grouped: &ById<TopicId, bool>,
) {
    let nobody = ById::like(&elements.nodes, false);
    let ends = ends(elements, &selection.nodes_by_filter(), &nobody);
    for (reason, (id, topic)) in selection.topics.iter_mut().zip(elements.topics.with_ids()) {
        let (ends, grouped) = (ends[id], grouped[id]);
        if reason.is_some() {
            continue;
        }
        if !grouped && ends.kept == 0 && ends.publishers + ends.subscribers > 0 {
            *reason = Some(Reason::Orphan);
        } else if !grouped
            && options.hide.debug
            && !options.mode.is_direct()
            && is_debug(topic.name.as_str())
        {
            *reason = Some(Reason::Debug);
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

impl Selection {
    /// The nodes that the filter of namespaces alone accepts: nodes hidden for another reason still keep
    /// their topics visible.
    fn nodes_by_filter(&self) -> ById<NodeId, Option<Reason>> {
        let by_filter = |reason: &Option<Reason>| reason.filter(|r| *r == Reason::NsFilter);
        self.nodes.iter().map(by_filter).collect()
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
