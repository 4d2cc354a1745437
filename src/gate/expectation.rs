//! The expectation of a mission: the values of `graph.yaml`, each with its place in the file.

mod fields;
mod parse;

use std::path::PathBuf;

use super::finding::FindingKind;
use super::measure::MEASURES;
use super::pattern::Pattern;
use super::range::{During, Range};
use crate::base::time::{Period, Stamp};
use crate::base::words::worded;
pub(crate) use crate::base::yaml::YamlPlace;
use crate::mission::ledger::Kind;

pub(crate) use parse::read;

/// The first line of every expectation.
pub(crate) const SCHEMA: &str = "bagreel.expect/1";

/// A value and its place in the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct At<T> {
    pub(crate) at: YamlPlace,
    pub(crate) value: T,
}

/// A whole `graph.yaml`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Expectation {
    /// The file, as it was named.
    pub(crate) file: PathBuf,
    /// The length of the windows in which rates are judged.
    pub(crate) period: Option<Period>,
    pub(crate) policy: Policy,
    pub(crate) nodes: Vec<Named<NodeFacts>>,
    pub(crate) topics: Vec<Named<TopicFacts>>,
    pub(crate) rules: Vec<Rule>,
    pub(crate) allow: Vec<AllowedFinding>,
}

/// The expectation of a name.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Named<T> {
    pub(crate) name: Pattern,
    /// The place of the name.
    pub(crate) at: YamlPlace,
    /// The place at which its facts begin.
    pub(crate) body: YamlPlace,
    pub(crate) facts: T,
}

/// The policy for elements of the bag that the file does not name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Policy {
    pub(crate) at: YamlPlace,
    pub(crate) nodes: Unlisted,
    pub(crate) topics: Unlisted,
    /// The policy for publishers of topics whose publishers are listed.
    pub(crate) publishers: Unlisted,
    /// The policy for remarks of the event log, in the order of [`REMARKS`].
    pub(crate) remarks: [Unlisted; REMARKS.len()],
}

/// The remarks of the event log that are findings: the key of their policy, their kind there and here.
pub(crate) const REMARKS: [(&str, Kind, FindingKind); 3] = [
    ("starved", Kind::Starved, FindingKind::Starved),
    (
        "duplicate_names",
        Kind::Duplicate,
        FindingKind::DuplicateName,
    ),
    ("messages_lost", Kind::Lost, FindingKind::MessagesLost),
];

/// The severity of something that is not named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unlisted {
    Allow,
    Warn,
    Error,
}

/// The facts that can be expected of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct NodeFacts {
    /// Whether it must not be there.
    pub(crate) forbidden: bool,
    /// Whether it need not be there.
    pub(crate) optional: bool,
    /// The stretch in which it may end; `None` if it must stay.
    pub(crate) may_end: Option<At<During>>,
    /// Whether only its log names it, so that it may be there unnamed.
    pub(crate) is_logged: bool,
    pub(crate) restarts: Option<At<Range>>,
    /// The state that it is in at the end.
    pub(crate) lifecycle: Option<At<String>>,
    /// The stretch in which it must appear.
    pub(crate) within: Option<At<During>>,
}

/// The facts that can be expected of a topic.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TopicFacts {
    pub(crate) forbidden: bool,
    pub(crate) optional: bool,
    /// The stretch in which its last message may come, up to which its rate is judged; `None` if it must stay.
    pub(crate) may_end: Option<At<During>>,
    pub(crate) kind: Option<At<String>>,
    /// The nodes that publish it: these and no others.
    pub(crate) by: Option<At<Vec<At<Pattern>>>>,
    /// The nodes that subscribe it: these at least.
    pub(crate) to: Option<At<Vec<At<Pattern>>>>,
    /// Messages per second in every window.
    pub(crate) hz: Option<At<Range>>,
    /// Messages per second from its first to its last one.
    pub(crate) mean_hz: Option<At<Range>>,
    /// The stretch in which its first message must come.
    pub(crate) within: Option<At<During>>,
    /// The share of windows in which the rate must hold, in per cent; all if `None`.
    pub(crate) percent: Option<f64>,
    /// The longest silence in nanoseconds.
    pub(crate) max_gap: Option<At<i64>>,
    /// The ranges of [`MEASURES`] in every window.
    pub(crate) measures: [Option<At<Range>>; MEASURES.len()],
    pub(crate) latched: Option<At<bool>>,
    /// Words that its quality of service must hold.
    pub(crate) qos: Option<At<String>>,
    /// The time in which rate and gaps are judged; the whole mission if `None`.
    pub(crate) during: Option<During>,
    /// The condition on the windows in which they are judged; all if `None`.
    pub(crate) whilst: Option<While>,
}

impl TopicFacts {
    /// Whether something is asked of its messages, so that it must have some.
    pub(crate) fn wants_messages(&self) -> bool {
        self.hz.is_some()
            || self.mean_hz.is_some()
            || self.max_gap.is_some()
            || self.within.is_some()
            || self.measures.iter().any(Option::is_some)
    }
}

/// A condition on windows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum While {
    /// A topic has this rate.
    Rate(Pattern, Range),
    /// A node is there.
    Node(Pattern),
}

/// An expectation with a name of its own.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rule {
    pub(crate) id: String,
    pub(crate) at: YamlPlace,
    pub(crate) demand: Demand,
}

/// The demand of a rule.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Demand {
    /// Facts of each of these nodes.
    Nodes(Vec<At<Pattern>>, NodeFacts),
    /// Facts of a topic.
    Topic(At<Pattern>, Box<TopicFacts>),
    /// That nodes begin one after the other.
    Order(Vec<At<Pattern>>),
    /// That one thing follows another within so many nanoseconds.
    Reaction {
        when: Event,
        expect: Event,
        within: i64,
    },
    /// That the number of reconfigurations lies in a range.
    Changes { during: Option<During>, many: Range },
}

/// An event that the ledger may tell of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Event {
    pub(crate) kind: EventKind,
    pub(crate) name: Pattern,
    /// The sender or value before; any if `None`.
    pub(crate) from: Option<Pattern>,
    /// The sender or value after; any if `None`.
    pub(crate) to: Option<Pattern>,
}

worded! {
    /// Kinds of events, as a rule names them.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) enum EventKind {
        Added = "added",
        Removed = "removed",
        Restarted = "restarted",
        Silent = "silent",
        HandedOver = "handed_over",
        Rate = "rate",
        Lifecycle = "lifecycle",
    }
}

/// A finding that is known and forgiven.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AllowedFinding {
    pub(crate) at: YamlPlace,
    pub(crate) finding: super::FindingKind,
    pub(crate) name: Pattern,
    /// The time from which on it does not hold, by the beginning of the bag; `None` for always.
    pub(crate) until: Option<At<Stamp>>,
    pub(crate) why: String,
}
