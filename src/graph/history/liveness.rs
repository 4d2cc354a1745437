//! The evidence that each element was alive: signs, ends and rhythms, from which its lifetimes are computed.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use crate::base::ids::grouped;
use crate::base::name::{is_feedback, is_log, lies_in, role, start};
use crate::base::rhythm::{CROWD_NS, FOUND_NS, TOGETHER_NS, broken_after};
use crate::base::time::{Span, Stamp};
use crate::evidence::collector::Recorded;
use crate::evidence::conclude::Findings;
use crate::evidence::inference::{ElementKey, Inference, Reliability, Validity};
use crate::evidence::observation::Name;
use crate::evidence::{Confidence, Evidence, SOURCES, source_word};
use crate::graph::history::lifetimes::{Extent, Likes, Liveness, LivenessOf, Pulse};
use crate::graph::history::restarts::{Restart, Restarts};
use crate::graph::history::senders::{Sender, Senders, Traffic, stretches};
use crate::graph::history::{Stretch, begins_steadily};

/// Adds the signs of all evidence to the liveness of its element. Takes the inferences out of the findings, of which
/// there may be very many.
pub(crate) fn collect(
    recorded: &Recorded,
    findings: &mut Findings,
    traffic: &Traffic,
    (restarts, pauses): (&Restarts, &[Span]),
) -> io::Result<(LivenessOf, Likes)> {
    let mut liveness_of = LivenessOf::new();
    let mut likes = Likes::new();
    let sent = sent(&findings.inferences);
    // Records of `/rosout` name their nodes themselves.
    let mut streams = findings.streams.iter();
    let is_rewritten = streams.any(|stream| {
        stream.trust == Reliability::First && !is_log(stream.connection.topic.as_str())
    });
    let mut forwarded = forwarded(findings, traffic);
    forwarded.extend(stand_ins(traffic).map(|what| (what, (true, true))));
    let asked = asked(findings, traffic);
    let inferences = std::mem::take(&mut findings.inferences);
    let findings = &*findings;
    for inference in inferences {
        let [node, topic] = inference.what.ends();
        let with_input = |topic: Option<Name>| {
            let known = node.zip(topic).and_then(|key| forwarded.get(&key));
            known.copied().unwrap_or_default()
        };
        let own = node.map_or(&[][..], |node| restarts.of(node));
        let deaths: Vec<Stamp> = own.iter().map(|r| r.death).collect();
        let liveness = liveness_of.entry(inference.what).or_default();
        // It is still valid after its last sign.
        liveness.lasts |= !matches!(inference.when, Validity::Moments(_) | Validity::Like(_));
        liveness.evidence = liveness.evidence.and(Evidence::row(inference.source));
        let confidence = confidence(&inference, findings, traffic);
        liveness.confidence = liveness.confidence.min(confidence);
        match &inference.when {
            Validity::Messages(at) => {
                let stream = &findings.streams[*at];
                let Some(senders) = traffic.some(stream.topic) else {
                    continue;
                };
                // The messages of its sender may all be in another bag.
                if senders.is_empty_among_others(*at) {
                    continue;
                }
                let place = senders.place(*at).unwrap_or(0);
                let (with_start, with_end) = with_input(Some(stream.topic));
                let name = stream.connection.topic.as_str();
                let is_free = is_log(name) || is_feedback(name);
                let what = Followed {
                    known: node.is_none() && sent.contains(at),
                    begins: !is_free && !with_start,
                    beats: !is_free && !with_end,
                    asked: node.and_then(|node| asked.get(&node)).copied(),
                    restarts: own,
                    pauses,
                };
                follow(liveness, senders, place, &what);
                if !deaths.is_empty() {
                    let times = recorded.messages.times(stream.times)?;
                    liveness.bound_all(&times, &deaths);
                }
            }
            Validity::First(at) => {
                let stream = &findings.streams[*at];
                if let Some(senders) = traffic.some(stream.topic)
                    && let Some(place) = senders.place(*at)
                    && let Some((first, _)) = senders.traces[place]
                {
                    liveness.bound_all(&[first], &[]);
                }
            }
            Validity::Signs { signs, ends } => {
                let ends = together(ends, &deaths);
                liveness.sign_all(signs, &ends);
                if is_from(&inference, "statistics") {
                    liveness.counted.extend(signs.first());
                }
                // A node reports its state in a rhythm as long as it is there.
                if is_from(&inference, "diagnostics") {
                    let of = topic.and_then(|topic| traffic.some(topic));
                    let senders = of.into_iter().flat_map(|of| &of.list);
                    let until = senders.map(|sender| sender.recording.1).max();
                    let until = until.unwrap_or(findings.mission.1);
                    let pulse = Pulse::of(&stretches(signs), own, pauses, until);
                    liveness.messages().pulses.extend(pulse);
                    liveness.last_sign = liveness.last_sign.max(signs.last().copied());
                }
                if SOURCES.get(inference.source).is_some_and(|s| s.own) {
                    liveness.last_sign = liveness.last_sign.max(signs.last().copied());
                    liveness.speaks = true;
                }
            }
            Validity::Begins { signs, ends } => {
                liveness.bound_all(signs, &together(ends, &deaths));
                // Relays of ROS 1 advertise their topic when their input sends its first message.
                if !with_input(topic).0 {
                    begin(liveness, &inference, signs, is_rewritten);
                }
            }
            Validity::Moments(signs) => liveness.bound_all(signs, &deaths),
            Validity::Unending => liveness.unending = true,
            Validity::Like(other) => likes.push((inference.what, *other)),
            Validity::Whole => liveness.extent = liveness.extent.max(Extent::Whole),
            Validity::Always => liveness.extent = Extent::Always,
        }
    }
    add_restarts(&mut liveness_of, restarts);
    Ok((liveness_of, likes))
}

/// Adds the times at which something of an element began; `is_rewritten`: earlier messages of a node may have another's name.
fn begin(liveness: &mut Liveness, inference: &Inference, signs: &[Stamp], is_rewritten: bool) {
    if !is_rewritten || !is_from(inference, "rosout") {
        liveness.begins.extend(signs);
    }
    if is_from(inference, "links") || is_from(inference, "parameter_events") {
        liveness.found.extend(signs);
    }
}

/// Adds the ends and the first signs of nodes that restarted.
fn add_restarts(liveness_of: &mut LivenessOf, restarts: &Restarts) {
    for (node, restarts) in restarts.with_ids() {
        for restart in restarts {
            let liveness = liveness_of.entry(ElementKey::Node(node)).or_default();
            let seen = restart.is_timed().then_some(restart.death);
            liveness.signs.extend(seen);
            liveness.signs.push(restart.birth);
            liveness.ends.push(restart.death);
        }
    }
}

/// The publications, as node and topic, that forward the messages of others, and whether they begin and end with
/// these: then that says nothing about the node.
fn forwarded(findings: &Findings, traffic: &Traffic) -> BTreeMap<(Name, Name), (bool, bool)> {
    let bounds = |topic: Name, node: Option<Name>| {
        let senders = traffic.some(topic).into_iter().flat_map(|of| &of.list);
        let own = senders.filter(|s| node.is_none() || s.node == node);
        let stretches = || own.clone().flat_map(|s| &s.stretches);
        let first = stretches().map(|s| (s.first, s.period)).min();
        first.zip(stretches().map(|s| (s.last, s.period)).max())
    };
    let kind = |topic: Name| {
        let stream = findings.streams.iter().find(|s| s.topic == topic);
        stream.map(|s| &s.connection.type_name)
    };
    let ends = |&(node, topic): &(Name, Name)| {
        let all = findings.inferences.iter();
        let inputs = all.filter_map(|inference| match inference.what {
            ElementKey::Subscribe(input, of) if of == node && input != topic => Some(input),
            _ => None,
        });
        let inputs: BTreeSet<Name> = inputs.filter(|input| kind(*input) == kind(topic)).collect();
        let inputs = || inputs.iter().filter_map(|input| bounds(*input, None));
        let ((first, early), (last, late)) = bounds(topic, Some(node))?;
        inputs().next()?;
        let began = inputs().any(|((input, _), _)| first.since(input) > broken_after(early));
        let goes_on = inputs().any(|(_, (input, _))| input.since(last) > broken_after(late));
        Some(((node, topic), (!began, !goes_on)))
    };
    findings.copies.iter().filter_map(ends).collect()
}

/// The publications, as node and topic, that only fill gaps of another publisher of their topic: their nodes may wait before and
/// after. For example, `/arm/servo` sends `/arm/command` from 128 s to 142 s, while `/arm/controller` does not.
fn stand_ins(traffic: &Traffic) -> impl Iterator<Item = (Name, Name)> + '_ {
    let is_near = |a: Stamp, b: Stamp| a.since(b).abs() <= TOGETHER_NS;
    traffic.somes().flat_map(move |(topic, of)| {
        let named = || of.list.iter().filter(|s| s.node.is_some() && !s.latched);
        let fills = move |own: &&Sender| {
            let bounds = own.stretches.first().zip(own.stretches.last());
            let mut others = named().filter(|other| other.node != own.node);
            bounds.is_some_and(|(first, last)| {
                others.any(|other| {
                    other.gaps().any(|gap| is_near(gap.0, first.first))
                        && other.gaps().any(|gap| is_near(gap.1, last.last))
                })
            })
        };
        named()
            .filter(fills)
            .filter_map(move |own| Some((own.node?, topic)))
    })
}

/// When others sent the first message to each node, on a topic below its name: what it sends at once is the answer
/// of a node that was there.
fn asked(findings: &Findings, traffic: &Traffic) -> BTreeMap<Name, Stamp> {
    let senders = || traffic.iter().flatten().flat_map(|of| &of.list);
    let nodes = senders().filter_map(|sender| sender.node);
    let nodes: BTreeMap<_, Name> = nodes.map(|node| (findings.text(node), node)).collect();
    let mut asked: BTreeMap<Name, Stamp> = BTreeMap::new();
    for (topic, of) in traffic.somes() {
        let name = format!("/{}", findings.text(topic).trim_start_matches('/'));
        let Some((space, _)) = name.rsplit_once('/') else {
            continue;
        };
        let owner = nodes.get(space).filter(|_| lies_in(&name, space));
        let others = of.list.iter().filter(|s| s.node.as_ref() != owner);
        let first = others.filter_map(|s| Some(s.stretches.first()?.first));
        if let Some((owner, first)) = owner.zip(first.min()) {
            let known = asked.entry(*owner).or_insert(first);
            *known = first.min(*known);
        }
    }
    asked
}

/// The confidence of an inference: a connection without messages in the time that is read is only declared by
/// its header.
fn confidence(inference: &Inference, findings: &Findings, traffic: &Traffic) -> Confidence {
    let Validity::Messages(at) = inference.when else {
        return inference.confidence;
    };
    let senders = traffic.some(findings.streams[at].topic);
    let sent = senders.and_then(|senders| senders.traces[senders.place(at)?]);
    match sent {
        Some(_) => inference.confidence,
        None => inference.confidence.max(Confidence::Declared),
    }
}

/// The streams with a known publisher, whose messages show a publication.
fn sent(inferences: &[Inference]) -> BTreeSet<usize> {
    let edges = inferences.iter().map(|one| (one.what, &one.when));
    let sent = edges.filter_map(|edge| match edge {
        (ElementKey::Publish(..), Validity::Messages(at)) => Some(*at),
        _ => None,
    });
    sent.collect()
}

/// Whether an inference is from the source of this name.
fn is_from(inference: &Inference, source: &str) -> bool {
    source_word(inference.source) == source
}

/// Both lists of times as one, sorted.
fn together(a: &[Stamp], b: &[Stamp]) -> Vec<Stamp> {
    let mut all = [a, b].concat();
    all.sort_unstable();
    all
}

/// Facts about a stream that is followed.
struct Followed<'a> {
    /// Whether it belongs to a topic with known senders: the topic exists as long as its publications.
    known: bool,
    /// Whether its beginning and its rhythm show when its sender exists, which has no log records.
    begins: bool,
    beats: bool,
    /// When its sender got the first message of its own.
    asked: Option<Stamp>,
    restarts: &'a [Restart],
    /// The times at which nothing was recorded.
    pauses: &'a [Span],
}

/// Adds the messages of one stream to the liveness of a publication or topic.
fn follow(liveness: &mut Liveness, senders: &Senders, place: usize, what: &Followed<'_>) {
    let sender = senders.of.get(place).and_then(|of| senders.list.get(*of));
    let sent = senders.traces.get(place).copied().flatten();
    let (Some((first, last)), Some(sender)) = (sent, sender) else {
        liveness.extent = liveness.extent.max(Extent::Whole);
        return;
    };
    let messages = liveness.messages();
    messages.senders.0 += 1;
    messages.senders.1 += u32::from(sender.latched);
    if what.known {
        liveness.seen.extend([first, last]);
        return;
    }
    liveness.signs.extend([first, last]);
    // A recorder receives a latched message as soon as it finds the topic, so the sender began about then, unless the
    // first one recorded may be a repetition.
    let period = sender.stretches.first().map_or(0, |s| s.period);
    let due = sender.recording.0.plus(FOUND_NS.saturating_add(period));
    let answers = |asked: Stamp| (0..=CROWD_NS).contains(&first.since(asked));
    let is_proof = what.begins && first > due && !what.asked.is_some_and(answers);
    if is_proof && (sender.latched || begins_steadily(&sender.stretches)) {
        liveness.begins.push(first);
    }
    liveness.last_sign = liveness.last_sign.max(Some(last));
    let messages = liveness.messages();
    messages.reach(Some(sender.recording));
    messages.due = messages.due.max(Some(due));
    let pulse = Pulse::of(
        &sender.stretches,
        what.restarts,
        what.pauses,
        sender.recording.1,
    );
    let pulse = pulse.filter(|_| what.beats && !sender.latched);
    messages.pulses.extend(pulse);
}

// Ends of the publishers of merged streams. A tool that rewrites bags keeps one connection per topic, so
// that no message names its sender; but if only one node is known to publish a topic, the end of the topic's
// rhythm is that of the node's. For example, only `/lidar` names `/scan` as its own, and `/scan` at 10 Hz stops at 50 s of
// 300 s: `/lidar` ended at 50 s.

/// Adds the rhythms that stopped for good to the liveness of their only publishers. A rhythm that continues
/// shows nothing: another node may have taken over the topic.
pub(crate) fn fall_silent(
    liveness_of: &mut LivenessOf,
    traffic: &Traffic,
    findings: &Findings,
    pauses: &[Span],
) {
    for (topic, nodes) in publishers(liveness_of) {
        let Some(sender) = merged(traffic, findings, topic) else {
            continue;
        };
        for (node, stretches) in by_publisher(&nodes, sender, findings) {
            let Some(liveness) = liveness_of.get_mut(&ElementKey::Publish(node, topic)) else {
                continue;
            };
            if begins_steadily(stretches) {
                liveness.begins.push(stretches[0].first);
            }
            let pulse = Pulse::of(stretches, &[], pauses, sender.recording.1);
            let pulse = pulse.filter(|pulse| pulse.broke_off(findings.mission.1));
            if let Some(pulse) = pulse {
                liveness.signs.push(pulse.last);
                liveness.last_sign = liveness.last_sign.max(Some(pulse.last));
                liveness.messages().pulses.push(pulse);
            }
        }
    }
}

/// The known publishers of each topic.
fn publishers(liveness_of: &LivenessOf) -> BTreeMap<Name, Vec<Name>> {
    let nodes = liveness_of.keys().filter_map(|what| match what {
        ElementKey::Publish(node, topic) => Some((*topic, *node)),
        _ => None,
    });
    grouped(nodes)
}

/// The sender that represents all senders of a merged topic, unless messages are latched.
fn merged<'a>(traffic: &'a Traffic, findings: &Findings, topic: Name) -> Option<&'a Sender> {
    let of = traffic.some(topic)?;
    let is_merged = |at: &usize| findings.streams[*at].trust == Reliability::First;
    let sender = of.list.iter().find(|sender| sender.node.is_none())?;
    (of.streams.iter().all(is_merged) && !sender.latched).then_some(sender)
}

/// The messages of each of the publishers: all of them for a single one; for those of one role, which take turns, those
/// from its start to the next one's.
fn by_publisher<'a>(
    nodes: &[Name],
    sender: &'a Sender,
    findings: &Findings,
) -> Vec<(Name, &'a [Stretch])> {
    if let [only] = nodes {
        return vec![(*only, &sender.stretches)];
    }
    let text = |node: &Name| findings.text(*node);
    let born = |node: &Name| Some((start(&text(node))?, *node));
    let births: Option<Vec<(Stamp, Name)>> = nodes.iter().map(born).collect();
    let mut pairs = nodes.windows(2);
    let is_one_role = pairs.all(|p| role(&text(&p[0])) == role(&text(&p[1])));
    let mut births = births.filter(|_| is_one_role).unwrap_or_default();
    births.sort_unstable();
    let ends = births.iter().skip(1).map(|(next, _)| *next);
    let ends = ends.chain([Stamp::MAX]);
    let own = |((from, node), to): (&(Stamp, Name), Stamp)| {
        Some((*node, within(&sender.stretches, *from, to)?))
    };
    births.iter().zip(ends).filter_map(own).collect()
}

/// The stretches of a turn; `None` if one continues into the next turn, so that two publish at the same time.
fn within(stretches: &[Stretch], from: Stamp, to: Stamp) -> Option<&[Stretch]> {
    let first = stretches.partition_point(|s| s.first < from);
    let next = stretches.partition_point(|s| s.first < to);
    let own = stretches.get(first..next)?;
    own.last().is_none_or(|last| last.last < to).then_some(own)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_ends_before_the_next_begins() {
        let stretch = |first, last| Stretch {
            first: Stamp(first),
            last: Stamp(last),
            count: 9,
            period: 1,
            is_even: true,
            is_joined: false,
        };
        let all = [stretch(10, 20), stretch(30, 40)];
        let turn = |from, to| within(&all, Stamp(from), Stamp(to)).map(<[Stretch]>::len);
        assert_eq!(turn(5, 25), Some(1));
        assert_eq!(turn(25, 50), Some(1));
        assert_eq!(turn(5, 15), None);
    }
}
