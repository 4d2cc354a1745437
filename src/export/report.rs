//! A report in Markdown for a pull request or a job summary: the changes with their times, drawn and in tables.

mod chart;

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::{Started, one_text};
use crate::base::file;
use crate::base::notice::{Notice, Notices};
use crate::base::time::Stamp;
use crate::base::words;
use crate::evidence::Evidence;
use crate::export::markdown::{self, address, code, folded, plain, row};
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::graph::{Element, Existence};
use crate::mission::Mission;
use crate::mission::info::summary::{Most, described};
use crate::mission::info::{Info, how_many, info};
use crate::view::View;

/// The most bytes of each part; together they stay below 256 KiB, a quarter of the limit of a job summary.
const MOST_CHANGES: usize = 96 << 10;
const MOST_TABLE: usize = 40 << 10;
const MOST_NOTICES: usize = 16 << 10;

/// The most expanded rows of a table; the rest is collapsed.
const MOST_OPEN: usize = 20;

/// Begins the report; it follows the text already in the file if that is the file to append to.
///
/// # Errors
/// As [`one_text`]; as [`file::text_before`] for the file to append to.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let before = file::text_before(target.path(), sequence.options.append_to.as_deref())?;
    one_text(target, move || before + &report(sequence))
}

/// The report.
fn report(sequence: &Sequence<'_>) -> String {
    let mission = sequence.mission;
    let view = sequence.unfolded.map_or(sequence.view, |all| all.view);
    let info = info(mission);
    let mut out = verdict(sequence, view, &info) + "\n\n";
    let links = sequence.options.links.iter();
    let links: Vec<String> = links
        .map(|(name, url)| format!("[{}](<{}>)", plain(name), address(url)))
        .collect();
    if !links.is_empty() {
        let _ = writeln!(out, "{}\n", links.join(" · "));
    }
    let mut links = sequence.options.links.iter();
    let first = view.frames.first();
    let times = ReportTimes {
        start: first.map_or(mission.span.start, |f| f.span.start),
        player: links.find(|(name, _)| name == "player"),
    };
    out.push_str(&phases(mission, &times));
    out.push_str(&changes(mission, view, &times));
    out.push_str(&chart::chart(view, sequence.paired));
    out.push_str(&nodes(mission, view, &info));
    out.push_str(&topics(mission, view, &info));
    out.push_str(&evidence(mission, &info));
    out.push_str(&notices(sequence.notices));
    out
}

/// Formats times, as links into the player if one is given.
struct ReportTimes<'a> {
    start: Stamp,
    player: Option<&'a (String, String)>,
}

impl ReportTimes<'_> {
    fn link(&self, at: Stamp) -> String {
        let millis = at.since(self.start).div_euclid(1_000_000);
        let text = words::offset_seconds(millis * 1_000_000);
        match self.player {
            None => text,
            Some((_, url)) => {
                let page = url.split('#').next().unwrap_or(url);
                format!("[{text}](<{}#t={}>)", address(page), millis as f64 / 1e3)
            }
        }
    }
}

/// The first lines: the mission as one sentence, and how it is divided.
fn verdict(sequence: &Sequence<'_>, view: &View, info: &Info) -> String {
    let title = title(sequence);
    let Some(first) = view.frames.first() else {
        return format!("**{}**: no windows.", plain(&title));
    };
    let changed = view.frames.iter().filter(|frame| frame.is_changed());
    let changed = changed.count();
    let of_them = (changed > 0).then(|| format!(", {changed} of them with changes"));
    let lengths = words::period(first.span.nanos());
    let date = words::date_and_clock(first.span.start.0);
    format!(
        "**{}**: {}.\n\n{}{} of {lengths}{}.",
        plain(&title),
        plain(&info.summary),
        date.map_or_else(String::new, |date| format!("From {date}, in ")),
        words::count(view.frames.len(), "window"),
        of_them.unwrap_or_default(),
    )
}

fn title(sequence: &Sequence<'_>) -> String {
    let bags = &sequence.mission.bags;
    let bag = || bags.first().map_or(String::new(), |b| b.name.clone());
    sequence.picture.title().map_or_else(bag, str::to_owned)
}

fn notices(notices: &Notices) -> String {
    let line = |notice: Notice| format!("- {}\n", plain(&notice.text) + &notice.times());
    let mut lines: Vec<String> = notices.iter().map(line).collect();
    if markdown::cut(&mut lines, MOST_NOTICES) > 0 {
        lines.push("- and more\n".to_owned());
    }
    if lines.is_empty() {
        return String::new();
    }
    folded("Notices", &lines.concat())
}

/// A table of at most `most` bytes, whose last line states how many rows were cut; `None` without rows.
fn table(heads: &[&str], mut rows: Vec<String>, most: usize) -> Option<String> {
    if rows.is_empty() {
        return None;
    }
    let heading = markdown::table(heads, &[]).len();
    let cut = markdown::cut(&mut rows, most.saturating_sub(heading));
    let mut out = markdown::table(heads, &rows);
    if cut > 0 {
        let _ = writeln!(out, "\n{} more left out.", words::count(cut, "row"));
    }
    Some(out)
}

/// Such a table, collapsed; nothing without rows.
fn folded_table(summary: &str, heads: &[&str], rows: Vec<String>, most: usize) -> String {
    let table = table(heads, rows, most);
    table.map_or_else(String::new, |table| folded(summary, &table))
}

/// All kinds of changes of a window; the rest of a kind is counted.
const EACH_KIND: Most = Most {
    kinds: usize::MAX,
    elements: 12,
};

/// The phases, collapsed; nothing if there is only one.
fn phases(mission: &Mission, times: &ReportTimes<'_>) -> String {
    let phases = &mission.log.phases;
    if phases.len() < 2 {
        return String::new();
    }
    let rows = phases.iter().zip(1..).map(|(phase, n)| {
        let from = times.link(phase.span.start);
        let long = words::duration(phase.span.nanos());
        row(&[n.to_string(), from, long, plain(&phase.name)])
    });
    let summary = words::count(phases.len(), "phase");
    let heads = ["Phase", "From", "For", "Name"];
    folded_table(&summary, &heads, rows.collect(), MOST_CHANGES)
}

/// The windows with changes; those beyond the first ones are collapsed.
fn changes(mission: &Mission, view: &View, times: &ReportTimes<'_>) -> String {
    let frames = view.frames.iter().filter(|f| !f.headlines.is_empty());
    let rows = frames.map(|frame| {
        let events = frame.headlines.iter().map(|headline| headline.event);
        let events = events.filter_map(|id| Some((id, mission.log.events.get(id)?)));
        let changes = described(mission, &events.collect::<Vec<_>>(), EACH_KIND);
        row(&[times.link(frame.span.start), plain(&changes)])
    });
    let mut open: Vec<String> = rows.collect();
    let rest = open.split_off(open.len().min(MOST_OPEN));
    let heads = ["Window", "Changes"];
    let table = table(&heads, open, MOST_CHANGES / 2);
    let summary = format!("{} more with changes", words::count(rest.len(), "window"));
    let rest = folded_table(&summary, &heads, rest, MOST_CHANGES / 2);
    table.map_or(String::new(), |table| table + "\n") + &rest
}

/// A rate in Hz; a dash for none.
fn hz(hz: Option<f64>) -> String {
    hz.map_or_else(|| "–".to_owned(), words::number)
}

fn seen(mission: &Mission, seen: &Existence) -> String {
    let at = |t: Stamp| words::offset_seconds(mission.offset(t));
    match (seen.first, seen.last) {
        (Some(first), Some(last)) => format!("{} – {}", at(first), at(last)),
        _ => "–".to_owned(),
    }
}

/// The kinds of its evidence, without those common to all elements.
fn known_by(evidence: Evidence) -> String {
    let words = evidence.words().filter(|word| *word != "rosout_rule");
    words.collect::<Vec<_>>().join(", ")
}

/// The elements that a view shows.
fn shown(view: &View) -> BTreeSet<Element> {
    let members = view.items.iter().flat_map(|item| &item.members);
    members.copied().collect()
}

/// Every node that is shown.
fn nodes(mission: &Mission, view: &View, info: &Info) -> String {
    let shown = shown(view);
    let all = mission.elements.nodes.with_ids();
    let all = all.filter(|(id, _)| shown.contains(&Element::Node(*id)));
    let rows = all.map(|(id, node)| {
        let own = (info.nodes).binary_search_by_key(&node.name.as_str(), |own| &own.name);
        let own = own.ok().map(|at| &info.nodes[at]);
        row(&[
            code(node.name.as_str()),
            seen(mission, &node.seen),
            mission.graphs.rows(Element::Node(id)).count().to_string(),
            hz(own.and_then(|own| own.sent_hz)),
            known_by(node.seen.evidence),
        ])
    });
    let rows: Vec<String> = rows.collect();
    let heads = ["Node", "Seen", "Windows", "Hz while sending", "Known by"];
    folded_table(&words::count(rows.len(), "node"), &heads, rows, MOST_TABLE)
}

/// Every topic that is shown.
fn topics(mission: &Mission, view: &View, info: &Info) -> String {
    let shown = shown(view);
    let all = mission.elements.topics.with_ids();
    let all = all.filter(|(id, _)| shown.contains(&Element::Topic(*id)));
    let rows = all.map(|(id, topic)| {
        let own = (info.topics).binary_search_by_key(&topic.name.as_str(), |own| &own.name);
        let own = own.ok().map(|at| &info.topics[at]);
        let types: Vec<String> = topic.types.iter().map(|t| code(t)).collect();
        row(&[
            code(topic.name.as_str()),
            types.join(", "),
            seen(mission, &topic.seen),
            mission.graphs.rows(Element::Topic(id)).count().to_string(),
            own.map_or(0, |own| own.count).to_string(),
            hz(own.and_then(|own| own.hz)),
            known_by(topic.seen.evidence),
        ])
    });
    let rows: Vec<String> = rows.collect();
    let heads = [
        "Topic",
        "Type",
        "Seen",
        "Windows",
        "Messages",
        "Hz while sending",
        "Known by",
    ];
    folded_table(&words::count(rows.len(), "topic"), &heads, rows, MOST_TABLE)
}

/// The strength of the evidence for the graph, as sentences, and the bags.
fn evidence(mission: &Mission, info: &Info) -> String {
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
        words::count(with, "topic"),
        with.saturating_sub(info.topics_without_publisher),
        with.saturating_sub(info.topics_without_subscriber),
    );
    for line in &info.advice {
        let _ = writeln!(out, "- to learn more: {}", plain(line));
    }
    for bag in mission.bags.iter().take(50) {
        let (name, format) = (plain(&bag.name), plain(&bag.format));
        let state = ["incomplete", "complete"][usize::from(bag.complete)];
        let _ = writeln!(out, "- {name}: {format}, {state}");
    }
    let out = out.trim_end().to_owned() + "\n";
    folded("Strength of the evidence", &out)
}

#[cfg(test)]
mod tests;
