//! Tests with a recorded mission: each of its reconfigurations breaks exactly its rule.

use std::fs;

use super::bagreel;
use crate::support::shared;

/// Each reconfiguration of the mission, the rule that it breaks, and when.
const MISSION: &str = "\
schema: bagreel.expect/1
nodes:
  /camera_driver: {}
  /controller: {}
  /probe: {}
  /camera_backup: {}
rules:
  - {id: localizer-starts, nodes: /localizer, within: 1s}
  - {id: planner-starts, nodes: /planner, within: 50s}
  - {id: controller-starts, nodes: /controller, within: 80s}
  - {id: backup-starts, nodes: /camera_backup, within: 100s}
  - {id: probe-starts, nodes: /probe, within: 160s}
  - {id: planner-restarts, nodes: /planner, restarts: ..0}
  - {id: probe-restarts, nodes: /probe, restarts: ..0}
  - {id: successor-starts, nodes: /controller_v2, within: 200s}
  - {id: joystick-starts, nodes: /joystick, within: 200s}
  - {id: localizer-restarts, nodes: /localizer, restarts: ..0}
  - {id: quiet-at-end, during: -30s.., changes: ..0}
  - {id: kept-takeover, topic: /image_small, by: [/camera_driver, /camera_backup]}
  - {id: kept-rate, topic: /scan_small, hz: 4..6}
  - {id: kept-restarts, nodes: /probe, restarts: ..1}
";

#[test]
fn each_reconfiguration_breaks_the_rule_written_for_it() {
    let Some(bag) = shared("data/bags/mission/mission.bag") else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("graph.yaml"), MISSION).unwrap();
    let args = [
        "check",
        bag.to_str().unwrap(),
        "--expect",
        "graph.yaml",
        "--format",
        "json",
    ];
    let output = bagreel(dir.path(), &args);
    assert_eq!(output.status.code(), Some(1));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let broken = |rule: &serde_json::Value| {
        let findings = rule["findings"].as_array()?;
        assert_eq!(findings.len(), 1, "{rule}");
        let title = rule["rule"].as_str().unwrap().split(':').next().unwrap();
        let (id, severity) = (&findings[0]["id"], &findings[0]["severity"]);
        assert_eq!(severity, "error", "{rule}");
        Some((title.to_owned(), id.as_str().unwrap().to_owned()))
    };
    let rules = report["rules"].as_array().unwrap();
    let found: Vec<_> = rules.iter().filter_map(broken).collect();
    let found: Vec<_> = found
        .iter()
        .map(|(a, b)| (a.as_str(), b.as_str()))
        .collect();
    let expected = [
        ("node /camera_driver", "node-gone"),
        ("node /controller", "node-gone"),
        ("node /probe", "node-gone"),
        ("node /camera_backup", "node-gone"),
        ("localizer-starts", "node-late"),
        ("planner-starts", "node-late"),
        ("controller-starts", "node-late"),
        ("backup-starts", "node-late"),
        ("probe-starts", "node-late"),
        ("planner-restarts", "node-restarted"),
        ("probe-restarts", "node-restarted"),
        ("successor-starts", "node-late"),
        ("joystick-starts", "node-late"),
        ("localizer-restarts", "node-restarted"),
        ("quiet-at-end", "too-many-changes"),
    ];
    assert_eq!(found, expected);
}

/// A rule for each of the mission's reconfigurations.
const STEPS: &str = "\
schema: bagreel.expect/1
nodes:
  /camera_backup: {optional: true}
  /camera_driver: {}
  /controller: {optional: true}
  /localizer: {optional: true}
  /planner: {optional: true}
  /probe: {optional: true}
rules:
  - {id: localizer-starts, nodes: /localizer, forbidden: true}
  - {id: planner-starts, nodes: /planner, forbidden: true}
  - {id: controller-starts, nodes: /controller, forbidden: true}
  - {id: backup-starts, nodes: /camera_backup, forbidden: true}
  - {id: probe-starts, nodes: /probe, forbidden: true}
  - {id: planner-restarts, nodes: /planner, restarts: ..0}
  - {id: probe-restarts, nodes: /probe, restarts: ..0}
  - {id: successor-starts, nodes: /controller_v2, forbidden: true}
  - {id: joystick-starts, nodes: /joystick, forbidden: true}
  - {id: localizer-restarts, nodes: /localizer, restarts: ..0}
";

/// An end of the mission in seconds: the rules newly broken there, and those no longer broken.
type Step = (
    &'static str,
    &'static [&'static str],
    &'static [&'static str],
);

#[test]
fn each_reconfiguration_breaks_exactly_its_rule() {
    let Some(bag) = shared("data/bags/mission/mission.bag") else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("graph.yaml"), STEPS).unwrap();
    let steps: [Step; 15] = [
        ("50", &["localizer-starts"], &[]),
        ("80", &["planner-starts"], &[]),
        ("110", &["controller-starts"], &[]),
        ("130", &["node /camera_driver"], &[]),
        ("160", &["backup-starts"], &[]),
        ("174", &["probe-starts"], &[]),
        ("184", &["node /planner"], &[]),
        ("196", &["node /probe"], &[]),
        // A node that returned is not missing.
        ("207", &["planner-restarts"], &["node /planner"]),
        ("220", &["probe-restarts"], &["node /probe"]),
        // Half a second apart, as the next two.
        ("243", &["node /controller", "successor-starts"], &[]),
        ("258", &["node /probe", "joystick-starts"], &[]),
        ("275", &["node /localizer"], &[]),
        ("300", &["localizer-restarts"], &["node /localizer"]),
        ("325", &["node /camera_backup"], &[]),
    ];
    let mut broken: Vec<String> = Vec::new();
    for (end, came, went) in steps {
        let bag = bag.to_str().unwrap();
        let args = [
            "check",
            bag,
            "--expect",
            "graph.yaml",
            "--format",
            "json",
            "--end",
            end,
        ];
        let output = bagreel(dir.path(), &args);
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let rules = report["rules"].as_array().unwrap().iter();
        let rules = rules.filter(|rule| rule["outcome"] == "broken");
        let title = |rule: &serde_json::Value| {
            let title = rule["rule"].as_str().unwrap();
            title.split(':').next().unwrap().to_owned()
        };
        let now: Vec<String> = rules.map(title).collect();
        let only = |these: &[String], those: &[String]| {
            let own = these.iter().filter(|rule| !those.contains(rule));
            own.cloned().collect::<Vec<_>>()
        };
        assert_eq!(only(&now, &broken), came, "until {end} s");
        assert_eq!(only(&broken, &now), went, "until {end} s");
        broken = now;
    }
}
