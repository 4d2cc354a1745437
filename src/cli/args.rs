//! The command line: every command and flag with its help text.

pub(super) mod gate;
#[cfg(feature = "parquet")]
pub(super) mod tables;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::base::time::{Moment, Period, parse_nanos};
use crate::export::FORMATS;
use crate::export::tables::TableFormat;
use crate::graph::diff::RATE_CHANGE;
use crate::graph::window::{Align, Cut, Length};

/// See how a robot's software reconfigures during a mission, straight from its bag files.
#[derive(Debug, Parser)]
#[command(name = "bagreel", version, max_term_width = 100)]
#[command(
    after_help = "Exit codes: 0 done, 1 failed, 2 usage, 3 done but data was skipped (damaged bag)."
)]
pub(super) struct Typed {
    #[command(subcommand)]
    pub(super) command: Command,
    /// Say nothing but errors.
    #[arg(long, short, global = true)]
    pub(super) quiet: bool,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Read bags once and write every output asked for: animations, frames, figures, data.
    #[command(after_help = outputs_help())]
    Render(Box<RenderArgs>),
    /// Tell what a bag holds, which evidence it has, and what cannot be known; over a folder, one row per bag.
    Info(Box<InfoArgs>),
    /// Write the messages themselves as tables: a row per message, or a table per topic with every field.
    #[command(after_help = EXTRACT_HELP)]
    Extract(Box<ExtractArgs>),
    /// Count what a fleet of bags holds: two tables, a row per bag and one per publisher and window, for any engine.
    #[cfg(feature = "parquet")]
    #[command(after_help = tables::HELP)]
    Tables(Box<tables::TablesArgs>),
    /// Print the log: what started, stopped, restarted, changed rate or hands, and when; the same for every period.
    Events(Box<EventsArgs>),
    /// Tell what differs between two missions: who is there, who talks to whom, how often, what happened when.
    #[command(after_help = gate::DIFF_HELP)]
    Diff(Box<gate::DiffArgs>),
    /// Write down what healthy runs have in common, as an expectation to edit and to keep.
    #[command(after_help = gate::BASELINE_HELP)]
    Baseline(Box<gate::BaselineArgs>),
    /// Hold a mission against an expectation: what is missing, new, late, slow, or not as it was.
    #[command(after_help = gate::check_help())]
    Check(Box<gate::CheckArgs>),
    /// List the built-in styles, or print one to start your own from.
    Styles {
        /// The style to print as TOML.
        name: Option<String>,
    },
    /// Print completions for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Print the manual page.
    Man,
}

#[derive(Debug, Args)]
pub(super) struct RenderArgs {
    #[command(flatten)]
    pub(super) inputs: Inputs,
    #[arg(long = "output", short, value_name = "FILE", help = shown(OUTPUT))]
    pub(super) outputs: Vec<OsString>,
    /// The format of outputs whose name does not tell it (such as `-`).
    #[arg(long, value_name = "WORD")]
    pub(super) format: Option<String>,
    #[command(flatten)]
    pub(super) time: TimeArgs,
    #[command(flatten)]
    pub(super) change: ChangeArgs,
    #[command(flatten)]
    pub(super) graph: GraphArgs,
    #[command(flatten)]
    pub(super) sizes: SizeArgs,
    #[command(flatten)]
    pub(super) view: ViewArgs,
    #[command(flatten)]
    pub(super) look: LookArgs,
    #[command(flatten)]
    pub(super) sequence: SequenceArgs,
    #[command(flatten)]
    pub(super) figure: FigureArgs,
    /// Print how long each station took.
    #[arg(long)]
    pub(super) timings: bool,
    /// Draw again whenever the style file changes, until interrupted.
    #[arg(long)]
    pub(super) watch: bool,
}

#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    #[command(flatten)]
    pub(super) inputs: Inputs,
    /// How to print it.
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: InfoFormat,
    /// Explain these elements: each piece of evidence with its time and text. One name for a node or topic, two for an edge.
    #[arg(long, num_args = 1..=2, value_names = ["NAME", "NAME"], conflicts_with_all = ["format", "verify"])]
    pub(super) why: Vec<String>,
    #[command(flatten)]
    pub(super) graph: GraphArgs,
    #[command(flatten)]
    pub(super) sizes: SizeArgs,
}

#[derive(Debug, Args)]
pub(super) struct EventsArgs {
    #[command(flatten)]
    pub(super) inputs: Inputs,
    /// How to print it.
    #[arg(long, value_enum, default_value_t)]
    pub(super) format: EventsFormat,
    /// Tell below each entry what it implies: the topics and connections of a node.
    #[arg(long)]
    pub(super) parts: bool,
    /// Tell of housekeeping and of the recorder too.
    #[arg(long)]
    pub(super) all: bool,
    /// Tell where each phase of the mission begins.
    #[arg(long)]
    pub(super) phases: bool,
    #[command(flatten)]
    pub(super) time: TimeArgs,
    #[command(flatten)]
    pub(super) change: ChangeArgs,
    #[command(flatten)]
    pub(super) graph: GraphArgs,
}

#[derive(Debug, Args)]
pub(super) struct ExtractArgs {
    /// Bags, as `render` takes them. The messages of several are one table.
    #[arg(required = true, value_name = "BAG")]
    pub(super) bags: Vec<PathBuf>,
    /// The file to write, `.csv` or `.parquet`; `-` is standard output; with `--fields` a folder.
    #[arg(long, short, value_name = "FILE|FOLDER")]
    pub(super) output: String,
    /// The format, where the name does not tell it. [default with `--fields`: parquet]
    #[arg(long, value_name = "csv|parquet")]
    pub(super) format: Option<String>,
    /// Decode messages: a table per topic, a column per field.
    #[arg(long)]
    pub(super) fields: bool,
    /// Names of topics to take, as in `rqt_graph`: `/nav/.*,-/nav/debug`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    pub(super) topic_filter: Option<String>,
    /// Begin here: `90`, `1:30` or `2m` after the bag's start, `-30s` before its end, or RFC 3339.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(super) start: Option<Moment>,
    /// End here, written like `--start`.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(super) end: Option<Moment>,
}

const EXTRACT_HELP: &str =
    "Columns of a row per message: time_ns, topic, type, publisher, size_bytes; sorted by time.";

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "lower")]
pub(super) enum InfoFormat {
    #[default]
    Text,
    Json,
    Csv,
    #[cfg(feature = "parquet")]
    Parquet,
}

impl InfoFormat {
    /// The format of a table; CSV for what is none.
    pub(super) fn of_table(self) -> TableFormat {
        match self {
            #[cfg(feature = "parquet")]
            Self::Parquet => TableFormat::Parquet,
            _ => TableFormat::Csv,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "lower")]
pub(super) enum EventsFormat {
    #[default]
    Text,
    Csv,
    Ndjson,
    Markdown,
}

#[derive(Debug, Args)]
pub(super) struct Inputs {
    /// Bags: `.bag`, `.bag.active`, `.db3`, `.mcap`, a rosbag2 folder, `-` for standard input, or an evolution `.json`.
    /// Several are one mission on one time axis.
    #[arg(required = true, value_name = "BAG")]
    pub(super) bags: Vec<PathBuf>,
    /// Read everything by a second, independent reader and compare.
    #[arg(long)]
    pub(super) verify: bool,
}

#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Time")]
pub(super) struct TimeArgs {
    /// The length of a window: `60`, `30s`, `1m`, `500ms`, or `all` for one window. [default: 60 s; less for a short bag,
    /// more for a long one]
    #[arg(long, short, value_parser = length)]
    pub(super) period: Option<Length>,
    /// From one window's start to the next; smaller than the period makes windows overlap.
    #[arg(long, value_parser = period)]
    pub(super) step: Option<Period>,
    /// Begin here: `90`, `1:30` or `2m` after the bag's start, `-30s` before its end, or RFC 3339.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(super) start: Option<Moment>,
    /// End here, written like `--start`.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(super) end: Option<Moment>,
    /// Windows from the first message, or on whole periods of UTC.
    #[arg(long, value_parser = align, value_name = "bag|clock", default_value = "bag")]
    pub(super) align: Align,
    /// Merge runs of windows with equal graphs.
    #[arg(long)]
    pub(super) skip_unchanged: bool,
    /// A window per phase, or per reconfiguration, instead of per period.
    #[arg(long, value_parser = cut, value_name = "phases|changes", conflicts_with_all = ["period", "step", "align", "skip_unchanged"])]
    pub(super) cut: Option<Cut>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Windows")]
pub(super) struct ChangeArgs {
    /// A rate that changes by more than this share counts as a change.
    #[arg(long, value_name = "SHARE", default_value_t = RATE_CHANGE, value_parser = share)]
    pub(super) rate_change: f64,
    /// Windows of silence after which something that never speaks again counts as gone.
    #[arg(long, value_name = "WINDOWS", default_value_t = 0)]
    pub(super) grace: u32,
}

impl Default for ChangeArgs {
    fn default() -> Self {
        Self {
            rate_change: RATE_CHANGE,
            grace: 0,
        }
    }
}

#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Graph")]
pub(super) struct GraphArgs {
    /// Draw and compare roles instead of names: anonymous suffixes folded.
    #[arg(long)]
    pub(super) roles: bool,
    /// Add nodes and edges that the bag hides: CSV, YAML, DOT of rqt_graph, or a launch file.
    #[arg(long, value_name = "FILE")]
    pub(super) topology: Vec<PathBuf>,
    /// Add what the source code in this workspace or repository declares for the nodes that the bag names; as of the
    /// recording's day, where it is in git. Nothing is run.
    #[arg(long, value_name = "DIR")]
    pub(super) source: Option<PathBuf>,
    /// The code to read, instead of the last commit before the recording's end: the newest commit, another one, or the
    /// files as they lie.
    #[arg(long, value_name = "HEAD|COMMIT|worktree", requires = "source")]
    pub(super) source_at: Option<String>,
    /// Infer subscriptions from equal header stamps, or from equal payloads also in bags larger than 64 MB or read by
    /// their index alone; nodes that the bag does not name from the only place in the source code that can be meant.
    #[arg(long, value_name = "stamps,payloads,source", value_parser = ["stamps", "payloads", "source"], value_delimiter = ',')]
    pub(super) infer: Vec<String>,
}

#[derive(Debug, Default, Args)]
pub(super) struct SizeArgs {
    /// Read the size of every message, even where the index does not tell it.
    #[arg(long)]
    pub(super) bytes: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "View")]
pub(super) struct ViewArgs {
    /// What the picture is: the graph, or a board of topics over time, which is the default where of most messages nobody
    /// knows the publisher and no option asks for the graph.
    #[arg(long, value_name = "graph|board", value_parser = ["graph", "board"], conflicts_with = "figure")]
    pub(super) view: Option<String>,
    /// What to draw: nodes only, nodes with one arrow for all topics between two of them, nodes and active topics, or
    /// all topics.
    #[arg(long, value_name = "nodes|bundles|active|all", value_parser = ["nodes", "bundles", "active", "all"])]
    pub(super) mode: Option<String>,
    /// Names of nodes to draw, as in `rqt_graph`: `/nav/.*,-/nav/debug`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    pub(super) ns_filter: Option<String>,
    /// Names of topics to draw, written like `--ns-filter`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    pub(super) topic_filter: Option<String>,
    /// Kinds to leave out, instead of the default `quiet`: debug, dead, leaf, tf, params, unreachable; `none` for nothing.
    #[arg(long, value_name = "KIND,…")]
    pub(super) hide: Option<String>,
    /// Kinds to draw as one box, instead of the default, which is all: actions, tf, images, namespaces=N; `none` for nothing.
    #[arg(long, value_name = "KIND,…")]
    pub(super) group: Option<String>,
    /// Namespaces to draw as one box each.
    #[arg(long, value_name = "NAMESPACE", value_delimiter = ',')]
    pub(super) collapse: Vec<String>,
    /// Namespaces that `--fit auto` must not collapse.
    #[arg(long, value_name = "NAMESPACE", value_delimiter = ',')]
    pub(super) expand: Vec<String>,
    /// Draw the recorder and the player too.
    #[arg(long)]
    pub(super) show_recorder: bool,
    /// Draw what `rqt_graph` shows when it is opened.
    #[arg(long)]
    pub(super) rqt_defaults: bool,
    /// Write the viewed graph to JSON and tables, not the full one.
    #[arg(long)]
    pub(super) filtered: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Look")]
pub(super) struct LookArgs {
    /// A built-in style or a style file. See `bagreel styles`.
    #[arg(long, default_value = "light", value_name = "NAME|FILE")]
    pub(super) style: String,
    /// The size of a frame in pixels.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(super) size: Option<(u32, u32)>,
    /// Where the picture will be seen, which sets page, text and furniture so that it can be read there: on a
    /// repository's front page (830 pixels), a slide (1280 × 720), in a paper's column (88 mm) or on its page (181 mm).
    #[arg(id = "for", long = "for", value_name = "readme|slide|column|page", value_parser = ["readme", "slide", "column", "page"],
        conflicts_with_all = ["size", "width", "figure", "strip", "layout_from"])]
    pub(super) purpose: Option<String>,
    /// The width of a vector figure on paper: `88mm`, `180mm`.
    #[arg(long, value_name = "MM", value_parser = width)]
    pub(super) width: Option<f64>,
    /// Whether to grow the canvas and collapse namespaces until the text can be read.
    #[arg(long, value_name = "auto|none", default_value = "auto", value_parser = ["auto", "none"])]
    pub(super) fit: String,
    /// Which way edges run.
    #[arg(long, value_name = "LR|TB|auto", default_value = "auto", value_parser = ["LR", "TB", "auto"])]
    pub(super) orientation: String,
    /// The layout engine.
    #[arg(long, value_name = "ENGINE", default_value = "layered")]
    pub(super) layout: String,
    /// Keep the places of an earlier run's JSON.
    #[arg(long, value_name = "FILE")]
    pub(super) layout_from: Option<PathBuf>,
    /// The title, instead of the bag's name.
    #[arg(long)]
    pub(super) title: Option<String>,
    /// Draw the graph only.
    #[arg(long)]
    pub(super) bare: bool,
    /// Mission phases to show: a file of `seconds|text` lines, or a string topic.
    #[arg(long, value_name = "FILE|TOPIC")]
    pub(super) captions: Option<String>,
    /// A font file for characters that the bundled font lacks.
    #[arg(long, value_name = "FILE")]
    pub(super) font: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Figure")]
pub(super) struct FigureArgs {
    /// A figure for a paper, `--width` wide (88mm), with text of 6 pt at least: what lives when, who talks to whom, or
    /// the reconfigurations one by one. For `.pdf`, `.svg`, `.png`, `.webp`; `.tex` includes it.
    #[arg(long, value_name = "lives|map|steps", value_parser = ["lives", "map", "steps"], conflicts_with_all = [
        "strip", "style", "size", "fit", "orientation", "layout", "layout_from", "mode", "hide", "group", "collapse",
        "expand", "rqt_defaults", "show_recorder", "title",
    ])]
    pub(super) figure: Option<String>,
    /// What the rows or boxes of a figure stand for; by default as much as fits.
    #[arg(long, value_name = "nodes|groups|topics", value_parser = ["nodes", "groups", "topics"], requires = "figure")]
    pub(super) rows: Option<String>,
    /// The phases whose beginnings `--figure steps` shows, such as `3,5`. [default: the six that change most]
    #[arg(long, value_name = "N,M,…", value_delimiter = ',', requires = "figure", value_parser = clap::value_parser!(u16).range(2..))]
    pub(super) steps: Vec<u16>,
    /// The size of names in a figure, `7pt` to `12pt`; all else is a point smaller.
    #[arg(long, value_name = "PT", default_value = "7pt", value_parser = points, requires = "figure")]
    pub(super) text: f64,
    /// Phases of the mission: found (`auto`), `none`, or a file with a line per phase (`0:38 navigation`; names alone
    /// name those that are found).
    #[arg(long, value_name = "FILE|auto|none", default_value = "auto")]
    pub(super) phases: String,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Sequence")]
pub(super) struct SequenceArgs {
    /// How long a window is shown, in milliseconds.
    #[arg(long, value_name = "MS", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(20..=600_000))]
    pub(super) frame_ms: u32,
    /// Frames in between at windows with a change.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=60))]
    pub(super) tween: u32,
    /// Show windows with a change this many times as long.
    #[arg(long, value_name = "TIMES", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub(super) hold_changes: u32,
    /// A film strip of chosen windows: `3x2`, `changes`, or window numbers `0,4,9`.
    #[arg(long, value_name = "3x2|changes|N,M,…")]
    pub(super) strip: Option<String>,
    /// The most bytes a GIF may have: `5MB`, `500kB`. Gives up tween, then size, then frames, and says so.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub(super) max_bytes: Option<u64>,
    /// Also write the first frame of animations as a PNG here.
    #[arg(long, value_name = "FILE")]
    pub(super) poster: Option<PathBuf>,
    /// How JSON holds the windows: each with all that is in it, or each element once with what it says when. [default:
    /// windows up to 2000 of them, else runs]
    #[arg(long, value_name = "windows|runs", value_parser = ["windows", "runs"])]
    pub(super) json: Option<String>,
    /// A row per run of equal windows in tables of nodes, topics and edges, not per window.
    #[arg(long)]
    pub(super) runs: bool,
    /// How DOT is written: laid out for `rqt_graph`, or plain for Graphviz.
    #[arg(long, value_name = "rqt|plain", default_value = "rqt", value_parser = ["rqt", "plain"])]
    pub(super) dot_profile: String,
    /// A link for the report: `player=URL`.
    #[arg(long, value_name = "NAME=URL")]
    pub(super) link: Vec<String>,
}

fn length(text: &str) -> Result<Length, String> {
    if text == "all" {
        return Ok(Length::All);
    }
    period(text).map(Length::Fixed)
}

fn period(text: &str) -> Result<Period, String> {
    Period::parse(text).ok_or_else(|| "write `60`, `30s`, `1m` or `500ms`".to_owned())
}

fn moment(text: &str) -> Result<Moment, String> {
    Moment::parse(text).ok_or_else(|| "write `90`, `1:30`, `2m`, `-30s`, or RFC 3339".to_owned())
}

fn align(text: &str) -> Result<Align, String> {
    match text {
        "bag" => Ok(Align::Bag),
        "clock" => Ok(Align::Clock),
        _ => Err("write `bag` or `clock`".to_owned()),
    }
}

fn cut(text: &str) -> Result<Cut, String> {
    match text {
        "phases" => Ok(Cut::Phases),
        "changes" => Ok(Cut::Changes),
        _ => Err("write `phases` or `changes`".to_owned()),
    }
}

fn share(text: &str) -> Result<f64, String> {
    let share = text
        .parse()
        .ok()
        .filter(|s: &f64| s.is_finite() && *s >= 0.0);
    share.ok_or_else(|| "write a share such as `0.25`".to_owned())
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let side = |part: &str| part.parse().ok().filter(|n| (64..=16_384).contains(n));
    let both = text
        .split_once('x')
        .and_then(|(w, h)| Some((side(w)?, side(h)?)));
    both.ok_or_else(|| "write a size such as `1280x720`; each side is 64 to 16384".to_owned())
}

fn width(text: &str) -> Result<f64, String> {
    let millimetres = text.strip_suffix("mm").and_then(|n| n.parse().ok());
    let millimetres = millimetres.filter(|mm: &f64| (20.0..=2000.0).contains(mm));
    millimetres.ok_or_else(|| "write a width such as `88mm`; 20 to 2000".to_owned())
}

fn points(text: &str) -> Result<f64, String> {
    let points = text.strip_suffix("pt").and_then(|n| n.parse().ok());
    let points = points.filter(|pt: &f64| (7.0..=12.0).contains(pt));
    points.ok_or_else(|| "write a size such as `8pt`; 7 to 12".to_owned())
}

fn bytes(text: &str) -> Result<u64, String> {
    let at = text
        .find(|c: char| c.is_ascii_alphabetic())
        .unwrap_or(text.len());
    let scale = match text[at..].to_ascii_lowercase().as_str() {
        "" | "b" => 1,
        "k" | "kb" => 1000,
        "m" | "mb" => 1_000_000,
        "kib" => 1024,
        "mib" => 1024 * 1024,
        _ => 0,
    };
    // The nanoseconds of a plain decimal number are exact enough for its thousandths.
    let number = parse_nanos(&text[..at]).filter(|_| scale > 0 && at > 0);
    let bytes =
        number.and_then(|n| u64::try_from(i128::from(n) * i128::from(scale) / 1_000_000_000).ok());
    bytes
        .filter(|n| *n > 0)
        .ok_or_else(|| "write a size such as `5MB` or `500kB`".to_owned())
}

const OUTPUT: &str = "A file to write; its extension tells the format, `{n}` makes one file per window, `-` is standard \
    output. May be given many times; the bag is read once. [default: out/<bag name>.gif]";

/// The table of formats, for the end of `render --help`.
fn outputs_help() -> String {
    let rows = FORMATS
        .iter()
        .map(|f| format!("  .{:<6} {}", f.word, f.what));
    let rows: Vec<String> = rows.collect();
    shown(&format!("Outputs, by extension:\n{}", rows.join("\n")))
}

/// A help text in which `{n}` stands as it is: clap would make a new line of it, so a style that changes nothing, and
/// that is left out where there is no terminal, comes in between.
fn shown(text: &str) -> String {
    text.replace("{n}", "{\u{1b}[0mn}")
}
