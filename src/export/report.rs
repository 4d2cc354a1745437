//! A report in Markdown for a pull request or a job summary: what changed, when, drawn and in tables.

pub(crate) mod encoder;
pub(crate) mod escape;
mod graph;
mod tables;

use std::fmt::Write as _;

use crate::base::words;
use crate::draw::style::{BUILTIN, Style};
use crate::export::mermaid;
use crate::export::sequence::Sequence;
use crate::mission::Mission;
use crate::view::{Counts, View};
use escape::{address, plain};

/// The most bytes of each part; together they stay below 256 KiB, a quarter of what a job summary may hold.
const MOST_CHANGES: usize = 96 << 10;
const MOST_TABLE: usize = 40 << 10;
const MOST_NOTICES: usize = 16 << 10;
/// So many phrases are written out for one window; the rest is counted.
const MOST_PHRASES: usize = 12;
/// A chart of more characters than this is left out: GitHub's Mermaid stops at 50,000.
const MOST_CHART: usize = 45_000;

/// The report.
pub(crate) fn report(sequence: &Sequence<'_>) -> String {
    let (mission, view) = (sequence.mission, sequence.view);
    let mut out = headline(sequence, view) + "\n\n";
    let links = sequence.options.links.iter();
    let links: Vec<String> = links
        .map(|(name, url)| format!("[{}](<{}>)", plain(name), address(url)))
        .collect();
    if !links.is_empty() {
        let _ = writeln!(out, "{}\n", links.join(" · "));
    }
    out.push_str(&changes(view));
    out.push_str(&chart(view));
    out.push_str(&tables::nodes(mission, MOST_TABLE));
    out.push_str(&tables::topics(mission, MOST_TABLE));
    out.push_str(&tables::evidence(mission));
    out.push_str(&notices(mission));
    out
}

/// The one line that says it all.
fn headline(sequence: &Sequence<'_>, view: &View) -> String {
    let title = sequence.picture.graph().map_or_else(
        || {
            sequence
                .mission
                .bags
                .first()
                .map_or(String::new(), |b| b.name.clone())
        },
        |whole| whole.title.to_owned(),
    );
    let mut out = format!("**{}**: ", plain(&title));
    let (Some(first), Some(last)) = (view.frames.first(), view.frames.last()) else {
        return out + "no windows.";
    };
    let span = last.span.end.since(first.span.start) / 1_000_000 * 1_000_000;
    let _ = write!(
        out,
        "{} from {} in {} of {}; ",
        words::offset(span),
        first
            .span
            .start
            .rfc3339()
            .unwrap_or_else(|| first.span.start.to_string()),
        words::count(view.frames.len(), "window"),
        words::period(first.span.nanos())
    );
    let changed = (0..view.frames.len())
        .filter(|k| view.is_changed(*k))
        .count();
    if changed == 0 {
        return out + "nothing changed.";
    }
    let told = told(
        &view
            .frames
            .iter()
            .fold(Counts::default(), |sum, f| sum + f.counts),
    );
    let _ = write!(out, "changes in {changed}: {}.", told.join(", "));
    out
}

/// What the headlines of all windows count, in words.
fn told(counts: &Counts) -> Vec<String> {
    let all = [
        (counts.nodes_added, "node", " started"),
        (counts.nodes_removed, "node", " stopped"),
        (counts.restarted, "restart", ""),
        (counts.handed_over, "hand-over", ""),
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

fn changes(view: &View) -> String {
    let start = view.frames.first().map(|f| f.span.start);
    let frames = view.frames.iter().filter(|f| !f.headlines.is_empty());
    let rows = frames.map(|frame| {
        let at = start.map_or(0, |s| frame.span.start.since(s)) / 1_000_000 * 1_000_000;
        let words = frame.words(MOST_PHRASES);
        format!(
            "| {} | {} | {} |\n",
            words::offset(at),
            frame.index + 1,
            plain(&words)
        )
    });
    let table = tables::table(&["Time", "Window", "What changed"], rows, MOST_CHANGES);
    table.map_or(String::new(), |table| table + "\n")
}

fn chart(view: &View) -> String {
    let Some((frame, left_out)) = graph::changed(view) else {
        return String::new();
    };
    // The picture's own style may be dark; Markdown is read on any ground.
    let Ok(style) = Style::builtin(BUILTIN[0].0) else {
        return String::new();
    };
    let chart = mermaid::chart(view, &style, &frame);
    if chart.len() > MOST_CHART {
        return "The graph of what changed is too large for Markdown.\n\n".to_owned();
    }
    let mut out = String::from("What changed, and what stands beside it:\n\n");
    let _ = writeln!(out, "```mermaid\n{}\n```\n", chart.trim_end());
    if left_out > 0 {
        let _ = writeln!(
            out,
            "{} more left out of the graph.\n",
            words::count(left_out, "edge")
        );
    }
    out
}

fn notices(mission: &Mission) -> String {
    let mut out = String::new();
    for notice in mission.notices.iter() {
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
