//! Tests of graphs with topics and logs whose publishers a tool merged.

use super::*;

const EVERY_TWO: [i64; 10] = [2, 4, 6, 8, 10, 12, 14, 16, 18, 20];

#[test]
fn the_only_publisher_of_a_merged_topic_ends_with_its_rhythm() {
    let all: Vec<i64> = (0..99).collect();
    let talks: &[Talk<'_>] = &[
        ("/base", Some("/host"), false, &all),
        ("/plan", Some("/planner"), false, &EVERY_TWO),
        ("/goal", Some("/boss"), false, &all),
    ];
    let logs: &[Log<'_>] = &[
        (1, "/host", "hello", &["/base"]),
        (1, "/planner", "hello", &["/plan", "/goal"]),
        (2, "/boss", "hello", &["/plan", "/goal"]),
    ];
    let built = logged(talks, logs, "planner.py");
    assert_eq!(there(&built, "/planner"), [0, 1, 2]);
    assert_eq!(there(&built, "/boss").len(), 10);
}

#[test]
fn a_merged_topic_of_two_publishers_ends_no_node() {
    let all: Vec<i64> = (0..99).collect();
    let talks: &[Talk<'_>] = &[
        ("/base", Some("/host"), false, &all),
        ("/plan", Some("/planner"), false, &EVERY_TWO),
    ];
    let logs: &[Log<'_>] = &[
        (1, "/planner", "hello", &["/plan"]),
        (1, "/other", "hello", &["/plan"]),
    ];
    let built = logged(talks, logs, "planner.cpp");
    assert_eq!(there(&built, "/planner").len(), 10);
    assert_eq!(there(&built, "/other").len(), 10);
}

#[test]
fn twins_share_a_merged_topic_in_turns() {
    let all: Vec<i64> = (0..99).collect();
    let sent: Vec<i64> = (2..20).chain(42..60).collect();
    let (first, second) = ("/see_1_0000000001000", "/see_2_0000000040000");
    let talks: &[Talk<'_>] = &[
        ("/base", Some("/host"), false, &all),
        ("/seen", Some(first), false, &sent),
    ];
    let logs: &[Log<'_>] = &[
        (3, first, "hello", &["/seen"]),
        (43, second, "hello", &["/seen"]),
    ];
    let built = logged(talks, logs, "see.py");
    assert_eq!(there(&built, first), [0, 1]);
    assert_eq!(there(&built, second), [4, 5]);
    assert!(built.elements.subscribes.iter().all(|e| {
        let topic = &built.elements.topics[e.topic];
        topic.name.as_str() != "/seen"
    }));
}

#[test]
fn a_refused_client_is_there_for_a_moment() {
    let all: Vec<i64> = (0..99).collect();
    let talks: &[Talk<'_>] = &[("/scan", Some("/host"), false, &all)];
    let link = "Connection: Creating TransportSubscriberLink for topic [/scan] connected to [callerid=[/bad] address=[x]]";
    let refusal =
        "Client [/bad] wants topic /scan to have datatype/md5sum [a/b], but our version has [c/d].";
    let good = link.replace("/bad", "/good");
    let logs: &[Log<'_>] = &[
        (15, "/host", link, &["/scan"]),
        (15, "/host", refusal, &["/scan"]),
        (15, "/host", &good, &["/scan"]),
    ];
    let built = logged(talks, logs, "subscriber.cpp");
    assert_eq!(there(&built, "/bad"), [1]);
    assert_eq!(there(&built, "/good"), (1..10).collect::<Vec<_>>());
    let bad = built
        .elements
        .nodes
        .iter()
        .position(|n| n.name.as_str() == "/bad");
    let ended = built.lives.of(Element::Node(Id::of(bad.unwrap()))).unwrap()[0]
        .ended
        .unwrap();
    assert_eq!(
        (ended.earliest.0, ended.latest.0),
        (15 * SECOND, 98 * SECOND)
    );
}
