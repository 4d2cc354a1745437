//! The evidence for each element as a track: signs, ends and rhythms, from which its lifetimes are computed.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use super::liveness::{Extent, Liveness, Pulse};
use super::restarts::{Restart, Restarts};
use super::senders::{Senders, Traffic};
use crate::base::rhythm::broken_after;
use crate::base::time::Stamp;
use crate::evidence::collector::Recorded;
use crate::evidence::conclude::Findings;
use crate::evidence::inference::{ElementKey, Inference, Reliability, Validity};
use crate::evidence::observation::Name;
use crate::evidence::{Confidence, Evidence, SOURCES};
use crate::graph::history::begins_steadily;

/// The track of every element.
///
/// Boxed, since the tree reserves much unused memory.
pub(crate) type Tracks = BTreeMap<ElementKey, Box<Liveness>>;

/// The elements that exist as long as others, each with its other.
pub(crate) type Likes = Vec<(ElementKey, ElementKey)>;

/// Adds the signs of all evidence to the track of its element. Takes the inferences out of the findings, of which
/// there may be very many.
pub(crate) fn tracks(
    recorded: &Recorded,
    findings: &mut Findings,
    traffic: &Traffic,
    restarts: &Restarts,
) -> io::Result<(Tracks, Likes)> {
    let mut tracks = Tracks::new();
    let mut likes = Likes::new();
    let sent = sent(&findings.inferences);
    // Records of `/rosout` name their nodes themselves.
    let mut data = findings
        .streams
        .iter()
        .filter(|s| s.connection.topic.as_str() != "/rosout");
    let is_rewritten = data.any(|stream| stream.trust == Reliability::First);
    let starved = starved(findings, traffic);
    let inferences = std::mem::take(&mut findings.inferences);
    let findings = &*findings;
    for inference in inferences {
        let [node, _] = inference.what.ends();
        let own = node.and_then(|node| restarts.get(&node));
        let own = own.map_or(&[][..], Vec::as_slice);
        let deaths: Vec<Stamp> = own.iter().map(|r| r.death).collect();
        let track = tracks.entry(inference.what).or_default();
        track.lasts |= lasts(&inference.when);
        track.evidence = track.evidence.and(Evidence::row(inference.source));
        track.confidence = track
            .confidence
            .min(confidence(&inference, findings, traffic));
        match &inference.when {
            Validity::Messages(at) => {
                let stream = &findings.streams[*at];
                let Some(senders) = traffic.get(&stream.topic) else {
                    continue;
                };
                let place = senders.streams.iter().position(|s| s == at).unwrap_or(0);
                let what = Followed {
                    known: node.is_none() && sent.contains(at),
                    beats: stream.connection.topic.as_str() != "/rosout"
                        && node.is_none_or(|node| !starved.contains(&(node, stream.topic))),
                    restarts: own,
                };
                follow(track, senders, place, &what);
                if !deaths.is_empty() {
                    let times = recorded.messages.times(stream.times)?;
                    track.bound_all(&times, &deaths);
                }
            }
            Validity::First(at) => {
                let stream = &findings.streams[*at];
                if let Some(senders) = traffic.get(&stream.topic)
                    && let Some(place) = senders.streams.iter().position(|s| s == at)
                    && let Some((first, _)) = senders.traces[place]
                {
                    track.bound_all(&[first], &[]);
                }
            }
            Validity::Signs { signs, ends } => {
                let ends = together(ends, &deaths);
                track.sign_all(signs, &ends);
                if is_from(&inference, "statistics") {
                    track.counted.extend(signs.first());
                }
                if SOURCES.get(inference.source).is_some_and(|s| s.own) {
                    track.last_sign = track.last_sign.max(signs.last().copied());
                    track.speaks = true;
                }
            }
            Validity::Begins { signs, ends } => {
                let ends = together(ends, &deaths);
                track.bound_all(signs, &ends);
                // Earlier messages of the node may have another's name.
                if !is_rewritten || !is_from(&inference, "rosout") {
                    track.begins.extend(signs);
                }
            }
            Validity::Moments(signs) => track.bound_all(signs, &deaths),
            Validity::Unending => track.unending = true,
            Validity::Like(other) => likes.push((inference.what, *other)),
            Validity::Whole => track.extent = track.extent.max(Extent::Whole),
            Validity::Always => track.extent = Extent::Always,
        }
    }
    for (node, restarts) in restarts {
        let track = tracks.entry(ElementKey::Node(*node)).or_default();
        for restart in restarts {
            track.signs.extend([restart.death, restart.birth]);
            track.ends.push(restart.death);
        }
    }
    Ok((tracks, likes))
}

/// The publications, as node and topic, that forward the messages of others and end with these: their end
/// says nothing about the node.
fn starved(findings: &Findings, traffic: &Traffic) -> BTreeSet<(Name, Name)> {
    let last = |topic: &Name, node: Option<Name>| {
        let senders = traffic.get(topic).into_iter().flat_map(|of| &of.list);
        let own = senders.filter(|s| node.is_none() || s.node == node);
        own.filter_map(|s| s.stretches.last().map(|s| (s.last, s.period)))
            .max()
    };
    let kind = |topic: Name| {
        let stream = findings.streams.iter().find(|s| s.topic == topic);
        stream.map(|s| &s.connection.type_name)
    };
    let is_starved = |(node, topic): &&(Name, Name)| {
        let inputs = findings
            .inferences
            .iter()
            .filter_map(|inference| match inference.what {
                ElementKey::Subscribe(input, of) if of == *node && input != *topic => Some(input),
                _ => None,
            });
        let inputs: BTreeSet<Name> = inputs
            .filter(|input| kind(*input) == kind(*topic))
            .collect();
        let own = last(topic, Some(*node));
        let goes_on = |input: &Name| {
            let sent = last(input, None).zip(own);
            sent.is_some_and(|((input, _), (own, period))| input.since(own) > broken_after(period))
        };
        !inputs.is_empty() && !inputs.iter().any(goes_on)
    };
    findings.copies.iter().filter(is_starved).copied().collect()
}

/// The confidence of an inference: a connection without messages in the time that is read is only declared by
/// its header.
fn confidence(inference: &Inference, findings: &Findings, traffic: &Traffic) -> Confidence {
    let Validity::Messages(at) = inference.when else {
        return inference.confidence;
    };
    let senders = traffic.get(&findings.streams[at].topic);
    let sent = senders.and_then(|senders| {
        let place = senders.streams.iter().position(|s| *s == at)?;
        senders.traces[place]
    });
    match sent {
        Some(_) => inference.confidence,
        None => inference.confidence.max(Confidence::Declared),
    }
}

/// The streams with a known publisher, whose messages show a publication.
fn sent(inferences: &[Inference]) -> BTreeSet<usize> {
    let sent = inferences.iter().filter_map(|inference| match inference {
        Inference {
            what: ElementKey::Publish(..),
            when: Validity::Messages(at),
            ..
        } => Some(*at),
        _ => None,
    });
    sent.collect()
}

/// Whether an inference is from the source of this name.
fn is_from(inference: &Inference, source: &str) -> bool {
    SOURCES
        .get(inference.source)
        .is_some_and(|s| s.word == source)
}

/// Whether an inference is still valid after its last sign.
fn lasts(when: &Validity) -> bool {
    !matches!(when, Validity::Moments(_) | Validity::Like(_))
}

/// Both lists of times as one, sorted.
fn together(a: &[Stamp], b: &[Stamp]) -> Vec<Stamp> {
    let mut all = [a, b].concat();
    all.sort_unstable();
    all
}

/// The most messages of a latched topic: one with more is sent again all the time.
const LATCHED: u64 = 20;

/// Facts about a stream that is followed.
struct Followed<'a> {
    /// Whether it belongs to a topic with known senders: the topic exists as long as its publications.
    known: bool,
    /// Whether its rhythm shows that its sender exists, which has no log records.
    beats: bool,
    restarts: &'a [Restart],
}

/// Adds the messages of one stream to the track of a publication or topic.
fn follow(track: &mut Liveness, senders: &Senders, place: usize, what: &Followed<'_>) {
    let sender = senders.of.get(place).and_then(|of| senders.list.get(*of));
    let sent = senders.traces.get(place).copied().flatten();
    let (Some((first, last)), Some(sender)) = (sent, sender) else {
        track.extent = track.extent.max(Extent::Whole);
        return;
    };
    let count: u64 = sender.stretches.iter().map(|s| s.count).sum();
    let latched = sender.latched && count <= LATCHED;
    let messages = track.messages();
    messages.senders.0 += 1;
    messages.senders.1 += u32::from(latched);
    if what.known {
        track.seen.extend([first, last]);
        return;
    }
    track.signs.extend([first, last]);
    // A recorder receives a latched message as soon as it finds the topic, so the sender began about then.
    if what.beats && (latched || begins_steadily(&sender.stretches)) {
        track.begins.push(first);
    }
    track.last_sign = track.last_sign.max(Some(last));
    let messages = track.messages();
    messages.reach(Some(sender.recording));
    let pulse = Pulse::of(&sender.stretches, what.restarts);
    let pulse = pulse.filter(|_| what.beats && !latched);
    messages.pulses.extend(pulse);
}
