//! A report in Markdown for a pull request or a job summary: the changes with their times, drawn and in tables.

mod changes;
pub(crate) mod encoder;
pub(crate) mod escape;
mod graph;
mod tables;

use std::fmt::Write as _;

use crate::base::notice::Notices;
use crate::base::time::Stamp;
use crate::base::words;
use crate::draw::style::{BUILTIN, Style};
use crate::export::mermaid;
use crate::export::sequence::Sequence;
use crate::view::{Counts, View};
use escape::{address, plain};

/// The most bytes of each part; together they stay below 256 KiB, a quarter of the limit of a job summary.
const MOST_CHANGES: usize = 96 << 10;
const MOST_TABLE: usize = 40 << 10;
const MOST_NOTICES: usize = 16 << 10;
/// The most characters of a chart; a longer one is left out, as GitHub's Mermaid stops at 50,000.
const MOST_CHART: usize = 45_000;

/// The most expanded rows of a table; the rest is collapsed.
const MOST_OPEN: usize = 20;
/// The most edges of an expanded chart; larger ones are collapsed.
const MOST_EDGES_OPEN: usize = 25;

/// The report.
pub(crate) fn report(sequence: &Sequence<'_>) -> String {
    let mission = sequence.mission;
    let view = sequence.unfolded.map_or(sequence.view, |all| all.view);
    let mut out = verdict(sequence, view) + "\n\n";
    let links = sequence.options.links.iter();
    let links: Vec<String> = links
        .map(|(name, url)| format!("[{}](<{}>)", plain(name), address(url)))
        .collect();
    if !links.is_empty() {
        let _ = writeln!(out, "{}\n", links.join(" · "));
    }
    let times = ReportTimes {
        start: view
            .frames
            .first()
            .map_or(mission.span.start, |f| f.span.start),
        player: sequence
            .options
            .links
            .iter()
            .find(|(name, _)| name == "player"),
    };
    out.push_str(&changes::phases(mission, &times));
    out.push_str(&changes::table(mission, view, &times));
    out.push_str(&chart(view));
    out.push_str(&tables::nodes(mission, view, MOST_TABLE));
    out.push_str(&tables::topics(mission, view, MOST_TABLE));
    out.push_str(&tables::evidence(mission));
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

/// The first lines: the changes in short, and the bag.
fn verdict(sequence: &Sequence<'_>, view: &View) -> String {
    let title = title(sequence);
    let (Some(first), Some(last)) = (view.frames.first(), view.frames.last()) else {
        return format!("**{}**: no windows.", plain(&title));
    };
    let counts = view
        .frames
        .iter()
        .fold(Counts::default(), |sum, f| sum + f.counts);
    let headline_counts = headline_counts(&counts);
    let said = if headline_counts.is_empty() {
        "nothing changed".to_owned()
    } else {
        headline_counts.join(", ")
    };
    let changed = (0..view.frames.len())
        .filter(|k| view.is_changed(*k))
        .count();
    let lengths = words::period(first.span.nanos());
    let date = words::date_and_clock(first.span.start.0);
    format!(
        "**{}**: {said}.\n\n{}{}, in {} of {lengths}{}.",
        plain(&title),
        words::duration(last.span.end.since(first.span.start)),
        date.map_or_else(String::new, |date| format!(" from {date}")),
        words::count(view.frames.len(), "window"),
        if changed == 0 {
            String::new()
        } else {
            format!(", {changed} of them with changes")
        },
    )
}

fn title(sequence: &Sequence<'_>) -> String {
    let bag = || {
        sequence
            .mission
            .bags
            .first()
            .map_or(String::new(), |b| b.name.clone())
    };
    sequence.picture.title().map_or_else(bag, str::to_owned)
}

/// The number of headlines of all windows, as text.
fn headline_counts(counts: &Counts) -> Vec<String> {
    let all = [
        (counts.nodes_added, "node", " started"),
        (counts.nodes_removed, "node", " stopped"),
        (counts.restarted, "node", " restarted"),
        (counts.handed_over, "topic", " handed over"),
        (counts.silent, "silence", ""),
        (counts.topics_added, "topic", " appeared"),
        (counts.topics_removed, "topic", " vanished"),
        (counts.edges_added, "connection", " made"),
        (counts.edges_removed, "connection", " ended"),
        (counts.values, "state", " changed"),
        (counts.rates, "rate", " changed"),
    ];
    let present = all.iter().filter(|(n, _, _)| *n > 0);
    present
        .map(|(n, word, what)| words::count(*n, word) + what)
        .collect()
}

fn chart(view: &View) -> String {
    let Some((seen, left_out)) = graph::changed(view) else {
        return String::new();
    };
    // The picture's style may be dark, but Markdown has any background.
    let Ok(style) = Style::builtin(BUILTIN[0].0) else {
        return String::new();
    };
    let chart = mermaid::chart(view, &style, &seen);
    if chart.len() > MOST_CHART {
        return "The graph of the changes is too large for Markdown.\n\n".to_owned();
    }
    let mut out = format!("```mermaid\n{}\n```\n\n", chart.trim_end());
    out += "Solid green: present only at the end. Dashed orange: present only at the start. Purple: changed in between.\n";
    if left_out > 0 {
        let _ = writeln!(
            out,
            "\n{} left out of the graph.",
            words::count(left_out, "edge")
        );
    }
    let edges = words::count(seen.arrows.len(), "edge");
    if seen.arrows.len() > MOST_EDGES_OPEN {
        return tables::folded(&format!("Graph of the changes ({edges})"), &out);
    }
    format!("Changed elements and their neighbours:\n\n{out}\n")
}

fn notices(notices: &Notices) -> String {
    let mut out = String::new();
    for notice in notices.iter() {
        let times = if notice.count > 1 {
            format!(" ({} times)", notice.count)
        } else {
            String::new()
        };
        let line = format!("- {}{times}\n", plain(&notice.text));
        if out.len() + line.len() > MOST_NOTICES {
            out.push_str("- and more\n");
            break;
        }
        out.push_str(&line);
    }
    if out.is_empty() {
        out
    } else {
        tables::folded("Notices", &out)
    }
}

#[cfg(test)]
mod tests;
