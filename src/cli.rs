//! What was typed, turned into work; the only file (with its folder) that knows clap and the environment.

mod typed;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{CommandFactory as _, Parser as _};

use crate::bag::Input;
use crate::collect;
use crate::error::Error;
use crate::evolution::Evolution;
use crate::graph;
use crate::info::{SurveyRow, json, survey_csv, survey_text};
use crate::pipeline::{Reading, is_survey, read, survey};
use crate::terminal::Terminal;
use crate::window::{Division, Length};
use typed::{
    Command, EventsArgs, GraphArgs, InfoArgs, InfoFormat, Inputs, RenderArgs, TimeArgs, Typed,
};

const DONE: u8 = 0;
const FAILED: u8 = 1;
const USAGE: u8 = 2;
const SKIPPED: u8 = 3;

/// How many parts of a mission `info` shows the activity of.
const PARTS: u32 = 32;

/// Runs the command line `args`, the program's name first, and answers its exit code: 0 done, 1 failed, 2 usage,
/// 3 done but data was skipped.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let typed = match Typed::try_parse_from(args) {
        Ok(typed) => typed,
        Err(error) => {
            // A closed pipe has read enough of the help.
            let _ = error.print();
            return if error.use_stderr() { USAGE } else { DONE };
        }
    };
    let no_colour = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
    let mut terminal = Terminal::new(typed.quiet, no_colour);
    let outcome = match typed.command {
        Command::Render(args) => render(&args, &mut terminal),
        Command::Info(args) => info(&args, &mut terminal),
        Command::Events(args) => events(&args, &mut terminal),
        Command::Styles { .. } => Ok(DONE),
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut Typed::command(), "bagreel", &mut text);
            terminal.results(&String::from_utf8_lossy(&text));
            Ok(DONE)
        }
        Command::Man => {
            let mut page = Vec::new();
            let written = clap_mangen::Man::new(Typed::command()).render(&mut page);
            terminal.results(&String::from_utf8_lossy(&page));
            written
                .map(|()| DONE)
                .map_err(Error::io("write", Path::new("the manual page")))
        }
    };
    outcome.unwrap_or_else(|error| {
        terminal.error(&error);
        if error.is_usage() { USAGE } else { FAILED }
    })
}

fn reading(inputs: &Inputs, time: &TimeArgs, graph: &GraphArgs) -> Reading {
    Reading {
        inputs: inputs.bags.iter().map(|path| input(path)).collect(),
        verify: inputs.verify,
        division: Division {
            length: time.period.unwrap_or(Length::Auto),
            step: time.step,
            start: time.start,
            end: time.end,
            align: time.align,
        },
        skip_unchanged: time.skip_unchanged,
        collect: collect::Options {
            sizes: graph.bytes,
            ..collect::Options::default()
        },
        graph: graph::Options {
            grace: graph.grace.unwrap_or(0) as usize,
        },
        rate_change: graph.rate_change,
    }
}

fn input(path: &Path) -> Input {
    if path == Path::new("-") {
        Input::Stdin
    } else {
        Input::Path(path.to_owned())
    }
}

/// The exit code of a mission that was read.
fn code(evolution: &Evolution) -> u8 {
    if evolution.notices.any_loss() {
        SKIPPED
    } else {
        DONE
    }
}

fn render(args: &RenderArgs, terminal: &mut Terminal) -> Result<u8, Error> {
    let evolution = read(&reading(&args.inputs, &args.time, &args.graph), terminal)?;
    for output in &args.outputs {
        let path = PathBuf::from(output);
        let mut out = Vec::new();
        let written = crate::evolution::write_json(&evolution, &mut out);
        written
            .and_then(|()| std::fs::write(&path, out))
            .map_err(Error::io("write", &path))?;
    }
    terminal.notices(&evolution.notices);
    Ok(code(&evolution))
}

fn events(args: &EventsArgs, terminal: &mut Terminal) -> Result<u8, Error> {
    let evolution = read(&reading(&args.inputs, &args.time, &args.graph), terminal)?;
    for event in crate::events::events(&evolution) {
        terminal.results(&format!(
            "{:>12}  {}\n",
            event.at(&evolution),
            event.sentence()
        ));
    }
    terminal.notices(&evolution.notices);
    Ok(code(&evolution))
}

fn info(args: &InfoArgs, terminal: &mut Terminal) -> Result<u8, Error> {
    let time = TimeArgs {
        period: Some(Length::Parts(PARTS)),
        ..TimeArgs::default()
    };
    let reading = reading(&args.inputs, &time, &args.graph);
    if let ([folder], [input]) = (&args.inputs.bags[..], &reading.inputs[..])
        && is_survey(input)
    {
        let rows = survey(folder, &reading, terminal)?;
        terminal.results(&match args.format {
            InfoFormat::Text => survey_text(&rows),
            InfoFormat::Csv => survey_csv(&rows),
            InfoFormat::Json => json(&rows),
        });
        return Ok(DONE);
    }
    let evolution = read(&reading, terminal)?;
    let info = crate::info::info(&evolution);
    terminal.results(&match args.format {
        InfoFormat::Text => crate::info::text(&info),
        InfoFormat::Json => json(&info),
        InfoFormat::Csv => {
            let path = evolution
                .bags
                .first()
                .map(|b| b.name.clone())
                .unwrap_or_default();
            survey_csv(&[SurveyRow {
                path,
                error: None,
                info: Some(info),
            }])
        }
    });
    terminal.notices(&evolution.notices);
    Ok(code(&evolution))
}
