//! Tests of check reports: hostile names are escaped in all of them, and none exceeds its reader's limit.

use std::fs;

use super::{HEALTHY, bag, bagreel, recording, run, said};

/// Hostile names.
const HOSTILE: [&str; 8] = [
    "/]]>&amp;<![CDATA[x",
    "/@team",
    "/a\n::error file=x::forged",
    "/##[error]forged",
    "/</testcase><failure>",
    "/a|b`c`<img src=x>",
    "/-->\"];evil[\"",
    "/\u{1b}[2J\u{202e}%0A::warning::x",
];

#[test]
fn hostile_names_are_inert_in_every_format() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let mut robot = recording(HEALTHY, 0);
    for name in HOSTILE {
        let own = robot.publisher(name, &format!("{name}/topic"), "std_msgs/String");
        robot.send(own, (1_000, 170_000), 1_000, b"\x01\0\0\0a");
    }
    bag(here, "run.bag", &robot);
    let expect = "schema: bagreel.expect/1\npolicy: {unexpected_nodes: error, unexpected_topics: warn}\nnodes:\n  /lidar: {}\n";
    fs::write(here.join("g.yaml"), expect).unwrap();
    let print = |format: &str| {
        said(&bagreel(
            here,
            &["check", "run.bag", "--expect", "g.yaml", "--format", format],
        ))
    };
    let visible = |text: &str| {
        text.chars()
            .all(|c| c == '\n' || !(c.is_control() || c == '\u{202e}'))
    };
    for format in [
        "text", "json", "markdown", "junit", "sarif", "gitlab", "github",
    ] {
        let text = print(format);
        assert!(text.contains("team") && visible(&text), "{format}: {text}");
    }
    let github = print("github");
    let commands: Vec<&str> = github
        .lines()
        .filter(|l| l.trim_start().starts_with("::"))
        .collect();
    assert!(
        commands.iter().all(|l| l.contains(" file=g.yaml,line=")),
        "{github}"
    );
    assert_eq!(
        commands
            .iter()
            .filter(|l| l.starts_with("::error "))
            .count(),
        10
    );
    assert!(
        !github.contains("##[") && !print("text").contains("##["),
        "{github}"
    );
    let markdown = print("markdown");
    let outside: Vec<&str> = markdown.split("```").step_by(2).collect();
    assert!(!outside.concat().contains("@team"), "{markdown}");
    assert!(
        !markdown.contains("<img") && !markdown.contains("</testcase"),
        "{markdown}"
    );
    assert!(!markdown.contains("evil[\""), "{markdown}");
    let junit = print("junit");
    let parsed = roxmltree::Document::parse(&junit).unwrap();
    assert_eq!(
        parsed
            .descendants()
            .filter(|n| n.has_tag_name("testcase"))
            .count(),
        3
    );
    assert_eq!(
        parsed
            .descendants()
            .filter(|n| n.has_tag_name("failure"))
            .count(),
        1
    );
    // A node and a topic may have one name; services keep one case of each.
    fs::write(
        here.join("both.yaml"),
        "schema: bagreel.expect/1\nnodes:\n  /x: {}\ntopics:\n  /x: {}\n",
    )
    .unwrap();
    let both = ["check", "run.bag", "--expect", "./both.yaml", "--format"];
    let junit = said(&bagreel(here, &[&both[..], &["junit"]].concat()));
    assert!(
        junit.contains("classname=\"both.yaml\" name=\"node /x\""),
        "{junit}"
    );
    assert!(
        junit.contains("classname=\"both.yaml\" name=\"topic /x\""),
        "{junit}"
    );
    let gitlab = said(&bagreel(here, &[&both[..], &["gitlab"]].concat()));
    assert!(gitlab.contains("\"path\": \"both.yaml\""), "{gitlab}");
    for format in ["json", "sarif", "gitlab"] {
        serde_json::from_str::<serde_json::Value>(&print(format)).unwrap();
    }
    // An expectation with such names can be read back and passes.
    assert_eq!(run(here, &["baseline", "run.bag", "-o", "own.yaml"]).0, 0);
    let (code, said) = run(here, &["check", "run.bag", "--expect", "own.yaml"]);
    assert_eq!((code, said.contains("no findings")), (0, true), "{said}");
}

#[test]
fn every_result_has_a_line_and_annotations_are_few() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "run.bag", &recording(HEALTHY, 0));
    let lines: Vec<String> = (0..30).map(|n| format!("  /gone_{n}: {{}}\n")).collect();
    let lines = lines.concat();
    fs::write(
        here.join("g.yaml"),
        format!("schema: bagreel.expect/1\nnodes:\n{lines}"),
    )
    .unwrap();
    let print = |format: &str| {
        said(&bagreel(
            here,
            &["check", "run.bag", "--expect", "g.yaml", "--format", format],
        ))
    };
    let github = print("github");
    let errors: Vec<&str> = github
        .lines()
        .filter(|l| l.starts_with("::error "))
        .collect();
    assert_eq!(errors.len(), 10);
    assert!(
        errors[9].contains("and 20 more in the log"),
        "{}",
        errors[9]
    );
    assert!(github.contains("error[node-missing]: /gone_29"));
    let sarif: serde_json::Value = serde_json::from_str(&print("sarif")).unwrap();
    let results = sarif["runs"][0]["results"].as_array().unwrap();
    assert_eq!(results.len(), 30);
    let line = |r: &serde_json::Value| {
        r["locations"][0]["physicalLocation"]["region"]["startLine"].as_u64()
    };
    assert!(results.iter().zip(3..).all(|(r, at)| line(r) == Some(at)));
    let gitlab: serde_json::Value = serde_json::from_str(&print("gitlab")).unwrap();
    let prints = gitlab
        .as_array()
        .unwrap()
        .iter()
        .map(|i| i["fingerprint"].as_str().unwrap());
    let prints: std::collections::BTreeSet<&str> = prints.collect();
    assert!(prints.len() == 30 && prints.iter().all(|p| p.len() == 12));
}

#[test]
fn no_report_exceeds_its_readers_limit() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let mut robot = recording(HEALTHY, 0);
    for n in 0..40 {
        let own = robot.publisher(&format!("/new_{n}"), "/odom", "nav_msgs/Odometry");
        robot.send(own, (1_000, 170_000), 60_000, &[2; 48]);
    }
    bag(here, "run.bag", &robot);
    let gone: Vec<String> = (0..5100)
        .map(|n| format!("  \"/gone_{n}_#[x|`@\": {{}}\n"))
        .collect();
    let gone = gone.concat();
    let by: Vec<String> = (0..200)
        .map(|n| format!("\"/lost_{n}_{}\"", "é#".repeat(40)))
        .collect();
    let text = format!(
        "schema: bagreel.expect/1\npolicy: {{unexpected_nodes: warn}}\nnodes:\n{gone}topics:\n  /scan: {{by: [{}]}}\n",
        by.join(", ")
    );
    fs::write(here.join("g.yaml"), text).unwrap();
    let outputs = ["-o", "c.md", "-o", "c.sarif", "-o", "c.xml", "-o", "c.json"];
    let args = [
        "check", "run.bag", "--expect", "g.yaml", "--format", "github",
    ];
    let output = bagreel(here, &[&args[..], &outputs].concat());
    let github = said(&output);
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(here.join("c.json")).unwrap()).unwrap();
    let count = |key: &str| json[key].as_u64().unwrap();
    assert!(count("errors") > 5300 && count("warnings") > 40 && count("unknown") == 0);
    // GitHub shows 10 of each kind per step and silently drops the rest.
    for (command, key) in [("::error ", "errors"), ("::warning ", "warnings")] {
        let own: Vec<&str> = github.lines().filter(|l| l.starts_with(command)).collect();
        assert_eq!(own.len(), 10, "{command}");
        let rest = format!("and {} more in the log", count(key) - 10);
        assert!(own[9].contains(&rest), "{}", own[9]);
    }
    let read = |name: &str| fs::read_to_string(here.join(name)).unwrap();
    let markdown = read("c.md");
    assert!(
        (100_000..256 << 10).contains(&markdown.len()),
        "{}",
        markdown.len()
    );
    let seen = markdown.split("<details>").next().unwrap();
    assert_eq!(
        seen.lines().filter(|l| l.starts_with("| ❌")).count(),
        12,
        "{seen}"
    );
    assert!(markdown.contains(" left out."), "{seen}");
    let chart = markdown.split("```mermaid\n").nth(1).unwrap();
    let chart = chart.split("```").next().unwrap();
    let edges = chart.lines().filter(|l| l.contains("->")).count();
    assert!(
        edges <= 60 && chart.len() <= 50_000,
        "{edges} edges, {} bytes",
        chart.len()
    );
    assert!(
        chart.lines().filter(|l| l.contains("([\"")).count() > 50,
        "{chart}"
    );
    let sarif: serde_json::Value = serde_json::from_str(&read("c.sarif")).unwrap();
    let run = &sarif["runs"][0];
    assert_eq!(run["results"].as_array().unwrap().len(), 5000);
    let note = &run["invocations"][0]["toolExecutionNotifications"][0]["message"]["text"];
    let rest = count("errors") + count("warnings") - 5000;
    assert_eq!(note, &format!("{rest} more findings left out"));
    roxmltree::Document::parse(&read("c.xml")).unwrap();
}

#[test]
fn reports_use_paths_in_the_repository() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    bag(here, "run.bag", &recording(HEALTHY, 0));
    let folder = here.join("robot/ci");
    fs::create_dir_all(&folder).unwrap();
    let text = "schema: bagreel.expect/1\nnodes:\n  /gone: {}\n";
    fs::write(folder.join("graph.yaml"), text).unwrap();
    let print = |format: &str, checkout: Option<(&str, &std::path::Path)>| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_bagreel"));
        for name in ["GITHUB_STEP_SUMMARY", "GITHUB_WORKSPACE", "CI_PROJECT_DIR"] {
            command.env_remove(name);
        }
        command.envs(checkout).current_dir(&folder);
        let bag = here.join("run.bag");
        command
            .arg("check")
            .arg(bag)
            .args(["--expect", "graph.yaml"]);
        said(&command.args(["--format", format]).output().unwrap())
    };
    let forms = [
        ("github", "file="),
        ("gitlab", "\"path\": \""),
        ("sarif", "\"uri\": \""),
        ("junit", "classname=\""),
        ("markdown", "against `"),
    ];
    for (format, before) in forms {
        let plain = print(format, None);
        assert!(plain.contains(&format!("{before}graph.yaml")), "{plain}");
        for variable in ["GITHUB_WORKSPACE", "CI_PROJECT_DIR"] {
            let text = print(format, Some((variable, here)));
            let path = format!("{before}robot/ci/graph.yaml");
            assert!(text.contains(&path), "{text}");
            let elsewhere = print(format, Some((variable, &here.join("other"))));
            assert_eq!(elsewhere, plain);
        }
    }
    fs::create_dir(here.join("robot/.git")).unwrap();
    for (format, before) in forms {
        let text = print(format, None);
        let path = format!("{before}ci/graph.yaml");
        assert!(text.contains(&path), "{text}");
    }
    // Two checks of one recording leave two comments.
    fs::write(folder.join("rules.yaml"), text).unwrap();
    let mark = |file: &str| {
        let bag = here.join("run.bag");
        let args = ["check", bag.to_str().unwrap(), "--expect", file];
        let text = said(&bagreel(
            &folder,
            &[&args[..], &["--format", "markdown"]].concat(),
        ));
        text.lines().last().unwrap().to_owned()
    };
    assert_eq!(mark("graph.yaml"), "<!-- bagreel:run:ci_graph -->");
    assert_eq!(mark("rules.yaml"), "<!-- bagreel:run:ci_rules -->");
}
