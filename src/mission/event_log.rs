//! The events of a mission, in continuous time: one list, made once from the full graph, independent of windows and views.
//!
//! In: the elements and the history of a mission. Out: an [`EventLog`], which all outputs read that show a change (badges,
//! captions, marks, tables, pages), and its text. Begin with `make`, which calls one file per kind of event and then `causes`,
//! which leaves one headline per cause; `written` and `sentence` print the log.

mod causes;
mod drafts;
mod handovers;
mod incidents;
mod rates;
mod sentence;
mod silence;
mod starts;
mod written;

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::base::ids::{grouped, ids};
use crate::base::rhythm::{CLOSE_NS, SWITCH, SWITCH_NS};
use crate::base::time::{Span, Stamp};
use crate::base::words::worded;
use crate::evidence::{Confidence, Evidence};
use crate::graph::{ById, Element, NodeId};

pub(crate) use drafts::{LogInput, sorted};
pub(crate) use sentence::{interrupted, predicate, sentence, sentence_with};
pub use written::{LogFormat, LogLine, LogOptions, log};
pub(crate) use written::{LogRow, body, headlines, lines, quoted, row_lines, whole};

/// The most reconfigurations of a mission: as many as automatic windows, so that a film of them has no more frames.
const MOST: i64 = crate::base::budget::CHOSEN_WINDOWS;

/// Every event of a mission, sorted.
pub(crate) fn make(context: &LogInput<'_>) -> ById<EventId, Event> {
    let mut drafts = drafts::Drafts::default();
    starts::add(context, &mut drafts);
    silence::add(context, &mut drafts);
    handovers::add(context, &mut drafts);
    rates::add(context, &mut drafts);
    incidents::add_lifecycles(context, &mut drafts);
    incidents::add(context, &mut drafts);
    causes::add(context, &mut drafts);
    sorted(drafts.list, context.elements)
}

ids! {
    /// The id of an event: its index in [`EventLog::events`].
    #[derive(Deserialize, Serialize)]
    EventId,
}

impl std::fmt::Display for EventId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

/// The parts of each event that has any, in order.
pub(crate) type Parts = BTreeMap<EventId, Vec<EventId>>;

/// All events of a mission, and its phases.
///
/// ```
/// use bagreel::values::Kind;
/// use bagreel::{Reading, read};
///
/// let bag = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
/// let mission = read(&Reading::of([bag]))?;
/// for (_, event) in mission.log.headlines(mission.span) {
///     println!("{} s: {}", mission.offset(event.time) / 1_000_000_000, event.kind.word());
/// }
/// let started = mission.log.events.iter().filter(|e| e.kind == Kind::Started);
/// # assert!(started.count() > 0);
/// # Ok::<(), bagreel::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct EventLog {
    /// Sorted by time, then kind, then name.
    pub events: ById<EventId, Event>,
    /// The interruptions of the recording, which are not actions of the robot, sorted by time.
    pub interruptions: Vec<Interruption>,
    /// The phases, in order and without gaps; empty if not detected.
    pub phases: Vec<Phase>,
    /// Whether it is the comparison of a mission, B, with another, A: elements that started or appeared are only in B,
    /// elements that stopped or vanished only in A, and times have no meaning.
    pub(crate) compares: bool,
}

worded! {
    /// The kind of an event. Ordered as events of one time are listed.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
    #[non_exhaustive]
    pub enum Kind {
        /// A node began; its edges and topics are parts of it.
        Started = "started",
        /// A node ended.
        Stopped = "stopped",
        /// A node, or an anonymous role, was gone from [`Event::time`] to [`Event::until`] and is back.
        Restarted = "restarted",
        /// A node or topic that sends regularly paused from [`Event::time`] to [`Event::until`]; nothing
        /// shows a restart.
        Silent = "silent",
        /// A topic of unknown publisher, or an edge of a running node, began.
        Appeared = "appeared",
        /// A topic of unknown publisher, or an edge of a running node, ended.
        Vanished = "vanished",
        /// A topic's messages come from other publishers.
        HandedOver = "handed_over",
        /// A topic's or publication's rate changed.
        Rate = "rate",
        /// A node's lifecycle state changed.
        Lifecycle = "lifecycle",
        /// A topic has another type.
        Type = "type",
        /// A topic is offered with another quality of service.
        Qos = "qos",
        /// A subscriber receives nothing over this edge: its quality of service requires more than is offered.
        Starved = "starved",
        /// Two nodes have the same name.
        Duplicate = "duplicate",
        /// The recorder lost messages of a topic.
        Lost = "lost",
    }
}

impl Kind {
    /// Whether it is a remark about the robot or the recorder, not a reconfiguration.
    pub(crate) fn is_remark(self) -> bool {
        matches!(self, Self::Starved | Self::Duplicate | Self::Lost)
    }
}

/// The values of an event besides its kind and time.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Detail<N = NodeId, V = Arc<str>> {
    /// No values.
    #[default]
    #[serde(skip)]
    None,
    /// Messages per second before and after; both above 0.
    Rates {
        /// The rate before.
        from_hz: f64,
        /// The rate after.
        to_hz: f64,
    },
    /// The senders before and after, sorted.
    Senders {
        /// The senders before.
        from: Vec<N>,
        /// The senders after.
        to: Vec<N>,
    },
    /// A number of messages that were lost, or of times that an element appears.
    Count {
        /// The number.
        count: u64,
    },
    /// A value before and after; empty for none.
    Values {
        /// The value before.
        from: V,
        /// The value after.
        to: V,
    },
}

impl<N, V> Detail<N, V> {
    /// The same values with other names for nodes and texts; `None` if a node has none.
    pub(crate) fn mapped<'a, M, W>(
        &'a self,
        node: impl Fn(&'a N) -> Option<M>,
        text: impl Fn(&'a V) -> W,
    ) -> Option<Detail<M, W>> {
        let nodes = |all: &'a [N]| all.iter().map(&node).collect::<Option<Vec<M>>>();
        Some(match self {
            Self::None => Detail::None,
            &Self::Rates { from_hz, to_hz } => Detail::Rates { from_hz, to_hz },
            Self::Senders { from, to } => {
                let (from, to) = (nodes(from)?, nodes(to)?);
                Detail::Senders { from, to }
            }
            &Self::Count { count } => Detail::Count { count },
            Self::Values { from, to } => {
                let (from, to) = (text(from), text(to));
                Detail::Values { from, to }
            }
        })
    }
}

/// An event.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Event {
    /// The kind.
    pub kind: Kind,
    /// The element. Where an anonymous role restarted, its new node.
    pub what: Element,
    /// The best estimate of the time.
    pub time: Stamp,
    /// The earliest possible time.
    pub earliest: Stamp,
    /// The latest possible time.
    pub latest: Stamp,
    /// The end of an event that lasts: a restart, a silence.
    pub until: Option<Stamp>,
    /// The values of the event.
    pub detail: Detail,
    /// The strength of the evidence for it.
    pub confidence: Confidence,
    /// The kinds of evidence for it.
    pub evidence: Evidence,
    /// The event that this one is a part of: an edge of a node that started. Parts have no parts.
    pub part_of: Option<EventId>,
    /// Whether it is housekeeping or the recorder's, which is only shown on request.
    pub quiet: bool,
    /// The number of elements in it, itself and its parts, ≥ 1.
    pub weight: u32,
}

impl Event {
    /// For how long it lasts, in nanoseconds, if that is known: a node that restarts is away for some time between the last sign
    /// before and the first after it.
    pub fn lasted(&self) -> Option<i64> {
        let is_known = |until: &Stamp| self.kind != Kind::Restarted || self.latest < *until;
        Some(self.until.filter(is_known)?.since(self.time))
    }

    /// Whether it is shown separately: neither quiet nor part of another.
    pub fn is_headline(&self) -> bool {
        !self.quiet && self.part_of.is_none()
    }
}

/// An interruption of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct Interruption {
    /// The time of the last message before, on the mission's time axis.
    pub time: Stamp,
    /// The kind.
    pub kind: InterruptionKind,
    /// The time by which the clock went back, or for which it lasted, in nanoseconds, ≥ 0.
    pub length: i64,
    /// The speed of a simulation in percent of the recorder's clock; 100 in all other kinds.
    pub percent: u32,
}

impl Interruption {
    /// The time in which nothing happens, without length where a clock went back; `None` if the simulation goes on.
    pub(crate) fn hole(&self) -> Option<Span> {
        let length = match self.kind {
            InterruptionKind::ClockBack | InterruptionKind::SimulationBack => 0,
            InterruptionKind::Nothing | InterruptionKind::SimulationPaused => self.length,
            InterruptionKind::SimulationSpeed => return None,
        };
        Some(Span::new(self.time, self.time.plus(length)))
    }
}

worded! {
    /// The kind of an interruption.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    #[non_exhaustive]
    pub enum InterruptionKind {
        /// The recorder's clock was set back, or simulated time restarted: later messages are placed after
        /// earlier ones.
        ClockBack = "clock_back",
        /// Nothing was recorded: the recorder paused, or its clock was set ahead.
        Nothing = "nothing_recorded",
        /// Simulated time was set back, according to `/clock`.
        SimulationBack = "simulation_back",
        /// Simulated time stood still.
        SimulationPaused = "simulation_paused",
        /// Simulated time had another speed than the recorder's clock, or than at the beginning.
        SimulationSpeed = "simulation_speed",
    }
}

/// A switch of the robot to another mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Switch {
    /// The time of its first event.
    pub(crate) time: Stamp,
    pub(crate) stopped: usize,
    pub(crate) started: usize,
}

/// A part of the mission with one configuration.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Phase {
    /// The interval, half-open.
    pub span: Span,
    /// The name: the user's, or the elements that began in it: `+4 nodes: controller, costmap and 2 more`.
    pub name: Arc<str>,
    /// The number of nodes (roles; topics if publishers are unknown) that are in it and not in the previous phase; in
    /// the first phase, the number of all nodes.
    pub nodes_added: u32,
    /// The number of nodes that are in the previous phase and not in this one.
    pub nodes_removed: u32,
    /// Whether it combines many consecutive short phases that only add or only remove.
    pub is_ramp: bool,
    /// The index of the earlier phase with the same configuration.
    pub same_as: Option<u32>,
}

impl EventLog {
    /// The word for the element of an event of this kind.
    pub(crate) fn word(&self, kind: Kind) -> &'static str {
        match kind {
            Kind::Started | Kind::Appeared if self.compares => "only in B",
            Kind::Stopped | Kind::Vanished if self.compares => "only in A",
            kind => kind.word(),
        }
    }

    /// Entries with times in `span`, with their ids, in order.
    pub fn inside(&self, span: Span) -> impl Iterator<Item = (EventId, &Event)> {
        let first = self.events.partition_point(|e| e.time < span.start);
        let events = self.events.with_ids().skip(first);
        events.take_while(move |(_, e)| e.time < span.end)
    }

    /// The headlines with times in `span`, in order.
    pub fn headlines(&self, span: Span) -> impl Iterator<Item = (EventId, &Event)> {
        self.inside(span).filter(|(_, e)| e.is_headline())
    }

    /// The times of reconfigurations inside `span`: the first of each group of close headlines.
    pub fn reconfigurations(&self, span: Span) -> Vec<Stamp> {
        let close = CLOSE_NS.max(span.nanos() / MOST);
        let headlines = self.headlines(span).filter(|(_, e)| !e.kind.is_remark());
        let times: Vec<Stamp> = headlines.map(|(_, e)| e.time).collect();
        let groups = times.chunk_by(|a, b| b.since(*a) <= close);
        groups.map(|group| group[0]).collect()
    }

    /// The robot's mode switches: nodes that stop and others that start within a few seconds. For example, at 60 s three nodes
    /// of the navigation stop and within 4 s four of the docking start.
    pub(crate) fn switches(&self) -> Vec<Switch> {
        let limits = self.events.iter().filter(|e| e.is_headline());
        let limits = limits.filter(|e| matches!(e.kind, Kind::Started | Kind::Stopped));
        let limits: Vec<&Event> = limits.collect();
        let mut found: Vec<Switch> = Vec::new();
        // The first one, the one after the last within reach, and the stops between them.
        let (mut at, mut end, mut stopped) = (0, 0, 0);
        while let Some(first) = limits.get(at) {
            let is_near = |e: &&&Event| e.time.since(first.time) <= SWITCH_NS;
            while let Some(next) = limits.get(end).filter(is_near) {
                stopped += usize::from(next.kind == Kind::Stopped);
                end += 1;
            }
            let many = end - at;
            let (each, all) = SWITCH;
            if stopped.min(many - stopped) >= each && many >= all {
                found.push(Switch {
                    time: first.time,
                    stopped,
                    started: many - stopped,
                });
                (at, stopped) = (end, 0);
            } else {
                stopped -= usize::from(first.kind == Kind::Stopped);
                at += 1;
            }
        }
        found
    }

    /// The ids of the parts of all events, in order, by the ids of those events.
    pub fn all_parts(&self) -> Parts {
        let events = self.events.with_ids();
        grouped(events.filter_map(|(id, event)| Some((event.part_of?, id))))
    }

    /// The parts of an event, in order.
    pub fn parts(&self, id: EventId) -> impl Iterator<Item = &Event> {
        self.events.iter().filter(move |e| e.part_of == Some(id))
    }
}
