//! Names of nodes and topics, kept as recorded, cheap to clone, ordered; and the parts of anonymous ones.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use crate::base::time::Stamp;

/// A message type in the form of ROS 1, without `/msg`.
pub(crate) fn plain_type(type_name: &str) -> Cow<'_, str> {
    match type_name.split_once("/msg/") {
        Some((package, name)) => Cow::Owned(format!("{package}/{name}")),
        None => Cow::Borrowed(type_name),
    }
}

/// The type of a service of unknown type.
pub(crate) const SERVICE: &str = "service";

/// Whether this is the type of a service.
pub(crate) fn is_service(kind: &str) -> bool {
    kind == SERVICE || kind.contains("/srv/")
}

macro_rules! name {
    ($(#[$doc:meta])* $type:ident) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $type(Arc<str>);

        impl $type {
            /// The name as recorded; may contain any characters, so escape it in output.
            pub fn as_str(&self) -> &str {
                &self.0
            }

            /// A shared handle on the text.
            pub fn shared(&self) -> Arc<str> {
                Arc::clone(&self.0)
            }
        }

        impl From<&str> for $type {
            fn from(name: &str) -> Self {
                Self(name.into())
            }
        }

        impl From<String> for $type {
            fn from(name: String) -> Self {
                Self(name.into())
            }
        }

        impl From<Arc<str>> for $type {
            fn from(name: Arc<str>) -> Self {
                Self(name)
            }
        }

        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }
    };
}

name! {
    /// The resolved name of a node, such as `/base/driver`.
    NodeName
}
name! {
    /// The resolved name of a topic, such as `/scan`.
    TopicName
}

/// The namespace of a resolved name: the part before its last slash, `/` for a name at the root.
pub fn namespace(name: &str) -> &str {
    match name.rfind('/') {
        Some(0) | None => "/",
        Some(at) => &name[..at],
    }
}

/// A name, and the namespaces that it is in, the innermost first, without the root.
pub(crate) fn with_spaces(name: &str) -> impl Iterator<Item = &str> {
    let above = std::iter::successors(Some(name), |name| Some(name.rsplit_once('/')?.0));
    above.take_while(|name| !name.is_empty())
}

/// The full name of a topic as a node names it: `/tf` for all, `scan` in the node's namespace, `../map` in the one around
/// that, `~/map` or `~map` below the node's name.
pub(crate) fn resolved(topic: &str, node: &str) -> String {
    let space = namespace(node);
    if let Some(private) = topic.strip_prefix('~') {
        format!("{node}/{}", private.trim_start_matches('/'))
    } else if let Some(outer) = topic.strip_prefix("../") {
        format!("{}/{outer}", namespace(space).trim_end_matches('/'))
    } else if topic.starts_with('/') {
        topic.to_owned()
    } else {
        format!("{}/{topic}", space.trim_end_matches('/'))
    }
}

/// The last part of a resolved name; the whole name if that part would be empty.
pub fn last_part(name: &str) -> &str {
    match name.rsplit('/').next() {
        Some(part) if !part.is_empty() => part,
        _ => name,
    }
}

/// Last parts of names that are meaningless without the previous part.
const VAGUE: [&str; 6] = ["data", "raw", "state", "status", "info", "events"];

/// Whether a last part is meaningless without the previous one: `state`.
pub(crate) fn is_vague(part: &str) -> bool {
    VAGUE.contains(&part)
}

/// The names of a picture, each in the fewest of its last parts that no other name ends with: `cam_wrist/driver` beside
/// other drivers, `planner` if there is one.
pub(crate) struct ShortNames<'a>(BTreeMap<&'a str, Option<&'a str>>);

impl<'a> FromIterator<&'a str> for ShortNames<'a> {
    fn from_iter<T: IntoIterator<Item = &'a str>>(names: T) -> Self {
        let mut only: BTreeMap<&str, Option<&str>> = BTreeMap::new();
        for name in names {
            for end in ends(name) {
                let owner = only.entry(end).or_insert(Some(name));
                *owner = owner.filter(|owner| *owner == name);
            }
        }
        Self(only)
    }
}

impl ShortNames<'_> {
    /// The short form of a name; the whole name, if it was not among those given.
    pub(crate) fn of<'n>(&self, name: &'n str) -> &'n str {
        let is_alone = |end: &&str| self.0.get(end) == Some(&Some(name)) && !is_vague(end);
        ends(name).find(is_alone).unwrap_or(name)
    }
}

/// The last part of a name, its last two and so on, without the slash before them. Of more than four parts the whole name
/// is as clear.
fn ends(name: &str) -> impl Iterator<Item = &str> {
    let ends = name.rmatch_indices('/').map(|(at, _)| &name[at + 1..]);
    ends.filter(|end| !end.is_empty()).take(4)
}

/// Whether a node represents unnamed publishers: `/scan ?`, `/scan ? ×2`. Names in ROS contain no spaces.
pub(crate) fn is_unnamed(node: &str) -> bool {
    node.contains(" ?")
}

/// Whether a node of this name plays bags: `/play_` and a number (ROS 1), `/rosbag2_player`.
pub fn is_player(node: &str) -> bool {
    let last = last_part(node);
    last == "rosbag2_player" || is_numbered(last, "play_")
}

/// Whether a node of this name records bags, or belongs to ROS 2's command line: `/record_` and a number (ROS 1),
/// `/rosbag2_recorder…`, `/_ros2cli_…`.
pub fn is_recorder(node: &str) -> bool {
    let last = last_part(node);
    is_numbered(last, "record_")
        || last.starts_with("rosbag2_recorder")
        || last.starts_with("_ros2cli_")
}

/// A name in a namespace, unless that is empty or the name lies in it already.
pub(crate) fn in_space<'a>(space: &str, name: &'a str) -> Cow<'a, str> {
    if space.is_empty() || lies_in(name, space) {
        return Cow::Borrowed(name);
    }
    Cow::Owned(format!("{space}/{}", name.trim_start_matches('/')))
}

/// Whether a name lies inside a namespace, which is written without a slash at its end.
pub(crate) fn lies_in(name: &str, space: &str) -> bool {
    let rest = name.strip_prefix(space);
    rest.is_some_and(|rest| rest.starts_with('/'))
}

/// As [`lies_in`], or the namespace's own name.
pub(crate) fn is_within(name: &str, space: &str) -> bool {
    name == space || lies_in(name, space)
}

/// Whether a node or topic is hidden by default: log, clock, parameters, statistics, recorder events.
pub fn is_quiet(name: &str) -> bool {
    const EXACT: [&str; 3] = ["/parameter_events", "/clock", "/statistics"];
    EXACT.contains(&name)
        // In a namespace, if there are several masters.
        || ["rosout", "rosout_agg"].contains(&last_part(name))
        || name.ends_with("/parameter_updates")
        || name.ends_with("/parameter_descriptions")
        || name.starts_with("/events/")
}

/// The topic on which every node publishes its own log records, and the one with the records of all, which one node
/// publishes.
pub(crate) const LOGS: [&str; 2] = ["/rosout", "/rosout_agg"];

/// Whether every node publishes its own log records on a topic, so that its messages have many senders.
pub(crate) fn is_log(topic: &str) -> bool {
    topic == LOGS[0]
}

/// Whether a topic is the feedback of an action: its rhythm says nothing about the server, which sends it while there is
/// a goal.
pub(crate) fn is_feedback(topic: &str) -> bool {
    topic.ends_with("/feedback")
}

fn is_numbered(name: &str, prefix: &str) -> bool {
    name.strip_prefix(prefix).is_some_and(is_number)
}

// The parts of an anonymous name: the role of a node, which is its name without the suffix that makes it unique, and
// the start time in that suffix.

/// The smallest number of digits in an appended time, in nanoseconds or milliseconds since 1970.
const CLOCK_DIGITS: usize = 13;

/// Nodes whose names end in a process number or an address.
const NUMBERED: [&str; 4] = [
    "/_ros2cli",
    "/launch_ros",
    "/transform_listener_impl",
    "/_ros2cli_daemon",
];

/// The name without an anonymous suffix: `/x` for `/x_1234_1611234567890` (rospy) and `/x_1611234567890123456`
/// (roscpp),
/// `/launch_ros` for `/launch_ros_1234` (ROS 2).
pub(crate) fn role(name: &str) -> &str {
    let Some((rest, last)) = name.rsplit_once('_') else {
        return name;
    };
    if is_number(last) && last.len() >= CLOCK_DIGITS {
        return match rest.rsplit_once('_') {
            Some((base, process)) if is_number(process) && ends_well(base) => base,
            _ if ends_well(rest) => rest,
            _ => name,
        };
    }
    let numbered = NUMBERED.iter().any(|known| rest.ends_with(known));
    if numbered && !last.is_empty() && last.bytes().all(|b| b.is_ascii_hexdigit()) {
        return rest;
    }
    name
}

/// Whether a node of this name is meant by its name or by its role.
pub(crate) fn is_named(name: &str, asked: &str) -> bool {
    name == asked || role(name) == asked
}

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}

/// Whether a name without its suffix is still a valid name.
fn ends_well(name: &str) -> bool {
    !name.is_empty() && !name.ends_with('/')
}

/// The start time in a name: `/x_PID_MILLISECONDS`, `/x_NANOSECONDS`.
pub(crate) fn start(name: &str) -> Option<Stamp> {
    let (rest, number) = name.rsplit_once('_')?;
    let process = rest.rsplit_once('_').map_or("", |(_, process)| process);
    let unit = match number.len() {
        13 if is_number(process) => 1_000_000,
        19 => 1,
        _ => return None,
    };
    let number: i64 = number.parse().ok().filter(|_| is_number(number))?;
    number.checked_mul(unit).map(Stamp)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn players_and_recorders_are_recognized_by_name() {
        assert!(is_player("/play_1795170682045") && is_player("/rosbag2_player"));
        assert!(!is_player("/play_music"));
        assert!(is_recorder("/record_1795170682045") && is_recorder("/rosbag2_recorder"));
        assert!(is_recorder("/_ros2cli_42"));
        assert!(!is_recorder("/record_player") && !is_recorder("/record_"));
    }

    #[test]
    fn a_name_is_put_into_a_namespace_once() {
        assert_eq!(in_space("/r2", "/scan"), "/r2/scan");
        assert_eq!(in_space("/r2", "/r2/scan"), "/r2/scan");
        assert_eq!(in_space("/r2", "/r2d2"), "/r2/r2d2");
        assert_eq!(in_space("", "scan"), "scan");
    }

    #[test]
    fn names_split_at_the_last_slash() {
        assert_eq!((namespace("/a/b/c"), last_part("/a/b/c")), ("/a/b", "c"));
        assert_eq!((namespace("/a"), last_part("/a")), ("/", "a"));
        assert_eq!((namespace("a"), last_part("a")), ("/", "a"));
        assert_eq!(last_part("/a/"), "/a/");
    }

    #[test]
    fn anonymous_suffixes_are_removed() {
        assert_eq!(role("/probe_9665_1795171273454"), "/probe");
        assert_eq!(role("/record_1795170682045487216"), "/record");
        assert_eq!(role("/r1/launch_ros_4711"), "/r1/launch_ros");
        assert_eq!(
            role("/transform_listener_impl_5581e0a3f2c0"),
            "/transform_listener_impl"
        );
    }

    #[test]
    fn other_names_are_kept() {
        for name in [
            "/camera_2",
            "/robot_1_2",
            "/a",
            "/_1795171273454",
            "/x_12345678",
        ] {
            assert_eq!(role(name), name);
        }
    }

    #[test]
    fn anonymous_names_contain_their_start() {
        let at = |name| start(name).map(|t| t.0);
        assert_eq!(
            at("/probe_9665_1795171273454"),
            Some(1_795_171_273_454_000_000)
        );
        assert_eq!(
            at("/record_1795170682045487216"),
            Some(1_795_170_682_045_487_216)
        );
        assert_eq!(at("/camera_1795171273454"), None);
        assert_eq!(at("/camera_2"), None);
    }
}
