//! The nodes and topics of a report, and how well they are known.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::{MOST_TABLE, folded_table};
use crate::base::time::Stamp;
use crate::base::words;
use crate::base::words::count;
use crate::evidence::Evidence;
use crate::export::markdown::{code, folded, plain, row};
use crate::graph::{Element, Existence, Graphs};
use crate::mission::Mission;
use crate::mission::info::{how_many, info};
use crate::view::View;

/// The number of windows that contain an element, with its messages and the sum of its rates in them.
#[derive(Default)]
struct WindowsOf {
    windows: usize,
    messages: u64,
    hz: f64,
    rated: usize,
}

impl WindowsOf {
    fn new(graphs: &Graphs, what: Element) -> Self {
        let mut all = Self::default();
        for (at, row) in graphs.rows(what) {
            all.windows += 1;
            all.messages += row.count.unwrap_or(0);
            if let Some(hz) = row.hz(graphs.spans()[at]) {
                all.hz += hz;
                all.rated += 1;
            }
        }
        all
    }

    fn mean(&self) -> String {
        match self.rated {
            0 => "–".to_owned(),
            n => words::number(self.hz / n as f64),
        }
    }
}

fn seen(mission: &Mission, seen: &Existence) -> String {
    let at = |t: Stamp| words::offset_seconds(mission.offset(t));
    match (seen.first, seen.last) {
        (Some(first), Some(last)) => format!("{} – {}", at(first), at(last)),
        _ => "–".to_owned(),
    }
}

/// The kinds of its evidence, without those common to all elements.
fn words(evidence: Evidence) -> String {
    let words = evidence.words().filter(|word| *word != "rosout_rule");
    words.collect::<Vec<_>>().join(", ")
}

/// The elements that a view shows.
fn shown(view: &View) -> BTreeSet<Element> {
    view.items
        .iter()
        .flat_map(|item| item.members.iter().copied())
        .collect()
}

/// Every node that is shown.
pub(super) fn nodes(mission: &Mission, view: &View) -> String {
    let shown = shown(view);
    let all = mission.elements.nodes.with_ids();
    let all = all.filter(|(id, _)| shown.contains(&Element::Node(*id)));
    let rows = all.map(|(id, node)| {
        let there = WindowsOf::new(&mission.graphs, Element::Node(id));
        row([
            code(node.name.as_str()),
            seen(mission, &node.seen),
            there.windows.to_string(),
            there.mean(),
            words(node.seen.evidence),
        ])
    });
    let rows: Vec<String> = rows.collect();
    let heads = ["Node", "Seen", "Windows", "Hz sent on average", "Known by"];
    folded_table(&count(rows.len(), "node"), &heads, rows, MOST_TABLE)
}

/// Every topic that is shown.
pub(super) fn topics(mission: &Mission, view: &View) -> String {
    let shown = shown(view);
    let all = mission.elements.topics.with_ids();
    let all = all.filter(|(id, _)| shown.contains(&Element::Topic(*id)));
    let rows = all.map(|(id, topic)| {
        let there = WindowsOf::new(&mission.graphs, Element::Topic(id));
        let types: Vec<String> = topic.types.iter().map(|t| code(t)).collect();
        row([
            code(topic.name.as_str()),
            types.join(", "),
            seen(mission, &topic.seen),
            there.windows.to_string(),
            there.messages.to_string(),
            there.mean(),
            words(topic.seen.evidence),
        ])
    });
    let rows: Vec<String> = rows.collect();
    let heads = [
        "Topic",
        "Type",
        "Seen",
        "Windows",
        "Messages",
        "Hz on average",
        "Known by",
    ];
    folded_table(&count(rows.len(), "topic"), &heads, rows, MOST_TABLE)
}

/// The strength of the evidence for the graph, as sentences, and the bags.
pub(super) fn evidence(mission: &Mission) -> String {
    let info = info(mission);
    let parts = [
        ("node", info.nodes_by_degree),
        ("publication", info.publishes_by_degree),
        ("subscription", info.subscribes_by_degree),
    ];
    let parts = parts.map(|(word, confidences)| how_many(word, confidences));
    let with = info.topics.iter().filter(|t| t.count > 0).count();
    let mut out = format!(
        "Known are {}. Of {} with messages, {} have a known publisher and {} a known subscriber.\n\n",
        parts.join(", "),
        count(with, "topic"),
        with.saturating_sub(info.topics_without_publisher),
        with.saturating_sub(info.topics_without_subscriber),
    );
    for line in &info.advice {
        let _ = writeln!(out, "- to learn more: {}", plain(line));
    }
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
    folded(
        "Strength of the evidence",
        &(out.trim_end().to_owned() + "\n"),
    )
}
