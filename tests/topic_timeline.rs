//! Tests of the topic timeline and of page sizes: drawn, refused and legible content.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(name)
}

/// Renders an example into a folder of its own.
fn rendered(name: &str, flags: &[&str], outputs: &[&str]) -> (tempfile::TempDir, Output) {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.arg("render").arg(example(name)).args(flags);
    for output in outputs {
        command.arg("-o").arg(folder.path().join(output));
    }
    let done = command.output().unwrap();
    (folder, done)
}

fn said(done: &Output) -> String {
    String::from_utf8_lossy(&done.stderr).into_owned()
}

fn text(folder: &tempfile::TempDir, name: &str) -> String {
    std::fs::read_to_string(folder.path().join(name)).unwrap()
}

/// The smallest font of a drawing, in pixels.
fn smallest(svg: &str) -> f64 {
    let all = svg.split("font-size=\"").skip(1);
    let px = all.map(|rest| rest.split('"').next().unwrap().parse::<f64>().unwrap());
    px.fold(f64::MAX, f64::min)
}

/// The x and the width of the playhead of a frame.
fn head(svg: &str) -> (f64, f64) {
    let head = svg.split("id=\"playhead\"").nth(1).unwrap();
    let of = |name: &str| -> f64 {
        let from = head.find(&format!(" {name}=\"")).unwrap() + name.len() + 3;
        head[from..].split('"').next().unwrap().parse().unwrap()
    };
    (of("x"), of("width"))
}

#[test]
fn a_mission_without_known_publishers_is_a_topic_timeline() {
    let (folder, done) = rendered(
        "courier.mcap",
        &[],
        &[
            "{n}.svg", "all.svg", "all.html", "all.gif", "all.pdf", "all.png",
        ],
    );
    assert!(done.status.success(), "{}", said(&done));
    assert!(said(&done).contains("`--mode all`"), "{}", said(&done));
    let frames: Vec<String> = (0..6).map(|n| text(&folder, &format!("{n}.svg"))).collect();
    for svg in &frames {
        assert!(svg.contains(">cmd_vel</text>"));
        assert!(
            svg.contains("most publishers are unknown"),
            "the reason is missing"
        );
        assert!(smallest(svg) >= 9.0);
    }
    // The playhead advances by a window per frame, and always has the width of one.
    let heads: Vec<(f64, f64)> = frames.iter().map(|svg| head(svg)).collect();
    for pair in heads.windows(2) {
        assert!((pair[1].0 - pair[0].0 - pair[0].1).abs() < 1.0, "{heads:?}");
    }
    // The current rate: the scan is silent at 1:10, and continues.
    assert!(frames[0].contains("5 Hz"));
    assert!(
        text(&folder, "all.svg").contains("attributeName=\"visibility\" calcMode=\"discrete\"")
    );
    let page = text(&folder, "all.html");
    assert!(page.contains("<body class=\"topic-timeline\">") && page.contains(">amcl_pose</text>"));
}

#[test]
fn the_user_chooses_between_graph_and_topic_timeline() {
    let (folder, done) = rendered("courier.mcap", &["--mode", "all"], &["{n}.svg"]);
    assert!(done.status.success());
    assert!(!said(&done).contains("board"));
    assert!(
        text(&folder, "0.svg").contains("class=\"node"),
        "a graph has nodes"
    );
    // Options for graphs select a graph, and are refused with a topic timeline.
    let (_folder, done) = rendered("courier.mcap", &["--orientation", "TB"], &["{n}.svg"]);
    assert!(done.status.success() && !said(&done).contains("board"));
    for flags in [
        &["--mode", "topics", "--orientation", "TB"][..],
        &["--mode", "topics", "--collapse", "/nav"],
        &["--mode", "topics", "--strip", "3x2"],
    ] {
        let (_folder, done) = rendered("courier.mcap", flags, &["x.svg"]);
        assert_eq!(done.status.code(), Some(2), "{flags:?}");
    }
}

#[test]
fn a_picture_for_a_readme_is_legible() {
    let (folder, done) = rendered("warehouse.bag", &["--for", "readme"], &["{n}.svg"]);
    assert!(done.status.success(), "{}", said(&done));
    assert!(
        !said(&done).contains("too small to read"),
        "{}",
        said(&done)
    );
    let svg = text(&folder, "3.svg");
    assert!(svg.contains("width=\"830\""));
    assert!(smallest(&svg) >= 8.95, "{}", smallest(&svg));
    assert!(!svg.contains("id=\"legend\""), "furniture is reduced");
}

#[test]
fn a_picture_for_paper_fits_a_column_and_reports_illegible_text() {
    let (folder, done) = rendered(
        "warehouse.bag",
        &["--for", "column", "--fit", "none"],
        &["{n}.svg"],
    );
    assert!(done.status.success(), "{}", said(&done));
    assert!(text(&folder, "0.svg").contains("width=\"88mm\""));
    assert!(
        said(&done).contains(" pt, too small to read") || smallest(&text(&folder, "0.svg")) >= 7.95
    );
    for other in [["--size", "800x600"], ["--width", "88mm"]] {
        let flags = [["--for", "page"], other].concat();
        let (_folder, done) = rendered("warehouse.bag", &flags, &["x.pdf"]);
        assert_eq!(done.status.code(), Some(2), "{other:?}");
    }
}

#[test]
fn frames_show_lifetimes_below_the_graph() {
    let (folder, done) = rendered("warehouse.bag", &[], &["{n}.svg"]);
    assert!(done.status.success(), "{}", said(&done));
    let svg = text(&folder, "2.svg");
    let marks = svg.split("<g class=\"mark\"").skip(1);
    let marks: Vec<&str> = marks.map(|g| g.split("</g>").next().unwrap()).collect();
    for (what, color) in [
        ("start", "#00795C"),
        ("end", "#C44900"),
        ("other", "#6A35C9"),
    ] {
        assert!(marks.iter().any(|mark| mark.contains(color)), "no {what}");
    }
    // Phases and rows have names.
    let names: Vec<&str> = svg.split("id=\"past\"").skip(1).collect();
    assert!(names[0].contains("emergency_stop") && names[0].contains("object_detector"));
    assert!(svg.split("id=\"phases\"").nth(1).unwrap().contains("<text"));
}

#[test]
fn a_readme_shows_all_rows_on_a_page_as_high_as_they_are() {
    let height = |name: &str| -> f64 {
        let flags = ["--for", "readme", "--mode", "topics", "--period", "all"];
        let (folder, done) = rendered(name, &flags, &["x.svg"]);
        assert!(done.status.success(), "{}", said(&done));
        let svg = text(&folder, "x.svg");
        let all = svg.split("viewBox=\"0 0 830 ").nth(1).unwrap();
        all.split('"').next().unwrap().parse().unwrap()
    };
    assert!(height("courier.mcap") < 400.0);
    let warehouse = height("warehouse.bag");
    assert!((900.0..=1100.0).contains(&warehouse), "{warehouse}");
}

#[test]
fn a_mission_in_one_window_has_rates_while_they_were_sent() {
    let svg_of = |mode: &str| {
        let (folder, done) = rendered(
            "courier.mcap",
            &["--period", "all", "--mode", mode],
            &["x.svg"],
        );
        assert!(done.status.success(), "{}", said(&done));
        text(&folder, "x.svg")
    };
    // `/plan` has one message a second, then one in four; three messages have no rate; an unknown node sends `/scan`.
    let topics = svg_of("topics");
    assert!(topics.contains(">1 → 0.25 Hz<") && topics.contains(">3 msg<"));
    assert!(!topics.contains("playhead"));
    // Every node that started during the mission is green.
    assert!(
        topics.contains(
            "#00795C\">/amcl, /docking, /gripper, /nav/controller, /nav/planner, /teleop<"
        )
    );
    assert!(svg_of("nodes").contains(">scan 5 Hz<"));
}

#[test]
fn a_mission_on_a_column_is_told_in_whole_words() {
    let column = |name: &str| {
        let flags = ["--for", "column", "--period", "all"];
        let (folder, done) = rendered(name, &flags, &["x.svg"]);
        assert!(done.status.success(), "{}", said(&done));
        text(&folder, "x.svg")
    };
    // The headline of a still is one phrase, and takes two lines.
    let graph = column("warehouse.bag");
    assert!(graph.contains(">31 nodes, 7 phases,<"), "{graph}");
    assert!(graph.contains(">2 restarts, 2 topics change hands<"));
    // Rates do not take the room of the time.
    let topics = column("courier.mcap");
    assert!(topics.contains(">12 topics, 8 phases<") && topics.contains(">10 … 5 Hz<"));
    assert!(topics.contains(">1 → 0.25 Hz<") && topics.contains(">most publishers are unknown<"));
}
