//! What a mission is expected to be: the nouns of `graph.yaml`, each with its place in the file.

mod fields;
mod parse;

use std::path::PathBuf;

use super::pattern::Pattern;
use super::range::{During, Range};
use crate::base::time::{Period, Stamp};
pub(crate) use crate::base::yaml::YamlPlace;

pub(crate) use parse::read;

/// The first line of every expectation.
pub(crate) const SCHEMA: &str = "bagreel.expect/1";

/// A value and where it stands.
#[derive(Clone, Debug, PartialEq)]
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

/// What is expected of a name.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Named<T> {
    pub(crate) name: Pattern,
    /// Where the name stands.
    pub(crate) at: YamlPlace,
    /// Where what is said of it begins.
    pub(crate) body: YamlPlace,
    pub(crate) facts: T,
}

/// What of the bag that the file does not name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Policy {
    pub(crate) at: YamlPlace,
    pub(crate) nodes: Unlisted,
    pub(crate) topics: Unlisted,
    /// Of topics whose publishers are listed.
    pub(crate) publishers: Unlisted,
}

/// How bad it is that something is not named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unlisted {
    Allow,
    Warn,
    Error,
}

/// What can be expected of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct NodeFacts {
    /// It must not be there.
    pub(crate) forbidden: bool,
    /// It need not be there.
    pub(crate) optional: bool,
    /// It need not stay to the end.
    pub(crate) may_end: bool,
    pub(crate) restarts: Option<At<Range>>,
    /// The state that it is in at the end.
    pub(crate) lifecycle: Option<At<String>>,
    /// Nanoseconds from the mission's start in which it must appear.
    pub(crate) within: Option<At<i64>>,
}

/// What can be expected of a topic.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TopicFacts {
    pub(crate) forbidden: bool,
    pub(crate) optional: bool,
    /// Its rate is judged up to its last message only.
    pub(crate) may_end: bool,
    pub(crate) kind: Option<At<String>>,
    /// Who publishes it: these and nobody else.
    pub(crate) by: Option<At<Vec<At<Pattern>>>>,
    /// Who subscribes it: these at least.
    pub(crate) to: Option<At<Vec<At<Pattern>>>>,
    /// Messages per second in every window.
    pub(crate) hz: Option<At<Range>>,
    /// The share of windows in which the rate must hold, in per cent; all if `None`.
    pub(crate) percent: Option<f64>,
    /// The longest silence in nanoseconds.
    pub(crate) max_gap: Option<At<i64>>,
    pub(crate) latched: Option<At<bool>>,
    /// Words that its quality of service must hold.
    pub(crate) qos: Option<At<String>>,
    /// When rate and gaps are judged.
    pub(crate) during: Option<During>,
    /// In which windows they are.
    pub(crate) whilst: Option<While>,
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

/// What a rule asks for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Demand {
    /// Of each of these nodes.
    Nodes(Vec<At<Pattern>>, NodeFacts),
    /// Of a topic.
    Topic(At<Pattern>, Box<TopicFacts>),
    /// That nodes begin one after the other.
    Order(Vec<At<Pattern>>),
    /// That one thing follows another within so many nanoseconds.
    Reaction {
        when: Event,
        expect: Event,
        within: i64,
    },
    /// How many reconfigurations there are.
    Changes { during: Option<During>, many: Range },
}

/// Something that the ledger may tell of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Event {
    pub(crate) kind: EventKind,
    pub(crate) name: Pattern,
    /// Who or what before.
    pub(crate) from: Option<Pattern>,
    /// Who or what after.
    pub(crate) to: Option<Pattern>,
}

/// Kinds of events, as a rule names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EventKind {
    Added,
    Removed,
    Restarted,
    Silent,
    HandedOver,
    Rate,
    Lifecycle,
}

impl EventKind {
    pub(crate) const ALL: [Self; 7] = [
        Self::Added,
        Self::Removed,
        Self::Restarted,
        Self::Silent,
        Self::HandedOver,
        Self::Rate,
        Self::Lifecycle,
    ];

    /// Its word in the file.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::Removed => "removed",
            Self::Restarted => "restarted",
            Self::Silent => "silent",
            Self::HandedOver => "handed_over",
            Self::Rate => "rate",
            Self::Lifecycle => "lifecycle",
        }
    }
}

/// A finding that is known and forgiven.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AllowedFinding {
    pub(crate) at: YamlPlace,
    pub(crate) finding: super::FindingKind,
    pub(crate) name: Pattern,
    /// It does not hold for bags that begin at this time or later.
    pub(crate) until: Option<At<Stamp>>,
    pub(crate) why: String,
}
