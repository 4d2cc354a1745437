//! The summary as text for people.

use std::fmt::Write as _;

use super::{ConfidenceCounts, FigureInfo, Info, NodeInfo, TopicInfo};
use crate::bag::Tier;
use crate::base::columns::{Cell, Column, WHOLE, hang, table};
use crate::base::time::Stamp;
use crate::base::words::{self, visible};

/// The summary as aligned text fitted to `width`, ending in a new line.
pub fn text(info: &Info, width: Option<usize>) -> String {
    let mut out = String::new();
    let flow = |text: &str| -> String {
        let line = |line: &str| {
            let lead = line.len() - line.trim_start().len();
            hang(&line[..lead], &line[lead..], lead + 2, width)
        };
        // Empty lines are kept.
        text.lines().map(line).collect()
    };
    let mut prose = String::new();
    // Writing to a string cannot fail.
    let _ = head(&mut prose, info);
    let _ = known(&mut prose, info);
    out.push_str(&flow(&prose));
    out.push_str(&topics(&info.topics, width));
    out.push('\n');
    out.push_str(&nodes(info, width));
    let mut prose = String::new();
    let _ = undrawn(&mut prose, info);
    out.push_str(&flow(&prose));
    out
}

/// Writes the edges from source code that are not drawn.
fn undrawn(out: &mut String, info: &Info) -> std::fmt::Result {
    if info.undrawn.is_empty() {
        return Ok(());
    }
    writeln!(out, "\nthe source code, not drawn")?;
    for line in &info.undrawn {
        writeln!(out, "  {}", words::visible(line))?;
    }
    Ok(())
}

fn head(out: &mut String, info: &Info) -> std::fmt::Result {
    writeln!(out, "{}\n", info.summary)?;
    for bag in &info.bags {
        let how = bag.tier_reason.as_ref();
        let how = how.map_or_else(String::new, |why| format!(" ({})", visible(why)));
        let state = if bag.complete { "" } else { ", damaged" };
        let compression = bag.compression.iter().filter(|word| *word != "none");
        let compression = format!(" {}", visible(&words::joined(compression, "+")));
        let compression = compression.trim_end();
        writeln!(
            out,
            "{}  {}{compression}, {}, read {}{how}{state}",
            visible(&bag.name),
            bag.format,
            words::bytes(bag.file_bytes),
            match bag.tier {
                Tier::Index => "by its index",
                Tier::Forward => "from the front",
                Tier::Verify => "by the second reader",
            }
        )?;
        for (key, value) in &bag.facts {
            writeln!(out, "  {}: {}", visible(key), visible(value))?;
        }
    }
    let (start, end) = (Stamp(info.start_ns), Stamp(info.end_ns));
    writeln!(out, "from  {start}\nto    {end}")?;
    writeln!(
        out,
        "{} long, {}\n",
        words::offset((info.end_ns - 1).saturating_sub(info.start_ns) / 1_000_000 * 1_000_000),
        words::count(info.messages, "message")
    )
}

fn known(out: &mut String, info: &Info) -> std::fmt::Result {
    writeln!(
        out,
        "{}, {}, {}",
        how_many("node", info.nodes_by_degree),
        how_many("publication", info.publishes_by_degree),
        how_many("subscription", info.subscribes_by_degree)
    )?;
    let with = info.topics.iter().filter(|t| t.count > 0).count();
    let unknown = info.topics.iter().filter_map(|t| t.unknown_publishers);
    let counted = match unknown.sum::<u32>() {
        0 => String::new(),
        n => format!(" ({})", words::count(n, "unnamed publisher")),
    };
    writeln!(
        out,
        "of {} with messages, {} with a known publisher{counted}, {} with a known subscriber",
        words::count(with, "topic"),
        with - info.topics_without_publisher,
        with - info.topics_without_subscriber
    )?;
    for row in &info.evidence {
        let parts = [
            (row.nodes, "node"),
            (row.publishes, "publication"),
            (row.subscribes, "subscription"),
        ];
        let parts = words::counted(&parts, words::count);
        writeln!(out, "  {:<18} {parts}", row.source)?;
    }
    for line in &info.advice {
        writeln!(out, "to learn more: {line}")?;
    }
    for FigureInfo { figure, shows } in &info.figures {
        writeln!(
            out,
            "for a paper: `bagreel figure --kind {figure}` shows {shows}"
        )?;
    }
    writeln!(out)
}

/// A count with its confidences, such as `34 nodes (31 measured, 3 stated)`.
pub(crate) fn how_many(what: &str, confidences: ConfidenceCounts) -> String {
    let parts = [
        (confidences.measured, "measured"),
        (confidences.stated, "stated"),
        (confidences.inferred, "inferred"),
        (confidences.declared, "declared"),
    ];
    let parts = words::counted(&parts, |n, word| format!("{n} {word}"));
    let all = words::count(confidences.total(), what);
    if parts.is_empty() {
        all
    } else {
        format!("{all} ({parts})")
    }
}

const TOPIC_COLUMNS: [Column; 6] = [
    Column::new("topic", false, 28, (0, 0)),
    Column::new("type", false, 12, (2, 1)),
    Column::new("messages", true, WHOLE, (0, 0)),
    Column::new("while sending", true, WHOLE, (0, 0)),
    Column::new("skew", true, WHOLE, (0, 3)),
    Column::new("activity", false, 8, (1, 2)),
];

const NODE_COLUMNS: [Column; 5] = [
    Column::new("node", false, 24, (0, 0)),
    Column::new("known", false, WHOLE, (0, 1)),
    Column::new("alive", true, WHOLE, (0, 0)),
    Column::new("sends", false, WHOLE, (0, 3)),
    Column::new("receives", false, WHOLE, (0, 2)),
];

fn topics(topics: &[TopicInfo], width: Option<usize>) -> String {
    let row = |topic: &TopicInfo| {
        let skew = topic.skew.map(|skew| format!("{skew:.2}"));
        vec![
            Cell::Text(visible(topic.name.as_str()).into_owned()),
            Cell::Type(visible(&topic.types.join(" ")).into_owned()),
            Cell::Text(topic.count.to_string()),
            Cell::Text(topic.hz.map_or_else(String::new, words::rate)),
            Cell::Text(skew.unwrap_or_default()),
            Cell::Bars(topic.activity.clone()),
        ]
    };
    let rows: Vec<Vec<Cell>> = topics.iter().map(row).collect();
    table(&TOPIC_COLUMNS, &rows, width)
}

fn nodes(info: &Info, width: Option<usize>) -> String {
    let row = |node: &NodeInfo| {
        let (sends, receives) = load(node);
        vec![
            Cell::Text(visible(node.name.as_str()).into_owned()),
            Cell::Text(node.confidence.to_owned()),
            Cell::Text(alive(node, info.start_ns)),
            Cell::Text(sends),
            Cell::Text(receives),
        ]
    };
    let rows: Vec<Vec<Cell>> = info.nodes.iter().map(row).collect();
    table(&NODE_COLUMNS, &rows, width)
}

/// When a node exists, as in the log.
fn alive(node: &NodeInfo, start_ns: i64) -> String {
    let at = |time: i64| words::offset_seconds(time - start_ns);
    match (node.first_ns, node.last_ns) {
        (Some(first), Some(last)) if at(first) == at(last) => format!("at {}", at(first)),
        (Some(first), Some(last)) => format!("{} – {}", at(first), at(last)),
        (Some(one), None) | (None, Some(one)) => format!("at {}", at(one)),
        (None, None) => "?".to_owned(),
    }
}

/// The messages that a node sends and receives per second, and the topics: `0.26/s on 4`; the number of messages if they
/// have no rate.
fn load(node: &NodeInfo) -> (String, String) {
    let rate = |count: u64, hz: Option<f64>| match hz {
        None if count > 0 => format!("{count} msg"),
        hz => words::number(hz.unwrap_or(0.0)) + "/s",
    };
    let sends = match node.sent {
        _ if node.publishes == 0 => String::new(),
        Some(n) => format!("{} on {}", rate(n, node.sent_hz), node.publishes),
        None => words::count(node.publishes, "topic"),
    };
    let receives = node.received.map_or_else(String::new, |n| {
        format!("≤ {} on {}", rate(n, node.received_hz), node.subscribes)
    });
    (sends, receives)
}
