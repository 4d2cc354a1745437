//! The event log as lines for people or rows for programs, independent of windows.

use std::fmt::Write as _;

use serde::Serialize;

use super::sentence::{interrupted, node_names, sentence, switched};
use super::{Detail, Event, EventId, Interruption, InterruptionKind, Kind, Parts, Phase, Switch};
use crate::base::columns::hang;
use crate::base::csv;
use crate::base::time::Stamp;
use crate::base::words::{self, visible, visible_json, worded};
use crate::graph::{ById, Element};
use crate::mission::Mission;
use crate::mission::json::{event_rows, text};

worded! {
    /// The format of a log.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum LogFormat {
        /// A line per event, for people.
        #[default]
        Text = "text",
        /// A table with a head, times in nanoseconds since 1970.
        Csv = "csv",
        /// An object per line, as in the `events` of a mission.
        Ndjson = "ndjson",
        /// One object, schema `bagreel.events/2`, with these objects as a list.
        Json = "json",
        /// A table for a pull request or a report.
        Markdown = "markdown",
    }
}

/// Options for the events of a log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LogOptions {
    /// Whether to write each headline's parts below it.
    pub parts: bool,
    /// Whether to write housekeeping and the recorder's events.
    pub all: bool,
    /// Whether to write a line before the first event of each phase.
    pub phases: bool,
}

/// A row of the log, in order.
pub(crate) enum LogRow<'a> {
    Phase(usize, &'a Phase),
    Interruption(&'a Interruption),
    Switch(Switch),
    Event(EventId, &'a Event),
    Part(EventId, &'a Event),
}

/// The log of a mission; ends in a new line unless it is empty. Control and direction characters in names are
/// escaped.
pub fn log(mission: &Mission, format: LogFormat, options: LogOptions) -> String {
    whole(&body(mission, None, format, options), format, false)
}

/// The rows of a log; those of a `bag` in a folder contain its name.
pub(crate) fn body(
    mission: &Mission,
    bag: Option<&str>,
    format: LogFormat,
    options: LogOptions,
) -> String {
    let rows = chosen(mission, options);
    match format {
        LogFormat::Text => {
            let title = bag.map(LogLine::plain);
            let lines = title.into_iter().chain(lines(mission, options));
            lines.map(|line| line.text(None)).collect()
        }
        LogFormat::Csv => csv(mission, bag, &rows),
        LogFormat::Ndjson | LogFormat::Json => ndjson(mission, bag, &rows),
        LogFormat::Markdown => {
            let title = bag.map_or_else(String::new, |bag| format!("\n### {}\n\n", escaped(bag)));
            title + &markdown(mission, &with_switches(mission, rows))
        }
    }
}

/// The log with these rows, which are of one mission or of the bags of a folder.
pub(crate) fn whole(rows: &str, format: LogFormat, is_of_folder: bool) -> String {
    match format {
        LogFormat::Csv => {
            let bag = if is_of_folder { "bag," } else { "" };
            format!("{bag}{COLUMNS}\n{rows}")
        }
        LogFormat::Json => {
            let rows = rows.lines().collect::<Vec<_>>().join(",\n");
            format!("{{\"schema\": \"bagreel.events/2\", \"events\": [\n{rows}\n]}}\n")
        }
        LogFormat::Text | LogFormat::Ndjson | LogFormat::Markdown => rows.to_owned(),
    }
}

/// The rows of the log without phases and parts; switches to another mode are rows for people only.
pub(crate) fn headlines(mission: &Mission, format: LogFormat) -> Vec<LogRow<'_>> {
    let rows = chosen(mission, LogOptions::default());
    match format {
        LogFormat::Csv | LogFormat::Ndjson | LogFormat::Json => rows,
        LogFormat::Text | LogFormat::Markdown => with_switches(mission, rows),
    }
}

/// Rows of the log, each as [`LogFormat::Ndjson`] or as text.
pub(crate) fn row_lines(mission: &Mission, rows: &[LogRow<'_>], format: LogFormat) -> Vec<LogLine> {
    if format == LogFormat::Ndjson {
        let rows = ndjson(mission, None, rows);
        return rows.lines().map(LogLine::plain).collect();
    }
    let parts = mission.log.all_parts();
    rows.iter().map(|row| line(mission, &parts, row)).collect()
}

/// The rows with an additional row before each mode switch, which is not an event of its own.
fn with_switches<'a>(mission: &Mission, rows: Vec<LogRow<'a>>) -> Vec<LogRow<'a>> {
    let mut switches = mission.log.switches().into_iter().peekable();
    let mut all = Vec::with_capacity(rows.len());
    for row in rows {
        if let LogRow::Event(_, event) = &row {
            let next = switches.next_if(|switch| switch.time <= event.time);
            all.extend(next.map(LogRow::Switch));
        }
        all.push(row);
    }
    all
}

fn chosen(mission: &Mission, options: LogOptions) -> Vec<LogRow<'_>> {
    let log = &mission.log;
    let parts = log.all_parts();
    let phases = log.phases.iter().enumerate();
    let mut phases = phases.filter(|_| options.phases).peekable();
    let mut interruptions = log.interruptions.iter().peekable();
    let mut rows = Vec::new();
    for (id, event) in log.events.with_ids() {
        while let Some((at, phase)) = phases.next_if(|(_, p)| p.span.start <= event.time) {
            rows.push(LogRow::Phase(at, phase));
        }
        while let Some(one) = interruptions.next_if(|one| one.time <= event.time) {
            rows.push(LogRow::Interruption(one));
        }
        if event.part_of.is_some() || event.quiet && !options.all {
            continue;
        }
        rows.push(LogRow::Event(id, event));
        let own = parts.get(&id).filter(|_| options.parts);
        let own = own.into_iter().flatten();
        let own = own.filter_map(|part| Some(LogRow::Part(*part, log.events.get(*part)?)));
        rows.extend(own);
    }
    rows.extend(phases.map(|(at, phase)| LogRow::Phase(at, phase)));
    rows.extend(interruptions.map(LogRow::Interruption));
    rows
}

/// The largest uncertainty of a time that is written as exact, in nanoseconds: a recorder looks for new topics once a
/// second, and finds a node within 2.5 s of its start, so that nearly every start is within it.
const SURE_NS: i64 = 4_000_000_000;
/// The largest uncertainty of a time that is written as "about", in nanoseconds; with more, it is written as a range, since a second
/// in the middle of it would be taken for the time.
const ABOUT_NS: i64 = 10_000_000_000;

/// The time of an event, counted from the mission's start: `00:37.9`, `~00:37`, or `00:35–00:58`.
fn at(mission: &Mission, event: &Event) -> String {
    let second = |time: Stamp| words::offset_seconds(mission.offset(time));
    match event.latest.since(event.earliest) {
        doubt if doubt <= SURE_NS => words::offset_tenths(mission.offset(event.time)),
        doubt if doubt <= ABOUT_NS => format!("~{}", second(event.time)),
        _ => format!("{}–{}", second(event.earliest), second(event.latest)),
    }
}

/// The title of a phase in the log.
fn title(at: usize, phase: &Phase) -> String {
    format!("phase {}: {}", at + 1, visible(&phase.name))
}

/// A line of the log for people, or an object for programs.
#[derive(Clone, Debug, Default)]
pub struct LogLine {
    /// The kind of event; `None` for the title of a phase, for what the recorder did, and for an object.
    pub(crate) kind: Option<Kind>,
    /// The time with the space after it.
    pub(crate) lead: String,
    pub(crate) words: String,
}

impl LogLine {
    /// A line without a time of its own.
    pub(crate) fn plain(words: &str) -> Self {
        Self {
            words: words.to_owned(),
            ..Self::default()
        }
    }

    /// The line, broken to `width` characters with a hanging indent; ends in a new line.
    pub fn text(&self, width: Option<usize>) -> String {
        hang(&self.lead, &self.words, self.lead.chars().count(), width)
    }
}

/// The log as lines for people, sorted by the time that each shows.
pub(crate) fn lines(mission: &Mission, options: LogOptions) -> Vec<LogLine> {
    let rows = with_switches(mission, chosen(mission, options));
    let parts = mission.log.all_parts();
    let shown = sorted(&rows).into_iter();
    shown.map(|row| line(mission, &parts, row)).collect()
}

fn line(mission: &Mission, parts: &Parts, row: &LogRow<'_>) -> LogLine {
    let (when, words) = when_and_what(mission, parts, row);
    let (kind, inner, words) = match row {
        LogRow::Phase(..) => (None, "", format!("── {words} ──")),
        LogRow::Interruption(_) | LogRow::Switch(_) => (None, "", words),
        LogRow::Event(_, event) => (Some(event.kind), "", words),
        LogRow::Part(_, event) => (Some(event.kind), "  ", words),
    };
    LogLine {
        kind,
        lead: format!("{when:>13}  {inner}"),
        words,
    }
}

/// The time of a row and its words for people.
fn when_and_what(mission: &Mission, parts: &Parts, row: &LogRow<'_>) -> (String, String) {
    let tenths = |time| words::offset_tenths(mission.offset(time));
    match row {
        LogRow::Phase(number, phase) => (tenths(phase.span.start), title(*number, phase)),
        LogRow::Interruption(one) => (tenths(one.time), interrupted(one)),
        LogRow::Switch(one) => (tenths(one.time), switched(one)),
        LogRow::Event(id, event) | LogRow::Part(id, event) => {
            (at(mission, event), sentence(mission, parts, *id, event))
        }
    }
}

/// The rows sorted by printed time, parts after the event that they belong to.
fn sorted<'a, 'm>(rows: &'a [LogRow<'m>]) -> Vec<&'a LogRow<'m>> {
    let mut time = Stamp(i64::MIN);
    let timed = rows.iter().map(|row| {
        time = match row {
            LogRow::Phase(_, phase) => phase.span.start,
            LogRow::Interruption(one) => one.time,
            LogRow::Switch(one) => one.time,
            LogRow::Event(_, event) => shown(event),
            LogRow::Part(..) => time,
        };
        (time, row)
    });
    let mut timed: Vec<_> = timed.collect();
    timed.sort_by_key(|(time, _)| *time);
    timed.into_iter().map(|(_, row)| row).collect()
}

/// The printed time of an event: the earliest possible one if a range is printed.
fn shown(event: &Event) -> Stamp {
    if event.latest.since(event.earliest) > ABOUT_NS {
        event.earliest
    } else {
        event.time
    }
}

fn markdown(mission: &Mission, rows: &[LogRow<'_>]) -> String {
    let heads = ["| when | what |\n|---:|---|\n", ""];
    let mut all = heads[usize::from(rows.is_empty())].to_owned();
    let parts = mission.log.all_parts();
    for row in sorted(rows) {
        let (when, words) = when_and_what(mission, &parts, row);
        let words = match row {
            LogRow::Phase(..) => format!("**{}**", escaped(&words)),
            LogRow::Part(..) => format!("· {}", escaped(&words)),
            _ => escaped(&words),
        };
        let _ = writeln!(all, "| {when} | {words} |");
    }
    all
}

/// A text escaped so that Markdown shows it as it is.
fn escaped(text: &str) -> String {
    let is_sign = |c| r"\|`*_[]<>~&@#".contains(c);
    words::replaced(text, is_sign, |c, out| out.extend(['\\', c])).into_owned()
}

const COLUMNS: &str = "\
    time_ns,kind,what,name,topic,id,earliest_ns,latest_ns,until_ns,before,after,degree,evidence,part_of,quiet,\
    weight";

/// What is not about an element, as a row.
#[derive(Serialize)]
struct PeriodRow<'a> {
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    number: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<&'a str>,
    time_ns: Stamp,
    until_ns: Stamp,
    /// The speed of a simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    percent: Option<u32>,
}

impl LogRow<'_> {
    /// A phase or an interruption, until the time to which the clock went back, or at which messages came again.
    fn period(&self) -> Option<PeriodRow<'_>> {
        match self {
            Self::Phase(at, phase) => Some(PeriodRow {
                kind: "phase",
                number: Some(at + 1),
                name: Some(&phase.name),
                time_ns: phase.span.start,
                until_ns: phase.span.end,
                percent: None,
            }),
            Self::Interruption(one) => Some(PeriodRow {
                kind: one.kind.word(),
                number: None,
                name: None,
                time_ns: one.time,
                until_ns: match one.kind {
                    InterruptionKind::ClockBack | InterruptionKind::SimulationBack => {
                        one.time.plus(-one.length)
                    }
                    _ => one.time.plus(one.length),
                },
                percent: Some(one.percent).filter(|percent| *percent != 100),
            }),
            Self::Switch(_) | Self::Event(..) | Self::Part(..) => None,
        }
    }
}

fn csv(mission: &Mission, bag: Option<&str>, rows: &[LogRow<'_>]) -> String {
    let rows = rows.iter().map(|row| match row {
        LogRow::Event(id, event) | LogRow::Part(id, event) => cells(mission, *id, event),
        other => other.period().map_or_else(Vec::new, |one| {
            let mut cells = vec![String::new(); COLUMNS.split(',').count()];
            cells[0] = one.time_ns.0.to_string();
            one.kind.clone_into(&mut cells[1]);
            cells[3] = visible(one.name.unwrap_or_default()).into_owned();
            cells[5] = one.number.map_or_else(String::new, |n| n.to_string());
            cells[8] = one.until_ns.0.to_string();
            cells[10] = one.percent.map_or_else(String::new, |n| n.to_string());
            cells
        }),
    });
    csv::lines(rows.map(|cells| bag.map(str::to_owned).into_iter().chain(cells)))
}

fn cells(mission: &Mission, id: EventId, event: &Event) -> Vec<String> {
    let (node, topic) = mission.elements.names(event.what);
    let (name, topic) = match event.what {
        Element::Topic(_) => (topic, None),
        _ => (node, topic),
    };
    let shown = |name: Option<&str>| visible(name.unwrap_or_default()).into_owned();
    let names = |nodes: &[_]| node_names(&mission.elements, nodes, " ");
    let (before, after) = match &event.detail {
        Detail::None => (String::new(), String::new()),
        Detail::Rates { from_hz, to_hz } => (from_hz.to_string(), to_hz.to_string()),
        Detail::Count { count: many } => (String::new(), many.to_string()),
        Detail::Senders { from, to } => (names(from), names(to)),
        Detail::Values { from, to } => (shown(Some(from)), shown(Some(to))),
    };
    vec![
        event.time.0.to_string(),
        event.kind.word().to_owned(),
        event.what.word().to_owned(),
        shown(name),
        shown(topic),
        id.to_string(),
        event.earliest.0.to_string(),
        event.latest.0.to_string(),
        event.until.map_or_else(String::new, |t| t.0.to_string()),
        before,
        after,
        event.confidence.word().to_owned(),
        event.evidence.words().collect::<Vec<_>>().join(" "),
        event.part_of.map_or_else(String::new, |of| of.to_string()),
        event.quiet.to_string(),
        event.weight.to_string(),
    ]
}

fn ndjson(mission: &Mission, bag: Option<&str>, rows: &[LogRow<'_>]) -> String {
    let events: ById<EventId, String> = event_rows(&mission.log, &mission.elements).collect();
    let bag = bag.map(|bag| format!("{{\"bag\":{},", quoted(bag)));
    let mut all = String::new();
    for row in rows {
        let json = match row {
            LogRow::Event(id, _) | LogRow::Part(id, _) => events.get(*id).cloned(),
            other => other.period().map(|one| text(&one)),
        };
        let Some(json) = json else { continue };
        let json = match &bag {
            Some(bag) => json.replacen('{', bag, 1),
            None => json,
        };
        all.push_str(&visible_json(&json));
        all.push('\n');
    }
    all
}

/// A text in quotes, as in JSON.
pub(crate) fn quoted(name: &str) -> String {
    text(&name)
}
