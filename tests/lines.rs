//! Tests of lines between boxes: one per pair, with the names of its topics; changing elements are not collapsed.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use serde_json::Value;

/// The elements of class `class` in a picture: attributes, and the words inside.
type Elements = Vec<(BTreeMap<String, String>, Vec<String>)>;

/// The README's animation as a picture per window, and its mission as JSON.
fn film() -> (Value, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    let done = Command::new(env!("CARGO_BIN_EXE_bagreel"))
        .args(["render", "examples/warehouse.bag", "--for", "readme"])
        .args(["--mode", "nodes", "--period", "10"])
        .arg("-o")
        .arg(out("{n}.svg"))
        .arg("-o")
        .arg(out("mission.json"))
        .output()
        .unwrap();
    assert!(done.status.success(), "{done:?}");
    let mission = std::fs::read_to_string(out("mission.json")).unwrap();
    let mission: Value = serde_json::from_str(&mission).unwrap();
    let windows = 0..mission["windows"].as_array().unwrap().len();
    let pictures = windows.map(|n| std::fs::read_to_string(out(&format!("{n:02}.svg"))).unwrap());
    (mission, pictures.collect())
}

/// The groups of a picture whose first class word is this one.
pub(crate) fn groups(picture: &str, class: &str) -> Elements {
    let document = roxmltree::Document::parse(picture).unwrap();
    let is_one = |node: &roxmltree::Node<'_, '_>| {
        node.attribute("class")
            .unwrap_or_default()
            .split(' ')
            .next()
            == Some(class)
    };
    let element = |node: roxmltree::Node<'_, '_>| {
        let attributes = node.attributes();
        let attributes = attributes.map(|a| (a.name().to_owned(), a.value().to_owned()));
        let texts = node.descendants().filter(|n| n.has_tag_name("text"));
        let words = texts.map(|text| {
            text.descendants()
                .filter_map(|n| n.text())
                .take(1)
                .collect()
        });
        (attributes.collect(), words.collect())
    };
    document.descendants().filter(is_one).map(element).collect()
}

#[test]
fn two_boxes_share_one_line_that_names_its_topics() {
    let (_, pictures) = film();
    let mut lines = 0;
    for picture in &pictures {
        let (mut pairs, mut nameless) = (BTreeSet::new(), BTreeSet::new());
        for (edge, words) in groups(picture, "edge") {
            let mut ends = [&edge["data-from"], &edge["data-to"]];
            ends.sort();
            if !edge["id"].ends_with("..over") {
                assert!(
                    pairs.insert(ends.map(String::clone)),
                    "{ends:?} have two lines"
                );
                lines += 1;
                nameless.insert((edge["data-from"].clone(), edge["data-topics"].clone()));
                continue;
            }
            let topics: Vec<&str> = edge["data-topics"].split(' ').collect();
            let last = |topic: &&str| {
                let parts = topic.split('/').filter(|part| !part.is_empty());
                parts.map(str::to_owned).collect::<Vec<_>>()
            };
            let parts: Vec<String> = topics.iter().flat_map(last).collect();
            let is_named = words
                .iter()
                .any(|text| parts.iter().any(|part| text.contains(part.as_str())));
            assert!(is_named, "{words:?} name none of {topics:?}");
            assert!(words.len() <= 6, "{words:?}");
            assert!(
                !words.iter().any(|text| text.contains("topic")),
                "{words:?}"
            );
        }
        // The lines of a fork share theirs.
        for (edge, _) in groups(picture, "edge") {
            if edge["id"].ends_with("..over") {
                nameless.remove(&(edge["data-from"].clone(), edge["data-topics"].clone()));
            }
        }
        assert!(nameless.is_empty(), "lines without words: {nameless:?}");
    }
    assert!(lines > 300, "{lines}");
}

#[test]
fn hubs_have_no_lines_and_nodes_without_lines_are_text() {
    let (_, pictures) = film();
    for picture in &pictures {
        for (edge, _) in groups(picture, "edge")
            .iter()
            .filter(|(e, _)| e.contains_key("data-topics"))
        {
            for name in edge["data-topics"].split(' ') {
                assert!(
                    !["/tf", "/tf_static", "/diagnostics", "/bond"].contains(&name),
                    "{name}"
                );
            }
        }
        let also = groups(picture, "also");
        let names: Vec<&str> = also
            .iter()
            .flat_map(|(a, _)| a["data-names"].split(' '))
            .collect();
        let boxes = groups(picture, "node");
        let boxes: Vec<&str> = boxes.iter().map(|(a, _)| a["data-name"].as_str()).collect();
        assert!(names.contains(&"/robot1/camera_tf"), "{names:?}");
        assert!(names.iter().all(|name| !boxes.contains(name)));
        let words: Vec<&String> = also.iter().flat_map(|(_, words)| words).collect();
        assert!(
            words
                .iter()
                .any(|word| word.starts_with("lifecycle_manager")),
            "{words:?}"
        );
    }
}

#[test]
fn changing_elements_are_not_collapsed() {
    let (mission, pictures) = film();
    let mut drawn = BTreeSet::new();
    for picture in &pictures {
        let boxes = groups(picture, "node");
        assert!(
            boxes.iter().all(|(b, _)| !b.contains_key("data-members")),
            "a fold"
        );
        drawn.extend(boxes.iter().map(|(b, _)| b["data-name"].clone()));
        let words = groups(picture, "also");
        drawn.extend(
            words
                .iter()
                .flat_map(|(a, _)| a["data-names"].split(' ').map(str::to_owned)),
        );
    }
    let windows = mission["windows"].as_array().unwrap().iter();
    let changes = windows.flat_map(|window| window["changes"].as_array().unwrap());
    let nodes = changes
        .filter(|change| change["what"] == "node")
        .filter_map(|c| c["name"].as_str());
    // Recorders are hidden, and the runs of a node have one box.
    let nodes = nodes.filter(|name| !name.contains("record_") && !name.contains("object_detector"));
    let nodes: BTreeSet<&str> = nodes.collect();
    assert!(nodes.len() > 15, "{nodes:?}");
    assert!(
        nodes.iter().all(|name| drawn.contains(*name)),
        "{nodes:?} but {drawn:?}"
    );
}

#[test]
fn a_namespace_that_is_not_running_yet_is_marked() {
    let (_, pictures) = film();
    let title = |picture: &str| {
        let titles = groups(picture, "namespace-title");
        let robot2 = titles
            .into_iter()
            .find(|(a, _)| a["data-name"] == "/robot2");
        robot2.unwrap().1.join(" ")
    };
    assert_eq!(title(&pictures[3]), "/robot2 not on yet");
    assert_eq!(title(&pictures[20]), "/robot2");
}
