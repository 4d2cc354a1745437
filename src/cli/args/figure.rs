//! The arguments of `bagreel figure`.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Args;

use super::values::{one_of, phases, points, width};
use super::{GraphArgs, Inputs, RangeArgs, RateArgs};
use crate::draw::figure::{FigureKind, RowKind};
use crate::pipeline::Phases;

#[derive(Debug, Args)]
pub(crate) struct FigureArgs {
    #[command(flatten)]
    pub(crate) inputs: Inputs,
    /// Output file: `.pdf`, `.svg`, `.png` or `.webp`, and `.tex` to include it. Repeatable; without it,
    /// `out/<bag name>.pdf`.
    #[arg(long = "output", short, value_name = "FILE")]
    pub(crate) outputs: Vec<OsString>,
    /// Lifelines, the graph of who publishes to whom, or the reconfigurations one by one.
    #[arg(long, default_value = "lives", value_parser = one_of(FigureKind::ALL))]
    pub(crate) kind: FigureKind,
    /// Width on paper: `88mm`, `180mm`. [default: 88mm]
    #[arg(long, value_name = "MM", value_parser = width)]
    pub(crate) width: Option<f64>,
    #[command(flatten)]
    pub(crate) form: FigureForm,
    #[command(flatten)]
    pub(crate) phases: PhaseArgs,
    /// Draw the figure without its legend.
    #[arg(long)]
    pub(crate) bare: bool,
    /// Font file for characters that the bundled font lacks.
    #[arg(long, value_name = "FILE")]
    pub(crate) font: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) range: RangeArgs,
    #[command(flatten)]
    pub(crate) rate: RateArgs,
    /// Nodes to draw, as `rqt_graph` filters: `/nav/.*,-/nav/debug`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    pub(crate) ns_filter: Option<String>,
    /// Topics to draw, in the same form as `--ns-filter`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    pub(crate) topic_filter: Option<String>,
    #[command(flatten)]
    pub(crate) graph: GraphArgs,
}

/// The options of every kind of figure.
#[derive(Debug, Default, Args)]
pub(crate) struct FigureForm {
    /// What a row of `lives` represents. [default: the finest that fits]
    #[arg(long, value_name = "nodes|groups|topics", value_parser = one_of(RowKind::ALL))]
    pub(crate) rows: Option<RowKind>,
    /// Phases whose beginnings `steps` shows, such as `3,5`. [default: the six with most changes]
    #[arg(long, value_name = "N,M,…", value_delimiter = ',', value_parser = clap::value_parser!(u16).range(2..))]
    pub(crate) steps: Vec<u16>,
    /// Size of names, `7pt` to `12pt`; other text is a point smaller. [default: 7pt]
    #[arg(long, value_name = "PT", value_parser = points)]
    pub(crate) text: Option<f64>,
}

#[derive(Debug, Args)]
pub(crate) struct PhaseArgs {
    /// Phases of the mission: detected (`auto`), `none`, or a file of lines such as `0:38 navigation` or names alone.
    #[arg(long, value_name = "FILE|auto|none", default_value = "auto", value_parser = phases)]
    pub(crate) phases: Phases,
}
