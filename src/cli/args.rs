//! The command line: every command and flag with its help text.

pub(super) mod figure;
pub(super) mod follow;
pub(super) mod gate;
mod help;
pub(super) mod render;
pub(super) mod tables;
mod values;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::base::error::Error;
use crate::base::time::{Moment, Period};
use crate::base::words::worded;
use crate::export::tables::TableFormat;
use crate::graph::diff::RATE_CHANGE;
use crate::graph::window::{Align, Cut, Division, Length};
use crate::mission::event_log::LogFormat;
use values::{length, moment, namespace, offset, one_of, period, share};

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
pub(super) struct Typed {
    #[command(subcommand)]
    pub(super) command: Command,
    /// Only print errors.
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    pub(super) quiet: bool,
    /// Print every note, not a summary of what was left out or chosen.
    #[arg(long, short, global = true)]
    pub(super) verbose: bool,
    /// When to use colors. `auto`: on a terminal, unless `NO_COLOR` is set.
    #[arg(long, global = true, value_enum, default_value_t, value_name = "WHEN")]
    pub(super) color: Colour,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "lower")]
pub(super) enum Colour {
    #[default]
    Auto,
    Always,
    Never,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Draw a mission: animations, frames, pages, figures and data, from one pass over the bag.
    #[command(after_long_help = render::outputs_help())]
    Render(Box<render::RenderArgs>),
    /// Draw a figure for a paper: when each node ran, who publishes to whom, or the reconfigurations one by
    /// one.
    Figure(Box<figure::FigureArgs>),
    /// Summarize a bag: contents, evidence, and what it cannot tell you; for a folder, one row per bag.
    Info(Box<InfoArgs>),
    /// Export messages as tables: a row per message, or a table per topic with every field.
    #[command(after_long_help = EXTRACT_HELP)]
    Extract(Box<ExtractArgs>),
    /// Count the messages of many bags per publisher, topic and window: a table per bag.
    #[command(after_long_help = tables::HELP)]
    Tables(Box<tables::TablesArgs>),
    /// Print the event log: what started, stopped, restarted, changed rate or was taken over, and when; for a folder, the logs
    /// of its bags.
    Events(Box<EventsArgs>),
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
    #[command(after_long_help = follow::FOLLOW_HELP)]
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

#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    #[command(flatten)]
    pub(super) inputs: Inputs,
    #[command(flatten)]
    pub(super) again: VerifyArgs,
    /// Output format.
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: InfoFormat,
    /// List the evidence for a node or topic (one name) or an edge (two names).
    #[arg(long, num_args = 1..=2, value_names = ["NAME", "NAME"], conflicts_with_all = ["format", "verify"])]
    pub(super) why: Vec<String>,
    #[command(flatten)]
    pub(super) graph: GraphArgs,
}

#[derive(Debug, Args)]
pub(super) struct EventsArgs {
    #[command(flatten)]
    pub(super) inputs: Inputs,
    /// Output format.
    #[arg(long, value_name = "WORD", default_value = "text", value_parser = one_of(LogFormat::ALL))]
    pub(super) format: LogFormat,
    /// List below each event the topics and connections that it affects.
    #[arg(long)]
    pub(super) parts: bool,
    /// Include housekeeping topics and the recorder.
    #[arg(long)]
    pub(super) all: bool,
    /// Show where each phase of the mission begins.
    #[arg(long)]
    pub(super) phases: bool,
    #[command(flatten)]
    pub(super) range: RangeArgs,
    #[command(flatten)]
    pub(super) rate: RateArgs,
    #[command(flatten)]
    pub(super) graph: GraphArgs,
}

#[derive(Debug, Args)]
pub(super) struct ExtractArgs {
    /// Bags, as for `render`; the messages of several bags go into one table.
    #[arg(required = true, value_name = "BAG")]
    pub(super) bags: Vec<PathBuf>,
    /// Output file, `.csv` or `.parquet`, or `-` for standard output; with `--fields`, a folder.
    #[arg(long, short, value_name = "FILE|FOLDER")]
    pub(super) output: String,
    /// Output format, if the name has no known extension. [default with `--fields`: csv]
    #[arg(long, value_name = "csv|parquet", value_parser = one_of(TableFormat::ALL))]
    pub(super) format: Option<TableFormat>,
    /// Decode messages into a table per topic with a column per field.
    #[arg(long)]
    pub(super) fields: bool,
    /// Folder of `.msg`, `.srv`, `.action` and `.idl` files for types that the bag does not define (repeatable; common types are built in).
    #[arg(
        long,
        visible_alias = "source",
        value_name = "DIR",
        requires = "fields"
    )]
    pub(super) msg_path: Vec<PathBuf>,
    /// Topics to export, as `rqt_graph` filters: `/nav/.*,-/nav/debug`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    pub(super) topic_filter: Option<String>,
    #[command(flatten)]
    pub(super) range: RangeArgs,
}

const EXTRACT_HELP: &str = "Columns without `--fields`: time_ns, topic, type, publisher, size_bytes; rows are sorted by time.";

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
    pub(super) fn of_table(self) -> Result<TableFormat, Error> {
        match self {
            Self::Parquet => TableFormat::Parquet.built(),
            _ => Ok(TableFormat::Csv),
        }
    }
}

#[derive(Debug, Default, Args)]
pub(super) struct Inputs {
    /// Bags (`.bag`, `.bag.active`, `.db3`, `.mcap`, a rosbag2 folder, `-` for standard input) or a mission's `.json`;
    /// several are read as one mission.
    #[arg(required = true, value_name = "BAG")]
    pub(super) bags: Vec<PathBuf>,
    /// Put the names of a bag in a namespace: `robot2.bag=/robot2`; once per bag.
    #[arg(long, value_name = "BAG=NAMESPACE", value_parser = namespace)]
    pub(super) ns: Vec<(PathBuf, String)>,
    /// Correct the clock of the computer that recorded a bag: `robot2.bag=+0.35s`; once per bag.
    #[arg(long, value_name = "BAG=TIME", value_parser = offset)]
    pub(super) offset: Vec<(PathBuf, i64)>,
}

impl Inputs {
    /// Inputs without corrections.
    pub(super) fn of(bags: &[PathBuf]) -> Self {
        Self {
            bags: bags.to_vec(),
            ..Self::default()
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct VerifyArgs {
    /// Read everything again with a second, independent reader and compare.
    #[arg(long)]
    pub(super) verify: bool,
}

/// The part of a recording.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(super) struct RangeArgs {
    /// Start time: `90`, `1:30` or `2m` after the bag's start, `-30s` before its end, or RFC 3339.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(super) start: Option<Moment>,
    /// End time, in the same forms as `--start`.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(super) end: Option<Moment>,
}

impl RangeArgs {
    /// This part in windows of this length.
    pub(super) fn in_windows(self, length: Option<Length>) -> Division {
        Division {
            length: length.unwrap_or(Length::Auto),
            start: self.start,
            end: self.end,
            ..Division::default()
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct TimeArgs {
    /// Length of a window: `60`, `30s`, `1m`, `500ms`, or `all` for one window. [default: 60 s, shorter for bags below
    /// five minutes, longer above ten hours]
    #[arg(long, short, value_parser = length)]
    pub(super) period: Option<Length>,
    /// Time from one window's start to the next; windows overlap if it is below `--period`. [default: the period]
    #[arg(long, value_parser = period)]
    pub(super) step: Option<Period>,
    /// Align windows with the first message (`bag`) or with whole periods of UTC (`clock`).
    #[arg(long, value_parser = one_of(Align::ALL), value_name = "bag|clock", default_value = "bag")]
    pub(super) align: Align,
    /// Make one window per phase or per reconfiguration instead of per period.
    #[arg(long, value_parser = one_of(Cut::ALL), value_name = "phases|changes", conflicts_with_all = ["period", "step", "align"])]
    pub(super) cut: Option<Cut>,
    #[command(flatten)]
    pub(super) range: RangeArgs,
}

impl TimeArgs {
    pub(super) fn division(&self) -> Division {
        Division {
            step: self.step,
            align: self.align,
            cut: self.cut,
            ..self.range.in_windows(self.period)
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct RateArgs {
    /// Report rates that change by more than this fraction.
    #[arg(long, value_name = "SHARE", default_value_t = RATE_CHANGE, value_parser = share)]
    pub(super) rate_change: f64,
}

#[derive(Clone, Debug, Default, Args)]
pub(super) struct GraphArgs {
    /// Add nodes and edges from a CSV, YAML, MCAP (`/rosgraph`) or launch file, or from DOT saved by rqt_graph.
    #[arg(long, value_name = "FILE")]
    pub(super) topology: Vec<PathBuf>,
    /// Add the publishers and subscribers that this workspace's source code declares for nodes in the bag. Nothing is
    /// executed.
    #[arg(long, value_name = "DIR")]
    pub(super) source: Option<PathBuf>,
    /// Also infer subscriptions from equal header stamps, from equal payloads in bags above 64 MB, or unnamed nodes
    /// from source code.
    #[arg(long, value_name = "stamps,payloads,source", value_parser = one_of(Inference::ALL), value_delimiter = ',')]
    pub(super) infer: Vec<Inference>,
}

worded! {
    /// What is inferred on request.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(super) enum Inference {
        /// Subscriptions, from equal header stamps.
        Stamps = "stamps",
        /// Subscriptions, from equal payloads in large bags.
        Payloads = "payloads",
        /// Unnamed nodes, from source code.
        Source = "source",
    }
}
