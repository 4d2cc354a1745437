//! Data flow, when asked for: a node that publishes messages whose header stamps equal those of an input just before,
//! again and again, subscribes that input.
//!
//! Fails where nodes stamp their output anew, where two nodes on the same input always answer in the same order (the
//! later one seems to listen to the earlier one), and where sources are triggered together.

use std::collections::BTreeMap;

use super::SourceContext;
use crate::bag::{Connection, Encoding};
use crate::base::time::Stamp;
use crate::evidence::claim::{Degree, EvidenceLine, Name, SourceId};
use crate::evidence::message::cursor::Cursor;
use crate::evidence::message::definition::outline;
use crate::evidence::proof::{Findings, Key, Proof, Validity};
use crate::evidence::times::Timed;

/// Bytes from a payload's start to the end of its header's stamp, in either encoding.
pub(crate) const HEAD: usize = 12;

/// Fewer equal stamps than this are chance.
const FEWEST: u64 = 10;
/// Of a hundred messages so many must carry the input's stamp.
const SHARE: u64 = 60;
/// Of a hundred pairs with equal stamps so many must have the input first.
const ORDERED: u64 = 95;
/// More streams than this with one stamp are a clock, not a flow.
const MOST_AT_ONCE: usize = 32;
/// Log times are kept in these units, modulo 2^32.
const UNIT_NS: i64 = 10_000;
/// The longest a node takes to answer, in units (1 s).
const ANSWER: i32 = 100_000;

/// Whether a connection's messages begin with a header, as far as the bag tells.
pub(crate) fn is_stamped(connection: &Connection) -> bool {
    let definition = connection.definition.as_deref().unwrap_or_default();
    if definition.trim().is_empty() {
        let kind = &connection.type_name;
        return kind.starts_with("sensor_msgs/") || kind.ends_with("Stamped");
    }
    let fields = outline(definition);
    fields
        .first()
        .is_some_and(|(_, fields)| fields.starts_with("Header "))
}

/// Keeps the stamp of a message, together with its log time.
pub(crate) fn hear(heard: &mut SourceContext<'_>, first_bytes: &[u8]) {
    let encoding = &heard.stream.connection.encoding;
    let stamp = Cursor::new(encoding, first_bytes).and_then(|mut payload| {
        if *encoding == Encoding::Ros1 {
            payload.u32()?;
        }
        payload.time()
    });
    if let (Ok(stamp), Some(time)) = (stamp, heard.time)
        && stamp != Stamp(0)
    {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "modulo 2^32 is meant"
        )]
        let units = time.0.div_euclid(UNIT_NS) as u32;
        heard.facts.header(heard.place, stamp, units);
    }
}

/// What equal stamps say about two streams.
#[derive(Clone, Copy, Debug, Default)]
struct Pair {
    equal: u64,
    /// How often the input came first, and not long before.
    before: u64,
    /// How long before, in units, all together.
    ahead: u64,
}

pub(crate) fn conclude(source: SourceId, known: &mut Findings<'_>) {
    let streams: Vec<usize> = known.facts.headers.keys().copied().collect();
    let series: Vec<_> = known.facts.headers.values().copied().collect();
    let nodes: Vec<_> = streams.iter().map(|at| publisher(known, *at)).collect();
    let mut pairs: BTreeMap<(usize, usize), Pair> = BTreeMap::new();
    let mut group: Vec<Timed> = Vec::new();
    let merged = known.facts.times.merge(&series, |timed| {
        if group.first().is_some_and(|first| first.time != timed.time) {
            compare(&group, &nodes, &mut pairs);
            group.clear();
        }
        if group.len() <= MOST_AT_ONCE {
            group.push(timed);
        }
    });
    if let Err(error) = merged {
        known.failed = Some(error);
    }
    compare(&group, &nodes, &mut pairs);
    let mut best: BTreeMap<usize, (usize, Pair)> = BTreeMap::new();
    for ((input, output), pair) in pairs {
        let messages = known.facts.times.count(series[output]);
        let often = pair.before >= FEWEST && pair.before * 100 >= messages * SHARE;
        if often && pair.before * 100 >= pair.equal * ORDERED {
            let better = best
                .get(&output)
                .is_none_or(|(_, other)| rank(pair) > rank(*other));
            if better {
                best.insert(output, (input, pair));
            }
        }
    }
    for (output, (input, pair)) in best {
        let messages = known.facts.times.count(series[output]);
        if let Some(node) = nodes[output] {
            flow(
                source,
                known,
                node,
                streams[input],
                streams[output],
                (pair.before, messages),
            );
        }
    }
}

/// The input that comes right before its output is the one: of two that match alike, the nearer.
fn rank(pair: Pair) -> (u64, std::cmp::Reverse<u64>) {
    (
        pair.before,
        std::cmp::Reverse(pair.ahead / pair.before.max(1)),
    )
}

/// The node that publishes a stream, as far as it is known to be one.
fn publisher(known: &Findings<'_>, at: usize) -> Option<Name> {
    let stream = &known.streams[at];
    stream.publisher.or_else(|| {
        let mut all = known.publishers(stream.topic);
        all.next().filter(|_| all.next().is_none())
    })
}

/// Counts the pairs among messages with one stamp.
fn compare(group: &[Timed], nodes: &[Option<Name>], pairs: &mut BTreeMap<(usize, usize), Pair>) {
    if group.len() < 2 || group.len() > MOST_AT_ONCE {
        return;
    }
    for output in group.iter().filter(|t| nodes[t.series].is_some()) {
        for input in group
            .iter()
            .filter(|t| nodes[t.series] != nodes[output.series])
        {
            let pair = pairs.entry((input.series, output.series)).or_default();
            let ahead = output.size.wrapping_sub(input.size).cast_signed();
            pair.equal += 1;
            if (0..=ANSWER).contains(&ahead) {
                pair.before += 1;
                pair.ahead += u64::from(ahead.unsigned_abs());
            }
        }
    }
}

/// The node subscribes the input for as long as it publishes the output.
fn flow(
    source: SourceId,
    known: &mut Findings<'_>,
    node: Name,
    input: usize,
    output: usize,
    (matches, messages): (u64, u64),
) {
    let (topic, basis) = (known.streams[input].topic, known.streams[output].topic);
    let [name, from, to] = [node, topic, basis].map(|n| known.text(n));
    let text = format!(
        "{matches} of {messages} messages of {to} carry the stamp of a message of {from} just before"
    );
    let names = [&*name, &*from];
    if !known.facts.watched.is_empty()
        && known
            .facts
            .watched
            .iter()
            .all(|w| names.contains(&w.as_str()))
    {
        known.facts.pieces.push(EvidenceLine {
            time: None,
            source: "equal_stamps",
            degree: Degree::Inferred,
            text,
        });
    }
    known.prove(Proof {
        what: Key::Subscribe(topic, node),
        source,
        degree: Degree::Inferred,
        when: Validity::Like(Key::Publish(node, basis)),
    });
}
