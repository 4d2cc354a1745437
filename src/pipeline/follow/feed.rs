//! Events and findings as lines, each told when it is first known, again when it is sure, and taken back where more
//! messages tell another story.

use std::collections::BTreeMap;

use super::SoFar;
use crate::base::rhythm::{CLOSING_NS, TOGETHER_NS};
use crate::base::time::Stamp;
use crate::base::words::worded;
use crate::gate::{Severity, Verdict};
use crate::mission::events::{LogFormat, line, quoted};
use crate::mission::ledger::{Entry, Kind};

worded! {
    /// How far a line can be relied on.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub(crate) enum Certainty {
        /// The next messages may show that it is not so.
        SoFar = "so_far",
        /// It holds for everything up to now.
        Sure = "sure",
        /// It was told, and more messages tell otherwise.
        Withdrawn = "withdrawn",
    }
}

impl Certainty {
    /// A line of text, or an object, with the certainty in it.
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

/// An event that was told.
struct Told {
    kind: Kind,
    names: (Option<String>, Option<String>),
    time: Stamp,
    certainty: Certainty,
    line: String,
    /// Whether it is in the newest log.
    is_there: bool,
}

/// The events told so far.
#[derive(Default)]
pub(crate) struct Feed {
    told: Vec<Told>,
}

/// The time for which what ends must stay away until it is sure: as long as the robot's last part, in which nothing that
/// ends is a finding. Five usual intervals have passed before the log tells of an end at all.
const SURE_NS: i64 = CLOSING_NS;

impl Feed {
    /// The lines that are new in `known`, by time.
    pub(crate) fn news(&mut self, known: &SoFar, format: LogFormat) -> Vec<String> {
        let mission = &known.mission;
        // What begins where the kept messages begin was there before.
        let from = known.from.plus(TOGETHER_NS);
        self.told.iter_mut().for_each(|told| told.is_there = false);
        let mut lines = Vec::new();
        let entries = (0..).zip(&mission.ledger.entries);
        for (id, entry) in entries.filter(|(_, e)| e.is_headline() && e.time >= from) {
            let certainty = certainty(entry, known.now);
            let names = mission.elements.names(entry.what);
            let names = (names.0.map(str::to_owned), names.1.map(str::to_owned));
            let same = |told: &&mut Told| {
                let is_near = told.time.since(entry.time).abs() <= TOGETHER_NS;
                told.kind == entry.kind && told.names == names && is_near && !told.is_there
            };
            if let Some(told) = self.told.iter_mut().find(same) {
                told.is_there = true;
                told.time = entry.time;
                if told.certainty == Certainty::Sure || certainty == Certainty::SoFar {
                    continue;
                }
                told.certainty = certainty;
                told.line = line(mission, id, entry, format);
                lines.push(certainty.mark(&told.line, format));
                continue;
            }
            let line = line(mission, id, entry, format);
            lines.push(certainty.mark(&line, format));
            self.told.push(Told {
                kind: entry.kind,
                names,
                time: entry.time,
                certainty,
                line,
                is_there: true,
            });
        }
        // What lies before the kept messages stays as it was told, and need not be known any more.
        self.told.retain(|told| told.time >= from || told.is_there);
        let gone = |told: &mut Told| !told.is_there;
        let gone = self.told.extract_if(.., gone);
        lines.extend(gone.map(|told| Certainty::Withdrawn.mark(&told.line, format)));
        lines
    }
}

/// Whether an event can still turn out to be another one: what ends may come back, and a rate is only known when it has
/// held.
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

/// The findings of an expectation that were seen, by fingerprint: since when, and the line once it was told.
#[derive(Default)]
pub(crate) struct FindingFeed {
    seen: BTreeMap<String, (Stamp, Option<String>)>,
}

impl FindingFeed {
    /// The lines about findings that have held long enough to be sure, and about those that hold no longer.
    pub(crate) fn news(&mut self, verdict: &Verdict, now: Stamp, format: LogFormat) -> Vec<String> {
        let mut lines = Vec::new();
        let mut there = BTreeMap::new();
        for finding in verdict.findings() {
            if !matches!(finding.severity, Severity::Error | Severity::Warning) {
                continue;
            }
            let (severity, kind) = (finding.severity.word(), finding.kind.word());
            let key = finding.fingerprint();
            let (since, mut told) = self.seen.remove(&key).unwrap_or((now, None));
            if told.is_none() && now.since(since) >= SURE_NS {
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
                told = Some(line);
            }
            there.insert(key, (since, told));
        }
        let gone = std::mem::replace(&mut self.seen, there).into_values();
        let gone = gone.filter_map(|(_, told)| told);
        lines.extend(gone.map(|line| Certainty::Withdrawn.mark(&line, format)));
        lines
    }
}
