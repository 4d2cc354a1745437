//! The commands that describe the contents of bags: `info`, `events`, `paper`.

use super::applies::{self, Given};
#[cfg(feature = "pdf")]
use super::args::PaperArgs;
use super::args::{EventsArgs, EventsFormat, InfoArgs, InfoFormat, RangeArgs, RateArgs, TimeArgs};
use super::reading::reading;
use super::terminal::Terminal;
use super::{DONE, SKIPPED, code};
use crate::base::error::Error;
use crate::base::notice::NoticeKind;
#[cfg(feature = "pdf")]
use crate::base::words;
use crate::graph::window::Length;
use crate::mission::events::{LogFormat, LogOptions, lines, log};
use crate::mission::info::{SurveyRow, json, survey_text};
#[cfg(feature = "pdf")]
use crate::pipeline::{self, Reading, paper::Paper};
use crate::pipeline::{Survey, explain, is_survey, read, survey, survey_file};

/// The number of parts of a mission for which `info` shows the activity.
const PARTS: u32 = 32;

/// The note about an empty log.
pub(super) const NO_EVENTS: &str = "no events: nothing started, stopped or changed";

/// Prints the log of a mission.
pub(super) fn events(
    args: &EventsArgs,
    given: &Given,
    terminal: &mut Terminal,
) -> Result<u8, Error> {
    let windows = TimeArgs::default();
    let reading = reading(&args.inputs, &windows, args.range, &args.rate, &args.graph)?;
    applies::check_inputs(given, &reading)?;
    if args.graph.source.is_some() {
        terminal
            .note("elements that only source code declares have no times and are not in the log");
    }
    let mission = read(&reading, terminal)?;
    let options = LogOptions {
        parts: args.parts,
        all: args.all,
        phases: args.phases,
    };
    let format = match args.format {
        EventsFormat::Text => LogFormat::Text,
        EventsFormat::Csv => LogFormat::Csv,
        EventsFormat::Ndjson => LogFormat::Ndjson,
        EventsFormat::Json => LogFormat::Json,
        EventsFormat::Markdown => LogFormat::Markdown,
    };
    let lines = lines(&mission, options);
    match format {
        LogFormat::Text => drop(terminal.log(&lines, format)?),
        _ => terminal.results(&log(&mission, format, options))?,
    }
    if lines.is_empty() {
        terminal.note(NO_EVENTS);
    }
    // The log is the same for every period.
    terminal.notices(&mission.notices.without(NoticeKind::Chosen));
    Ok(code(&mission))
}

/// Prints the summary of a mission, or a row for each bag of a folder.
#[cfg_attr(
    not(feature = "parquet"),
    expect(
        clippy::match_wildcard_for_single_variants,
        reason = "with Parquet, there are two tables"
    )
)]
pub(super) fn info(args: &InfoArgs, given: &Given, terminal: &mut Terminal) -> Result<u8, Error> {
    let time = TimeArgs {
        period: Some(Length::Parts(PARTS)),
        ..TimeArgs::default()
    };
    let reading = reading(
        &args.inputs,
        &time,
        RangeArgs::default(),
        &RateArgs::default(),
        &args.graph,
    )?;
    applies::check_inputs(given, &reading)?;
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
            table => terminal.table(&survey_file(&rows, table.of_table())?)?,
        }
        return Ok(if skipped { SKIPPED } else { DONE });
    }
    if !args.why.is_empty() {
        let mut reading = reading;
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
        table => {
            let bag = mission.bags.first();
            let name = bag.map_or_else(String::new, |bag| bag.name.clone());
            let row = SurveyRow::of(name, &mission);
            terminal.table(&survey_file(&[row], table.of_table())?)?;
        }
    }
    terminal.notices(&mission.notices);
    Ok(code(&mission))
}

/// Writes the bundle.
#[cfg(feature = "pdf")]
pub(super) fn paper(args: &PaperArgs, terminal: &mut Terminal) -> Result<u8, Error> {
    let mut reading = Reading::default();
    reading.division.length = args.period.unwrap_or(Length::Auto);
    let period = |length: Length| match length {
        Length::Fixed(period) => period.to_string().replace(' ', ""),
        _ => "all".to_owned(),
    };
    let job = Paper {
        runs: args.runs.clone(),
        folder: args.output.clone(),
        options: args.period.map_or_else(String::new, |length| {
            format!(" --period {}", period(length))
        }),
        reading,
    };
    let done = pipeline::paper::paper(&job, terminal)?;
    for remark in &done.remarks {
        terminal.note(remark);
    }
    let files = words::count(done.files, "file");
    let runs = words::count(done.runs, "recording");
    terminal.wrote([&*job.folder], &format!("{files} about {runs}"));
    Ok(if done.skipped { SKIPPED } else { DONE })
}
