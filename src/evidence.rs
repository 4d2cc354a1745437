//! Who talks to whom, and how we know: one file per kind of proof, one row each in [`SOURCES`].
//!
//! A source reads messages whose layout it knows, or the announcement of a connection, or draws a conclusion from the
//! whole mission; what it finds are claims. `evidence.md` of the design tells where each rule comes from.

mod action;
mod bond;
mod connection;
mod diagnostics;
mod discovery;
mod dynamic_reconfigure;
pub(crate) mod equal_stamps;
mod lifecycle;
mod links;
mod metrics;
mod only_publisher;
mod parameter_events;
pub(crate) mod qos;
mod recorder;
mod rosgraph;
mod rosout;
mod rosout_ros2;
mod rosout_rule;
mod service_event;
mod statistics;
mod topic_statistics;

use crate::definition::{self, Fit, Shape};
use crate::facts::{Claim, Facts, Name, Said, SourceId};
pub use crate::facts::{Degree, Piece};
use crate::proof::{Known, Stream};
use crate::time::Stamp;
use crate::wire::{self, Cursor};

/// A kind of evidence.
pub struct Source {
    /// Its word in JSON.
    pub word: &'static str,
    /// What it reads, in one line.
    pub about: &'static str,
    /// The layouts of the messages that it reads.
    pub(crate) reads: &'static [(Shape, Read)],
    /// Whether what it claims holds until it is taken back, though nobody repeats it.
    pub(crate) lasting: bool,
    /// What the announcement of a connection says.
    pub(crate) announced: Option<fn(&mut Heard<'_>)>,
    /// What follows from the whole mission; run in the order of the rows.
    pub(crate) conclude: &'static [Conclude],
}

/// Draws a conclusion.
type Conclude = fn(SourceId, &mut Known<'_>);

/// A source that does nothing yet, for rows to fill in.
const NOTHING: Source = Source {
    word: "",
    about: "",
    reads: &[],
    lasting: false,
    announced: None,
    conclude: &[],
};

/// All kinds of evidence; a set of them ([`Evidence`]) holds at most 64.
pub const SOURCES: &[Source] = &[
    Source {
        word: "connection",
        about: "ROS 1 connection headers and MCAP channel metadata (`callerid`)",
        conclude: &[connection::conclude],
        ..NOTHING
    },
    Source {
        word: "statistics",
        about: "`/statistics` of ROS 1 (`rosgraph_msgs/TopicStatistics`)",
        reads: &[(statistics::SHAPE, statistics::read)],
        ..NOTHING
    },
    Source {
        word: "topic_statistics",
        about: "`/topic_statistics` of graph-monitor (`rosgraph_monitor_msgs/msg/TopicStatistics`)",
        reads: &[(topic_statistics::SHAPE, topic_statistics::read)],
        ..NOTHING
    },
    Source {
        word: "rosgraph",
        about: "`/rosgraph` of graph-monitor (`rosgraph_msgs/msg/Graph`, `rosgraph_monitor_msgs/msg/Graph`)",
        reads: &[
            (rosgraph::SHAPE, rosgraph::read),
            (rosgraph::OLD_SHAPE, rosgraph::read),
        ],
        lasting: true,
        ..NOTHING
    },
    Source {
        word: "discovery",
        about: "`ros_discovery_info` (`rmw_dds_common/msg/ParticipantEntitiesInfo`)",
        reads: &[(discovery::SHAPE, discovery::read)],
        lasting: true,
        ..NOTHING
    },
    Source {
        word: "lifecycle",
        about: "`<node>/transition_event` (`lifecycle_msgs/msg/TransitionEvent`)",
        reads: &[(lifecycle::SHAPE, lifecycle::read)],
        lasting: true,
        ..NOTHING
    },
    Source {
        word: "service_event",
        about: "`<service>/_service_event` of service introspection",
        reads: &[(service_event::SHAPE, service_event::read)],
        ..NOTHING
    },
    Source {
        word: "qos",
        about: "offered quality of service in ROS 2 recordings",
        announced: Some(qos::announced),
        conclude: &[qos::conclude],
        ..NOTHING
    },
    Source {
        word: "parameter_events",
        about: "`rcl_interfaces/msg/ParameterEvent`",
        reads: &[(parameter_events::SHAPE, parameter_events::read)],
        lasting: true,
        ..NOTHING
    },
    Source {
        word: "links",
        about: "log records of roscpp about its connections",
        reads: &[
            (definition::LOG, links::read),
            (definition::OLD_LOG, links::read),
        ],
        ..NOTHING
    },
    Source {
        word: "rosout",
        about: "log records of ROS 1 (`rosgraph_msgs/Log`) and ROS 2 (`rcl_interfaces/msg/Log`)",
        reads: &[
            (definition::LOG, rosout::read),
            (definition::OLD_LOG, rosout::read),
            (rosout_ros2::SHAPE, rosout_ros2::read),
        ],
        conclude: &[rosout::conclude, rosout_ros2::conclude],
        ..NOTHING
    },
    Source {
        word: "metrics",
        about: "`/statistics` of ROS 2 (`statistics_msgs/msg/MetricsMessage`)",
        reads: &[(metrics::SHAPE, metrics::read)],
        conclude: &[metrics::conclude],
        lasting: true,
        ..NOTHING
    },
    Source {
        word: "diagnostics",
        about: "status names of `diagnostic_msgs/DiagnosticArray`, and its aggregator",
        reads: &[
            (diagnostics::SHAPE, diagnostics::read),
            (diagnostics::SHAPE2, diagnostics::read),
        ],
        conclude: &[diagnostics::conclude],
        ..NOTHING
    },
    Source {
        word: "dynamic_reconfigure",
        about: "`<node>/parameter_descriptions` and `<node>/parameter_updates` of ROS 1",
        conclude: &[dynamic_reconfigure::conclude],
        ..NOTHING
    },
    Source {
        word: "action",
        about: "the topics of actions, and the clients in `actionlib_msgs/GoalStatusArray`",
        reads: &[(action::SHAPE, action::read)],
        conclude: &[action::conclude],
        ..NOTHING
    },
    Source {
        word: "bond",
        about: "topics of type `bond/Status`",
        conclude: &[bond::conclude],
        ..NOTHING
    },
    Source {
        word: "only_publisher",
        about: "messages that name no publisher, of topics that one node is known to publish",
        conclude: &[only_publisher::conclude],
        ..NOTHING
    },
    Source {
        word: "equal_stamps",
        about: "header stamps passed on from input to output (with `--infer stamps`)",
        conclude: &[equal_stamps::conclude],
        ..NOTHING
    },
    Source {
        word: "recorder",
        about: "the recorder subscribes everything recorded; its log records name its source file",
        reads: &[
            (definition::LOG, recorder::read),
            (definition::OLD_LOG, recorder::read),
        ],
        conclude: &[recorder::conclude],
        ..NOTHING
    },
    Source {
        word: "rosout_rule",
        about: "every node of ROS 1 publishes `/rosout`",
        conclude: &[rosout_rule::conclude],
        ..NOTHING
    },
    Source {
        word: "topology",
        about: "a file of the user's that states nodes and edges (CSV, YAML, DOT)",
        ..NOTHING
    },
    Source {
        word: "launch",
        about: "a launch file of the user's, which declares nodes",
        ..NOTHING
    },
];

/// What a source hears, and where its claims go.
pub(crate) struct Heard<'a> {
    pub(crate) facts: &'a mut Facts,
    pub(crate) stream: &'a Stream,
    /// The stream's place among all streams.
    pub(crate) place: usize,
    pub(crate) source: SourceId,
    /// When the message was recorded; `None` at an announcement.
    pub(crate) time: Option<Stamp>,
}

impl Heard<'_> {
    /// The handle on a text.
    pub(crate) fn name(&mut self, text: &str) -> Name {
        self.facts.name(text)
    }

    /// Takes down the sequence number of a message, which falls back when its publisher starts anew.
    pub(crate) fn sequence(&mut self, number: u32) {
        if let Some(time) = self.time {
            self.facts.sequence(self.place, time, number);
        }
    }

    /// Takes a claim down, made now, with the words it rests on.
    pub(crate) fn claim(&mut self, claim: Claim, degree: Degree, words: impl FnOnce() -> String) {
        let said = Said {
            claim,
            degree,
            snapshot: None,
        };
        self.say(said, words);
    }

    /// Takes a claim down that stands and falls with a snapshot.
    pub(crate) fn say(&mut self, said: Said, words: impl FnOnce() -> String) {
        let word = SOURCES.get(self.source).map_or("", |s| s.word);
        self.facts.explain(said, word, self.time, words);
        self.facts.add(self.source, said, self.time);
    }
}

/// A reader of one layout.
pub(crate) type Read = fn(&mut Heard<'_>, &mut Cursor<'_>) -> wire::Result<()>;

/// The sources that read a connection's messages, with how; and whether some source knows its type by another layout.
pub(crate) fn readers(stream: &Stream) -> (Vec<(SourceId, Read)>, bool) {
    let mut readers = Vec::new();
    let mut foreign = false;
    for (id, source) in SOURCES.iter().enumerate() {
        let fits = source
            .reads
            .iter()
            .map(|(shape, read)| (read, shape.fit(&stream.connection)));
        let known: Vec<_> = fits.filter(|(_, fit)| *fit != Fit::OtherType).collect();
        match known.iter().find(|(_, fit)| *fit == Fit::Same) {
            Some((read, _)) => readers.push((id, **read)),
            None => foreign |= !known.is_empty(),
        }
    }
    (readers, foreign)
}

/// A set of kinds of evidence: the places of rows in [`SOURCES`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Evidence(u64);

impl Evidence {
    /// No evidence.
    pub const NONE: Self = Self(0);

    /// The set of this one word; empty for a word that is no source of ours.
    pub fn of(word: &str) -> Self {
        SOURCES
            .iter()
            .position(|s| s.word == word)
            .map_or(Self::NONE, Self::row)
    }

    /// The set of this one row.
    pub(crate) fn row(source: SourceId) -> Self {
        let bit = u32::try_from(source).unwrap_or(u32::MAX);
        Self(1_u64.checked_shl(bit).unwrap_or(0))
    }

    /// Both together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether nothing is in it.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The words of all kinds, in the order of [`SOURCES`].
    pub fn all_words() -> impl Iterator<Item = &'static str> {
        SOURCES.iter().map(|source| source.word)
    }

    /// The words in it, in the order of [`SOURCES`].
    pub fn words(self) -> impl Iterator<Item = &'static str> {
        SOURCES
            .iter()
            .enumerate()
            .filter(move |(at, _)| self.0 >> at & 1 == 1)
            .map(|(_, source)| source.word)
    }
}
