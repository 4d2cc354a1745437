//! The expectation of a mission: the values of `graph.yaml`, each with its position in the file.

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
use crate::mission::event_log::Kind;

pub(crate) use parse::read;

/// The first line of every expectation.
pub(crate) const SCHEMA: &str = "bagreel.expect/1";

/// A value and its position in the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct At<T> {
    pub(crate) at: YamlPlace,
    pub(crate) value: T,
}

/// A whole `graph.yaml`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Expectation {
    /// The file as given.
    pub(crate) file: PathBuf,
    /// The length of the windows in which rates are checked.
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
    /// The position of the name.
    pub(crate) at: YamlPlace,
    /// The position at which its facts begin.
    pub(crate) body: YamlPlace,
    pub(crate) facts: T,
}

/// The policy for elements of the bag that are not in the file.
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

/// The severity of an element that is not in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unlisted {
    Allow,
    Warn,
    Error,
}

/// The facts that can be expected about a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct NodeFacts {
    /// Whether it must be absent.
    pub(crate) forbidden: bool,
    /// Whether it may be absent.
    pub(crate) optional: bool,
    /// The time range in which it may end; `None` if it must stay.
    pub(crate) may_end: Option<At<During>>,
    /// Whether only its log names it, so it may run unnamed.
    pub(crate) is_logged: bool,
    pub(crate) restarts: Option<At<Range>>,
    /// Its state at the end.
    pub(crate) lifecycle: Option<At<String>>,
    /// The time range in which it must appear.
    pub(crate) within: Option<At<During>>,
}

/// The facts that can be expected about a topic.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TopicFacts {
    pub(crate) forbidden: bool,
    pub(crate) optional: bool,
    /// The time range for its last message, until which its rate is checked; `None` if it must stay.
    pub(crate) may_end: Option<At<During>>,
    /// The types of its messages: these and no others.
    pub(crate) kinds: Option<At<Vec<At<Pattern>>>>,
    /// The nodes that publish it: these and no others.
    pub(crate) by: Option<At<Vec<At<Pattern>>>>,
    /// The nodes that subscribe to it: these at least.
    pub(crate) to: Option<At<Vec<At<Pattern>>>>,
    /// Messages per second in every window.
    pub(crate) hz: Option<At<Range>>,
    /// Messages per second from its first to its last one.
    pub(crate) mean_hz: Option<At<Range>>,
    /// The time range for its first message.
    pub(crate) within: Option<At<During>>,
    /// The percentage of windows in which the rate must be met; all if `None`.
    pub(crate) percent: Option<f64>,
    /// The longest silence in nanoseconds.
    pub(crate) max_gap: Option<At<i64>>,
    /// The ranges of [`MEASURES`] in every window.
    pub(crate) measures: [Option<At<Range>>; MEASURES.len()],
    pub(crate) latched: Option<At<bool>>,
    /// Text that its quality of service must contain.
    pub(crate) qos: Option<At<String>>,
    /// The time range in which rate and gaps are checked; the whole mission if `None`.
    pub(crate) during: Option<During>,
    /// The condition on the windows in which they are checked; all if `None`.
    pub(crate) whilst: Option<While>,
}

impl TopicFacts {
    /// Whether any fact requires messages.
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
    /// A node is present.
    Node(Pattern),
}

/// A named expectation.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rule {
    pub(crate) id: String,
    pub(crate) at: YamlPlace,
    pub(crate) demand: Demand,
}

/// The condition that a rule checks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Demand {
    /// Facts of each of these nodes.
    Nodes(Vec<At<Pattern>>, NodeFacts),
    /// Facts of a topic.
    Topic(At<Pattern>, Box<TopicFacts>),
    /// The order in which nodes start.
    Order(Vec<At<Pattern>>),
    /// An event that follows another within this many nanoseconds.
    Reaction {
        when: ExpectedEvent,
        expect: ExpectedEvent,
        within: i64,
    },
    /// The range of the number of reconfigurations.
    Changes { during: Option<During>, many: Range },
}

/// An event of the event log.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ExpectedEvent {
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

/// An accepted known finding.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AllowedFinding {
    pub(crate) at: YamlPlace,
    pub(crate) finding: super::FindingKind,
    pub(crate) name: Pattern,
    /// The expiry, compared with the start of the bag; `None` for never.
    pub(crate) until: Option<At<Stamp>>,
    pub(crate) why: String,
}
