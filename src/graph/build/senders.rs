//! The messages of every sender on every topic over the whole mission: even stretches, pauses, first and last
//! messages.

use std::collections::BTreeMap;
use std::io;

use super::recordings::recordings;
use super::tempo::stretches;
use crate::base::error::Result;
use crate::base::name::is_feedback;
use crate::base::time::{Span, Stamp};
use crate::evidence::collector::{Recorded, spool_error};
use crate::evidence::conclude::Findings;
use crate::evidence::inference::{Reliability, Stream};
use crate::evidence::observation::Name;
use crate::graph::history::{LongestPauses, Stretch};

/// The senders of each topic.
pub(crate) type Traffic = BTreeMap<Name, Senders>;

/// The senders of one topic.
#[derive(Debug)]
pub(crate) struct Senders {
    /// The indices of the topic's streams, sorted.
    pub(crate) streams: Vec<usize>,
    /// The first and the last message of each stream; `None` without messages.
    pub(crate) traces: Vec<Option<(Stamp, Stamp)>>,
    /// The messages of each sender: first the unknown ones together, then the known ones, sorted.
    pub(crate) list: Vec<Sender>,
    /// The index of each stream's sender in `list`.
    pub(crate) of: Vec<usize>,
    /// The longest pauses of all senders together.
    pub(crate) pauses: Vec<Span>,
}

impl Senders {
    /// The place of a stream among those of the topic; there is one per file of a split recording.
    pub(crate) fn place(&self, stream: usize) -> Option<usize> {
        self.streams.binary_search(&stream).ok()
    }
}

/// The messages of one sender on one topic, over all its streams: a split recording has one per part.
#[derive(Debug)]
pub(crate) struct Sender {
    /// The node; `None` for all unknown senders together.
    pub(crate) node: Option<Name>,
    pub(crate) latched: bool,
    pub(crate) stretches: Vec<Stretch>,
    /// The first and the last moment of its recordings.
    pub(crate) recording: (Stamp, Stamp),
}

/// The node that sent the messages of a stream, if its name is reliable enough.
pub(crate) fn sender(stream: &Stream) -> Option<Name> {
    stream
        .publisher
        .filter(|_| !matches!(stream.trust, Reliability::First | Reliability::Gone))
}

/// Reads the times of every topic once.
pub(crate) fn traffic(recorded: &Recorded, findings: &Findings) -> Result<Traffic> {
    let recordings = recordings(recorded, &findings.streams);
    let mut streams: BTreeMap<Name, Vec<usize>> = BTreeMap::new();
    for (at, stream) in findings.streams.iter().enumerate() {
        streams.entry(stream.topic).or_default().push(at);
    }
    let of_topic = |(topic, of): (Name, Vec<usize>)| {
        Ok((topic, senders(recorded, findings, &recordings, of)?))
    };
    let all: io::Result<Traffic> = streams.into_iter().map(of_topic).collect();
    all.map_err(spool_error)
}

/// Reads the times of some streams, which together are one topic.
fn senders(
    recorded: &Recorded,
    findings: &Findings,
    recordings: &[Option<(Stamp, Stamp)>],
    streams: Vec<usize>,
) -> io::Result<Senders> {
    let of_topic: Vec<&Stream> = streams.iter().map(|at| &findings.streams[*at]).collect();
    let ids: Vec<_> = of_topic.iter().map(|stream| stream.times).collect();
    let mut traces: Vec<Option<(Stamp, Stamp)>> = vec![None; streams.len()];
    let (of, mut received) = places(&of_topic, recordings);
    let mut pauses = LongestPauses::default();
    recorded.messages.merge(&ids, |timed| {
        let trace = &mut traces[timed.series];
        *trace = Some((trace.map_or(timed.time, |t| t.0), timed.time));
        pauses.add(timed.time);
        received[of[timed.series]].add(timed.time);
    })?;
    let mut list: Vec<Sender> = received.into_iter().map(SenderTimes::into_sender).collect();
    let topic = of_topic.first().map(|stream| &stream.connection.topic);
    if topic.is_some_and(|topic| is_feedback(topic.as_str())) {
        let stretches = list.iter_mut().flat_map(|sender| &mut sender.stretches);
        stretches.for_each(|stretch| stretch.is_even = false);
    }
    Ok(Senders {
        streams,
        traces,
        list,
        of,
        pauses: pauses.spans(),
    })
}

/// The times of one sender.
struct SenderTimes {
    node: Option<Name>,
    latched: bool,
    times: Vec<Stamp>,
    recording: (Stamp, Stamp),
    /// One of this many messages is kept, and every late one.
    every: usize,
    passed: usize,
}

/// The most times kept per sender (32 MB); of more, every second one is dropped.
const MOST_TIMES: usize = 1 << 22;
/// The silence after which a message is kept in any case, and the one before it, in nanoseconds.
const LATE_NS: i64 = 500_000_000;

impl SenderTimes {
    fn add(&mut self, time: Stamp) {
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
            recording: self.recording,
        }
    }
}

/// The streams of one sender together.
struct Together {
    latched: bool,
    /// The first and the last moment of its recordings that are not empty.
    recording: Option<(Stamp, Stamp)>,
}

/// The index of each stream's sender, and the senders without times yet.
fn places(
    streams: &[&Stream],
    recordings: &[Option<(Stamp, Stamp)>],
) -> (Vec<usize>, Vec<SenderTimes>) {
    let mut senders: BTreeMap<Option<Name>, Together> = BTreeMap::new();
    for stream in streams {
        let together = senders.entry(sender(stream)).or_insert(Together {
            latched: true,
            recording: None,
        });
        together.latched &= stream.latched;
        if let Some(own) = recordings[stream.bag] {
            let all = together.recording.get_or_insert(own);
            *all = (all.0.min(own.0), all.1.max(own.1));
        }
    }
    let places: BTreeMap<Option<Name>, usize> = senders.keys().copied().zip(0..).collect();
    let places = streams
        .iter()
        .map(|stream| places[&sender(stream)])
        .collect();
    let received = senders.iter().map(|(node, together)| SenderTimes {
        node: *node,
        latched: together.latched,
        recording: together.recording.unwrap_or((Stamp::MIN, Stamp::MAX)),
        times: Vec::new(),
        every: 1,
        passed: 0,
    });
    (places, received.collect())
}
