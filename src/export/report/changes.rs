//! The changes with their times and full names: a row per window, and a row per phase.

use super::{MOST_CHANGES, MOST_OPEN, ReportTimes, folded_table};
use crate::base::words;
use crate::export::markdown::{plain, row};
use crate::graph::{Element, Elements};
use crate::mission::Mission;
use crate::mission::event_log::Kind;
use crate::mission::events::sentence_with;
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
        row([n.to_string(), from, long, plain(&phase.name)])
    });
    let summary = words::count(phases.len(), "phase");
    let heads = ["Phase", "From", "For", "Name"];
    folded_table(&summary, &heads, rows.collect(), MOST_CHANGES)
}

/// The windows with changes; those beyond the first ones are collapsed.
pub(super) fn table(mission: &Mission, view: &View, times: &ReportTimes<'_>) -> String {
    let frames = view.frames.iter().filter(|f| !f.headlines.is_empty());
    let rows = frames.map(|frame| {
        let window = times.link(frame.span.start);
        row([window, changes_of(mission, frame)])
    });
    let mut open: Vec<String> = rows.collect();
    let rest = open.split_off(open.len().min(MOST_OPEN));
    let heads = ["Window", "Changes"];
    let table = super::table(&heads, open, MOST_CHANGES / 2);
    let summary = format!("{} more with changes", words::count(rest.len(), "window"));
    let rest = folded_table(&summary, &heads, rest, MOST_CHANGES / 2);
    table.map_or(String::new(), |table| table + "\n") + &rest
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
