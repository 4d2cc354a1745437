//! The parts of an anonymous name: the role of a node, which is its name without the suffix that makes it unique, and
//! the start time in that suffix.

use crate::base::time::Stamp;

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
