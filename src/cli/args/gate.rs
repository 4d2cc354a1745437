//! The arguments of `diff`, `baseline` and `check`.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::values::{length, share};
use super::{GraphArgs, RangeArgs};
use crate::gate::{FORMATS, ReportFormat};
use crate::graph::diff::RATE_CHANGE;
use crate::graph::window::Length;

#[derive(Debug, Args)]
pub(crate) struct DiffArgs {
    /// First mission: a bag, a folder, a mission's JSON, or an expectations file (`.yaml`).
    #[arg(value_name = "A")]
    pub(crate) first: PathBuf,
    /// Second mission, in the same forms.
    #[arg(value_name = "B")]
    pub(crate) second: PathBuf,
    /// Output format.
    #[arg(long, value_name = "text|json|markdown", default_value = "text", value_parser = diff_format)]
    pub(crate) format: &'static ReportFormat,
    /// Also write this file: `.txt`, `.json`, `.md`, or a picture of both in any format of `render`. Repeatable.
    #[arg(long = "output", short, value_name = "FILE")]
    pub(crate) outputs: Vec<OsString>,
    /// Report rates that differ by more than this fraction, if statistically significant.
    #[arg(long, value_name = "SHARE", default_value_t = RATE_CHANGE, value_parser = share)]
    pub(crate) rate_change: f64,
    #[command(flatten)]
    pub(crate) range: RangeArgs,
}

#[derive(Debug, Args)]
pub(crate) struct BaselineArgs {
    /// Bags of healthy runs, one run each.
    #[arg(required = true, value_name = "BAG")]
    pub(crate) bags: Vec<PathBuf>,
    /// Output file; `-` is standard output.
    #[arg(
        long,
        short,
        value_name = "FILE",
        default_value = "-",
        conflicts_with = "update"
    )]
    pub(crate) output: OsString,
    /// Update this expectations file: rewrite only what no longer matches and keep comments.
    #[arg(long, value_name = "FILE")]
    pub(crate) update: Option<PathBuf>,
    /// Update only these nodes and topics.
    #[arg(long, value_name = "NAME", requires = "update")]
    pub(crate) only: Vec<String>,
    /// Length of the windows in which rates are measured: `60`, `30s`, `500ms`. [default: the file's `period`]
    #[arg(long, short, value_parser = length)]
    pub(crate) period: Option<Length>,
    #[command(flatten)]
    pub(crate) range: RangeArgs,
    /// Add nodes and edges from a CSV, YAML, MCAP (`/rosgraph`) or launch file, or from DOT saved by rqt_graph.
    #[arg(long, value_name = "FILE")]
    pub(crate) topology: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// Bags, as for `render`; several are read as one mission.
    #[arg(required_unless_present = "explain", value_name = "BAG")]
    pub(crate) bags: Vec<PathBuf>,
    /// Expectations file to check against.
    #[arg(long, value_name = "FILE", required_unless_present = "explain")]
    pub(crate) expect: Option<PathBuf>,
    /// Output format.
    #[arg(long, value_name = "WORD", default_value = "text", value_parser = check_format)]
    pub(crate) format: &'static ReportFormat,
    /// Also write this file, in the format of its extension or prefix: `check.xml`, `gitlab:quality.json`. Repeatable.
    #[arg(long = "output", short, value_name = "[WORD:]FILE")]
    pub(crate) outputs: Vec<OsString>,
    /// How to treat rules that cannot be evaluated.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) undecidable: Undecidable,
    /// Explain a kind of finding, such as `topic-rate-low`, and exit.
    #[arg(long, value_name = "ID", conflicts_with_all = [
        "bags", "expect", "format", "outputs", "undecidable", "start", "end", "topology", "source", "infer",
    ])]
    pub(crate) explain: Option<String>,
    #[command(flatten)]
    pub(crate) range: RangeArgs,
    #[command(flatten)]
    pub(crate) graph: GraphArgs,
}

/// The effect of undecidable rules on the exit code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "lower")]
pub(crate) enum Undecidable {
    /// They do not fail the check.
    #[default]
    Allow,
    /// They fail the check.
    Error,
}

pub(crate) const DIFF_HELP: &str = "Exit codes: 0 equal, 1 different, 2 not compared (usage error, unreadable bag), 3 equal but data was skipped \
    (damaged bag).";
pub(crate) const BASELINE_HELP: &str =
    "Exit codes: 0 written, 1 failed, 2 usage error, 3 written but data was skipped (damaged bag).";
pub(crate) const CHECK_HELP: &str = "Exit codes: 0 passed, 1 failed, 2 not checked (usage error, unreadable bag, no rule could be evaluated), 3 passed but \
    data was skipped (damaged bag).";

fn check_format(word: &str) -> Result<&'static ReportFormat, String> {
    ReportFormat::from_word(word).ok_or_else(|| {
        let words: Vec<&str> = FORMATS.iter().map(|f| f.word).collect();
        format!("write one of {}", words.join(", "))
    })
}

fn diff_format(word: &str) -> Result<&'static ReportFormat, String> {
    let format = ReportFormat::from_word(word).filter(|format| format.differences.is_some());
    format.ok_or_else(|| "write one of text, json, markdown".to_owned())
}

/// The formats, for the end of `check --help`.
pub(crate) fn check_help() -> String {
    let rows = FORMATS.iter().map(|f| {
        let ends = f
            .endings
            .first()
            .map_or_else(String::new, |e| format!(" ({e})"));
        format!("  {:<9} {}{ends}", f.word, f.what)
    });
    let rows: Vec<String> = rows.collect();
    format!("Formats:\n{}\n\n{CHECK_HELP}", rows.join("\n"))
}
