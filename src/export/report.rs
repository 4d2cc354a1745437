//! A report in Markdown for a pull request or a job summary: the changes with their times, drawn and in tables.

mod changes;
mod chart;
mod elements;

use std::fmt::Write as _;

use super::{Started, one_text};
use crate::base::file;
use crate::base::notice::{Notice, Notices};
use crate::base::time::Stamp;
use crate::base::words;
use crate::export::markdown::{self, address, folded, plain};
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::view::{Counts, View};

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
    out.push_str(&chart::chart(view));
    out.push_str(&elements::nodes(mission, view));
    out.push_str(&elements::topics(mission, view));
    out.push_str(&elements::evidence(mission));
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
    format!(
        "**{}**: {said}.\n\n{} from {}, in {} of {lengths}{}.",
        plain(&title),
        words::duration(last.span.end.since(first.span.start)),
        words::date_and_clock(first.span.start.0),
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

#[cfg(test)]
mod tests;
