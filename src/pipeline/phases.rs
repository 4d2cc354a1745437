//! The phases of a mission: detected, or named or defined by the user's file.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Reading;
use crate::base::error::{Error, Result};
use crate::base::time::{Span, Stamp, parse_nanos};
use crate::base::{budget, file};
use crate::graph::Elements;
use crate::graph::history::Sending;
use crate::graph::window::between;
use crate::mission::event_log::Phase;
use crate::mission::phases::{of_spans, phases};

/// The source of phases and of their names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Phases {
    /// Detected, and named after their changes.
    #[default]
    Found,
    /// There are none.
    None,
    /// A file: lines `0:38 navigation` define the start of a phase; lines without a time name the detected phases.
    File(PathBuf),
}

impl Phases {
    /// The file that defines them, if any.
    pub(super) fn file(&self) -> Option<&PathBuf> {
        match self {
            Self::File(path) => Some(path),
            _ => None,
        }
    }

    /// Whether the user named them.
    pub(super) fn is_named(&self) -> bool {
        matches!(self, Self::File(_))
    }
}

/// The sources of phases: the history of the mission, and the phases of an earlier run.
pub(super) struct Basis<'a> {
    pub(super) elements: &'a Elements,
    pub(super) sending: &'a Sending,
    /// The time of the mission.
    pub(super) whole: Span,
    pub(super) earlier: Vec<Phase>,
    /// Whether an event is listed. Where none is, phases would claim changes.
    pub(super) has_changes: bool,
}

/// The phases that `reading` asks for.
///
/// # Errors
/// [`Error::BadFile`] for a line that is not a phase, more names than phases, or times out of order.
pub(super) fn wanted(reading: &Reading, basis: Basis<'_>) -> Result<Vec<Phase>> {
    match &reading.phases {
        Phases::None => Ok(Vec::new()),
        Phases::Found => Ok(basis.found()),
        Phases::File(path) => {
            let text = file::read_text(path, budget::USER_TEXT)?;
            from_file(basis, &text, path)
        }
    }
}

impl Basis<'_> {
    fn found(self) -> Vec<Phase> {
        if !self.earlier.is_empty() {
            return self.earlier;
        }
        let found = phases(self.elements, self.sending, self.whole);
        if self.has_changes || found.len() < 2 {
            return found;
        }
        self.at(&[])
    }

    /// Phases that begin at these times, sorted, with these names. The time before the first is a phase with a default
    /// name.
    fn at(&self, begins: &[(Stamp, String)]) -> Vec<Phase> {
        let whole = self.whole;
        let begins: Vec<_> = begins.iter().filter(|(at, _)| *at < whole.end).collect();
        let starts = begins.iter().map(|(at, _)| (*at).max(whole.start));
        let mut starts: Vec<Stamp> = starts.collect();
        let is_led = starts.first().is_none_or(|first| *first > whole.start);
        if is_led {
            starts.insert(0, whole.start);
        }
        let spans = between(&starts, whole.end);
        let mut all = of_spans(self.elements, self.sending, whole, &spans);
        let named = all.iter_mut().skip(usize::from(is_led));
        for (phase, (_, name)) in named.zip(begins) {
            phase.name = Arc::from(name.as_str());
        }
        all
    }
}

/// One line: the start of a phase, if given, in nanoseconds after the mission's start, and its name.
type PhaseLine = (Option<i64>, String);

fn from_file(basis: Basis<'_>, text: &str, path: &Path) -> Result<Vec<Phase>> {
    let hint = "write a phase per line: `0:38 navigation`, or only names for the detected phases";
    let bad = |line: usize, reason: &str| Error::bad_file(path, line, reason, hint);
    let all = text.lines().enumerate().map(|(n, l)| (n + 1, l.trim()));
    let all = all.filter(|(_, l)| !l.is_empty() && !l.starts_with('#'));
    let lines: Vec<(usize, PhaseLine)> = all.map(|(n, l)| (n, line(l))).collect();
    let timed = lines.iter().filter(|(_, (at, _))| at.is_some()).count();
    if let Some((n, _)) = lines.iter().find(|(_, (at, _))| timed > 0 && at.is_none()) {
        return Err(bad(*n, "this line has no start time, but other lines do"));
    }
    if timed > 0 {
        let disordered = lines.windows(2).find(|pair| pair[0].1.0 >= pair[1].1.0);
        if let Some(pair) = disordered {
            return Err(bad(pair[1].0, "it does not begin after the previous one"));
        }
        // The time before the first phase belongs to it.
        let start = basis.whole.start;
        let begins = lines.into_iter().enumerate().map(|(k, (_, (at, name)))| {
            let at = at.filter(|_| k > 0).unwrap_or(0);
            (start.plus(at), name)
        });
        return Ok(basis.at(&begins.collect::<Vec<_>>()));
    }
    let mut found = basis.found();
    let many = found.len();
    if let Some((n, _)) = lines.get(many) {
        return Err(bad(
            *n,
            &format!("there are more names than phases ({many})"),
        ));
    }
    for (phase, (_, (_, name))) in found.iter_mut().zip(lines) {
        phase.name = Arc::from(name);
    }
    Ok(found)
}

fn line(text: &str) -> PhaseLine {
    let timed = text.split_once([' ', '|', '\t']);
    let timed = timed.and_then(|(at, name)| Some((parse_nanos(at)?, name)));
    match timed {
        Some((at, name)) => (Some(at), name.trim().to_owned()),
        None => (None, text.to_owned()),
    }
}
