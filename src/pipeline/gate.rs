//! Checking: reads the expectation and the mission, compares them, writes the findings.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::PathBuf;

use super::{Drawing, Reading, Render, Watch, read, show};
use crate::base::error::Result;
use crate::base::{budget, file, words};
use crate::export::Output;
use crate::export::check as places;
use crate::export::sink::OutputSink;
use crate::export::target::Target;
use crate::gate::{
    DiffFormat, DiffSubject, Difference, Format, Side, Subject, Verdict, Written, differences,
    judge, pairs, union, update, write,
};
use crate::graph::window::Length;
use crate::mission::Mission;

/// One report to write.
pub(crate) struct ReportJob {
    pub(crate) target: Target,
    pub(crate) format: &'static Format,
}

/// The whole job of `bagreel check`.
pub(crate) struct Check {
    pub(crate) reading: Reading,
    pub(crate) expect: PathBuf,
    /// The path of the expectation from the root of its repository.
    pub(crate) tracked: String,
    pub(crate) reports: Vec<ReportJob>,
    /// The bags as given.
    pub(crate) bags: Vec<String>,
    pub(crate) links: Vec<(String, String)>,
    /// Whether undecidable facts are errors.
    pub(crate) is_strict: bool,
    /// A file that Markdown is appended to.
    pub(crate) append_to: Option<PathBuf>,
}

impl Check {
    /// The subject of the reports.
    pub(crate) fn subject<'a>(&self, mission: &'a Mission) -> Subject<'a> {
        let file = self.expect.display().to_string();
        let plain = file.trim_start_matches("./");
        Subject {
            mission,
            bags: self.bags.clone(),
            file: plain.to_owned(),
            tracked: self.tracked.clone(),
            links: self.links.clone(),
        }
    }
}

/// The outcome of `bagreel check`.
pub(crate) struct CheckResult {
    pub(crate) mission: Mission,
    pub(crate) verdict: Verdict,
}

/// Checks a mission and writes every report.
///
/// # Errors
/// If the expectation, the mission or an output cannot be read or written.
pub(crate) fn check(job: &Check, watch: &mut dyn Watch) -> Result<CheckResult> {
    let text = file::read_text(&job.expect, budget::USER_TEXT)?;
    let expectation = crate::gate::read(&text, &job.expect)?;
    let targets: Vec<Target> = job.reports.iter().map(|r| r.target.clone()).collect();
    let mut kept = job.reading.files();
    kept.push(job.expect.clone());
    places::check(&targets, &kept)?;
    let mut reading = job.reading.clone();
    if let (Length::Auto, Some(period)) = (reading.division.length, expectation.period) {
        reading.division.length = Length::Fixed(period);
    }
    let mission = read(&reading, watch)?;
    let mut verdict = judge(&expectation, &mission, is_part(&reading));
    if job.is_strict {
        verdict.decide();
    }
    let subject = job.subject(&mission);
    for report in &job.reports {
        let text = (report.format.write)(&subject, &verdict);
        let before = file::text_before(report.target.path(), job.append_to.as_deref())?;
        put(&report.target, &(before + &text))?;
    }
    Ok(CheckResult { mission, verdict })
}

/// The whole job of `bagreel diff`.
pub(crate) struct DiffJob {
    pub(crate) readings: [Reading; 2],
    /// The share by which a rate must differ.
    pub(crate) rate_change: f64,
    pub(crate) subject: DiffSubject,
    pub(crate) reports: Vec<(Target, &'static DiffFormat)>,
    /// Pictures of both missions.
    pub(crate) pictures: Vec<Output>,
    pub(crate) drawing: Drawing,
}

/// The outcome of `bagreel diff`.
pub(crate) struct Compared {
    pub(crate) missions: Vec<Mission>,
    pub(crate) differences: Vec<Difference>,
    /// Remarks for the user about the pictures.
    pub(crate) remarks: BTreeSet<String>,
}

/// Compares two missions, and writes every report and picture.
///
/// # Errors
/// If a mission cannot be read or an output cannot be written.
pub(crate) fn diff(job: &DiffJob, watch: &mut dyn Watch) -> Result<Compared> {
    let reports = job.reports.iter().map(|(target, _)| target.clone());
    let pictures = job.pictures.iter().map(|output| output.target.clone());
    let targets: Vec<Target> = reports.chain(pictures).collect();
    places::check(&targets, &files(&job.readings))?;
    let [first, second] = &job.readings;
    let first = read(first, watch)?;
    let second = read(second, watch)?;
    let differences = differences(&first, &second, job.rate_change);
    for (target, format) in &job.reports {
        put(target, &(format.write)(&job.subject, &differences))?;
    }
    // Animations show the first mission and then both; stills show both.
    let (moving, standing): (Vec<Output>, Vec<Output>) = job
        .pictures
        .iter()
        .cloned()
        .partition(|o| MOVING.contains(&o.format.word));
    let mut remarks = BTreeSet::new();
    for (outputs, side) in [(moving, Side::Each), (standing, Side::Both)] {
        if outputs.is_empty() {
            continue;
        }
        let mission = union(&first, &second, &differences, side);
        let mut render = Render::new(Reading::default(), outputs)?;
        render.drawing = job.drawing.clone();
        let missions = [&first, &second];
        let pairs = pairs(missions, &job.subject, &differences, &mission);
        render.sequence.pairs = (!pairs.rows.is_empty()).then_some(pairs);
        let done = show(&render, mission, watch)?;
        let of_files = done.written.iter().flat_map(|w| w.remarks.clone());
        remarks.extend(of_files);
        remarks.extend(done.mission.notices.iter().map(|n| n.text));
    }
    Ok(Compared {
        missions: vec![first, second],
        differences,
        remarks,
    })
}

/// Formats in which one window follows another.
const MOVING: [&str; 5] = ["gif", "apng", "html", "mp4", "webm"];

/// The whole job of `bagreel baseline`.
pub(crate) struct Baseline {
    /// The runs, each read separately.
    pub(crate) runs: Vec<Reading>,
    /// The expectation to update; `None` to write a new one.
    pub(crate) update: Option<PathBuf>,
    /// The names to update; all if empty.
    pub(crate) only: Vec<String>,
    pub(crate) output: Target,
}

/// The outcome of `bagreel baseline`.
#[derive(Default)]
pub(crate) struct BaselineWritten {
    pub(crate) missions: Vec<Mission>,
    /// The number of rewritten facts.
    pub(crate) changed: usize,
    /// The number of remaining findings.
    pub(crate) left: usize,
    /// The numbers of nodes and topics written in a new expectation, and of both that did not fit.
    pub(crate) nodes: usize,
    pub(crate) topics: usize,
    pub(crate) left_out: usize,
}

/// Writes an expectation that all runs meet, or updates one.
///
/// # Errors
/// If the expectation or a run cannot be read, or the output cannot be written.
pub(crate) fn baseline(job: &Baseline, watch: &mut dyn Watch) -> Result<BaselineWritten> {
    let old = job.update.as_deref().map(|path| {
        let text = file::read_text(path, budget::USER_TEXT)?;
        let expectation = crate::gate::read(&text, path)?;
        Ok((path, text, expectation.period))
    });
    let old = old.transpose()?;
    let kept = files(&job.runs);
    let target = match &old {
        Some((path, ..)) => Target::Path((*path).to_owned()),
        None => job.output.clone(),
    };
    places::check(std::slice::from_ref(&target), &kept)?;
    let mut period = old.as_ref().and_then(|(.., period)| *period);
    let mut missions: Vec<Mission> = Vec::new();
    for run in &job.runs {
        let mut reading = run.clone();
        if let (Length::Auto, Some(period)) = (reading.division.length, period) {
            reading.division.length = Length::Fixed(period);
        }
        let mission = read(&reading, watch)?;
        // All runs use the period of the first.
        period = period.or(Some(mission.period));
        missions.push(mission);
    }
    let mut done = BaselineWritten {
        missions,
        ..BaselineWritten::default()
    };
    let text = if let Some((path, text, _)) = old {
        let is_part = job.runs.iter().any(is_part);
        let new = update(&text, path, (&done.missions, is_part), &job.only)?;
        (done.changed, done.left) = (new.changed, new.left);
        new.text
    } else {
        let new = written(&done.missions, job.runs.iter().any(is_part));
        (done.nodes, done.topics, done.left_out) = (new.nodes, new.topics, new.left_out);
        new.text
    };
    put(&target, &text)?;
    Ok(done)
}

/// Whether only a part of a recording is read, in which start times differ from those in the whole.
fn is_part(reading: &Reading) -> bool {
    reading.division.start.is_some() || reading.division.end.is_some()
}

/// The expectation that all of these runs meet.
fn written(missions: &[Mission], is_part: bool) -> Written {
    let names: Vec<String> = missions.iter().map(name).collect();
    let from = words::some_of(&names, 3);
    write(missions, is_part, &from)
}

fn name(mission: &Mission) -> String {
    mission
        .bags
        .first()
        .map_or_else(String::new, |bag| bag.name.clone())
}

fn files(readings: &[Reading]) -> Vec<PathBuf> {
    readings.iter().flat_map(Reading::files).collect()
}

/// Writes a text atomically.
fn put(target: &Target, text: &str) -> Result<()> {
    places::make_folder(target)?;
    let mut sink = OutputSink::create(target, None)?;
    let failed = sink.error();
    match sink.write_all(text.as_bytes()) {
        Ok(()) => sink.commit().map(drop),
        // A closed pipe is not an error.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(failed(error)),
    }
}
