//! Hand-overs of topics: one sender stops and another begins, or the larger share of a topic's messages moves.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::make::{Drafts, LogInput};
use super::{Detail, Kind};
use crate::base::rhythm::{
    BACK_NS, BREAK, FEWEST_OF_SENDER, OVERLAP_NS, SHARE_HOLDS_NS, SHUTDOWN_NS, TAKEN_NS,
    broken_after,
};
use crate::base::time::Stamp;
use crate::graph::history::{Bound, Sender};
use crate::graph::{Element, NodeId, TopicId};

/// The most senders of a topic that take over from each other: a topic of more is shared.
const MOST_SENDERS: usize = 100;

/// An interval in which one role publishes without a gap.
#[derive(Clone, Debug)]
struct RoleSending {
    role: Arc<str>,
    node: NodeId,
    first: Stamp,
    last: Stamp,
    count: u64,
    /// The time between its last messages, in nanoseconds.
    period: i64,
}

impl RoleSending {
    /// The longest time for which both send while one takes over from the other: a few messages.
    fn overlap(&self, new: &Self) -> i64 {
        let few = self.period.max(new.period).saturating_mul(BREAK);
        few.clamp(SHUTDOWN_NS, OVERLAP_NS)
    }
}

/// Adds all hand-overs.
pub(super) fn add(context: &LogInput<'_>, drafts: &mut Drafts) {
    let stretches = context
        .history
        .sending
        .senders
        .iter()
        .flat_map(|s| &s.stretches);
    let end = stretches.map(|s| s.last).max().unwrap_or(Stamp::MAX);
    let mut of: BTreeMap<TopicId, Vec<&Sender>> = BTreeMap::new();
    for sender in &context.history.sending.senders {
        of.entry(sender.topic).or_default().push(sender);
    }
    for (topic, senders) in of {
        if context.is_by_the_way(topic) || senders.iter().any(|v| v.node.is_none() || v.is_latched)
        {
            continue;
        }
        let all = sendings(context, &senders);
        let roles: BTreeSet<&Arc<str>> = all.iter().map(|s| &s.role).collect();
        if (2..=MOST_SENDERS).contains(&roles.len()) {
            for (old, new) in replaced(&all, end) {
                hand(context, drafts, topic, &old, &new);
            }
            shares(context, drafts, topic, &senders);
        }
    }
}

/// The publishing intervals of each role, sorted by first message.
fn sendings(context: &LogInput<'_>, senders: &[&Sender]) -> Vec<RoleSending> {
    let mut all: Vec<RoleSending> = Vec::new();
    for sender in senders {
        let Some(node) = sender.node else { continue };
        let mut own: Vec<RoleSending> = Vec::new();
        for stretch in &sender.stretches {
            match own.last_mut() {
                Some(last) if stretch.is_joined => {
                    (last.last, last.count) = (stretch.last, last.count + stretch.count);
                    last.period = stretch.period;
                }
                _ => own.push(RoleSending {
                    role: Arc::clone(&context.elements.nodes[node].role),
                    node,
                    first: stretch.first,
                    last: stretch.last,
                    count: stretch.count,
                    period: stretch.period,
                }),
            }
        }
        all.extend(own);
    }
    all.sort_by_key(|s| (s.first, s.node));
    all
}

/// Every end of sending that is compensated by the start of another role, except at the end of the recording.
fn replaced(all: &[RoleSending], end: Stamp) -> Vec<(RoleSending, RoleSending)> {
    let mut found = Vec::new();
    let ends = |s: &&RoleSending| end.since(s.last) > broken_after(s.period);
    let senders = all.iter().filter(|s| s.count >= FEWEST_OF_SENDER);
    for old in senders.filter(ends) {
        let own = || {
            all.iter()
                .filter(|s| s.role == old.role && s.last > old.last)
        };
        let back = own().map(|s| s.first).min();
        if back.is_some_and(|back| back.since(old.last) <= BACK_NS) {
            continue;
        }
        let others = || all.iter().filter(|s| s.role != old.role);
        let begins = others().find(|s| {
            let late = s.first.since(old.last);
            let soon = late <= TAKEN_NS || back.is_none();
            late >= -old.overlap(s)
                && soon
                && s.first > old.first
                && s.last > old.last
                && s.count >= FEWEST_OF_SENDER
        });
        let Some(new) = begins.filter(|new| back.is_none_or(|back| new.first < back)) else {
            continue;
        };
        // A role that was publishing already and continues does not take over from anybody.
        let carried = others().any(|s| {
            s.role != new.role && s.last > old.last && s.first < old.last.plus(-OVERLAP_NS)
        });
        let went_on = others().any(|s| {
            s.role == new.role
                && s.first < old.last.plus(-OVERLAP_NS)
                && s.last.plus(BACK_NS) > old.last
        });
        if !carried && !went_on {
            found.push((old.clone(), new.clone()));
        }
    }
    found
}

fn hand(
    context: &LogInput<'_>,
    drafts: &mut Drafts,
    topic: TopicId,
    old: &RoleSending,
    new: &RoleSending,
) {
    let at = Bound {
        time: new.first,
        earliest: old.last.min(new.first),
        latest: old.last.max(new.first),
    };
    let mut event = context.event(Kind::HandedOver, Element::Topic(topic), at);
    event.detail = Detail::Senders {
        from: vec![old.node],
        to: vec![new.node],
    };
    drafts.add(event);
}

/// The rate of a sender in an interval.
struct Pace {
    node: NodeId,
    first: Stamp,
    last: Stamp,
    hz: f64,
}

/// Adds the times at which another sender begins to provide most messages of a topic while both continue.
fn shares(context: &LogInput<'_>, drafts: &mut Drafts, topic: TopicId, senders: &[&Sender]) {
    let paces: Vec<Pace> = senders
        .iter()
        .filter_map(|v| Some((v.node?, v)))
        .flat_map(|(node, v)| {
            v.stretches.iter().map(move |s| Pace {
                node,
                first: s.first,
                last: s.last,
                hz: s.hz(),
            })
        })
        .collect();
    let mut cuts: Vec<Stamp> = paces.iter().flat_map(|p| [p.first, p.last]).collect();
    cuts.sort_unstable();
    cuts.dedup();
    let mut before: Option<(NodeId, BTreeSet<NodeId>, Stamp)> = None;
    let lasting = cuts.windows(2);
    for pair in lasting.filter(|pair| pair[1].since(pair[0]) >= SHARE_HOLDS_NS) {
        let inside = paces
            .iter()
            .filter(|p| p.first <= pair[0] && pair[1] <= p.last);
        let senders: Vec<&Pace> = inside.collect();
        let whole: f64 = senders.iter().map(|p| p.hz).sum();
        let Some(main) = senders.iter().find(|p| p.hz > whole / 2.0) else {
            continue;
        };
        let nodes: BTreeSet<NodeId> = senders.iter().map(|p| p.node).collect();
        if let Some((old, then, until)) = &before
            && *old != main.node
            && nodes.contains(old)
            && then.contains(&main.node)
            && pair[0].since(*until) <= SHARE_HOLDS_NS
        {
            let at = Bound {
                time: pair[0],
                earliest: *until,
                latest: pair[0],
            };
            let mut event = context.event(Kind::HandedOver, Element::Topic(topic), at);
            event.detail = Detail::Senders {
                from: vec![*old],
                to: vec![main.node],
            };
            drafts.add(event);
        }
        before = Some((main.node, nodes, pair[1]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    /// A role that sends at 2 Hz.
    fn sends(role: &str, node: NodeId, first: i64, last: i64) -> RoleSending {
        RoleSending {
            role: role.into(),
            node,
            first: Stamp(first * SECOND),
            last: Stamp(last * SECOND),
            count: 20,
            period: SECOND / 2,
        }
    }

    fn found(old: (i64, i64), new: (i64, i64)) -> usize {
        let all = [
            sends("/a", NodeId(0), old.0, old.1),
            sends("/b", NodeId(1), new.0, new.1),
        ];
        replaced(&all, Stamp(100 * SECOND)).len()
    }

    #[test]
    fn a_sender_until_the_end_hands_nothing_over() {
        assert_eq!(found((0, 50), (51, 100)), 1);
        assert_eq!(found((0, 98), (97, 100)), 0);
    }

    #[test]
    fn a_hand_over_overlaps_by_a_few_messages_at_most() {
        assert_eq!(found((0, 50), (48, 90)), 1);
        assert_eq!(found((0, 50), (46, 90)), 0);
    }
}
