//! The arguments of `bagreel render`.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use clap::{ArgAction, Args};

use super::figure::PhaseArgs;
use super::values::{bytes, link, one_of, size, width};
use super::{GraphArgs, Inputs, RateArgs, TimeArgs, VerifyArgs};
use crate::base::words::worded;
use crate::export::FORMATS;
use crate::layout::Orientation;
use crate::pipeline::Purpose;

#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub(crate) inputs: Inputs,
    #[command(flatten)]
    pub(crate) again: VerifyArgs,
    #[arg(long = "output", short, value_name = "FILE", help = shown(OUTPUT))]
    pub(crate) outputs: Vec<OsString>,
    /// Format of outputs without a known extension, such as `-`.
    #[arg(long, value_name = "WORD")]
    pub(crate) format: Option<String>,
    #[command(flatten)]
    pub(crate) time: TimeArgs,
    #[command(flatten)]
    pub(crate) rate: RateArgs,
    #[command(flatten)]
    pub(crate) graph: GraphArgs,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    #[command(flatten)]
    pub(crate) look: LookArgs,
    #[command(flatten)]
    pub(crate) sequence: SequenceArgs,
    #[command(flatten)]
    pub(crate) phases: PhaseArgs,
}

#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    /// Draw nodes only, with one line per pair and the topics on it, nodes and topics, or a timeline of topics.
    /// [default: all; topics if most publishers are unknown]
    #[arg(long, value_name = "nodes|all|topics", value_parser = one_of(ModeWord::ALL))]
    pub(crate) mode: Option<ModeWord>,
    /// Nodes to draw, as `rqt_graph` filters: `/nav/.*,-/nav/debug`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    pub(crate) ns_filter: Option<String>,
    /// Topics to draw, in the same form as `--ns-filter`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    pub(crate) topic_filter: Option<String>,
    /// Kinds to leave out: quiet, debug, dead, leaf, tf, params, services, unreachable, or none. [default: quiet]
    #[arg(long, value_name = "KIND,…")]
    pub(crate) hide: Option<String>,
    /// Kinds to draw as one box: actions, tf, images, namespaces=N, or none. [default: all of them]
    #[arg(long, value_name = "KIND,…")]
    pub(crate) group: Option<String>,
    /// Draw each of these namespaces as one box; one after `-` never is: `/robot2,-/robot1`.
    #[arg(
        long,
        value_name = "[-]NAMESPACE,…",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    pub(crate) collapse: Vec<String>,
    /// Draw what `rqt_graph` shows by default.
    #[arg(long)]
    pub(crate) rqt_defaults: bool,
}

worded! {
    /// What a picture shows.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) enum ModeWord {
        /// Nodes.
        Nodes = "nodes",
        /// Nodes and topics.
        All = "all",
        /// Topics, over time.
        Topics = "topics",
    }
}

#[derive(Debug, Args)]
pub(crate) struct LookArgs {
    /// Built-in style or style file; see `bagreel styles`.
    #[arg(long, default_value = "light", value_name = "NAME|FILE")]
    pub(crate) style: String,
    /// Frame size in pixels. [default: fits the graph]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<(u32, u32)>,
    /// Choose page and text size for a README (830 px), a slide (1280×720), or a paper's column (88 mm) or page (181 mm).
    #[arg(id = "for", long = "for", value_name = "readme|slide|column|page", value_parser = one_of(Purpose::ALL),
        conflicts_with_all = ["size", "width", "strip", "layout_from"])]
    pub(crate) purpose: Option<Purpose>,
    /// Printed width of a PDF or SVG: `88mm`, `180mm`.
    #[arg(long, value_name = "MM", value_parser = width)]
    pub(crate) width: Option<f64>,
    /// Enlarge the page and collapse namespaces until labels are legible.
    #[arg(long, value_name = "auto|none", default_value = "auto", action = ArgAction::Set,
        value_parser = PossibleValuesParser::new(["auto", "none"]).map(|word| word == "auto"))]
    pub(crate) fit: bool,
    /// Direction of edges. [default: the better one]
    #[arg(long, value_name = "LR|TB", value_parser = one_of(Orientation::ALL))]
    pub(crate) orientation: Option<Orientation>,
    /// Layout engine: layered or layout-rs.
    #[arg(long, value_name = "ENGINE", default_value = "layered")]
    pub(crate) layout: String,
    /// Reuse the positions of an earlier run's JSON.
    #[arg(long, value_name = "FILE")]
    pub(crate) layout_from: Option<PathBuf>,
    /// Title. [default: the bag's name]
    #[arg(long)]
    pub(crate) title: Option<String>,
    /// Draw the graph without title, legend or timeline.
    #[arg(long)]
    pub(crate) bare: bool,
    /// Font file for characters that the bundled font lacks.
    #[arg(long, value_name = "FILE")]
    pub(crate) font: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct SequenceArgs {
    /// Duration of every frame in milliseconds [default: the time to read what changes, and none for long quiet times].
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u32).range(20..=600_000))]
    pub(crate) frame_ms: Option<u32>,
    /// Draw several windows side by side: a grid `3x2`, or window numbers `0,4,9`.
    #[arg(long, value_name = "3x2|N,M,…")]
    pub(crate) strip: Option<String>,
    /// Limit a GIF's size, such as `5MB`, by dropping resolution, then frames.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub(crate) max_bytes: Option<u64>,
    /// Link to add to the report, such as `player=URL`.
    #[arg(long, value_name = "NAME=URL", value_parser = link)]
    pub(crate) link: Vec<(String, String)>,
}

const OUTPUT: &str = "Output file; the extension selects the format, `{n}` writes one file per window, `-` is standard \
    output. Repeatable. [default: out/<bag name>.gif; .png if nothing changes, and for a topic timeline]";

/// The table of formats, for the end of `render --help`.
pub(super) fn outputs_help() -> String {
    let rows = FORMATS
        .iter()
        .map(|f| format!("  .{:<6} {}", f.word, f.what));
    let rows: Vec<String> = rows.collect();
    shown(&format!("Outputs, by extension:\n{}", rows.join("\n")))
}

/// A help text that shows `{n}` literally: clap would replace it by a line break, so an escape sequence that has no effect
/// is put inside; clap removes it where there is no terminal.
fn shown(text: &str) -> String {
    text.replace("{n}", "{\u{1b}[0mn}")
}
