//! Every frame counted by script against the data, as it lies in the files: chips, marks and timeline of SVG frames,
//! the page, the report, and what a GIF is drawn from.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// What the data says of each window: the places of the headlines that lie in it.
fn headlines(mission: &Value) -> Vec<BTreeSet<u64>> {
    let ledger = mission["ledger"].as_array().unwrap();
    let parts = ledger
        .iter()
        .flat_map(|e| e["parts"].as_array().into_iter().flatten());
    let parts: BTreeSet<u64> = parts.map(|p| p.as_u64().unwrap()).collect();
    let told =
        |entry: &&Value| entry["quiet"] == false && !parts.contains(&entry["id"].as_u64().unwrap());
    let headlines: Vec<&Value> = ledger.iter().filter(told).collect();
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

/// The groups of an SVG whose class begins with this word, with the entries that they name.
fn groups<'a>(svg: &'a str, class: &'a str) -> impl Iterator<Item = Vec<u64>> + 'a {
    let starts = svg
        .match_indices("<g class=\"")
        .map(|(at, _)| &svg[at + 10..]);
    let tags = starts.map(|rest| &rest[..rest.find('>').unwrap()]);
    let of_class = tags.filter(move |tag| {
        let words = tag[..tag.find('"').unwrap()].split(' ').next();
        words == Some(class)
    });
    of_class.filter_map(|tag| {
        let (_, rest) = tag.split_once("data-entries=\"")?;
        let list = &rest[..rest.find('"')?];
        Some(list.split(' ').map(|n| n.parse().unwrap()).collect())
    })
}

fn rendered(bag: &str, period: &str, folder: &Path) {
    let input = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(bag);
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command
        .arg("render")
        .arg(input)
        .args(["-q", "--view", "graph", "--period", period]);
    for name in ["x.json", "x{n}.svg", "x.html", "x.md"] {
        command.arg("-o").arg(folder.join(name));
    }
    let done = command.output().unwrap();
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
}

#[test]
fn every_frame_counts_what_the_data_says() {
    let all = [
        ("warehouse.bag", "10"),
        ("warehouse.bag", "60"),
        ("courier.mcap", "5"),
        ("courier.mcap", "30"),
    ];
    for (bag, period) in all {
        let folder = tempfile::tempdir().unwrap();
        rendered(bag, period, folder.path());
        let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        let mission: Value = serde_json::from_str(&text("x.json")).unwrap();
        let expected = headlines(&mission);
        let digits = (expected.len() - 1).to_string().len();
        for (index, told) in expected.iter().enumerate() {
            let svg = text(&format!("x{index:0digits$}.svg"));
            let at = format!("{bag} by {period} s, window {index}");
            frame(&svg, told, &at);
        }
        timeline(
            &text(&format!("x{:0digits$}.svg", 0)),
            &expected,
            &format!("{bag} by {period} s"),
        );
        page(&text("x.html"), &expected, &format!("{bag} by {period} s"));
        report(&text("x.md"), &expected, &format!("{bag} by {period} s"));
    }
}

/// One frame: its chips, its caption, and the marks of its boxes and arrows.
fn frame(svg: &str, told: &BTreeSet<u64>, at: &str) {
    let chips: Vec<u64> = groups(svg, "chips").flatten().collect();
    assert_eq!(chips, [told.len() as u64], "chips of {at}");
    let marks = ["node", "topic", "edge"].into_iter();
    let marked: BTreeSet<u64> = marks
        .flat_map(|class| groups(svg, class))
        .flatten()
        .collect();
    assert_eq!(marked, *told, "marks of {at}");
    assert_eq!(
        told.is_empty(),
        svg.contains("no reconfiguration"),
        "caption of {at}"
    );
}

/// The timeline's marks: a window without a headline has none.
fn timeline(svg: &str, expected: &[BTreeSet<u64>], at: &str) {
    let marks: u64 = groups(svg, "mark").flatten().sum();
    let all: usize = expected.iter().map(BTreeSet::len).sum();
    assert_eq!(marks, all as u64, "timeline of {at}");
}

/// What the page's chips and jumps are made of, and the elements that it marks in each window.
fn page(html: &str, expected: &[BTreeSet<u64>], at: &str) {
    let (_, rest) = html
        .split_once(" id=\"data\"")
        .or_else(|| html.split_once(" id=data"))
        .unwrap();
    let (_, rest) = rest.split_once('>').unwrap();
    let data: Value = serde_json::from_str(&rest[..rest.find("</script>").unwrap()]).unwrap();
    let mut told = vec![0; expected.len()];
    for row in data["told"].as_array().unwrap() {
        told[place(&row[0])] = row[1].as_u64().unwrap();
    }
    let numbers: Vec<u64> = expected.iter().map(|told| told.len() as u64).collect();
    assert_eq!(told, numbers, "chips of the page of {at}");
    let classes: Vec<&str> = data["classes"]
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
    for life in data["lives"].as_array().unwrap() {
        let runs: Vec<usize> = life[0].as_array().unwrap().iter().map(place).collect();
        let mut window = 0;
        for run in runs.chunks(2) {
            window += run[0];
            marked[window] |= is_mark(classes[run[1]]);
        }
    }
    let with_headlines: Vec<bool> = expected.iter().map(|told| !told.is_empty()).collect();
    assert_eq!(marked, with_headlines, "marks of the page of {at}");
}

fn place(number: &Value) -> usize {
    usize::try_from(number.as_u64().unwrap()).unwrap()
}

/// The report's first line: its numbers add up to all headlines.
fn report(markdown: &str, expected: &[BTreeSet<u64>], at: &str) {
    let all: usize = expected.iter().map(BTreeSet::len).sum();
    let first = markdown.lines().next().unwrap();
    let (_, told) = first.split_once("changes in ").unwrap();
    let mut numbers = told
        .split([' ', ':'])
        .filter_map(|word| word.parse::<usize>().ok());
    let windows = expected.iter().filter(|told| !told.is_empty()).count();
    assert_eq!(numbers.next(), Some(windows), "{at}: {first}");
    assert_eq!(numbers.sum::<usize>(), all, "{at}: {first}");
}
