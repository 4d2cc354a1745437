//! Compares the counts in every output with the data: headlines, marks and timeline of SVG frames, the page, the
//! report, and the source of a GIF.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::support::windows;

/// For each window in the data: the indices of its headlines.
fn headlines(mission: &Value) -> Vec<BTreeSet<u64>> {
    let ledger = mission["events"].as_array().unwrap();
    let parts = ledger
        .iter()
        .flat_map(|e| e["parts"].as_array().into_iter().flatten());
    let parts: BTreeSet<u64> = parts.map(|p| p.as_u64().unwrap()).collect();
    let shown =
        |entry: &&Value| entry["quiet"] == false && !parts.contains(&entry["id"].as_u64().unwrap());
    let headlines: Vec<&Value> = ledger.iter().filter(shown).collect();
    let window = |window: &Value| {
        let span = window["start_ns"].as_i64().unwrap()..window["end_ns"].as_i64().unwrap();
        let inside = headlines
            .iter()
            .filter(|e| span.contains(&e["time_ns"].as_i64().unwrap()));
        inside.map(|e| e["id"].as_u64().unwrap()).collect()
    };
    mission["windows"]
        .as_array()
        .unwrap()
        .iter()
        .map(window)
        .collect()
}

/// The groups of an SVG whose class begins with these words, with the events that they name.
fn groups<'a>(svg: &'a str, class: &'a str) -> impl Iterator<Item = Vec<u64>> + 'a {
    let starts = svg
        .match_indices("<g class=\"")
        .map(|(at, _)| &svg[at + 10..]);
    let tags = starts.map(|rest| &rest[..rest.find('>').unwrap()]);
    let of_class = tags.filter(move |tag| {
        let rest = tag[..tag.find('"').unwrap()].strip_prefix(class);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
    });
    of_class.filter_map(|tag| {
        let keys = ["data-entries=\"", "data-entry=\""];
        let (_, rest) = keys.iter().find_map(|key| tag.split_once(key))?;
        let list = &rest[..rest.find('"')?];
        Some(
            list.split_whitespace()
                .map(|n| n.parse().unwrap())
                .collect(),
        )
    })
}

/// Renders an example; returns the terminal output.
fn rendered(bag: &str, period: &str, folder: &Path) -> String {
    let input = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(bag);
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command
        .arg("render")
        .arg(input)
        .args(["--mode", "all", "--period", period]);
    for name in ["x.json", "x{n}.svg", "x{n}.mmd", "x.html", "x.md"] {
        command.arg("-o").arg(folder.join(name));
    }
    let done = command.output().unwrap();
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    String::from_utf8(done.stderr).unwrap()
}

#[test]
fn every_frame_has_the_counts_of_the_data() {
    let all = [
        ("warehouse.bag", "10"),
        ("warehouse.bag", "60"),
        ("courier.mcap", "5"),
        ("courier.mcap", "30"),
    ];
    for (bag, period) in all {
        let folder = tempfile::tempdir().unwrap();
        let said = rendered(bag, period, folder.path());
        let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        let mission: Value = serde_json::from_str(&text("x.json")).unwrap();
        let expected = headlines(&mission);
        let digits = (expected.len() - 1).to_string().len();
        let (lasting, over) = lasting(&mission);
        let reported = joined(&expected, &lasting);
        let changed = joined(&expected, &over);
        let windows = windows::windows(&mission);
        for (index, shown) in reported.iter().enumerate() {
            let svg = text(&format!("x{index:0digits$}.svg"));
            let at = format!("{bag} by {period} s, window {index}");
            frame(&svg, shown, &at);
            coloured(&svg, shown, &mission, &at);
            alive(&svg, &windows[index], &at);
            chart(&text(&format!("x{index:0digits$}.mmd")), shown, &at);
        }
        settled(&folder.path().join("x"), &reported, digits);
        terminal(&said, &expected);
        strip(bag, period, &changed, folder.path());
        timeline(
            &text(&format!("x{:0digits$}.svg", 0)),
            &expected,
            &format!("{bag} by {period} s"),
        );
        let at = format!("{bag} by {period} s");
        page(&text("x.html"), (&expected, &changed), &at);
        report(&text("x.md"), (&expected, &changed), &at);
    }
}

/// One frame: its headline, and the marks of its boxes, rows, words, arrows and frames.
fn frame(svg: &str, shown: &BTreeSet<u64>, at: &str) {
    let named: BTreeSet<u64> = groups(svg, "headline").flatten().collect();
    assert_eq!(named, *shown, "headline of {at}");
    let marks = ["node", "topic", "edge", "also"].into_iter();
    let marked: BTreeSet<u64> = marks
        .flat_map(|class| groups(svg, class))
        .flatten()
        .collect();
    assert_eq!(marked, *shown, "marks of {at}");
    assert_eq!(shown.is_empty(), svg.contains("no change"), "words of {at}");
}

/// A node that starts, stops or restarts has its colour at its own box, however many do so at once; without a line, at its
/// words.
fn coloured(svg: &str, shown: &BTreeSet<u64>, mission: &Value, at: &str) {
    let places = [
        "node added",
        "node removed",
        "node changed",
        "node away",
        "also",
    ];
    let nodes: BTreeSet<u64> = places
        .iter()
        .flat_map(|class| groups(svg, class).flatten())
        .collect();
    for id in shown {
        let event = &mission["events"][usize::try_from(*id).unwrap()];
        let is_life = ["started", "stopped", "restarted"]
            .iter()
            .any(|kind| event["kind"] == **kind);
        if event["what"] == "node" && is_life {
            assert!(nodes.contains(id), "{} of {at}", event["name"]);
        }
    }
}

/// A node that is drawn as active is one of the window's nodes in the data: for an anonymous one, a run of
/// it.
fn alive(svg: &str, window: &Value, at: &str) {
    let nodes = window["nodes"].as_array().unwrap();
    let names: Vec<&str> = nodes.iter().map(|n| n["name"].as_str().unwrap()).collect();
    let is_run = |name: &str, role: &str| {
        let rest = name.strip_prefix(role);
        rest.is_some_and(|rest| rest.chars().all(|c| c == '_' || c.is_ascii_digit()))
    };
    let tags = svg.split("<g class=\"node ").skip(1);
    for tag in tags.map(|rest| &rest[..rest.find('>').unwrap()]) {
        let (classes, rest) = tag.split_once("\" data-name=\"").unwrap();
        let name = &rest[..rest.find('"').unwrap()];
        let classes: Vec<&str> = classes.split(' ').collect();
        // Unknown publishers and collapsed namespaces are boxes, not nodes.
        let is_gone = classes.contains(&"removed");
        let is_drawn = classes.contains(&"active") && !is_gone;
        if is_drawn && !name.contains(" ?") && !rest.contains(" data-members=") {
            assert!(names.iter().any(|n| is_run(n, name)), "{name} of {at}");
        }
    }
}

/// The timeline's marks: a window without a headline has none.
fn timeline(svg: &str, expected: &[BTreeSet<u64>], at: &str) {
    let marks: BTreeSet<u64> = groups(svg, "mark").flatten().collect();
    let all: BTreeSet<u64> = expected.iter().flatten().copied().collect();
    assert_eq!(marks, all, "timeline of {at}");
}

/// The data of the page's badges and jumps, and the elements that it marks in each window.
fn page(html: &str, (expected, changed): (&[BTreeSet<u64>], &[BTreeSet<u64>]), at: &str) {
    let (_, rest) = html
        .split_once(" id=\"data\"")
        .or_else(|| html.split_once(" id=data"))
        .unwrap();
    let (_, rest) = rest.split_once('>').unwrap();
    let data: Value = serde_json::from_str(&rest[..rest.find("</script>").unwrap()]).unwrap();
    let mut shown = vec![0; expected.len()];
    for row in data["reported"].as_array().unwrap() {
        shown[place(&row[0])] = row[1].as_u64().unwrap();
    }
    let numbers: Vec<u64> = expected.iter().map(|shown| shown.len() as u64).collect();
    assert_eq!(shown, numbers, "counts on the page of {at}");
    let graph = &data["graphs"][0];
    let classes: Vec<&str> = graph["classes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| c.as_str().unwrap())
        .collect();
    let is_mark = |class: &str| {
        ["added", "removed", "changed"]
            .iter()
            .any(|mark| class.split(' ').any(|w| w == *mark))
    };
    let mut marked = vec![false; expected.len()];
    for runs in graph["runs"].as_array().unwrap() {
        let runs: Vec<usize> = runs[0].as_array().unwrap().iter().map(place).collect();
        let mut window = 0;
        for run in runs.chunks(2) {
            window += run[0];
            marked[window] |= is_mark(classes[run[1]]);
        }
    }
    let is_changed: Vec<bool> = changed.iter().map(|shown| !shown.is_empty()).collect();
    assert_eq!(marked, is_changed, "marks of the page of {at}");
}

fn place(number: &Value) -> usize {
    usize::try_from(number.as_u64().unwrap()).unwrap()
}

/// The report's first line: it counts all headlines.
fn report(markdown: &str, (expected, all): (&[BTreeSet<u64>], &[BTreeSet<u64>]), at: &str) {
    let windows = all.iter().filter(|shown| !shown.is_empty()).count();
    let all: usize = expected.iter().map(BTreeSet::len).sum();
    let mut lines = markdown.lines().filter(|line| !line.is_empty());
    let (first, second) = (lines.next().unwrap(), lines.next().unwrap());
    let (_, shown) = first.split_once("**: ").unwrap();
    let (_, changed) = second.rsplit_once(", ").unwrap();
    let changed: usize = changed.split(' ').next().unwrap().parse().unwrap();
    assert_eq!(changed, windows, "{at}: {second}");
    assert!(shown.contains(&format!(", {all} change")), "{at}: {first}");
}

/// A flow chart has marks if and only if there is a headline.
fn chart(mermaid: &str, shown: &BTreeSet<u64>, at: &str) {
    let is_mark = |line: &&str| {
        let mut words = line.split_whitespace();
        matches!(words.next(), Some("class" | "linkStyle")) && words.last() != Some("space")
    };
    let marks = mermaid.lines().filter(is_mark).count();
    assert_eq!(marks == 0, shown.is_empty(), "flow chart of {at}");
}

/// The line at the end counts the headlines.
fn terminal(said: &str, expected: &[BTreeSet<u64>]) {
    let line = said
        .lines()
        .find(|line| line.starts_with("wrote "))
        .unwrap();
    let all: usize = expected.iter().map(BTreeSet::len).sum();
    let word = if all == 1 { "change" } else { "changes" };
    assert!(
        line.contains(&format!(", {all} {word}, in ")),
        "{line}: {all}"
    );
}

/// The most windows in a strip.
const MOST_PANELS: usize = 12;

/// The strip shows the first window and those with headlines, or with most of them; others if there is room.
fn strip(bag: &str, period: &str, expected: &[BTreeSet<u64>], folder: &Path) {
    let input = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(bag);
    let to = folder.join("strip.svg");
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command
        .arg("render")
        .arg(input)
        .args(["-q", "--mode", "all", "--period", period]);
    let done = command
        .args(["--strip", "4x3", "-o"])
        .arg(&to)
        .output()
        .unwrap();
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let svg = fs::read_to_string(to).unwrap();
    let panels = svg.match_indices("id=\"panel-").map(|(at, found)| {
        let rest = &svg[at + found.len()..];
        rest[..rest.find('"').unwrap()].parse::<usize>().unwrap()
    });
    let panels: BTreeSet<usize> = panels.collect();
    let has = |k: &usize| *k == 0 || !expected[*k].is_empty();
    let wanted: BTreeSet<usize> = (0..expected.len()).filter(has).collect();
    if wanted.len() <= MOST_PANELS {
        assert!(
            panels.is_superset(&wanted),
            "strip of {bag} by {period} s: {panels:?}, not {wanted:?}"
        );
    } else {
        assert!(
            panels.is_subset(&wanted),
            "strip of {bag} by {period} s: {panels:?}"
        );
    }
    assert_eq!(panels.len(), MOST_PANELS.min(expected.len()));
}

/// Every group of a frame by its id, except the clock and the timeline; visible numbers are removed.
fn drawn(svg: &str) -> BTreeMap<&str, String> {
    let mut all = BTreeMap::new();
    for line in svg.lines() {
        let Some((_, rest)) = line.split_once(" id=\"") else {
            continue;
        };
        let id = &rest[..rest.find('"').unwrap()];
        // Rate labels consist of numbers.
        if ["clock", "past", "playhead"].contains(&id) || id.ends_with("..over") {
            continue;
        }
        all.insert(id, without_numbers(line));
    }
    all
}

/// A line of SVG with placeholders for rates and counts, without tooltip and lengths of texts.
fn without_numbers(line: &str) -> String {
    let mut parts = line.split(" textLength=\"");
    let mut unmeasured = parts.next().unwrap_or_default().to_owned();
    parts.for_each(|part| unmeasured += part.split_once('"').map_or("", |(_, rest)| rest));
    let line = unmeasured.as_str();
    let (head, rest) = line.split_once("<title>").unwrap_or((line, ""));
    let rest = rest.split_once("</title>").map_or("", |(_, rest)| rest);
    let mut out = head.to_owned();
    for (at, part) in rest.split('>').enumerate() {
        let (text, tag) = part.split_once('<').unwrap_or(("", part));
        let is_number = text.ends_with(" Hz") || text.ends_with(" msg");
        out += if at > 0 { ">" } else { "" };
        out += if is_number { "#" } else { text };
        out += "<";
        out += tag;
    }
    out
}

/// A window without a headline after another one is drawn the same, except for clock and numbers.
fn settled(stem: &Path, expected: &[BTreeSet<u64>], digits: usize) {
    let read = |k: usize| {
        let path = format!("{}{k:0digits$}.svg", stem.display());
        fs::read_to_string(path).unwrap()
    };
    for k in 1..expected.len() {
        // The line below the headline names the last change.
        let is_quiet = |k: usize| expected[k].is_empty();
        if k > 1 && (k - 2..=k).all(is_quiet) {
            let (before, after) = (read(k - 1), read(k));
            assert_eq!(drawn(&before), drawn(&after), "window {k}");
        }
    }
}

/// The events of earlier windows that are drawn in each window: absences that last into it, and those that end in it;
/// and the latter alone.
fn lasting(mission: &Value) -> (Vec<BTreeSet<u64>>, Vec<BTreeSet<u64>>) {
    let headlines: BTreeSet<u64> = headlines(mission).into_iter().flatten().collect();
    let ledger = mission["events"].as_array().unwrap().iter();
    let lasts = ledger.filter_map(|e| {
        let id = e["id"].as_u64().filter(|id| headlines.contains(id))?;
        let (from, to) = (e["time_ns"].as_i64()?, e["until_ns"].as_i64()?);
        Some((id, from, to, e["kind"] == "restarted"))
    });
    let lasts: Vec<(u64, i64, i64, bool)> = lasts.collect();
    let windows = mission["windows"].as_array().unwrap().iter();
    let both = windows.map(|window| {
        let nanos = |key: &str| window[key].as_i64().unwrap();
        let (start, end) = (nanos("start_ns"), nanos("end_ns"));
        let open = lasts.iter().filter(|e| e.1 < start && e.2 >= start);
        let over = open.clone().filter(|e| e.2 < end).map(|e| e.0);
        let drawn = open.filter(|e| e.2 < end || e.3).map(|e| e.0);
        (drawn.collect(), over.collect())
    });
    both.unzip()
}

fn joined(a: &[BTreeSet<u64>], b: &[BTreeSet<u64>]) -> Vec<BTreeSet<u64>> {
    a.iter().zip(b).map(|(a, b)| a | b).collect()
}
