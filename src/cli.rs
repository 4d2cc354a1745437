//! The command line; only this file and its folder use clap and the environment.
//!
//! In come the arguments of the program; out come an exit code, and what a person reads. Each command is a file: its
//! arguments, the job for the pipeline that they are, and what it prints. Open `render` first; `args` has what commands share,
//! `applies` refuses options without effect.

mod applies;
mod args;
mod figure;
mod follow;
mod gate;
mod help;
mod installed;
mod render;
mod show;
mod stop;
mod tables;
pub(crate) mod terminal;
mod values;

use std::ffi::OsString;
use std::io::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use clap::{ColorChoice, CommandFactory as _, FromArgMatches as _, Parser, Subcommand, ValueEnum};

use crate::base::error::Error;
use crate::base::notice::Notices;
use crate::base::words::visible;
use crate::cli::terminal::{Terminal, has_colour, print_usage};
use applies::Given;

/// The version, and in packages the commit that they were built from: `0.1.0 (1a2b3c4d5e 2026-11-23)`.
const VERSION: &str = match option_env!("BAGREEL_VERSION") {
    Some(named) => named,
    None => env!("CARGO_PKG_VERSION"),
};

/// See how a robot's software reconfigures during a mission, straight from its bag files.
#[derive(Debug, Parser)]
#[command(name = "bagreel", version = VERSION, max_term_width = 100)]
#[command(
    after_help = "Exit codes: 0 done, 1 failed, 2 usage error, 3 done but data was skipped (damaged bag)."
)]
struct Typed {
    #[command(subcommand)]
    command: Command,
    /// Only print errors.
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Print every note, not a summary of what was left out or chosen.
    #[arg(long, short, global = true)]
    verbose: bool,
    /// When to use colors. `auto`: on a terminal, unless `NO_COLOR` is set.
    #[arg(long, global = true, value_enum, default_value_t, value_name = "WHEN")]
    color: Colour,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "lower")]
enum Colour {
    #[default]
    Auto,
    Always,
    Never,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Draw a mission: animations, frames, pages, figures and data, from one pass over the bag.
    #[command(after_long_help = render::outputs_help())]
    Render(Box<render::RenderArgs>),
    /// Draw a figure for a paper: when each node ran, who publishes to whom, or the reconfigurations one by
    /// one.
    Figure(Box<figure::FigureArgs>),
    /// Summarize a bag: contents, evidence, and what it cannot tell you; for a folder, one row per bag.
    Info(Box<show::InfoArgs>),
    /// Export messages as tables: a row per message, or a table per topic with every field.
    #[command(after_long_help = tables::EXTRACT_HELP)]
    Extract(Box<tables::ExtractArgs>),
    /// Count the messages of many bags per publisher, topic and window: a table per bag.
    #[command(after_long_help = tables::HELP)]
    Tables(Box<tables::TablesArgs>),
    /// Print the event log: what started, stopped, restarted, changed rate or was taken over, and when; for a folder, the logs
    /// of its bags.
    Events(Box<show::EventsArgs>),
    /// Compare two missions: nodes, topics, connections, rates and events.
    #[command(after_long_help = gate::DIFF_HELP)]
    Diff(Box<gate::DiffArgs>),
    /// Generate an expectations file from healthy runs.
    #[command(after_long_help = gate::BASELINE_HELP)]
    Baseline(Box<gate::BaselineArgs>),
    /// Check a mission against an expectations file: what is missing, new, late or slow.
    #[command(after_long_help = gate::check_help())]
    Check(Box<gate::CheckArgs>),
    /// Follow a recording while it grows: print each event as soon as it is known, without ROS and without locks.
    #[command(after_long_help = follow::HELP)]
    Follow(Box<follow::FollowArgs>),
    /// List the built-in styles, or print one as a starting point for your own.
    Styles {
        /// The style to print as TOML.
        name: Option<String>,
    },
    /// Print completions for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Print the manual page, or that of one command.
    Man {
        /// The command.
        command: Option<String>,
    },
}

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
        Command::Figure(args) => figure::figure(&args, &given, &mut terminal),
        Command::Info(args) => show::info_of(&args, &given, &mut terminal),
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
    let shown = args.iter();
    let shown = shown.map(|arg| visible(&arg.to_string_lossy()).into_owned());
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

/// The exit code for work with these notices.
fn code(notices: &Notices) -> u8 {
    let is_loss = notices.any_loss();
    if is_loss { SKIPPED } else { DONE }
}
