//! The role of a node: its name without the suffix that makes an anonymous name unique.

/// The shortest number of nanoseconds or milliseconds since 1970 that somebody may append, in digits.
const CLOCK_DIGITS: usize = 13;

/// Nodes whose names end in a process number or an address.
const NUMBERED: [&str; 4] = [
    "/_ros2cli",
    "/launch_ros",
    "/transform_listener_impl",
    "/_ros2cli_daemon",
];

/// The name without an anonymous suffix: `/x_1234_1611234567890` (rospy), `/x_1611234567890123456` (roscpp) and
/// `/launch_ros_1234` (ROS 2) are `/x` and `/launch_ros`.
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

fn is_number(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}

/// Whether a name is left.
fn ends_well(name: &str) -> bool {
    !name.is_empty() && !name.ends_with('/')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anonymous_suffixes_are_folded() {
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
}
