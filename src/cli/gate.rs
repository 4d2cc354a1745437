//! `diff`, `baseline` and `check`: their arguments, the jobs that they are, and exit codes of their outcome.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::applies::{self, Given};
use super::args::{GraphArgs, Inputs, RangeArgs, reading};
use super::render::summary;
use super::terminal::Terminal;
use super::values::{length, share};
use super::{DONE, FAILED, SKIPPED, USAGE, code};
use crate::base::error::Result;
use crate::base::notice::Notices;
use crate::base::words;
use crate::export::target::Target;
use crate::gate::{FORMATS, Judgement, ReportFormat, Severity, explain};
use crate::graph::window::Length;
use crate::mission::Mission;
use crate::pipeline::{self, Baseline, Check, Diff, Reading, Report};

#[derive(Debug, Args)]
pub(super) struct DiffArgs {
    /// First mission: a bag, a folder, a mission's JSON, or an expectations file (`.yaml`).
    #[arg(value_name = "A")]
    first: PathBuf,
    /// Second mission, in the same forms.
    #[arg(value_name = "B")]
    second: PathBuf,
    /// Output format.
    #[arg(long, value_name = "text|json|markdown", default_value = "text", value_parser = diff_format)]
    format: &'static ReportFormat,
    /// Also write this file: `.txt`, `.json`, `.md`, or a picture of both in any format of `render`. Repeatable.
    #[arg(long = "output", short, value_name = "FILE")]
    outputs: Vec<OsString>,
    /// Report rates that differ by more than this fraction, if statistically significant. [default: what `baseline` allows]
    #[arg(long, value_name = "SHARE", value_parser = share)]
    rate_change: Option<f64>,
    #[command(flatten)]
    range: RangeArgs,
}

#[derive(Debug, Args)]
pub(super) struct BaselineArgs {
    /// Bags of healthy runs, one run each.
    #[arg(required = true, value_name = "BAG")]
    bags: Vec<PathBuf>,
    /// Output file; `-` is standard output.
    #[arg(
        long,
        short,
        value_name = "FILE",
        default_value = "-",
        conflicts_with = "update"
    )]
    output: OsString,
    /// Update this expectations file: rewrite only what no longer matches and keep comments.
    #[arg(long, value_name = "FILE")]
    update: Option<PathBuf>,
    /// Update only these nodes and topics.
    #[arg(long, value_name = "NAME", requires = "update")]
    only: Vec<String>,
    /// Length of the windows in which rates are measured: `60`, `30s`, `500ms`. [default: the file's `period`]
    #[arg(long, short, value_parser = length)]
    period: Option<Length>,
    #[command(flatten)]
    range: RangeArgs,
    /// Add nodes and edges from a CSV, YAML, MCAP (`/rosgraph`) or launch file, or from DOT saved by rqt_graph.
    #[arg(long, value_name = "FILE")]
    topology: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    /// Bags, as for `render`; several are read as one mission.
    #[arg(required_unless_present = "explain", value_name = "BAG")]
    bags: Vec<PathBuf>,
    /// Expectations file to check against.
    #[arg(long, value_name = "FILE", required_unless_present = "explain")]
    expect: Option<PathBuf>,
    /// Output format.
    #[arg(long, value_name = "WORD", default_value = "text", value_parser = check_format)]
    format: &'static ReportFormat,
    /// Also write this file, in the format of its extension or prefix: `check.xml`, `gitlab:quality.json`. Repeatable.
    #[arg(long = "output", short, value_name = "[WORD:]FILE")]
    outputs: Vec<OsString>,
    /// How to treat rules that cannot be evaluated.
    #[arg(long, value_enum, default_value_t)]
    undecidable: Undecidable,
    /// Explain a kind of finding, such as `topic-rate-low`, and exit.
    #[arg(long, value_name = "ID", conflicts_with_all = [
        "bags", "expect", "format", "outputs", "undecidable", "start", "end", "topology", "source", "infer",
    ])]
    explain: Option<String>,
    #[command(flatten)]
    range: RangeArgs,
    #[command(flatten)]
    graph: GraphArgs,
}

/// The effect of undecidable rules on the exit code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "lower")]
pub(super) enum Undecidable {
    /// They do not fail the check.
    #[default]
    Allow,
    /// They fail the check.
    Error,
}

pub(super) const DIFF_HELP: &str = "Exit codes: 0 equal, 1 different, 2 not compared (usage error, unreadable bag), 3 equal but data was skipped \
    (damaged bag).";
pub(super) const BASELINE_HELP: &str =
    "Exit codes: 0 written, 1 failed, 2 usage error, 3 written but data was skipped (damaged bag).";
pub(super) const CHECK_HELP: &str = "Exit codes: 0 passed, 1 failed, 2 not checked (usage error, unreadable bag, no rule could be evaluated), 3 passed but \
    data was skipped (damaged bag).";

fn check_format(word: &str) -> Result<&'static ReportFormat, String> {
    ReportFormat::from_word(word).ok_or_else(|| {
        let all = FORMATS.iter().map(|format| format.word);
        format!("write one of {}", words::joined(all, ", "))
    })
}

fn diff_format(word: &str) -> Result<&'static ReportFormat, String> {
    let format = ReportFormat::from_word(word).filter(|format| format.differences.is_some());
    format.ok_or_else(|| "write one of text, json, markdown".to_owned())
}

/// The formats, for the end of `check --help`.
pub(super) fn check_help() -> String {
    let rows = FORMATS.iter().map(|f| {
        let end = f.endings.first();
        let end = end.map_or_else(String::new, |end| format!(" ({end})"));
        format!("  {:<9} {}{end}", f.word, f.what)
    });
    format!("Formats:\n{}\n\n{CHECK_HELP}", words::joined(rows, "\n"))
}

/// Prints the differences between two missions, or between one and an expectation.
pub(super) fn diff(args: &DiffArgs, given: &Given, terminal: &mut Terminal) -> Result<u8> {
    let paths = [&args.first, &args.second];
    if let Some(at) = paths.iter().position(|path| is_expectation(path)) {
        // The file has ranges of its own.
        let what = "has no effect when a mission is compared with an expectations file";
        given.refuse("rate-change", what, "give two missions, or omit it")?;
        return against(args, given, (paths[1 - at], paths[at]), terminal);
    }
    let graph = GraphArgs::default();
    let one = |path| judged(std::slice::from_ref(path), args.range, &graph);
    let mut job = Diff::new([one(&args.first)?, one(&args.second)?])?;
    job.rate_change = args.rate_change;
    for output in &args.outputs {
        job.write(output)?;
    }
    for reading in &job.readings {
        applies::check_inputs(given, reading)?;
    }
    let done = pipeline::diff(&job, terminal)?;
    let report = job.report(&done.differences, args.format);
    print(&report, args.format.word, terminal)?;
    for remark in &done.remarks {
        terminal.note(remark);
    }
    let notices = notices(&done.missions);
    terminal.notices(&notices);
    let reports = job.reports.iter().map(|report| &report.target);
    let targets = reports.chain(job.pictures.iter().map(|picture| &picture.target));
    let what = words::count(done.differences.len(), "difference");
    wrote(targets, &what, terminal);
    let is_different = done.differences.iter().any(|d| d.is_known);
    Ok(if is_different { FAILED } else { code(&notices) })
}

/// Prints a report; only text fits the terminal.
fn print(report: &str, format: &str, terminal: &mut Terminal) -> Result<()> {
    match format {
        "text" => terminal.fitted(report),
        _ => terminal.results(report),
    }
}

/// The notices of several missions.
fn notices(missions: &[Mission]) -> Notices {
    let mut all = Notices::new();
    all.extend(missions.iter().flat_map(|mission| mission.notices.iter()));
    all
}

/// Prints the files written and what is in them, if there are files.
pub(super) fn wrote<'a>(
    targets: impl Iterator<Item = &'a Target>,
    what: &str,
    terminal: &mut Terminal,
) {
    let files = targets.filter(|target| **target != Target::Stdout);
    let mut files = files.map(Target::path).peekable();
    if files.peek().is_some() {
        terminal.wrote(files, what);
    }
}

/// Whether a path names an expectation.
fn is_expectation(path: &Path) -> bool {
    let end = path.extension();
    end.is_some_and(|end| end == "yaml" || end == "yml") && path.is_file()
}

/// Prints the difference between a mission and an expectation: the findings of a check.
fn against(
    args: &DiffArgs,
    given: &Given,
    (bag, expect): (&Path, &Path),
    terminal: &mut Terminal,
) -> Result<u8> {
    let check = CheckArgs {
        bags: vec![bag.to_owned()],
        expect: Some(expect.to_owned()),
        format: args.format,
        outputs: args.outputs.clone(),
        undecidable: Undecidable::Allow,
        explain: None,
        range: args.range,
        graph: GraphArgs::default(),
    };
    self::check(&check, given, terminal)
}

/// Writes an expectation that all of these healthy runs meet.
pub(super) fn baseline(args: &BaselineArgs, given: &Given, terminal: &mut Terminal) -> Result<u8> {
    let graph = GraphArgs {
        topology: args.topology.clone(),
        ..GraphArgs::default()
    };
    let run = |bag: &PathBuf| {
        let mut reading = judged(std::slice::from_ref(bag), args.range, &graph)?;
        reading.division.length = args.period.unwrap_or(Length::Auto);
        Ok(reading)
    };
    let runs = args.bags.iter().map(run);
    let mut job = Baseline::new(runs.collect::<Result<_>>()?, Target::parse(&args.output));
    job.update.clone_from(&args.update);
    job.only.clone_from(&args.only);
    for run in &job.runs {
        applies::check_inputs(given, run)?;
    }
    if job.output == Target::Stdout {
        terminal.make_room();
    }
    let done = pipeline::baseline(&job, terminal)?;
    let notices = notices(&done.missions);
    terminal.notices(&notices);
    if done.left_out > 0 {
        let names = words::count(done.left_out, "name");
        terminal.note(&format!(
            "{names} do not fit in the expectations file: there are too many, or they are too long"
        ));
    }
    if let Some(path) = &args.update {
        let (path, changed) = (path.display(), words::count(done.changed, "fact"));
        let findings = words::count(done.left, "finding");
        let left = match done.left {
            0 => String::new(),
            _ => format!("; {findings} of rules left, which only you can resolve"),
        };
        terminal.status(&format!("{path}: {changed} updated{left}"));
    } else {
        let counts = [(done.nodes, "node"), (done.topics, "topic")];
        let what = counts.map(|(count, word)| words::count(count, word));
        wrote([&job.output].into_iter(), &what.join(", "), terminal);
    }
    Ok(code(&notices))
}

/// Checks a mission against an expectation.
pub(super) fn check(args: &CheckArgs, given: &Given, terminal: &mut Terminal) -> Result<u8> {
    if let Some(word) = &args.explain {
        let width = terminal.width().unwrap_or(80).min(80);
        terminal.results(&explain(word, width)?)?;
        return Ok(DONE);
    }
    // Given, unless a kind is explained.
    let expect = args.expect.clone().unwrap_or_default();
    let mut job = job(judged(&args.bags, args.range, &args.graph)?, expect);
    let reports = args.outputs.iter().map(|output| report(output));
    job.reports = reports.collect::<Result<_>>()?;
    job.is_strict = args.undecidable == Undecidable::Error;
    job.append_to = summary();
    applies::check_guesses(&args.graph.infer)?;
    applies::check_inputs(given, &job.reading)?;
    verdict(&job, Some(args.format), terminal)
}

/// Runs the check, prints the findings if a format is given, and returns the exit code.
pub(super) fn verdict(
    job: &Check,
    format: Option<&ReportFormat>,
    terminal: &mut Terminal,
) -> Result<u8> {
    let done = pipeline::check(job, terminal)?;
    if let Some(format) = format {
        print(&job.report(&done, format), format.word, terminal)?;
    }
    terminal.notices(&done.mission.notices);
    let verdict = &done.verdict;
    let findings = verdict.findings().len();
    if findings == 0 && verdict.facts(Judgement::Kept) == 0 {
        let file = job.expect.display();
        terminal.note(&format!("`{file}` contains no rule that applies"));
    }
    let what = words::count(findings, "finding");
    let targets = job.reports.iter().map(|report| &report.target);
    wrote(targets, &what, terminal);
    Ok(match code(&done.mission.notices) {
        _ if verdict.count(Severity::Error) > 0 => FAILED,
        _ if verdict.is_blind() => USAGE,
        SKIPPED => SKIPPED,
        _ => DONE,
    })
}

/// The check against an expectations file. Reports name it by its path from the root of its repository, with slashes: the
/// checkout of a GitHub or GitLab job, else the nearest folder with `.git`; as given outside a repository.
pub(super) fn job(reading: Reading, expect: PathBuf) -> Check {
    let whole = expect.canonicalize().unwrap_or_default();
    let checkouts = ["GITHUB_WORKSPACE", "CI_PROJECT_DIR"];
    let named = checkouts.iter().filter_map(std::env::var_os);
    let named = named.filter_map(|root| PathBuf::from(root).canonicalize().ok());
    let found = whole.ancestors().skip(1);
    let found = found.filter(|folder| folder.join(".git").exists());
    let mut roots = named.chain(found.map(Path::to_owned));
    let mut job = Check::new(reading, expect);
    if let Some(below) = roots.find_map(|root| Some(whole.strip_prefix(root).ok()?.to_owned())) {
        job.tracked = words::joined(below.iter().map(|part| part.to_string_lossy()), "/");
    }
    job
}

/// The reading for a check. Missions in JSON have their own windows.
fn judged(bags: &[PathBuf], range: RangeArgs, graph: &GraphArgs) -> Result<Reading> {
    let mut reading = reading(&Inputs::of(bags), graph)?;
    reading.division = range.in_windows(None);
    Ok(reading)
}

/// A report to write; Markdown if it is a CI job's summary file, which has no extension.
fn report(output: &OsStr) -> Result<Report> {
    let is_summary = summary().is_some_and(|path| path == Path::new(output));
    let target = Target::parse(output);
    match ReportFormat::from_word("markdown").filter(|_| is_summary) {
        Some(format) => Ok(Report { target, format }),
        None => Report::parse(output),
    }
}
