//! The figure that was asked for: its phases named, drawn, and put into LaTeX.

use std::path::Path;
use std::sync::Arc;

use super::Drawing;
use crate::base::error::{Error, Result};
use crate::base::time::{Span, parse_nanos};
use crate::base::{budget, file};
use crate::draw::figure::{self, Figure};
use crate::export::Output;
use crate::export::options::FigureOptions;
use crate::mission::Mission;
use crate::mission::ledger::Phase;

/// Where phases and their names come from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Phases {
    /// They are found, and told by what they change.
    #[default]
    Found,
    /// There are none.
    None,
    /// From a file: lines `0:38 navigation` say when they begin; lines without a time name those that are found.
    File(std::path::PathBuf),
}

/// The figure, and the lines for LaTeX.
///
/// # Errors
/// As [`figure::figure`].
pub(super) fn draw(
    mission: &Mission,
    drawing: &Drawing,
    options: &FigureOptions,
    outputs: &[Output],
) -> Result<(Figure, String)> {
    let filters = (&drawing.view.ns_filter, &drawing.view.topic_filter);
    let drawn = figure::figure(mission, filters, &drawing.fonts, options)?;
    let picture = outputs
        .iter()
        .find(|o| ["pdf", "png", "svg"].contains(&o.format.word))
        .and_then(|o| o.target.path().file_name())
        .map_or_else(
            || format!("{}.pdf", options.kind.word()),
            |name| name.to_string_lossy().into_owned(),
        );
    let latex = figure::latex(&drawn, &picture, options);
    Ok((drawn, latex))
}

/// Names the phases of a mission, or replaces them; answers whether the names are the user's.
///
/// # Errors
/// [`Error::BadFile`] for a line that says no phase, more names than phases, or times out of order.
pub(super) fn name_phases(mission: &mut Mission, from: &Phases) -> Result<bool> {
    match from {
        Phases::Found => Ok(false),
        Phases::None => {
            mission.ledger.phases.clear();
            Ok(false)
        }
        Phases::File(path) => {
            let text = file::read_text(path, budget::USER_TEXT)?;
            read(mission, &text, path)?;
            Ok(true)
        }
    }
}

/// One line: when it begins, if it says so, and its name.
type Line = (Option<i64>, String);

fn read(mission: &mut Mission, text: &str, path: &Path) -> Result<()> {
    let bad = |line: usize, reason: String| Error::BadFile {
        path: path.to_owned(),
        line,
        reason,
        hint: "write a phase per line: `0:38 navigation`, or names alone for those that are found"
            .to_owned(),
    };
    let all = text.lines().enumerate().map(|(n, l)| (n + 1, l.trim()));
    let all = all.filter(|(_, l)| !l.is_empty() && !l.starts_with('#'));
    let lines: Vec<(usize, Line)> = all.map(|(n, l)| (n, line(l))).collect();
    let timed = lines.iter().filter(|(_, (at, _))| at.is_some()).count();
    if let Some((n, _)) = lines.iter().find(|(_, (at, _))| timed > 0 && at.is_none()) {
        return Err(bad(
            *n,
            "some lines say when their phase begins, this one does not".to_owned(),
        ));
    }
    if timed > 0 {
        let disordered = lines.windows(2).find(|pair| pair[0].1.0 >= pair[1].1.0);
        if let Some(pair) = disordered {
            return Err(bad(
                pair[1].0,
                "it does not begin after the one before".to_owned(),
            ));
        }
        mission.ledger.phases = at_times(mission, &lines);
        return Ok(());
    }
    let many = mission.ledger.phases.len();
    if let Some((n, _)) = lines.get(many) {
        return Err(bad(*n, format!("there are {many} phases and more names")));
    }
    for (phase, (_, (_, name))) in mission.ledger.phases.iter_mut().zip(lines) {
        phase.name = Arc::from(name);
    }
    Ok(())
}

fn line(text: &str) -> Line {
    let timed = text.split_once([' ', '|', '\t']);
    let timed = timed.and_then(|(at, name)| Some((parse_nanos(at)?, name)));
    match timed {
        Some((at, name)) => (Some(at), name.trim().to_owned()),
        None => (None, text.to_owned()),
    }
}

/// Phases that begin at these times; what comes before the first of them belongs to it.
fn at_times(mission: &Mission, lines: &[(usize, Line)]) -> Vec<Phase> {
    let whole = mission.activity.span();
    let starts: Vec<_> = lines
        .iter()
        .enumerate()
        .map(|(k, (_, (at, _)))| match k {
            0 => whole.start,
            _ => whole.start.plus(at.unwrap_or(0)).min(whole.end),
        })
        .collect();
    let ends = starts.iter().skip(1).copied().chain([whole.end]);
    let spans: Vec<Span> = starts
        .iter()
        .copied()
        .zip(ends)
        .map(|(start, end)| Span { start, end })
        .collect();
    let mut phases = crate::mission::phases::of_spans(&mission.elements, &mission.activity, &spans);
    for (phase, (_, (_, name))) in phases.iter_mut().zip(lines) {
        phase.name = Arc::from(name.as_str());
    }
    phases
}
