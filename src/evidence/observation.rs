//! Observations that the messages of a mission make about its graph, with their source, strength and times.
//!
//! An observation is kept once per source with the times at which it was made, so that millions of repeated
//! messages take no more memory than their (compressed) times.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::io;
use std::sync::Arc;

use crate::base::budget;
use crate::base::ids::{ById, ids};
use crate::base::name::is_named;
use crate::base::time::{Span, Stamp};
use crate::base::words::worded;
use crate::evidence::source_word;
use crate::evidence::times::{SeriesId, Stamps};

worded! {
    /// The strength of evidence. Ordered: the stronger is the smaller.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
    pub enum Confidence {
        /// Messages of this very connection, or the middleware's own statistics.
        #[default]
        Measured = "measured",
        /// A statement: a log record's topic list, a graph snapshot, the user's own file.
        Stated = "stated",
        /// A convention: an action, a bond, every node publishes `/rosout`.
        Inferred = "inferred",
        /// Known from a header or metadata only.
        Declared = "declared",
    }
}

ids! {
    @pub(crate),
    /// The number of a text in the mission: the name of a node or topic, a type, a state.
    Name,
}

/// Declares the kinds of observations with the names in each.
macro_rules! observations {
    ($($(#[$about:meta])* $Kind:ident($($name:ident),+),)*) => {
        /// An observation of a source. The number of a name has no meaning: order by its text.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub(crate) enum Observation {
            $($(#[$about])* $Kind($(observations!(@$name)),+),)*
        }

        impl Observation {
            /// The same observation with its names renumbered.
            fn renamed(self, to: &impl Fn(Name) -> Name) -> Self {
                match self {
                    $(Self::$Kind($($name),+) => Self::$Kind($(to($name)),+),)*
                }
            }

            /// The first two names in the observation.
            pub(crate) fn names(self) -> [Option<Name>; 2] {
                match self {
                    $(Self::$Kind($($name),+) => first_two(&[$($name),+]),)*
                }
            }
        }
    };
    (@$name:ident) => { Name };
}

observations! {
    /// This node is running.
    Node(node),
    /// This node has just started.
    Begins(node),
    /// This node logs a record that is not its first.
    Continues(node),
    /// This node has ended.
    NodeGone(node),
    /// This topic exists.
    Topic(topic),
    /// A recorder of all topics has just seen this topic for the first time.
    Appears(topic),
    /// This node publishes this topic.
    Publish(node, topic),
    /// This node subscribes to this topic.
    Subscribe(node, topic),
    /// This node has just subscribed to this topic.
    Joins(node, topic),
    /// This node tried to subscribe to this topic, and was refused.
    Refused(node, topic),
    /// This node no longer subscribes to this topic.
    Unsubscribe(node, topic),
    /// This node names this topic as its own, as publisher or as subscriber.
    Lists(node, topic),
    /// Log records of the second node arrive over a connection that names the first as publisher.
    Carries(publisher, node),
    /// A logger of this name, which is a node or a part of one, logs to this topic.
    Logger(logger, topic),
    /// A status on this topic (second) is named after this node (first).
    Reports(node, topic),
    /// This node is in this lifecycle state.
    Lifecycle(node, state),
    /// This topic has this type.
    Type(topic, kind),
    /// This topic is offered with this quality of service.
    Quality(topic, quality),
    /// According to a log text, this logger's node publishes this topic.
    SaysPublish(logger, topic),
    /// According to a log text, this logger's node subscribes to this topic.
    SaysSubscribe(logger, topic),
    /// This logger logs from this source file (its own name, no folder).
    LogsFrom(logger, file),
    /// A log text of this logger reports that a subscriber of this topic of its node receives nothing because
    /// of this policy of the quality of service.
    Starves(logger, topic, policy),
    /// This node, or logger, receives nothing from a publisher of this topic because of this policy.
    Starved(node, topic, policy),
    /// Two nodes have this name.
    Duplicate(node),
    /// A client with this id calls this service.
    Calls(service, client),
    /// The recorder lost so many messages of this topic.
    Lost(topic, many),
    /// A snapshot was taken: observations that the source made in an earlier snapshot of the same name and not in this one
    /// have ended.
    Snapshot(name),
}

impl Observation {
    /// A node publishes a topic, or subscribes to it.
    pub(crate) fn edge(publishes: bool, node: Name, topic: Name) -> Self {
        if publishes {
            Self::Publish(node, topic)
        } else {
            Self::Subscribe(node, topic)
        }
    }
}

fn first_two(names: &[Name]) -> [Option<Name>; 2] {
    [names.first().copied(), names.get(1).copied()]
}

/// The index of a source in the table of sources.
pub(crate) type SourceId = usize;

/// An observation by one source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObservationRecord {
    pub(crate) observation: Observation,
    pub(crate) source: SourceId,
    pub(crate) confidence: Confidence,
    /// The snapshots that this observation belongs to, which end it when it is missing.
    pub(crate) snapshot: Option<Name>,
    /// The times at which it was made.
    pub(crate) times: SeriesId,
}

/// A piece of evidence, kept for `why`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EvidenceLine {
    /// The time; `None` for evidence that applies to the whole mission.
    pub time: Option<Stamp>,
    /// The word of the source.
    pub source: &'static str,
    /// The strength.
    pub confidence: Confidence,
    /// The statement, in one line; may contain any characters, so escape it in output.
    pub text: String,
}

/// Statistics of the messages of a topic in an interval: over one connection, or at one end of it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Measurement {
    /// The topic; `None`: the only one that the subscriber subscribes to.
    pub(crate) topic: Option<Name>,
    pub(crate) publisher: Option<Name>,
    pub(crate) subscriber: Option<Name>,
    /// The interval, half-open.
    pub(crate) span: Span,
    /// Whether the interval overlaps that of the report before: only its new part counts.
    pub(crate) is_rolling: bool,
    /// The number of messages over the connection, or at this end; `None` if another report counts them.
    pub(crate) delivered: Option<u64>,
    /// The number of messages from which jitter and age are computed.
    pub(crate) count: u64,
    pub(crate) drops: Option<u64>,
    pub(crate) bytes: Option<u64>,
    /// The standard deviation of the time between messages in nanoseconds.
    pub(crate) jitter_ns: Option<i64>,
    /// The mean age in nanoseconds.
    pub(crate) age_ns: Option<i64>,
}

/// All observations of a mission.
#[derive(Clone, Debug, Default)]
pub(crate) struct Observations {
    /// The names for which [`EvidenceLine`]s are kept; if empty, none are kept.
    pub(crate) watched: Vec<String>,
    pub(crate) pieces: Vec<EvidenceLine>,
    /// The header stamps of streams, by the streams' indices; log times are stored in place of sizes.
    pub(crate) headers: ById<usize, Option<SeriesId>>,
    /// The ages of messages by their header stamps, by the streams' indices; stored in place of sizes
    /// ([`age_of`]).
    pub(crate) ages: ById<usize, Option<SeriesId>>,
    /// Simulated times, by the indices of the streams of `/clock`, in milliseconds in place of sizes; and the last one with its bag.
    pub(crate) clocks: ById<usize, Option<SeriesId>>,
    pub(crate) clock: Option<(usize, Stamp)>,
    /// The last simulated time that was kept, with its stream and the time of its message.
    ticked: Option<(usize, Stamp, Stamp)>,
    /// The numbers of stamps in simulated time, by the streams' indices.
    pub(crate) simulated: BTreeMap<usize, u32>,
    /// Statistics, in the order in which they were read.
    pub(crate) measured: Vec<Measurement>,
    /// The hashes of payloads, by the streams' indices; stored in place of sizes.
    pub(crate) payloads: ById<usize, Option<SeriesId>>,
    /// The number of publishers that offer each stream, by the streams' indices; 0 if unknown.
    pub(crate) offers: ById<usize, u32>,
    /// Texts that nodes log, and texts in messages.
    pub(crate) logged: LoggedTexts,
    /// The namespaces of recordings; empty for one without.
    pub(crate) spaces: BTreeSet<String>,
    /// Nodes with a log record from a Python file, until their lists are interpreted.
    pub(crate) rospy: BTreeSet<Name>,
    ids: HashMap<Arc<str>, Name>,
    texts: ById<Name, Arc<str>>,
    /// The number of bytes of all texts.
    bytes: usize,
    places: HashMap<(Observation, SourceId, Option<Name>), usize>,
    pub(crate) list: Vec<ObservationRecord>,
    /// All times, which can be added until this is shared.
    pub(crate) times: Arc<Stamps>,
    /// The name that replaces all texts beyond the limit.
    overflow: Option<Name>,
    /// The number of observations beyond the limits.
    pub(crate) dropped: u64,
}

impl Observations {
    /// The same observations with a separate set of times, to which more can be added.
    ///
    /// # Errors
    /// As [`Stamps::since`].
    pub(crate) fn copy(&self) -> io::Result<Self> {
        Ok(Self {
            times: Arc::new(self.times.since(Stamp(i64::MIN))?),
            ..self.clone()
        })
    }

    /// The name of a text; the overflow name if the limit is reached.
    pub(crate) fn name(&mut self, text: &str) -> Name {
        if let Some(name) = self.ids.get(text) {
            return *name;
        }
        let bytes = self.bytes.saturating_add(text.len());
        if self.texts.len() >= budget::NAMES
            || text.len() > budget::NAME
            || bytes > budget::NAMES_BYTES
        {
            return self.overflow();
        }
        self.bytes = bytes;
        let text: Arc<str> = text.into();
        let name = self.texts.push(Arc::clone(&text));
        self.ids.insert(text, name);
        name
    }

    /// The name that replaces all texts beyond the limit; no observation about it is kept.
    fn overflow(&mut self) -> Name {
        let texts = &mut self.texts;
        *self.overflow.get_or_insert_with(|| texts.push("".into()))
    }

    /// The name of a known text.
    pub(crate) fn known(&self, text: &str) -> Option<Name> {
        self.ids.get(text).copied()
    }

    /// The text of a name.
    pub(crate) fn text(&self, name: Name) -> Arc<str> {
        let text = self.texts.get(name);
        text.map_or_else(|| "".into(), Arc::clone)
    }

    /// Adds an observation by `source`, at `time` if it has one; keeps its explanation if `why` requests its names.
    pub(crate) fn state(
        &mut self,
        source: SourceId,
        said: Statement,
        time: Option<Stamp>,
        words: impl FnOnce() -> String,
    ) {
        if self.is_watched(said.observation.names()) && self.pieces.len() < budget::EVIDENCE_LINES {
            let text: String = words().chars().take(budget::EVIDENCE_LINE).collect();
            if !text.is_empty() {
                self.explain(source, said.confidence, time, text);
            }
        }
        self.add(source, said, time);
    }

    /// Adds a piece of evidence, by `source`.
    pub(crate) fn explain(
        &mut self,
        source: SourceId,
        confidence: Confidence,
        time: Option<Stamp>,
        text: String,
    ) {
        self.pieces.push(EvidenceLine {
            time,
            source: source_word(source),
            confidence,
            text,
        });
    }

    /// Whether `why` requests an element with these names, or with this role.
    pub(crate) fn is_watched(&self, names: [Option<Name>; 2]) -> bool {
        let names = names.map(|name| name.map(|name| self.text(name)));
        let about = |asked: &String| names.iter().flatten().any(|name| is_named(name, asked));
        !self.watched.is_empty() && self.watched.iter().all(about)
    }

    /// Adds a header stamp of the stream at index `place`.
    pub(crate) fn header(&mut self, place: usize, stamp: Stamp, log_time: u32) {
        note(&mut self.times, &mut self.headers, place, (stamp, log_time));
    }

    /// Adds the age of a message of the stream at index `place`; an age of more than half an hour is ignored.
    pub(crate) fn age(&mut self, place: usize, time: Stamp, stamp: Stamp) {
        let micros = time.since(stamp).div_euclid(1000).saturating_add(AGE_0);
        if let Ok(age) = u32::try_from(micros) {
            note(&mut self.times, &mut self.ages, place, (time, age));
        }
    }

    /// Adds a simulated time of the stream at index `place` of a bag; a tick that goes on from one just before shows nothing.
    pub(crate) fn tick(&mut self, (place, bag): (usize, usize), time: Stamp, simulated: Stamp) {
        self.clock = Some((bag, simulated));
        let is_soon = |to: Stamp, from: Stamp| (0..TICK_NS).contains(&to.since(from));
        if let Some((at, real, other)) = self.ticked
            && at == place
            && is_soon(time, real)
            && is_soon(simulated, other)
        {
            return;
        }
        self.ticked = Some((place, time, simulated));
        // Steps are measured modulo 2^32 ms, which is 49 days.
        let millis = simulated.0.div_euclid(1_000_000).rem_euclid(1 << 32);
        let millis = u32::try_from(millis).unwrap_or_default();
        note(&mut self.times, &mut self.clocks, place, (time, millis));
    }

    /// Adds a statistic, up to the limit.
    pub(crate) fn measure(&mut self, measurement: Measurement) {
        if self.measured.len() < budget::MEASUREMENTS {
            self.measured.push(measurement);
        } else {
            self.dropped += 1;
        }
    }

    /// Adds the hash of a payload of the stream at index `place`.
    pub(crate) fn payload(&mut self, place: usize, time: Stamp, hash: u32) {
        note(&mut self.times, &mut self.payloads, place, (time, hash));
    }

    /// Finishes adding times.
    ///
    /// # Errors
    /// As [`Stamps::finish`].
    pub(crate) fn finish(&mut self) -> io::Result<()> {
        Arc::get_mut(&mut self.times).map_or(Ok(()), Stamps::finish)
    }

    /// Removes everything that messages at other times than these state.
    ///
    /// # Errors
    /// If the temporary file of times cannot be read or written.
    pub(crate) fn clip(&mut self, span: Span) -> io::Result<()> {
        let Some(times) = Arc::get_mut(&mut self.times) else {
            return Ok(());
        };
        let kept = self.payloads.iter().chain(&self.ages).chain(&self.clocks);
        for series in kept.flatten() {
            times.clip(*series, span)?;
        }
        let mut left = Vec::new();
        for fact in self.list.drain(..) {
            if times.clip(fact.times, span)? == 0 || times.count(fact.times) > 0 {
                left.push(fact);
            }
        }
        self.list = left;
        // They are places in the old list.
        self.places = HashMap::new();
        self.pieces
            .retain(|piece| piece.time.is_none_or(|time| span.contains(time)));
        self.logged.clip(span);
        Ok(())
    }

    /// Adds an observation by `source`, at `time` if it has one.
    pub(crate) fn add(&mut self, source: SourceId, said: Statement, time: Option<Stamp>) {
        if self.overflow.is_some() && said.observation.names().contains(&self.overflow) {
            self.dropped += 1;
            return;
        }
        let key = (said.observation, source, said.snapshot);
        let place = match self.places.get(&key) {
            Some(place) => *place,
            None if self.list.len() >= budget::OBSERVATIONS => {
                self.dropped += 1;
                return;
            }
            None => {
                let Some(times) = Arc::get_mut(&mut self.times).map(Stamps::series) else {
                    return;
                };
                self.list.push(ObservationRecord {
                    observation: said.observation,
                    source,
                    confidence: said.confidence,
                    snapshot: said.snapshot,
                    times,
                });
                self.places.insert(key, self.list.len() - 1);
                self.list.len() - 1
            }
        };
        let fact = &mut self.list[place];
        fact.confidence = fact.confidence.min(said.confidence);
        if let Some(times) = Arc::get_mut(&mut self.times) {
            times.add(fact.times, time.as_slice(), None);
        }
    }

    /// Finishes adding observations.
    pub(crate) fn seal(&mut self) {
        self.places = HashMap::new();
    }

    /// Numbers all names in the order of their texts; returns the new number of each old one.
    pub(crate) fn renumber(&mut self) -> ById<Name, Name> {
        let mut order: Vec<Name> = self.texts.ids().collect();
        order.sort_by(|a, b| self.texts[*a].cmp(&self.texts[*b]));
        let mut new = ById::like(&self.texts, Name(0));
        for (rank, old) in (0..).map(Name).zip(&order) {
            new[*old] = rank;
        }
        let to = |name: Name| new.get(name).copied().unwrap_or(name);
        let texts = order.iter().map(|old| Arc::clone(&self.texts[*old]));
        self.texts = texts.collect();
        self.overflow = self.overflow.map(to);
        let names = (0..).map(Name);
        self.ids = self.texts.iter().cloned().zip(names).collect();
        for fact in &mut self.list {
            fact.observation = fact.observation.renamed(&to);
            fact.snapshot = fact.snapshot.map(to);
        }
        for measured in &mut self.measured {
            measured.topic = measured.topic.map(to);
            measured.publisher = measured.publisher.map(to);
            measured.subscriber = measured.subscriber.map(to);
        }
        new
    }

    /// The texts of all names, by their numbers.
    pub(crate) fn into_texts(self) -> ById<Name, Arc<str>> {
        self.texts
    }

    /// The times at which a fact was observed, sorted.
    pub(crate) fn times(&self, fact: &ObservationRecord) -> io::Result<Vec<Stamp>> {
        self.times.times(fact.times)
    }
}

/// The shortest time between two simulated times that are kept, in nanoseconds: simulators send up to a thousand a second, and
/// pauses and steps last a second or more.
const TICK_NS: i64 = 20_000_000;
/// The number that means an age of 0, in microseconds: clocks may differ either way.
const AGE_0: i64 = 1 << 31;

/// The age of a number that [`Observations::age`] kept, in nanoseconds.
pub(crate) fn age_of(kept: u32) -> i64 {
    (i64::from(kept) - AGE_0) * 1000
}

/// Adds a time with its number to the series of a stream.
fn note(
    times: &mut Arc<Stamps>,
    series: &mut ById<usize, Option<SeriesId>>,
    place: usize,
    (time, number): (Stamp, u32),
) {
    if let Some(times) = Arc::get_mut(times) {
        let id = *series.grown(place).get_or_insert_with(|| times.series());
        times.add(id, &[time], Some(&[number]));
    }
}

/// An observation with everything that belongs to it except its source and time.
#[derive(Clone, Copy)]
pub(crate) struct Statement {
    pub(crate) observation: Observation,
    pub(crate) confidence: Confidence,
    pub(crate) snapshot: Option<Name>,
}

impl Statement {
    /// An observation outside of snapshots.
    pub(crate) fn new(observation: Observation, confidence: Confidence) -> Self {
        Self {
            observation,
            confidence,
            snapshot: None,
        }
    }
}

// Log texts of nodes and values of small messages, kept together so that a log text that repeats a message
// can be found. Bounded: beyond the limit, the first are kept.

/// A text of a logger.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct LoggedText {
    pub(crate) time: Stamp,
    pub(crate) logger: Arc<str>,
    pub(crate) text: Box<str>,
}

/// A value in a message of a stream.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ShownValue {
    pub(crate) time: Stamp,
    pub(crate) stream: usize,
    /// The index of the field in the message.
    pub(crate) field: usize,
    pub(crate) value: Box<str>,
}

/// The kept log texts and message values.
#[derive(Clone, Debug, Default)]
pub(crate) struct LoggedTexts {
    said: Vec<LoggedText>,
    shown: Vec<ShownValue>,
    /// The number of bytes of log texts and of values.
    bytes: [usize; 2],
}

/// The most bytes of log texts, and of values, that are kept: some ten thousand texts, more than an hour of talkative nodes. They are
/// compared with each other, which takes a tenth of a second for so many.
const MOST_TEXTS: usize = 2 << 20;
/// The overhead of a short text in bytes: its time, its logger and its allocation.
const TEXT_ENTRY: usize = 48;

impl LoggedTexts {
    /// Adds a log text.
    pub(crate) fn add(&mut self, time: Stamp, logger: &str, text: &str) {
        self.bytes[0] += text.len() + TEXT_ENTRY;
        if self.bytes[0] <= MOST_TEXTS {
            self.said.push(LoggedText {
                time,
                logger: logger.into(),
                text: text.into(),
            });
        }
    }

    /// Adds a value in a message.
    pub(crate) fn show(&mut self, time: Stamp, (stream, field): (usize, usize), value: &str) {
        self.bytes[1] += value.len() + TEXT_ENTRY;
        if self.bytes[1] <= MOST_TEXTS {
            self.shown.push(ShownValue {
                time,
                stream,
                field,
                value: value.into(),
            });
        }
    }

    /// Whether there were more log texts than are kept.
    pub(crate) fn is_cut(&self) -> bool {
        self.bytes[0] > MOST_TEXTS
    }

    /// Drops those at other times than these.
    pub(crate) fn clip(&mut self, span: Span) {
        self.said.retain(|text| span.contains(text.time));
        self.shown.retain(|value| span.contains(value.time));
    }

    /// Log texts and values, sorted; of values that a field repeats, only the first.
    pub(crate) fn sorted(&self) -> (Vec<LoggedText>, Vec<ShownValue>) {
        let (mut said, mut shown) = (self.said.clone(), self.shown.clone());
        said.sort_unstable();
        shown.sort_unstable();
        let mut last: BTreeMap<(usize, usize), Box<str>> = BTreeMap::new();
        shown.retain(|message| {
            let place = (message.stream, message.field);
            let before = last.insert(place, message.value.clone());
            before.is_none_or(|value| value != message.value)
        });
        (said, shown)
    }
}

#[cfg(test)]
mod tests {
    mod observations {
        use super::super::*;

        fn alive(node: Name) -> Statement {
            Statement::new(Observation::Node(node), Confidence::Stated)
        }

        #[test]
        fn names_beyond_the_budget_are_counted_and_left_out() {
            let mut observations = Observations::default();
            let long = "x".repeat(budget::NAME + 1);
            for k in 0..budget::NAMES + 10 {
                let node = observations.name(&format!("/n{k}"));
                observations.add(0, alive(node), None);
            }
            let node = observations.name(&long);
            observations.add(0, alive(node), None);
            assert_eq!(
                (observations.list.len(), observations.dropped),
                (budget::NAMES, 11)
            );
            observations.renumber();
            let node = observations.name("/one more");
            observations.add(0, alive(node), None);
            assert_eq!(observations.dropped, 12);
        }

        #[test]
        fn long_names_do_not_exhaust_memory() {
            let mut observations = Observations::default();
            for k in 0..1000 {
                observations.name(&format!("{k:060000}"));
            }
            assert!(observations.bytes <= budget::NAMES_BYTES);
            assert!(
                (500..600).contains(&observations.texts.len()),
                "{}",
                observations.texts.len()
            );
        }
    }

    mod texts {
        use super::super::*;

        #[test]
        fn repeated_field_values_are_kept_once() {
            let mut texts = LoggedTexts::default();
            for (time, value) in [(3, "b"), (1, "a"), (2, "a"), (4, "a")] {
                texts.show(Stamp(time), (0, 0), value);
            }
            let times: Vec<_> = texts.sorted().1.iter().map(|s| s.time.0).collect();
            assert_eq!(times, [1, 3, 4]);
        }

        #[test]
        fn either_side_is_bounded() {
            let mut texts = LoggedTexts::default();
            let long = "x".repeat(1 << 20);
            (0..9).for_each(|n| texts.add(Stamp(n), "/a", &long));
            texts.show(Stamp(0), (0, 0), "kept");
            let (said, shown) = texts.sorted();
            assert_eq!((said.len(), shown.len()), (1, 1));
        }
    }
}
