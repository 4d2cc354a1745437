//! `bagreel render`: from arguments to a job, and the report of what was written.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::applies::{self, Given};
use super::args::figure::FigureArgs;
use super::args::render::{LookArgs, ModeWord, RenderArgs};
use super::reading::reading;
use super::terminal::Terminal;
use super::{code, look};
use crate::bag::Input;
use crate::base::error::Error;
use crate::base::notice::NoticeKind;
use crate::base::words;
use crate::export::Output;
use crate::export::target::Target;
use crate::mission::Mission;
use crate::pipeline::{Drawing, Reading, Render, Rendered};
use crate::view::NameFilter;

/// Reads once and writes every output.
pub(super) fn render(
    args: &RenderArgs,
    given: &Given,
    terminal: &mut Terminal,
) -> Result<u8, Error> {
    let job = job(args, given)?;
    applies::check_outputs(given, args, &job.outputs)?;
    if args.view.mode == Some(ModeWord::Topics) {
        applies::check_topics(given, &job.outputs)?;
    }
    crate::pipeline::check_outputs(&job)?;
    applies::check_inputs(given, &job.reading)?;
    make_room(&job, terminal);
    let done = crate::pipeline::render(&job, terminal)?;
    report(&done, terminal);
    Ok(code(&done.mission))
}

/// Hides the progress if an output is standard output.
fn make_room(job: &Render, terminal: &mut Terminal) {
    let mut targets = job.outputs.iter().map(|output| &output.target);
    if targets.any(|target| *target == Target::Stdout) {
        terminal.make_room();
    }
}

/// Reads once and draws a figure.
pub(super) fn figure(
    args: &FigureArgs,
    given: &Given,
    terminal: &mut Terminal,
) -> Result<u8, Error> {
    let job = figure_job(args)?;
    crate::pipeline::check_outputs(&job)?;
    applies::check_inputs(given, &job.reading)?;
    make_room(&job, terminal);
    let done = crate::pipeline::render(&job, terminal)?;
    // A figure shows continuous time, independent of windows.
    terminal.notices(&done.notices.without(NoticeKind::Chosen));
    wrote(&done, "", terminal);
    Ok(code(&done.mission))
}

/// The job of `figure`.
fn figure_job(args: &FigureArgs) -> Result<Render, Error> {
    let mut reading = reading(&args.inputs, &args.graph)?;
    reading.division = args.range.in_windows(None);
    reading.rate_change = args.rate.rate_change;
    reading.phases = args.phases.phases.clone();
    let outputs = outputs(&args.outputs, &reading, "pdf", None)?;
    let mut job = Render::new(reading, outputs)?;
    let filter = |text: &Option<String>| NameFilter::parse(text.as_deref().unwrap_or_default());
    job.drawing.fonts = look::fonts(args.font.as_deref())?;
    job.drawing.view.ns_filter = filter(&args.ns_filter)?;
    job.drawing.view.topic_filter = filter(&args.topic_filter)?;
    job.drawing.page.rate_change = args.rate.rate_change;
    job.drawing.page.width_mm = args.width;
    job.sequence.figure = Some(look::figure(args)?);
    job.kept = args.font.iter().cloned().collect();
    Ok(job)
}

/// The outputs as given, or that of the bag's name with this extension.
fn outputs(
    given: &[OsString],
    reading: &Reading,
    extension: &str,
    format: Option<&str>,
) -> Result<Vec<Output>, Error> {
    if given.is_empty() {
        let name = default_output(&reading.inputs, extension);
        return Ok(vec![Output::parse(&name, format)?]);
    }
    let summary = look::summary();
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
fn wrote(done: &Rendered, what: &str, terminal: &mut Terminal) {
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
fn job(args: &RenderArgs, given: &Given) -> Result<Render, Error> {
    let look = &args.look;
    let mut reading = reading(&args.inputs, &args.graph)?;
    reading.verify = args.again.verify;
    reading.division = args.time.division();
    reading.rate_change = args.rate.rate_change;
    reading.phases = args.phases.phases.clone();
    let outputs = outputs(&args.outputs, &reading, "gif", args.format.as_deref())?;
    reading.is_still_if_unchanged = applies::allows_still(given, &outputs);
    let still = default_output(&reading.inputs, "png");
    let is_still = reading.is_still_if_unchanged && args.outputs.is_empty();
    let drawing = Drawing {
        body: look::body(args.view.mode, given),
        view: look::view(&args.view)?,
        style: look::style(&look.style)?,
        fonts: look::fonts(look.font.as_deref())?,
        page: look::page(look, args.rate.rate_change),
        is_sized: look.size.is_some(),
        medium: None,
        is_fitted: look.fit,
        engine: crate::layout::engine(&look.layout)?,
        kept: look::kept(look.layout_from.as_deref())?,
    };
    Ok(Render {
        drawing: match look.purpose {
            Some(purpose) => drawing.seen(purpose),
            None => drawing,
        },
        sequence: look::sequence(&args.sequence)?,
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
