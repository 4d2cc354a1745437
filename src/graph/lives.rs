//! Lives in continuous time: when each element began and ended, where the truth lies, and how every sender sent.
//!
//! Windows say only when we look; nothing here depends on them.

use std::sync::Arc;

use super::{NodeId, TopicId};
use crate::base::time::{Span, Stamp};
use crate::evidence::Degree;

/// A moment, as well as it is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bound {
    /// The sign that tells of it.
    pub time: Stamp,
    /// The truth does not lie before this.
    pub earliest: Stamp,
    /// The truth does not lie after this.
    pub latest: Stamp,
}

/// One life of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Life {
    /// When it is there, half-open.
    pub span: Span,
    /// When it began; `None` if it may have been there before the mission began.
    pub began: Option<Bound>,
    /// When it ended; `None` if nothing tells that it did.
    pub ended: Option<Bound>,
}

/// A run of messages of one sender at one rate, without a gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stretch {
    /// The first message.
    pub first: Stamp,
    /// The last message.
    pub last: Stamp,
    /// Messages, 1...
    pub count: u64,
    /// The median time between them in nanoseconds; 0 with fewer than two.
    pub period: i64,
    /// Whether they come at even times.
    pub is_even: bool,
    /// Whether the stretch before it ends where this one begins: a change of rate, not a gap.
    pub is_joined: bool,
}

impl Stretch {
    /// Messages per second; 0 with fewer than two.
    pub fn hz(&self) -> f64 {
        let nanos = self.last.since(self.first);
        if nanos <= 0 {
            return 0.0;
        }
        let mean = nanos as f64 / (self.count - 1).max(1) as f64;
        let median = self.period as f64;
        // A few lost messages do not make a rate slower; messages in pairs have no middle.
        let period = if self.is_even { median } else { mean };
        1e9 / period.max(1.0)
    }
}

/// All that one sender sent on one topic.
#[derive(Clone, Debug, PartialEq)]
pub struct Voice {
    /// The topic.
    pub topic: TopicId,
    /// Who sent; `None` where the bag does not say.
    pub node: Option<NodeId>,
    /// Whether its last message stands for it.
    pub is_latched: bool,
    /// In order, none overlapping.
    pub stretches: Vec<Stretch>,
}

/// A lifecycle state that a node entered.
#[derive(Clone, Debug, PartialEq)]
pub struct Transition {
    /// The node.
    pub node: NodeId,
    /// When.
    pub time: Stamp,
    /// The state.
    pub state: Arc<str>,
}

/// The lives of all elements, by their places in [`super::Elements`], and what was sent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lives {
    /// Of each node, in order.
    pub nodes: Vec<Known>,
    /// Of each topic.
    pub topics: Vec<Known>,
    /// Of each publication.
    pub publishes: Vec<Known>,
    /// Of each subscription.
    pub subscribes: Vec<Known>,
    /// What every sender sent, sorted by topic and node.
    pub voices: Vec<Voice>,
    /// Lifecycle states, sorted by time.
    pub transitions: Vec<Transition>,
}

impl Lives {
    /// Nodes that came back under the same name, and when; sorted by time.
    pub fn returns(&self) -> Vec<(NodeId, Stamp)> {
        let lives = (0..).zip(&self.nodes);
        let again = lives.flat_map(|(id, known)| known.lives.iter().skip(1).map(move |l| (id, l)));
        let mut all: Vec<_> = again
            .map(|(id, life)| (id, life.began.map_or(life.span.start, |at| at.time)))
            .collect();
        all.sort_unstable_by_key(|(id, time)| (*time, *id));
        all
    }
}

/// The lives of one element.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// How well it is known at its best.
    pub degree: Degree,
    /// In order, none overlapping.
    pub lives: Vec<Life>,
}

/// Fewer messages than this before a pause are no rhythm that could break.
const FEWEST: u64 = 5;
/// A rhythm breaks after a silence of so many periods.
const BREAK: i64 = 5;
/// And of so many nanoseconds: a recorder starts and stops writing topics up to a second apart.
const BREAK_NS: i64 = 2_000_000_000;
/// Somebody who pauses more often than this, and for more than a fifth of the time, speaks when there is something to
/// say.
const OFTEN: usize = 4;

/// When a sender with a rhythm was silent while it lived (`lives`, half-open): from its last message to the next, or
/// to no other. What comes in bursts is never silent.
pub(crate) fn silences(stretches: &[Stretch], lives: &[Span]) -> Vec<(Stamp, Option<Stamp>)> {
    let mut found = Vec::new();
    for life in lives {
        let inside = |s: &&Stretch| life.start <= s.first && s.first < life.end;
        let own: Vec<&Stretch> = stretches.iter().filter(inside).collect();
        for (at, stretch) in own.iter().enumerate() {
            let next = own.get(at + 1).map(|next| next.first);
            let silence = next.unwrap_or(life.end).since(stretch.last);
            let long = silence > stretch.period.saturating_mul(BREAK).max(BREAK_NS);
            if stretch.is_even && stretch.count >= FEWEST && long {
                found.push((stretch.last, next));
            }
        }
    }
    let sending: i64 = stretches.iter().map(|s| s.last.since(s.first)).sum();
    let quiet: i64 = found
        .iter()
        .filter_map(|(from, to)| Some((*to)?.since(*from)))
        .sum();
    if found.len() > OFTEN && quiet > sending / 4 {
        found.clear();
    }
    found
}

/// When all of several senders are silent, of whom at least one has a rhythm that broke.
pub(crate) fn all_silent(senders: &[&[Stretch]], lives: &[Span]) -> Vec<(Stamp, Option<Stamp>)> {
    let mut found: Vec<(Stamp, Option<Stamp>)> = Vec::new();
    for sender in senders {
        found.extend(silences(sender, lives));
    }
    found.sort_unstable();
    let mut all: Vec<(Stamp, Option<Stamp>)> = Vec::new();
    for (from, to) in found {
        // From the last message of any of them to the first of any.
        let sends = |s: &&Stretch| s.last > from && to.is_none_or(|to| s.first < to);
        let others = || senders.iter().flat_map(|s| s.iter()).filter(sends);
        if others().next().is_none()
            && all
                .last()
                .is_none_or(|last| last.1.is_some_and(|end| end <= from))
        {
            all.push((from, to));
        }
    }
    all
}
