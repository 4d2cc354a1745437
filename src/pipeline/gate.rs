//! Checking: reads the expectation and the mission, compares them, writes the findings.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::{Body, Drawing, Reading, Render, Watch, read, show};
use crate::bag::Input;
use crate::base::error::{Error, Result};
use crate::base::notice::NoticeKind;
use crate::base::time::Period;
use crate::base::{budget, file, words};
use crate::export::Output;
use crate::export::check::{check as check_targets, make_folder};
use crate::export::sink::write_file;
use crate::export::target::Target;
use crate::gate::{
    DiffSubject, Difference, Expectation, ReportFormat, Side, Subject, Verdict, differences, judge,
    pairs, unchecked, union, update, write,
};
use crate::graph::window::Length;
use crate::mission::{Mission, RATE_CHANGE};

/// One report of a check or a comparison, to write to a file.
#[derive(Clone, Debug)]
pub struct Report {
    pub(crate) target: Target,
    pub(crate) format: &'static ReportFormat,
}

impl Report {
    /// A report in the format of the extension, such as `check.xml`, or of the word in front: `gitlab:quality.json`.
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown extension.
    pub fn parse(output: impl AsRef<OsStr>) -> Result<Self> {
        let output = output.as_ref();
        let text = output.to_string_lossy();
        let named = text.split_once(':');
        let named = named.and_then(|(word, path)| Some((ReportFormat::from_word(word)?, path)));
        let (format, target) = match named {
            Some((format, path)) => (Some(format), Target::parse(path)),
            None => (
                ReportFormat::of_name(&text, |_| true),
                Target::parse(output),
            ),
        };
        let unknown = || {
            Error::usage(
                format!("`{text}` has no known extension"),
                "use the extension .md, .xml, .json, .sarif or .txt, or put the format in front: `gitlab:FILE`",
            )
        };
        let format = format.ok_or_else(unknown)?;
        Ok(Self { target, format })
    }
}

/// The whole job of `bagreel check`.
#[derive(Clone)]
#[non_exhaustive]
pub struct Check {
    /// The mission to check. Its windows are those of the expectations file unless their length is fixed.
    pub reading: Reading,
    /// The expectations file.
    pub expect: PathBuf,
    /// The path of that file from the root of its repository, for services that annotate its lines.
    pub tracked: String,
    /// The names of the bags in reports.
    pub bags: Vec<String>,
    /// The files to write.
    pub reports: Vec<Report>,
    /// Whether facts that cannot be decided are errors.
    pub is_strict: bool,
    /// A file that reports are appended to instead of replacing it.
    pub append_to: Option<PathBuf>,
}

/// The outcome of `bagreel check`.
#[derive(Debug)]
#[non_exhaustive]
pub struct Checked {
    /// The mission, as it was read.
    pub mission: Mission,
    /// The findings.
    pub verdict: Verdict,
}

impl Check {
    /// A check of a mission against an expectations file that writes no reports.
    pub fn new(reading: Reading, expect: impl Into<PathBuf>) -> Self {
        let expect = expect.into();
        Self {
            tracked: plain(&expect),
            bags: reading.inputs.iter().map(Input::given).collect(),
            reading,
            expect,
            reports: Vec::new(),
            is_strict: false,
            append_to: None,
        }
    }

    /// The findings of this check as a report.
    pub fn report(&self, done: &Checked, format: &ReportFormat) -> String {
        let subject = Subject {
            mission: &done.mission,
            bags: self.bags.clone(),
            file: plain(&self.expect),
            tracked: self.tracked.clone(),
        };
        (format.verdict)(&subject, &done.verdict)
    }
}

/// A path as given, without a leading `./`.
fn plain(path: &Path) -> String {
    let given = path.display().to_string();
    given.trim_start_matches("./").to_owned()
}

/// Reads an expectations file: its text, and what it says.
///
/// # Errors
/// If it cannot be read, or has a mistake.
pub(crate) fn expectation(path: &Path) -> Result<(String, Expectation)> {
    let text = file::read_text(path, budget::USER_TEXT)?;
    let expectation = crate::gate::read(&text, path)?;
    Ok((text, expectation))
}

/// A reading with windows of this length, unless it has its own.
fn in_windows(reading: &Reading, period: Option<Period>) -> Reading {
    let mut reading = reading.clone();
    if let (Length::Auto, Some(period)) = (reading.division.length, period) {
        reading.division.length = Length::Fixed(period);
    }
    reading
}

/// Checks a mission and writes every report.
///
/// # Errors
/// If the expectations file, the mission or an output cannot be read or written.
pub fn check(job: &Check, watch: &mut dyn Watch) -> Result<Checked> {
    let (_, expectation) = expectation(&job.expect)?;
    let targets: Vec<Target> = job.reports.iter().map(|r| r.target.clone()).collect();
    let mut kept = job.reading.files();
    kept.push(job.expect.clone());
    check_targets(&targets, &kept)?;
    let reading = in_windows(&job.reading, expectation.period);
    let mission = read(&reading, watch).and_then(|mission| {
        let apart = mission.notices.iter().find(|n| n.kind == NoticeKind::Apart);
        match apart.map(|apart| apart.text) {
            Some(text) => Err(Error::usage(text, "`check` judges one run")),
            None => Ok(mission),
        }
    });
    if let Err(error) = &mission {
        // A service that finds no test report calls the job a success.
        let text = unchecked(&job.bags.join(" "), &job.tracked, error);
        for report in job.reports.iter().filter(|r| r.format.word == "junit") {
            put(&report.target, text.as_bytes())?;
        }
    }
    let mission = mission?;
    let mut verdict = judge(&expectation, &mission, is_part(&reading));
    if job.is_strict {
        verdict.decide();
    }
    let done = Checked { mission, verdict };
    for report in &job.reports {
        let text = job.report(&done, report.format);
        let before = file::text_before(report.target.path(), job.append_to.as_deref())?;
        put(&report.target, (before + &text).as_bytes())?;
    }
    Ok(done)
}

/// The whole job of `bagreel diff`.
#[derive(Clone)]
#[non_exhaustive]
pub struct Diff {
    /// The missions.
    pub readings: [Reading; 2],
    /// The fraction by which a rate must differ, besides significantly; `None` for what `baseline` allows.
    pub rate_change: Option<f64>,
    /// The names of the missions.
    pub subject: DiffSubject,
    /// Pictures to write, of both missions.
    pub pictures: Vec<Output>,
    /// The options of these pictures.
    pub drawing: Drawing,
    /// The files to write, in formats of differences.
    pub(crate) reports: Vec<Report>,
}

impl Diff {
    /// A comparison that writes no files.
    ///
    /// # Errors
    /// As [`Drawing::new`].
    pub fn new(readings: [Reading; 2]) -> Result<Self> {
        let mut drawing = Drawing::new()?;
        drawing.body = Body::Graph;
        Ok(Self {
            subject: subject(&readings),
            readings,
            rate_change: None,
            reports: Vec::new(),
            pictures: Vec::new(),
            drawing,
        })
    }

    /// Adds a file to write: `d.txt`, `d.json`, `d.md`, or a picture in any format of [`Render`].
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown extension, and for tables, which contain times, which differ between the two.
    pub fn write(&mut self, output: &OsStr) -> Result<()> {
        let name = output.to_string_lossy();
        if let Some(format) = ReportFormat::of_name(&name, |f| f.differences.is_some()) {
            let target = Target::parse(output);
            self.reports.push(Report { target, format });
            return Ok(());
        }
        let picture = Output::named(output, None)?;
        if !picture.format.is_viewed {
            return Err(Error::usage(
                format!("`{name}` cannot represent a comparison"),
                "write differences as `d.txt`, `d.json` or `d.md`, or draw them: `d.svg`, `d.html`, `d.gif`",
            ));
        }
        self.pictures.push(picture);
        Ok(())
    }

    /// The differences as a report; empty in a format of verdicts alone.
    pub fn report(&self, differences: &[Difference], format: &ReportFormat) -> String {
        let write = format.differences;
        write.map_or_else(String::new, |write| write(&self.subject, differences))
    }
}

/// The names of two missions, without folders unless the names differ only in these.
fn subject(readings: &[Reading; 2]) -> DiffSubject {
    let names = |name: fn(&Input) -> String| {
        let names = |reading: &Reading| words::some_of(reading.inputs.iter().map(name), 2);
        readings.each_ref().map(names)
    };
    let short = names(Input::name);
    let [first, second] = if short[0] == short[1] {
        names(Input::given)
    } else {
        short
    };
    DiffSubject { first, second }
}

/// The outcome of `bagreel diff`.
#[derive(Debug)]
#[non_exhaustive]
pub struct Compared {
    /// Both missions, as they were read.
    pub missions: [Mission; 2],
    /// The differences: elements, then events, then times of topics.
    pub differences: Vec<Difference>,
    /// Remarks for the user about the pictures.
    pub remarks: BTreeSet<String>,
}

/// Compares two missions, and writes every report and picture.
///
/// # Errors
/// If a mission cannot be read or an output cannot be written.
pub fn diff(job: &Diff, watch: &mut dyn Watch) -> Result<Compared> {
    let reports = job.reports.iter().map(|report| report.target.clone());
    let pictures = job.pictures.iter().map(|output| output.target.clone());
    let targets: Vec<Target> = reports.chain(pictures).collect();
    check_targets(&targets, &files(&job.readings))?;
    let [first, second] = &job.readings;
    let first = read(first, watch)?;
    // Windows of equal length have comparable rates.
    let second = read(&in_windows(second, Some(first.period)), watch)?;
    let is_part = job.readings.iter().any(is_part);
    let differences = differences(&first, &second, job.rate_change, is_part);
    for report in &job.reports {
        let text = job.report(&differences, report.format);
        put(&report.target, text.as_bytes())?;
    }
    // Animations show the first mission and then both; stills show both.
    let pictures = job.pictures.iter().cloned();
    let (moving, standing): (Vec<Output>, Vec<Output>) =
        pictures.partition(|o| MOVING.contains(&o.format.word));
    let mut remarks = BTreeSet::new();
    for (outputs, side) in [(moving, Side::Each), (standing, Side::Both)] {
        if outputs.is_empty() {
            continue;
        }
        let mission = union(&first, &second, &differences, side);
        let mut render = Render::new(Reading::default(), outputs)?;
        render.drawing = job.drawing.clone();
        let page = &mut render.drawing.page;
        page.rate_change = job.rate_change.unwrap_or(RATE_CHANGE);
        let (a, b) = (&job.subject.first, &job.subject.second);
        page.title.get_or_insert_with(|| format!("A: {a} → B: {b}"));
        let missions = [&first, &second];
        let pairs = pairs(missions, &job.subject, &differences, &mission);
        render.sequence.pairs = (!pairs.rows.is_empty()).then_some(pairs);
        let done = show(&render, mission, watch)?;
        remarks.extend(done.written.into_iter().flat_map(|w| w.remarks));
        remarks.extend(done.mission.notices.iter().map(|n| n.text));
    }
    Ok(Compared {
        missions: [first, second],
        differences,
        remarks,
    })
}

/// Formats in which one window follows another.
const MOVING: [&str; 2] = ["gif", "html"];

/// The whole job of `bagreel baseline`.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Baseline {
    /// The healthy runs, each read separately.
    pub runs: Vec<Reading>,
    /// The expectations file to update instead of writing a new one.
    pub update: Option<PathBuf>,
    /// The nodes and topics to update; all if empty.
    pub only: Vec<String>,
    /// The file to write unless one is updated.
    pub output: Target,
}

impl Baseline {
    /// A new expectations file that all runs meet.
    pub fn new(runs: Vec<Reading>, output: Target) -> Self {
        Self {
            runs,
            update: None,
            only: Vec::new(),
            output,
        }
    }
}

/// The outcome of `bagreel baseline`.
#[derive(Debug, Default)]
#[non_exhaustive]
pub struct BaselineWritten {
    /// The runs, as they were read.
    pub missions: Vec<Mission>,
    /// The number of rewritten facts in an updated file.
    pub changed: usize,
    /// The number of remaining findings in an updated file: those of rules.
    pub left: usize,
    /// The number of nodes in a new file.
    pub nodes: usize,
    /// The number of topics in a new file.
    pub topics: usize,
    /// The number of nodes and topics that did not fit in a new file.
    pub left_out: usize,
}

/// Writes an expectation that all runs meet, or updates one.
///
/// # Errors
/// If the expectations file or a run cannot be read, or the output cannot be written.
pub fn baseline(job: &Baseline, watch: &mut dyn Watch) -> Result<BaselineWritten> {
    let old = job.update.as_deref();
    let old = old.map(|path| Ok((path, expectation(path)?))).transpose()?;
    let kept = files(&job.runs);
    let target = match &old {
        Some((path, _)) => Target::Path((*path).to_owned()),
        None => job.output.clone(),
    };
    check_targets(std::slice::from_ref(&target), &kept)?;
    let mut period = old.as_ref().and_then(|(_, (_, old))| old.period);
    let mut missions: Vec<Mission> = Vec::new();
    for run in &job.runs {
        let mission = read(&in_windows(run, period), watch)?;
        // All runs use the period of the first.
        period = period.or(Some(mission.period));
        missions.push(mission);
    }
    let is_part = job.runs.iter().any(is_part);
    let new = if let Some((path, (text, _))) = old {
        update(&text, path, &missions, is_part, &job.only)?
    } else {
        let names = missions.iter().filter_map(|run| run.bags.first());
        let names = words::some_of(names.map(|bag| &bag.name), 3);
        write(&missions, is_part, &names)
    };
    put(&target, new.text.as_bytes())?;
    Ok(BaselineWritten {
        missions,
        changed: new.changed,
        left: new.left,
        nodes: new.nodes,
        topics: new.topics,
        left_out: new.left_out,
    })
}

/// Whether only a part of a recording is read, in which start times differ from those in the whole.
fn is_part(reading: &Reading) -> bool {
    reading.division.start.is_some() || reading.division.end.is_some()
}

fn files(readings: &[Reading]) -> Vec<PathBuf> {
    readings.iter().flat_map(Reading::files).collect()
}

/// Writes a file atomically.
pub(crate) fn put(target: &Target, bytes: &[u8]) -> Result<()> {
    make_folder(target)?;
    match write_file(target, bytes) {
        // A closed pipe is not an error.
        Err(Error::Io { source, .. }) if source.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.map(drop),
    }
}
