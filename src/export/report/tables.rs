//! The tables of a report, each cut where it would become too long.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::escape::{code, plain};
use crate::base::time::Stamp;
use crate::base::words;
use crate::base::words::count;
use crate::evidence::Evidence;
use crate::mission::Mission;

/// A table of these rows, of at most `most` bytes; a last line tells how many rows were cut. `None` without rows.
pub(super) fn table(
    heads: &[&str],
    rows: impl Iterator<Item = String>,
    most: usize,
) -> Option<String> {
    let mut out = format!(
        "| {} |\n|{}\n",
        heads.join(" | "),
        "---|".repeat(heads.len())
    );
    let empty = out.len();
    let mut cut = 0;
    for row in rows {
        if cut > 0 || out.len() + row.len() > most {
            cut += 1;
        } else {
            out.push_str(&row);
        }
    }
    if cut > 0 {
        let _ = writeln!(out, "\n{} more left out.", count(cut, "row"));
    }
    (out.len() > empty).then_some(out)
}

/// Text that opens on a click.
pub(super) fn folded(summary: &str, inside: &str) -> String {
    format!(
        "<details><summary>{summary}</summary>\n\n{}\n\n</details>\n\n",
        inside.trim_end()
    )
}

/// In how many windows each was, and the sum of its rates there.
#[derive(Clone, Copy, Default)]
struct WindowsOf {
    windows: usize,
    hz: f64,
    rated: usize,
}

impl WindowsOf {
    fn add(&mut self, hz: Option<f64>) {
        self.windows += 1;
        if let Some(hz) = hz {
            self.hz += hz;
            self.rated += 1;
        }
    }

    fn mean(&self) -> String {
        match self.rated {
            0 => "–".to_owned(),
            n => words::number(self.hz / n as f64),
        }
    }
}

fn seen(mission: &Mission, first: Option<Stamp>, last: Option<Stamp>) -> String {
    let at = |t: Stamp| words::offset_seconds(mission.offset(t));
    match (first, last) {
        (Some(first), Some(last)) => format!("{} – {}", at(first), at(last)),
        _ => "–".to_owned(),
    }
}

fn words(evidence: Evidence) -> String {
    evidence.words().collect::<Vec<_>>().join(", ")
}

/// Every node of the mission.
pub(super) fn nodes(mission: &Mission, most: usize) -> String {
    let elements = &mission.elements;
    let mut presence = vec![WindowsOf::default(); elements.nodes.len()];
    for state in mission.graphs.iter().flat_map(|graph| graph.nodes) {
        if let Some(one) = presence.get_mut(state.id as usize) {
            one.add(state.hz);
        }
    }
    let rows = elements.nodes.iter().zip(&presence).map(|(node, there)| {
        format!(
            "| {} | {} | {} | {} | {} |\n",
            code(node.name.as_str()),
            seen(mission, node.first, node.last),
            there.windows,
            there.mean(),
            words(node.evidence)
        )
    });
    let heads = ["Node", "Seen", "Windows", "Hz sent", "Known by"];
    let summary = count(elements.nodes.len(), "node");
    table(&heads, rows, most).map_or(String::new(), |table| folded(&summary, &table))
}

/// Every topic of the mission.
pub(super) fn topics(mission: &Mission, most: usize) -> String {
    let elements = &mission.elements;
    let mut presence = vec![(WindowsOf::default(), 0_u64); elements.topics.len()];
    for state in mission.graphs.iter().flat_map(|graph| graph.topics) {
        if let Some((one, messages)) = presence.get_mut(state.id as usize) {
            one.add(state.hz);
            *messages += state.count;
        }
    }
    let rows = elements
        .topics
        .iter()
        .zip(&presence)
        .map(|(topic, (there, messages))| {
            let types: Vec<String> = topic.types.iter().map(|t| code(t)).collect();
            format!(
                "| {} | {} | {} | {} | {messages} | {} | {} |\n",
                code(topic.name.as_str()),
                types.join(", "),
                seen(mission, topic.first, topic.last),
                there.windows,
                there.mean(),
                words(topic.evidence)
            )
        });
    let heads = [
        "Topic", "Type", "Seen", "Windows", "Messages", "Hz", "Known by",
    ];
    let summary = count(elements.topics.len(), "topic");
    table(&heads, rows, most).map_or(String::new(), |table| folded(&summary, &table))
}

/// What the bags are and what proves the graph.
pub(super) fn evidence(mission: &Mission) -> String {
    let elements = &mission.elements;
    let lists = [
        (
            "nodes",
            elements
                .nodes
                .iter()
                .map(|n| n.evidence)
                .collect::<Vec<_>>(),
        ),
        (
            "topics",
            elements.topics.iter().map(|t| t.evidence).collect(),
        ),
        (
            "publications",
            elements.publishes.iter().map(|e| e.evidence).collect(),
        ),
        (
            "subscriptions",
            elements.subscribes.iter().map(|e| e.evidence).collect(),
        ),
    ];
    let mut counts: BTreeMap<&str, [usize; 4]> = BTreeMap::new();
    for (at, (_, list)) in lists.iter().enumerate() {
        for word in list.iter().flat_map(|evidence| evidence.words()) {
            counts.entry(word).or_default()[at] += 1;
        }
    }
    let rows = counts
        .iter()
        .map(|(word, [nodes, topics, publishes, subscribes])| {
            format!("| {word} | {nodes} | {topics} | {publishes} | {subscribes} |\n")
        });
    let heads = [
        "Known by",
        "Nodes",
        "Topics",
        "Publications",
        "Subscriptions",
    ];
    let mut out = table(&heads, rows, usize::MAX).unwrap_or_default();
    out.push('\n');
    for bag in mission.bags.iter().take(50) {
        let state = if bag.complete {
            "complete"
        } else {
            "incomplete"
        };
        let _ = writeln!(
            out,
            "- {}: {}, {state}",
            plain(&bag.name),
            plain(&bag.format)
        );
    }
    folded("Evidence", &out)
}
