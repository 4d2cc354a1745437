//! `bagreel render`: its arguments, the job that they are, and the report of what was written.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use clap::{ArgAction, Args};

use super::applies::{self, Given, OF_GRAPHS};
use super::args::{GraphArgs, Inputs, PhaseArgs, RateArgs, TimeArgs, reading};
use super::code;
use super::terminal::Terminal;
use super::values::{bytes, link, one_of, size, width};
use crate::bag::Input;
use crate::base::error::{Error, Result};
use crate::base::geometry::Size;
use crate::base::words::{self, worded};
use crate::base::{budget, file};
use crate::draw::picture::PageOptions;
use crate::draw::style::{BUILTIN, Style};
use crate::draw::text::Fonts;
use crate::export::sequence::{self, SequenceOptions};
use crate::export::target::Target;
use crate::export::{FORMATS, Output};
use crate::graph::window::Length;
use crate::layout::Orientation;
use crate::mission::{Mission, Places, read_json};
use crate::pipeline::{Body, Drawing, Purpose, Reading, Render, Rendered};
use crate::view::{Grouping, Hide, Mode, NameFilter, ViewOptions};

#[derive(Debug, Args)]
pub(super) struct RenderArgs {
    #[command(flatten)]
    pub(super) inputs: Inputs,
    #[arg(long = "output", short, value_name = "FILE", help = shown(OUTPUT))]
    pub(super) outputs: Vec<OsString>,
    /// Format of outputs without a known extension, such as `-`.
    #[arg(long, value_name = "WORD")]
    pub(super) format: Option<String>,
    #[command(flatten)]
    pub(super) time: TimeArgs,
    #[command(flatten)]
    pub(super) rate: RateArgs,
    #[command(flatten)]
    pub(super) graph: GraphArgs,
    #[command(flatten)]
    pub(super) view: ViewArgs,
    #[command(flatten)]
    pub(super) look: LookArgs,
    #[command(flatten)]
    pub(super) sequence: SequenceArgs,
    #[command(flatten)]
    pub(super) phases: PhaseArgs,
}

#[derive(Debug, Args)]
pub(super) struct ViewArgs {
    /// Draw nodes only, with one line per pair and the topics on it, nodes and topics, or a timeline of topics.
    /// [default: all; topics if most publishers are unknown]
    #[arg(long, value_name = "nodes|all|topics", value_parser = one_of(ModeWord::ALL))]
    pub(super) mode: Option<ModeWord>,
    /// Nodes to draw, as `rqt_graph` filters: `/nav/.*,-/nav/debug`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    pub(super) ns_filter: Option<String>,
    /// Topics to draw, in the same form as `--ns-filter`.
    #[arg(long, value_name = "FILTER", allow_hyphen_values = true)]
    pub(super) topic_filter: Option<String>,
    /// Kinds to leave out: quiet, debug, dead, leaf, tf, params, services, unreachable, or none. [default: quiet]
    #[arg(long, value_name = "KIND,…")]
    pub(super) hide: Option<String>,
    /// Kinds to draw as one box: actions, tf, images, namespaces=N, or none. [default: all of them]
    #[arg(long, value_name = "KIND,…")]
    pub(super) group: Option<String>,
    /// Draw each of these namespaces as one box; one after `-` never is: `/robot2,-/robot1`.
    #[arg(
        long,
        value_name = "[-]NAMESPACE,…",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    pub(super) collapse: Vec<String>,
    /// Draw what `rqt_graph` shows by default.
    #[arg(long)]
    pub(super) rqt_defaults: bool,
}

worded! {
    /// What a picture shows.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(super) enum ModeWord {
        /// Nodes.
        Nodes = "nodes",
        /// Nodes and topics.
        All = "all",
        /// Topics, over time.
        Topics = "topics",
    }
}

#[derive(Debug, Args)]
pub(super) struct LookArgs {
    /// Built-in style or style file; see `bagreel styles`.
    #[arg(long, default_value = "light", value_name = "NAME|FILE")]
    pub(super) style: String,
    /// Frame size in pixels. [default: fits the graph]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(super) size: Option<(u32, u32)>,
    /// Choose page and text size for a README (830 px), a slide (1280×720), or a paper's column (88 mm) or page (181 mm).
    #[arg(id = "for", long = "for", value_name = "readme|slide|column|page", value_parser = one_of(Purpose::ALL),
        conflicts_with_all = ["size", "width", "strip", "layout_from"])]
    pub(super) purpose: Option<Purpose>,
    /// Printed width of a PDF or SVG: `88mm`, `180mm`.
    #[arg(long, value_name = "MM", value_parser = width)]
    pub(super) width: Option<f64>,
    /// Enlarge the page and collapse namespaces until labels are legible.
    #[arg(long, value_name = "auto|none", default_value = "auto", action = ArgAction::Set,
        value_parser = PossibleValuesParser::new(["auto", "none"]).map(|word| word == "auto"))]
    pub(super) fit: bool,
    /// Direction of edges. [default: the better one]
    #[arg(long, value_name = "LR|TB", value_parser = one_of(Orientation::ALL))]
    pub(super) orientation: Option<Orientation>,
    /// Layout engine: layered or layout-rs.
    #[arg(long, value_name = "ENGINE", default_value = "layered")]
    pub(super) layout: String,
    /// Reuse the positions of an earlier run's JSON.
    #[arg(long, value_name = "FILE")]
    pub(super) layout_from: Option<PathBuf>,
    /// Title. [default: the bag's name]
    #[arg(long)]
    pub(super) title: Option<String>,
    /// Draw the graph without title, legend or timeline.
    #[arg(long)]
    pub(super) bare: bool,
    /// Font file for characters that the bundled font lacks.
    #[arg(long, value_name = "FILE")]
    pub(super) font: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct SequenceArgs {
    /// Duration of every frame in milliseconds [default: the time to read what changes, and none for long quiet times].
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u32).range(20..=600_000))]
    pub(super) frame_ms: Option<u32>,
    /// Draw several windows side by side: a grid `3x2`, or window numbers `0,4,9`.
    #[arg(long, value_name = "3x2|N,M,…")]
    pub(super) strip: Option<String>,
    /// Limit a GIF's size, such as `5MB`, by dropping resolution, then frames.
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub(super) max_bytes: Option<u64>,
    /// Link to add to the report, such as `player=URL`.
    #[arg(long, value_name = "NAME=URL", value_parser = link)]
    pub(super) link: Vec<(String, String)>,
}

const OUTPUT: &str = "Output file; the extension selects the format, `{n}` writes one file per window, `-` is standard \
    output. Repeatable. [default: out/<bag name>.gif; .png if nothing changes, and for a topic timeline]";

/// The table of formats, for the end of `render --help`.
pub(super) fn outputs_help() -> String {
    let rows = FORMATS.iter();
    let rows = rows.map(|f| format!("  .{:<6} {}", f.word, f.what));
    shown(&("Outputs, by extension:\n".to_owned() + &words::joined(rows, "\n")))
}

/// A help text that shows `{n}` literally: clap would replace it by a line break, so an escape sequence that has no effect
/// is put inside; clap removes it where there is no terminal.
fn shown(text: &str) -> String {
    text.replace("{n}", "{\u{1b}[0mn}")
}

/// Reads once and writes every output.
pub(super) fn render(args: &RenderArgs, given: &Given, terminal: &mut Terminal) -> Result<u8> {
    let job = job(args, given)?;
    let is_one_window = args.time.period == Some(Length::All);
    applies::check_outputs(given, is_one_window, &job.outputs)?;
    if args.view.mode == Some(ModeWord::Topics) {
        applies::check_topics(given, &job.outputs)?;
    }
    crate::pipeline::check_outputs(&job)?;
    applies::check_inputs(given, &job.reading)?;
    make_room(&job, terminal);
    let done = crate::pipeline::render(&job, terminal)?;
    report(&done, terminal);
    Ok(code(&done.mission.notices))
}

/// Hides the progress if an output is standard output.
pub(super) fn make_room(job: &Render, terminal: &mut Terminal) {
    let mut targets = job.outputs.iter().map(|output| &output.target);
    if targets.any(|target| *target == Target::Stdout) {
        terminal.make_room();
    }
}

/// The outputs as given, or that of the bag's name with this extension.
pub(super) fn outputs(
    given: &[OsString],
    reading: &Reading,
    extension: &str,
    format: Option<&str>,
) -> Result<Vec<Output>> {
    if given.is_empty() {
        let name = default_output(&reading.inputs, extension);
        return Ok(vec![Output::parse(&name, format)?]);
    }
    let summary = summary();
    let named = given.iter().map(|output| {
        let is_summary = summary.as_deref() == Some(Path::new(output));
        Output::named(output, format.or(is_summary.then_some("md")))
    });
    named.collect()
}

/// Prints the files written, the number of windows and changes, and the time taken.
pub(super) fn report(done: &Rendered, terminal: &mut Terminal) {
    for remark in done.written.iter().flat_map(|w| &w.remarks) {
        terminal.note(remark);
    }
    terminal.notices(&done.notices);
    let windows = format!("{}, ", division(&done.mission));
    wrote(done, &windows, terminal);
}

/// Prints the files written and what is in them.
pub(super) fn wrote(done: &Rendered, what: &str, terminal: &mut Terminal) {
    let mission = &done.mission;
    let changes = mission.log.headlines(mission.span).count();
    let changes = words::count(changes, "change");
    let files = done.written.iter().map(|w| &*w.path);
    terminal.wrote(files, &format!("{what}{changes}"));
}

/// The division of the mission as text: `33 windows of 10 s`, `1 window of 5 min 26 s`, `9 windows` that differ in
/// length.
fn division(mission: &Mission) -> String {
    let windows = words::count(mission.windows.len(), "window");
    if let [only] = &mission.windows[..] {
        return format!("{windows} of {}", words::duration(only.span.nanos()));
    }
    let length = mission.period.nanos();
    let mut whole = mission.windows.iter().filter(|w| !w.partial);
    if whole.all(|w| w.span.nanos() == length) {
        format!("{windows} of {}", mission.period)
    } else {
        windows
    }
}

/// The job of `render`.
fn job(args: &RenderArgs, given: &Given) -> Result<Render> {
    let look = &args.look;
    let mut reading = reading(&args.inputs, &args.graph)?;
    reading.division = args.time.division();
    reading.rate_change = args.rate.rate_change;
    reading.phases = args.phases.phases.clone();
    let outputs = outputs(&args.outputs, &reading, "gif", args.format.as_deref())?;
    reading.is_still_if_unchanged = applies::allows_still(given, &outputs);
    let still = default_output(&reading.inputs, "png");
    let is_still = reading.is_still_if_unchanged && args.outputs.is_empty();
    let drawing = Drawing {
        body: body(args.view.mode, given),
        view: view(&args.view)?,
        style: style(&look.style)?,
        fonts: fonts(look.font.as_deref())?,
        page: page(look, args.rate.rate_change),
        is_sized: look.size.is_some(),
        medium: None,
        is_fitted: look.fit,
        engine: crate::layout::engine(&look.layout)?,
        kept: kept_places(look.layout_from.as_deref())?,
    };
    Ok(Render {
        drawing: match look.purpose {
            Some(purpose) => drawing.seen(purpose),
            None => drawing,
        },
        sequence: sequence(&args.sequence)?,
        kept: kept(look),
        outputs,
        still: is_still.then(|| Output::parse(&still, None)).transpose()?,
        reading,
    })
}

/// The files that only a drawing reads. The name of a built-in style is included, which is harmless.
fn kept(look: &LookArgs) -> Vec<PathBuf> {
    let style = PathBuf::from(&look.style);
    let files = [Some(&style), look.font.as_ref(), look.layout_from.as_ref()];
    let files = files.into_iter().flatten().filter(|path| path.exists());
    files.cloned().collect()
}

/// The default output: `out/<bag name>.gif`, `.pdf` for a figure, `.png` for a still; the bag's name is without its
/// extension.
fn default_output(inputs: &[Input], extension: &str) -> String {
    let name = inputs.first().map_or_else(String::new, Input::name);
    let mut stem = name.as_str();
    for end in [".active", ".zstd", ".bag", ".db3", ".mcap", ".json"] {
        stem = stem.strip_suffix(end).unwrap_or(stem);
    }
    format!("out/{}.{extension}", stem.replace('/', "_"))
}

/// The view options: `rqt_graph`'s defaults or ours, modified by the given options.
fn view(args: &ViewArgs) -> Result<ViewOptions> {
    let mut view = if args.rqt_defaults {
        ViewOptions::rqt_defaults()
    } else {
        ViewOptions::default()
    };
    match args.mode {
        Some(ModeWord::Nodes) => view.mode = Mode::Nodes,
        Some(ModeWord::All) => (view.mode, view.keeps_topics) = (Mode::All, true),
        Some(ModeWord::Topics) | None => {}
    }
    if let Some(filter) = &args.ns_filter {
        view.ns_filter = NameFilter::parse(filter)?;
    }
    if let Some(filter) = &args.topic_filter {
        view.topic_filter = NameFilter::parse(filter)?;
    }
    if let Some(hide) = &args.hide {
        view.hide = Hide::parse(hide)?;
    }
    if let Some(group) = &args.group {
        view.group = Grouping::parse(group)?;
    }
    for name in &args.collapse {
        match name.strip_prefix('-') {
            Some(kept) => view.expand.push(kept.into()),
            None => view.collapse.push(name.as_str().into()),
        }
    }
    Ok(view)
}

/// Graph or timeline: as requested, or a graph if an option only applies to a graph.
fn body(mode: Option<ModeWord>, given: &Given) -> Body {
    match mode {
        Some(ModeWord::Topics) => Body::TopicTimeline,
        None if given.any(OF_GRAPHS).is_none() => Body::Auto,
        _ => Body::Graph,
    }
}

/// A built-in style by its name, else a file.
fn style(name: &str) -> Result<Style> {
    let path = Path::new(name);
    if BUILTIN.iter().any(|row| row.0 == name) || !path.exists() {
        return Style::builtin(name);
    }
    let text = file::read_text(path, budget::USER_TEXT)?;
    Style::from_toml(&text, path)
}

/// The bundled font, with the user's font file for characters that it lacks.
pub(super) fn fonts(file: Option<&Path>) -> Result<Fonts> {
    let Some(path) = file else {
        return Ok(Fonts::bundled());
    };
    let data = file::read(path, budget::FONT)?;
    Fonts::bundled().with(data, path)
}

fn page(args: &LookArgs, rate_change: f64) -> PageOptions {
    let default = PageOptions::default();
    let size = args.size.map(|(w, h)| Size::new(w.into(), h.into()));
    PageOptions {
        size: size.unwrap_or(default.size),
        width_mm: args.width,
        bare: args.bare,
        title: args.title.clone(),
        orientation: args.orientation,
        rate_change,
        ..default
    }
}

fn sequence(args: &SequenceArgs) -> Result<SequenceOptions> {
    let strip = args.strip.as_deref().map(sequence::Choice::parse);
    Ok(SequenceOptions {
        frame_ms: args.frame_ms,
        max_bytes: args.max_bytes,
        strip: strip.transpose()?,
        links: args.link.clone(),
        append_to: summary(),
        ..SequenceOptions::default()
    })
}

/// The summary file of a GitHub job; its name has no extension.
pub(super) fn summary() -> Option<PathBuf> {
    std::env::var_os("GITHUB_STEP_SUMMARY").map(PathBuf::from)
}

/// The positions from an earlier run's JSON.
fn kept_places(file: Option<&Path>) -> Result<Option<Places>> {
    let Some(path) = file else { return Ok(None) };
    let text = file::read_text(path, budget::MISSION_JSON)?;
    let places = read_json(&text, path)?.layout;
    places.map(Some).ok_or_else(|| {
        let hint = "write it beside a picture: `bagreel render BAG -o x.gif -o x.json`";
        Error::bad_file(path, 0, "it contains no layout", hint)
    })
}
