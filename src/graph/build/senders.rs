//! How every sender sent on every topic over the whole mission: even stretches, pauses, first and last messages.

use std::collections::BTreeMap;
use std::io;

use super::tempo::stretches;
use crate::base::time::{Span, Stamp};
use crate::evidence::claim::Name;
use crate::evidence::collector::Recorded;
use crate::evidence::conclude::Findings;
use crate::evidence::proof::{Reliability, Stream};
use crate::graph::lives::Stretch;
use crate::graph::sending::{LongestPauses, SendingRuns, shortest_silence};

/// What happened on each topic.
pub(crate) type Traffic = BTreeMap<Name, Senders>;

/// Who sent on one topic.
#[derive(Debug)]
pub(crate) struct Senders {
    /// The places of the topic's streams.
    pub(crate) streams: Vec<usize>,
    /// The first and the last message of each stream; `None` if it has none.
    pub(crate) traces: Vec<Option<(Stamp, Stamp)>>,
    /// What each sender sent: those that are known, sorted, after the unknown ones together.
    pub(crate) list: Vec<Sender>,
    /// The place of each stream's sender among those.
    pub(crate) of: Vec<usize>,
    /// When anybody sent.
    pub(crate) sending: Vec<Span>,
    /// The longest times in which nobody did.
    pub(crate) pauses: Vec<Span>,
}

/// What one sender sent on one topic, over all its streams: a split recording has one per part.
#[derive(Debug)]
pub(crate) struct Sender {
    /// `None` for all who are not known.
    pub(crate) node: Option<Name>,
    pub(crate) latched: bool,
    pub(crate) stretches: Vec<Stretch>,
    /// When it sent, as figures show it.
    pub(crate) sending: Vec<Span>,
}

/// The node that is believed to have sent the messages of a stream.
pub(crate) fn sender(stream: &Stream) -> Option<Name> {
    stream
        .speaker
        .filter(|_| stream.trust != Reliability::First)
}

/// Listens to every topic once.
pub(crate) fn traffic(recorded: &Recorded, findings: &Findings) -> io::Result<Traffic> {
    let mut streams: BTreeMap<Name, Vec<usize>> = BTreeMap::new();
    for (at, stream) in findings.streams.iter().enumerate() {
        streams.entry(stream.topic).or_default().push(at);
    }
    let of_topic = |(topic, of): (Name, Vec<usize>)| Ok((topic, senders(recorded, findings, of)?));
    streams.into_iter().map(of_topic).collect()
}

/// Listens to some streams, which together are one topic.
fn senders(recorded: &Recorded, findings: &Findings, streams: Vec<usize>) -> io::Result<Senders> {
    let of_topic: Vec<&Stream> = streams.iter().map(|at| &findings.streams[*at]).collect();
    let ids: Vec<_> = of_topic.iter().map(|stream| stream.times).collect();
    let least = shortest_silence(recorded.span.map_or(0, |span| span.nanos()));
    let mut traces: Vec<Option<(Stamp, Stamp)>> = vec![None; streams.len()];
    let (of, mut heard) = places(&of_topic);
    let (mut all, mut pauses) = (SendingRuns::default(), LongestPauses::default());
    recorded.messages.merge(&ids, |timed| {
        if !recorded.believes(timed.time) {
            return;
        }
        let trace = &mut traces[timed.series];
        *trace = Some((trace.map_or(timed.time, |t| t.0), timed.time));
        all.hear(timed.time, least);
        pauses.hear(timed.time);
        heard[of[timed.series]].hear(timed.time, least);
    })?;
    Ok(Senders {
        streams,
        traces,
        list: heard.into_iter().map(SenderTimes::into_sender).collect(),
        of,
        sending: all.stretches(),
        pauses: pauses.spans(),
    })
}

/// What is heard of one sender.
struct SenderTimes {
    node: Option<Name>,
    latched: bool,
    runs: SendingRuns,
    times: Vec<Stamp>,
    /// Of so many messages one is kept, unless it comes late.
    every: usize,
    passed: usize,
}

/// The most times kept per sender (32 MB); of more, every second goes.
const MOST_TIMES: usize = 1 << 22;
/// A message after so much silence is kept in any case, and the one before it.
const LATE_NS: i64 = 500_000_000;

impl SenderTimes {
    fn hear(&mut self, time: Stamp, least: i64) {
        self.runs.hear(time, least);
        let late = self
            .times
            .last()
            .is_none_or(|last| time.since(*last) > LATE_NS);
        self.passed += 1;
        if !late && self.passed < self.every {
            return;
        }
        self.passed = 0;
        self.times.push(time);
        if self.times.len() > MOST_TIMES {
            self.every *= 2;
            let mut kept = false;
            self.times.retain(|_| {
                kept = !kept;
                kept
            });
        }
    }

    fn into_sender(self) -> Sender {
        let mut stretches = stretches(&self.times);
        for stretch in &mut stretches {
            stretch.count = (stretch.count - 1) * self.every as u64 + 1;
            stretch.period /= i64::try_from(self.every).unwrap_or(i64::MAX);
        }
        Sender {
            node: self.node,
            latched: self.latched,
            stretches,
            sending: self.runs.stretches(),
        }
    }
}

/// The sender of each stream, and what is heard of each sender: nothing yet.
fn places(streams: &[&Stream]) -> (Vec<usize>, Vec<SenderTimes>) {
    let mut latched: BTreeMap<Option<Name>, bool> = BTreeMap::new();
    for stream in streams {
        *latched.entry(sender(stream)).or_insert(true) &= stream.latched;
    }
    let place = |stream: &&Stream| latched.range(..sender(stream)).count();
    let places = streams.iter().map(place).collect();
    let heard = latched.iter().map(|(node, latched)| SenderTimes {
        node: *node,
        latched: *latched,
        runs: SendingRuns::default(),
        times: Vec::new(),
        every: 1,
        passed: 0,
    });
    (places, heard.collect())
}
