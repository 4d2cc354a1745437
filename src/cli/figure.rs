//! `bagreel figure`: its arguments, and the job that they are.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Args;

use super::applies::{self, Given};
use super::args::{GraphArgs, Inputs, PhaseArgs, RangeArgs, RateArgs, reading};
use super::code;
use super::render::{fonts, make_room, outputs, wrote};
use super::terminal::Terminal;
use super::values::{one_of, points, width};
use crate::base::error::{Error, Result};
use crate::base::notice::NoticeKind;
use crate::draw::figure::{FigureKind, RowKind};
use crate::export::sequence::FigureOptions;
use crate::pipeline::Render;
use crate::view::NameFilter;

#[derive(Debug, Args)]
pub(super) struct FigureArgs {
    #[command(flatten)]
    inputs: Inputs,
    /// Output file: `.pdf`, `.svg`, `.png` or `.webp`, and `.tex` to include it. Repeatable; without it,
    /// `out/<bag name>.pdf`.
    #[arg(long = "output", short, value_name = "FILE")]
    outputs: Vec<OsString>,
    /// Lifelines, the graph of who publishes to whom, the holders of topics that change hands, or the steps from phase to
    /// phase.
    #[arg(long, default_value = "lives", value_parser = one_of(FigureKind::ALL))]
    kind: FigureKind,
    /// Width on paper: `88mm`, `180mm`. [default: 88mm]
    #[arg(long, value_name = "MM", value_parser = width)]
    width: Option<f64>,
    /// What a row of `lives` represents. [default: the finest that fits]
    #[arg(long, value_name = "nodes|groups|topics", value_parser = one_of(RowKind::ALL))]
    rows: Option<RowKind>,
    /// Phases whose beginnings `steps` shows, such as `3,5`. [default: the six with most changes]
    #[arg(long, value_name = "N,M,…", value_delimiter = ',', value_parser = clap::value_parser!(u16).range(2..))]
    steps: Vec<u16>,
    /// Size of names, `7pt` to `12pt`; other text is a point smaller. [default: 7pt]
    #[arg(long, value_name = "PT", value_parser = points)]
    text: Option<f64>,
    #[command(flatten)]
    phases: PhaseArgs,
    /// Draw the figure without its legend.
    #[arg(long)]
    bare: bool,
    /// Font file for characters that the bundled font lacks.
    #[arg(long, value_name = "FILE")]
    font: Option<PathBuf>,
    #[command(flatten)]
    range: RangeArgs,
    #[command(flatten)]
    rate: RateArgs,
    /// Nodes to draw, as `rqt_graph` filters: `/nav/.*,-/nav/debug`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    ns_filter: Option<String>,
    /// Topics to draw, in the same form as `--ns-filter`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    topic_filter: Option<String>,
    #[command(flatten)]
    graph: GraphArgs,
}

/// Reads once and draws a figure.
pub(super) fn figure(args: &FigureArgs, given: &Given, terminal: &mut Terminal) -> Result<u8> {
    let job = job(args)?;
    crate::pipeline::check_outputs(&job)?;
    applies::check_inputs(given, &job.reading)?;
    make_room(&job, terminal);
    let done = crate::pipeline::render(&job, terminal)?;
    // A figure shows continuous time, independent of windows.
    terminal.notices(&done.notices.without(NoticeKind::Chosen));
    wrote(&done, "", terminal);
    Ok(code(&done.mission.notices))
}

/// The job of `figure`.
fn job(args: &FigureArgs) -> Result<Render> {
    let mut reading = reading(&args.inputs, &args.graph)?;
    reading.division = args.range.in_windows(None);
    reading.rate_change = args.rate.rate_change;
    reading.phases = args.phases.phases.clone();
    let outputs = outputs(&args.outputs, &reading, "pdf", None)?;
    let mut job = Render::new(reading, outputs)?;
    let filter = |text: &Option<String>| NameFilter::parse(text.as_deref().unwrap_or_default());
    job.drawing.fonts = fonts(args.font.as_deref())?;
    job.drawing.view.ns_filter = filter(&args.ns_filter)?;
    job.drawing.view.topic_filter = filter(&args.topic_filter)?;
    job.drawing.page.rate_change = args.rate.rate_change;
    job.drawing.page.width_mm = args.width;
    job.sequence.figure = Some(options(args)?);
    job.kept = args.font.iter().cloned().collect();
    Ok(job)
}

/// The requested figure, with its width on paper in millimetres.
fn options(args: &FigureArgs) -> Result<FigureOptions> {
    let kind = args.kind;
    let steps = args.steps.iter().map(|s| usize::from(*s)).collect();
    if kind != FigureKind::Steps && !args.steps.is_empty() {
        return Err(Error::usage(
            format!("`--steps` has no effect on `{}`", kind.word()),
            "it chooses the panels of `--kind steps`",
        ));
    }
    if kind != FigureKind::Lives && args.rows.is_some() {
        return Err(Error::usage(
            format!("`--rows` has no effect on `{}`", kind.word()),
            "it chooses the rows of `--kind lives`",
        ));
    }
    let default = FigureOptions::default();
    Ok(FigureOptions {
        kind,
        width_mm: args.width.unwrap_or(default.width_mm),
        text_pt: args.text.unwrap_or(default.text_pt),
        rows: args.rows,
        steps,
        is_bare: args.bare,
        ..default
    })
}
