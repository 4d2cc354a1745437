//! The rows of a figure of lifelines and their order: the staircase, namespaces, collapsed rows.

use std::collections::BTreeSet;

use super::marks::Marks;
use super::tracks::Track;
use crate::base::name::{last_part, namespace};
use crate::base::time::{Span, Stamp};
use crate::base::words;

/// The part of the mission, one in this many, up to which starts count as one burst.
const BURST: i64 = 66;
/// The number of parts of the mission that make the grid on which ends are compared.
const END: i64 = 33;
/// The least number of constant rows that are collapsed.
const FEWEST_FOLDED: usize = 3;
/// The most rows that are drawn separately in a figure without starts and stops.
const MOST_OPEN: usize = 12;

/// One row of the figure.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum FigureRow {
    /// The title of a namespace.
    Space(String),
    /// A track, by index, with its label; members of a titled namespace are indented.
    Track(usize, String, bool),
    /// Tracks that exist throughout, by index, and their namespace.
    Folded(Vec<usize>, String),
}

impl FigureRow {
    /// Whether it represents this track.
    pub(crate) fn holds(&self, track: usize) -> bool {
        match self {
            Self::Space(_) => false,
            Self::Track(at, ..) => *at == track,
            Self::Folded(all, _) => all.contains(&track),
        }
    }
}

/// All rows in order. Marked tracks are not collapsed.
pub(crate) fn rows(tracks: &[Track], whole: Span, marks: &Marks) -> Vec<FigureRow> {
    let marked = marks.marked();
    let mut spaces: Vec<(bool, Stamp, &str, Vec<usize>)> = Vec::new();
    for (at, track) in tracks.iter().enumerate() {
        let space = namespace(&track.name);
        match spaces.iter_mut().find(|(.., name, _)| *name == space) {
            Some((_, start, _, own)) => {
                *start = (*start).min(track.start());
                own.push(at);
            }
            None => spaces.push((space != "/", track.start(), space, vec![at])),
        }
    }
    spaces.sort_by(|a, b| (a.0, a.1, a.2).cmp(&(b.0, b.1, b.2)));
    let mut rows = Vec::new();
    for (_, _, space, own) in spaces {
        rows.extend(of_space(tracks, whole, (marks, &marked), space, own));
    }
    rows
}

fn of_space(
    tracks: &[Track],
    whole: Span,
    (marks, marked): (&Marks, &BTreeSet<usize>),
    space: &str,
    own: Vec<usize>,
) -> Vec<FigureRow> {
    if let [only] = own[..] {
        let name = tracks[only].name.trim_start_matches('/');
        return vec![FigureRow::Track(only, name.to_owned(), false)];
    }
    let mut rows = vec![FigureRow::Space(space.to_owned())];
    let is_folded = |at: &usize| !marked.contains(at) && is_throughout(&tracks[*at], whole);
    let mut folded: Vec<usize> = own.iter().copied().filter(is_folded).collect();
    // If nothing else is shown, a few rows are more informative than their number.
    let is_all = folded.len() == tracks.len() && tracks.len() <= MOST_OPEN;
    if folded.len() < FEWEST_FOLDED || is_all {
        folded.clear();
    }
    let open = own
        .into_iter()
        .filter(|at| folded.binary_search(at).is_err());
    let open = in_order(tracks, whole, marks, open.collect());
    if !folded.is_empty() {
        rows.push(FigureRow::Folded(folded, space.to_owned()));
    }
    rows.extend(open.into_iter().map(|at| {
        let label = last_part(&tracks[at].name).to_owned();
        FigureRow::Track(at, label, true)
    }));
    rows
}

/// Whether a track exists from (nearly) the first moment to the last, without a gap or a step.
fn is_throughout(track: &Track, whole: Span) -> bool {
    let [life] = track.lives[..] else {
        return false;
    };
    let nanos = whole.nanos();
    let steady = track.topic.is_none() || track.bars.len() == 1;
    life.span.start.since(whole.start) <= nanos / 20 && steady
}

/// The tracks sorted by burst of start, then by end, the latest first, then by name.
fn in_order(tracks: &[Track], whole: Span, marks: &Marks, mut own: Vec<usize>) -> Vec<usize> {
    own.sort_by_key(|at| (tracks[*at].start(), *at));
    let (near, grid) = (whole.nanos() / BURST, (whole.nanos() / END).max(1));
    let mut bursts: Vec<Vec<usize>> = Vec::new();
    let mut last: Option<Stamp> = None;
    for at in own {
        let start = tracks[at].start();
        match bursts.last_mut() {
            Some(burst) if last.is_some_and(|l| start.since(l) <= near) => burst.push(at),
            _ => bursts.push(vec![at]),
        }
        last = Some(start);
    }
    let end = |at: usize| {
        marks
            .ends(at)
            .then(|| tracks[at].end().since(whole.start) / grid)
    };
    // Elements that never end come first.
    let end = |at: usize| end(at).unwrap_or(i64::MAX);
    for burst in &mut bursts {
        burst.sort_by(|a, b| {
            let late = end(*b).cmp(&end(*a));
            late.then_with(|| tracks[*a].name.cmp(&tracks[*b].name))
        });
    }
    bursts.concat()
}

/// The label of a collapsed row: `8 nodes throughout`.
pub(crate) fn folded_label(tracks: &[Track], all: &[usize]) -> String {
    let word = match all.first().and_then(|at| tracks[*at].topic) {
        Some(_) => "topic",
        None => "node",
    };
    format!("{} throughout", words::count(all.len(), word))
}
