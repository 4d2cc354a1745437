//! From bags to the mission: collects, concludes, detects the phases, divides time, builds the graphs; each value is
//! made once.

use std::path::{Path, PathBuf};
#[cfg(feature = "source")]
use std::sync::Arc;

use super::collect::{Collected, collect};
use super::phases::{Basis, wanted};
use super::probe::probe;
use super::verify::{Verified, verify};
use super::{Phases, Stage, Watch};
use crate::bag::straight::ClockFall;
use crate::bag::{self, Input, InputKind, Report};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::rhythm::CLOSE_NS;
use crate::base::time::{DAY, Span, Stamp};
use crate::base::{budget, cast, file, words};
use crate::evidence::EvidenceLine;
#[cfg(feature = "source")]
use crate::evidence::code::{self, SourceCode};
use crate::evidence::collector::{self, Recorded};
use crate::evidence::conclude::{self, Findings, conclude};
use crate::graph::history::simulation::ClockChange;
use crate::graph::history::windows;
use crate::graph::window::{self, Cut, Division, Length, Windows};
use crate::graph::{History, NodeId, Windowed, graphs, made, traffic, unread};
use crate::mission::RATE_CHANGE;
use crate::mission::changes;
use crate::mission::event_log::{self, Event, EventLog, Interruption, InterruptionKind};
use crate::mission::{Mission, Window, read_json};

/// The inputs of a mission and the options of reading them.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Reading {
    /// Bags of one mission, or the JSON of one mission.
    pub inputs: Vec<Input>,
    /// The times by which the clocks of recorders were wrong, in nanoseconds: they are added to the times of those
    /// inputs that have this path or name, or lie in this folder.
    pub offsets: Vec<(PathBuf, i64)>,
    /// The namespaces of the names in some inputs, such as `/robot2`, found as in `offsets`: two robots may use the same
    /// names.
    pub namespaces: Vec<(PathBuf, String)>,
    /// Whether to read everything again with a second reader and compare.
    pub verify: bool,
    /// The division of time into windows.
    pub division: Division,
    /// Whether a mission without changes after the first window has a single window, with rates over the whole time.
    pub is_still_if_unchanged: bool,
    /// The options of collecting evidence.
    pub collect: collector::CollectOptions,
    /// Sources of facts besides the bags.
    pub conclude: conclude::ConcludeOptions,
    /// The source code to read; replaces `conclude.code`.
    #[cfg(feature = "source")]
    pub code: Option<SourceCode>,
    /// The fraction by which a rate must change to be reported, ≥ 0.
    pub rate_change: f64,
    /// The source of phases and of their names.
    pub phases: Phases,
}

impl Default for Reading {
    /// No inputs, with the command line's defaults.
    fn default() -> Self {
        Self {
            inputs: Vec::new(),
            offsets: Vec::new(),
            namespaces: Vec::new(),
            verify: false,
            division: Division::default(),
            is_still_if_unchanged: false,
            collect: collector::CollectOptions::default(),
            conclude: conclude::ConcludeOptions::default(),
            #[cfg(feature = "source")]
            code: None,
            rate_change: RATE_CHANGE,
            phases: Phases::Found,
        }
    }
}

impl Reading {
    /// Reads one mission's bags by their paths or URLs, or its JSON, with the command line's defaults.
    pub fn of<P: Into<PathBuf>>(paths: impl IntoIterator<Item = P>) -> Self {
        let inputs = paths.into_iter().map(|path| Input::parse(path.into()));
        Self {
            inputs: inputs.collect(),
            ..Self::default()
        }
    }

    /// The files and folders that it reads, which are never overwritten.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        #[cfg(feature = "source")]
        let source = self.code.iter().map(|code| &code.folder);
        #[cfg(not(feature = "source"))]
        let source = std::iter::empty();
        let topology = self.conclude.topology.files.iter();
        let named = source.chain(topology).chain(self.phases.file());
        let there = named.filter(|path| path.exists()).cloned();
        files(&self.inputs).into_iter().chain(there).collect()
    }
}

/// The existing files and folders among inputs.
pub(super) fn files(inputs: &[Input]) -> Vec<PathBuf> {
    let paths = inputs.iter().filter_map(|input| match input {
        Input::Path(path) => Some(path),
        Input::Stdin => None,
    });
    paths.filter(|path| path.exists()).cloned().collect()
}

/// Reads the inputs into a mission.
///
/// # Errors
/// If an input cannot be read at all, none contains a message, or times are invalid.
pub fn read(reading: &Reading, watch: &mut dyn Watch) -> Result<Mission> {
    explain(reading, watch).map(|(mission, _)| mission)
}

/// Reads the inputs into a mission, with all evidence on the elements in `reading.collect.why`, sorted by time. A
/// mission read from JSON has no evidence.
///
/// # Errors
/// As [`read`].
pub fn explain(reading: &Reading, watch: &mut dyn Watch) -> Result<(Mission, Vec<EvidenceLine>)> {
    let pipe = reading.inputs.iter().find(|input| input.is_pipe());
    if let Some(pipe) = pipe.filter(|_| reading.verify) {
        let pipe = pipe.name();
        let what = format!("`--verify` reads a bag twice, but {pipe} can be read only once");
        return Err(Error::usage(what, "save the bag to a file first"));
    }
    watch.stage(Stage::Read);
    if let Some(path) = mission_file(&reading.inputs)? {
        refuse(reading, path)?;
        return Ok((reread(path, reading)?, Vec::new()));
    }
    let mut reading = reading.clone();
    let mut collected = collect(&mut reading, false, watch)?;
    let reading = &reading;
    let verified = reading.verify.then(|| verify(&collected, reading, watch));
    let verified = verified.transpose()?;
    watch.stage(Stage::Graphs);
    let mut findings = concluded(&collected, reading)?;
    let traffic = traffic(&collected.recorded, &findings)?;
    let passed_over = unread(&collected.recorded, &findings, &traffic)?;
    probe(reading, &mut collected, &passed_over)?;
    let history = made(&collected.recorded, &mut findings, &traffic)?;
    let mission = mission(&collected, &findings, history, verified, reading)?;
    Ok((mission, findings.lines))
}

/// The path of the mission's JSON that is the only input; `None` for bags.
///
/// # Errors
/// If it cannot be read.
pub(crate) fn mission_file(inputs: &[Input]) -> Result<Option<&Path>> {
    let is_json =
        |input: &Input| -> Result<bool> { Ok(matches!(bag::sniff(input)?, InputKind::Json)) };
    match inputs {
        [Input::Path(path)] if is_json(&inputs[0])? => Ok(Some(path)),
        _ => Ok(None),
    }
}

/// Refuses options that only apply to bags.
fn refuse(reading: &Reading, path: &Path) -> Result<()> {
    #[cfg(feature = "source")]
    let source = reading.code.is_some().then_some("`--source` adds to bags");
    #[cfg(not(feature = "source"))]
    let source = None;
    let division = &reading.division;
    let cut = division.cut.map(|_| "`--cut` divides the time of bags");
    match source.or(cut) {
        None => Ok(()),
        Some(what) => Err(Error::usage(
            format!("{what}, but `{}` is a mission's JSON", path.display()),
            "give the bag itself",
        )),
    }
}

/// The mission of what was collected from a growing recording.
///
/// # Errors
/// As [`read`].
pub(super) fn so_far(collected: &Collected, reading: &Reading) -> Result<Mission> {
    let mut findings = concluded(collected, reading)?;
    let traffic = traffic(&collected.recorded, &findings)?;
    let history = made(&collected.recorded, &mut findings, &traffic)?;
    mission(collected, &findings, history, None, reading)
}

/// The limit of bags that a mission in JSON exceeds, if any, and a hint.
fn excess(mission: &Mission) -> Option<(String, &'static str)> {
    let many = i64::try_from(mission.windows.len()).unwrap_or(i64::MAX);
    let elements = &mission.elements;
    let nodes = elements.nodes.iter().map(|node| node.name.as_str());
    let topics = elements.topics.iter().map(|topic| topic.name.as_str());
    let lengths: Vec<usize> = nodes.chain(topics).map(str::len).collect();
    let longest = lengths.iter().max().copied().unwrap_or(0);
    let whole = lengths.iter().sum::<usize>();
    if mission.span.nanos() / DAY >= budget::SPAN_DAYS {
        let days = budget::SPAN_DAYS;
        let reason = format!("its windows cover more than {days} days");
        Some((reason, "times are nanoseconds since 1970"))
    } else if many > budget::WINDOWS {
        let reason = format!("{many} windows are more than {}", budget::WINDOWS);
        let hint = "generate it again from the bag with a longer `--period`";
        Some((reason, hint))
    } else if longest > budget::NAME || lengths.len() > budget::NAMES || whole > budget::NAMES_BYTES
    {
        let reason = "its names are too many or too long".to_owned();
        Some((reason, "such names are not valid"))
    } else {
        None
    }
}

fn reread(path: &Path, reading: &Reading) -> Result<Mission> {
    let text = file::read_text(path, budget::MISSION_JSON)?;
    let mut mission = read_json(&text, path)?;
    drop(text);
    if let Some((reason, hint)) = excess(&mission) {
        return Err(Error::bad_file(path, 0, reason, hint));
    }
    if !mission.knows_lives() {
        mission.find_changes(reading.rate_change);
    } else if (reading.rate_change - RATE_CHANGE).abs() > f64::EPSILON {
        let what = format!(
            "`--rate-change` has no effect on `{}`, which already contains its changes",
            path.display()
        );
        return Err(Error::usage(what, "give the bag itself"));
    }
    if mission.sending.senders.is_empty() {
        mission.sending = windows::sending(&mission.elements, &mission.graphs);
    }
    let basis = Basis {
        elements: &mission.elements,
        sending: &mission.sending,
        whole: mission.span,
        earlier: std::mem::take(&mut mission.log.phases),
        has_changes: mission.log.events.iter().any(Event::is_headline),
    };
    mission.log.phases = wanted(reading, basis)?;
    Ok(mission)
}

/// The findings from everything read, and from source code.
fn concluded(collected: &Collected, reading: &Reading) -> Result<Findings> {
    #[cfg(feature = "source")]
    if let Some(wanted) = &reading.code {
        let mut options = reading.conclude.clone();
        options.code = Some(Arc::new(code::read(wanted)?));
        return conclude(&collected.recorded, &options);
    }
    conclude(&collected.recorded, &reading.conclude)
}

/// The mission of everything read and concluded.
fn mission(
    collected: &Collected,
    findings: &Findings,
    history: History,
    verified: Option<Verified>,
    reading: &Reading,
) -> Result<Mission> {
    let recorded = &collected.recorded;
    let log = log_of(&history, collected, reading)?;
    let mut windows = divided(reading, collected.range, &log)?;
    let period = windows.period;
    let is_still = reading.is_still_if_unchanged && is_still(&windows, &log);
    if is_still {
        windows.spans = vec![windows.span];
    }
    let windowed = graphs(recorded, findings, &history, &windows.spans)?;
    let list = list(&windows, &windowed, &history, &log);
    let mut notices: Notices = recorded.notices.clone();
    notices.extend(findings.notices.iter());
    notices.extend(doubled(&history));
    if reading.division.length == Length::Auto && reading.division.cut.is_none() && !is_still {
        let text = format!("using {period} windows (change with `--period`)");
        notices.add(Notice::new(NoticeKind::Chosen, text));
    }
    let (mut bags, remarks) = match verified {
        Some(verified) => (verified.reports, verified.notices),
        None => (collected.reports.clone(), Vec::new()),
    };
    notices.extend(remarks);
    in_order(&mut bags, recorded);
    Ok(Mission {
        bags,
        span: windows.span,
        messages: list.iter().map(|window| window.messages).sum(),
        period,
        step: windows.step,
        elements: history.elements,
        windows: list,
        graphs: windowed.graphs,
        log,
        sending: history.sending,
        undrawn: findings.undrawn.clone(),
        logged: findings.logged.clone(),
        layout: None,
        notices,
    })
}

/// Sorts bags by their first messages, then by name: the order in which they were given does not matter.
fn in_order(bags: &mut Vec<Report>, recorded: &Recorded) {
    let firsts = recorded.firsts();
    let first = |bag| firsts.some(bag).copied().unwrap_or(Stamp::MAX);
    let mut all: Vec<_> = (0..).map(first).zip(bags.drain(..)).collect();
    all.sort_by(|(a, x), (b, y)| (a, &x.name).cmp(&(b, &y.name)));
    bags.extend(all.into_iter().map(|(_, bag)| bag));
}

/// The notice about nodes that appear in several recordings at the same time.
fn doubled(history: &History) -> Option<Notice> {
    let name = |id: &NodeId| format!("`{}`", history.elements.nodes[*id].name);
    let text = format!(
        "several recordings contain messages of the same nodes at the same time, so restarts of these nodes are unknown: {}; put the names of one bag in a namespace with `--ns BAG=/robot2`",
        words::some_of(history.doubled.iter().map(name), NAMED)
    );
    (!history.doubled.is_empty()).then(|| Notice::new(NoticeKind::Note, text))
}

/// The most nodes named in a notice.
const NAMED: usize = 3;

/// The windows: of equal length, or from change to change.
fn divided(reading: &Reading, span: Span, log: &EventLog) -> Result<Windows> {
    let windows = match reading.division.cut {
        None => return window::divide(&reading.division, span),
        Some(Cut::Phases) if log.phases.is_empty() => {
            return Err(Error::usage(
                "`--cut phases` needs phases, but `--phases none` removes them",
                "leave out `--phases none`",
            ));
        }
        Some(Cut::Phases) => {
            let phases = log.phases.iter().skip(1);
            window::at_changes(span, phases.map(|phase| phase.span.start))
        }
        Some(Cut::Changes) => window::at_changes(span, log.reconfigurations(span).into_iter()),
    };
    Ok(windows)
}

/// The log: the events of the mission, and its phases.
fn log_of(history: &History, collected: &Collected, reading: &Reading) -> Result<EventLog> {
    let elements = &history.elements;
    let events = event_log::make(&event_log::LogInput {
        elements,
        history,
        rate_change: reading.rate_change,
    });
    let basis = Basis {
        elements,
        sending: &history.sending,
        whole: collected.range,
        earlier: Vec::new(),
        has_changes: events.iter().any(Event::is_headline),
    };
    let one = |time, kind, length| Interruption {
        time,
        kind,
        length,
        percent: 100,
    };
    let simulated = history.simulation.changes.iter().map(|(span, what)| {
        let (kind, length, speed) = match *what {
            ClockChange::Back(length) => (InterruptionKind::SimulationBack, length, 1.0),
            ClockChange::Paused => (InterruptionKind::SimulationPaused, span.nanos(), 1.0),
            ClockChange::Speed(speed) => (InterruptionKind::SimulationSpeed, span.nanos(), speed),
        };
        let percent = cast::to_u32(libm::round(speed * 100.0));
        Interruption {
            percent,
            ..one(span.start, kind, length)
        }
    });
    let mut interruptions: Vec<Interruption> = simulated.collect();
    // In a recording in simulated time, the recorder's clock is that of the simulation.
    let is_simulated = |fall: &&ClockFall| {
        let mut all = history.simulation.changes.iter();
        all.any(|(span, what)| {
            let is_back = matches!(what, ClockChange::Back(_));
            is_back && span.start.since(fall.time).abs() <= CLOSE_NS
        })
    };
    let falls = collected.recorded.falls.iter();
    let back = falls.filter(|fall| !is_simulated(fall));
    interruptions.extend(back.map(|fall| one(fall.time, InterruptionKind::ClockBack, fall.length)));
    let is_paused = |pause: &&Span| history.simulation.pauses().any(|own| own == **pause);
    let nothing = history.pauses.iter().filter(|pause| !is_paused(pause));
    interruptions
        .extend(nothing.map(|pause| one(pause.start, InterruptionKind::Nothing, pause.nanos())));
    interruptions.sort_unstable();
    Ok(EventLog {
        interruptions,
        events,
        phases: wanted(reading, basis)?,
        ..EventLog::default()
    })
}

/// The windows, and the changes from each to the next.
fn list(windows: &Windows, windowed: &Windowed, history: &History, log: &EventLog) -> Vec<Window> {
    let changes = changes::explain(&windowed.graphs, &history.elements, log);
    let window = |(index, (messages, (changes, events)))| Window {
        index,
        span: windows.spans[index],
        partial: windows.partial(index),
        messages,
        changes,
        events,
    };
    let parts = windowed.messages.iter().copied().zip(changes);
    parts.enumerate().map(window).collect()
}

/// Whether no event begins, ends or lasts after the first window.
fn is_still(windows: &Windows, log: &EventLog) -> bool {
    let first = windows.spans.first().map_or(windows.span.end, |s| s.end);
    let all = log.headlines(windows.span);
    let mut later = all.filter(|(_, e)| e.until.unwrap_or(e.time) >= first);
    later.next().is_none()
}
