//! The commands that judge: what was typed, turned into work for the pipeline, and its outcome into an exit code.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::args::gate::{BaselineArgs, CheckArgs, GateTime, Undecidable};
use super::args::{ChangeArgs, GraphArgs, Inputs, TimeArgs};
use super::terminal::Terminal;
use super::{DONE, FAILED, SKIPPED, USAGE, code, reading, summary};
use crate::base::error::{Error, Result};
use crate::export::target::Target;
use crate::gate::{Format, Severity, explain};
use crate::pipeline::Reading;
use crate::pipeline::gate::{self, Baseline, Check, Report};

/// Writes down what healthy runs have in common.
pub(super) fn baseline(args: &BaselineArgs, terminal: &mut Terminal) -> Result<u8> {
    let runs = args.bags.iter().map(|bag| {
        let inputs = Inputs {
            bags: vec![bag.clone()],
            verify: false,
        };
        judged(&inputs, &args.time, &args.graph)
    });
    let job = Baseline {
        runs: runs.collect::<Result<_>>()?,
        update: args.update.clone(),
        only: args.only.clone(),
        output: Target::parse(&args.output),
    };
    let done = gate::baseline(&job, terminal)?;
    for mission in &done.missions {
        terminal.notices(&mission.notices);
    }
    if let Some(path) = &args.update {
        let left = match done.left {
            0 => String::new(),
            n => format!("; {n} findings of rules are left, which only you can resolve"),
        };
        let n = done.changed;
        terminal.say(&format!("{}: {n} facts written anew{left}", path.display()));
    }
    let codes = done.missions.iter().map(code);
    Ok(codes.max().unwrap_or(DONE))
}

/// Holds a mission against an expectation.
pub(super) fn check(args: &CheckArgs, terminal: &mut Terminal) -> Result<u8> {
    if let Some(word) = &args.explain {
        let Some(text) = explain(word) else {
            return Err(unknown_kind(word));
        };
        terminal.results(&text)?;
        return Ok(DONE);
    }
    let Some(expect) = args.expect.clone() else {
        return Err(Error::usage("`--expect` is missing", "name a graph.yaml"));
    };
    let job = Check {
        reading: judged(&args.inputs(), &args.time, &args.graph)?,
        expect,
        reports: args
            .outputs
            .iter()
            .map(|o| report(o))
            .collect::<Result<_>>()?,
        bags: typed(&args.bags),
        links: args.link.clone(),
        append_to: summary(),
    };
    let done = gate::check(&job, terminal)?;
    let subject = job.subject(&done.mission);
    terminal.results(&(args.format.write)(&subject, &done.verdict))?;
    terminal.notices(&done.mission.notices);
    let verdict = &done.verdict;
    let is_strict = args.undecidable == Undecidable::Error;
    let unknown = verdict.count(Severity::Unknown) > 0;
    Ok(match code(&done.mission) {
        _ if verdict.count(Severity::Error) > 0 || is_strict && unknown => FAILED,
        _ if verdict.is_blind() => USAGE,
        SKIPPED => SKIPPED,
        _ => DONE,
    })
}

fn unknown_kind(word: &str) -> Error {
    let words = || crate::gate::Kind::words();
    let near = crate::evidence::topology::nearest::nearest(word, words());
    let near = near.map_or_else(String::new, |near| format!("; the nearest is `{near}`"));
    let all: Vec<&str> = words().collect();
    Error::usage(
        format!("no finding is called `{word}`{near}"),
        format!("they are {}", all.join(", ")),
    )
}

/// What to read for a judgement. Missions in JSON bring their own windows.
fn judged(inputs: &Inputs, time: &GateTime, graph: &GraphArgs) -> Result<Reading> {
    let time = TimeArgs {
        period: time.period,
        start: time.start,
        end: time.end,
        ..TimeArgs::default()
    };
    reading(inputs, &time, &ChangeArgs::default(), graph)
}

fn typed(bags: &[PathBuf]) -> Vec<String> {
    bags.iter().map(|bag| bag.display().to_string()).collect()
}

/// A report to write: its format by the word before a colon, by its ending, or because a job collects its summary there.
fn report(output: &OsStr) -> Result<Report> {
    let name = output.to_string_lossy();
    let named = |word: &str| Format::from_word(word);
    if let Some((format, path)) = name
        .split_once(':')
        .and_then(|(word, path)| Some((named(word)?, path)))
    {
        return Ok(Report {
            target: Target::parse(path),
            format,
        });
    }
    let is_summary = summary().is_some_and(|path| path == Path::new(output));
    let format = if is_summary {
        named("markdown")
    } else {
        Format::of_name(&name)
    };
    let unknown = || {
        Error::usage(
            format!("the name `{name}` tells no format"),
            "end it in .md, .xml, .json, .sarif or .txt, or write the format before it: `gitlab:FILE`",
        )
    };
    Ok(Report {
        target: Target::parse(output),
        format: format.ok_or_else(unknown)?,
    })
}
