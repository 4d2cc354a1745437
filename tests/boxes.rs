//! Tests that boxes of a window agree with its JSON.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// The mission as JSON, and a picture of each of its windows.
fn rendered(bag: &str, arguments: &[&str]) -> (Value, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.arg("render").arg(bag).args(["--view", "graph"]);
    let outputs = [out("mission.json"), out("{n}.svg")];
    let done = command
        .args(arguments)
        .args(outputs.iter().flat_map(|path| [Path::new("-o"), path]))
        .output()
        .unwrap();
    assert!(done.status.success(), "{done:?}");
    let mission = std::fs::read_to_string(out("mission.json")).unwrap();
    let mission: Value = serde_json::from_str(&mission).unwrap();
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

/// The boxes of a picture: their class and attributes by name.
fn boxes(picture: &str) -> impl Iterator<Item = BTreeMap<String, String>> + '_ {
    let document = roxmltree::Document::parse(picture).unwrap();
    let is_box = |node: &roxmltree::Node<'_, '_>| {
        let class = node.attribute("class").unwrap_or_default();
        node.has_attribute("data-state")
            && class
                .split(' ')
                .any(|word| word == "node" || word == "topic")
    };
    let boxes = document.descendants().filter(is_box);
    let attributes = |node: roxmltree::Node<'_, '_>| {
        let all = node.attributes();
        all.map(|a| (a.name().to_owned(), a.value().to_owned()))
            .collect()
    };
    boxes.map(attributes).collect::<Vec<_>>().into_iter()
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
