//! From bags to the evolution: read once, divide time, build the graphs, find what changed.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Stage, Watch};
use crate::bag::{self, Input, Kind, OpenOptions, Reader, Report};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::Span;
use crate::base::{budget, file};
use crate::evidence::EvidenceLine;
use crate::evidence::code::{self, SourceCode};
use crate::evidence::collector::{self, Collected, Collector};
use crate::graph;
use crate::graph::diff::RATE_CHANGE;
use crate::graph::sending::sending;
use crate::graph::window::{self, Division, Length, Windows};
use crate::mission::activity::{self, Activity, Cell};
use crate::mission::phases::phases;
use crate::mission::{Mission, Window, read_json};

/// What to read and how.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Reading {
    /// Bags of one mission, or one evolution.
    pub inputs: Vec<Input>,
    /// Whether to read everything by a second reader too, and compare.
    pub verify: bool,
    /// How time is divided.
    pub division: Division,
    /// Whether to merge runs of windows without a change.
    pub skip_unchanged: bool,
    /// What to look at while reading.
    pub collect: collector::Options,
    /// How graphs are built.
    pub graph: graph::Options,
    /// The source code to read once the recording's day is known; takes the place of `graph.code`.
    pub code: Option<SourceCode>,
    /// The share by which a rate must change to count, 0...
    pub rate_change: f64,
}

impl Default for Reading {
    /// Nothing yet, with every option as the command line has it.
    fn default() -> Self {
        Self {
            inputs: Vec::new(),
            verify: false,
            division: Division::default(),
            skip_unchanged: false,
            collect: collector::Options::default(),
            graph: graph::Options::default(),
            code: None,
            rate_change: RATE_CHANGE,
        }
    }
}

impl Reading {
    /// Bags of one mission by their paths, or one mission's own JSON, with every option as the command line has it.
    pub fn of<P: Into<PathBuf>>(paths: impl IntoIterator<Item = P>) -> Self {
        let inputs = paths.into_iter().map(|path| Input::Path(path.into()));
        Self {
            inputs: inputs.collect(),
            ..Self::default()
        }
    }
}

/// Reads the inputs into an evolution.
///
/// # Errors
/// Where an input cannot be read at all or none holds a message, and for times that make no sense.
pub fn read(reading: &Reading, watch: &mut dyn Watch) -> Result<Mission> {
    if reading.verify
        && let Some(pipe) = reading.inputs.iter().find(|input| input.is_pipe())
    {
        let what = format!(
            "`--verify` reads a bag twice, and {} only gives it once",
            pipe.name()
        );
        return Err(Error::usage(what, "save the bag in a file first"));
    }
    let (mut mission, _) = explain(reading, watch)?;
    if reading.verify && mission_file(&reading.inputs)?.is_none() {
        watch.stage(Stage::Verify);
        let second = Recorded::read(reading, true, watch);
        match second.and_then(|mut second| build(&mut second, reading, watch)) {
            Ok(second) => compare(&mut mission, &second),
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(why) => {
                let text = format!("the bag could not be verified: {why}");
                mission.notices.add(Notice::new(NoticeKind::Damaged, text));
            }
        }
    }
    Ok(mission)
}

/// Reads the inputs into an evolution, with every piece of evidence on the elements that `reading` asks about, sorted
/// by time. An evolution that is read holds no such pieces.
///
/// # Errors
/// As [`read`].
pub fn explain(reading: &Reading, watch: &mut dyn Watch) -> Result<(Mission, Vec<EvidenceLine>)> {
    watch.stage(Stage::Read);
    if let Some(path) = mission_file(&reading.inputs)? {
        return Ok((reread(path, reading)?, Vec::new()));
    }
    let mut recorded = Recorded::read(reading, false, watch)?;
    let mission = build(&mut recorded, reading, watch)?;
    Ok((mission, recorded.collected.why()))
}

/// The path of the evolution that is the only input; `None` for bags.
///
/// # Errors
/// Where it cannot be read.
pub(crate) fn mission_file(inputs: &[Input]) -> Result<Option<&Path>> {
    let is_json = |input: &Input| -> Result<bool> { Ok(matches!(bag::sniff(input)?, Kind::Json)) };
    match inputs {
        [Input::Path(path)] if is_json(&inputs[0])? => Ok(Some(path)),
        _ => Ok(None),
    }
}

const DAY: i64 = 86_400_000_000_000;

fn reread(path: &Path, reading: &Reading) -> Result<Mission> {
    let text = file::read_text(path, budget::MISSION_JSON)?;
    let mut mission = read_json(&text, path)?;
    drop(text);
    if mission.span.nanos() / DAY >= budget::SPAN_DAYS {
        return Err(Error::BadFile {
            path: path.to_owned(),
            line: 0,
            reason: format!("its windows cover more than {} days", budget::SPAN_DAYS),
            hint: "times are nanoseconds since 1970".to_owned(),
        });
    }
    if !mission.knows_lives() {
        mission.find_changes(reading.rate_change, &[]);
    } else if (reading.rate_change - RATE_CHANGE).abs() > f64::EPSILON {
        let what = format!(
            "`--rate-change` compares windows, and `{}` holds its changes already",
            path.display()
        );
        return Err(Error::usage(what, "give the bag itself"));
    }
    mission.activity = Activity::of_windows(&mission);
    if mission.ledger.phases.is_empty() {
        mission.ledger.phases = phases(&mission.elements, &mission.activity);
    }
    Ok(mission)
}

/// Everything that was read of a mission.
struct Recorded {
    bags: Vec<Report>,
    collected: Collected,
    /// The time that the windows divide.
    range: Span,
}

impl Recorded {
    /// Reads every bag once.
    fn read(reading: &Reading, verify: bool, watch: &mut dyn Watch) -> Result<Self> {
        let options = OpenOptions { verify };
        let (inputs, twice) = each_once(&reading.inputs)?;
        let mut readers = bag::open_each(inputs, &options).collect::<Result<Vec<_>>>()?;
        let cut = reading.division.start.is_some() || reading.division.end.is_some();
        let known = if cut { known_span(&mut readers)? } else { None };
        let range = known
            .map(|span| window::range(&reading.division, span))
            .transpose()?;
        let mut collector = Collector::new(affordable(reading));
        let mut bags = Vec::new();
        for mut reader in readers {
            let mut progress = |done, total| watch.progress(done, total);
            bags.push(reader.read(range, &mut collector.bag(&mut progress))?);
        }
        let mut collected = collector.finish()?;
        collected.notices.extend(twice);
        let Some(span) = collected.span else {
            return Err(no_messages(&reading.inputs, &collected.notices));
        };
        let range = match range {
            Some(range) => range,
            None => window::range(&reading.division, span)?,
        };
        Ok(Self {
            bags,
            collected,
            range,
        })
    }
}

/// What to look at, without the payloads of bags that are larger than what is compared of them: an index would be of no
/// use if every payload were read.
fn affordable(reading: &Reading) -> collector::Options {
    let mut options = reading.collect.clone();
    let sizes = reading.inputs.iter().filter_map(bag::size_on_disk);
    if sizes.fold(0, u64::saturating_add) > options.payload_bytes {
        options.payload_bytes = 0;
    }
    options
}

/// Every input once; a bag that was named twice would count twice.
fn each_once(inputs: &[Input]) -> Result<(Vec<Input>, Vec<Notice>)> {
    let mut seen = BTreeSet::new();
    let (mut once, mut twice) = (Vec::new(), Vec::new());
    for input in inputs {
        let real = match input {
            Input::Path(path) => path.canonicalize().unwrap_or_else(|_| path.clone()),
            Input::Stdin => PathBuf::from("-"),
        };
        if seen.insert(real) {
            once.push(input.clone());
        } else if input.is_pipe() {
            let what = format!("{} was named twice, and can be read once", input.name());
            return Err(Error::usage(what, "name it once"));
        } else {
            let text = format!("`{}` was named twice and read once", input.name());
            twice.push(Notice::new(NoticeKind::Note, text));
        }
    }
    Ok((once, twice))
}

/// What is said of a bag that is whole and empty.
pub(super) const NOTHING_RECORDED: &str = "it was closed before anything was recorded";

/// The error for bags without a message, with what was lost on the way.
fn no_messages(inputs: &[Input], notices: &Notices) -> Error {
    let lost: Vec<String> = notices
        .iter()
        .filter(|n| n.kind.is_loss())
        .take(3)
        .map(|n| format!("{} (×{})", n.text, n.count))
        .collect();
    Error::NoMessages {
        path: inputs
            .first()
            .map_or_else(PathBuf::new, |i| PathBuf::from(i.name())),
        hint: if lost.is_empty() {
            NOTHING_RECORDED.to_owned()
        } else {
            lost.join("; ")
        },
    }
}

/// The time that all bags cover, if every one of them tells without being read.
pub(super) fn known_span(readers: &mut [Box<dyn Reader>]) -> Result<Option<Span>> {
    let mut all: Option<Span> = None;
    for reader in readers {
        let Some(span) = reader.span()? else {
            return Ok(None);
        };
        all = Some(all.map_or(span, |a| Span {
            start: a.start.min(span.start),
            end: a.end.max(span.end),
        }));
    }
    Ok(all)
}

fn build(recorded: &mut Recorded, reading: &Reading, watch: &mut dyn Watch) -> Result<Mission> {
    watch.stage(Stage::Graphs);
    let mut options = reading.graph.clone();
    if let Some(wanted) = &reading.code {
        let end = recorded
            .collected
            .span
            .map_or(recorded.range.end, |span| span.end);
        options.code = Some(Arc::new(code::read(wanted, end)?));
    }
    let windows = window::divide(&reading.division, recorded.range)?;
    let mut mission = graphs(recorded, &windows, reading, &options)?;
    if reading.skip_unchanged {
        let merged = merged(&mission, &windows);
        mission = graphs(recorded, &merged, reading, &options)?;
    }
    mission.activity = activity(recorded, &mission, &options)?;
    mission.ledger.phases = phases(&mission.elements, &mission.activity);
    if reading.division.length == Length::Auto {
        let text = format!("the period is {}; `--period` takes another", windows.period);
        mission.notices.add(Notice::new(NoticeKind::Chosen, text));
    }
    Ok(mission)
}

/// The graphs of the same mission on the grid that no `--period` moves.
fn activity(
    recorded: &mut Recorded,
    mission: &Mission,
    options: &graph::Options,
) -> Result<Activity> {
    let options = graph::Options {
        // Counted in windows, which these are not.
        grace: 0,
        ..options.clone()
    };
    let spans = activity::grid(mission.span);
    let built = graph::build(&mut recorded.collected, &spans, &options)?;
    let cells = spans.into_iter().zip(built.graphs);
    Ok(Activity {
        cells: cells.map(|(span, graph)| Cell { span, graph }).collect(),
        sending: sending(&mut recorded.collected, &mission.elements)?,
    })
}

/// Builds the graph of every window and finds what changed.
fn graphs(
    recorded: &mut Recorded,
    windows: &Windows,
    reading: &Reading,
    options: &graph::Options,
) -> Result<Mission> {
    let built = graph::build(&mut recorded.collected, &windows.spans, options)?;
    let messages = built.messages.iter().sum();
    let mut notices: Notices = recorded.collected.notices.clone();
    notices.extend(built.notices.iter());
    let parts = windows
        .spans
        .iter()
        .zip(built.graphs)
        .zip(built.messages)
        .enumerate();
    let list: Vec<Window> = parts
        .map(|(index, ((span, graph), inside))| Window {
            index,
            span: *span,
            partial: windows.partial(index),
            messages: inside,
            graph,
            changes: Vec::new(),
            entries: Vec::new(),
        })
        .collect();
    let mut mission = Mission {
        bags: recorded.bags.clone(),
        span: windows.span,
        messages,
        period: windows.period,
        step: windows.step,
        elements: built.elements,
        windows: list,
        ledger: crate::mission::Ledger::default(),
        activity: Activity::default(),
        undrawn: built.undrawn,
        layout: None,
        notices,
    };
    mission.tell(&built.lives, reading.rate_change);
    Ok(mission)
}

/// The windows with every run of them that shows no change made one.
fn merged(mission: &Mission, windows: &Windows) -> Windows {
    let mut spans: Vec<Span> = Vec::new();
    for window in &mission.windows {
        match spans.last_mut() {
            Some(last) if window.changes.is_empty() => last.end = window.span.end,
            _ => spans.push(window.span),
        }
    }
    Windows {
        spans,
        ..windows.clone()
    }
}

/// Notices where the second reader counts otherwise than the first, and what it could not verify.
fn compare(first: &mut Mission, second: &Mission) {
    let verified = unverified(first, second);
    let (ours, theirs) = (counts(first), counts(second));
    let differing = ours.symmetric_difference(&theirs).count();
    let same = first.messages == second.messages && differing == 0;
    let messages = first.messages;
    let (text, kind) = match (same, verified) {
        (true, true) => (
            format!("a second reader counts the same {messages} messages"),
            NoticeKind::Note,
        ),
        (true, false) => (
            format!("a second reading counts the same {messages} messages"),
            NoticeKind::Note,
        ),
        (false, _) => (
            format!(
                "a second reader counts {} messages instead of {messages}; {differing} counts of topics in windows differ",
                second.messages
            ),
            NoticeKind::Damaged,
        ),
    };
    first.notices.add(Notice::new(kind, text));
    first
        .notices
        .extend(second.notices.iter().filter(|n| n.kind.is_loss()));
    for bag in &mut first.bags {
        bag.tier = bag::Tier::Verify;
    }
}

/// Says of which bags not everything could be verified; answers whether there are none.
fn unverified(first: &mut Mission, second: &Mission) -> bool {
    let mut all = true;
    for (bag, again) in first.bags.iter_mut().zip(&second.bags) {
        if let Some(why) = &again.tier_reason {
            all = false;
            // A reader that refuses from the start says nothing of the bag; one that stops has met damage.
            let kind = if again.complete {
                NoticeKind::Note
            } else {
                NoticeKind::Damaged
            };
            let text = format!("`{}` could not be verified: {why}", bag.name);
            first.notices.add(Notice::new(kind, text));
        }
        bag.complete &= again.complete;
    }
    all
}

/// Every count of a topic in a window.
fn counts(mission: &Mission) -> BTreeSet<(usize, &str, u64)> {
    let topics = &mission.elements.topics;
    let counted = |window: &'_ Window| {
        let index = window.index;
        let states = window.graph.topics.iter().filter(|t| t.count > 0);
        states
            .map(move |t| (index, topics[t.id as usize].name.as_str(), t.count))
            .collect::<Vec<_>>()
    };
    mission.windows.iter().flat_map(counted).collect()
}
