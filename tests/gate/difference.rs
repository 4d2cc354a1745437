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
