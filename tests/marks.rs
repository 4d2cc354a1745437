//! Tests that pictures agree with the log: every mark is an event with the log's text, and every headline is marked
//! wherever its element is drawn.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::support::shared;

/// The log of a bag: its events by id, and their sentences.
struct Log {
    events: BTreeMap<u64, Value>,
    sentences: BTreeSet<String>,
}

impl Log {
    fn of(bag: &Path) -> Self {
        let log = said(bag, &["events", "--format", "json", "--parts", "--all"]);
        let mut log: Value = serde_json::from_str(&log).unwrap();
        assert_eq!(log["schema"], "bagreel.events/2");
        let Value::Array(rows) = log["events"].take() else {
            panic!("the events are no list")
        };
        let text = said(bag, &["events", "--parts", "--all"]);
        // A time of thirteen characters, two spaces, and the sentence, which is indented for parts.
        let sentence = |line: &str| line.chars().skip(15).collect::<String>();
        Self {
            events: rows
                .into_iter()
                .map(|row| (row["id"].as_u64().unwrap(), row))
                .collect(),
            sentences: text
                .lines()
                .map(|line| sentence(line).trim().to_owned())
                .collect(),
        }
    }

    fn kind(&self, id: u64) -> &str {
        let event = self
            .events
            .get(&id)
            .unwrap_or_else(|| panic!("no event {id} in the log"));
        event["kind"].as_str().unwrap()
    }

    /// The headlines: neither quiet nor part of another.
    fn headlines(&self) -> BTreeMap<u64, &Value> {
        let all = self.events.values();
        let parts = all
            .clone()
            .flat_map(|e| e["parts"].as_array().into_iter().flatten());
        let parts: BTreeSet<u64> = parts.map(|p| p.as_u64().unwrap()).collect();
        let own = all.filter(|e| e["quiet"] == false);
        let own = own.map(|e| (e["id"].as_u64().unwrap(), e));
        own.filter(|(id, _)| !parts.contains(id)).collect()
    }
}

fn said(bag: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    let done = command.args(arguments).arg(bag).output().unwrap();
    assert!(done.stderr.is_empty() || done.status.code().is_some_and(|c| c == 0 || c == 3));
    String::from_utf8(done.stdout).unwrap()
}

/// The bags of the examples and of the shared data.
fn bags() -> Vec<PathBuf> {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let mut all = vec![
        examples.join("warehouse.bag"),
        examples.join("courier.mcap"),
    ];
    all.extend(shared("data/mini/nodelet.bag"));
    all.extend(shared("data/bags/mission/mission.bag"));
    all
}

/// Renders a bag with these flags; returns the file's text, or `None` if the command fails.
fn rendered(bag: &Path, flags: &[&str], name: &str) -> Option<String> {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagreel"));
    command.args(flags).arg("--quiet").arg(bag);
    let done = command
        .arg("-o")
        .arg(folder.path().join(name))
        .output()
        .unwrap();
    if done.status.code() == Some(2) {
        return None;
    }
    let files = std::fs::read_dir(folder.path()).unwrap();
    let texts = files.map(|file| std::fs::read_to_string(file.unwrap().path()).unwrap());
    Some(texts.collect())
}

/// A group of an SVG: its first class word, its attributes, its title.
struct Marked<'a> {
    class: &'a str,
    ids: Vec<u64>,
    title: String,
}

/// The groups that are or should be marks: those that name events, and those whose class requires it.
fn marks(svg: &str) -> Vec<Marked<'_>> {
    const SIGNS: [&str; 6] = ["start", "end", "event", "letter", "handover", "mark"];
    let tags = svg.split("<g class=\"").skip(1).map(|rest| {
        let (tag, inside) = rest.split_once('>').unwrap();
        let class = tag.split(['"', ' ']).next().unwrap();
        let list = ["data-entry=\"", "data-entries=\""]
            .iter()
            .find_map(|key| tag.split_once(key));
        let ids = list.map_or("", |(_, rest)| rest.split('"').next().unwrap());
        let title = inside
            .strip_prefix("<title>")
            .and_then(|t| t.split("</title>").next());
        Marked {
            class,
            ids: ids
                .split_whitespace()
                .map(|id| id.parse().unwrap())
                .collect(),
            title: unescaped(title.unwrap_or("")),
        }
    });
    tags.filter(|m| SIGNS.contains(&m.class) || !m.ids.is_empty())
        .collect()
}

fn unescaped(text: &str) -> String {
    text.replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&quot;", "\"")
        .replace("&amp;", "&")
}

/// Checks that every mark names events of the log, of its own kind; returns all of them.
fn shown(log: &Log, svg: &str, at: &str) -> BTreeSet<u64> {
    let mut all = BTreeSet::new();
    for mark in marks(svg) {
        assert!(!mark.ids.is_empty(), "a {} of {at} is no event", mark.class);
        for id in &mark.ids {
            let kind = log.kind(*id);
            let fits = match mark.class {
                "start" => ["started", "appeared", "restarted"].contains(&kind),
                "end" => ["stopped", "vanished", "restarted"].contains(&kind),
                "handover" => kind == "handed_over",
                _ => true,
            };
            assert!(
                fits,
                "a {} of {at} is of an event that is {kind}",
                mark.class
            );
        }
        if ["start", "end", "event", "letter", "handover"].contains(&mark.class)
            && !mark.title.is_empty()
        {
            assert!(log.sentences.contains(&mark.title), "{at}: {}", mark.title);
        }
        all.extend(mark.ids);
    }
    all
}

/// The text after the name in the sentence of an event with numbers: `30 → 5 Hz`.
fn numbers(sentence: &str) -> Option<String> {
    let (before, after) = sentence
        .split_once(" → ")
        .filter(|_| sentence.ends_with("Hz"))?;
    // The sentence of a publication has an arrow of its own.
    let (before, after) = after
        .rsplit_once(" → ")
        .map_or((before, after), |(a, b)| (a, b));
    let from = before.rsplit(' ').next()?;
    Some(format!("{from} → {after}"))
}

#[test]
fn every_mark_of_a_figure_is_an_event_of_the_log() {
    for bag in bags() {
        let log = Log::of(&bag);
        for (figure, width) in [
            ("lives", "88mm"),
            ("lives", "181mm"),
            ("graph", "181mm"),
            ("steps", "181mm"),
        ] {
            let at = format!("{figure} at {width} of {}", bag.display());
            let flags = ["figure", "--kind", figure, "--width", width];
            let Some(svg) = rendered(&bag, &flags, "figure.svg") else {
                continue;
            };
            shown(&log, &svg, &at);
            for letter in marks(&svg).iter().filter(|m| m.class == "letter") {
                if let Some(numbers) = numbers(&letter.title) {
                    let text = svg.replace("</text>", " ");
                    let words: String = text
                        .split('<')
                        .filter_map(|t| Some(t.split_once('>')?.1))
                        .collect();
                    let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
                    assert!(
                        words.contains(&numbers),
                        "{at}: no `{numbers}` for {}",
                        letter.title
                    );
                }
            }
        }
    }
}

#[test]
fn every_headline_is_marked_in_the_row_of_its_element() {
    for bag in bags() {
        let log = Log::of(&bag);
        for rows in ["nodes", "topics"] {
            let at = format!("{rows} of {}", bag.display());
            let flags = ["figure", "--width", "181mm", "--rows", rows];
            let Some(svg) = rendered(&bag, &flags, "figure.svg") else {
                continue;
            };
            let marked = shown(&log, &svg, &at);
            for (id, event) in log.headlines() {
                let (kind, what) = (
                    event["kind"].as_str().unwrap(),
                    event["what"].as_str().unwrap(),
                );
                let is_row = match what {
                    "node" => rows == "nodes",
                    "topic" => rows == "topics" || kind == "handed_over",
                    _ => true,
                };
                assert_eq!(marked.contains(&id), is_row, "{at}: {event}");
            }
        }
    }
}

#[test]
fn lifetimes_rates_and_hand_overs_agree_in_all_pictures() {
    // Compares log, figure, animation and page of the example.
    let bag = &bags()[0];
    let log = Log::of(bag);
    let headlines = log.headlines();
    let of = |kind: &str| -> BTreeSet<u64> {
        let own = headlines.iter().filter(|(_, e)| e["kind"] == kind);
        own.map(|(id, _)| *id).collect()
    };
    let (handed, rates) = (of("handed_over"), of("rate"));
    assert!(handed.len() >= 2 && rates.len() >= 3);
    let svg = rendered(bag, &["figure"], "figure.svg").unwrap();
    let with = |svg: &str, class: &str| -> BTreeSet<u64> {
        let own = marks(svg);
        own.into_iter()
            .filter(|m| m.class == class)
            .flat_map(|m| m.ids)
            .collect()
    };
    assert_eq!(with(&svg, "handover"), handed);
    assert!(rates.is_subset(&with(&svg, "letter")), "{rates:?}");
    let frame = rendered(
        bag,
        &["render", "--mode", "all", "--period", "60"],
        "frame{n}.svg",
    )
    .unwrap();
    assert!(with(&frame, "handover").is_subset(&handed));
    assert_eq!(with(&frame, "mark"), headlines.keys().copied().collect());
    let html = rendered(bag, &["render", "--period", "60"], "page.html").unwrap();
    let data = page(&html);
    let takeovers = data["takeovers"].as_array().unwrap().iter();
    let takeovers: BTreeSet<u64> = takeovers
        .map(|takeover| takeover[3].as_u64().unwrap())
        .collect();
    assert_eq!(takeovers, handed);
}

#[test]
fn every_change_in_json_names_its_event() {
    for bag in bags() {
        let log = Log::of(&bag);
        let mission: Value =
            serde_json::from_str(&said(&bag, &["render", "-o", "-", "--format", "json"])).unwrap();
        let windows = mission["windows"].as_array().unwrap().iter();
        let changes = windows.flat_map(|window| window["changes"].as_array().unwrap());
        for change in changes {
            log.kind(change["event"].as_u64().unwrap());
        }
    }
}

#[test]
fn the_marks_of_frames_strips_and_pages_are_events_too() {
    for bag in bags() {
        let log = Log::of(&bag);
        let at = bag.display().to_string();
        let frames = rendered(&bag, &["render", "--period", "60"], "frame{n}.svg").unwrap();
        shown(&log, &frames, &at);
        if let Some(strip) = rendered(
            &bag,
            &["render", "--mode", "all", "--strip", "3x2"],
            "strip.svg",
        ) {
            shown(&log, &strip, &at);
        }
        let html = rendered(&bag, &["render", "--period", "60"], "page.html").unwrap();
        let data = page(&html);
        let id = |value: &Value| value.as_u64().unwrap();
        let lists = |key: &str| data[key].as_array().unwrap().iter();
        let lines = lists("reported").flat_map(|shown| shown[3].as_array().unwrap());
        let lines: BTreeSet<u64> = lines.map(|line| id(&line[4])).collect();
        assert!(
            lines.iter().all(|id| log.headlines().contains_key(id)),
            "{at}"
        );
        for event in lists("rows").flat_map(|row| row[5].as_array().unwrap()) {
            let kind = log.kind(id(&event[2]));
            let fits = match id(&event[1]) {
                0 => ["started", "appeared", "restarted"].contains(&kind),
                1 => ["stopped", "vanished", "restarted"].contains(&kind),
                _ => true,
            };
            assert!(fits, "{at}: {event} is {kind}");
        }
    }
}

/// The data of a page.
fn page(html: &str) -> Value {
    let (_, rest) = html
        .split_once("<script id=\"data\"")
        .or_else(|| html.split_once(" id=data"))
        .unwrap();
    let (_, rest) = rest.split_once('>').unwrap();
    serde_json::from_str(&rest[..rest.find("</script>").unwrap()]).unwrap()
}
