//! Tests that boxes and edges of a window agree with its JSON.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::lines::groups;
use crate::support::{shared, windows};

/// The mission as JSON, and a picture of each of its windows.
fn rendered(bag: impl AsRef<Path>, arguments: &[&str]) -> (Value, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.arg("render").arg(bag.as_ref());
    // Without a mode, unknown publishers would make it a timeline.
    if !arguments.contains(&"--mode") {
        command.args(["--mode", "all"]);
    }
    let outputs = [out("mission.json"), out("{n}.svg")];
    let done = command
        .args(arguments)
        .args(outputs.iter().flat_map(|path| [Path::new("-o"), path]))
        .output()
        .unwrap();
    assert!(done.status.success(), "{done:?}");
    let mission = std::fs::read_to_string(out("mission.json")).unwrap();
    let mut mission: Value = serde_json::from_str(&mission).unwrap();
    mission["windows"] = windows::windows(&mission).into();
    let files = std::fs::read_dir(folder.path()).unwrap();
    let mut files: Vec<_> = files.map(|file| file.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|end| end == "svg"));
    files.sort();
    let pictures = files
        .iter()
        .map(|path| std::fs::read_to_string(path).unwrap());
    let pictures: Vec<String> = pictures.collect();
    assert_eq!(pictures.len(), mission["windows"].as_array().unwrap().len());
    (mission, pictures)
}

/// An element of a picture: its class and attributes.
type Drawn = BTreeMap<String, String>;

/// The nodes, topics and edges of a picture; samples in its legend have no name.
fn elements(picture: &str) -> impl Iterator<Item = Drawn> {
    let kinds = ["node", "topic", "edge"].into_iter();
    let all = kinds.flat_map(|kind| groups(picture, kind));
    all.map(|(drawn, _)| drawn)
        .filter(|drawn| drawn.contains_key("data-name") || drawn.contains_key("data-from"))
}

/// The nodes and topics of a picture.
fn boxes(picture: &str) -> impl Iterator<Item = Drawn> {
    elements(picture).filter(|drawn| drawn.contains_key("data-state"))
}

fn rows<'a>(window: &'a Value, what: &str) -> impl Iterator<Item = &'a Value> {
    window[what].as_array().unwrap().iter()
}

#[test]
fn a_collapsed_box_counts_its_elements_in_the_window() {
    let folded = [
        "--period",
        "10",
        "--mode",
        "nodes",
        "--collapse",
        "/robot1",
        "--collapse",
        "/robot2",
    ];
    let (mission, pictures) = rendered("examples/warehouse.bag", &folded);
    let mut seen = 0;
    for (window, picture) in rows(&mission, "windows").zip(&pictures) {
        for folded in boxes(picture).filter(|b| b.contains_key("data-members")) {
            let below = format!("{}/", folded["data-name"]);
            let is_inside = |node: &&Value| {
                let name = node["name"].as_str().unwrap();
                name.starts_with(&below) && !name.contains("/record_")
            };
            let number = rows(window, "nodes").filter(is_inside).count();
            assert_eq!(folded["data-members"], number.to_string(), "{below}");
            assert!(number > 0);
            seen += 1;
        }
        let has = |name: &str| {
            rows(window, "nodes").any(|n| n["name"].as_str().unwrap().starts_with(name))
        };
        let is_drawn = |name: &str| boxes(picture).any(|b| b["data-name"] == name);
        assert!(has("/robot2/") || !is_drawn("/robot2"));
    }
    assert!(seen > 40);
}

#[test]
fn no_topic_is_active_before_its_first_message() {
    let (mission, pictures) = rendered(
        "examples/warehouse.bag",
        &["--fit", "none", "--period", "2"],
    );
    let mut silent = 0;
    for (window, picture) in rows(&mission, "windows").zip(&pictures) {
        let topics = rows(window, "topics").map(|t| (t["name"].as_str().unwrap(), t));
        let topics: BTreeMap<&str, &Value> = topics.collect();
        for topic in boxes(picture).filter(|b| b["class"].starts_with("topic")) {
            let Some(row) = topics.get(&*topic["data-name"]) else {
                continue;
            };
            let is_early = row["first_ns"].as_i64() >= window["end_ns"].as_i64();
            assert!(
                !is_early || topic["data-state"] != "active",
                "{topic:?} {row}"
            );
            silent += usize::from(is_early);
        }
    }
    assert!(silent > 0);
}

/// The graph of a window: its nodes with the name they are drawn with, its topics, and who publishes and subscribes.
struct Graph<'a> {
    drawn_as: BTreeMap<&'a str, &'a str>,
    topics: BTreeSet<&'a str>,
    edges: BTreeSet<(&'a str, &'a str, &'a str)>,
}

impl<'a> Graph<'a> {
    fn of(window: &'a Value) -> Self {
        let text = |row: &'a Value, key: &str| row[key].as_str().unwrap();
        let edges = |kind: &'static str| {
            rows(window, kind).map(move |row| (kind, text(row, "node"), text(row, "topic")))
        };
        let nodes = rows(window, "nodes");
        Self {
            drawn_as: nodes.map(|n| (text(n, "name"), text(n, "role"))).collect(),
            topics: rows(window, "topics").map(|t| text(t, "name")).collect(),
            edges: edges("publishes").chain(edges("subscribes")).collect(),
        }
    }

    /// Whether a box stands for a node: by its name, the name of its role, or that of a namespace around it.
    fn is_node(&self, drawn: &str, node: &str) -> bool {
        let below = |name: &str| {
            name.strip_prefix(drawn)
                .is_some_and(|rest| rest.starts_with('/'))
        };
        drawn == node || self.drawn_as.get(node) == Some(&drawn) || below(node)
    }

    /// Whether a box stands for a topic: by its name, or as the common box of the topics of an action.
    fn is_topic(drawn: &str, topic: &str) -> bool {
        let action = drawn.strip_suffix("action_topics");
        drawn == topic || action.is_some_and(|action| topic.starts_with(action))
    }

    fn has_edge(&self, kind: &str, node: &str, topic: &str) -> bool {
        self.edges.iter().any(|(of, end, sent)| {
            *of == kind && self.is_node(node, end) && Self::is_topic(topic, sent)
        })
    }

    fn has(&self, drawn: &Drawn) -> bool {
        let class: Vec<&str> = drawn["class"].split(' ').collect();
        match class[..] {
            ["node", ..] => self
                .drawn_as
                .keys()
                .any(|node| self.is_node(&drawn["data-name"], node)),
            ["topic", ..] => self
                .topics
                .iter()
                .any(|topic| Self::is_topic(&drawn["data-name"], topic)),
            ["edge", "publish", ..] => {
                self.has_edge("publishes", &drawn["data-from"], &drawn["data-to"])
            }
            ["edge", "subscribe", ..] => {
                self.has_edge("subscribes", &drawn["data-to"], &drawn["data-from"])
            }
            _ => {
                let (from, to) = (&drawn["data-from"], &drawn["data-to"]);
                drawn["data-topics"].split(' ').all(|topic| {
                    let is_sent = |node, other: &str| {
                        self.has_edge("publishes", node, topic)
                            && (self.has_edge("subscribes", other, topic) || other == topic)
                    };
                    let is_read = |node| from == topic && self.has_edge("subscribes", node, topic);
                    is_sent(from, to) || is_sent(to, from) || is_read(to)
                })
            }
        }
    }
}

#[test]
fn only_what_is_in_the_graph_of_a_window_is_drawn_in_it() {
    let examples = ["examples/warehouse.bag", "examples/courier.mcap"].map(|bag| Some(bag.into()));
    let others = [
        "bags/mission/mission.bag",
        "mini/nodelet.bag",
        "mini/mini_late.bag",
    ];
    let others = others.map(|bag| shared(&format!("data/{bag}")));
    let mut all = 0;
    for bag in examples.into_iter().chain(others).flatten() {
        for mode in [&["--mode", "all"][..], &["--fit", "none"], &[]] {
            let (mission, pictures) = rendered(&bag, &[&["--period", "10"], mode].concat());
            for (window, picture) in rows(&mission, "windows").zip(&pictures) {
                let graph = Graph::of(window);
                for drawn in elements(picture) {
                    let is_past = |word| ["removed", "away", "gone"].contains(&word);
                    if !drawn["class"].split(' ').any(is_past) {
                        assert!(
                            graph.has(&drawn),
                            "{bag:?} {mode:?} {}: {drawn:?}",
                            window["index"]
                        );
                        all += 1;
                    }
                }
            }
        }
    }
    assert!(all > 5_000, "{all}");
}
