//! Tests of the page, the animated SVG and the report: in a real browser if available, and by size.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::support::{browser, windows};

/// Runs `bagreel render` on this mission and returns the folder with `x.` and each of the extensions.
fn rendered(mission: &Value, extensions: &[&str]) -> TempDir {
    let folder = TempDir::new().unwrap();
    let input = folder.path().join("in.json");
    fs::write(&input, mission.to_string()).unwrap();
    render(&input, folder.path(), extensions);
    folder
}

fn render(input: &Path, folder: &Path, extensions: &[&str]) {
    render_with(input, folder, extensions, &[]);
}

fn render_with(input: &Path, folder: &Path, extensions: &[&str], more: &[&str]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.arg("render").arg(input).arg("--quiet");
    command.args(more);
    if more.is_empty() && extensions.iter().any(|e| !["md", "mmd"].contains(e)) {
        command.args(["--fit", "none"]);
    }
    for extension in extensions {
        command.arg("-o").arg(folder.join(format!("x.{extension}")));
    }
    let done = command.output().unwrap();
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
}

/// A mission of ten-second windows in which every node publishes its own topic to a listener; presence and rates depend
/// on the window.
fn running(names: &[&str], windows: usize) -> Value {
    let start = 1_700_000_000_000_000_000_i64;
    let window = |w: usize| {
        let there = |i: &usize| i.is_multiple_of(3) || !(w / 7 + i).is_multiple_of(4);
        let hz = |i: usize| {
            if i.is_multiple_of(5) && (w / 11) % 2 == 1 {
                7.4
            } else {
                10.0 + i as f64
            }
        };
        let who: Vec<usize> = (0..names.len()).filter(there).collect();
        let topic = |i: usize| format!("{}/out", names[i]);
        let from = start + i64::try_from(w).unwrap() * 10_000_000_000;
        json!({
            "start_ns": from, "end_ns": from + 10_000_000_000_i64, "messages": 10,
            "nodes": who.iter().map(|i| json!({"name": names[*i], "state": "active", "hz": hz(*i)})).collect::<Vec<_>>(),
            "topics": who.iter().map(|i| json!({"name": topic(*i), "types": ["<t>/T"], "state": "active", "count": 10, "hz": hz(*i)}))
                .collect::<Vec<_>>(),
            "publishes": who.iter().map(|i| json!({"node": names[*i], "topic": topic(*i), "state": "active", "hz": hz(*i)}))
                .collect::<Vec<_>>(),
            "subscribes": who.iter().map(|i| json!({"topic": topic(*i), "node": names[0], "state": "active", "hz": null}))
                .collect::<Vec<_>>(),
        })
    };
    let windows: Vec<Value> = (0..windows).map(window).collect();
    let mut mission = windows::mission(windows);
    mission["bags"] = json!([{"name": "mission", "format": "mcap"}]);
    mission
}

const ROBOT: [&str; 12] = [
    "/nav/planner",
    "/nav/controller",
    "/nav/smoother",
    "/base/driver",
    "/base/battery",
    "/base/bumper",
    "/sensors/lidar",
    "/sensors/camera",
    "/sensors/scanner",
    "/loc/amcl",
    "/loc/map",
    "/loc/ekf",
];

const HOSTILE: [&str; 31] = [
    "/</script><script>window.hit=1</script>",
    "/<img src=x onerror=window.hit=2>",
    "/a\u{2028}b\u{2029}c",
    "/\u{202e}gnp.exe\u{2066}",
    "/\"'`quotes",
    "/--><!--x",
    "/&lt;b&gt;",
    "/@you #12 [x](http://y) |z| www.a.b",
    "/日本語",
    "/{{data}}",
    "/<svg onload=window.hit=3>",
    "/<iframe src=javascript:window.hit=4>",
    "/javascript:window.hit=5",
    "/]]><script>window.hit=6</script>",
    "/</style><script>window.hit=7</script>",
    "/</title><script>window.hit=8</script>",
    "/${window.hit=9}",
    "/\\u003cscript>window.hit=10",
    "/&#x3c;script&#x3e;",
    "/%3Cscript%3E",
    "/x'onclick='window.hit=11",
    "/x\"onmouseover=\"window.hit=12",
    "/__proto__",
    "/constructor",
    "/toString",
    "/\u{feff}\u{200b}nothing",
    "/line\nbreak\ttab\u{7f}",
    "/```fence",
    "/\"]; click x",
    "/%%{init: {}}%%",
    "/| cell | <br>",
];

#[test]
fn the_page_in_a_browser_shows_the_mission() {
    let mission = running(&ROBOT, 50);
    let pages = rendered(&mission, &["html", "svg", "json", "md"]);
    let hostile = rendered(&running(&HOSTILE, 12), &["html"]);
    let folded = rendered_with(&mission, &["html"], &["--collapse", "/nav,/sensors"]);
    let timeline = rendered_with(&mission, &["html"], &["--mode", "topics"]);
    let quiet = rendered(&running(&ROBOT[..1], 5), &["html"]);
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let bag = TempDir::new().unwrap();
    let warehouse = examples.join("warehouse.bag");
    render_with(&warehouse, bag.path(), &["html"], &["--period", "10"]);
    let comparison = bag.path().join("comparison.html");
    let compared = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .arg("diff")
        .args([examples.join("courier.mcap"), warehouse])
        .arg("-o")
        .arg(&comparison)
        .output()
        .unwrap();
    assert!(comparison.exists(), "{compared:?}");
    let file = |folder: &TempDir, name: &str| folder.path().join(name);
    let files = [
        file(&pages, "x.html"),
        file(&pages, "x.json"),
        file(&hostile, "x.html"),
        file(&pages, "x.svg"),
        file(&folded, "x.html"),
        file(&timeline, "x.html"),
        file(&pages, "x.md"),
        file(&quiet, "x.html"),
        file(&bag, "x.html"),
        comparison,
    ];
    browser::drive("drive.py", files);
}

#[test]
fn next_change_is_visible_on_every_recording() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut inputs: Vec<PathBuf> = [
        "examples/warehouse.bag",
        "examples/courier.mcap",
        "tests/data/medium.json",
    ]
    .map(|file| here.join(file))
    .to_vec();
    let more = [
        "inspect/inspect.bag",
        "mini/mini_bz2.bag",
        "bags/mission/mission.bag",
        "bags/webots/results",
        "bags/roomba/ros2bag",
        "bags/docker_mcap/test",
    ];
    let more = more.map(|file| here.join("../shared/data").join(file));
    let (there, absent): (Vec<_>, Vec<_>) = more.into_iter().partition(|path| path.exists());
    for path in absent {
        println!("skipped: no `{}`", path.display());
    }
    inputs.extend(there);
    let names: Vec<String> = (0..150)
        .map(|k| format!("/part{}/node{k}", k % 12))
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut folders: Vec<TempDir> = inputs
        .iter()
        .map(|input| {
            let folder = TempDir::new().unwrap();
            render_with(input, folder.path(), &["html"], &["--fit", "auto"]);
            folder
        })
        .collect();
    folders.push(rendered(&running(&names, 30), &["html"]));
    folders.push(rendered(&running(&ROBOT[..1], 5), &["html"]));
    browser::drive(
        "walk.py",
        folders.iter().map(|folder| folder.path().join("x.html")),
    );
}

/// The data of a page's script.
fn data_of(page: &str) -> Value {
    let (_, rest) = page
        .split_once("<script id=\"data\" type=\"application/json\">")
        .unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

fn read(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap()
}

/// Renders the mission with more options into its own folder.
fn rendered_with(mission: &Value, extensions: &[&str], more: &[&str]) -> TempDir {
    let folder = TempDir::new().unwrap();
    let input = folder.path().join("in.json");
    fs::write(&input, mission.to_string()).unwrap();
    render_with(&input, folder.path(), extensions, more);
    folder
}

#[test]
fn phases_of_a_mission_of_windows_begin_with_them() {
    let folder = rendered(&running(&ROBOT, 50), &["html"]);
    let data = data_of(&read(&folder, "x.html"));
    let starts = data["phases"].as_array().unwrap().iter();
    let starts: Vec<f64> = starts.map(|phase| phase[0].as_f64().unwrap()).collect();
    assert!(starts.len() > 2, "{starts:?}");
    // One that began in the last moment of a window would be named as that window's.
    assert!(starts.iter().all(|start| start % 10.0 == 0.0), "{starts:?}");
}

#[test]
fn collapsed_elements_are_listed_in_page_and_report() {
    let mission = running(&ROBOT, 20);
    let open = rendered(&mission, &["md"]);
    let folded = rendered_with(&mission, &["html", "md"], &["--collapse", "/nav,/sensors"]);
    let data = data_of(&read(&folded, "x.html"));
    let names = |graph: usize| data["graphs"][graph]["names"].as_array().unwrap().clone();
    for name in ROBOT {
        assert!(names(0).contains(&json!(name)), "{name}");
    }
    assert!(names(1).contains(&json!("/nav")) && !names(1).contains(&json!("/nav/planner")));
    let place = names(1).iter().position(|n| n == "/nav").unwrap();
    let held = data["graphs"][1]["members"][place].as_array().unwrap();
    assert!(
        held.iter()
            .any(|at| names(0)[usize::try_from(at.as_u64().unwrap()).unwrap()] == "/nav/planner")
    );
    let verdict = |text: &str| text.lines().next().unwrap().to_owned();
    assert_eq!(
        verdict(&read(&open, "x.md")),
        verdict(&read(&folded, "x.md"))
    );
}

#[test]
fn a_page_lists_infrastructure_as_words() {
    let edge = |node: &str, topic: &str| json!({"node": node, "topic": topic, "state": "active", "hz": 5.0});
    let node = |name: &str| json!({"name": name, "state": "active", "hz": 5.0});
    let topic = |name: &str| json!({"name": name, "types": ["a/T"], "state": "active", "count": 50, "hz": 5.0});
    let start = 1_700_000_000_000_000_000_i64;
    let window = |w: i64| {
        json!({
            "start_ns": start + w * 10_000_000_000, "end_ns": start + (w + 1) * 10_000_000_000, "messages": 10,
            "nodes": (["/arm/camera_tf", "/arm/driver", "/arm/planner"].map(node)),
            "topics": (["/arm/plan", "/tf"].map(topic)),
            "publishes": [edge("/arm/planner", "/arm/plan"), edge("/arm/camera_tf", "/tf"), edge("/arm/driver", "/tf")],
            "subscribes": [edge("/arm/driver", "/arm/plan"), edge("/arm/planner", "/tf")],
        })
    };
    let windows: Vec<Value> = (0..3).map(window).collect();
    let mission = windows::mission(windows);
    let page = read(&rendered(&mission, &["html"]), "x.html");
    let drawing = |key: &str| {
        let rest = page.split_once(key).unwrap_or_else(|| panic!("no {key}")).1;
        rest.split_once("</g>")
            .unwrap()
            .0
            .split_once('>')
            .unwrap()
            .1
            .to_owned()
    };
    assert_eq!(page.matches(">also here:</text>").count(), 2);
    for (name, word) in [("/tf", "/tf"), ("/arm/camera_tf", "camera_tf")] {
        let drawing = drawing(&format!(" data-name=\"{name}\""));
        assert!(
            drawing.starts_with("<text ") && drawing.contains(&format!(">{word}</text>")),
            "{drawing}"
        );
    }
    assert!(drawing(" data-name=\"/arm/driver\"").starts_with("<rect "));
    // They can be found, with all their facts.
    let graph = &data_of(&page)["graphs"][0];
    let names = &graph["names"];
    let name = |end: &Value| &names[usize::try_from(end.as_u64().unwrap()).unwrap()];
    let arrows = graph["arrows"].as_array().unwrap();
    let edges: Vec<&str> = page.split("<g class=\"edge ").skip(1).collect();
    let arrow = |from: &str, to: &str| {
        let is = |a: &Value| *name(&a[0]) == from && *name(&a[1]) == to;
        let edge = edges[arrows.iter().position(is).unwrap()];
        edge.split_once("</g>").unwrap().0.contains("<path ")
    };
    assert!(!arrow("/arm/camera_tf", "/tf") && arrow("/arm/plan", "/arm/driver"));
    let count = |key: &str| graph[key].as_array().unwrap().len();
    assert_eq!([count("names"), count("boxes"), count("arrows")], [5, 5, 5]);
    let shown = read(
        &rendered_with(&mission, &["html"], &["--hide", "none"]),
        "x.html",
    );
    assert!(!shown.contains("also here:"));
}

#[test]
fn arrows_between_nodes_list_their_topics() {
    let pages = rendered_with(&running(&ROBOT, 20), &["html", "svg"], &["--mode", "nodes"]);
    let page = read(&pages, "x.html");
    let arrows = data_of(&page)["graphs"][0]["arrows"]
        .as_array()
        .unwrap()
        .clone();
    assert!(arrows.iter().any(|a| a[2] == "/nav/controller/out"));
    assert!(page.contains("/nav/controller/out 11 Hz</text>"));
    assert!(read(&pages, "x.svg").contains("out 11 Hz</text>"));
}

#[test]
fn phases_named_by_the_user_are_shown_everywhere() {
    let folder = TempDir::new().unwrap();
    let names = folder.path().join("names");
    fs::write(&names, "0|setting out\n60|coming home\n").unwrap();
    let more = ["--phases", names.to_str().unwrap()];
    let pages = rendered_with(&running(&ROBOT, 12), &["html", "svg", "md"], &more);
    for name in ["x.html", "x.svg", "x.md"] {
        let text = read(&pages, name);
        assert!(
            text.contains("setting out") && text.contains("coming home"),
            "{name}"
        );
    }
}

/// An example mission with these window options, as page, data and frames.
fn divided(more: &[&str]) -> (Value, Value, String) {
    let folder = TempDir::new().unwrap();
    let bag = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/courier.mcap");
    let done = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .arg("render")
        .arg(bag)
        .args(more)
        .args(["--mode", "all", "--quiet"])
        .args(
            ["x.html", "x.json", "x{n}.svg"]
                .iter()
                .flat_map(|name| ["-o".into(), folder.path().join(name).into_os_string()]),
        )
        .output()
        .unwrap();
    assert!(done.status.success(), "{done:?}");
    let mission = serde_json::from_str(&read(&folder, "x.json")).unwrap();
    (
        data_of(&read(&folder, "x.html")),
        mission,
        read(&folder, "x01.svg"),
    )
}

/// Checks that a page has the mission's windows, and each headline in every window that contains its time.
fn holds_its_windows(data: &Value, mission: &Value) {
    let windows = mission["windows"].as_array().unwrap();
    let first = windows[0]["start_ns"].as_i64().unwrap();
    let list = |key: &str| {
        data[key]
            .as_array()
            .unwrap()
            .iter()
            .map(|s| s.as_f64().unwrap())
    };
    let of = |key: &'static str| {
        let secs =
            move |w: &Value| (w[key].as_i64().unwrap() - first).div_euclid(1_000_000) as f64 / 1e3;
        windows.iter().map(secs)
    };
    assert!(list("starts").eq(of("start_ns")) && list("ends").eq(of("end_ns")));
    let mut shown = 0;
    for at in data["reported"].as_array().unwrap() {
        let window = usize::try_from(at[0].as_u64().unwrap()).unwrap();
        let (start, end) = (
            list("starts").nth(window).unwrap(),
            list("ends").nth(window).unwrap(),
        );
        for line in at[3].as_array().unwrap() {
            assert!(
                (start..end).contains(&line[0].as_f64().unwrap()),
                "{line} in {start} – {end}"
            );
            shown += 1;
        }
    }
    assert!(shown > 5);
}

#[test]
fn overlapping_windows_are_shown_with_their_own_spans() {
    let (data, mission, frame) = divided(&["--period", "10", "--step", "5"]);
    holds_its_windows(&data, &mission);
    assert_eq!(
        (&data["starts"][1], &data["ends"][1]),
        (&json!(5), &json!(15))
    );
    assert!(frame.contains(">0:05 – 0:15<"), "{frame}");
}

/// The value of a run list in a window.
fn value_at(list: &Value, window: u64) -> usize {
    let (mut from, mut value) = (0, 0);
    let list: Vec<u64> = serde_json::from_value(list.clone()).unwrap_or_default();
    for run in list.chunks(2) {
        from += run[0];
        if from > window {
            break;
        }
        value = run[1];
    }
    usize::try_from(value).unwrap()
}

#[test]
fn a_page_has_the_exact_rate_of_each_window() {
    let folder = TempDir::new().unwrap();
    let bag = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/warehouse.bag");
    render_with(&bag, folder.path(), &["html", "json"], &["--period", "10"]);
    let graph = &data_of(&read(&folder, "x.html"))["graphs"][0];
    let mission: Value = serde_json::from_str(&read(&folder, "x.json")).unwrap();
    let names = graph["names"].as_array().unwrap();
    let text = |value: usize| graph["labels"][value].as_str().unwrap();
    let (mut compared, mut empty) = (0, 0);
    for (w, window) in (0..).zip(windows::windows(&mission)) {
        for topic in window["topics"].as_array().unwrap() {
            let place = names.iter().rposition(|name| *name == topic["name"]);
            let (Some(place), Some(hz)) = (place, topic["hz"].as_f64()) else {
                continue;
            };
            let lists = &graph["runs"][place];
            let state = graph["classes"][value_at(&lists[0], w)].as_str().unwrap();
            if state == "off" || graph["kinds"][place] != 1 {
                continue;
            }
            let exact: f64 = text(value_at(&lists[4], w)).parse().unwrap();
            assert!((exact - hz).abs() <= 1e-5 * hz, "{w} {topic} {exact}");
            let drawn = text(value_at(&lists[1], w));
            // Silence ends a rate of at least five messages.
            if hz == 0.0 && !state.contains("removed") {
                assert_eq!(drawn, "", "{w} {topic}");
                empty += 1;
            }
            compared += 1;
        }
    }
    assert!(compared > 500 && empty > 10, "{compared} {empty}");
}

#[test]
fn pages_of_ros_2_do_not_mention_connections_of_ros_1() {
    let (data, ..) = divided(&["--period", "10"]);
    let words = data["words"].as_array().unwrap();
    let has = |text: &str| {
        words
            .iter()
            .any(|line| line.as_str().unwrap().contains(text))
    };
    assert!(has("known by connection: channels of the recording"));
    assert!(!has("ROS 1 connection") && !has("known by unknown"));
}

#[test]
fn an_animation_shows_every_rate_in_its_window() {
    let mission = running(&ROBOT, 50);
    let pages = rendered(&mission, &["svg"]);
    let svg = read(&pages, "x.svg");
    // `/base/battery` is slower in every second group of eleven windows, and present throughout.
    let has = |rate: &str| svg.contains(&format!(">{rate}</text>"));
    assert!(has("10 Hz") && has("7.4 Hz"), "{svg}");
    let stretches = |rate: &str| {
        let groups = svg.split("<animate attributeName=\"visibility\"").skip(1);
        let own = groups.filter(|group| group.contains(&format!(">{rate}</text>")));
        let times = own.map(|group| group.split('>').next().unwrap());
        times
            .map(|times| times.matches("visible").count())
            .sum::<usize>()
    };
    assert!(stretches("7.4 Hz") >= 2, "{svg}");
}

#[test]
fn bars_and_jumps_count_headlines() {
    let pages = rendered(&running(&ROBOT, 50), &["html", "json"]);
    let data = data_of(&read(&pages, "x.html"));
    let mission: Value = serde_json::from_str(&read(&pages, "x.json")).unwrap();
    let ledger = mission["events"].as_array().unwrap();
    let parts: Vec<&Value> = ledger
        .iter()
        .filter_map(|e| e["parts"].as_array())
        .flatten()
        .collect();
    let is_headline = |e: &&Value| e["quiet"] != true && !parts.contains(&&e["id"]);
    let entries = ledger.iter().filter(is_headline).count() as u64;
    let shown: u64 = data["reported"]
        .as_array()
        .unwrap()
        .iter()
        .map(|t| t[1].as_u64().unwrap())
        .sum();
    assert!(shown > 10);
    assert_eq!(shown, entries);
    for window in data["reported"].as_array().unwrap() {
        let lines = window[3].as_array().unwrap().iter();
        let is_back = |line: &&Value| line[3].as_str().unwrap().contains(" is back after ");
        let headlines = lines.filter(|line| !is_back(line)).count() as u64;
        assert_eq!(window[1].as_u64().unwrap(), headlines);
    }
}

#[test]
fn links_in_a_report_cannot_execute_code() {
    let folder = TempDir::new().unwrap();
    let input = folder.path().join("in.json");
    fs::write(&input, running(&ROBOT, 3).to_string()).unwrap();
    for bad in ["player=javascript:alert(1)", "player=DATA:text/html,x"] {
        let done = Command::new(env!("CARGO_BIN_EXE_bagreel"))
            .arg("render")
            .arg(&input)
            .args(["--quiet", "--link", bad, "-o"])
            .arg(folder.path().join("x.md"))
            .output()
            .unwrap();
        assert_eq!(done.status.code(), Some(2), "{bad}");
    }
}

#[test]
fn a_page_makes_no_requests_and_has_a_strict_policy() {
    let pages = rendered(&running(&HOSTILE, 12), &["html", "svg"]);
    let page = fs::read_to_string(pages.path().join("x.html")).unwrap();
    assert!(page.contains("default-src 'none';script-src 'sha256-"));
    for bad in [
        "<script>window",
        "<img",
        "src=\"http",
        "href=\"http",
        "unsafe-",
        "@import",
        "\u{2028}",
        "\u{202e}",
    ] {
        assert!(!page.contains(bad), "{bad}");
    }
    let svg = fs::read_to_string(pages.path().join("x.svg")).unwrap();
    for bad in [
        "<script",
        "<img",
        "href=\"http",
        "filter",
        "\u{2028}",
        "\u{202e}",
    ] {
        assert!(!svg.contains(bad), "{bad}");
    }
}

#[test]
fn names_in_a_report_are_escaped() {
    let pages = rendered(&running(&HOSTILE, 12), &["md", "mmd"]);
    let report = fs::read_to_string(pages.path().join("x.md")).unwrap();
    // Mermaid has its own entities.
    let (before, rest) = report.split_once("```mermaid").unwrap();
    let words = before.to_owned() + rest.split_once("```").unwrap().1;
    for bad in [
        "<script", "<img", "@you", "#12", "http://", "[x](", "www.a", "<t>",
    ] {
        assert!(!words.contains(bad), "{bad}");
    }
    let own = ["<details><summary>", "</summary>", "</details>"];
    let tags = report.matches('<').count();
    assert_eq!(
        tags,
        own.iter().map(|t| report.matches(t).count()).sum::<usize>()
            + report.matches("<summary>").count()
    );
    assert!(
        report.starts_with("**mission**: ") || report.starts_with("**in"),
        "{}",
        &report[..80]
    );
    assert!(report.contains("```mermaid\nflowchart LR\n"));
}

#[test]
fn a_report_is_appended_to_a_job_summary() {
    let folder = TempDir::new().unwrap();
    let (input, summary) = (folder.path().join("in.json"), folder.path().join("summary"));
    fs::write(&input, running(&ROBOT, 9).to_string()).unwrap();
    fs::write(&summary, "before\n").unwrap();
    let done = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .arg("render")
        .arg(&input)
        .args(["--quiet", "--link", "player=https://example.org/a>b", "-o"])
        .arg(&summary)
        .env("GITHUB_STEP_SUMMARY", &summary)
        .output()
        .unwrap();
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let text = fs::read_to_string(&summary).unwrap();
    assert!(text.starts_with("before\n\n**"), "{text}");
    assert!(text.contains("[player](<https://example.org/a%3Eb>)"));
    assert!(text.contains("](<https://example.org/a%3Eb#t="), "{text}");
}

#[test]
fn pages_stay_within_their_size() {
    // 60 windows, 24 nodes and their failures.
    let medium = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/medium.json");
    let folder = TempDir::new().unwrap();
    render(&medium, folder.path(), &["html", "svg", "md"]);
    let size = |path: PathBuf| fs::metadata(path).unwrap().len();
    let page = fs::read_to_string(folder.path().join("x.html")).unwrap();
    let fonts = page
        .split("<style>")
        .nth(1)
        .and_then(|s| s.split("</style>").next())
        .unwrap();
    assert!(fonts.starts_with("@font-face"));
    // Including 76,000 of script and CSS.
    assert!(
        page.len() - fonts.len() <= 131_500,
        "{}",
        page.len() - fonts.len()
    );
    assert!(page.len() <= 260_000, "{}", page.len());
    // The drawings of an animation, many of them paler as well, with a fifth more for dots; compressed, a tenth of that.
    assert!(
        size(folder.path().join("x.svg")) <= 460_000,
        "{}",
        size(folder.path().join("x.svg"))
    );
    assert!(size(folder.path().join("x.md")) <= 256 << 10);
}
