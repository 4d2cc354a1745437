//! Ends of the publishers of merged streams. A tool that rewrites bags keeps one connection per topic, so
//! that no message names its sender; but if only one node is known to publish a topic, the end of the topic's
//! rhythm is that of the node's.

use std::collections::BTreeMap;

use super::liveness::Pulse;
use super::senders::{Sender, Traffic};
use super::tracks::Tracks;
use crate::base::role::{role, start};
use crate::base::time::{Span, Stamp};
use crate::evidence::conclude::Findings;
use crate::evidence::inference::{ElementKey, Reliability};
use crate::evidence::observation::Name;
use crate::graph::history::{Stretch, begins_steadily};

/// Adds the rhythms that stopped for good to the tracks of their only publishers. A rhythm that continues
/// shows nothing: another node may have taken over the topic.
pub(crate) fn fall_silent(
    tracks: &mut Tracks,
    traffic: &Traffic,
    findings: &Findings,
    pauses: &[Span],
) {
    for (topic, nodes) in publishers(tracks) {
        let Some(sender) = merged(traffic, findings, topic) else {
            continue;
        };
        for (node, stretches) in turns(&nodes, sender, findings) {
            let end = sender.recording.1.min(findings.mission.1);
            let Some(track) = tracks.get_mut(&ElementKey::Publish(node, topic)) else {
                continue;
            };
            if begins_steadily(stretches) {
                track.begins.push(stretches[0].first);
            }
            let pulse = Pulse::of(stretches, &[], pauses).filter(|pulse| pulse.broke_off(end));
            if let Some(pulse) = pulse {
                track.signs.push(pulse.last());
                track.last_sign = track.last_sign.max(Some(pulse.last()));
                track.messages().pulses.push(pulse);
            }
        }
    }
}

/// The known publishers of each topic.
fn publishers(tracks: &Tracks) -> BTreeMap<Name, Vec<Name>> {
    let mut all: BTreeMap<Name, Vec<Name>> = BTreeMap::new();
    for what in tracks.keys() {
        if let ElementKey::Publish(node, topic) = what {
            all.entry(*topic).or_default().push(*node);
        }
    }
    all
}

/// The sender that represents all senders of a merged topic, unless messages are latched.
fn merged<'a>(traffic: &'a Traffic, findings: &Findings, topic: Name) -> Option<&'a Sender> {
    let of = traffic.get(&topic)?;
    let is_merged = |at: &usize| findings.streams[*at].trust == Reliability::First;
    let sender = of.list.iter().find(|sender| sender.node.is_none())?;
    (of.streams.iter().all(is_merged) && !sender.latched).then_some(sender)
}

/// The messages of each of the publishers: all of them for a single one; for those of one role, which take turns, those
/// from its start to the next one's.
fn turns<'a>(
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
    let is_one_role = nodes
        .windows(2)
        .all(|p| role(&text(&p[0])) == role(&text(&p[1])));
    let mut births = births.filter(|_| is_one_role).unwrap_or_default();
    births.sort_unstable();
    let ends = births.iter().skip(1).map(|(next, _)| *next);
    let ends = ends.chain([Stamp::MAX]);
    let turns = births.iter().zip(ends);
    turns
        .filter_map(|((from, node), to)| Some((*node, within(&sender.stretches, *from, to)?)))
        .collect()
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
