//! Recordings of one robot by several recorders: clocks that differ are corrected, and messages that another bag contains are left out.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use super::Reading;
use super::inputs::{affordable, given_offset, in_time, space_of};
use crate::bag::straight::{Seam, pass};
use crate::bag::{self, ConnectionId, Input, Message, OpenOptions, Sink};
use crate::base::error::Result;
use crate::base::ids::ById;
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::evidence::clock::{self, ClockOffset, NEAR_NS};
use crate::evidence::collector::{CollectOptions, Collector, Recorded, spool_error};
use crate::evidence::inference::Stream;
use crate::evidence::observation::Name;

/// The time that is compared in large bags, whose payloads are not read, in nanoseconds: messages of slow topics are in it, too.
const SAMPLE_NS: i64 = 10_000_000_000;

/// The messages that are left out since another bag contains them: by bag and connection, the times that the other covers.
pub(super) type Copies = ById<usize, BTreeMap<ConnectionId, Vec<Span>>>;

/// What a topic's messages in two bags have in common: its name, its publisher and its type.
type Key<'a> = (Name, Option<Name>, &'a str);

fn key(stream: &Stream) -> Key<'_> {
    let kind = &*stream.connection.type_name;
    (stream.topic, stream.publisher, kind)
}

/// The streams of each key by bag.
fn by_key(recorded: &Recorded) -> BTreeMap<Key<'_>, BTreeMap<usize, Vec<usize>>> {
    let mut all: BTreeMap<_, BTreeMap<usize, Vec<usize>>> = BTreeMap::new();
    for (at, stream) in recorded.streams.iter().enumerate() {
        let bags = all.entry(key(stream)).or_default();
        bags.entry(stream.bag).or_default().push(at);
    }
    all
}

/// The pairs of bags that recorded one robot, by all messages that were compared; in large bags, by a part of them.
pub(super) fn pairs(
    reading: &Reading,
    inputs: &[Input],
    recorded: &Recorded,
) -> Result<Vec<ClockOffset>> {
    let space = |bag: usize| space_of(reading, &inputs[bag]);
    let is_one = |pair: &&ClockOffset| pair.is_one_robot && space(pair.bag) == space(pair.other);
    let mut pairs: Vec<ClockOffset> = recorded.offsets.iter().filter(is_one).copied().collect();
    let is_unread =
        |at: &usize| !recorded.streams[*at].latched && recorded.facts.payloads.some(*at).is_none();
    let mut common: BTreeSet<[usize; 2]> = BTreeSet::new();
    let mut unread: BTreeSet<usize> = BTreeSet::new();
    for bags in by_key(recorded).values().filter(|bags| bags.len() > 1) {
        let own = bags.iter().filter(|(_, own)| own.iter().any(is_unread));
        for (bag, _) in own {
            let others = bags.keys().filter(|other| *other != bag);
            common.extend(others.map(|other| [*bag.min(other), *bag.max(other)]));
            unread.insert(*bag);
        }
    }
    let is_known = |bags: &[usize; 2]| {
        let of = |pair: &ClockOffset| [pair.other, pair.bag] == *bags;
        pairs.iter().any(of) || bags.iter().any(|bag| inputs[*bag].is_pipe())
    };
    common.retain(|bags| !is_known(bags));
    // A bag beside one whose payloads have been read is read whole, of two others the time that they share.
    let is_small = affordable(reading).payload_bytes > 0;
    let is_beside = |bags: &[usize; 2]| is_small && !bags.iter().all(|bag| unread.contains(bag));
    let (beside, apart): (Vec<_>, Vec<_>) = common.into_iter().partition(is_beside);
    let beside: BTreeSet<usize> = beside.into_iter().flatten().collect();
    let spans = spans(recorded);
    let shared = apart.into_iter().filter_map(|[one, other]| {
        let (first, second) = (spans.some(one)?, spans.some(other)?);
        let part = Span::new(first.start.max(second.start), first.end.min(second.end));
        (part.nanos() > NEAR_NS).then(|| (vec![one, other], Some(part)))
    });
    let whole = (!beside.is_empty()).then(|| (beside.into_iter().collect(), None));
    for (bags, part) in whole.into_iter().chain(shared) {
        let inputs: Vec<&Input> = bags.iter().map(|bag| &inputs[*bag]).collect();
        let sample = sample(reading, &inputs, part)?;
        let found = sample.offsets.iter().filter(|pair| pair.is_one_robot);
        pairs.extend(found.map(|pair| ClockOffset {
            bag: bags[pair.bag],
            other: bags[pair.other],
            ..*pair
        }));
    }
    pairs.sort_unstable_by_key(|pair| (pair.bag, pair.other));
    Ok(pairs)
}

/// The times that each bag covers.
pub(super) fn spans(recorded: &Recorded) -> ById<usize, Option<Span>> {
    let mut spans: ById<usize, Option<Span>> = ById::default();
    for stream in &recorded.streams {
        if let Some((first, last)) = recorded.messages.bounds(stream.times) {
            let own = Span::new(first, last.plus(1));
            let all = spans.grown(stream.bag).get_or_insert(own);
            *all = all.hull(own);
        }
    }
    spans
}

/// The messages of several bags compared: all, or those in the middle of an interval.
fn sample(reading: &Reading, inputs: &[&Input], span: Option<Span>) -> Result<Recorded> {
    let part = span.map(|span| {
        let from = span.start.plus((span.nanos() - SAMPLE_NS).max(0) / 2);
        Span::new(from, span.end.min(from.plus(SAMPLE_NS)))
    });
    let mut collector = Collector::new(CollectOptions {
        payload_bytes: u64::MAX,
        ..CollectOptions::default()
    });
    for input in inputs {
        let reader = bag::open(input, &OpenOptions::default())?;
        let mut progress = |_, _| {};
        let mut sink = collector.bag_in(&space_of(reading, input), &mut progress);
        in_time(reading, input, reader).read(part, &mut sink)?;
    }
    collector.finish()
}

/// Adds the offsets of recorders' clocks to a reading, except for bags for which one is given; returns them by bag, with notices.
pub(super) fn correct(
    reading: &mut Reading,
    pairs: &[ClockOffset],
    inputs: &[Input],
) -> (ById<usize, i64>, Vec<Notice>) {
    let mut shifts: ById<usize, i64> = ById::default();
    let mut notices = Vec::new();
    for of_bag in pairs.chunk_by(|a, b| a.bag == b.bag) {
        let pair = of_bag[0];
        let by = *shifts.grown(pair.other) - pair.ahead;
        if by.abs() > NEAR_NS && given_offset(reading, &inputs[pair.bag]).is_none() {
            *shifts.grown(pair.bag) = by;
            notices.push(apart(reading, &pair, inputs, true));
        }
    }
    for (bag, by) in shifts.with_ids().filter(|(_, by)| **by != 0) {
        reading.offsets.push((inputs[bag].given().into(), *by));
    }
    (shifts, notices)
}

/// The messages that are left out: of each topic those from the time of a bag that has more of them. What one recorder missed is
/// not taken from another.
pub(super) fn copies(
    recorded: &Recorded,
    pairs: &[ClockOffset],
    shifts: &ById<usize, i64>,
) -> Copies {
    let is_pair = |a, b| pairs.iter().any(|pair| [pair.other, pair.bag] == [a, b]);
    let spans = spans(recorded);
    let mut copies = Copies::default();
    for bags in by_key(recorded).values().filter(|bags| bags.len() > 1) {
        // Of a latched topic the first message counts, as it was there before.
        let rank = |bag: &usize| {
            let streams = || bags[bag].iter().map(|at| &recorded.streams[*at]);
            let bounds = streams().filter_map(|s| recorded.messages.bounds(s.times));
            let first = bounds.map(|(first, _)| first).min();
            let count: u64 = streams().map(|s| recorded.messages.count(s.times)).sum();
            let first = first.filter(|_| streams().all(|stream| stream.latched));
            (Reverse(first), count, Reverse(*bag))
        };
        for (bag, own) in bags {
            let is_better = |other: &&usize| {
                is_pair(*bag.min(other), *bag.max(other)) && rank(other) > rank(bag)
            };
            for other in bags.keys().filter(is_better) {
                let by = shifts.get(*other).copied().unwrap_or(0);
                let covered = spans.some(*other).map(|span| {
                    let (start, end) = (span.start.plus(by), span.end.plus(by));
                    Span::new(start.plus(-NEAR_NS), end.plus(NEAR_NS))
                });
                for at in own {
                    let id = recorded.streams[*at].connection.id;
                    copies.grown(*bag).entry(id).or_default().extend(covered);
                }
            }
        }
    }
    copies
}

/// Finds out whether the run after a seam repeats the messages before it.
pub(super) fn examine(
    reading: &Reading,
    input: &Input,
    (recorded, bag): (&Recorded, usize),
    seam: &mut Seam,
) -> Result<()> {
    let is_both = |s: &&Stream| {
        let before = seam.count_before(s.connection.id);
        s.bag == bag && before > 0 && recorded.messages.count(s.times) > before
    };
    let both = recorded.streams.iter().filter(is_both);
    let both: BTreeSet<ConnectionId> = both.map(|s| s.connection.id).collect();
    let span = Span::new(seam.after, seam.before.plus(1));
    let repeats = |all: &Recorded, bag: usize| {
        let is_both = |s: &Stream| s.bag == bag && both.contains(&s.connection.id);
        clock::repeats((&all.streams, &all.facts), span, is_both).map_err(spool_error)
    };
    if repeats(recorded, bag)? || repeats(&sample(reading, &[input], Some(span))?, 0)? {
        seam.repeated = both;
    }
    Ok(())
}

/// A sink that passes everything on but what another bag contains.
pub(super) struct Rest<'a> {
    sink: &'a mut dyn Sink,
    copies: Option<&'a BTreeMap<ConnectionId, Vec<Span>>>,
    /// The number of messages that were left out.
    pub(super) left_out: u64,
}

impl<'a> Rest<'a> {
    pub(super) fn new(sink: &'a mut dyn Sink, copies: &'a Copies, bag: usize) -> Self {
        Self {
            sink,
            copies: copies.get(bag).filter(|own| !own.is_empty()),
            left_out: 0,
        }
    }

    fn kept(&self, connection: ConnectionId, time: Stamp) -> Option<Stamp> {
        let spans = self.copies.and_then(|all| all.get(&connection));
        let is_copy = spans.is_some_and(|spans| spans.iter().any(|span| span.contains(time)));
        (!is_copy).then_some(time)
    }
}

impl Sink for Rest<'_> {
    fn behind(&mut self) -> Option<&mut dyn Sink> {
        Some(&mut *self.sink)
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        if self.copies.is_none() {
            self.sink.stamps(connection, stamps, sizes);
            return;
        }
        let kept = stamps.iter().map(|time| self.kept(connection, *time));
        let kept: Vec<Option<Stamp>> = kept.collect();
        self.left_out += pass(&mut *self.sink, connection, &kept, sizes);
    }

    fn message(&mut self, message: Message<'_>) {
        if self.kept(message.connection, message.time).is_some() {
            self.sink.message(message);
        }
    }
}

/// The notice about recorders whose clocks differ: by the messages that two of them recorded, or by all of them.
pub(super) fn apart(
    reading: &Reading,
    offset: &ClockOffset,
    inputs: &[Input],
    is_corrected: bool,
) -> Notice {
    let [own, other] = [offset.bag, offset.other].map(|at| inputs[at].name());
    let given = given_offset(reading, &inputs[offset.bag]).unwrap_or(0);
    let seconds = given.saturating_sub(offset.ahead) as f64 / 1e9;
    let length = words::duration(offset.ahead.saturating_abs());
    let side = if offset.ahead > 0 {
        "ahead of"
    } else {
        "behind"
    };
    let (why, then) = match offset.messages {
        0 => (
            "their first messages".to_owned(),
            "puts these together, if they are of one run",
        ),
        many => (
            words::count(many, "message") + " that both recorded",
            "corrects it",
        ),
    };
    let then = if is_corrected {
        format!("corrected; `--offset {own}=0s` leaves its times as they are")
    } else {
        format!("`--offset {own}={seconds:+.3}s` {then}")
    };
    let text =
        format!("the clock of `{own}` is {length} {side} that of `{other}` by {why}: {then}");
    let kind = match offset.messages {
        0 => NoticeKind::Apart,
        _ => NoticeKind::Note,
    };
    Notice::new(kind, text)
}
