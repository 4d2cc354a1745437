//! The commands that describe the contents of bags: `info`, `events`.

use std::path::Path;

use clap::{Args, ValueEnum};

use super::applies::{self, Given};
use super::args::{GraphArgs, Inputs, RangeArgs, RateArgs, VerifyArgs, reading};
use super::terminal::Terminal;
use super::values::one_of;
use super::{DONE, SKIPPED, code};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::export::tables::TableFormat;
use crate::graph::window::Length;
use crate::mission::Mission;
use crate::mission::event_log::{LogFormat, LogLine, LogOptions, body, lines, log, whole};
use crate::mission::info::{SurveyRow, json, survey_text};
use crate::pipeline::{Reading, Survey, each, explain, is_survey, read, survey, survey_file};

#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    again: VerifyArgs,
    /// Output format.
    #[arg(long, value_enum, default_value_t)]
    format: InfoFormat,
    /// List the evidence for a node or topic (one name) or an edge (two names).
    #[arg(long, num_args = 1..=2, value_names = ["NAME", "NAME"], conflicts_with_all = ["format", "verify"])]
    why: Vec<String>,
    #[command(flatten)]
    graph: GraphArgs,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "lower")]
pub(super) enum InfoFormat {
    #[default]
    Text,
    Json,
    Csv,
    Parquet,
}

impl InfoFormat {
    /// The table format; CSV if the format is not one.
    ///
    /// # Errors
    /// If this build does not write it.
    fn of_table(self) -> Result<TableFormat> {
        match self {
            Self::Parquet => TableFormat::Parquet.built(),
            _ => Ok(TableFormat::Csv),
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct EventsArgs {
    #[command(flatten)]
    inputs: Inputs,
    /// Output format.
    #[arg(long, value_name = "WORD", default_value = "text", value_parser = one_of(LogFormat::ALL))]
    format: LogFormat,
    /// List below each event the topics and connections that it affects.
    #[arg(long)]
    parts: bool,
    /// Include housekeeping topics and the recorder.
    #[arg(long)]
    all: bool,
    /// Show where each phase of the mission begins.
    #[arg(long)]
    phases: bool,
    #[command(flatten)]
    range: RangeArgs,
    #[command(flatten)]
    rate: RateArgs,
    #[command(flatten)]
    graph: GraphArgs,
}

/// The number of parts of a mission for which `info` shows the activity.
const PARTS: u32 = 32;

/// The note about an empty log.
pub(super) const NO_EVENTS: &str = "no events: nothing started, stopped or changed";

/// The log for people: the mission as one sentence, and its events.
fn introduced(mission: &Mission, options: LogOptions) -> impl Iterator<Item = LogLine> {
    let first = LogLine::plain(&crate::mission::info::info(mission).summary);
    std::iter::once(first).chain(lines(mission, options))
}

/// Prints the log of a mission, or those of the bags in a folder.
pub(super) fn events(args: &EventsArgs, given: &Given, terminal: &mut Terminal) -> Result<u8> {
    let mut reading = reading(&args.inputs, &args.graph)?;
    reading.division = args.range.in_windows(None);
    reading.rate_change = args.rate.rate_change;
    applies::check_inputs(given, &reading)?;
    if args.graph.source.is_some() {
        terminal
            .note("elements that only source code declares have no times and are not in the log");
    }
    let options = LogOptions {
        parts: args.parts,
        all: args.all,
        phases: args.phases,
    };
    let format = args.format;
    if let ([folder], [input]) = (&args.inputs.bags[..], &reading.inputs[..])
        && is_survey(input)
    {
        let each = LogOf { format, options };
        return events_of_folder(folder, &reading, each, terminal);
    }
    let mission = read(&reading, terminal)?;
    if format == LogFormat::Text {
        let lines: Vec<LogLine> = introduced(&mission, options).collect();
        terminal.log(&lines, format)?;
    } else {
        terminal.results(&log(&mission, format, options))?;
        if lines(&mission, options).is_empty() {
            terminal.note(NO_EVENTS);
        }
    }
    // The log is the same for every period.
    terminal.notices(&mission.notices.without(NoticeKind::Chosen));
    Ok(code(&mission))
}

/// The requested form of a log.
#[derive(Clone, Copy)]
struct LogOf {
    format: LogFormat,
    options: LogOptions,
}

/// Prints the logs of all bags below a folder as one.
fn events_of_folder(
    folder: &Path,
    reading: &Reading,
    form: LogOf,
    terminal: &mut Terminal,
) -> Result<u8> {
    let LogOf { format, options } = form;
    let (mut rows, mut shown) = (String::new(), Vec::new());
    let mut notices = Notices::new();
    for bag in each(folder, reading, terminal)? {
        let name = &bag.name;
        match bag.mission {
            Ok(mission) => {
                if format == LogFormat::Text {
                    shown.push(LogLine::plain(name));
                    shown.extend(introduced(&mission, options));
                } else {
                    rows += &body(&mission, Some(name), format, options);
                }
                let own = mission.notices.without(NoticeKind::Chosen);
                notices.extend(own.iter().map(|notice| Notice {
                    text: format!("`{name}`: {}", notice.text),
                    ..notice
                }));
            }
            Err(unread) if unread.is_loss => {
                notices.add(Notice::new(NoticeKind::Damaged, unread.why));
            }
            Err(empty) => notices.add(Notice::new(NoticeKind::Note, empty.why)),
        }
    }
    match format {
        LogFormat::Text => drop(terminal.log(&shown, format)?),
        _ => terminal.results(&whole(&rows, format, true))?,
    }
    terminal.notices(&notices);
    Ok(if notices.any_loss() { SKIPPED } else { DONE })
}

/// Prints the summary of a mission, or a row for each bag of a folder.
pub(super) fn info(args: &InfoArgs, given: &Given, terminal: &mut Terminal) -> Result<u8> {
    let mut reading = reading(&args.inputs, &args.graph)?;
    reading.verify = args.again.verify;
    reading.division.length = Length::Parts(PARTS);
    applies::check_inputs(given, &reading)?;
    let table = args.format.of_table()?;
    if let ([folder], [input]) = (&args.inputs.bags[..], &reading.inputs[..])
        && is_survey(input)
    {
        if !args.why.is_empty() {
            let what = "`--why` explains one mission, but a folder of bags contains many";
            return Err(Error::usage(what, "give one of the bags"));
        }
        let Survey { rows, skipped } = survey(folder, &reading, terminal)?;
        match args.format {
            InfoFormat::Text => terminal.results(&survey_text(&rows, terminal.width()))?,
            InfoFormat::Json => terminal.results(&json(&rows))?,
            _ => terminal.table(&survey_file(&rows, table)?)?,
        }
        return Ok(if skipped { SKIPPED } else { DONE });
    }
    if !args.why.is_empty() {
        reading.collect.why.clone_from(&args.why);
        let (mission, pieces) = explain(&reading, terminal)?;
        terminal.fitted(&crate::mission::info::why(&mission, &args.why, &pieces)?)?;
        terminal.notices(&mission.notices);
        return Ok(code(&mission));
    }
    let mission = read(&reading, terminal)?;
    let info = || crate::mission::info::info(&mission);
    match args.format {
        InfoFormat::Text => {
            terminal.results(&crate::mission::info::text(&info(), terminal.width()))?;
        }
        InfoFormat::Json => terminal.results(&json(&info()))?,
        _ => {
            let bag = mission.bags.first();
            let name = bag.map_or_else(String::new, |bag| bag.name.clone());
            let row = SurveyRow::of(name, &mission);
            terminal.table(&survey_file(&[row], table)?)?;
        }
    }
    terminal.notices(&mission.notices);
    Ok(code(&mission))
}
