//! `bagreel render`: from arguments to a job, and the report of what was written.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::applies::{self, Given};
use super::args::TimeArgs;
use super::args::figure::FigureArgs;
use super::args::render::RenderArgs;
use super::reading::reading;
use super::terminal::Terminal;
use super::{code, look};
use crate::bag::Input;
use crate::base::error::Error;
use crate::base::notice::NoticeKind;
use crate::base::words;
use crate::export::Output;
use crate::export::options::FigureOptions;
use crate::export::target::Target;
use crate::mission::Mission;
use crate::pipeline::{Drawing, Purpose, Render, Rendered};
use crate::view::NameFilter;

/// Reads once and writes every output.
pub(super) fn render(
    args: &RenderArgs,
    given: &Given,
    terminal: &mut Terminal,
) -> Result<u8, Error> {
    let job = job(args, given)?;
    applies::check_outputs(given, args, &job.outputs)?;
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
    applies::check_figure(&job.outputs)?;
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
    let time = TimeArgs::default();
    let reading = reading(&args.inputs, &time, args.range, &args.rate, &args.graph)?;
    let reading = reading.with_phases(look::phases(&args.phases.phases));
    let outputs = match &args.outputs[..] {
        [] => vec![Output::parse(
            &default_output(&reading.inputs, "pdf"),
            None,
        )?],
        some => {
            let named = some.iter().map(|output| Output::named(output, None));
            named.collect::<Result<_, _>>()?
        }
    };
    let mut drawing = Drawing::new()?;
    drawing.fonts = look::fonts(args.font.as_deref())?;
    let filter = |text: &Option<String>| NameFilter::parse(text.as_deref().unwrap_or_default());
    drawing.view.ns_filter = filter(&args.ns_filter)?;
    drawing.view.topic_filter = filter(&args.topic_filter)?;
    drawing.page.rate_change = args.rate.rate_change;
    drawing.page.width_mm = args.width;
    let kept = [args.font.clone(), Some(PathBuf::from(&args.phases.phases))];
    let figure = look::figure(&args.kind, &args.form, args.width)?;
    let mut job = Render::new(reading, outputs)?;
    job.drawing = drawing;
    job.sequence.figure = Some(FigureOptions {
        is_bare: args.bare,
        ..figure
    });
    job.kept = kept
        .into_iter()
        .flatten()
        .filter(|path| path.exists())
        .collect();
    Ok(job)
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
    let reading = reading(
        &args.inputs,
        &args.time,
        args.range,
        &args.rate,
        &args.graph,
    )?;
    let mut reading = reading.with_phases(look::phases(&args.phases.phases));
    let outputs = match &args.outputs[..] {
        [] => {
            let name = default_output(&reading.inputs, "gif");
            vec![Output::parse(&name, args.format.as_deref())?]
        }
        some => some
            .iter()
            .map(|o| Output::named(o, args.format.as_deref().or(summary_format(o))))
            .collect::<Result<_, _>>()?,
    };
    let is_still = applies::allows_still(given, &outputs);
    reading.is_still_if_unchanged = is_still;
    let still = default_output(&reading.inputs, "png");
    let still = (is_still && args.outputs.is_empty()).then(|| Output::parse(&still, None));
    let purpose = args
        .look
        .purpose
        .as_deref()
        .map(Purpose::parse)
        .transpose()?;
    let drawing = Drawing {
        body: look::body(args)?,
        view: look::view(&args.view)?,
        style: look::style(&args.look.style)?,
        fonts: look::fonts(args.look.font.as_deref())?,
        page: look::options(&args.look, args.rate.rate_change),
        is_sized: args.look.size.is_some(),
        purpose: None,
        is_fitted: args.look.fit == "auto",
        engine: crate::layout::engine(&args.look.layout)?,
        kept: look::kept(args.look.layout_from.as_deref())?,
    };
    Ok(Render {
        drawing: match purpose {
            Some(purpose) => drawing.seen(purpose),
            None => drawing,
        },
        sequence: crate::export::sequence::SequenceOptions {
            append_to: summary(),
            ..look::sequence(&args.sequence)?
        },
        kept: kept(args),
        outputs,
        still: still.transpose()?,
        reading,
    })
}

/// The files that only a drawing reads. Names of built-in styles are included, which is harmless.
fn kept(args: &RenderArgs) -> Vec<PathBuf> {
    let look = &args.look;
    let named = [Some(&look.style), Some(&args.phases.phases)];
    let named = named.into_iter().flatten().map(PathBuf::from);
    let files = [&look.font, &look.layout_from].into_iter().flatten();
    let all = named.chain(files.cloned());
    all.filter(|path| path.exists()).collect()
}

/// The summary file of a GitHub job; its name has no extension.
pub(super) fn summary() -> Option<PathBuf> {
    std::env::var_os("GITHUB_STEP_SUMMARY").map(PathBuf::from)
}

fn summary_format(output: &OsStr) -> Option<&'static str> {
    summary()
        .is_some_and(|path| path == Path::new(output))
        .then_some("md")
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
