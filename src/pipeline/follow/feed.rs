//! Events and findings as lines, each printed when first detected, again when certain, and withdrawn if later messages
//! contradict it.

use std::collections::BTreeMap;

use super::SoFar;
use crate::base::rhythm::{CLOSING_NS, TOGETHER_NS};
use crate::base::time::Stamp;
use crate::base::words::worded;
use crate::gate::{Severity, Verdict};
use crate::mission::events::{LogFormat, line, quoted};
use crate::mission::ledger::{Detail, Entry, Kind};

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
    /// A line of text, or an object, with its certainty.
    fn mark(self, line: &str, format: LogFormat) -> String {
        match (format, self) {
            (LogFormat::Ndjson, _) => {
                let rest = line.strip_prefix('{').unwrap_or("}");
                format!("{{\"state\":\"{}\",{rest}", self.word())
            }
            (_, Self::Sure) => line.to_owned(),
            (_, Self::SoFar) => format!("{line} (so far)"),
            (_, Self::Withdrawn) => format!("{line} (withdrawn)"),
        }
    }
}

/// A printed event.
struct Printed {
    kind: Kind,
    names: (Option<String>, Option<String>),
    detail: Detail,
    time: Stamp,
    certainty: Certainty,
    line: String,
    /// Whether it is in the newest log.
    is_there: bool,
}

/// The events printed so far.
#[derive(Default)]
pub(crate) struct Feed {
    printed: Vec<Printed>,
}

/// The time after which an end is certain: as long as the mission's closing part, in which ends are not findings. An
/// end is only logged after five usual intervals anyway.
const SURE_NS: i64 = CLOSING_NS;

impl Feed {
    /// The new lines in `known`, sorted by time.
    pub(crate) fn news(&mut self, known: &SoFar, format: LogFormat) -> Vec<String> {
        let mission = &known.mission;
        // Elements that begin with the kept messages existed before.
        let from = known.from.plus(TOGETHER_NS);
        self.printed
            .iter_mut()
            .for_each(|printed| printed.is_there = false);
        let mut lines = Vec::new();
        let entries = (0..).zip(&mission.ledger.entries);
        for (id, entry) in entries.filter(|(_, e)| e.is_headline() && e.time >= from) {
            let certainty = certainty(entry, known.now);
            let names = mission.elements.names(entry.what);
            let names = (names.0.map(str::to_owned), names.1.map(str::to_owned));
            let same = |printed: &&mut Printed| {
                let is_near = printed.time.since(entry.time).abs() <= TOGETHER_NS;
                // Numbers become more precise; another state is another event.
                let is_other = entry.kind == Kind::Lifecycle && printed.detail != entry.detail;
                let is_alike = printed.kind == entry.kind && printed.names == names && !is_other;
                is_alike && is_near && !printed.is_there
            };
            if let Some(printed) = self.printed.iter_mut().find(same) {
                printed.is_there = true;
                printed.time = entry.time;
                if printed.certainty == Certainty::Sure || certainty == Certainty::SoFar {
                    continue;
                }
                printed.certainty = certainty;
                printed.line = line(mission, id, entry, format);
                lines.push(certainty.mark(&printed.line, format));
                continue;
            }
            let line = line(mission, id, entry, format);
            lines.push(certainty.mark(&line, format));
            self.printed.push(Printed {
                kind: entry.kind,
                names,
                detail: entry.detail.clone(),
                time: entry.time,
                certainty,
                line,
                is_there: true,
            });
        }
        // Events before the kept messages are final and can be dropped.
        self.printed
            .retain(|printed| printed.time >= from || printed.is_there);
        let gone = |printed: &mut Printed| !printed.is_there;
        let gone = self.printed.extract_if(.., gone);
        lines.extend(gone.map(|printed| Certainty::Withdrawn.mark(&printed.line, format)));
        lines
    }
}

/// Whether an event is certain: an ended element may return, and a rate must last for a while.
fn certainty(entry: &Entry, now: Stamp) -> Certainty {
    let is_open = matches!(entry.kind, Kind::Stopped | Kind::Vanished | Kind::Rate);
    let is_away = entry.kind == Kind::Silent && entry.until.is_none();
    let is_fresh = now.since(entry.time.max(entry.latest)) < SURE_NS;
    if is_away || is_open && is_fresh {
        Certainty::SoFar
    } else {
        Certainty::Sure
    }
}

/// The findings of an expectation so far, by fingerprint: since when, and the line once it was printed.
#[derive(Default)]
pub(crate) struct FindingFeed {
    seen: BTreeMap<String, (Stamp, Option<String>)>,
}

impl FindingFeed {
    /// The lines about findings that have become certain, and about those that no longer apply.
    pub(crate) fn news(&mut self, verdict: &Verdict, now: Stamp, format: LogFormat) -> Vec<String> {
        let mut lines = Vec::new();
        let mut there = BTreeMap::new();
        for finding in verdict.findings() {
            if !matches!(finding.severity, Severity::Error | Severity::Warning) {
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
                        quoted(&finding.says),
                        now.0
                    )
                } else {
                    format!("{severity}[{kind}]: {}", finding.says)
                };
                lines.push(Certainty::Sure.mark(&line, format));
                printed = Some(line);
            }
            there.insert(key, (since, printed));
        }
        let gone = std::mem::replace(&mut self.seen, there).into_values();
        let gone = gone.filter_map(|(_, printed)| printed);
        lines.extend(gone.map(|line| Certainty::Withdrawn.mark(&line, format)));
        lines
    }
}
