//! Recordings of one robot by several recorders: clocks that differ are corrected, and messages that another bag contains are left out.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::io;

use super::Reading;
use super::inputs::{affordable, given_offset, in_time, space_of};
use crate::bag::straight::{Seam, pass};
use crate::bag::{self, ConnectionId, Input, Message, OpenOptions, Sink};
use crate::base::error::Result;
use crate::base::ids::ById;
use crate::base::name::is_log;
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::evidence::clock::{self, ClockOffset, NEAR_NS};
use crate::evidence::collector::{CollectOptions, Collector, Recorded, spool_error};
use crate::evidence::inference::Stream;
use crate::evidence::observation::Name;

/// The time that is compared in large bags, whose payloads are not read, in nanoseconds: messages of slow topics are in it, too.
const SAMPLE_NS: i64 = 10_000_000_000;
/// The most pairs of files that are compared for two split recordings: there may be one in which little was sent.
const SAMPLES: usize = 3;

/// The messages that are left out since another bag, or the same, contains them: by bag and connection, their times, sorted; an interval
/// without length is the second message at its time.
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
    parts: &[Vec<usize>],
) -> Result<Vec<ClockOffset>> {
    let space = |bag: usize| space_of(reading, &inputs[bag]);
    let is_one = |pair: &&ClockOffset| pair.is_one_robot && space(pair.bag) == space(pair.other);
    let mut pairs: Vec<ClockOffset> = recorded.offsets.iter().filter(is_one).copied().collect();
    let is_unread =
        |at: &usize| !recorded.streams[*at].latched && recorded.facts.payloads.some(*at).is_none();
    let known = pairs.iter().map(|pair| [pair.other, pair.bag]);
    let known: BTreeSet<_> = known.flat_map(|[a, b]| [[a, b], [b, a]]).collect();
    let mut part = vec![0; inputs.len()];
    for (at, bags) in parts.iter().enumerate() {
        for bag in bags {
            part[*bag] = at;
        }
    }
    let spans = spans(recorded);
    // Small bags are read whole, of large ones the time that two of them share.
    let is_small = affordable(reading).payload_bytes > 0;
    let (mut small, mut large) = (BTreeSet::new(), BTreeMap::<_, BTreeMap<_, _>>::new());
    for bags in by_key(recorded).values() {
        let files = bags.keys().copied().filter(|bag| !inputs[*bag].is_pipe());
        let unread = files.clone().filter(|bag| bags[bag].iter().any(is_unread));
        let unread: BTreeSet<usize> = unread.collect();
        if is_small {
            let is_new = |one, other| one != other && !known.contains(&[one, other]);
            let mut unread = unread.iter();
            if unread.any(|one| files.clone().any(|other| is_new(*one, other))) {
                small.extend(files);
            }
        } else {
            let times = files.filter_map(|bag| Some((*spans.some(bag)?, bag)));
            for (pair, shared) in overlapping(times.collect()) {
                let is_new = pair.iter().any(|bag| unread.contains(bag)) && !known.contains(&pair);
                if shared.nanos() > NEAR_NS && is_new {
                    let pairs = large.entry(pair.map(|bag| part[bag])).or_default();
                    pairs.insert(pair, shared);
                }
            }
        }
    }
    let longest = |pairs: BTreeMap<[usize; 2], Span>| {
        let mut pairs: Vec<_> = pairs.into_iter().collect();
        pairs.sort_by_key(|(_, shared)| Reverse(shared.nanos()));
        pairs.truncate(SAMPLES);
        let pairs = pairs.into_iter();
        pairs.map(|(bags, shared)| (bags.to_vec(), Some(shared)))
    };
    let whole = (small.into_iter().collect(), None);
    let samples = std::iter::once(whole).chain(large.into_values().flat_map(longest));
    for (bags, part) in samples.filter(|(bags, _): &(Vec<usize>, _)| !bags.is_empty()) {
        let inputs: Vec<&Input> = bags.iter().map(|bag| &inputs[*bag]).collect();
        let sample = sample(reading, &inputs, part)?;
        let found = sample.offsets.iter().filter(|pair| pair.is_one_robot);
        pairs.extend(found.map(|pair| ClockOffset {
            bag: bags[pair.bag],
            other: bags[pair.other],
            ..*pair
        }));
    }
    // The clock of a recorder is that of all parts into which it splits its recording; parts that have little in common may agree by chance.
    let mut best: BTreeMap<[usize; 2], (usize, i64)> = BTreeMap::new();
    for pair in &pairs {
        let (one, other) = (part[pair.bag], part[pair.other]);
        // Or of two recorders the one whose clock is so far ahead that its recording seems to be the next part.
        if one == other {
            pairs.sort_unstable_by_key(|pair| (pair.bag, pair.other));
            return Ok(pairs);
        }
        for (key, ahead) in [([one, other], pair.ahead), ([other, one], -pair.ahead)] {
            let known = best.entry(key).or_default();
            *known = (*known).max((pair.messages, ahead));
        }
    }
    let mut all = BTreeMap::new();
    for ([one, other], (messages, ahead)) in best {
        let spans = &spans;
        let moved = |at: usize, by| {
            let bags = parts[at].iter();
            bags.filter_map(move |bag| Some((spans.some(*bag)?.moved(by), *bag)))
        };
        let beside = overlapping(moved(one, -ahead).chain(moved(other, 0)).collect());
        // By the first of the other's, the clock of a bag is corrected also at a time when the other did not record.
        let first = parts[other].iter().min().copied();
        let firsts = parts[one].iter().filter_map(|bag| Some([first?, *bag]));
        for [before, bag] in beside.into_iter().map(|of| of.0).chain(firsts) {
            if before < bag && [part[before], part[bag]] == [other, one] {
                let offset = ClockOffset {
                    bag,
                    other: before,
                    ahead,
                    messages,
                    is_one_robot: true,
                };
                all.insert((bag, before), offset);
            }
        }
    }
    Ok(all.into_values().collect())
}

/// The pairs of bags that recorded at one time, the one that was given first before the other, with that time.
fn overlapping(mut bags: Vec<(Span, usize)>) -> Vec<([usize; 2], Span)> {
    bags.sort_unstable_by_key(|(span, bag)| (span.start, *bag));
    let (mut open, mut pairs) = (Vec::<(Span, usize)>::new(), Vec::new());
    for (span, bag) in bags {
        open.retain(|(before, _)| before.end > span.start);
        pairs.extend(open.iter().map(|(before, other)| {
            let shared = Span::new(span.start, span.end.min(before.end));
            ([bag.min(*other), bag.max(*other)], shared)
        }));
        open.push((span, bag));
    }
    pairs
}

/// The messages that bags themselves contain twice, since recordings were merged; `seams`: where time goes back in each bag.
pub(super) fn merged(
    reading: &Reading,
    inputs: &[Input],
    recorded: &Recorded,
    seams: &[Vec<Seam>],
) -> Result<Copies> {
    let mut copies = Copies::default();
    let mut read: ById<usize, Vec<usize>> = ById::default();
    for (at, _) in recorded.facts.payloads.somes() {
        read.grown(recorded.streams[at].bag).push(at);
    }
    let all = inputs.iter().zip(seams).enumerate();
    for (bag, (input, seams)) in all.filter(|(_, (input, _))| !input.is_pipe()) {
        let sampled;
        let (all, of) = if seams.is_empty() || !read.of(bag).is_empty() {
            (recorded, read.of(bag).to_vec())
        } else {
            sampled = sample(reading, &[input], None)?;
            (&sampled, (0..sampled.streams.len()).collect())
        };
        let again = clock::merged((&all.streams, &all.facts), &of, seams.len());
        for (at, span) in again.map_err(spool_error)? {
            let of_bag = copies.grown(bag).entry(all.streams[at].connection.id);
            of_bag.or_default().push(span);
        }
    }
    Ok(copies)
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

/// Moves the times of copies with the clocks of their bags.
pub(super) fn moved(copies: &mut Copies, shifts: &ById<usize, i64>) {
    for (bag, by) in shifts.with_ids() {
        let spans = copies.grown(bag).values_mut().flatten();
        spans.for_each(|span| *span = span.moved(*by));
    }
}

/// The times between which the same of some bags were recording, with these bags; `spans`: the times that each bag covers.
fn parts<'a>(
    bags: impl Iterator<Item = &'a usize>,
    spans: &ById<usize, Option<Span>>,
) -> Vec<(Span, BTreeSet<usize>)> {
    // Those that begin or end at each time.
    let mut changes: BTreeMap<Stamp, BTreeSet<usize>> = BTreeMap::new();
    for (bag, span) in bags.filter_map(|bag| Some((*bag, spans.some(*bag)?))) {
        for edge in [span.start, span.end] {
            changes.entry(edge).or_default().insert(bag);
        }
    }
    let ends: Vec<Stamp> = changes.keys().skip(1).copied().collect();
    let mut here = BTreeSet::new();
    let parts = changes.into_iter().zip(ends);
    let part = |((start, changed), end)| {
        here = &here ^ &changed;
        (Span::new(start, end), here.clone())
    };
    parts.map(part).collect()
}

/// The messages that are left out: whenever several bags recorded a topic of one robot, those of all but the one with most of them then.
/// What that recorder missed is not taken from another.
pub(super) fn copies(
    recorded: &Recorded,
    pairs: &[ClockOffset],
    shifts: &ById<usize, i64>,
) -> Result<Copies> {
    let mut copies = Copies::default();
    if pairs.is_empty() {
        return Ok(copies);
    }
    let pairs: BTreeSet<[usize; 2]> = pairs.iter().map(|pair| [pair.other, pair.bag]).collect();
    let is_pair = |a: usize, b: usize| pairs.contains(&[a.min(b), a.max(b)]);
    let mut spans = spans(recorded);
    for (bag, by) in shifts.with_ids() {
        let span = spans.grown(bag).iter_mut();
        span.for_each(|span| *span = span.moved(*by));
    }
    // Log records are, and each is another one.
    let is_latched = |s: &Stream| s.latched && !is_log(s.connection.topic.as_str());
    let times = &recorded.messages;
    for bags in by_key(recorded).values() {
        let streams = |bag: usize| bags[&bag].iter().map(|at| &recorded.streams[*at]);
        // Of a latched topic the first message counts, as it was there before.
        let order = |bag: usize| {
            let first = streams(bag).filter_map(|s| Some(times.bounds(s.times)?.0));
            let first = first.min().filter(|_| streams(bag).all(is_latched));
            let count: u64 = streams(bag).map(|s| times.count(s.times)).sum();
            (first, Reverse(count), bag)
        };
        for (part, here) in parts(bags.keys(), &spans) {
            let is_twice = |bag: &usize| here.iter().any(|other| is_pair(*bag, *other));
            let count = |bag: usize| {
                let own = part.moved(-shifts.get(bag).copied().unwrap_or(0));
                let counts = streams(bag).map(|s| times.count_in(s.times, own));
                Ok((bag, counts.sum::<io::Result<u64>>()?))
            };
            let counts = here.iter().copied().filter(is_twice).map(count);
            let mut counts: Vec<(usize, u64)> =
                counts.collect::<io::Result<_>>().map_err(spool_error)?;
            // One message more or less shows no loss: at an edge it may be recorded by one only.
            let most = counts.iter().map(|of| of.1).max().unwrap_or(0);
            counts.sort_by_cached_key(|(bag, count)| (count + 1 < most, order(*bag)));
            let mut kept: Vec<usize> = Vec::new();
            for (bag, _) in counts {
                let better = kept.iter().find(|other| is_pair(**other, bag));
                let Some(own) = better.and_then(|better| spans.some(*better)) else {
                    kept.push(bag);
                    continue;
                };
                // At the edges of a recording its messages may be recorded a little sooner or later.
                let near = |is_edge| if is_edge { NEAR_NS } else { 0 };
                let start = part.start.plus(-near(part.start == own.start));
                let covered = Span::new(start, part.end.plus(near(part.end == own.end)));
                for stream in streams(bag) {
                    let of_bag = copies.grown(bag).entry(stream.connection.id);
                    of_bag.or_default().push(covered);
                }
            }
        }
    }
    for spans in copies.iter_mut().flat_map(BTreeMap::values_mut) {
        *spans = Span::joined(std::mem::take(spans), 0);
    }
    Ok(copies)
}

/// A sink that passes everything on but what another bag, or the same, contains.
pub(super) struct Rest<'a> {
    sink: &'a mut dyn Sink,
    copies: Option<&'a BTreeMap<ConnectionId, Vec<Span>>>,
    /// The number of messages that were left out.
    pub(super) left_out: u64,
    /// The stamps and the messages that were passed on although the same connection has another one at their time, which is not.
    passed: BTreeSet<(bool, ConnectionId, Stamp)>,
}

impl<'a> Rest<'a> {
    pub(super) fn new(sink: &'a mut dyn Sink, copies: &'a Copies, bag: usize) -> Self {
        Self {
            sink,
            copies: copies.get(bag).filter(|own| !own.is_empty()),
            left_out: 0,
            passed: BTreeSet::new(),
        }
    }

    fn keeps(&mut self, is_stamp: bool, connection: ConnectionId, time: Stamp) -> bool {
        let Some(copies) = self.copies else {
            return true;
        };
        let spans = copies.get(&connection).map_or(&[][..], Vec::as_slice);
        let next = spans.partition_point(|span| span.start <= time);
        match next.checked_sub(1).map(|at| spans[at]) {
            Some(span) if span.nanos() == 0 && span.start == time => {
                self.passed.insert((is_stamp, connection, time))
            }
            span => !span.is_some_and(|span| span.contains(time)),
        }
    }
}

impl Sink for Rest<'_> {
    fn behind(&mut self) -> Option<&mut dyn Sink> {
        Some(&mut *self.sink)
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        if self.copies.is_none() {
            return self.sink.stamps(connection, stamps, sizes);
        }
        let keep = |time: &Stamp| Some(*time).filter(|time| self.keeps(true, connection, *time));
        let kept: Vec<Option<Stamp>> = stamps.iter().map(keep).collect();
        self.left_out += pass(self.sink, connection, &kept, sizes);
    }

    fn message(&mut self, message: Message<'_>) {
        if self.keeps(false, message.connection, message.time) {
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
    let is_ahead = offset.ahead > 0;
    let side = if is_ahead { "ahead of" } else { "behind" };
    let (kind, why, then) = match offset.messages {
        0 => {
            let then = "puts these together, if they are of one run";
            (NoticeKind::Apart, "their first messages".to_owned(), then)
        }
        many => {
            let why = words::count(many, "message") + " that both recorded";
            (NoticeKind::Note, why, "corrects it")
        }
    };
    let then = if is_corrected {
        format!("corrected; `--offset {own}=0s` leaves its times as they are")
    } else {
        format!("`--offset {own}={seconds:+.3}s` {then}")
    };
    let text =
        format!("the clock of `{own}` is {length} {side} that of `{other}` by {why}: {then}");
    Notice::new(kind, text)
}
