//! Measures huge but valid missions: ten hours in windows of one second, and a robot of 20,000 topics.
//!
//! `cargo bench --bench missions [-- --keep]` makes the bags below `target/bench/missions/`, reads each into every
//! output in a process of its own, and prints a table. `-- --make` only makes them. The latest results are in
//! `missions.md`.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_sign_loss,
    reason = "a panic in a benchmark names its line, and the numbers are small"
)]

mod measure;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use bagreel::internals::evidence::topology;
use bagreel::values::{Length, Period};
use bagreel::{Output, Reading, Render, render};
use measure::{Took, cpu, median, peak_mb};

const SECOND: u64 = 1_000_000_000;
const START: u64 = 1_700_000_000 * SECOND;

/// A mission by its size.
struct Shape {
    name: &'static str,
    seconds: u64,
    nodes: usize,
    topics: usize,
    /// The length of its windows; empty for the default.
    period: &'static str,
    /// Nanoseconds between two messages of the topic with this index.
    every: fn(usize) -> u64,
}

const SHAPES: [Shape; 3] = [
    // One message per second in total.
    Shape {
        name: "quiet",
        seconds: 36_000,
        nodes: 20,
        topics: 100,
        period: "1",
        every: |_| 100 * SECOND,
    },
    // One to four per second on each topic, so that hardly two windows are equal.
    Shape {
        name: "busy",
        seconds: 36_000,
        nodes: 20,
        topics: 100,
        period: "1",
        every: |at| SECOND / (at as u64 % 4 + 1),
    },
    Shape {
        name: "wide",
        seconds: 60,
        nodes: 100,
        topics: 20_000,
        period: "",
        every: |_| SECOND,
    },
];

impl Shape {
    /// The publisher of a topic.
    fn node(&self, topic: usize) -> usize {
        topic % self.nodes
    }

    /// Whether a node is running: every tenth is absent from the middle to three quarters.
    fn lives(&self, node: usize, second: u64) -> bool {
        let away = self.seconds / 2..self.seconds / 4 * 3;
        node % 10 != 3 || !away.contains(&second)
    }

    /// Messages of one second, sorted: time, topic. They are up to a twentieth of their period late.
    fn second(&self, second: u64, all: &mut Vec<(u64, usize)>) {
        all.clear();
        let (from, to) = (second * SECOND, (second + 1) * SECOND);
        for topic in (0..self.topics).filter(|t| self.lives(self.node(*t), second)) {
            let every = (self.every)(topic);
            let phase = topic as u64 * 7_919_000 % every;
            let first = (from + every - 1).saturating_sub(phase) / every;
            for n in first.. {
                let due = n * every + phase;
                if due >= to {
                    break;
                }
                let noise = (n + topic as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
                let late = (noise * every / 20) >> 24;
                all.push(((due + late).min(to - 1), topic));
            }
        }
        all.sort_unstable();
    }

    /// The bag and the table of its subscriptions, created if missing.
    fn make(&self, folder: &Path) -> (PathBuf, PathBuf) {
        let bag = folder.join(format!("{}.mcap", self.name));
        let table = folder.join(format!("{}.csv", self.name));
        if !table.exists() {
            self.record(&bag);
            fs::write(&table, self.subscriptions()).unwrap();
        }
        (bag, table)
    }

    fn record(&self, bag: &Path) {
        let to = BufWriter::new(File::create(bag).unwrap());
        let options = mcap::WriteOptions::new()
            .profile("ros1")
            .compression(Some(mcap::Compression::Lz4));
        let mut to = options.create(to).unwrap();
        let schema = to.add_schema("std_msgs/Empty", "ros1msg", b"").unwrap();
        let mut channel = |topic: usize| {
            let of = BTreeMap::from([("callerid".to_owned(), node_name(self.node(topic)))]);
            to.add_channel(schema, &topic_name(self.node(topic), topic), "ros1", &of)
                .unwrap()
        };
        let channels: Vec<u16> = (0..self.topics).map(&mut channel).collect();
        let mut all = Vec::new();
        for second in 0..self.seconds {
            self.second(second, &mut all);
            for (at, topic) in &all {
                let header = mcap::records::MessageHeader {
                    channel_id: channels[*topic],
                    sequence: 0,
                    log_time: START + at,
                    publish_time: START + at,
                };
                to.write_to_known_channel(&header, &[]).unwrap();
            }
        }
        to.finish().unwrap();
    }

    /// Each node subscribes to the next one's first three topics.
    fn subscriptions(&self) -> String {
        let mut table = "Name,Publish,Subscribe,Node-start,Node-end\n".to_owned();
        for node in 0..self.nodes {
            let next = (node + 1) % self.nodes;
            let topics = (next..self.topics).step_by(self.nodes).take(3);
            let topics: Vec<String> = topics
                .map(|t| format!("'{}'", topic_name(next, t)))
                .collect();
            let _ = writeln!(
                table,
                "{},[],\"[{}]\",,",
                node_name(node),
                topics.join(", ")
            );
        }
        table
    }
}

fn node_name(node: usize) -> String {
    format!("/part{}/node{node:03}", node / 10)
}

fn topic_name(node: usize, topic: usize) -> String {
    format!("/part{}/topic{topic:05}", node / 10)
}

/// Writes one output in this process and prints its cost: `--one bag table period output`.
fn one(args: &[String]) {
    let start = Instant::now();
    let mut reading = Reading::of([&args[0]]);
    reading.division.length = Period::parse(&args[2]).map_or(Length::Auto, Length::Fixed);
    reading.conclude.topology = topology::read(&PathBuf::from(&args[1])).unwrap();
    let job = Render::new(reading, vec![Output::parse(&args[3], None).unwrap()]).unwrap();
    let rendered = render(&job).unwrap();
    println!(
        "took {} {} {} {} {}",
        start.elapsed().as_secs_f64(),
        cpu(),
        rendered.written[0].bytes,
        peak_mb(),
        rendered.mission.messages
    );
}

fn measured(bag: &Path, table: &Path, period: &str, output: &Path) -> Took {
    let run = || {
        let args = [
            "--one",
            bag.to_str().unwrap(),
            table.to_str().unwrap(),
            period,
            output.to_str().unwrap(),
        ];
        let out = Command::new(std::env::current_exe().unwrap())
            .args(args)
            .output()
            .unwrap();
        measure::parse(&out.stdout)
    };
    median(3, run).unwrap()
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if args.first().is_some_and(|a| a == "--one") {
        return one(&args[1..]);
    }
    let has = |flag: &str| args.iter().any(|a| a == flag);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/bench/missions");
    fs::create_dir_all(&folder).unwrap();
    println!("| mission | output | wall | processor | peak | size |\n|---|---|---|---|---|---|");
    for shape in &SHAPES {
        let (bag, table) = shape.make(&folder);
        if has("--make") {
            continue;
        }
        for extension in ["json", "html", "csv", "md", "svg"] {
            let output = folder.join(format!("{}.{extension}", shape.name));
            let took = measured(&bag, &table, shape.period, &output);
            println!(
                "| {} ({} messages) | {extension} | {:.2} s | {:.2} s | {:.0} MB | {:.1} MB |",
                shape.name,
                took.messages,
                took.wall,
                took.cpu,
                took.peak_mb,
                took.bytes / 1e6
            );
        }
    }
    if !has("--keep") && !has("--make") {
        fs::remove_dir_all(&folder).unwrap();
    }
}
