//! Inferences from the observations of a mission: the evidence for each node, topic and edge.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::Arc;

use crate::bag::{Connection, Encoding};
use crate::base::ids::{ById, Few};
use crate::base::name::{LOGS, is_log, plain_type, with_spaces};
use crate::base::rhythm::CLOSE_NS;
use crate::base::time::{Span, Stamp};
use crate::evidence::message::dynamic::is_ros1_log;
use crate::evidence::observation::{
    Confidence, LoggedText, Name, Observation, ObservationRecord, Observations, SourceId,
};
use crate::evidence::times::{SeriesId, Stamps};
use crate::evidence::{SOURCES, source_word};

/// A connection of one of the bags.
#[derive(Clone, Debug)]
pub(crate) struct Stream {
    /// The index of the bag among the inputs.
    pub(crate) bag: usize,
    /// The connection as the reader announced it.
    pub(crate) connection: Connection,
    pub(crate) topic: Name,
    pub(crate) publisher: Option<Name>,
    /// Whether the last message stays valid after its time: latched (ROS 1) or transient local (ROS 2).
    pub(crate) latched: bool,
    /// The reliability of its publisher's name.
    pub(crate) trust: Reliability,
    /// The log times of its messages.
    pub(crate) times: SeriesId,
    /// Whether a part of the recording is read and all its messages are outside of it.
    pub(crate) is_outside: bool,
}

/// The reliability of the publisher that a header names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reliability {
    /// It published every message.
    Whole,
    /// It published the first message; the others may be from any node.
    First,
    /// It published every message, as far as other evidence shows.
    Likely,
    /// It published messages of the topic earlier, and ended before these.
    Gone,
    /// It played back messages that others published earlier.
    Player,
}

/// A node, a topic or an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ElementKey {
    Node(Name),
    Topic(Name),
    /// A node and a topic that it publishes.
    Publish(Name, Name),
    /// A topic and a node that subscribes to it.
    Subscribe(Name, Name),
}

/// What a node does with a topic, in words.
pub(crate) fn verb(publishes: bool) -> &'static str {
    if publishes {
        "publishes"
    } else {
        "subscribes to"
    }
}

impl ElementKey {
    /// A node publishes a topic, or subscribes to it.
    pub(crate) fn edge(publishes: bool, node: Name, topic: Name) -> Self {
        if publishes {
            Self::Publish(node, topic)
        } else {
            Self::Subscribe(topic, node)
        }
    }

    /// The node and the topic: both for an edge, otherwise one.
    pub(crate) fn ends(self) -> [Option<Name>; 2] {
        match self {
            Self::Node(node) => [Some(node), None],
            Self::Topic(topic) => [None, Some(topic)],
            Self::Publish(node, topic) | Self::Subscribe(topic, node) => [Some(node), Some(topic)],
        }
    }

    /// The same element with its names renumbered.
    pub(crate) fn renamed(self, to: &impl Fn(Name) -> Name) -> Self {
        match self {
            Self::Node(a) => Self::Node(to(a)),
            Self::Topic(a) => Self::Topic(to(a)),
            Self::Publish(a, b) => Self::Publish(to(a), to(b)),
            Self::Subscribe(a, b) => Self::Subscribe(to(a), to(b)),
        }
    }
}

/// The times during which an inference is valid.
#[derive(Debug)]
pub(crate) enum Validity {
    /// While there are messages of this stream.
    Messages(usize),
    /// At the first message of this stream.
    First(usize),
    /// From the first sign to the last; after an end only from the next sign on.
    Signs { signs: Vec<Stamp>, ends: Vec<Stamp> },
    /// From a beginning to the next end.
    Begins { signs: Vec<Stamp>, ends: Vec<Stamp> },
    /// At these moments; without other inferences, it is not known to last.
    Moments(Vec<Stamp>),
    /// As long as this other element exists.
    Like(ElementKey),
    /// For the whole mission, unless signs give times.
    Whole,
    /// From the first sign to the mission's end, for the recorder, which writes the bag.
    Unending,
    /// For the whole mission, regardless of signs.
    Always,
}

impl Validity {
    /// From this time to the next end.
    pub(crate) fn begin(time: Stamp) -> Self {
        Self::Begins {
            signs: vec![time],
            ends: Vec::new(),
        }
    }
}

/// A piece of evidence for an element.
#[derive(Debug)]
pub(crate) struct Inference {
    pub(crate) what: ElementKey,
    pub(crate) source: SourceId,
    pub(crate) confidence: Confidence,
    pub(crate) when: Validity,
}

impl Inference {
    /// Renumbers the names.
    pub(crate) fn rename(&mut self, to: &impl Fn(Name) -> Name) {
        self.what = self.what.renamed(to);
        if let Validity::Like(other) = &mut self.when {
            *other = other.renamed(to);
        }
    }
}

/// The publishers that only send outside of the part of the recording that is read: they may have stopped, or
/// not have started. Nodes that only send latched messages and logs may still be running.
fn gone(streams: &[Stream]) -> BTreeSet<Option<Name>> {
    let of = |is: &dyn Fn(&&Stream) -> bool| -> BTreeSet<Option<Name>> {
        streams.iter().filter(is).map(|s| s.publisher).collect()
    };
    let absent = of(&|s| s.is_outside && s.publisher.is_some());
    let speaking = of(&|s| !s.is_outside);
    let holding = of(&|s| s.latched);
    let repeating = of(&|s| !s.latched && !is_log(s.connection.topic.as_str()));
    let is_gone = |node: &Option<Name>| {
        !speaking.contains(node) && (repeating.contains(node) || !holding.contains(node))
    };
    absent.into_iter().filter(is_gone).collect()
}

/// Everything known about a mission once all bags are read, and the conclusions so far.
#[derive(Default)]
pub(crate) struct Conclusions<'a> {
    /// The source that concludes now: what is added is from it.
    pub(crate) source: SourceId,
    pub(crate) streams: &'a [Stream],
    /// The log times of the streams' messages.
    pub(crate) messages: Option<&'a Stamps>,
    pub(crate) facts: Observations,
    pub(crate) inferences: Vec<Inference>,
    /// Statements other than about which elements exist, by time for each element.
    pub(crate) incidents: Vec<Incident>,
    /// Inferences that were explained by their source, if `why` requests them.
    pub(crate) worded: BTreeSet<(ElementKey, SourceId)>,
    /// Publications whose messages are byte-for-byte copies of another topic's.
    pub(crate) copies: BTreeSet<(Name, Name)>,
    /// The mission's first and last moment.
    pub(crate) mission: (Stamp, Stamp),
    /// The publishers that may have stopped, or not have started, in the part of the recording that is read.
    pub(crate) gone: BTreeSet<Option<Name>>,
    /// The streams of each topic.
    recorded: ById<Name, Vec<usize>>,
    /// The number of publishers of each topic when its recording began.
    offers: ById<Name, u32>,
    /// The error of reading times, if any.
    pub(crate) failed: Option<io::Error>,
    publishers: ById<Name, BTreeSet<Name>>,
    subscribers: ById<Name, BTreeSet<Name>>,
    nodes: BTreeSet<Name>,
    closed: Option<Closed>,
}

impl<'a> Conclusions<'a> {
    pub(crate) fn new(
        streams: &'a [Stream],
        messages: &'a Stamps,
        facts: Observations,
        mission: (Stamp, Stamp),
    ) -> Self {
        let mut recorded: ById<Name, Vec<usize>> = ById::default();
        for (at, stream) in streams.iter().enumerate() {
            recorded.grown(stream.topic).push(at);
        }
        Self {
            mission,
            gone: gone(streams),
            recorded,
            offers: offers(&facts.offers, streams),
            streams,
            messages: Some(messages),
            facts,
            ..Self::default()
        }
    }

    /// Adds an inference.
    pub(crate) fn add(&mut self, what: ElementKey, confidence: Confidence, when: Validity) {
        let [node, _] = what.ends();
        self.nodes.extend(node);
        match what {
            ElementKey::Subscribe(topic, node) => {
                self.subscribers.grown(topic).insert(node);
            }
            ElementKey::Publish(node, topic) => {
                self.publishers.grown(topic).insert(node);
            }
            ElementKey::Node(_) | ElementKey::Topic(_) => {}
        }
        self.inferences.push(Inference {
            what,
            source: self.source,
            confidence,
            when,
        });
    }

    /// Adds an inference, with its explanation for `why`; `time` if it belongs to one.
    pub(crate) fn because(
        &mut self,
        what: ElementKey,
        confidence: Confidence,
        when: Validity,
        time: Option<Stamp>,
        words: impl FnOnce(&Self) -> String,
    ) {
        if self.facts.is_watched(what.ends()) {
            let text = words(self);
            self.worded.insert((what, self.source));
            self.facts.explain(self.source, confidence, time, text);
        }
        self.add(what, confidence, when);
    }

    /// Adds the inference of a rule, valid as long as `basis`, unless the element is known already or
    /// stronger evidence contradicts it.
    pub(crate) fn infer(
        &mut self,
        what: ElementKey,
        basis: ElementKey,
        words: impl FnOnce(&Self) -> String,
    ) {
        if !self.knows(what) && !self.denies(what) {
            let when = Validity::Like(basis);
            self.because(what, Confidence::Inferred, when, None, words);
        }
    }

    /// As [`Self::infer`] for a topic whose messages name no publisher: the node publishes it whenever there are
    /// messages.
    pub(crate) fn infer_publisher(
        &mut self,
        node: Name,
        topic: Name,
        words: impl Fn(&Self) -> String,
    ) {
        let what = ElementKey::Publish(node, topic);
        if self.knows(what) || self.denies(what) {
            return;
        }
        for at in self.recorded.of(topic).to_vec() {
            if self.streams[at].publisher.is_none() {
                let when = Validity::Messages(at);
                self.because(what, Confidence::Inferred, when, None, &words);
            }
        }
    }

    /// Whether there is an inference about this element already.
    pub(crate) fn knows(&self, what: ElementKey) -> bool {
        match what {
            ElementKey::Node(node) => self.nodes.contains(&node),
            ElementKey::Topic(topic) => self.is_recorded(topic),
            ElementKey::Publish(node, topic) => self.publishers(topic).any(|n| n == node),
            ElementKey::Subscribe(topic, node) => self.subscribers(topic).any(|n| n == node),
        }
    }

    /// Whether a complete list, or every message's own header, contradicts an edge.
    pub(crate) fn denies(&mut self, what: ElementKey) -> bool {
        self.closed(|closed| closed.lists_deny(what) || closed.headers_deny(what))
    }

    fn closed<T>(&mut self, ask: impl Fn(&Closed) -> T) -> T {
        let closed = match self.closed.take() {
            Some(closed) => closed,
            None => Closed::new(self),
        };
        let answer = ask(&closed);
        self.closed = Some(closed);
        answer
    }

    /// Whether a recording is of ROS 1, perhaps converted: by its log, otherwise by its encoding.
    pub(crate) fn is_ros1(&self) -> bool {
        let connections = || self.streams.iter().map(|stream| &stream.connection);
        let is_ros2 =
            |kind: &str| ["rcl_interfaces/Log", "rcl_interfaces/ParameterEvent"].contains(&kind);
        connections().any(|c| is_ros1_log(&c.type_name))
            || connections().any(|c| c.encoding == Encoding::Ros1)
                && self.topics_of(is_ros2).is_empty()
    }

    /// Whether a topic is the log of ROS 1, which a recorder receives its own records from only after it has subscribed to it.
    pub(crate) fn is_log1(&self, topic: Name) -> bool {
        let name = self.text(topic);
        LOGS.iter().any(|log| name.ends_with(log))
    }

    /// Whether a bag has a connection of this topic, even without messages.
    pub(crate) fn is_recorded(&self, topic: Name) -> bool {
        !self.recorded.of(topic).is_empty()
    }

    /// The type of a recorded topic in the form of ROS 1, without `/msg`; empty if no bag states it.
    pub(crate) fn kind(&self, topic: Name) -> String {
        let first = self.recorded.of(topic).first();
        first.map_or_else(String::new, |at| {
            plain_type(&self.streams[*at].connection.type_name).into_owned()
        })
    }

    /// The number of publishers of a topic when its recording began; `None` if unknown.
    pub(crate) fn offers(&self, topic: Name) -> Option<u32> {
        self.offers.get(topic).copied().filter(|many| *many > 0)
    }

    /// The known node that a logger belongs to: the one of its name, or the nearest above it in the namespaces.
    pub(crate) fn owner(&self, logger: &str) -> Option<Name> {
        let mut known = with_spaces(logger).filter_map(|name| self.facts.known(name));
        known.find(|name| self.nodes.contains(name))
    }

    /// The texts of loggers that belong to a node, sorted by time, each with the name of its node; none if not all were kept,
    /// since a node's last ones are asked for.
    pub(crate) fn logged(&self) -> Vec<LoggedText> {
        if self.facts.logged.is_cut() {
            return Vec::new();
        }
        let (mut said, _) = self.facts.logged.sorted();
        said.retain_mut(|text| {
            let node = self.owner(&text.logger);
            text.logger = node.map_or_else(|| "".into(), |node| self.text(node));
            node.is_some()
        });
        said
    }

    /// Whether headers name all publishers of a topic.
    pub(crate) fn is_reported(&self, topic: Name) -> bool {
        let mut streams = self.recorded.of(topic).iter().map(|at| &self.streams[*at]);
        let is_sure = |of: &Stream| of.publisher.is_some() && of.trust == Reliability::Whole;
        self.is_recorded(topic) && streams.all(is_sure)
    }

    /// Whether a node other than `node` names this topic as its own, as publisher or subscriber.
    pub(crate) fn named_by_others(&self, topic: Name, node: Name) -> bool {
        self.facts.list.iter().any(|fact| {
            matches!(fact.observation, Observation::Lists(n, t) | Observation::Publish(n, t) if t == topic && n != node)
        })
    }

    /// The nodes known so far to publish `topic`.
    pub(crate) fn publishers(&self, topic: Name) -> impl Iterator<Item = Name> + '_ {
        self.publishers.get(topic).into_iter().flatten().copied()
    }

    /// The publisher of a topic, if it is known to be a single one.
    pub(crate) fn only_publisher(&self, topic: Name) -> Option<Name> {
        let mut all = self.publishers(topic);
        all.next().filter(|_| all.next().is_none())
    }

    /// The nodes known so far to subscribe to `topic`.
    pub(crate) fn subscribers(&self, topic: Name) -> impl Iterator<Item = Name> + '_ {
        self.subscribers.get(topic).into_iter().flatten().copied()
    }

    /// All subscriptions known so far, as topic and node.
    pub(crate) fn subscriptions(&self) -> impl Iterator<Item = (Name, Name)> + '_ {
        let all = self.subscribers.with_ids();
        all.flat_map(|(topic, nodes)| nodes.iter().map(move |node| (topic, *node)))
    }

    /// All publications known so far, as node and topic.
    pub(crate) fn publications(&self) -> impl Iterator<Item = (Name, Name)> + '_ {
        let all = self.publishers.with_ids();
        all.flat_map(|(topic, nodes)| nodes.iter().map(move |node| (*node, topic)))
    }

    /// Every node known so far.
    pub(crate) fn nodes(&self) -> &BTreeSet<Name> {
        &self.nodes
    }

    /// The recorded topics whose type, without `/msg`, `fits` accepts, in the order of their names.
    pub(crate) fn topics_of(&self, fits: impl Fn(&str) -> bool) -> Vec<Name> {
        let connections = self.streams.iter().map(|s| (&s.connection, s.topic));
        let fitting = connections.filter(|(of, _)| fits(&plain_type(&of.type_name)));
        let mut topics: Vec<_> = fitting.map(|(of, topic)| (&of.topic, topic)).collect();
        topics.sort();
        topics.dedup();
        topics.into_iter().map(|(_, topic)| topic).collect()
    }

    /// Adds `what` by a convention: it exists as long as `basis`, unless a complete list omits it. Headers do
    /// not contradict it, as a topic published by convention is often silent.
    pub(crate) fn like(&mut self, what: ElementKey, basis: ElementKey) {
        if !self.closed(|closed| closed.settled_lists_deny(what)) {
            self.add(what, Confidence::Inferred, Validity::Like(basis));
        }
    }

    /// The names of all known nodes and loggers.
    pub(crate) fn names(&self) -> BTreeSet<Name> {
        let facts = self.facts.list.iter();
        let loggers = facts.filter_map(|fact| match fact.observation {
            Observation::Logger(name, _) => Some(name),
            _ => None,
        });
        loggers.chain(self.nodes.iter().copied()).collect()
    }

    /// The node for a name without its namespace: the only known one with this ending, otherwise one with
    /// exactly this name.
    pub(crate) fn meant(&self, node: Name) -> Name {
        let text = self.text(node);
        let names = self.names();
        let mut ending = names.iter().filter(|n| self.text(**n).ends_with(&*text));
        match (names.contains(&node), ending.next(), ending.next()) {
            (false, Some(only), None) => *only,
            _ => node,
        }
    }

    /// The times of the first and the last message of a stream.
    pub(crate) fn bounds(&self, stream: &Stream) -> Option<(Stamp, Stamp)> {
        self.messages?.bounds(stream.times)
    }

    /// The text of a name.
    pub(crate) fn text(&self, name: Name) -> Arc<str> {
        self.facts.text(name)
    }

    /// The observations of a source.
    pub(crate) fn observed(&self, source: SourceId) -> Vec<ObservationRecord> {
        let all = self.facts.list.iter().filter(|fact| fact.source == source);
        all.copied().collect()
    }

    /// The times at which a fact was observed, sorted; empty if they cannot be read, and the error is stored.
    pub(crate) fn times(&mut self, fact: &ObservationRecord) -> Vec<Stamp> {
        self.facts.times(fact).unwrap_or_else(|error| {
            self.failed = Some(error);
            Vec::new()
        })
    }
}

/// The largest number of publishers that offered each topic in one bag; 0 if unknown.
pub(crate) fn offers(of_streams: &ById<usize, u32>, streams: &[Stream]) -> ById<Name, u32> {
    let mut offers: ById<Name, u32> = ById::default();
    for (count, stream) in of_streams.iter().zip(streams) {
        let most = offers.grown(stream.topic);
        *most = (*most).max(*count);
    }
    offers
}

// Observations taken literally, with their times: signs, and ends by observations that revoke them.

impl Conclusions<'_> {
    /// All observations of the source that concludes now, with their signs and ends, sorted.
    pub(crate) fn observations(&mut self) -> Vec<(ObservationRecord, Vec<Stamp>, Vec<Stamp>)> {
        let endings = self.endings();
        let facts = self.observed(self.source).into_iter();
        let times = |fact: ObservationRecord| {
            let (signs, ends) = self.signs_and_ends(&fact, &endings);
            (fact, signs, ends)
        };
        facts.map(times).collect()
    }

    /// Adds the inferences that follow from single observations without a rule: nodes, topics, publications
    /// and subscriptions.
    pub(crate) fn take_at_their_word(&mut self) {
        let endings = self.endings();
        let facts = self.facts.list.iter();
        let many = |fact: &ObservationRecord| self.facts.times.count(fact.times);
        let records = facts.filter_map(|fact| match fact.observation {
            Observation::Node(node) => Some(((fact.source, node), many(fact))),
            _ => None,
        });
        let records: BTreeMap<(SourceId, Name), u64> = records.collect();
        for fact in self.facts.list.clone() {
            let what = match fact.observation {
                Observation::Node(node) | Observation::Begins(node) => ElementKey::Node(node),
                Observation::Topic(topic) => ElementKey::Topic(topic),
                Observation::Publish(node, topic) => ElementKey::Publish(node, topic),
                Observation::Subscribe(node, topic)
                | Observation::Joins(node, topic)
                | Observation::Refused(node, topic) => ElementKey::Subscribe(topic, node),
                _ => continue,
            };
            let (mut signs, ends) = self.signs_and_ends(&fact, &endings);
            if let Observation::Joins(node, topic) = fact.observation
                && let Some(refused) = endings.get(&Observation::Refused(node, topic))
            {
                signs.retain(|sign| !is_refused(*sign, refused));
            }
            if signs.is_empty() && matches!(fact.observation, Observation::Joins(..)) {
                continue;
            }
            // If every log record has the first number, sequence numbers are unused.
            if let Observation::Begins(node) = fact.observation
                && source_word(fact.source) == "rosout"
                && signs.len() > 1
                && records.get(&(fact.source, node)) == Some(&(signs.len() as u64))
            {
                continue;
            }
            let when = match fact.observation {
                Observation::Joins(..) | Observation::Begins(_) => Validity::Begins { signs, ends },
                Observation::Refused(..) => Validity::Moments(signs),
                _ => Validity::Signs { signs, ends },
            };
            self.source = fact.source;
            self.add(what, fact.confidence, when);
        }
    }

    /// The times at which observations were revoked, those of refusals and those of snapshots, sorted.
    fn endings(&mut self) -> BTreeMap<Observation, Vec<Stamp>> {
        let mut endings: BTreeMap<Observation, Vec<Stamp>> = BTreeMap::new();
        for fact in self.facts.list.clone() {
            if let Observation::NodeGone(_)
            | Observation::Unsubscribe(..)
            | Observation::Refused(..)
            | Observation::Snapshot(_) = fact.observation
            {
                let times = self.times(&fact);
                endings.entry(fact.observation).or_default().extend(times);
            }
        }
        for times in endings.values_mut() {
            times.sort_unstable();
        }
        endings
    }

    /// The times at which an observation was made, and at which it was revoked, sorted.
    fn signs_and_ends(
        &mut self,
        fact: &ObservationRecord,
        endings: &BTreeMap<Observation, Vec<Stamp>>,
    ) -> (Vec<Stamp>, Vec<Stamp>) {
        let mut signs = self.times(fact);
        let ending = match fact.observation {
            Observation::Node(node) => endings.get(&Observation::NodeGone(node)),
            Observation::Subscribe(node, topic)
            | Observation::Joins(node, topic)
            | Observation::SaysSubscribe(node, topic) => {
                endings.get(&Observation::Unsubscribe(node, topic))
            }
            _ => None,
        };
        let mut ends = ending.cloned().unwrap_or_default();
        if let Some(name) = fact.snapshot
            && let Some(taken) = endings.get(&Observation::Snapshot(name))
        {
            let mut absent = absences(&signs, taken);
            if SOURCES.get(fact.source).is_some_and(|source| source.holds) {
                hold(&mut signs, taken);
                hold(&mut absent, taken);
            }
            ends.extend(absent);
        }
        ends.sort_unstable();
        ends.dedup();
        (signs, ends)
    }
}

/// Extends snapshots that show an element to the last moments before the next ones.
fn hold(times: &mut Vec<Stamp>, snapshots: &[Stamp]) {
    let next = |time: &Stamp| snapshots.get(snapshots.partition_point(|t| t <= time));
    let last = times.iter().filter_map(next).map(|next| next.plus(-1));
    let last: Vec<Stamp> = last.collect();
    times.extend(last);
    times.sort_unstable();
    times.dedup();
}

/// The longest time from a client's connection to its refusal, in nanoseconds: both are logged together.
const REFUSED_NS: i64 = 1_000_000_000;

/// Whether a connection made at `time` was refused at once.
fn is_refused(time: Stamp, refusals: &[Stamp]) -> bool {
    let soon = |refusal: &Stamp| (0..=REFUSED_NS).contains(&refusal.since(time));
    refusals.iter().any(soon)
}

/// The snapshots that show an absence: the first and the last of each run without the observation. Both lists are sorted.
fn absences(signs: &[Stamp], snapshots: &[Stamp]) -> Vec<Stamp> {
    let mut absent = Vec::new();
    let mut from = 0;
    for sign in signs {
        let run = &snapshots[from..snapshots.partition_point(|t| t < sign).max(from)];
        absent.extend(run.first());
        absent.extend(run.last());
        from = snapshots.partition_point(|t| t <= sign);
    }
    absent.extend(snapshots.get(from));
    absent
}

// Edges known not to exist: a complete list of a node's edges omits them.

/// Complete lists of the topics that nodes publish and subscribe to, if there are any.
#[derive(Default)]
pub(crate) struct Closed {
    /// By node: all topics that a rospy node names as its own, or all that a snapshot of the graph shows for
    /// a node.
    all: Few<Name, BTreeSet<Name>>,
    /// By node: all topics that a roscpp node publishes.
    published: Few<Name, BTreeSet<Name>>,
    /// Nodes whose lists were repeated long after the first: a list made at a node's start may lack later topics.
    settled: BTreeSet<Name>,
    /// Topics on which every message names its publisher, with all these publishers.
    stated: Few<Name, BTreeSet<Name>>,
}

impl Closed {
    pub(crate) fn new(known: &Conclusions<'_>) -> Self {
        let mut closed = Self::default();
        let mut times: BTreeMap<Name, Span> = BTreeMap::new();
        for fact in &known.facts.list {
            let listed = fact.snapshot.is_some();
            if let Observation::Lists(node, _) | Observation::Publish(node, _) = fact.observation
                && let Some((first, last)) = known.facts.times.bounds(fact.times)
                && listed
            {
                let own = Span::new(first, last);
                let span = times.entry(node).or_insert(own);
                *span = span.hull(own);
            }
            match (fact.observation, source_word(fact.source)) {
                (Observation::Lists(node, topic), _)
                | (
                    Observation::Publish(node, topic) | Observation::Subscribe(node, topic),
                    "rosgraph",
                ) => {
                    closed.all.grown(node).insert(topic);
                }
                (Observation::Publish(node, topic), "rosout") if listed => {
                    closed.published.grown(node).insert(topic);
                }
                _ => {}
            }
        }
        let settled = times.iter().filter(|(_, span)| span.nanos() >= SETTLED_NS);
        closed.settled = settled.map(|(node, _)| *node).collect();
        let mut unnamed = Vec::new();
        for stream in known.streams {
            match stream.publisher {
                Some(node) if stream.trust == Reliability::Whole => {
                    closed.stated.grown(stream.topic).insert(node);
                }
                _ => unnamed.push(stream.topic),
            }
        }
        for topic in unnamed {
            closed.stated.grown(topic).clear();
        }
        closed
    }

    /// Whether every message of a topic names its publisher, and this node is never named.
    pub(crate) fn headers_deny(&self, what: ElementKey) -> bool {
        match what {
            ElementKey::Publish(node, topic) => lacks(&self.stated, topic, node),
            _ => false,
        }
    }

    /// Whether a complete list that was made long after its node's start omits this edge.
    pub(crate) fn settled_lists_deny(&self, what: ElementKey) -> bool {
        let node = match what {
            ElementKey::Publish(node, _) | ElementKey::Subscribe(_, node) => node,
            ElementKey::Node(_) | ElementKey::Topic(_) => return false,
        };
        self.settled.contains(&node) && self.lists_deny(what)
    }

    /// Whether a complete list omits this edge; false for nodes and topics.
    pub(crate) fn lists_deny(&self, what: ElementKey) -> bool {
        match what {
            ElementKey::Publish(node, topic) => {
                lacks(&self.all, node, topic) || lacks(&self.published, node, topic)
            }
            ElementKey::Subscribe(topic, node) => lacks(&self.all, node, topic),
            ElementKey::Node(_) | ElementKey::Topic(_) => false,
        }
    }
}

/// The time after a node's start at which it has made its connections, in nanoseconds; a list made
/// earlier may lack some. Nodes that wait for a map or a transform take three seconds; with less, their later topics would be denied.
const SETTLED_NS: i64 = 5_000_000_000;

/// Whether there is a list for `of` without `member`.
fn lacks(lists: &Few<Name, BTreeSet<Name>>, of: Name, member: Name) -> bool {
    let list = lists.get(of).filter(|list| !list.is_empty());
    list.is_some_and(|list| !list.contains(&member))
}

// Statements about the graph other than about which elements exist.

/// The kind of an incident, with what is stated about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum IncidentKind {
    /// A subscriber receives nothing, because this policy of its quality of service is incompatible; empty if none is named.
    Starved(Arc<str>),
    /// Two nodes have the same name.
    Duplicate,
    /// The recorder lost so many messages.
    Lost(u64),
    /// A node that forwarded the messages of one topic now forwards those of another.
    Switch(Name, Name),
}

/// A statement about an element.
#[derive(Debug, PartialEq)]
pub(crate) struct Incident {
    pub(crate) what: ElementKey,
    pub(crate) kind: IncidentKind,
    pub(crate) source: SourceId,
    pub(crate) time: Stamp,
    /// The time of the last statement of a run of equal ones.
    pub(crate) until: Option<Stamp>,
}

impl Conclusions<'_> {
    /// Adds an incident; one shortly after another of its kind about the same element is merged with it.
    pub(crate) fn incident(&mut self, what: ElementKey, kind: IncidentKind, time: Stamp) {
        let source = self.source;
        let own = |old: &&mut Incident| old.what == what && old.source == source;
        if let Some(last) = self.incidents.iter_mut().rev().find(own)
            && time.since(last.until.unwrap_or(last.time)) <= CLOSE_NS
        {
            let is_same = match (&mut last.kind, &kind) {
                (IncidentKind::Lost(all), IncidentKind::Lost(more)) => {
                    *all = all.saturating_add(*more);
                    true
                }
                (old, new) => old == new,
            };
            if is_same {
                last.until = Some(time).filter(|time| *time > last.time);
                return;
            }
        }
        self.incidents.push(Incident {
            what,
            kind,
            source,
            time,
            until: None,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_missing_in_a_snapshot_is_an_absence() {
        let stamps = |times: &[i64]| times.iter().map(|t| Stamp(*t)).collect::<Vec<_>>();
        let absent = absences(&stamps(&[4, 8]), &stamps(&[1, 2, 3, 4, 5, 6, 7, 8, 9]));
        assert_eq!(absent, stamps(&[1, 3, 5, 7, 9]));
        assert_eq!(absences(&stamps(&[1, 2]), &stamps(&[1, 2])), []);
    }
}
