//! Counts the messages of a bag per window of ten seconds, topic and publisher, and prints them as JSON.
//!
//! `cargo run --release --example counts -- run.bag`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use std::collections::BTreeMap;

use bagreel::bag::{self, Connection, ConnectionId, Input, Message, OpenOptions, Sink, Want};
use bagreel::base::notice::Notice;
use bagreel::base::time::Stamp;

#[derive(Default)]
struct Counts {
    connections: Vec<Connection>,
    stamps: Vec<(ConnectionId, Stamp)>,
    bytes: u64,
    payloads: BTreeMap<String, (u64, u64)>,
    notices: Vec<Notice>,
    want: Want,
}

impl Sink for Counts {
    fn connection(&mut self, connection: &Connection) -> Want {
        assert_eq!(connection.id.0 as usize, self.connections.len());
        self.connections.push(connection.clone());
        self.want
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        assert!(self.connections.len() > connection.0 as usize);
        assert!(sizes.is_none_or(|s| s.len() == stamps.len()));
        self.stamps.extend(stamps.iter().map(|t| (connection, *t)));
        self.bytes += sizes.map_or(0, |s| s.iter().map(|b| u64::from(*b)).sum());
    }

    fn message(&mut self, message: Message<'_>) {
        let topic = &self.connections[message.connection.0 as usize].topic;
        let entry = self.payloads.entry(topic.to_string()).or_default();
        entry.0 += 1;
        entry.1 += message.data.len() as u64;
    }

    fn notice(&mut self, notice: Notice) {
        self.notices.push(notice);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut counts = Counts::default();
    let mut options = OpenOptions::default();
    let mut inputs = Vec::new();
    for argument in std::env::args().skip(1) {
        match argument.as_str() {
            "--verify" => options.verify = true,
            "--sizes" => counts.want = Want::Sizes,
            "--payloads" => counts.want = Want::Payload,
            "-" => inputs.push(Input::Stdin),
            path => inputs.push(Input::Path(path.into())),
        }
    }
    let input = inputs.first().ok_or("name a bag")?;
    let mut reader = match bag::open(input, &options) {
        Ok(reader) => reader,
        Err(e) => {
            let error = serde_json::json!({"error": e.to_string(), "hint": e.hint()});
            println!("{error:#}");
            return Ok(());
        }
    };
    let span = reader.span()?;
    let report = reader.read(None, &mut counts)?;

    let start = counts.stamps.iter().map(|s| s.1).min().unwrap_or_default();
    let mut topics = BTreeMap::<(i64, &str), u64>::new();
    let mut publishes = BTreeMap::<(i64, &str, &str), u64>::new();
    for (id, at) in &counts.stamps {
        let connection = &counts.connections[id.0 as usize];
        let window = at.since(start) / 10_000_000_000;
        *topics
            .entry((window, connection.topic.as_str()))
            .or_default() += 1;
        if let Some(node) = &connection.publisher {
            let key = (window, connection.topic.as_str(), node.as_str());
            *publishes.entry(key).or_default() += 1;
        }
    }
    let connections: Vec<_> = counts
        .connections
        .iter()
        .map(|c| serde_json::json!({"topic": c.topic.as_str(), "type": &*c.type_name, "publisher": c.publisher.as_ref().map(bagreel::base::name::NodeName::as_str),
            "latching": c.latching, "qos": c.qos.is_some(), "hash": c.type_hash.as_deref()}))
        .collect();
    let json = serde_json::json!({
        "start_ns": start.0,
        "end_ns": counts.stamps.iter().map(|s| s.1.0).max(),
        "span": span.map(|s| (s.start.0, s.end.0)),
        "messages": counts.stamps.len(),
        "bytes": counts.bytes,
        "format": report.format, "tier": report.tier.word(), "tier_reason": report.tier_reason,
        "complete": report.complete, "compression": report.compression,
        "bytes_read": report.bytes_read, "file_bytes": report.file_bytes, "facts": report.facts,
        "topics": topics.iter().map(|((w, t), n)| (w, t, n)).collect::<Vec<_>>(),
        "publishes": publishes.iter().map(|((w, t, p), n)| (w, t, p, n)).collect::<Vec<_>>(),
        "connections": connections,
        "payloads": counts.payloads,
        "notices": counts.notices.iter().map(|n| (n.kind.word(), n.count, &n.text)).collect::<Vec<_>>(),
    });
    println!("{json:#}");
    Ok(())
}
