//! The summary as text for people.

use std::fmt::Write as _;

use super::{DegreeCounts, Info, NodeInfo, TopicInfo};
use crate::base::time::Stamp;
use crate::base::words::{self, visible};

/// The most columns of a sparkline.
const COLUMNS: usize = 32;
const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// The summary as aligned text, ending in a new line.
pub fn text(info: &Info) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = head(&mut out, info);
    let _ = known(&mut out, info);
    let _ = topics(&mut out, &info.topics);
    let _ = nodes(&mut out, info);
    let _ = undrawn(&mut out, info);
    out
}

/// Writes the edges that source code offers and that are not drawn.
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
    for bag in &info.bags {
        let how = bag
            .tier_reason
            .as_ref()
            .map_or_else(String::new, |why| format!(" ({})", visible(why)));
        let state = if bag.complete { "" } else { ", damaged" };
        let compression = bag.compression.join("+");
        let compression = visible(&compression);
        writeln!(
            out,
            "{}  {} {compression}, {}, read by {}{how}{state}",
            visible(&bag.name),
            bag.format,
            words::bytes(bag.file_bytes),
            bag.tier
        )?;
        for (key, value) in &bag.facts {
            writeln!(out, "  {}: {}", visible(key), visible(value))?;
        }
    }
    let (start, end) = (Stamp(info.start_ns), Stamp(info.end_ns));
    writeln!(out, "from  {start}\nto    {end}")?;
    writeln!(
        out,
        "{} of mission, {} messages\n",
        words::offset((info.end_ns - 1).saturating_sub(info.start_ns) / 1_000_000 * 1_000_000),
        info.messages
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
    let unknown: u32 = info
        .topics
        .iter()
        .filter_map(|t| t.unknown_publishers)
        .sum();
    let counted = match unknown as usize {
        0 => String::new(),
        n => format!(
            " (the bag counts {} that nobody names)",
            words::count(n, "publisher")
        ),
    };
    writeln!(
        out,
        "of {with} topics with messages, {} have a known publisher{counted}, {} a known subscriber",
        with - info.topics_without_publisher,
        with - info.topics_without_subscriber
    )?;
    for row in &info.evidence {
        let parts = [
            (row.nodes, "node"),
            (row.publishes, "publication"),
            (row.subscribes, "subscription"),
        ];
        let parts: Vec<String> = parts
            .iter()
            .filter(|(n, _)| *n > 0)
            .map(|(n, what)| words::count(*n, what))
            .collect();
        writeln!(out, "  {:<18} {}", row.source, parts.join(", "))?;
    }
    info.advice
        .iter()
        .try_for_each(|line| writeln!(out, "to know more: {line}"))?;
    for figure in &info.figures {
        let (word, shows) = (figure.figure, &figure.shows);
        writeln!(out, "for a paper: `--figure {word}` shows {shows}")?;
    }
    writeln!(out)
}

/// A count with its degrees, such as `34 nodes (31 measured, 3 stated)`.
pub(crate) fn how_many(what: &str, degrees: DegreeCounts) -> String {
    let parts = [
        (degrees.measured, "measured"),
        (degrees.stated, "stated"),
        (degrees.inferred, "inferred"),
        (degrees.declared, "declared"),
    ];
    let parts: Vec<String> = parts
        .iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, word)| format!("{n} {word}"))
        .collect();
    let inner = if parts.is_empty() {
        String::new()
    } else {
        format!(" ({})", parts.join(", "))
    };
    words::count(degrees.total(), what) + &inner
}

fn topics(out: &mut String, topics: &[TopicInfo]) -> std::fmt::Result {
    writeln!(out, "topics")?;
    let width = topics
        .iter()
        .map(|t| t.name.chars().count())
        .max()
        .unwrap_or(0)
        .min(60);
    let kinds = topics
        .iter()
        .map(|t| t.types.join(" ").chars().count())
        .max()
        .unwrap_or(0)
        .min(40);
    for topic in topics {
        let rate = topic.hz.map_or_else(String::new, words::rate);
        let types = topic.types.join(" ");
        let types = visible(&types);
        let bars = sparkline(&topic.activity);
        writeln!(
            out,
            "  {:<width$}  {types:<kinds$}  {:>9}  {rate:>9}  {bars}",
            visible(topic.name.as_str()),
            topic.count
        )?;
    }
    writeln!(out)
}

fn nodes(out: &mut String, info: &Info) -> std::fmt::Result {
    writeln!(out, "nodes")?;
    let width = info
        .nodes
        .iter()
        .map(|n| n.name.chars().count())
        .max()
        .unwrap_or(0)
        .min(60);
    for node in &info.nodes {
        let life = |at: Option<i64>| {
            at.map_or_else(
                || "?".to_owned(),
                |at| words::offset_seconds(at - info.start_ns),
            )
        };
        let span = format!("{} – {}", life(node.first_ns), life(node.last_ns));
        writeln!(
            out,
            "  {:<width$}  {:<9} {span:>15}  {}",
            visible(node.name.as_str()),
            node.degree,
            load(node, info.duration_s)
        )?;
    }
    Ok(())
}

/// The messages that a node sends and receives per second of the mission.
fn load(node: &NodeInfo, duration_s: f64) -> String {
    let rate = |count: u64| words::number(count as f64 / duration_s.max(1e-3));
    let topics = |n: usize| words::count(n, "topic");
    let mut parts = Vec::new();
    if node.publishes > 0 {
        let sent = node
            .sent
            .map_or_else(String::new, |n| format!(" {} msg/s", rate(n)));
        parts.push(format!("sends{sent} on {}", topics(node.publishes)));
    }
    if let Some(received) = node.received {
        parts.push(format!(
            "receives up to {} msg/s on {}",
            rate(received),
            topics(node.subscribes)
        ));
    }
    parts.join(", ")
}

/// Messages over time as bars; a blank where there are no messages.
fn sparkline(activity: &[u64]) -> String {
    let columns = activity.len().clamp(1, COLUMNS);
    let part = |k: usize| {
        let (from, to) = (
            k * activity.len() / columns,
            (k + 1) * activity.len() / columns,
        );
        activity[from..to].iter().sum::<u64>()
    };
    let sums: Vec<u64> = (0..columns).map(part).collect();
    let most = sums.iter().copied().max().unwrap_or(0).max(1);
    // Rounded up, so that a single message is a bar.
    let bar = |n: u64| {
        if n == 0 {
            ' '
        } else {
            BARS[usize::try_from((n * 8).div_ceil(most) - 1)
                .unwrap_or(7)
                .min(7)]
        }
    };
    sums.into_iter().map(bar).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sparkline_shows_silence_as_blanks() {
        assert_eq!(sparkline(&[0, 1, 4, 8]), " ▁▄█");
        assert_eq!(sparkline(&[]), " ");
        assert_eq!(sparkline(&[1; 100]).chars().count(), COLUMNS);
    }
}
