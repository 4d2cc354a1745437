//! The names that are housekeeping according to `rqt_graph`'s lists; our own short list is in the graph's
//! module.

pub(crate) use crate::base::name::is_quiet;

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
