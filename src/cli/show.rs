//! The commands that describe the contents of bags: `info`, `events`.

use std::ffi::OsString;
use std::path::Path;

use clap::{Args, ValueEnum};

use super::applies::{self, Given};
use super::args::{GraphArgs, Inputs, RangeArgs, RateArgs, reading};
use super::gate::wrote;
use super::terminal::Terminal;
use super::values::{one_of, phases};
use super::{DONE, SKIPPED, code};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::export::check::check as check_targets;
use crate::export::tables::TableFormat;
use crate::export::target::Target;
use crate::graph::window::Length;
use crate::mission::Mission;
use crate::mission::event_log::{LogFormat, LogLine, LogOptions, body, lines, whole};
use crate::mission::info::summary::summary;
use crate::mission::info::{SurveyRow, info, json, survey_text, text, why};
use crate::pipeline::{
    Phases, Reading, Survey, each, explain, is_survey, put, read, survey, survey_file,
};

#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    #[command(flatten)]
    inputs: Inputs,
    /// Read everything again with a second, independent reader and compare.
    #[arg(long)]
    verify: bool,
    /// Output format.
    #[arg(long, value_enum, default_value_t)]
    format: InfoFormat,
    /// Write this file instead: `.txt`, `.json`, `.csv` or `.parquet`. Repeatable.
    #[arg(long = "output", short, value_name = "FILE", conflicts_with = "format")]
    outputs: Vec<OsString>,
    /// List the evidence for a node or topic (one name) or an edge (two names).
    #[arg(long, num_args = 1..=2, value_names = ["NAME", "NAME"], conflicts_with_all = ["format", "outputs", "verify"])]
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
    /// The summary of a mission, or the survey of a folder, in this format.
    ///
    /// # Errors
    /// If this build does not write it.
    fn file(self, rows: &[SurveyRow], is_survey: bool, width: Option<usize>) -> Result<Vec<u8>> {
        let one = rows.first().filter(|_| !is_survey);
        let one = one.and_then(|row| row.info.as_ref());
        Ok(match (self, one) {
            (Self::Text, Some(one)) => text(one, width).into_bytes(),
            (Self::Text, None) => survey_text(rows, width).into_bytes(),
            (Self::Json, Some(one)) => json(one).into_bytes(),
            (Self::Json, None) => json(&rows).into_bytes(),
            (Self::Csv, _) => survey_file(rows, TableFormat::Csv)?,
            (Self::Parquet, _) => survey_file(rows, TableFormat::Parquet.built()?)?,
        })
    }
}

/// The outputs by their extensions; only standard output, in the default format, without any. Refuses to overwrite an input.
fn outputs<F: Copy>(
    (given, default): (&[OsString], F),
    of: impl Fn(&str) -> Option<F>,
    hint: &str,
    reading: &Reading,
) -> Result<Vec<(Target, F)>> {
    let output = |name: &OsString| {
        let target = Target::parse(name);
        let word = match target.extension().as_deref() {
            Some("txt") => "text".to_owned(),
            Some("md") => "markdown".to_owned(),
            other => other.unwrap_or_default().to_owned(),
        };
        let what = || format!("`{}` has no known extension", name.display());
        Ok((target, of(&word).ok_or_else(|| Error::usage(what(), hint))?))
    };
    let mut all: Vec<(Target, F)> = given.iter().map(output).collect::<Result<_>>()?;
    let targets: Vec<Target> = all.iter().map(|(target, _)| target.clone()).collect();
    check_targets(&targets, &reading.files())?;
    if all.is_empty() {
        all.push((Target::Stdout, default));
    }
    Ok(all)
}

#[derive(Debug, Args)]
pub(super) struct EventsArgs {
    #[command(flatten)]
    inputs: Inputs,
    /// Output format.
    #[arg(long, value_name = "WORD", default_value = "text", value_parser = one_of(LogFormat::ALL))]
    format: LogFormat,
    /// Write this file instead: `.txt`, `.csv`, `.ndjson`, `.json` or `.md`. Repeatable.
    #[arg(long = "output", short, value_name = "FILE", conflicts_with = "format")]
    outputs: Vec<OsString>,
    /// List below each event the topics and connections that it affects.
    #[arg(long)]
    parts: bool,
    /// Include housekeeping topics and the recorder.
    #[arg(long)]
    all: bool,
    /// Phases whose beginnings are shown: detected (`auto`), `none`, or a file of lines such as `0:38 navigation` or names
    /// alone.
    #[arg(long, value_name = "FILE|auto|none", default_value = "none", value_parser = phases)]
    phases: Phases,
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

/// The logs of one mission, or of the bags of a folder.
struct Logs {
    options: LogOptions,
    outputs: Vec<(Target, LogFormat)>,
    /// The rows for each output, and the lines for people.
    rows: Vec<String>,
    shown: Vec<LogLine>,
    notices: Notices,
}

impl Logs {
    /// Adds the log of a mission; that of a bag in a folder has its name.
    fn add(&mut self, bag: Option<&str>, mission: &Mission) {
        let first = LogLine::plain(&summary(mission, &info(mission)));
        let lines = std::iter::once(first).chain(lines(mission, self.options));
        let lines: Vec<LogLine> = bag.map(LogLine::plain).into_iter().chain(lines).collect();
        for ((_, format), rows) in self.outputs.iter().zip(&mut self.rows) {
            rows.push_str(&match format {
                LogFormat::Text => lines.iter().map(|line| line.text(None)).collect(),
                format => body(mission, bag, *format, self.options),
            });
        }
        self.shown.extend(lines);
        // The log is the same for every period.
        let own = mission.notices.without(NoticeKind::Chosen);
        self.notices.extend(own.iter().map(|notice| match bag {
            Some(bag) => Notice {
                text: format!("`{bag}`: {}", notice.text),
                ..notice
            },
            None => notice,
        }));
    }
}

/// Prints or writes the log of a mission, or those of the bags in a folder.
pub(super) fn events(args: &EventsArgs, given: &Given, terminal: &mut Terminal) -> Result<u8> {
    let mut reading = reading(&args.inputs, &args.graph)?;
    reading.division = args.range.in_windows(None);
    reading.rate_change = args.rate.rate_change;
    reading.phases.clone_from(&args.phases);
    applies::check_inputs(given, &reading)?;
    if args.graph.source.is_some() {
        let text = "elements that only source code declares have no times and are not in the log";
        terminal.note(text);
    }
    let hint = "write `x.txt`, `x.csv`, `x.ndjson`, `x.json` or `x.md`";
    let given_outputs = (&args.outputs[..], args.format);
    let outputs = outputs(given_outputs, LogFormat::from_word, hint, &reading)?;
    let mut logs = Logs {
        options: LogOptions {
            parts: args.parts,
            all: args.all,
            phases: args.phases != Phases::None,
        },
        rows: vec![String::new(); outputs.len()],
        outputs,
        shown: Vec::new(),
        notices: Notices::new(),
    };
    let folder = folder(&args.inputs, &reading);
    match folder {
        None => logs.add(None, &read(&reading, terminal)?),
        Some(folder) => {
            for bag in each(folder, &reading, terminal)? {
                match bag.mission {
                    Ok(mission) => logs.add(Some(&bag.name), &mission),
                    Err(unread) => logs.notices.add(unread),
                }
            }
        }
    }
    let is_empty = folder.is_none() && logs.shown.len() == 1;
    for ((target, format), rows) in logs.outputs.iter().zip(&logs.rows) {
        let text = whole(rows, *format, folder.is_some());
        match (target, format) {
            (Target::Stdout, LogFormat::Text) => drop(terminal.log(&logs.shown, *format)?),
            (Target::Stdout, _) => terminal.results(&text)?,
            (file, _) => put(file, text.as_bytes())?,
        }
        if is_empty && *format != LogFormat::Text {
            terminal.note(NO_EVENTS);
        }
    }
    let targets = logs.outputs.iter().map(|(target, _)| target);
    wrote(targets, "the event log", terminal);
    terminal.notices(&logs.notices);
    Ok(code(&logs.notices))
}

/// The folder of bags that is the only input, if it is.
fn folder<'a>(inputs: &'a Inputs, reading: &Reading) -> Option<&'a Path> {
    match (&inputs.bags[..], &reading.inputs[..]) {
        ([folder], [input]) if is_survey(input) => Some(folder),
        _ => None,
    }
}

/// Prints or writes the summary of a mission, or a row for each bag of a folder.
pub(super) fn info_of(args: &InfoArgs, given: &Given, terminal: &mut Terminal) -> Result<u8> {
    let mut reading = reading(&args.inputs, &args.graph)?;
    reading.verify = args.verify;
    reading.division.length = Length::Parts(PARTS);
    applies::check_inputs(given, &reading)?;
    let hint = "write `x.txt`, `x.json`, `x.csv` or `x.parquet`";
    let of = |word: &str| InfoFormat::from_str(word, false).ok();
    let outputs = outputs((&args.outputs, args.format), of, hint, &reading)?;
    let mut formats = outputs.iter().map(|(_, format)| *format);
    if formats.any(|format| format == InfoFormat::Parquet) {
        TableFormat::Parquet.built()?;
    }
    let folder = folder(&args.inputs, &reading);
    if !args.why.is_empty() {
        if folder.is_some() {
            let what = "`--why` explains one mission, but a folder of bags contains many";
            return Err(Error::usage(what, "give one of the bags"));
        }
        reading.collect.why.clone_from(&args.why);
        let (mission, pieces) = explain(&reading, terminal)?;
        terminal.fitted(&why(&mission, &args.why, &pieces)?)?;
        terminal.notices(&mission.notices);
        return Ok(code(&mission.notices));
    }
    let (rows, notices, code) = if let Some(folder) = folder {
        let Survey { rows, skipped } = survey(folder, &reading, terminal)?;
        (rows, Notices::new(), if skipped { SKIPPED } else { DONE })
    } else {
        let mission = read(&reading, terminal)?;
        let bag = mission.bags.first();
        let name = bag.map_or_else(String::new, |bag| bag.name.clone());
        let row = SurveyRow::of(name, &mission);
        (vec![row], mission.notices.clone(), code(&mission.notices))
    };
    for (target, format) in &outputs {
        let width = terminal.width().filter(|_| *target == Target::Stdout);
        let bytes = format.file(&rows, folder.is_some(), width)?;
        match (target, format) {
            (Target::Stdout, InfoFormat::Text | InfoFormat::Json) => {
                terminal.results(&String::from_utf8_lossy(&bytes))?;
            }
            (Target::Stdout, _) => terminal.table(&bytes)?,
            (file, _) => put(file, &bytes)?,
        }
    }
    let targets = outputs.iter().map(|(target, _)| target);
    wrote(targets, "the summary", terminal);
    terminal.notices(&notices);
    Ok(code)
}
