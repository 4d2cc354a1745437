//! The page, the animated SVG and the report, as files: driven in a real browser where there is one, and weighed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use tempfile::TempDir;

/// Runs `bagreel render` on this evolution and returns the folder with `x.` and each of the extensions.
fn rendered(mission: &Value, extensions: &[&str]) -> TempDir {
    let folder = TempDir::new().unwrap();
    let input = folder.path().join("in.json");
    fs::write(&input, mission.to_string()).unwrap();
    render(&input, folder.path(), extensions);
    folder
}

fn render(input: &Path, folder: &Path, extensions: &[&str]) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.arg("render").arg(input).arg("--quiet");
    if extensions.iter().any(|e| !["md", "mmd"].contains(e)) {
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

/// A mission of windows of ten seconds in which everybody publishes a topic of their own to a listener; who is there
/// and how fast depends on the window.
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
    json!({"schema": "bagreel.evolution/1", "bags": [{"name": "mission", "format": "mcap"}], "windows": windows})
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

const HOSTILE: [&str; 10] = [
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
];

#[test]
fn a_browser_plays_the_page_as_the_evolution_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mission = running(&ROBOT, 50);
    let pages = rendered(&mission, &["html", "svg", "json"]);
    let hostile = rendered(&running(&HOSTILE, 12), &["html"]);
    let file = |folder: &TempDir, name: &str| folder.path().join(name);
    let driven = Command::new("python3")
        .arg(root.join("tests/browser/drive.py"))
        .args([
            file(&pages, "x.html"),
            file(&pages, "x.json"),
            file(&hostile, "x.html"),
            file(&pages, "x.svg"),
        ])
        .output();
    let Ok(driven) = driven else {
        eprintln!("skipped: `python3` is not installed");
        return;
    };
    let (out, err) = (
        String::from_utf8_lossy(&driven.stdout),
        String::from_utf8_lossy(&driven.stderr),
    );
    assert!(driven.status.success(), "{out}{err}");
    assert!(
        out.contains("all well") || out.contains("skipped: "),
        "{out}"
    );
    eprint!("{out}");
}

#[test]
fn a_page_asks_for_nothing_and_lets_nothing_in() {
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
fn a_report_carries_no_markup_from_names() {
    let pages = rendered(&running(&HOSTILE, 12), &["md", "mmd"]);
    let report = fs::read_to_string(pages.path().join("x.md")).unwrap();
    // Mermaid has entities of its own.
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
fn a_job_summary_is_added_to() {
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
}

#[test]
fn pages_keep_their_weight() {
    let medium = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/graphs/medium.json");
    if !medium.exists() {
        eprintln!("skipped: {} is not there", medium.display());
        return;
    }
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
    assert!(
        page.len() - fonts.len() <= 61_000,
        "{}",
        page.len() - fonts.len()
    );
    assert!(page.len() <= 200_000, "{}", page.len());
    assert!(
        size(folder.path().join("x.svg")) <= 30_000,
        "{}",
        size(folder.path().join("x.svg"))
    );
    assert!(size(folder.path().join("x.md")) <= 256 << 10);
}
