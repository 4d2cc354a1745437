//! Tests of differences between two missions, as text and as pictures.

use std::fs;

use super::{HEALTHY, Robot, bag, recording, run};
use crate::support::Recording;

#[test]
fn differences_are_limited_to_what_both_can_show() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "a.bag", &recording(HEALTHY, 0));
    bag(here, "same.bag", &recording(HEALTHY, 3));
    let other = Robot {
        scan_ms: 200,
        controller: "/pilot",
        has_teleop: true,
        ..HEALTHY
    };
    bag(here, "b.bag", &recording(other, 3));
    let (code, said) = run(here, &["diff", "a.bag", "same.bag"]);
    assert_eq!((code, said.contains("no differences")), (0, true), "{said}");
    let outputs = [
        "-o", "d.json", "-o", "d.md", "-o", "d.svg", "-o", "d.html", "-o", "d.gif",
    ];
    let (code, said) = run(here, &[&["diff", "a.bag", "b.bag"][..], &outputs].concat());
    assert_eq!(code, 1, "{said}");
    let wanted = [
        "- node       /controller",
        "+ node       /pilot",
        "+ node       /teleop",
        "~ rate       /scan",
        "10 Hz → 5 Hz",
        "a.bag and b.bag: ",
    ];
    for line in wanted {
        assert!(said.contains(line), "no `{line}` in {said}");
    }
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(here.join("d.json")).unwrap()).unwrap();
    let rows = json["differences"].as_array().unwrap();
    assert!(
        rows.iter()
            .any(|r| r["kind"] == "rate" && r["name"] == "/scan" && r["in"] == "both")
    );
    let svg = fs::read_to_string(here.join("d.svg")).unwrap();
    for name in ["/controller", "/pilot", "/teleop", "/scan", "/odom"] {
        assert!(svg.contains(name), "{name}");
    }
    assert!(!svg.contains("window 1 of"), "time means nothing here");
    // Elements in only one of them did not start or stop.
    let html = fs::read_to_string(here.join("d.html")).unwrap();
    for text in [&svg, &html] {
        for words in [
            "A: a.bag → B: b.bag",
            "only in A",
            "only in B",
            "B against A",
        ] {
            assert!(text.contains(words), "no `{words}`");
        }
        for words in ["started", "stopped", "vanished", "appeared"] {
            assert!(!text.contains(&format!(" {words}")), "{words}");
        }
    }
    assert!(html.contains("<body class=\"compares paired\">"));
    let (code, said) = run(here, &["diff", "a.bag", "b.bag", "-o", "d.csv"]);
    assert!(
        code == 2 && said.contains("cannot represent a comparison"),
        "{said}"
    );
    fs::create_dir(here.join("new")).unwrap();
    fs::copy(here.join("b.bag"), here.join("new/a.bag")).unwrap();
    let (_, said) = run(here, &["diff", "a.bag", "new/a.bag"]);
    assert!(said.contains("only in new/a.bag"), "{said}");
    assert!(fs::read(here.join("d.gif")).unwrap().starts_with(b"GIF89a"));
    let markdown = fs::read_to_string(here.join("d.md")).unwrap();
    assert!(markdown.starts_with("### 🔀 "), "{markdown}");
    fs::write(
        here.join("g.yaml"),
        "schema: bagreel.expect/1\nnodes:\n  /teleop: {}\n",
    )
    .unwrap();
    let (code, said) = run(here, &["diff", "a.bag", "g.yaml"]);
    assert_eq!(
        (code, said.contains("error[node-missing]: /teleop")),
        (1, true),
        "{said}"
    );
    assert_eq!(run(here, &["diff", "gone.bag", "a.bag"]).0, 2);
    assert_eq!(run(here, &["diff", "a.bag"]).0, 2);
}

#[test]
fn unobservable_elements_are_listed_below_the_differences() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "a.bag", &recording(HEALTHY, 0));
    let ros2 = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
    let (code, said) = run(here, &["diff", "a.bag", ros2, "-o", "d.md"]);
    assert_eq!(code, 1, "{said}");
    let lines: Vec<&str> = said.lines().filter(|l| !l.contains(": ")).collect();
    let unknown: Vec<bool> = lines.iter().map(|l| l.starts_with("? ")).collect();
    assert!(unknown.is_sorted() && unknown.contains(&true), "{said}");
    let markdown = fs::read_to_string(here.join("d.md")).unwrap();
    let (open, folded) = markdown.split_once("<details><summary>").unwrap();
    let rows = |text: &str, sign: &str| text.lines().filter(|l| l.starts_with(sign)).count();
    assert!(
        rows(open, "| - ") > 0 && rows(open, "| ? ") == 0,
        "{markdown}"
    );
    assert!(
        rows(folded, "| ? ") > 0 && rows(folded, "| - ") == 0,
        "{markdown}"
    );
}

/// Two minutes of a lidar whose node lives on, and of commands in bursts, of which every n-th is sent.
pub(super) fn two_minutes(scan: (i64, i64), every: usize, shift: i64) -> Recording {
    let mut bag = Recording::default();
    let base = bag.publisher("/base", "/odom", "nav_msgs/Odometry");
    bag.send(base, (0, 120_000), 100, &[1; 48]);
    let state = bag.publisher("/lidar", "/lidar/state", "std_msgs/String");
    bag.send(state, (shift, 120_000), 500, b"\x01\0\0\0a");
    let lidar = bag.publisher("/lidar", "/scan", "sensor_msgs/LaserScan");
    bag.send(lidar, (scan.0 + shift, scan.1), 100, &[2; 400]);
    let pilot = bag.publisher("/pilot", "/cmd_vel", "geometry_msgs/Twist");
    let bursts = (0..12).flat_map(|n| (0..20).map(move |k| 2000 + n * n * 800 + k * 30));
    for at in bursts.step_by(every) {
        bag.send(pilot, (at + shift, at + shift + 1), 1, &[3; 48]);
    }
    bag
}

#[test]
fn topics_that_begin_or_end_at_another_time_or_send_less_differ_also_on_the_page() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let whole = (0, 120_000);
    bag(here, "good.bag", &two_minutes(whole, 1, 0));
    for (name, scan, every, line, page) in [
        ("healthy", whole, 1, "no differences", "Differences"),
        (
            "late",
            (40_000, 120_000),
            1,
            "~ begin      /scan  00:00 → 00:40",
            "begins at 00:40",
        ),
        (
            "ends",
            (0, 72_000),
            1,
            "~ end        /scan  stays → ends at 01:11",
            "stays → ends at 01:11",
        ),
        ("fewer", whole, 2, "~ rate       /cmd_vel  ", "/cmd_vel"),
    ] {
        let file = format!("{name}.bag");
        bag(here, &file, &two_minutes(scan, every, 300));
        let (code, said) = run(here, &["diff", "good.bag", &file, "-o", "d.html"]);
        let is_same = name == "healthy";
        assert_eq!(code, i32::from(!is_same), "{name}: {said}");
        assert!(said.contains(line), "{name}: no `{line}` in {said}");
        let one = is_same || said.contains(": 1 difference");
        assert!(one, "{name}: {said}");
        let html = fs::read_to_string(here.join("d.html")).unwrap();
        assert!(html.contains(page), "{name}");
        assert_eq!(html.contains("compares paired"), !is_same, "{name}");
    }
}

/// How a topic differs in a second run: which of its messages remain, by their number and their share of its life.
type Fault = (&'static str, fn(usize, f64) -> bool);

const FAULTS: &[Fault] = &[
    ("removed", |_, _| false),
    ("three messages", |n, _| n < 3),
    ("halved", |n, _| n % 2 == 0),
    ("a fifth lost", |n, _| n % 5 != 0),
    ("late", |_, share| share > 0.3),
    ("gap", |_, share| !(0.4..0.6).contains(&share)),
    ("dies", |_, share| share < 0.6),
    ("one in ten", |n, _| n % 10 == 0),
];

/// A recording whose topics send evenly, rarely, in bursts, and with a long pause.
fn rhythms() -> Recording {
    let mut all = Recording::default();
    let mut topic = |name: &str, parts: &[(i64, i64)], period: i64| {
        let node = format!("/node{name}").replace("/node/", "/of_");
        let place = all.publisher(&node, name, "std_msgs/String");
        for part in parts {
            all.send(place, *part, period, b"\x05\0\0\0hello");
        }
    };
    topic("/steady", &[(0, 120_000)], 50);
    topic("/even", &[(500, 120_000)], 100);
    topic("/slow", &[(900, 120_000)], 1000);
    let bursts: Vec<(i64, i64)> = (0..8)
        .map(|n| (n * 15_000 + 700, n * 15_000 + 2700))
        .collect();
    topic("/bursts", &bursts, 50);
    let uneven = [
        (3000, 9000),
        (11_000, 12_000),
        (40_000, 71_000),
        (75_000, 76_500),
        (99_000, 118_000),
    ];
    topic("/uneven", &uneven, 70);
    topic("/paused", &[(1000, 30_000), (60_000, 119_000)], 100);
    all
}

/// The recording with a fault of this publisher that its messages do not show.
fn graph_faults(number: usize) -> [(&'static str, Recording); 4] {
    let changed = |fault: &'static str, change: &dyn Fn(&mut Recording)| {
        let mut other = rhythms();
        change(&mut other);
        (fault, other)
    };
    [
        changed("type changed", &|other| {
            "std_msgs/Float64".clone_into(&mut other.publishers[number].type_name);
        }),
        changed("publisher swapped", &|other| {
            other.publishers[number]
                .node
                .clone_from(&rhythms().publishers[0].node);
        }),
        changed("node renamed", &|other| {
            "/other".clone_into(&mut other.publishers[number].node);
        }),
        changed("second publisher", &|other| {
            let topic = other.publishers[number].topic.clone();
            let intruder = other.publisher("/intruder", &topic, "std_msgs/String");
            other.send(intruder, (2_000, 118_000), 400, b"\x05\0\0\0hello");
        }),
    ]
}

#[test]
fn what_check_finds_with_a_baseline_of_a_run_diff_finds_too() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let healthy = rhythms();
    bag(here, "a.bag", &healthy);
    run(here, &["baseline", "a.bag", "-o", "graph.yaml"]);
    // Each node of a healthy run is up to a second late.
    let mut again = rhythms();
    for (of, time, _) in &mut again.messages {
        *time += i64::try_from(*of).unwrap() * 150_000_000;
    }
    bag(here, "again.bag", &again);
    let (code, said) = run(here, &["diff", "a.bag", "again.bag"]);
    assert_eq!(code, 0, "{said}");
    let mut missed = Vec::new();
    for (number, publisher) in healthy.publishers.iter().enumerate().skip(1) {
        let own = healthy.messages.iter().filter(|m| m.0 == number);
        let times: Vec<i64> = own.map(|m| m.1).collect();
        let (first, life) = (times[0], (times[times.len() - 1] - times[0]) as f64);
        let sent = FAULTS.iter().map(|(fault, keeps)| {
            let mut other = rhythms();
            let mut nth = 0;
            other.messages.retain(|(of, time, _)| {
                nth += usize::from(*of == number);
                *of != number || keeps(nth - 1, (time - first) as f64 / life)
            });
            (*fault, other)
        });
        for (fault, other) in sent.chain(graph_faults(number)) {
            bag(here, "b.bag", &other);
            let read = |args: &[&str]| -> serde_json::Value {
                run(here, &[args, &["-o", "r.json"]].concat());
                serde_json::from_slice(&fs::read(here.join("r.json")).unwrap()).unwrap()
            };
            let names = |json: &serde_json::Value| -> Vec<String> {
                let rows = json.as_array().into_iter().flatten();
                rows.map(|row| row["name"].as_str().unwrap().to_owned())
                    .collect()
            };
            let checked = read(&["check", "b.bag", "--expect", "graph.yaml"]);
            let rules = checked["rules"].as_array().unwrap().iter();
            let found: Vec<String> = rules.flat_map(|rule| names(&rule["findings"])).collect();
            let differs = names(&read(&["diff", "a.bag", "b.bag"])["differences"]);
            let topic = publisher.topic.as_str();
            let is_named = |names: &[String]| {
                names
                    .iter()
                    .any(|name| name.contains(topic) || name.contains(&publisher.node))
            };
            // A new node stands for what it publishes.
            let is_found = is_named(&differs) || differs.iter().any(|name| name == "/intruder");
            if is_named(&found) && !is_found {
                missed.push(format!("{topic} {fault}: {found:?}"));
            }
        }
    }
    assert_eq!(missed, [""; 0]);
}
