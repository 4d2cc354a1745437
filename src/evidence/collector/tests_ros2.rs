//! Tests of the sources of ROS 2 with single messages.

use super::tests::{Payload, claims, hear};

#[test]
fn a_log_record_of_ros2_names_its_logger() {
    let record = Payload::cdr()
        .time()
        .byte(20)
        .text("r1.nav")
        .text("hi")
        .text("f")
        .text("g")
        .u32(1);
    assert_eq!(
        claims("/rosout", "rcl_interfaces/msg/Log", None, &record),
        ["Logger /r1/nav /rosout", "LogsFrom /r1/nav f"]
    );
}

#[test]
fn parameter_events_name_their_node() {
    let value = |p: Payload| {
        p.byte(2)
            .byte(0)
            .u64(5)
            .u64(0)
            .text("")
            .u32(0)
            .u32(0)
            .u32(0)
            .u32(0)
            .u32(0)
    };
    let message = Payload::cdr()
        .time()
        .text("/r1/nav")
        .u32(1)
        .text("use_sim_time");
    let message = value(message).u32(0).u32(0);
    assert_eq!(
        claims(
            "/parameter_events",
            "rcl_interfaces/msg/ParameterEvent",
            None,
            &message
        ),
        ["Node /r1/nav", "Publish /r1/nav /parameter_events"]
    );
}

#[test]
fn a_transition_tells_the_state() {
    let message = Payload::cdr()
        .u64(1)
        .byte(3)
        .text("activate")
        .byte(2)
        .text("inactive")
        .byte(3)
        .text("active");
    assert_eq!(
        claims(
            "/amcl/transition_event",
            "lifecycle_msgs/msg/TransitionEvent",
            None,
            &message
        ),
        [
            "Lifecycle /amcl active",
            "Publish /amcl /amcl/transition_event"
        ]
    );
}

#[test]
fn a_graph_snapshot_names_everything() {
    let duration = |p: Payload| p.u32(0).u32(0);
    let qos = |p: Payload| {
        let p = duration(duration(p.u32(10)))
            .byte(1)
            .byte(1)
            .byte(2)
            .byte(1);
        duration(p)
    };
    let message = Payload::cdr().time().u32(1).text("/lidar");
    let message = qos(message
        .u32(1)
        .text("/scan")
        .text("sensor_msgs/msg/LaserScan"));
    let message = message.u32(0).u32(0).u32(0);
    assert_eq!(
        claims(
            "/rosgraph",
            "rosgraph_monitor_msgs/msg/Graph",
            None,
            &message
        ),
        [
            "Node /lidar",
            "Publish /lidar /scan",
            "Snapshot snapshot /rosgraph",
            "Type /scan sensor_msgs/msg/LaserScan"
        ]
    );
}

#[test]
fn topic_statistics_tell_publishers_from_subscribers() {
    let one = |p: Payload, kind, node| {
        let p = p.byte(kind).text(node).text("/scan").u32(9);
        p.time().time().time()
    };
    let message = one(one(Payload::cdr().time().u32(2), 0, "/lidar"), 1, "/slam");
    assert_eq!(
        claims(
            "/topic_statistics",
            "rosgraph_monitor_msgs/msg/TopicStatistics",
            None,
            &message
        ),
        ["Publish /lidar /scan", "Subscribe /slam /scan"]
    );
}

#[test]
fn metrics_name_a_subscriber() {
    let message = Payload::cdr()
        .text("slam")
        .text("message_age")
        .text("ms")
        .time()
        .time();
    let message = message.u32(1).byte(1).u64(0);
    assert_eq!(
        claims(
            "/statistics",
            "statistics_msgs/msg/MetricsMessage",
            None,
            &message
        ),
        ["Reports /slam /statistics"]
    );
}

#[test]
fn discovery_names_nodes_with_either_length_of_identifier() {
    for gid in [16, 24] {
        let id = vec![7; gid];
        let message = Payload::cdr()
            .raw(&id)
            .u32(1)
            .text("/r1")
            .text("nav")
            .u32(1)
            .raw(&id)
            .u32(0);
        let all = claims(
            "ros_discovery_info",
            "rmw_dds_common/msg/ParticipantEntitiesInfo",
            None,
            &message,
        );
        assert!(all.contains(&"Node /r1/nav".to_owned()), "{gid}: {all:?}");
    }
}

#[test]
fn service_events_count_clients_and_calls() {
    let message = Payload::cdr()
        .byte(1)
        .time()
        .raw(&[9; 16])
        .u64(3)
        .u32(0)
        .u32(0);
    let all = claims("/add/_service_event", "a/srv/Add_Event", None, &message);
    let expected = [
        "Called /add/_service_event request received",
        "Topic /add/_service_event",
    ];
    assert!(
        expected.iter().all(|e| all.contains(&(*e).to_owned())),
        "{all:?}"
    );
    assert_eq!(all.len(), 3);
}

#[test]
fn services_tell_their_calls_and_clients() {
    let message = Payload::cdr()
        .byte(1)
        .time()
        .raw(&[9; 16])
        .u64(3)
        .u32(0)
        .u32(0);
    let (collector, _) = hear("/add/_service_event", "a/srv/Add_Event", None, &message);
    let services = collector.finish().unwrap().services();
    let told: Vec<_> = services
        .iter()
        .map(|s| (&*s.name, s.requests, s.replies, s.clients))
        .collect();
    assert_eq!(told, [("/add", 1, 0, 1)]);
}
