//! What happened in a mission, in continuous time: one list, made once on the full graph, before any window or view.
//!
//! Windows only say when we look. Whatever tells a change (chips, captions, marks, tables, pages, the log) reads this.

mod changes;
mod from_changes;
mod hands;
mod lifetimes;
mod make;
mod rates;
mod silence;

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::time::{Span, Stamp};
use crate::evidence::{Degree, Evidence};
use crate::graph::{Element, Elements, NodeId};
use crate::mission::Window;

pub(crate) use changes::{explain, places};
pub(crate) use make::{LedgerInput, make, sorted};

/// A launch file brings its nodes up one after the other, each within this time.
const CLOSE_NS: i64 = 2_000_000_000;
/// Nobody looks at more turns of a mission than windows are chosen for it.
const MOST_TURNS: i64 = crate::base::budget::CHOSEN_WINDOWS;

/// An entry's place in [`Ledger::entries`].
pub type EntryId = u32;

/// Everything that happened, and the phases in which it did.
///
/// ```
/// use bagreel::values::Kind;
/// use bagreel::{Reading, read};
///
/// let bag = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
/// let mission = read(&Reading::of([bag]))?;
/// for (_, entry) in mission.ledger.headlines(mission.span) {
///     println!("{} s: {}", mission.offset(entry.time) / 1_000_000_000, entry.kind.word());
/// }
/// let started = mission.ledger.entries.iter().filter(|e| e.kind == Kind::Started);
/// # assert!(started.count() > 0);
/// # Ok::<(), bagreel::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Ledger {
    /// Sorted by time, then kind, then name: the log never runs backwards.
    pub entries: Vec<Entry>,
    /// Stretches that one graph describes, in order and without holes; empty where they were not looked for.
    pub phases: Vec<Phase>,
    /// Whether it tells how a mission, B, differs from another, A: what started or appeared is only in B, what stopped or
    /// vanished only in A, and times mean nothing.
    pub(crate) compares: bool,
}

/// What kind of thing happened. Ordered as entries of one time are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Kind {
    /// A node began; its edges and topics are parts of it.
    Started,
    /// A node ended.
    Stopped,
    /// A node, or an anonymous role, was gone from [`Entry::time`] to [`Entry::until`] and is back.
    Restarted,
    /// A node or topic with a rhythm paused from [`Entry::time`] to [`Entry::until`]; nothing proves a restart.
    Silent,
    /// A topic of unknown publisher, or an edge of a living node, began.
    Appeared,
    /// A topic of unknown publisher, or an edge of a living node, ended.
    Vanished,
    /// A topic's messages come from other senders.
    HandedOver,
    /// A topic's or publication's rate changed.
    Rate,
    /// A node's lifecycle state changed.
    Lifecycle,
    /// A topic has another type.
    Type,
    /// A topic is offered with another quality of service.
    Qos,
}

impl Kind {
    /// All of them, in their order.
    pub const ALL: [Self; 11] = [
        Self::Started,
        Self::Stopped,
        Self::Restarted,
        Self::Silent,
        Self::Appeared,
        Self::Vanished,
        Self::HandedOver,
        Self::Rate,
        Self::Lifecycle,
        Self::Type,
        Self::Qos,
    ];

    /// Its word in JSON and in the log.
    pub fn word(self) -> &'static str {
        match self {
            Self::Started => "started",
            Self::Stopped => "stopped",
            Self::Restarted => "restarted",
            Self::Silent => "silent",
            Self::Appeared => "appeared",
            Self::Vanished => "vanished",
            Self::HandedOver => "handed_over",
            Self::Rate => "rate",
            Self::Lifecycle => "lifecycle",
            Self::Type => "type",
            Self::Qos => "qos",
        }
    }
}

/// What an entry says beside its kind and its time.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Detail {
    /// Nothing more.
    #[default]
    None,
    /// Messages per second before and after; both above 0.
    Rates {
        /// Before.
        from_hz: f64,
        /// After.
        to_hz: f64,
    },
    /// Who sent before and who sends after, sorted.
    Senders {
        /// Before.
        from: Vec<NodeId>,
        /// After.
        to: Vec<NodeId>,
    },
    /// A value before and after; empty for none.
    Values {
        /// Before.
        from: Arc<str>,
        /// After.
        to: Arc<str>,
    },
}

/// One thing that happened.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Entry {
    /// What kind of thing.
    pub kind: Kind,
    /// To whom or what. Where an anonymous role restarted, its new node.
    pub what: Element,
    /// When, as well as we know.
    pub time: Stamp,
    /// The truth does not lie before this.
    pub earliest: Stamp,
    /// The truth does not lie after this.
    pub latest: Stamp,
    /// When it was over, of what lasts: a restart, a silence.
    pub until: Option<Stamp>,
    /// What more there is to say.
    pub detail: Detail,
    /// How well it is known.
    pub degree: Degree,
    /// What proves it.
    pub evidence: Evidence,
    /// The entry that this one is a part of: an edge of a node that started. Parts have no parts.
    pub part_of: Option<EntryId>,
    /// Whether it is housekeeping or the recorder's, which is told only when asked for.
    pub quiet: bool,
    /// How many elements it moved, itself and its parts, 1...
    pub weight: u32,
}

impl Entry {
    /// Whether it is told by itself: neither quiet nor part of another.
    pub fn is_headline(&self) -> bool {
        !self.quiet && self.part_of.is_none()
    }
}

/// A stretch of the mission that one graph describes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Phase {
    /// From when to when, half-open.
    pub span: Span,
    /// What it is called: the user's name, or what began in it: `+4 nodes: controller, costmap and 2 more`.
    pub name: Arc<str>,
    /// Nodes (roles; topics where publishers are unknown) that are there and were not in the phase before; in the first
    /// phase all that are there.
    pub nodes_added: u32,
    /// Nodes that were in the phase before and are not there.
    pub nodes_removed: u32,
    /// Whether it stands for many short phases in a row that only added or only removed.
    pub is_ramp: bool,
    /// The earlier phase, by place, that has the same configuration.
    pub same_as: Option<u32>,
}

impl Ledger {
    /// What the changes from window to window say, where nothing finer is known.
    pub(crate) fn from_changes(elements: &Elements, windows: &[Window]) -> Self {
        from_changes::from_changes(elements, windows)
    }

    /// What is said of whatever an entry of this kind is about.
    pub(crate) fn word(&self, kind: Kind) -> &'static str {
        match kind {
            Kind::Started | Kind::Appeared if self.compares => "only in B",
            Kind::Stopped | Kind::Vanished if self.compares => "only in A",
            kind => kind.word(),
        }
    }

    /// Entries whose time lies in `span`, with their places, in order.
    pub fn inside(&self, span: Span) -> impl Iterator<Item = (EntryId, &Entry)> {
        let first = self.entries.partition_point(|e| e.time < span.start);
        let entries = self.entries.iter().enumerate().skip(first);
        entries
            .take_while(move |(_, e)| e.time < span.end)
            .map(|(id, e)| (u32::try_from(id).unwrap_or(u32::MAX), e))
    }

    /// The headlines whose time lies in `span`, in order.
    pub fn headlines(&self, span: Span) -> impl Iterator<Item = (EntryId, &Entry)> {
        self.inside(span).filter(|(_, e)| e.is_headline())
    }

    /// When the mission reconfigured inside `span`: the first headline of each run of them that are close together.
    pub fn turns(&self, span: Span) -> Vec<Stamp> {
        let close = CLOSE_NS.max(span.nanos() / MOST_TURNS);
        let mut turns = Vec::new();
        let mut last: Option<Stamp> = None;
        for (_, entry) in self.headlines(span) {
            if last.is_none_or(|last| entry.time.since(last) > close) {
                turns.push(entry.time);
            }
            last = Some(entry.time);
        }
        turns
    }

    /// The places of all entries' parts, in order, by the places of those entries.
    pub fn all_parts(&self) -> BTreeMap<EntryId, Vec<EntryId>> {
        let mut parts: BTreeMap<EntryId, Vec<EntryId>> = BTreeMap::new();
        for (id, entry) in (0..).zip(&self.entries) {
            if let Some(whole) = entry.part_of {
                parts.entry(whole).or_default().push(id);
            }
        }
        parts
    }

    /// The parts of an entry, in order.
    pub fn parts(&self, id: EntryId) -> impl Iterator<Item = &Entry> {
        self.entries.iter().filter(move |e| e.part_of == Some(id))
    }
}
