//! The kinds of findings, each a row in [`KINDS`]; and one finding.

use std::collections::BTreeMap;
use std::fmt;

use crate::base::digest;
use crate::base::time::{Span, Stamp};
use crate::base::words::visible;
use crate::base::words::worded;
use crate::base::yaml::YamlPlace;

/// A kind of finding in [`KINDS`].
pub(crate) struct KindRow {
    pub(crate) kind: FindingKind,
    pub(crate) word: &'static str,
    /// The key in the file that it is about; empty for the element itself, or for none.
    pub(crate) key: &'static str,
    /// The class in charts of the node or topic that it is about; empty if it is about neither.
    pub(crate) class: &'static str,
    pub(crate) meaning: &'static str,
    /// How it is decided.
    pub(crate) more: &'static str,
}

/// The kinds of findings: the word, the key, the class, the meaning, and how it is decided.
macro_rules! kinds {
    ($($kind:ident $word:literal $key:literal $class:literal: $meaning:literal, $more:literal;)+) => {
        /// A kind of finding.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum FindingKind {
            $(#[doc = $meaning] $kind,)+
        }

        /// All kinds in order.
        pub(crate) const KINDS: &[KindRow] = &[$(KindRow {
            kind: FindingKind::$kind,
            word: $word,
            key: $key,
            class: $class,
            meaning: $meaning,
            more: $more,
        },)+];
    };
}

kinds! {
    NodeMissing "node-missing" "" "gone":
        "An expected node is not in the bag.",
        "Any evidence counts except source code and launch files, under the node's name or its role (anonymous suffixes \
         folded). Undecidable if the bag names no node or only those that wrote a log, if a tool has merged its senders, for \
         nodes with `known_by: log`, and if the recorder of a ROS 2 bag seems to have started late: more nodes are missing \
         than are named. `optional: true` requires nothing.";
    NodeForbidden "node-forbidden" "" "new":
        "A forbidden node is in the bag.",
        "Written as `forbidden: true`, mostly for a pattern such as `/debug/*`.";
    NodeLate "node-late" "within" "changed":
        "A node appeared later, or earlier, than it should have.",
        "`within: 40s..1:10` counts from the first message; `within: 20s` is short for `within: ..20s`. Undecidable where the node may have existed before its \
         first sign.";
    NodeGone "node-gone" "may_end" "gone":
        "A node ended before the mission did.",
        "An expected node is expected to stay. Its end is inferred from regular messages that stopped for good, or stated by a log or snapshot; the last 5 s, in which robots are shut down, do not count. `may_end: true` permits an end at any time, `may_end: 1:30..` from then on.";
    NodeRestarted "node-restarted" "restarts" "changed":
        "A node restarted more or less often than allowed.",
        "`restarts: ..0`. A restart is detected by sequence numbers, a new process, or a new anonymous name of the same role.";
    NodeLifecycle "node-lifecycle" "lifecycle" "changed":
        "A node is in another lifecycle state at the end.",
        "`lifecycle: active`. Undecidable without the node's transition events.";
    TopicMissing "topic-missing" "" "gone":
        "An expected topic is not in the bag.",
        "A topic is present if it has messages or a publisher; with `hz`, `mean_hz`, `max_gap` or `within` it must have \
         messages. `optional: true` requires nothing.";
    TopicForbidden "topic-forbidden" "" "new":
        "A forbidden topic is in the bag.",
        "Written as `forbidden: true`, mostly for a pattern.";
    TopicType "topic-type" "type" "changed":
        "A topic has another type than expected.",
        "`type: sensor_msgs/LaserScan`, or a list of several; the `/msg/` of ROS 2 makes no difference.";
    TopicQos "topic-qos" "qos" "changed":
        "A topic is offered with another quality of service.",
        "`qos: reliable` requires each of its words; `latched: true` requires a latched last message. Undecidable where \
         the bag does not record it.";
    TopicRateLow "topic-rate-low" "hz" "changed":
        "A topic had fewer messages per second than expected.",
        "`hz: 13.5..16.5` is judged in every whole window from the topic's first message to the mission's end, `percent: \
         95` of them at least. One message more or less at the edge of a window is ignored. `mean_hz: 2..3` is judged from the \
         first to the last message, for topics with an uneven rate.";
    TopicRateHigh "topic-rate-high" "hz" "changed":
        "A topic had more messages per second than expected.",
        "As `topic-rate-low`, above the range.";
    TopicGap "topic-gap" "max_gap" "changed":
        "A topic was silent for longer than allowed.",
        "`max_gap: 0.5s` applies between any two messages, and from the last one to the end of the mission unless it `may_end`.";
    TopicLate "topic-late" "within" "changed":
        "A topic's first message came later, or earlier, than it should have.",
        "`within: 40s..1:10` counts from the first message of the bag. A message within 2.5 s of the recorder's start is never early: there may have been others before.";
    TopicGone "topic-gone" "may_end" "changed":
        "A topic ended too early.",
        "`may_end: 1:30..` lets a topic end from then on. The last 5 s, in which robots are shut down, do not count.";
    TopicAge "topic-age" "" "changed":
        "The messages of a topic were older than allowed when they arrived.",
        "`age: ..0.2s` is checked against the mean age in every window, from statistics or, where they are read, from the stamps \
         in headers. Undecidable in a bag without either.";
    TopicBytes "topic-bytes" "" "changed":
        "A topic had more, or fewer, bytes per second than allowed.",
        "`bytes: ..5MB/s` is checked in every window.";
    TopicDrops "topic-drops" "" "changed":
        "More messages of a topic were lost than allowed.",
        "`drops: ..0` is checked in every window, by the drops that statistics report. Undecidable in a bag without them.";
    PublisherMissing "publisher-missing" "by" "changed":
        "A node does not publish an expected topic.",
        "`by: [/a, /b]`. Undecidable where the publishers of the topic are unknown.";
    PublisherUnexpected "publisher-unexpected" "by" "changed":
        "A topic has a publisher that is not listed.",
        "`by: [/a]` names all of them; `policy: {unexpected_publishers: warn}` turns it into a warning. Only publishers that are \
         measured or stated count.";
    SubscriberMissing "subscriber-missing" "to" "changed":
        "A node does not subscribe to an expected topic.",
        "`to: [/a]` names some of them. Undecidable unless the bag lists subscribers: by `/rosgraph`, statistics, \
         discovery, or this node's log of its connections.";
    TooManyChanges "too-many-changes" "" "":
        "There were more, or fewer, changes than allowed.",
        "`during: -30s.., changes: ..0` counts the events that `bagreel events` prints.";
    UnexpectedNode "unexpected-node" "" "new":
        "A node in the bag is not in the file.",
        "Only with `policy: {unexpected_nodes: warn}` or `error`. Recorders and players never count.";
    UnexpectedTopic "unexpected-topic" "" "new":
        "A topic in the bag is not in the file.",
        "Only with `policy: {unexpected_topics: warn}` or `error`. Housekeeping such as `/rosout` never counts.";
    Starved "starved" "" "changed":
        "A subscriber receives nothing because it requests a higher quality of service than is offered.",
        "A warning wherever a log or `/rosgraph` reports it; `policy: {starved: error}` or `allow`.";
    DuplicateName "duplicate-name" "" "changed":
        "Two nodes have the same name.",
        "A warning wherever a log or `/rosgraph` reports it; `policy: {duplicate_names: error}` or `allow`.";
    MessagesLost "messages-lost" "" "changed":
        "The recorder lost messages, so that gaps and low rates may be its own.",
        "A warning wherever the recorder reports it; `policy: {messages_lost: error}` or `allow`.";
}

impl FindingKind {
    pub(crate) fn row(self) -> &'static KindRow {
        &KINDS[self as usize]
    }

    /// Its word.
    pub fn word(self) -> &'static str {
        self.row().word
    }

    /// The kind of a word.
    pub fn from_word(word: &str) -> Option<Self> {
        let row = KINDS.iter().find(|row| row.word == word);
        row.map(|row| row.kind)
    }

    /// Whether it is about a node rather than a topic or several elements.
    pub(crate) fn is_about_node(self) -> bool {
        matches!(self.word().split_once('-'), Some(("node", _) | (_, "node")))
    }
}

worded! {
    /// The severity of a finding, the worst first.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    #[non_exhaustive]
    pub enum Severity {
        /// The check fails.
        Error = "error",
        /// Reported; the check passes.
        Warning = "warning",
        /// Not observable in the bag.
        Unknown = "unknown",
    }
}

/// The cause of findings in the event log, by which they are grouped.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub struct Cause {
    /// The time at which it happened, if known.
    pub time: Option<Stamp>,
    /// The event as text: `/lidar stopped at 04:50`.
    pub text: String,
}

impl Cause {
    /// Whether it is about this name, so that findings about the name need not repeat it.
    pub(crate) fn is_about(&self, name: &str) -> bool {
        let rest = self.text.strip_prefix(name);
        rest.is_some_and(|rest| rest.starts_with(' '))
    }
}

/// One finding. Control characters in its texts are escaped.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Finding {
    /// Its kind.
    pub kind: FindingKind,
    /// Its severity.
    pub severity: Severity,
    /// The position of the expectation in the file.
    pub place: YamlPlace,
    /// The node or topic that it is about.
    pub name: String,
    /// The finding in one sentence.
    pub text: String,
    /// The observed value, in short.
    pub seen: String,
    /// The expected value.
    pub expected: String,
    /// The time range that it is about, if any.
    pub when: Option<Span>,
    /// Lines with details.
    pub details: Vec<String>,
    /// The cause, if known.
    pub cause: Option<Cause>,
    /// Hints for the user.
    pub help: Vec<String>,
    /// The name in the file that `baseline --update` would rewrite.
    pub accept: Option<String>,
    /// The number of earlier findings in the file with the same [`Self::fingerprint`] input.
    pub(crate) nth: usize,
    /// Whether the rest of a recording that is not over may resolve it.
    pub(crate) is_open: bool,
}

/// The text with its control characters escaped.
fn escaped(text: impl fmt::Display) -> String {
    visible(&text.to_string()).into_owned()
}

impl Finding {
    /// A finding about a name, of severity [`Severity::Error`].
    pub(crate) fn new(kind: FindingKind, name: &str, place: YamlPlace, text: String) -> Self {
        Self {
            kind,
            severity: Severity::Error,
            place,
            name: visible(name).into_owned(),
            text: escaped(text),
            seen: String::new(),
            expected: String::new(),
            when: None,
            details: Vec::new(),
            cause: None,
            help: Vec::new(),
            accept: None,
            nth: 0,
            is_open: false,
        }
    }

    /// A finding that is not observable, with the reason in its text.
    pub(crate) fn unknown(kind: FindingKind, name: &str, place: YamlPlace, text: String) -> Self {
        Self::new(kind, name, place, text).severe(Severity::Unknown)
    }

    /// The finding with another severity.
    pub(crate) fn severe(mut self, severity: Severity) -> Self {
        self.severity = severity;
        self
    }

    /// The finding with the observed and the expected value.
    pub(crate) fn saw(mut self, seen: impl fmt::Display, expected: impl fmt::Display) -> Self {
        self.seen = escaped(seen);
        self.expected = escaped(expected);
        self
    }

    /// The finding with its cause, if known.
    pub(crate) fn because(mut self, cause: Option<Cause>) -> Self {
        self.cause = cause;
        self
    }

    /// The finding with its time.
    pub(crate) fn at(mut self, when: Span) -> Self {
        self.when = Some(when);
        self
    }

    /// The finding with more lines.
    pub(crate) fn details<T: fmt::Display>(mut self, lines: impl IntoIterator<Item = T>) -> Self {
        self.details.extend(lines.into_iter().map(escaped));
        self
    }

    /// The finding with hints.
    pub(crate) fn hints<T: fmt::Display>(mut self, hints: impl IntoIterator<Item = T>) -> Self {
        self.help.extend(hints.into_iter().map(escaped));
        self
    }

    /// The sentence and all details, separated by `between`.
    pub(crate) fn reported(&self, between: &str) -> String {
        let mut all = vec![self.text.as_str()];
        all.extend(self.details.iter().map(String::as_str));
        all.join(between)
    }

    /// Twelve hex digits that are stable across runs and when lines of the file move.
    pub fn fingerprint(&self) -> String {
        let look = self.look();
        match self.nth {
            0 => digest::hex(&look, 12),
            nth => digest::hex(&format!("{look}\n{nth}"), 12),
        }
    }

    /// The part of it that is stable across runs: unexpected publishers are, numbers are not.
    fn look(&self) -> String {
        let who = match self.kind {
            FindingKind::PublisherUnexpected => self.seen.as_str(),
            _ => "",
        };
        let (kind, name, expected) = (self.kind.word(), &self.name, &self.expected);
        format!("{kind}\n{name}\n{expected}\n{who}")
    }
}

/// Numbers equal findings in file order, so that fingerprints are unique.
pub(crate) fn number<'a>(findings: impl Iterator<Item = &'a mut Finding>) {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for finding in findings {
        let count = seen.entry(finding.look()).or_default();
        finding.nth = *count;
        *count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_its_index_and_a_unique_name() {
        for (at, KindRow { kind, word, .. }) in KINDS.iter().enumerate() {
            assert_eq!(*kind as usize, at, "{word}");
            assert_eq!(FindingKind::from_word(word), Some(*kind));
            assert_eq!(kind.word(), *word);
        }
    }

    #[test]
    fn a_fingerprint_is_independent_of_lines_and_numbers() {
        let at = |line| YamlPlace { line, column: 1 };
        let one =
            Finding::new(FindingKind::TopicRateLow, "/scan", at(3), "a".to_owned()).saw("7", "9..");
        let two =
            Finding::new(FindingKind::TopicRateLow, "/scan", at(9), "b".to_owned()).saw("6", "9..");
        let other = Finding::new(FindingKind::TopicRateLow, "/scan2", at(3), "a".to_owned())
            .saw("7", "9..");
        assert_eq!(one.fingerprint(), two.fingerprint());
        assert_ne!(one.fingerprint(), other.fingerprint());
        assert_eq!(one.fingerprint().len(), 12);
        let mut twice = [one.clone(), two];
        number(twice.iter_mut());
        assert_eq!(twice[0].fingerprint(), one.fingerprint());
        assert_ne!(twice[0].fingerprint(), twice[1].fingerprint());
    }
}
