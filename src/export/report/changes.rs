//! The changes with their times and full names: a row per window, and a row per phase.

use super::escape::plain;
use super::{MOST_CHANGES, MOST_OPEN, ReportTimes, tables};
use crate::base::words;
use crate::graph::{Element, Elements};
use crate::mission::Mission;
use crate::mission::event_log::Kind;
use crate::mission::event_log::sentence_with;
use crate::view::{Frame, Headline, View};

/// The most names listed per kind.
const MOST_NAMES: usize = 12;
/// The most events of a window that are listed separately.
const MOST_LISTED: usize = 12;

/// The phases, collapsed; nothing if there is only one.
pub(super) fn phases(mission: &Mission, times: &ReportTimes<'_>) -> String {
    let phases = &mission.log.phases;
    if phases.len() < 2 {
        return String::new();
    }
    let rows = phases.iter().zip(1..).map(|(phase, n)| {
        let from = times.link(phase.span.start);
        let long = words::duration(phase.span.nanos());
        format!("| {n} | {from} | {long} | {} |\n", plain(&phase.name))
    });
    let table = tables::table(&["Phase", "From", "For", "Name"], rows, MOST_CHANGES);
    let summary = words::count(phases.len(), "phase");
    table.map_or(String::new(), |table| tables::folded(&summary, &table))
}

/// The windows with changes; those beyond the first ones are collapsed.
pub(super) fn table(mission: &Mission, view: &View, times: &ReportTimes<'_>) -> String {
    let frames = view.frames.iter().filter(|f| !f.headlines.is_empty());
    let rows = frames.map(|frame| {
        let what = changes_of(mission, frame);
        format!("| {} | {what} |\n", times.link(frame.span.start))
    });
    let rows: Vec<String> = rows.collect();
    let (open, rest) = rows.split_at(rows.len().min(MOST_OPEN));
    let table = |rows: &[String]| {
        let heads = ["Window", "Changes"];
        tables::table(&heads, rows.iter().cloned(), MOST_CHANGES / 2)
    };
    let mut out = table(open).map_or(String::new(), |table| table + "\n");
    if let Some(table) = table(rest) {
        let summary = format!("{} more with changes", words::count(rest.len(), "window"));
        out += &tables::folded(&summary, &table);
    }
    out
}

/// The kinds of headlines that are grouped, with their labels.
const TOGETHER: [(Kind, &str, &str); 5] = [
    (Kind::Started, "node", "started"),
    (Kind::Stopped, "node", "stopped"),
    (Kind::Restarted, "node", "restarted"),
    (Kind::Appeared, "connection", "made"),
    (Kind::Vanished, "connection", "ended"),
];

/// The changes of a window as Markdown: `2 nodes started: /a, /b; /t handed over: /a → /b`.
fn changes_of(mission: &Mission, frame: &Frame) -> String {
    let elements = &mission.elements;
    let mut parts = Vec::new();
    for (kind, word, what) in TOGETHER {
        let of_kind = frame.headlines.iter().filter(|h| h.kind == kind);
        let all: Vec<&Headline> = of_kind.filter(|h| is_together(h)).collect();
        if !all.is_empty() {
            let names: Vec<String> = all.iter().map(|h| plain(&name(elements, h.what))).collect();
            let count = words::count(all.len(), word);
            let names = words::some_of(&names, MOST_NAMES);
            parts.push(format!("{count} {what}: {names}"));
        }
    }
    let rest: Vec<&Headline> = frame.headlines.iter().filter(|h| !is_together(h)).collect();
    for headline in rest.iter().take(MOST_LISTED) {
        let event = mission.log.events.get(headline.event);
        parts.extend(event.map(|event| plain(&sentence_with(mission, &[], event))));
    }
    if rest.len() > MOST_LISTED {
        parts.push(format!("and {} more", rest.len() - MOST_LISTED));
    }
    parts.join("; ")
}

/// Whether headlines of this kind are grouped; topics of unknown publishers appear and vanish separately.
fn is_together(headline: &Headline) -> bool {
    let kinds = TOGETHER.iter().any(|(kind, ..)| *kind == headline.kind);
    kinds && !headline.what.is_topic()
}

/// The name of an element: the role of a node, the name of a topic, both ends of an edge.
fn name(elements: &Elements, what: Element) -> String {
    let (node, topic) = elements.ends(what);
    let node = node.map(|id| &*elements.nodes[id].role);
    let topic = topic.map(|id| elements.topics[id].name.as_str());
    match (node, topic, what) {
        (Some(node), Some(topic), Element::Subscribe(_)) => format!("{topic} → {node}"),
        (Some(node), Some(topic), _) => format!("{node} → {topic}"),
        (node, topic, _) => node.or(topic).unwrap_or_default().to_owned(),
    }
}
