//! Hand-overs of topics: one sender stops and another begins, or the larger share of a topic's messages moves.
//!
//! For example, `/joystick` sends `/cmd_vel` at 10 Hz until 40 s and `/nav` from 41 s on: `/cmd_vel` was handed over from one to
//! the other at 41 s. If `/joystick` sends again at 43 s, it only paused, and `/nav` took nothing over.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::drafts::{Drafts, LogInput};
use super::{Detail, Kind};
use crate::base::rhythm::{
    BACK_NS, BREAK, BREAK_NS, FEWEST_OF_SENDER, OVERLAP_NS, SHARE_HOLDS_NS, TAKEN_NS, broken_after,
};
use crate::base::time::Stamp;
use crate::graph::history::{Bound, Sender, Stretch, hide};
use crate::graph::{Element, NodeId, TopicId};

/// The most roles of a topic that take over from each other. Each is compared with all others, and a topic of a hundred
/// publishers, such as a log, is shared by them and handed over by none.
const MOST_SENDERS: usize = 100;

/// The messages of one role without a gap, at any rate.
#[derive(Clone, Debug)]
struct RoleSending {
    role: Arc<str>,
    node: NodeId,
    sent: Stretch,
}

impl RoleSending {
    /// The longest time for which both send while one takes over from the other: a few messages.
    fn overlap(&self, new: &Self) -> i64 {
        let few = self.sent.period.max(new.sent.period).saturating_mul(BREAK);
        few.clamp(BREAK_NS, OVERLAP_NS)
    }
}

/// Adds all hand-overs.
pub(super) fn add(context: &LogInput<'_>, drafts: &mut Drafts) {
    let senders = &context.history.sending.senders;
    let stretches = senders.iter().flat_map(|s| &s.stretches);
    let end = stretches.map(|s| s.last).max().unwrap_or(Stamp::MAX);
    for senders in senders.chunk_by(|a, b| a.topic == b.topic) {
        let topic = senders[0].topic;
        if context.is_by_the_way(topic) || senders.iter().any(|v| v.node.is_none() || v.is_latched)
        {
            continue;
        }
        let all = sendings(context, senders);
        let roles: BTreeSet<&Arc<str>> = all.iter().map(|s| &s.role).collect();
        if (2..=MOST_SENDERS).contains(&roles.len()) {
            for (old, new) in replaced(&all, end) {
                let ends = [(old.node, old.sent.last), (new.node, new.sent.first)];
                hand_over(context, drafts, topic, ends);
            }
            shares(context, drafts, topic, senders);
        }
    }
}

/// The publishing intervals of each role, sorted by first message.
fn sendings(context: &LogInput<'_>, senders: &[Sender]) -> Vec<RoleSending> {
    let mut all: Vec<RoleSending> = Vec::new();
    let pauses = &context.history.pauses;
    for sender in senders {
        let Some(node) = sender.node else { continue };
        let mut own: Vec<RoleSending> = Vec::new();
        for stretch in &sender.stretches {
            match own.last_mut() {
                // The end of a pause of the recorder is no beginning.
                Some(RoleSending { sent, .. })
                    if stretch.is_joined || hide(pauses, (sent.last, Some(stretch.first))) =>
                {
                    (sent.last, sent.period) = (stretch.last, stretch.period);
                    sent.count += stretch.count;
                }
                _ => own.push(RoleSending {
                    role: Arc::clone(&context.elements.nodes[node].role),
                    node,
                    sent: *stretch,
                }),
            }
        }
        all.extend(own);
    }
    all.sort_by_key(|s| (s.sent.first, s.node));
    all
}

/// Every end of sending that is compensated by the start of another role, except at the end of the recording.
fn replaced(all: &[RoleSending], end: Stamp) -> Vec<(&RoleSending, &RoleSending)> {
    let mut found = Vec::new();
    let is_enough = |s: &&RoleSending| s.sent.count >= FEWEST_OF_SENDER;
    let ends = |s: &&RoleSending| end.since(s.sent.last) > broken_after(s.sent.period);
    for old in all.iter().filter(is_enough).filter(ends) {
        let last = old.sent.last;
        let later = || all.iter().filter(|s| s.sent.last > last);
        let own = later().filter(|s| s.role == old.role);
        let back = own.map(|s| s.sent.first).min();
        if back.is_some_and(|back| back.since(last) <= BACK_NS) {
            continue;
        }
        let others = || all.iter().filter(|s| s.role != old.role);
        let begins = later().filter(is_enough).find(|s| {
            let late = s.sent.first.since(last);
            let soon = late <= TAKEN_NS || back.is_none();
            s.role != old.role && late >= -old.overlap(s) && soon && s.sent.first > old.sent.first
        });
        let Some(new) = begins.filter(|new| back.is_none_or(|back| new.sent.first < back)) else {
            continue;
        };
        // A role that was publishing already and continues does not take over from anybody.
        let mut before = others().filter(|s| s.sent.first < last.plus(-OVERLAP_NS));
        let goes_on = |s: &RoleSending| {
            let pause = if s.role == new.role { BACK_NS } else { 0 };
            s.sent.last.plus(pause) > last
        };
        if !before.any(goes_on) {
            found.push((old, new));
        }
    }
    found
}

/// Adds a hand-over: the sender before with its last message, and the one after with its first.
fn hand_over(
    context: &LogInput<'_>,
    drafts: &mut Drafts,
    topic: TopicId,
    [(old, last), (new, first)]: [(NodeId, Stamp); 2],
) {
    let at = Bound::new(first, last.min(first), last.max(first));
    let mut event = context.event(Kind::HandedOver, Element::Topic(topic), at);
    event.detail = Detail::Senders {
        from: vec![old],
        to: vec![new],
    };
    drafts.add(event);
}

/// Adds the times at which another sender begins to provide most messages of a topic while both continue.
fn shares(context: &LogInput<'_>, drafts: &mut Drafts, topic: TopicId, senders: &[Sender]) {
    let known = senders.iter().filter_map(|v| Some((v.node?, &v.stretches)));
    let known = known.flat_map(|(node, all)| all.iter().map(move |s| (node, s)));
    let known: Vec<(NodeId, &Stretch)> = known.collect();
    let mut cuts: Vec<Stamp> = known.iter().flat_map(|(_, s)| [s.first, s.last]).collect();
    cuts.sort_unstable();
    cuts.dedup();
    let mut before: Option<(NodeId, BTreeSet<NodeId>, Stamp)> = None;
    let between = cuts.windows(2);
    for pair in between.filter(|pair| pair[1].since(pair[0]) >= SHARE_HOLDS_NS) {
        let inside = known.iter();
        let inside = inside.filter(|(_, s)| s.first <= pair[0] && pair[1] <= s.last);
        let rates: BTreeMap<NodeId, f64> = inside.map(|(node, s)| (*node, s.hz())).collect();
        let whole: f64 = rates.values().sum();
        let Some((main, _)) = rates.iter().find(|(_, hz)| **hz > whole / 2.0) else {
            continue;
        };
        let (main, nodes): (NodeId, BTreeSet<NodeId>) = (*main, rates.keys().copied().collect());
        if let Some((old, then, until)) = &before
            && *old != main
            && nodes.contains(old)
            && then.contains(&main)
            && pair[0].since(*until) <= SHARE_HOLDS_NS
        {
            hand_over(context, drafts, topic, [(*old, *until), (main, pair[0])]);
        }
        before = Some((main, nodes, pair[1]));
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
            sent: Stretch {
                first: Stamp(first * SECOND),
                last: Stamp(last * SECOND),
                count: 20,
                period: SECOND / 2,
                is_even: true,
                is_joined: false,
            },
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
    fn a_fast_sender_may_overlap_for_two_seconds() {
        let fast = |role, node, first, last| {
            let mut one = sends(role, node, first, last);
            one.sent.period = SECOND / 50;
            one
        };
        let found = |first| {
            let all = [
                fast("/a", NodeId(0), 0, 50),
                fast("/b", NodeId(1), first, 90),
            ];
            replaced(&all, Stamp(100 * SECOND)).len()
        };
        assert_eq!([48, 47].map(found), [1, 0]);
    }

    #[test]
    fn a_hand_over_overlaps_by_a_few_messages_at_most() {
        assert_eq!(found((0, 50), (48, 90)), 1);
        assert_eq!(found((0, 50), (46, 90)), 0);
    }
}
