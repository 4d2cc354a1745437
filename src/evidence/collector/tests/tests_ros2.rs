//! Tests of the sources of ROS 2 with single messages.

use super::{Payload, observations};

#[test]
fn a_log_record_of_ros2_names_its_logger() {
    for empty in Payload::both() {
        let record = empty.time().byte(20).text("r1.nav").text("hi");
        let record = record.text("f").text("g").u32(1);
        assert_eq!(
            observations("/rosout", "rcl_interfaces/msg/Log", None, &record),
            ["Logger /r1/nav /rosout", "LogsFrom /r1/nav f"]
        );
    }
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
        observations(
            "/parameter_events",
            "rcl_interfaces/msg/ParameterEvent",
            None,
            &message
        ),
        [
            "Begins /r1/nav",
            "Node /r1/nav",
            "Publish /r1/nav /parameter_events"
        ]
    );
}

#[test]
fn a_transition_sets_the_state() {
    let message = Payload::cdr()
        .u64(1)
        .byte(3)
        .text("activate")
        .byte(2)
        .text("inactive")
        .byte(3)
        .text("active");
    assert_eq!(
        observations(
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
        observations(
            "/rosgraph",
            "rosgraph_monitor_msgs/msg/Graph",
            None,
            &message
        ),
        [
            "Node /lidar",
            "Publish /lidar /scan",
            "Quality /scan reliable volatile depth 10",
            "Snapshot snapshot /rosgraph",
            "Type /scan sensor_msgs/msg/LaserScan"
        ]
    );
}

/// An end of a topic in the newest form of `rosgraph_msgs`, reliable or best effort.
fn graph_end(p: Payload, topic: &str, reliability: u8) -> Payload {
    let p = p.text(topic).text("a/msg/T").byte(1).raw(&[0; 32]);
    let p = p.u32(10).u32(0).u32(0).u32(0).u32(0);
    p.byte(1).byte(reliability).byte(2).byte(1).u32(0).u32(0)
}

#[test]
fn a_single_node_names_services_and_actions() {
    let empty = |p: Payload, many| (0..many).fold(p, |p, _| p.u32(0));
    let service = |p: Payload, name: &str, kind: &str| {
        let qos = |p: Payload| p.u32(0).raw(&[0; 16]).raw(&[0; 4]).u32(0).u32(0);
        let kind = |p: Payload| p.text(kind).byte(1).raw(&[0; 32]);
        qos(kind(qos(kind(p.text(name)))))
    };
    let message = empty(Payload::cdr().text("/nav"), 2);
    let message = graph_end(message.u32(1), "/plan", 1).u32(0).u32(1);
    let message = service(message, "/clear", "std_srvs/srv/Empty").u32(1);
    let message = service(
        message,
        "/nav/get_parameters",
        "rcl_interfaces/srv/GetParameters",
    );
    let message = message.u32(0).u32(1).text("/go");
    let message = ["send_goal", "get_result", "cancel_goal"]
        .iter()
        .fold(message, |p, part| service(p, part, "a/srv/S"));
    let message = graph_end(message, "/go/_action/feedback", 1);
    let message = graph_end(message, "/go/_action/status", 1);
    // The definition in the bag may list the outermost fields only.
    assert_eq!(
        observations(
            "/nodl/observed_node",
            "rosgraph_msgs/msg/Node",
            None,
            &message
        ),
        [
            "Node /nav",
            "Publish /nav /clear",
            "Publish /nav /go/_action/feedback",
            "Publish /nav /go/_action/status",
            "Publish /nav /plan",
            "Quality /go/_action/feedback reliable volatile depth 10",
            "Quality /go/_action/status reliable volatile depth 10",
            "Quality /plan reliable volatile depth 10",
            "Snapshot snapshot /nodl/observed_node /nav",
            "Type /clear std_srvs/srv/Empty",
            "Type /go/_action/feedback a/msg/T",
            "Type /go/_action/status a/msg/T",
            "Type /plan a/msg/T",
        ]
    );
}

#[test]
fn a_reliable_subscriber_of_a_best_effort_publisher_is_starved() {
    let empty = |p: Payload, many| (0..many).fold(p, |p, _| p.u32(0));
    let node = |p: Payload, name: &str| empty(p.text(name), 2);
    let message = node(Payload::cdr().u32(2), "/a");
    let message = empty(graph_end(message.u32(1), "/t", 2), 5);
    let message = node(message, "/a").u32(0);
    let message = empty(graph_end(message.u32(1), "/t", 1), 4);
    let all = observations("/rosgraph", "rosgraph_msgs/msg/Graph", None, &message);
    assert!(all.contains(&"Starved /a /t".to_owned()), "{all:?}");
    assert!(all.contains(&"Duplicate /a".to_owned()), "{all:?}");
}

#[test]
fn losses_of_the_recorder_name_the_topic_and_the_number() {
    let message = Payload::cdr()
        .text("/rec")
        .u32(1)
        .text("/scan")
        .u64(2)
        .u64(3);
    assert_eq!(
        observations(
            "/events/rosbag2_messages_lost",
            "rosbag2_interfaces/msg/MessagesLostEvent",
            None,
            &message
        ),
        ["Lost /scan 5"]
    );
}

#[test]
fn topic_statistics_distinguish_publishers_and_subscribers() {
    let one = |p: Payload, kind, node| {
        let p = p.byte(kind).text(node).text("/scan").u32(9);
        p.time().time().time()
    };
    let message = one(one(Payload::cdr().time().u32(2), 0, "/lidar"), 1, "/slam");
    assert_eq!(
        observations(
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
        observations(
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
        let all = observations(
            "ros_discovery_info",
            "rmw_dds_common/msg/ParticipantEntitiesInfo",
            None,
            &message,
        );
        assert!(all.contains(&"Node /r1/nav".to_owned()), "{gid}: {all:?}");
    }
}

#[test]
fn service_events_prove_their_topic_and_their_service() {
    let message = Payload::cdr()
        .byte(1)
        .time()
        .raw(&[9; 16])
        .u64(3)
        .u32(0)
        .u32(0);
    let all = observations("/add/_service_event", "a/srv/Add_Event", None, &message);
    assert_eq!(
        all,
        [
            "Calls /add 09090909090909090909090909090909",
            "Topic /add",
            "Topic /add/_service_event",
            "Type /add a/srv/Add"
        ]
    );
}

#[test]
fn a_graph_with_names_near_the_end_is_read_too() {
    let kind = |p: Payload, kind: &str| p.text(kind).byte(1).raw(&[0; 32]);
    let message = Payload::cdr().u32(1).u32(0);
    let message = graph_end(message.u32(1), "/plan", 1).u32(0).u32(0);
    let message = message.u32(1).text("/clear");
    let message = kind(kind(message, "std_srvs/srv/Empty"), "std_srvs/srv/Empty");
    let message = message.u32(0).u32(1).text("/go");
    let message = (0..3).fold(message, |p, _| kind(p, "a/action/Go"));
    let message = message.text("/nav").u32(0);
    let all = observations("/rosgraph", "rosgraph_msgs/msg/Graph", None, &message);
    for observation in [
        "Node /nav",
        "Publish /nav /plan",
        "Subscribe /nav /clear",
        "Type /clear std_srvs/srv/Empty",
        "Publish /nav /go/_action/feedback",
    ] {
        assert!(
            all.contains(&observation.to_owned()),
            "{observation}: {all:?}"
        );
    }
}
