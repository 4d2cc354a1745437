//! The arguments of `diff`, `baseline` and `check`.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{GraphArgs, Inputs, length, moment, share, size};
use crate::base::time::Moment;
use crate::gate;
use crate::graph::diff::RATE_CHANGE;
use crate::graph::window::Length;

#[derive(Debug, Args)]
pub(crate) struct DiffArgs {
    /// A bag, a folder, a mission in JSON, or an expectation (`.yaml`), which the other is held against.
    #[arg(value_name = "A")]
    pub(crate) first: PathBuf,
    /// The other.
    #[arg(value_name = "B")]
    pub(crate) second: PathBuf,
    /// How to print what differs.
    #[arg(long, value_name = "text|json|markdown", default_value = "text", value_parser = diff_format)]
    pub(crate) format: &'static gate::DiffFormat,
    /// A file to write too: `.txt`, `.json`, `.md`, or one picture of both: `.html`, `.svg`, `.gif` and all that `render`
    /// draws. May be given many times.
    #[arg(long = "output", short, value_name = "FILE")]
    pub(crate) outputs: Vec<OsString>,
    /// The style of pictures: built in, or a style file. See `bagreel styles`.
    #[arg(long, default_value = "light", value_name = "NAME|FILE")]
    pub(crate) style: String,
    /// The size of pictures in pixels.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<(u32, u32)>,
    /// A rate that differs by more than this share is told, if chance does not make such a difference.
    #[arg(long, value_name = "SHARE", default_value_t = RATE_CHANGE, value_parser = share)]
    pub(crate) rate_change: f64,
    /// Begin both here: `90`, `1:30` or `2m` after the bag's start, `-30s` before its end, or RFC 3339.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(crate) start: Option<Moment>,
    /// End both here, written like `--start`.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(crate) end: Option<Moment>,
    #[command(flatten)]
    pub(crate) graph: GraphArgs,
}

impl DiffArgs {
    /// The part of the missions that is compared.
    pub(crate) fn time(&self) -> GateTime {
        GateTime {
            period: None,
            start: self.start,
            end: self.end,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct BaselineArgs {
    /// Healthy runs: each bag is one, and what holds in all of them is written down.
    #[arg(required = true, value_name = "BAG")]
    pub(crate) bags: Vec<PathBuf>,
    /// The file to write; `-` is standard output.
    #[arg(
        long,
        short,
        value_name = "FILE",
        default_value = "-",
        conflicts_with = "update"
    )]
    pub(crate) output: OsString,
    /// Bring this expectation up to date instead: only what no longer holds is written anew, comments stay.
    #[arg(long, value_name = "FILE")]
    pub(crate) update: Option<PathBuf>,
    /// Bring only these nodes and topics up to date.
    #[arg(long, value_name = "NAME", requires = "update")]
    pub(crate) only: Vec<String>,
    #[command(flatten)]
    pub(crate) time: GateTime,
    #[command(flatten)]
    pub(crate) graph: GraphArgs,
}

#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// Bags, as `render` takes them: several are one mission.
    #[arg(required_unless_present = "explain", value_name = "BAG")]
    pub(crate) bags: Vec<PathBuf>,
    /// The expectation that the mission is held against.
    #[arg(long, value_name = "FILE", required_unless_present = "explain")]
    pub(crate) expect: Option<PathBuf>,
    /// How to print what was found.
    #[arg(long, value_name = "WORD", default_value = "text", value_parser = check_format)]
    pub(crate) format: &'static gate::Format,
    /// A file to write too; its name tells the format, or a word before it: `check.xml`, `gitlab:quality.json`. May be
    /// given many times.
    #[arg(long = "output", short, value_name = "[WORD:]FILE")]
    pub(crate) outputs: Vec<OsString>,
    /// A link for the Markdown: `player=URL`.
    #[arg(long, value_name = "NAME=URL", value_parser = link)]
    pub(crate) link: Vec<(String, String)>,
    /// What comes of rules that the bag has no evidence to decide.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) undecidable: Undecidable,
    /// Explain a kind of finding, such as `topic-rate-low`.
    #[arg(long, value_name = "ID", conflicts_with_all = [
        "bags", "expect", "format", "outputs", "link", "undecidable", "period", "start", "end", "roles", "topology", "source",
        "infer",
    ])]
    pub(crate) explain: Option<String>,
    #[command(flatten)]
    pub(crate) time: GateTime,
    #[command(flatten)]
    pub(crate) graph: GraphArgs,
}

/// What undecidable rules do to the exit code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "lower")]
pub(crate) enum Undecidable {
    /// Nothing.
    #[default]
    Allow,
    /// They fail.
    Error,
}

/// Which part of a mission is judged, and in which windows.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Time")]
pub(crate) struct GateTime {
    /// The length of the windows in which rates are judged: `60`, `30s`, `500ms`. [default: the expectation's `period`]
    #[arg(long, short, value_parser = length)]
    pub(crate) period: Option<Length>,
    /// Begin here: `90`, `1:30` or `2m` after the bag's start, `-30s` before its end, or RFC 3339.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(crate) start: Option<Moment>,
    /// End here, written like `--start`.
    #[arg(long, value_parser = moment, allow_hyphen_values = true)]
    pub(crate) end: Option<Moment>,
}

impl CheckArgs {
    /// The bags, as the other commands take them.
    pub(crate) fn inputs(&self) -> Inputs {
        Inputs {
            bags: self.bags.clone(),
            verify: false,
        }
    }
}

pub(crate) const DIFF_HELP: &str = "Exit codes: 0 the same, 1 different, 2 could not tell (usage, unreadable), 3 the same but data was skipped (damaged \
    bag).";
pub(crate) const BASELINE_HELP: &str =
    "Exit codes: 0 written, 1 failed, 2 usage, 3 written but data was skipped (damaged bag).";
pub(crate) const CHECK_HELP: &str = "Exit codes: 0 kept, 1 broken, 2 could not tell (usage, unreadable, or nothing could be decided), 3 kept but data was \
    skipped (damaged bag).";

fn check_format(word: &str) -> Result<&'static gate::Format, String> {
    gate::Format::from_word(word).ok_or_else(|| {
        let words: Vec<&str> = gate::FORMATS.iter().map(|f| f.word).collect();
        format!("write one of {}", words.join(", "))
    })
}

fn diff_format(word: &str) -> Result<&'static gate::DiffFormat, String> {
    let word = if word == "md" { "markdown" } else { word };
    let format = gate::DIFF_FORMATS.iter().find(|f| f.word == word);
    format.ok_or_else(|| "write one of text, json, markdown".to_owned())
}

fn link(text: &str) -> Result<(String, String), String> {
    let (name, url) = text.split_once('=').ok_or("write `player=URL`")?;
    if name.is_empty() || url.is_empty() {
        return Err("write `player=URL`".to_owned());
    }
    Ok((name.to_owned(), url.to_owned()))
}

/// The formats, for the end of `check --help`.
pub(crate) fn check_help() -> String {
    let rows = gate::FORMATS.iter().map(|f| {
        let ends = f
            .endings
            .first()
            .map_or_else(String::new, |e| format!(" ({e})"));
        format!("  {:<9} {}{ends}", f.word, f.what)
    });
    let rows: Vec<String> = rows.collect();
    format!("Formats:\n{}\n\n{CHECK_HELP}", rows.join("\n"))
}
