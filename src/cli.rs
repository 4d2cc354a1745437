//! The command line; only this file and its folder use clap and the environment.

mod applies;
mod args;
mod follow;
mod gate;
mod installed;
mod look;
mod reading;
mod render;
mod show;
mod stop;
mod tables;
pub(crate) mod terminal;

use std::ffi::OsString;
use std::io::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use clap::{ColorChoice, CommandFactory as _, FromArgMatches as _, ValueEnum as _};

use crate::base::error::Error;
use crate::base::words::visible;
use crate::cli::terminal::{Terminal, has_colour, print_usage};
use crate::mission::Mission;
use applies::Given;
use args::{Colour, Command, Typed};

const DONE: u8 = 0;
const FAILED: u8 = 1;
const USAGE: u8 = 2;
const SKIPPED: u8 = 3;

/// Runs the command line `args`, the program's name first, and returns its exit code: 0 done, 1 failed, 2 usage, 3 done
/// but data was skipped.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    hush();
    // A panic is a failure; it has already been reported.
    catch_unwind(AssertUnwindSafe(|| command(args))).unwrap_or(FAILED)
}

/// Silences the panics of `layout-rs`, which are caught; the graph is then laid out by another engine.
fn hush() {
    let default_hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let is_caught = |at: &std::panic::Location<'_>| at.file().contains("layout-rs-");
        if !panic.location().is_some_and(is_caught) {
            default_hook(panic);
        }
    }));
}

fn command(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let (given, typed) = match parsed(&args) {
        Ok(parsed) => parsed,
        Err(error) => return untyped(&args, error),
    };
    let mut terminal = Terminal::new(&typed);
    let mut failed = FAILED;
    let outcome = match typed.command {
        Command::Render(args) => render::render(&args, &given, &mut terminal),
        Command::Figure(args) => render::figure(&args, &given, &mut terminal),
        Command::Info(args) => show::info(&args, &given, &mut terminal),
        Command::Extract(args) => tables::extract(&args, &mut terminal),
        Command::Tables(args) => tables::tables(&args, &mut terminal),
        Command::Events(args) => show::events(&args, &given, &mut terminal),
        Command::Diff(args) => {
            failed = USAGE;
            gate::diff(&args, &given, &mut terminal)
        }
        Command::Baseline(args) => gate::baseline(&args, &given, &mut terminal),
        Command::Check(args) => {
            failed = USAGE;
            gate::check(&args, &given, &mut terminal)
        }
        Command::Follow(args) => follow::follow(&args, &mut terminal),
        Command::Styles { name } => installed::styles(name.as_deref(), &mut terminal),
        Command::Completions { shell } => installed::completions(shell, &mut terminal),
        Command::Man { command } => installed::manual(command.as_deref(), &mut terminal),
    };
    // Even if the work was done, a script must not continue as if it had not been interrupted.
    let outcome = match terminal.stopped_by() {
        Some(_) => Err(Error::Interrupted),
        None => outcome,
    };
    outcome.unwrap_or_else(|error| {
        if is_closed_pipe(&error) {
            return DONE;
        }
        terminal.error(&error);
        match (error, terminal.stopped_by()) {
            (Error::Interrupted, Some(code)) => code,
            (error, _) if error.is_usage() => USAGE,
            _ => failed,
        }
    })
}

/// Whether the reader of our standard output has closed it.
fn is_closed_pipe(error: &Error) -> bool {
    let Error::Io { path, source, .. } = error else {
        return false;
    };
    path == Path::new("-") && source.kind() == std::io::ErrorKind::BrokenPipe
}

/// Parses the command line: the names of the given options, and all options with defaults.
fn parsed<T: Into<OsString> + Clone>(
    args: impl IntoIterator<Item = T>,
) -> Result<(Given, Typed), clap::Error> {
    // Without the arrangement of help, which takes half of the time of parsing.
    let matches = Typed::command().try_get_matches_from(args)?;
    Ok((Given::of(&matches), Typed::from_arg_matches(&matches)?))
}

/// Prints the help, the version, or the error of the command line, with control characters escaped so that no argument
/// can control the terminal.
fn untyped(args: &[OsString], error: clap::Error) -> u8 {
    let shown = args
        .iter()
        .map(|arg| visible(&arg.to_string_lossy()).into_owned());
    let colour = if has_colour(asked_colour(args), error.use_stderr()) {
        ColorChoice::Always
    } else {
        ColorChoice::Never
    };
    let coloured = Typed::grammar().color(colour).try_get_matches_from(shown);
    let error = coloured.err().unwrap_or(error);
    if error.use_stderr() {
        let text = error.render();
        match colour {
            ColorChoice::Always => print_usage(&text.ansi().to_string()),
            _ => print_usage(&text.to_string()),
        }
        return USAGE;
    }
    match error.print().and_then(|()| std::io::stdout().flush()) {
        // A closed pipe is not an error.
        Err(lost) if lost.kind() != std::io::ErrorKind::BrokenPipe => FAILED,
        _ => DONE,
    }
}

/// The value of `--color` in a command line that may have errors.
fn asked_colour(args: &[OsString]) -> Colour {
    let typed = args.iter().map(|arg| arg.to_string_lossy());
    let mut typed = typed.take_while(|arg| arg != "--");
    let value = typed.find_map(|arg| arg.strip_prefix("--color").map(str::to_owned));
    let value = match value.as_deref() {
        Some("") => typed.next().unwrap_or_default().into_owned(),
        other => other.unwrap_or_default().trim_start_matches('=').to_owned(),
    };
    Colour::from_str(&value, true).unwrap_or_default()
}

/// The exit code for a mission.
fn code(mission: &Mission) -> u8 {
    if mission.notices.any_loss() {
        SKIPPED
    } else {
        DONE
    }
}
