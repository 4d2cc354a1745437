//! Messages forwarded byte by byte (relay, throttle, mux, drop, republish): the node that publishes the
//! copies subscribes to the topic that had them first; and the choice that a mux reports. For example, 500 of 500 messages of
//! `/cmd_vel` have the bytes of messages of `/nav_vel` just before, so the publisher of `/cmd_vel` subscribes to `/nav_vel`.
//!
//! The length and the first bytes are compared, by a hash; content that is repeated in its own topic (an
//! empty message, a constant) is not significant and is counted once. The budget is that of
//! [`crate::evidence::collector::PAYLOAD_BYTES`].

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::hash::BuildHasher as _;

use foldhash::quality::FixedState;
use foldhash::{HashMap, HashSet};

use crate::base::ids::ById;
use crate::base::name::LOGS;
use crate::base::rhythm::FEWEST_OF_SENDER;
use crate::base::time::Stamp;
use crate::evidence::inference::{Conclusions, ElementKey, IncidentKind};
use crate::evidence::observation::Name;
use crate::evidence::source::SourceContext;
use crate::evidence::spread::Spread;

/// The fewest equal messages that are significant: fewer short ones may be equal by chance.
const FEWEST: u64 = 10;
/// The share, in per cent, of an output's different messages that must be copies: a relay sends nothing else, but the
/// recorder may have lost some originals.
const SHARE: u64 = 90;
/// The least ratio of the number of times that the input comes first to that of the output: the recorder receives some
/// copies before their originals, but not most of them.
const FIRST: u64 = 3;
/// The most flows that have a content at once; with more it is a constant, such as an empty array, and the work would be the square
/// of their number.
const MOST_AT_ONCE: usize = 32;
/// The most runs of a flow that are kept: a mux that switches more often forwards several inputs at once.
const MOST_RUNS: usize = 4096;
/// The longest time in which a message is forwarded, in nanoseconds: with more, a constant that is sent now and
/// then would count as forwarded.
const RECENT_NS: i64 = 2_000_000_000;

/// The number of bytes of a payload that are compared: a header's stamp and the first lines of an image are among them.
pub(crate) const HEAD: usize = 16 << 10;

/// Keeps the hash of a payload of `size` bytes with this beginning.
pub(crate) fn collect(context: &mut SourceContext<'_>, beginning: &[u8], size: u32) {
    // A fixed seed, so that two contents that share a hash by chance share it in every run.
    let hash = FixedState::default().hash_one((size, beginning));
    let [a, b, c, d, ..] = hash.to_le_bytes();
    if let Some(time) = context.time {
        let hash = u32::from_le_bytes([a, b, c, d]);
        context.facts.payload(context.place, time, hash);
    }
}

/// A flow: a topic and its publisher, over all bags.
type PayloadFlow = (Name, Option<Name>);

/// The equal messages of two flows.
#[derive(Clone, Copy, Default)]
struct PayloadPair {
    /// The number of messages that the input had before the output.
    before: u64,
    lag: Spread,
}

/// Messages of an output in a row that all come from one input, and only from it.
#[derive(Clone, Copy)]
struct Run {
    input: usize,
    first: Stamp,
    count: u64,
}

/// The result of one pass over all messages.
#[derive(Default)]
struct Matches {
    pairs: BTreeMap<(usize, usize), PayloadPair>,
    /// By flow: the number of its different messages that were seen before in exactly these other flows.
    origins: ById<usize, BTreeMap<Vec<usize>, u64>>,
    distinct: ById<usize, u64>,
    /// By flow: the number of its messages that another one had just after it, as the recorder may receive a
    /// copy first.
    later: ById<usize, BTreeMap<usize, u64>>,
    /// By flow, in order.
    runs: ById<usize, Vec<Run>>,
}

pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    let (flows, matches) = matches(known);
    for (output, total) in matches.distinct.with_ids().filter(|(_, total)| **total > 0) {
        let (basis, sender) = flows[output];
        let Some(node) = sender.or_else(|| known.only_publisher(basis)) else {
            continue;
        };
        let inputs = inputs(known, &flows, &matches, output, node);
        let copied = copied(&matches, output, &inputs);
        if copied < FEWEST || copied * 100 < total * SHARE {
            continue;
        }
        known.copies.insert((node, basis));
        let inputs = nearest(&matches, output, &inputs);
        switches(known, &flows, &matches, (output, &inputs));
        for input in inputs {
            let topic = flows[input].0;
            let what = ElementKey::Subscribe(topic, node);
            known.infer(what, ElementKey::Publish(node, basis), |known| {
                let count = matches.pairs[&(input, output)].before;
                let [from, to] = [topic, basis].map(|n| known.text(n));
                format!(
                    "{count} of {total} different messages of {to} are byte by byte those of {from} just before"
                )
            });
        }
    }
}

/// Adds the times at which a mux switches to another of its inputs.
fn switches(
    known: &mut Conclusions<'_>,
    flows: &[PayloadFlow],
    matches: &Matches,
    (output, inputs): (usize, &[usize]),
) {
    let runs = matches.runs.of(output).iter();
    let runs: Vec<&Run> = runs
        .filter(|run| run.count >= FEWEST_OF_SENDER && inputs.contains(&run.input))
        .collect();
    for pair in runs.windows(2).filter(|two| two[0].input != two[1].input) {
        let [from, to] = [pair[0], pair[1]].map(|run| flows[run.input].0);
        let what = ElementKey::Topic(flows[output].0);
        known.incident(what, IncidentKind::Switch(from, to), pair[1].first);
    }
}

/// Processes all messages in order of time.
fn matches(known: &mut Conclusions<'_>) -> (Vec<PayloadFlow>, Matches) {
    let mut topics: BTreeMap<String, BTreeSet<Name>> = BTreeMap::new();
    for (at, _) in known.facts.payloads.somes() {
        let topic = known.streams[at].topic;
        topics.entry(known.kind(topic)).or_default().insert(topic);
    }
    let kept = known.facts.payloads.somes().filter(|(at, _)| {
        let stream = &known.streams[*at];
        // The only topic of its type is not a copy of another, and log records are forwarded by a known node.
        let alike = topics.get(&known.kind(stream.topic));
        !LOGS.contains(&stream.connection.topic.as_str()) && alike.is_some_and(|all| all.len() > 1)
    });
    let (places, series): (Vec<usize>, Vec<_>) = kept.unzip();
    let flow_of = |at: &usize| (known.streams[*at].topic, known.streams[*at].publisher);
    let named = places.iter().map(|at| {
        let (topic, node) = flow_of(at);
        let names = (known.text(topic), node.map(|node| known.text(node)));
        (names, (topic, node))
    });
    let named: BTreeMap<_, PayloadFlow> = named.collect();
    let flows: Vec<PayloadFlow> = named.into_values().collect();
    let rank: BTreeMap<PayloadFlow, usize> = flows.iter().copied().zip(0..).collect();
    let flow_at: Vec<usize> = places.iter().map(|at| rank[&flow_of(at)]).collect();
    let mut walk = PayloadWalk::default();
    let merged = known.facts.times.merge(&series, |timed| {
        walk.take(timed.time, flow_at[timed.series], timed.size);
    });
    if let Err(error) = merged {
        known.failed = Some(error);
    }
    (flows, walk.found)
}

/// The pass over all messages.
#[derive(Default)]
struct PayloadWalk {
    found: Matches,
    /// The contents that each flow had so far.
    seen: HashSet<(usize, u32)>,
    /// The flows that had a content recently, with the times.
    recent: HashMap<u32, Vec<(Stamp, usize)>>,
    queue: VecDeque<(Stamp, u32)>,
}

impl PayloadWalk {
    fn take(&mut self, time: Stamp, flow: usize, hash: u32) {
        while let Some((old, hash)) = self.queue.front().copied()
            && time.since(old) > RECENT_NS
        {
            self.queue.pop_front();
            if let Some(owners) = self.recent.get_mut(&hash) {
                owners.retain(|(t, _)| time.since(*t) <= RECENT_NS);
                if owners.is_empty() {
                    self.recent.remove(&hash);
                }
            }
        }
        if !self.seen.insert((flow, hash)) {
            return;
        }
        *self.found.distinct.grown(flow) += 1;
        let owners = self.recent.entry(hash).or_default();
        if owners.len() >= MOST_AT_ONCE {
            return;
        }
        let mut origins = Vec::new();
        for (before, input) in owners.iter().filter(|(t, f)| *t < time && *f != flow) {
            let later = self.found.later.grown(*input);
            *later.entry(flow).or_default() += 1;
            let pair = self.found.pairs.entry((*input, flow)).or_default();
            pair.before += 1;
            pair.lag.add(time.since(*before) as f64 / 1e9);
            origins.push(*input);
        }
        if let [input] = origins[..] {
            let runs = self.found.runs.grown(flow);
            let is_more = runs.len() < MOST_RUNS;
            match runs.last_mut() {
                Some(run) if run.input == input => run.count += 1,
                _ if is_more => runs.push(Run {
                    input,
                    first: time,
                    count: 1,
                }),
                _ => {}
            }
        }
        if !origins.is_empty() {
            origins.sort_unstable();
            let of = self.found.origins.grown(flow);
            *of.entry(origins).or_default() += 1;
        }
        owners.push((time, flow));
        self.queue.push_back((time, hash));
    }
}

/// The flows of the same type by other nodes that had enough of an output's messages first. If neither was
/// clearly first, a complete list of the other's topics decides.
fn inputs(
    known: &mut Conclusions<'_>,
    flows: &[PayloadFlow],
    matches: &Matches,
    output: usize,
    node: Name,
) -> Vec<usize> {
    let before = |a, b| matches.pairs.get(&(a, b)).map_or(0, |pair| pair.before);
    let (to, _) = flows[output];
    let own = matches.origins.get(output).into_iter().flatten();
    let from: BTreeSet<usize> = own.flat_map(|(from, _)| from).copied().collect();
    let mut inputs = Vec::new();
    for input in from {
        let (topic, sender) = flows[input];
        let (often, back) = (before(input, output), before(output, input));
        let is_known = known.knows(ElementKey::Publish(node, topic));
        if topic == to || known.kind(topic) != known.kind(to) || often < FEWEST || is_known {
            continue;
        }
        let is_undecided = back < FIRST * often;
        let is_input = often >= FIRST * back
            || is_undecided && sender.is_some_and(|of| known.denies(ElementKey::Subscribe(to, of)));
        if is_input {
            inputs.push(input);
        }
    }
    inputs
}

/// The number of different messages of an output that one of these inputs had just before, or just after.
fn copied(matches: &Matches, output: usize, inputs: &[usize]) -> u64 {
    let origins = matches.origins.get(output).into_iter().flatten();
    let before = origins.filter(|(from, _)| from.iter().any(|f| inputs.contains(f)));
    let later = matches.later.get(output).into_iter().flatten();
    let later = later.filter(|(input, _)| inputs.contains(input));
    let before: u64 = before.map(|(_, count)| count).sum();
    let later: u64 = later.map(|(_, count)| count).sum();
    (before + later).min(matches.distinct[output])
}

/// The nearer of two inputs with the same messages, which are on one path: the one whose lag clearly varies
/// less; neither if that is not clear.
fn nearest(matches: &Matches, output: usize, inputs: &[usize]) -> Vec<usize> {
    let pair = |input: usize| matches.pairs[&(input, output)];
    let together = |a: usize, b: usize| -> u64 {
        let origins = matches.origins.get(output).into_iter().flatten();
        let both = origins.filter(|(from, _)| from.contains(&a) && from.contains(&b));
        both.map(|(_, count)| count).sum()
    };
    let is_path = |a, b| together(a, b) * 2 >= pair(a).before.min(pair(b).before);
    let beats = |a: usize, b: usize| pair(a).lag.is_clearly_less(&pair(b).lag);
    let rivals = |a: usize| inputs.iter().copied().filter(move |b| *b != a);
    let is_nearest = |a: &usize| rivals(*a).all(|b| !is_path(*a, b) || beats(*a, b));
    inputs.iter().copied().filter(is_nearest).collect()
}

// The choice that a mux reports on `<mux>/selected`: it subscribes to that topic and forwards it from then on.

/// The name of the topic below that of the mux.
const SELECTED: &str = "/selected";

pub(crate) fn conclude_selected(known: &mut Conclusions<'_>) {
    let is_report = |topic: &Name| known.text(*topic).ends_with(SELECTED);
    let reports = known.topics_of(|kind| kind == "std_msgs/String");
    let reports: Vec<Name> = reports.into_iter().filter(is_report).collect();
    if reports.is_empty() {
        return;
    }
    let (_, shown) = known.facts.logged.sorted();
    for report in reports {
        let text = known.text(report);
        let node = known.facts.known(text.trim_end_matches(SELECTED));
        let Some(node) = node.filter(|node| known.nodes().contains(node)) else {
            continue;
        };
        let of_report = shown
            .iter()
            .filter(|of| known.streams[of.stream].topic == report);
        let chosen = of_report.filter_map(|of| Some((of.time, known.facts.known(&of.value)?)));
        let chosen: Vec<(Stamp, Name)> = chosen.collect();
        let is_output = |(of, topic): &(Name, Name)| *of == node && known.is_recorded(*topic);
        let outputs: Vec<_> = known.publications().filter(is_output).collect();
        for (_, output) in outputs {
            select(known, (node, output), &chosen);
        }
    }
}

/// Adds the inputs of a mux that have the type of its output, and the times at which it switches from one to
/// another.
fn select(known: &mut Conclusions<'_>, (node, output): (Name, Name), chosen: &[(Stamp, Name)]) {
    let kind = known.kind(output);
    let is_input =
        |topic: Name| topic != output && known.is_recorded(topic) && known.kind(topic) == kind;
    let mut inputs = chosen.to_vec();
    inputs.retain(|(_, topic)| is_input(*topic));
    for (_, input) in &inputs {
        let what = ElementKey::Subscribe(*input, node);
        known.infer(what, ElementKey::Publish(node, output), |known| {
            let [node, input] = [node, *input].map(|name| known.text(name));
            format!("{node} reports that it forwards {input}")
        });
    }
    let what = ElementKey::Topic(output);
    if known.incidents.iter().any(|incident| incident.what == what) {
        return;
    }
    for pair in inputs.windows(2).filter(|pair| pair[0].1 != pair[1].1) {
        let switch = IncidentKind::Switch(pair[0].1, pair[1].1);
        known.incident(what, switch, pair[1].0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Flow, milliseconds, content.
    fn walked(messages: &[(usize, i64, u32)]) -> Matches {
        let mut walk = PayloadWalk::default();
        let mut sorted = messages.to_vec();
        sorted.sort_by_key(|m| m.1);
        for (flow, at, hash) in sorted {
            walk.take(Stamp(at * 1_000_000), flow, hash);
        }
        walk.found
    }

    #[test]
    fn only_different_contents_count() {
        let found = walked(&[
            (0, 0, 7),
            (1, 1, 7),
            (0, 10, 7),
            (1, 11, 7),
            (0, 20, 8),
            (1, 21, 8),
        ]);
        assert_eq!(found.pairs[&(0, 1)].before, 2);
        assert_eq!(found.distinct, vec![2, 2].into());
    }

    #[test]
    fn a_copy_recorded_before_its_original_is_detected() {
        let message = |n: u32| {
            let (at, early) = (i64::from(n) * 100, n.is_multiple_of(5));
            [(0, at, n), (1, if early { at - 1 } else { at + 1 }, n)]
        };
        let found = walked(&(1..41).flat_map(message).collect::<Vec<_>>());
        assert_eq!(copied(&found, 1, &[0]), 40);
        assert_eq!(found.pairs[&(0, 1)].before, 32);
    }

    #[test]
    fn old_messages_are_not_inputs() {
        assert!(walked(&[(0, 0, 7), (1, 2_500, 7)]).pairs.is_empty());
    }

    #[test]
    fn in_a_chain_the_last_link_but_one_is_the_input() {
        // 0 → 1 with a variable lag, 1 → 2 with a steady one.
        let messages: Vec<_> = (0..40_u32)
            .flat_map(|n| {
                let (at, wild) = (i64::from(n) * 100, i64::from(n * 7 % 40));
                [(0, at, n), (1, at + 1 + wild, n), (2, at + 3 + wild, n)]
            })
            .collect();
        assert_eq!(nearest(&walked(&messages), 2, &[0, 1]), [1]);
    }

    #[test]
    fn two_copies_of_a_topic_are_not_each_others_input() {
        let messages: Vec<_> = (0..40_u32)
            .flat_map(|n| {
                let at = i64::from(n) * 100;
                [
                    (0, at, n),
                    (1, at + 1 + i64::from(n * 7 % 10), n),
                    (2, at + 20 + i64::from(n * 3 % 10), n),
                ]
            })
            .collect();
        let inputs = nearest(&walked(&messages), 2, &[0, 1]);
        assert!(!inputs.contains(&1), "{inputs:?}");
    }
}
