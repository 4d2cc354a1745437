//! Data flow, on request: a node whose messages repeatedly have the header stamps of messages received just
//! before subscribes to that input. For example, 590 of 600 messages of `/cloud` have the stamp of a message of `/scan` from
//! 20 ms before, so the publisher of `/cloud` subscribes to `/scan`.
//!
//! It fails if nodes restamp their output, or if sources are triggered together. If two inputs are possible
//! and cannot be distinguished, no observation is made; nor in simulations, in which all messages of one step
//! have the same stamp.

use std::collections::{BTreeMap, BTreeSet};

use super::SourceContext;
use crate::bag::{Connection, Encoding};
use crate::base::name::{LOGS, plain_type};
use crate::base::time::Stamp;
use crate::evidence::inference::{Conclusions, ElementKey};
use crate::evidence::message::cursor::PayloadCursor;
use crate::evidence::message::dynamic::MessageSchema;
use crate::evidence::observation::{Name, Observation, ObservationRecord};
use crate::evidence::source_id;
use crate::evidence::spread::Spread;
use crate::evidence::times::Timed;

/// The number of bytes from a payload's start to the end of its first header's stamp, in either encoding, possibly
/// behind the length of a list.
pub(crate) const HEAD: usize = 20;

/// The fewest equal stamps that are significant: fewer may be equal by chance.
const FEWEST: u64 = 10;
/// The share, in per cent, of messages that must carry the input's stamp: the recorder may have lost a part of the input, and
/// with less a second input, from which a node also takes stamps, would count.
const SHARE: u64 = 60;
/// The share, in per cent, of pairs with equal stamps that must have the input first: the recorder rarely receives an output
/// before its input.
const ORDERED: u64 = 95;
/// The share, in per cent, of the best input's matches above which another input is equally good: a camera's image and its
/// calibration have the same stamps but for lost messages.
const AS_GOOD: u64 = 97;
/// The most streams with one stamp; more are a clock, not a flow, and the work would be the square of their number.
const MOST_AT_ONCE: usize = 32;
/// The unit in which log times are kept, in nanoseconds, modulo 2^32: fine enough for the order of messages in one process, coarse
/// enough that they repeat after half a day, not within the longest answer.
const UNIT_NS: i64 = 10_000;
/// The longest time in which a node responds, in units (1 s): the slowest detectors take about half of it. With more, outputs of
/// which the recorder received the input late, by another path, would count.
const ANSWER: i32 = 100_000;
/// Lists whose first element begins with a header.
const LISTS: [&str; 3] = [
    "tf2_msgs/TFMessage",
    "tf/tfMessage",
    "visualization_msgs/MarkerArray",
];

/// The first header in a message, which begins with it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FirstHeader {
    /// Whether the message begins with a list, whose first element begins with the header.
    is_listed: bool,
    /// Whether it begins with a number.
    is_numbered: bool,
}

/// Where the messages of a connection have their first header, as far as known; `None` if they do not begin with one.
pub(crate) fn first_header(connection: &Connection, schema: &MessageSchema) -> Option<FirstHeader> {
    // Log records carry the stamps of the messages they are about.
    if LOGS.contains(&connection.topic.as_str()) {
        return None;
    }
    let header = |is_listed| FirstHeader {
        is_listed,
        is_numbered: schema.numbers_headers(&connection.encoding),
    };
    let type_name = &*connection.type_name;
    if LISTS.contains(&&*plain_type(type_name)) {
        return Some(header(true));
    }
    let definition = connection.definition.as_deref().unwrap_or_default();
    let has_header = if definition.trim().is_empty() {
        type_name.starts_with("sensor_msgs/") || type_name.ends_with("Stamped")
    } else {
        schema.has_header()
    };
    has_header.then(|| header(false))
}

/// The stamp at the beginning of a message; `None` for an empty list and for 0.
fn stamp(encoding: &Encoding, header: FirstHeader, first_bytes: &[u8]) -> Option<Stamp> {
    let stamp = PayloadCursor::new(encoding, first_bytes).and_then(|payload| {
        let mut payload = payload.numbered(header.is_numbered);
        if header.is_listed && payload.u32()? == 0 {
            return Ok(Stamp(0));
        }
        Ok(payload.header_start()?.stamp)
    });
    stamp.ok().filter(|stamp| *stamp != Stamp(0))
}

/// Keeps the age of a message by its stamp.
pub(crate) fn age(context: &mut SourceContext<'_>, header: FirstHeader, first_bytes: &[u8]) {
    let encoding = &context.stream.connection.encoding;
    if let (Some(stamp), Some(time)) = (stamp(encoding, header, first_bytes), context.time) {
        context.facts.age(context.place, time, stamp);
    }
}

/// Keeps the stamp of a message, together with its log time.
pub(crate) fn collect(context: &mut SourceContext<'_>, header: FirstHeader, first_bytes: &[u8]) {
    let encoding = &context.stream.connection.encoding;
    if let (Some(stamp), Some(time)) = (stamp(encoding, header, first_bytes), context.time) {
        // Modulo 2^32, so that it fits.
        let units = time.0.div_euclid(UNIT_NS).rem_euclid(1 << 32);
        let units = u32::try_from(units).unwrap_or(u32::MAX);
        context.facts.header(context.place, stamp, units);
    }
}

/// The equal stamps of two flows.
#[derive(Clone, Copy, Default)]
struct StampPair {
    equal: u64,
    /// The number of times that the input came first, and not long before.
    before: u64,
    /// The time by which it came first, in seconds.
    lag: Spread,
}

/// Messages of one topic by one publisher, or by all publishers of one role.
struct StampFlow {
    topic: Name,
    /// The nodes that send it, if known, and the role they share.
    nodes: Vec<Name>,
    role: String,
    kind: String,
    messages: u64,
}

/// All flows with their equal stamps.
struct Flows {
    all: Vec<StampFlow>,
    /// By output, then input.
    pairs: BTreeMap<(usize, usize), StampPair>,
}

pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    if is_simulated(known) {
        return;
    }
    let flows = flows(known);
    for (output, flow) in flows.all.iter().enumerate() {
        let is_copy = |node: &Name| known.copies.contains(&(*node, flow.topic));
        if flow.nodes.is_empty() || flow.nodes.iter().any(is_copy) {
            continue;
        }
        let Some((topic, matches)) = input(known, &flows, output) else {
            continue;
        };
        for node in &flow.nodes {
            let basis = ElementKey::Publish(*node, flow.topic);
            known.infer(ElementKey::Subscribe(topic, *node), basis, |known| {
                let [from, to] = [topic, flow.topic].map(|n| known.text(n));
                let total = flow.messages;
                format!(
                    "{matches} of {total} messages of {to} carry the stamp of a message of {from} just before"
                )
            });
        }
    }
}

/// Whether nodes run by simulated time.
fn is_simulated(known: &Conclusions<'_>) -> bool {
    let clocks = known.topics_of(|kind| kind == "rosgraph_msgs/Clock");
    let set = known.observed(source_id("sim_time"));
    let is_set = |fact: &ObservationRecord| matches!(fact.observation, Observation::Subscribe(..));
    !clocks.is_empty() || set.iter().any(is_set)
}

/// The input topic of an output, if only one is possible, and the number of messages with its stamp.
fn input(known: &Conclusions<'_>, flows: &Flows, output: usize) -> Option<(Name, u64)> {
    let flow = &flows.all[output];
    let own = flows.pairs.range((output, 0)..=(output, usize::MAX));
    // All publishers of a topic are one input.
    let mut topics: BTreeMap<Name, (usize, StampPair, u64)> = BTreeMap::new();
    for ((_, input), pair) in own {
        let back = flows.pairs.get(&(*input, output)).map_or(0, |p| p.before);
        let of = topics.entry(flows.all[*input].topic);
        let of = of.or_insert((*input, StampPair::default(), 0));
        of.1.equal += pair.equal;
        of.1.before += pair.before;
        of.1.lag = of.1.lag.and(pair.lag);
        of.2 += back;
    }
    let good = topics.into_iter().filter(|(topic, (input, pair, back))| {
        *topic != flow.topic
            && pair.before >= FEWEST
            && pair.before * 100 >= flow.messages * SHARE
            && pair.before * 100 >= pair.equal * ORDERED
            && back * 100 <= pair.equal * (100 - ORDERED)
            && can_feed(&flows.all[*input].kind, &flow.kind)
            && !known
                .publishers(*topic)
                .any(|node| flow.nodes.contains(&node))
    });
    let mut good: Vec<_> = good.map(|(_, (input, pair, _))| (input, pair)).collect();
    let most = good.iter().map(|(_, pair)| pair.before).max()?;
    good.retain(|(_, pair)| pair.before * 100 >= most * AS_GOOD);
    let best = without_siblings(flows, flow, good)?;
    let found = |(at, pair): &(usize, StampPair)| (flows.all[*at].topic, pair.before);
    if let [only] = &best[..] {
        return Some(found(only));
    }
    let clear = |(at, pair): &&(usize, StampPair)| {
        let mut others = best.iter().filter(|(other, _)| other != at);
        others.all(|(_, other)| pair.lag.is_clearly_less(&other.lag))
    };
    best.iter().find(clear).map(found)
}

/// Sensor measurements, and types that are only computed from messages of their own row: no camera image is
/// computed from a laser scan.
const SENSED: [&[&str]; 4] = [
    &[
        "sensor_msgs/Image",
        "sensor_msgs/CompressedImage",
        "stereo_msgs/DisparityImage",
    ],
    &["sensor_msgs/Imu", "sensor_msgs/MagneticField"],
    &["sensor_msgs/JointState"],
    &["sensor_msgs/NavSatFix"],
];
/// Scans and clouds, which are computed from images too.
const CLOUDS: [&str; 3] = [
    "sensor_msgs/LaserScan",
    "sensor_msgs/PointCloud",
    "sensor_msgs/PointCloud2",
];
/// Packages whose messages describe a robot's surroundings or its state, not types that one program defines.
const COMMON: [&str; 4] = ["sensor_msgs/", "geometry_msgs/", "nav_msgs/", "tf2_msgs/"];

/// Whether messages of one type may be computed from those of another. Nothing else is computed from a
/// camera's calibration alone.
fn can_feed(input: &str, output: &str) -> bool {
    const CALIBRATION: &str = "sensor_msgs/CameraInfo";
    let is_common = COMMON.iter().any(|package| input.starts_with(package));
    let row = SENSED.iter().find(|row| row.contains(&output));
    if input == CALIBRATION {
        return output == CALIBRATION;
    }
    if !is_common || input == output {
        return true;
    }
    if CLOUDS.contains(&output) {
        return CLOUDS.contains(&input) || SENSED[0].contains(&input);
    }
    // A depth image may be computed from a cloud.
    let is_depth = |row: &[&str]| row == SENSED[0] && input == "sensor_msgs/PointCloud2";
    row.is_none_or(|row| row.contains(&input) || is_depth(row))
}

/// The input among flows that one publisher sends with one stamp: the one of the output's type, else the only one that
/// is not a `CameraInfo`; `None` if that is not clear.
fn without_siblings(
    flows: &Flows,
    output: &StampFlow,
    inputs: Vec<(usize, StampPair)>,
) -> Option<Vec<(usize, StampPair)>> {
    let mut families: BTreeMap<&[Name], Vec<(usize, StampPair)>> = BTreeMap::new();
    let mut left = Vec::new();
    for (at, pair) in inputs {
        match &flows.all[at].nodes[..] {
            [] => left.push((at, pair)),
            nodes => families.entry(nodes).or_default().push((at, pair)),
        }
    }
    for family in families.into_values() {
        let kind = |(at, _): &&(usize, StampPair)| flows.all[*at].kind.as_str();
        let same = family.iter().filter(|f| kind(f) == output.kind);
        let is_data = |f: &&_| kind(f) != "sensor_msgs/CameraInfo";
        let data = family.iter().filter(is_data);
        let [same, data]: [Vec<_>; 2] = [same.copied().collect(), data.copied().collect()];
        match (&family[..], &same[..], &data[..]) {
            ([one], ..) | (_, [one], _) | (_, [], [one]) => left.push(*one),
            _ => return None,
        }
    }
    Some(left)
}

/// Pools the streams and compares their stamps.
fn flows(known: &mut Conclusions<'_>) -> Flows {
    let (streams, series): (Vec<usize>, Vec<_>) = known.facts.headers.somes().unzip();
    let series: Vec<_> = series.into_iter().copied().collect();
    let mut pooled: BTreeMap<(String, String), StampFlow> = BTreeMap::new();
    let mut keys = Vec::new();
    for (at, id) in streams.iter().zip(&series) {
        let topic = known.streams[*at].topic;
        let publisher = known.streams[*at].publisher;
        let node = publisher.or_else(|| known.only_publisher(topic));
        let role = node.map_or_else(String::new, |n| role(&known.text(n)));
        let key = (known.text(topic).to_string(), role.clone());
        let flow = pooled.entry(key.clone()).or_insert_with(|| StampFlow {
            topic,
            nodes: Vec::new(),
            role,
            kind: known.kind(topic),
            messages: 0,
        });
        flow.messages += known.facts.times.count(*id);
        flow.nodes.extend(node.filter(|n| !flow.nodes.contains(n)));
        keys.push(key);
    }
    let order: Vec<_> = pooled.keys().cloned().collect();
    let place = |key| order.binary_search(key).unwrap_or(0);
    let flow_at: Vec<usize> = keys.iter().map(place).collect();
    let all: Vec<StampFlow> = pooled.into_values().collect();
    let mut pairs: BTreeMap<(usize, usize), StampPair> = BTreeMap::new();
    let mut group: Vec<(Timed, usize)> = Vec::new();
    let merged = known.facts.times.merge(&series, |timed| {
        let first = group.first().map(|(first, _)| first.time);
        if first.is_some_and(|first| first != timed.time) {
            compare(&group, &all, &mut pairs);
            group.clear();
        }
        if group.len() <= MOST_AT_ONCE {
            group.push((timed, flow_at[timed.series]));
        }
    });
    if let Err(error) = merged {
        known.failed = Some(error);
    }
    compare(&group, &all, &mut pairs);
    Flows { all, pairs }
}

/// A node's name without the numbers that differ from run to run.
fn role(node: &str) -> String {
    node.trim_end_matches(|c: char| c.is_ascii_digit() || c == '_')
        .to_owned()
}

/// Counts the pairs among messages with one stamp.
fn compare(
    group: &[(Timed, usize)],
    all: &[StampFlow],
    pairs: &mut BTreeMap<(usize, usize), StampPair>,
) {
    if group.len() < 2 || group.len() > MOST_AT_ONCE {
        return;
    }
    let mut counted = BTreeSet::new();
    for (output, to) in group.iter().filter(|(_, to)| !all[*to].nodes.is_empty()) {
        // From different senders, as far as known.
        let is_other = |(_, from): &&(_, usize)| {
            let (one, other) = (&all[*from], &all[*to]);
            one.topic != other.topic && (one.role.is_empty() || one.role != other.role)
        };
        for (input, from) in group.iter().filter(is_other) {
            if !counted.insert((from, to)) {
                continue;
            }
            let pair = pairs.entry((*to, *from)).or_default();
            let ahead = output.size.wrapping_sub(input.size).cast_signed();
            pair.equal += 1;
            if (0..=ANSWER).contains(&ahead) {
                pair.before += 1;
                pair.lag.add(f64::from(ahead) * UNIT_NS as f64 / 1e9);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_type_is_computed_from_what_may_feed_it_only() {
        for (input, output, may) in [
            ("sensor_msgs/Image", "sensor_msgs/Image", true),
            ("sensor_msgs/Image", "sensor_msgs/PointCloud2", true),
            ("sensor_msgs/LaserScan", "geometry_msgs/PoseStamped", true),
            ("vision_msgs/Detection2DArray", "sensor_msgs/Image", true),
            (
                "sensor_msgs/CameraInfo",
                "vision_msgs/Detection2DArray",
                false,
            ),
            ("sensor_msgs/LaserScan", "sensor_msgs/Image", false),
            ("nav_msgs/Odometry", "sensor_msgs/LaserScan", false),
            ("sensor_msgs/JointState", "sensor_msgs/Imu", false),
        ] {
            assert_eq!(can_feed(input, output), may, "{input} to {output}");
        }
    }
}
