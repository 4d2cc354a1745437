//! Tests of graphs from files besides the bag and of outputs made from them: services, starved subscribers,
//! `NoDL`, bundles.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::support::cdr::Cdr;
use crate::support::{ORIGIN, Recording, mcap, windows};

const SECOND: i64 = 1_000_000_000;

/// Runs the command in a folder; returns its exit code, its results and its messages.
fn bagreel(folder: &Path, args: &str) -> (Option<i32>, String, String) {
    let mut run = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    let done = run
        .current_dir(folder)
        .args(args.split(' '))
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (done.status.code(), text(&done.stdout), text(&done.stderr))
}

/// Runs a command that must succeed; returns its results.
fn done(folder: &Path, args: &str) -> String {
    let (code, results, said) = bagreel(folder, args);
    assert_eq!(code, Some(0), "{args}: {said}");
    results
}

/// A folder with a recording.
fn folder(bag: &Recording, options: &mcap::Options) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("r.mcap"), mcap::write(bag, options)).unwrap();
    folder
}

/// Ten seconds of a lidar whose publisher is named.
fn lidar() -> Recording {
    let mut bag = Recording::default();
    let scan = bag.publisher("/lidar", "/scan", "sensor_msgs/msg/LaserScan");
    bag.send(scan, (0, 10_000), 100, &Cdr::default().u32(1).done());
    bag
}

/// ROS 2, with the names of publishers.
fn ros2() -> mcap::Options {
    mcap::Options {
        profile: "ros2",
        publisher_key: Some("node"),
        ..mcap::Options::default()
    }
}

#[test]
fn services_and_actions_of_a_file_are_drawn_between_nodes_and_hidden_on_request() {
    let folder = folder(&lidar(), &ros2());
    let folder = folder.path();
    let yaml = "nodes:\n  /planner: {services: [/plan], actions: [/go], subscribes: [/scan]}\n\
                \x20 /ui: {clients: [/plan], action_clients: [/go]}\n";
    fs::write(folder.join("t.yaml"), yaml).unwrap();
    let draw = |with: &str| {
        done(
            folder,
            &format!(
                "render r.mcap --topology t.yaml -p all --size 1280x720 -o - --format svg {with}"
            ),
        )
    };
    let all = draw("--mode all");
    assert!(all.contains("class=\"topic service"), "no hexagon: {all}");
    assert!(all.contains(">service</text>"), "no legend: {all}");
    let nodes = draw("--mode nodes");
    assert!(
        nodes.contains("edge bundle service") || nodes.contains("edge bundle"),
        "{nodes}"
    );
    assert!(nodes.contains("plan()"), "{nodes}");
    let hidden = draw("--mode nodes --hide services");
    assert!(
        !hidden.contains("plan()") && hidden.contains("/go"),
        "{hidden}"
    );
    let dot = done(
        folder,
        "render r.mcap --topology t.yaml -p all -o - --format dot",
    );
    assert!(dot.contains("label=\"/plan\", shape=box"), "{dot}");
    // Recorders leave services out, so their absence in the bag is not reported.
    let (_, _, said) = bagreel(folder, "info r.mcap --topology t.yaml -v");
    assert!(!said.contains("/plan"), "{said}");
}

/// The end of a topic in `rosgraph_msgs`, with its reliability.
fn end(cdr: Cdr, topic: &str, kind: &str, reliability: u8) -> Cdr {
    let hash = (0..32).fold(cdr.text(topic).text(kind).u8(1), |cdr, _| cdr.u8(0));
    let zero = (0..4).fold(hash.u32(10), |cdr, _| cdr.u32(0));
    zero.u8(1).u8(reliability).u8(2).u8(1).u32(0).u32(0)
}

/// A node of `rosgraph_msgs` with one parameter, at most one publisher and one subscription.
fn node(cdr: Cdr, name: &str, sends: Option<&str>, hears: Option<(&str, u8)>) -> Cdr {
    let cdr = cdr
        .text(name)
        .u32(1)
        .text("use_sim_time")
        .u8(1)
        .text("")
        .text("")
        .u8(0)
        .u8(0);
    let cdr = cdr
        .u32(0)
        .u32(0)
        .u32(1)
        .u8(1)
        .u8(1)
        .u64(0)
        .f64(0.0)
        .text("");
    let cdr = (0..5).fold(cdr, |cdr, _| cdr.u32(0));
    let kind = "sensor_msgs/msg/LaserScan";
    let cdr = match sends {
        Some(topic) => end(cdr.u32(1), topic, kind, 2),
        None => cdr.u32(0),
    };
    let cdr = match hears {
        Some((topic, reliability)) => end(cdr.u32(1), topic, kind, reliability),
        None => cdr.u32(0),
    };
    (0..4).fold(cdr, |cdr, _| cdr.u32(0))
}

/// A graph in which `/slam` requests more than `/lidar` offers, with bytes after its end.
fn graph(spare: usize) -> Vec<u8> {
    let cdr = node(Cdr::default().u32(3), "/lidar", Some("/scan"), None);
    let cdr = node(cdr, "/slam", None, Some(("/scan", 1)));
    let mut graph = node(cdr, "/viewer", None, Some(("/scan", 2))).done();
    graph.extend(vec![0xAB; spare]);
    graph
}

/// The recording of such graphs.
fn graphs(spare: usize) -> Recording {
    let mut bag = lidar();
    let graphs = bag.publisher("", "/rosgraph", "rosgraph_msgs/msg/Graph");
    for second in [1, 5] {
        bag.messages
            .push((graphs, ORIGIN + second * SECOND, graph(spare)));
    }
    bag.messages.sort_by_key(|m| m.1);
    bag
}

#[test]
fn a_starved_subscription_ends_in_a_bar_and_a_graph_has_qualities_and_parameters() {
    // Some serializers append unused bytes.
    for spare in [0, 32] {
        let folder = folder(&graphs(spare), &ros2());
        let folder = folder.path();
        let svg = done(
            folder,
            "render r.mcap --mode all -p all --size 1280x720 -o - --format svg",
        );
        let starved: Vec<&str> = svg.split("<g ").filter(|g| g.contains("starved")).collect();
        assert!(
            !starved.is_empty() && starved.iter().all(|g| g.contains("/slam")),
            "{starved:?}"
        );
        assert!(
            svg.contains("gets nothing (quality of service)"),
            "no legend: {svg}"
        );
        let page = done(folder, "render r.mcap -p all -o - --format html");
        let others = page.matches("<path class=\"l\"").count();
        assert!(others == 1 && page.contains(" starved"), "{others}");
        assert!(page.contains("gets nothing (quality of service)</span>"));
        let why = done(folder, "info r.mcap --why /slam /scan");
        assert!(why.contains("(reliable volatile depth 10)"), "{why}");
        let info: Value = serde_json::from_str(&done(folder, "info r.mcap --format json")).unwrap();
        let topics = info["topics"].as_array().unwrap();
        let scan = topics
            .iter()
            .find(|topic| topic["name"] == "/scan")
            .unwrap();
        assert_eq!(scan["qos"], "best_effort volatile depth 10");
    }
}

#[test]
fn a_recorded_graph_is_a_topology_for_another_bag() {
    let folder = folder(&graphs(0), &ros2());
    let folder = folder.path();
    fs::rename(folder.join("r.mcap"), folder.join("graph.mcap")).unwrap();
    fs::write(folder.join("r.mcap"), mcap::write(&lidar(), &ros2())).unwrap();
    let why = done(
        folder,
        "info r.mcap --topology graph.mcap --why /slam /scan",
    );
    assert!(why.contains("graph.mcap"), "{why}");
    let (code, _, said) = bagreel(folder, "info graph.mcap --topology r.mcap");
    assert!(
        code == Some(1) && said.contains("it contains no recorded graph"),
        "{code:?} {said}"
    );
}

#[test]
fn introspection_names_the_client_and_the_server_if_the_recorder_names_publishers() {
    let mut bag = lidar();
    let event = |kind: u8| {
        let info = (0..16).fold(Cdr::default().u8(kind).time(ORIGIN), Cdr::u8);
        info.u64(1).u32(0).u32(0).done()
    };
    for (node, kind) in [("/ui", 0), ("/planner", 1), ("/planner", 2), ("/ui", 3)] {
        let place = bag.publisher(node, "/plan/_service_event", "nav_msgs/srv/GetPlan_Event");
        bag.messages.push((place, ORIGIN + SECOND, event(kind)));
    }
    bag.messages.sort_by_key(|m| m.1);
    let folder = folder(&bag, &ros2());
    let why = done(folder.path(), "info r.mcap --why /plan /ui");
    assert!(why.contains("/ui publishes /plan"), "{why}");
    let why = done(folder.path(), "info r.mcap --why /plan /planner");
    assert!(why.contains("/planner subscribes to /plan"), "{why}");

    // Otherwise the service is known, and a number for each client.
    bag.publishers.iter_mut().for_each(|one| one.node.clear());
    let folder = self::folder(&bag, &ros2());
    let info = done(folder.path(), "info r.mcap");
    let service = info.lines().find(|line| line.contains(" /plan "));
    assert!(
        service.is_some_and(|line| line.contains("nav_msgs/srv/GetPlan ")),
        "{info}"
    );
    let why = done(folder.path(), "info r.mcap --why /plan");
    let client = "/plan: request sent, client 000102030405060708090a0b0c0d0e0f";
    assert!(why.contains(client), "{why}");
}

#[test]
fn metrics_of_a_subscriber_are_those_of_its_only_topic() {
    let mut bag = graphs(0);
    let place = bag.publisher("", "/statistics", "statistics_msgs/msg/MetricsMessage");
    for (metric, numbers) in [
        ("message_age", [(1, 70.0), (5, 10.0)]),
        ("message_period", [(4, 20.0), (5, 10.0)]),
    ] {
        for second in 1..10 {
            let end = ORIGIN + second * SECOND;
            let cdr = Cdr::default().text("slam").text(metric).text("ms");
            let cdr = cdr.time(end - SECOND).time(end).u32(2);
            let cdr = numbers
                .iter()
                .fold(cdr, |cdr, (kind, n)| cdr.u8(*kind).f64(*n));
            bag.messages.push((place, end, cdr.done()));
        }
    }
    bag.messages.sort_by_key(|m| m.1);
    let folder = folder(&bag, &ros2());
    let json = done(folder.path(), "render r.mcap -p all -o - --format json");
    let mission: Value = serde_json::from_str(&json).unwrap();
    let windows = windows::windows(&mission);
    let edges = windows[0]["subscribes"].as_array().unwrap();
    let slam = edges
        .iter()
        .find(|e| e["node"] == "/slam" && e["topic"] == "/scan")
        .unwrap();
    let near = |key: &str, truth: f64| (slam[key].as_f64().unwrap() - truth).abs() < truth * 0.01;
    assert!(near("age_s", 0.07) && near("jitter_s", 0.02), "{slam}");
}

#[test]
fn rolling_statistics_count_each_message_once() {
    let mut bag = graphs(0);
    let kind = "rosgraph_monitor_msgs/msg/TopicStatistics";
    let place = bag.publisher("", "/topic_statistics", kind);
    // The lidar sends 10 messages per second, of which 8 arrive, 70 ms old; means are of the last 50 at most.
    for second in 1..=10_u32 {
        let one = |cdr: Cdr, kind, node, many: u32, mean: u32| {
            let cdr = cdr.u8(kind).text(node).text("/scan").u32(many.min(50));
            let cdr = cdr.u32(0).u32(mean * 1_000_000);
            (0..4).fold(cdr, |cdr, _| cdr.u32(0))
        };
        let cdr = Cdr::default().time(ORIGIN).u32(3);
        let cdr = one(cdr, 0, "/lidar", 10 * second, 100);
        let cdr = one(cdr, 1, "/slam", 8 * second, 125);
        let cdr = one(cdr, 2, "/slam", 8 * second, 70);
        let at = ORIGIN + i64::from(second) * SECOND - 1;
        bag.messages.push((place, at, cdr.done()));
    }
    bag.messages.sort_by_key(|m| m.1);
    let folder = folder(&bag, &ros2());
    let json = done(folder.path(), "render r.mcap -p 5 -o - --format json");
    let mission: Value = serde_json::from_str(&json).unwrap();
    for window in windows::windows(&mission) {
        let edges = window["subscribes"].as_array().unwrap();
        let slam = edges.iter().find(|e| e["node"] == "/slam").unwrap();
        let near =
            |key: &str, truth: f64| (slam[key].as_f64().unwrap() - truth).abs() <= truth * 0.01;
        assert!(
            near("count", 40.0) && near("hz", 8.0) && near("age_s", 0.07),
            "{slam}"
        );
    }
}

#[test]
fn skew_is_the_coefficient_of_variation_of_the_rate() {
    let mut bag = Recording::default();
    let even = bag.publisher("/a", "/even", "std_msgs/msg/Empty");
    let uneven = bag.publisher("/a", "/uneven", "std_msgs/msg/Empty");
    bag.send(even, (0, 20_000), 100, &Cdr::default().done());
    // 15 messages in each of the first ten seconds, then 5.
    for (from, step) in [(0, 66), (10_000, 200)] {
        let many = if step == 66 { 150 } else { 50 };
        for n in 0..many {
            bag.messages.push((
                uneven,
                ORIGIN + (from + n * step) * 1_000_000,
                Cdr::default().done(),
            ));
        }
    }
    bag.messages.sort_by_key(|m| m.1);
    let folder = folder(&bag, &ros2());
    done(folder.path(), "render r.mcap -p 5 -o x.csv");
    let table = fs::read_to_string(folder.path().join("x.topics.csv")).unwrap();
    let mut rows = table
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let heads = rows.next().unwrap();
    let at = |name: &str| heads.iter().position(|head| *head == name).unwrap();
    let skews: BTreeMap<&str, f64> = rows
        .map(|row| (row[at("topic")], row[at("skew")].parse().unwrap()))
        .collect();
    assert!(skews["/even"] < 0.01, "{skews:?}");
    // From 15.2, 14.8 and 5 messages per second in the whole windows.
    assert!((skews["/uneven"] - 0.4043).abs() < 0.001, "{skews:?}");
}

#[test]
fn a_nodl_document_is_a_topology() {
    let folder = folder(&graphs(0), &ros2());
    let folder = folder.path();
    let document = "nodl_version: 2
service_clients:
  - {name: /reset, type: std_srvs/srv/Empty}
";
    fs::write(folder.join("ns.ui.nodl.yaml"), document).unwrap();
    let why = done(
        folder,
        "info r.mcap --topology ns.ui.nodl.yaml --why /ns/ui /reset",
    );
    assert!(why.contains("ns.ui.nodl.yaml"), "{why}");
}

#[test]
fn one_query_counts_bags_without_nodes_and_with_nodes_missing() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let write = |name: &str, bag: &Recording, options: &mcap::Options| {
        fs::write(folder.join(name), mcap::write(bag, options)).unwrap();
    };
    let unnamed = mcap::Options {
        publisher_key: None,
        ..ros2()
    };
    fs::create_dir(folder.join("bags")).unwrap();
    write("bags/whole.mcap", &lidar(), &ros2());
    // The recorder counts publishers that it does not name: alone, and beside a node that logs.
    let mut bag = lidar();
    "- reliability: reliable\n  durability: volatile\n  history: keep_last\n  depth: 10\n"
        .clone_into(&mut bag.publishers[0].qos);
    write("bags/without.mcap", &bag, &unnamed);
    write("bags/without_2.mcap", &bag, &unnamed);
    let rosout = bag.publisher("", "/rosout", "rcl_interfaces/msg/Log");
    let record = Cdr::default().time(ORIGIN).u8(20).text("planner");
    let record = record.text("ready").text("planner.cpp").text("run").u32(1);
    bag.messages.insert(0, (rosout, ORIGIN, record.done()));
    write("bags/missing.mcap", &bag, &unnamed);
    bag.publishers[0].qos.clear();
    write("bags/missing_uncounted.mcap", &bag, &unnamed);
    fs::write(folder.join("bags/broken.mcap"), b"\x89MCAP0\r\nbroken").unwrap();
    let (_, survey, _) = bagreel(folder, "info bags --format csv");
    let mut rows = survey.lines().map(|row| row.split(','));
    let heads = rows.next().unwrap().collect::<Vec<_>>();
    let db = rusqlite::Connection::open_in_memory().unwrap();
    db.execute(
        &format!("CREATE TABLE \"survey.csv\" ({})", heads.join(" NUMERIC, ")),
        [],
    )
    .unwrap();
    for row in rows {
        // An empty cell is `NULL`.
        let cells = row.map(|cell| Some(cell).filter(|cell| !cell.is_empty()));
        let places = vec!["?"; heads.len()].join(", ");
        db.execute(
            &format!("INSERT INTO \"survey.csv\" VALUES ({places})"),
            rusqlite::params_from_iter(cells.take(heads.len())),
        )
        .unwrap();
    }
    let docs = include_str!("../docs/src/fleets.md");
    let query = docs
        .split("```sql\n")
        .nth(1)
        .unwrap()
        .split("```")
        .next()
        .unwrap();
    let counts = db.query_row(query, [], |row| Ok((row.get(0)?, row.get(1)?)));
    assert_eq!(counts, Ok((2, 2)), "{survey}");
}
