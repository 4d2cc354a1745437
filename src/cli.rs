//! The command line, turned into work; the only file (with its folder) that uses clap and the environment.

mod applies;
mod args;
mod extract;
mod gate;
mod look;
mod stop;
#[cfg(feature = "parquet")]
mod tables;
pub(crate) mod terminal;

use std::ffi::{OsStr, OsString};
use std::io::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use clap::{CommandFactory as _, FromArgMatches as _};

use crate::bag::Input;
use crate::base::error::Error;
use crate::base::words::visible;
use crate::base::{budget, file, words};
use crate::cli::terminal::Terminal;
use crate::evidence::code::{SourceCode, Version};
use crate::evidence::collector;
use crate::evidence::conclude;
use crate::evidence::topology;
use crate::export::Output;
use crate::graph::window::{Division, Length};
use crate::mission::info::{SurveyRow, json, survey_text};
use crate::mission::{Mission, events};
use crate::pipeline::{
    Drawing, Phases, Purpose, Reading, Render, Rendered, Survey, Watch as _, explain, is_survey,
    read, survey, survey_file,
};
use applies::Given;
use args::{
    ChangeArgs, Command, EventsArgs, EventsFormat, ExtractArgs, GraphArgs, InfoArgs, InfoFormat,
    Inputs, RenderArgs, TimeArgs, Typed,
};

const DONE: u8 = 0;
const FAILED: u8 = 1;
const USAGE: u8 = 2;
const SKIPPED: u8 = 3;

/// The number of parts of a mission for which `info` shows the activity.
const PARTS: u32 = 32;

/// Runs the command line `args`, the program's name first, and returns its exit code: 0 done, 1 failed, 2 usage, 3 done
/// but data was skipped.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    hush();
    // A mistake of ours is a failure, and has been told by now.
    catch_unwind(AssertUnwindSafe(|| command(args))).unwrap_or(FAILED)
}

/// Silences the panics of `layout-rs`, which are caught; the graph is then laid out by another engine.
fn hush() {
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let is_caught = |at: &std::panic::Location<'_>| at.file().contains("layout-rs-");
        if !panic.location().is_some_and(is_caught) {
            tell(panic);
        }
    }));
}

fn command(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let (given, typed) = match parsed(&args) {
        Ok(parsed) => parsed,
        Err(error) => return untyped(&args, error),
    };
    let no_colour = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
    let mut terminal = Terminal::new(typed.quiet, no_colour);
    let mut failed = FAILED;
    let outcome = match typed.command {
        Command::Render(args) => render(&args, &given, &mut terminal),
        Command::Info(args) => info(&args, &given, &mut terminal),
        Command::Extract(args) => extract(&args, &mut terminal),
        #[cfg(feature = "parquet")]
        Command::Tables(args) => tables::tables(&args, &mut terminal),
        Command::Events(args) => log(&args, &given, &mut terminal),
        Command::Diff(args) => {
            failed = USAGE;
            gate::diff(&args, &given, &mut terminal)
        }
        Command::Baseline(args) => gate::baseline(&args, &given, &mut terminal),
        Command::Check(args) => {
            failed = USAGE;
            gate::check(&args, &given, &mut terminal)
        }
        Command::Styles { name } => styles(name.as_deref(), &mut terminal),
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut Typed::command(), "bagreel", &mut text);
            terminal
                .results(&String::from_utf8_lossy(&text))
                .map(|()| DONE)
        }
        Command::Man => {
            let mut page = Vec::new();
            clap_mangen::Man::new(Typed::command())
                .render(&mut page)
                .map_err(Error::io("write", Path::new("the manual page")))
                .and_then(|()| terminal.results(&String::from_utf8_lossy(&page)))
                .map(|()| DONE)
        }
    };
    // Whatever was still done, a script must not go on as if nobody had stopped it.
    let outcome = match terminal.stopped_by() {
        Some(_) => Err(Error::Interrupted),
        None => outcome,
    };
    outcome.unwrap_or_else(|error| {
        terminal.error(&error);
        match (error, terminal.stopped_by()) {
            (Error::Interrupted, Some(code)) => code,
            (error, _) if error.is_usage() => USAGE,
            _ => failed,
        }
    })
}

/// The command line, parsed: the names of the options that were typed, and all options with defaults.
fn parsed<T: Into<OsString> + Clone>(
    args: impl IntoIterator<Item = T>,
) -> Result<(Given, Typed), clap::Error> {
    let matches = Typed::command().try_get_matches_from(args)?;
    Ok((Given::of(&matches), Typed::from_arg_matches(&matches)?))
}

/// Prints the help, the version, or the error of the command line, with all control characters made visible, so that no
/// argument steers the terminal.
fn untyped(args: &[OsString], error: clap::Error) -> u8 {
    let shown = args
        .iter()
        .map(|arg| visible(&arg.to_string_lossy()).into_owned());
    let error = parsed(shown).err().unwrap_or(error);
    match error.print().and_then(|()| std::io::stdout().flush()) {
        _ if error.use_stderr() => USAGE,
        // A closed pipe has read enough of the help.
        Err(lost) if lost.kind() != std::io::ErrorKind::BrokenPipe => FAILED,
        _ => DONE,
    }
}

fn reading(
    inputs: &Inputs,
    time: &TimeArgs,
    change: &ChangeArgs,
    graph: &GraphArgs,
) -> Result<Reading, Error> {
    let infers = |what: &str| graph.infer.iter().any(|word| word == what);
    Ok(Reading {
        inputs: inputs.bags.iter().map(|path| input(path)).collect(),
        verify: inputs.verify,
        division: Division {
            length: time.period.unwrap_or(Length::Auto),
            step: time.step,
            start: time.start,
            end: time.end,
            align: time.align,
            cut: time.cut,
        },
        skip_unchanged: time.skip_unchanged,
        collect: collector::CollectOptions {
            infer_stamps: infers("stamps"),
            payload_bytes: if infers("payloads") {
                u64::MAX
            } else {
                collector::PAYLOAD_BYTES
            },
            ..collector::CollectOptions::default()
        },
        grace: change.grace as usize,
        conclude: conclude::ConcludeOptions {
            roles: graph.roles,
            topology: topology::read_all(&graph.topology)?,
            code: None,
        },
        code: source_code(graph)?,
        rate_change: change.rate_change,
        phases: Phases::Found,
    })
}

/// The source code to read, if any.
fn source_code(graph: &GraphArgs) -> Result<Option<SourceCode>, Error> {
    let infers = graph.infer.iter().any(|word| word == "source");
    let Some(folder) = graph.source.clone() else {
        return if infers {
            Err(Error::usage(
                "`--infer source` has no source code to read",
                "add `--source DIR`, a workspace or repository",
            ))
        } else {
            Ok(None)
        };
    };
    let version = match graph.source_at.as_deref() {
        None => Version::Recording,
        Some("worktree") => Version::Worktree,
        Some(commit) => Version::Commit(commit.to_owned()),
    };
    Ok(Some(SourceCode {
        folder,
        version,
        infers,
    }))
}

fn input(path: &Path) -> Input {
    Input::parse(path)
}

/// The exit code of a mission that was read.
fn code(mission: &Mission) -> u8 {
    if mission.notices.any_loss() {
        SKIPPED
    } else {
        DONE
    }
}

fn extract(args: &ExtractArgs, terminal: &mut Terminal) -> Result<u8, Error> {
    let inputs = args.bags.iter().map(|path| input(path)).collect();
    let (notices, undecoded) = extract::extract(args, inputs, terminal)?;
    let is_whole = undecoded == 0 && !notices.any_loss();
    Ok(if is_whole { DONE } else { SKIPPED })
}

fn render(args: &RenderArgs, given: &Given, terminal: &mut Terminal) -> Result<u8, Error> {
    let mut job = job(args)?;
    job.reading.collect.sizes = args.sizes.bytes;
    applies::check_outputs(given, args, &job.outputs)?;
    crate::pipeline::check(&job)?;
    applies::check_inputs(given, &job.reading)?;
    if job
        .outputs
        .iter()
        .all(|output| applies::is_figure(args, output))
        && let Some(note) = applies::about_windows(given, "a figure")
    {
        terminal.note(&note);
    }
    if args.watch {
        return watch(args, job, terminal);
    }
    let done = crate::pipeline::render(&job, terminal)?;
    report(&done, args, terminal);
    Ok(code(&done.mission))
}

/// Draws again whenever the style file changes, until interrupted. The bag is read once.
fn watch(args: &RenderArgs, mut job: Render, terminal: &mut Terminal) -> Result<u8, Error> {
    let mission = read(&job.reading, terminal)?;
    let path = PathBuf::from(&args.look.style);
    if !path.is_file() {
        return Err(Error::usage(
            "`--watch` watches a style file",
            "`bagreel styles light > mine.toml`, then `--style mine.toml`",
        ));
    }
    let mut seen = None;
    while !terminal.stopped() {
        let now = file::read_text(&path, budget::USER_TEXT).ok();
        if now == seen {
            terminal.wait();
            continue;
        }
        seen = now;
        let style = look::style(&args.look.style);
        let drawn = style.and_then(|style| {
            job.drawing.style = style;
            crate::pipeline::show(&job, mission.clone(), terminal)
        });
        match drawn {
            Ok(done) => report(&done, args, terminal),
            Err(error) => terminal.error(&error),
        }
    }
    Ok(code(&mission))
}

/// Prints the files written, the number of windows and changes, and the time taken.
fn report(done: &Rendered, args: &RenderArgs, terminal: &mut Terminal) {
    let timings = args.timings;
    let mission = &done.mission;
    for remark in done.written.iter().flat_map(|w| &w.remarks) {
        terminal.note(remark);
    }
    terminal.notices(&done.notices);
    if timings {
        terminal.timings();
    }
    let names: Vec<String> = done
        .written
        .iter()
        .map(|w| w.path.display().to_string())
        .collect();
    let changes = mission.ledger.headlines(mission.span).count();
    let seconds = terminal.seconds();
    terminal.say(&format!(
        "wrote {}: {}, {}, in {seconds:.1} s",
        names.join(", "),
        division(mission),
        words::count(changes, "change")
    ));
}

/// The division of the mission in words: `33 windows of 10 s`, `1 window of 5 min 26 s`, `9 windows` that differ in
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

/// The work that `render` was asked to do.
fn job(args: &RenderArgs) -> Result<Render, Error> {
    let reading = reading(&args.inputs, &args.time, &args.change, &args.graph)?;
    let phases = look::phases(&args.figure.phases, args.look.captions.as_deref())?;
    let reading = reading.with_phases(phases);
    let mut outputs = match &args.outputs[..] {
        [] => vec![Output::parse(
            &default_output(&reading.inputs, args.figure.figure.is_some()),
            args.format.as_deref(),
        )?],
        some => some
            .iter()
            .map(|o| Output::named(o, args.format.as_deref().or(summary_format(o))))
            .collect::<Result<_, _>>()?,
    };
    outputs.extend(args.sequence.poster.as_deref().map(Output::poster));
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
        page: look::options(&args.look, args.change.rate_change),
        is_sized: args.look.size.is_some(),
        purpose: None,
        is_fitted: args.look.fit == "auto",
        splits_hubs: true,
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
            figure: look::figure(&args.figure, &args.look)?,
            ..look::sequence(&args.sequence)?
        },
        kept: kept(args),
        outputs,
        is_filtered: args.view.filtered,
        reading,
    })
}

/// The files that only a drawing reads. A style or captions may be a name that is not a file, which does no harm.
fn kept(args: &RenderArgs) -> Vec<PathBuf> {
    let look = &args.look;
    let named = [
        Some(&look.style),
        look.captions.as_ref(),
        Some(&args.figure.phases),
    ];
    let named = named.into_iter().flatten().map(PathBuf::from);
    let files = [&look.font, &look.layout_from].into_iter().flatten();
    let all = named.chain(files.cloned());
    all.filter(|path| path.exists()).collect()
}

/// The file that collects the summary of a job of GitHub's; its name has no extension.
fn summary() -> Option<PathBuf> {
    std::env::var_os("GITHUB_STEP_SUMMARY").map(PathBuf::from)
}

fn summary_format(output: &OsStr) -> Option<&'static str> {
    summary()
        .is_some_and(|path| path == Path::new(output))
        .then_some("md")
}

/// The output where none is given: `out/<bag name>.gif`, of a figure `.pdf`; the name is without the ending of the
/// format.
fn default_output(inputs: &[Input], is_figure: bool) -> String {
    let name = inputs.first().map_or_else(String::new, Input::name);
    let mut stem = name.as_str();
    for end in [".active", ".zstd", ".bag", ".db3", ".mcap", ".json"] {
        stem = stem.strip_suffix(end).unwrap_or(stem);
    }
    let extension = if is_figure { "pdf" } else { "gif" };
    format!("out/{}.{extension}", stem.replace('/', "_"))
}

fn log(args: &EventsArgs, given: &Given, terminal: &mut Terminal) -> Result<u8, Error> {
    let reading = reading(&args.inputs, &args.time, &args.change, &args.graph)?;
    applies::check_inputs(given, &reading)?;
    if let Some(note) = applies::about_windows(given, "the log") {
        terminal.note(&note);
    }
    if args.graph.source.is_some() {
        terminal.note("what only source code says has no times, and is left out of the log");
    }
    let mission = read(&reading, terminal)?;
    let options = events::LogOptions {
        parts: args.parts,
        all: args.all,
        phases: args.phases,
    };
    let format = match args.format {
        EventsFormat::Text => events::LogFormat::Text,
        EventsFormat::Csv => events::LogFormat::Csv,
        EventsFormat::Ndjson => events::LogFormat::Ndjson,
        EventsFormat::Markdown => events::LogFormat::Markdown,
    };
    terminal.results(&events::log(&mission, format, options))?;
    terminal.notices(&mission.notices);
    Ok(code(&mission))
}

#[cfg_attr(
    not(feature = "parquet"),
    expect(
        clippy::match_wildcard_for_single_variants,
        reason = "with Parquet there are two tables"
    )
)]
fn info(args: &InfoArgs, given: &Given, terminal: &mut Terminal) -> Result<u8, Error> {
    let time = TimeArgs {
        period: Some(Length::Parts(PARTS)),
        ..TimeArgs::default()
    };
    let mut reading = reading(&args.inputs, &time, &ChangeArgs::default(), &args.graph)?;
    reading.collect.sizes = args.sizes.bytes;
    applies::check_inputs(given, &reading)?;
    if let ([folder], [input]) = (&args.inputs.bags[..], &reading.inputs[..])
        && is_survey(input)
    {
        if !args.why.is_empty() {
            let what = "`--why` explains one mission, and a folder of bags holds many";
            return Err(Error::usage(what, "name one of the bags"));
        }
        let Survey { rows, skipped } = survey(folder, &reading, terminal)?;
        match args.format {
            InfoFormat::Text => terminal.results(&survey_text(&rows))?,
            InfoFormat::Json => terminal.results(&json(&rows))?,
            table => terminal.table(&survey_file(&rows, table.of_table())?)?,
        }
        return Ok(if skipped { SKIPPED } else { DONE });
    }
    if !args.why.is_empty() {
        let mut reading = reading;
        reading.collect.why.clone_from(&args.why);
        let (mission, pieces) = explain(&reading, terminal)?;
        terminal.results(&crate::mission::info::why(&mission, &args.why, &pieces)?)?;
        terminal.notices(&mission.notices);
        return Ok(code(&mission));
    }
    let mission = read(&reading, terminal)?;
    let info = || crate::mission::info::info(&mission);
    match args.format {
        InfoFormat::Text => terminal.results(&crate::mission::info::text(&info()))?,
        InfoFormat::Json => terminal.results(&json(&info()))?,
        table => {
            let bag = mission.bags.first();
            let name = bag.map_or_else(String::new, |bag| bag.name.clone());
            let row = SurveyRow::of(name, &mission);
            terminal.table(&survey_file(&[row], table.of_table())?)?;
        }
    }
    terminal.notices(&mission.notices);
    Ok(code(&mission))
}

fn styles(name: Option<&str>, terminal: &mut Terminal) -> Result<u8, Error> {
    match name {
        Some(name) => terminal.results(crate::draw::style::builtin_text(name)?)?,
        None => terminal.results(&look::styles())?,
    }
    Ok(DONE)
}
