//! Events and findings as lines, each printed when first detected, again when certain, and withdrawn if later messages
//! contradict it.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::SoFar;
use crate::base::error::Result;
use crate::base::ids::grouped;
use crate::base::rhythm::{CLOSING_NS, SWITCH_NS, TOGETHER_NS};
use crate::base::time::Stamp;
use crate::base::words::worded;
use crate::gate::{Expectation, Severity, judge};
use crate::graph::window::Length;
use crate::mission::Mission;
use crate::mission::event_log::{Detail, Event, InterruptionKind, Kind};
use crate::mission::event_log::{LogFormat, LogLine, LogRow, headlines, quoted, row_lines};
use crate::pipeline::expectation;

worded! {
    /// The certainty of a line.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub(crate) enum Certainty {
        /// Later messages may contradict it.
        SoFar = "so_far",
        /// It is final.
        Sure = "sure",
        /// It was printed, and later messages contradict it.
        Withdrawn = "withdrawn",
    }
}

impl Certainty {
    fn of(is_sure: bool) -> Self {
        if is_sure { Self::Sure } else { Self::SoFar }
    }

    /// A line of text, or an object, with its certainty.
    fn mark(self, mut line: LogLine, format: LogFormat) -> LogLine {
        match (format, self) {
            (LogFormat::Ndjson, _) => {
                let rest = line.words.strip_prefix('{').unwrap_or("}");
                line.words = format!("{{\"state\":\"{}\",{rest}", self.word());
            }
            (_, Self::Sure) => {}
            (_, Self::SoFar) => line.words += " (so far)",
            (_, Self::Withdrawn) => line.words += " (withdrawn)",
        }
        line
    }
}

/// The key by which two rows of the log are the same event, besides their time: numbers become more precise,
/// while another state, or another number of switched nodes, is another event.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    Event {
        kind: Kind,
        names: (Option<String>, Option<String>),
        /// The state before and after.
        state: Option<(Arc<str>, Arc<str>)>,
    },
    Interruption(InterruptionKind),
    Switch {
        stopped: usize,
        started: usize,
    },
}

/// A row with its place among all that were printed as `id`: that in the log of a growing recording changes.
fn numbered(mut line: LogLine, id: usize) -> LogLine {
    let row = line.words.strip_prefix("{\"id\":");
    if let Some((_, rest)) = row.and_then(|row| row.split_once(',')) {
        line.words = format!("{{\"id\":{id},{rest}");
    }
    line
}

/// A printed event.
struct Printed {
    id: usize,
    key: Key,
    time: Stamp,
    certainty: Certainty,
    line: LogLine,
    /// Whether it is in the newest log.
    is_there: bool,
}

/// The events printed so far.
#[derive(Default)]
pub struct Feed {
    printed: Vec<Printed>,
    /// The number of all that were ever printed.
    many: usize,
}

/// The time after which an end is certain: as long as the mission's closing part, in which ends are not findings. An
/// end is only logged after five usual intervals anyway.
const SURE_NS: i64 = CLOSING_NS;

impl Feed {
    /// The new lines in `known`, in the order of the log.
    pub fn new_lines(&mut self, known: &SoFar, format: LogFormat) -> Vec<LogLine> {
        let mission = &known.mission;
        // Elements that begin with the kept messages existed before.
        let from = known.from.plus(TOGETHER_NS);
        let printed = self.printed.iter().enumerate();
        let mut places = grouped(printed.map(|(place, printed)| (&printed.key, place)));
        let mut found = Vec::new();
        for row in headlines(mission, format) {
            let Some((key, time, certainty)) = identity(mission, &row, known.now) else {
                continue;
            };
            if time < from {
                continue;
            }
            let is_near =
                |place: &usize| self.printed[*place].time.since(time).abs() <= TOGETHER_NS;
            let place = places.get_mut(&key).and_then(|places| {
                let at = places.iter().position(is_near)?;
                Some(places.remove(at))
            });
            found.push((place, key, time, certainty, row));
        }
        for printed in &mut self.printed {
            printed.is_there = false;
        }
        let (mut places, mut rows) = (Vec::new(), Vec::new());
        for (place, key, time, certainty, row) in found {
            let is_new = place.is_none_or(|at| self.printed[at].certainty < certainty);
            let place = place.unwrap_or_else(|| {
                self.many += 1;
                self.printed.push(Printed {
                    id: self.many - 1,
                    key,
                    time,
                    certainty,
                    line: LogLine::default(),
                    is_there: true,
                });
                self.printed.len() - 1
            });
            let printed = &mut self.printed[place];
            (printed.is_there, printed.time) = (true, time);
            if is_new {
                printed.certainty = certainty;
                places.push(place);
                rows.push(row);
            }
        }
        let mut lines = Vec::new();
        for (place, line) in places.into_iter().zip(row_lines(mission, &rows, format)) {
            let printed = &mut self.printed[place];
            let line = numbered(line, printed.id);
            lines.push(printed.certainty.mark(line.clone(), format));
            printed.line = line;
        }
        // Events before the kept messages are final and can be dropped.
        self.printed
            .retain(|printed| printed.time >= from || printed.is_there);
        let gone = |printed: &mut Printed| !printed.is_there;
        let gone = self.printed.extract_if(.., gone);
        lines.extend(gone.map(|printed| Certainty::Withdrawn.mark(printed.line, format)));
        lines
    }
}

/// The key of a row, its time, and whether it is certain; `None` for a phase and for a part, which are not printed.
fn identity(mission: &Mission, row: &LogRow<'_>, now: Stamp) -> Option<(Key, Stamp, Certainty)> {
    Some(match row {
        LogRow::Event(_, event) => {
            let (node, topic) = mission.elements.names(event.what);
            let state = match &event.detail {
                Detail::Values { from, to } if event.kind == Kind::Lifecycle => {
                    Some((from.clone(), to.clone()))
                }
                _ => None,
            };
            let key = Key::Event {
                kind: event.kind,
                names: (node.map(str::to_owned), topic.map(str::to_owned)),
                state,
            };
            (key, event.time, certainty(event, now))
        }
        LogRow::Interruption(one) => (Key::Interruption(one.kind), one.time, Certainty::Sure),
        LogRow::Switch(one) => {
            let key = Key::Switch {
                stopped: one.stopped,
                started: one.started,
            };
            // By then the last of its stops is certain.
            let is_over = now.since(one.time) >= SWITCH_NS + SURE_NS;
            (key, one.time, Certainty::of(is_over))
        }
        LogRow::Phase(..) | LogRow::Part(..) => return None,
    })
}

/// Whether an event is certain: an ended element may return, and a rate must last for a while.
fn certainty(event: &Event, now: Stamp) -> Certainty {
    let is_open = matches!(event.kind, Kind::Stopped | Kind::Vanished | Kind::Rate);
    let is_away = event.kind == Kind::Silent && event.until.is_none();
    let is_fresh = now.since(event.time.max(event.latest)) < SURE_NS;
    Certainty::of(!(is_away || is_open && is_fresh))
}

/// The findings of an expectation so far, by fingerprint: since when, and the line once it was printed.
pub struct FindingFeed {
    expectation: Expectation,
    seen: BTreeMap<String, (Stamp, Option<LogLine>)>,
}

impl FindingFeed {
    /// No findings yet, of the expectation in this file.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn new(path: &Path) -> Result<Self> {
        Ok(Self {
            expectation: expectation(path)?.1,
            seen: BTreeMap::new(),
        })
    }

    /// The length of windows according to the file.
    pub fn length(&self) -> Length {
        self.expectation.period.map_or(Length::Auto, Length::Fixed)
    }

    /// The lines about findings that have become certain, and about those that no longer apply.
    pub fn new_lines(&mut self, known: &SoFar, format: LogFormat) -> Vec<LogLine> {
        let now = known.now;
        let verdict = judge(&self.expectation, &known.mission, known.is_part());
        let mut lines = Vec::new();
        let mut there = BTreeMap::new();
        for finding in verdict.findings() {
            let is_broken = matches!(finding.severity, Severity::Error | Severity::Warning);
            if !is_broken || finding.is_open {
                continue;
            }
            let (severity, kind) = (finding.severity.word(), finding.kind.word());
            let key = finding.fingerprint();
            let (since, mut printed) = self.seen.remove(&key).unwrap_or((now, None));
            if printed.is_none() && now.since(since) >= SURE_NS {
                let line = if format == LogFormat::Ndjson {
                    format!(
                        "{{\"kind\":\"finding\",\"finding\":\"{kind}\",\"severity\":\"{severity}\",\"name\":{},\"text\":{},\"time_ns\":{}}}",
                        quoted(&finding.name),
                        quoted(&finding.text),
                        now.0
                    )
                } else {
                    format!("{severity}[{kind}]: {}", finding.text)
                };
                let line = LogLine::plain(&line);
                printed = Some(line.clone());
                lines.push(Certainty::Sure.mark(line, format));
            }
            there.insert(key, (since, printed));
        }
        let gone = std::mem::replace(&mut self.seen, there).into_values();
        let gone = gone.filter_map(|(_, printed)| printed);
        lines.extend(gone.map(|line| Certainty::Withdrawn.mark(line, format)));
        lines
    }
}
