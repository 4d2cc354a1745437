//! Lives in continuous time: the beginning and end of each element with their uncertainty, and the sending of every
//! publisher.
//!
//! Nothing here depends on windows.

use std::sync::Arc;

use super::{NodeId, TopicId};
use crate::base::time::{Span, Stamp};
use crate::evidence::Degree;

/// A moment with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bound {
    /// The time of the sign that shows it.
    pub time: Stamp,
    /// The earliest possible time.
    pub earliest: Stamp,
    /// The latest possible time.
    pub latest: Stamp,
}

/// One life of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Life {
    /// The interval in which it exists, half-open.
    pub span: Span,
    /// The beginning; `None` if it may have existed before the mission began.
    pub began: Option<Bound>,
    /// The end; `None` if no end is known.
    pub ended: Option<Bound>,
}

/// A run of messages of one sender at one rate, without a gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stretch {
    /// The time of the first message.
    pub first: Stamp,
    /// The time of the last message.
    pub last: Stamp,
    /// The number of messages, ≥ 1.
    pub count: u64,
    /// The median time between messages in nanoseconds; 0 with fewer than two.
    pub period: i64,
    /// Whether the messages come at even intervals.
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

/// All messages of one sender on one topic.
#[derive(Clone, Debug, PartialEq)]
pub struct Voice {
    /// The topic.
    pub topic: TopicId,
    /// The node that sent; `None` where the bag does not tell.
    pub node: Option<NodeId>,
    /// Whether its last message is latched.
    pub is_latched: bool,
    /// The stretches of even sending, in order, none overlapping.
    pub stretches: Vec<Stretch>,
}

/// A transition of a node to a lifecycle state.
#[derive(Clone, Debug, PartialEq)]
pub struct Transition {
    /// The node.
    pub node: NodeId,
    /// The time.
    pub time: Stamp,
    /// The new state.
    pub state: Arc<str>,
}

/// The lives of all elements, by their places in [`super::Elements`], and all sending.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lives {
    /// The lives of each node, in order.
    pub nodes: Vec<Known>,
    /// The lives of each topic.
    pub topics: Vec<Known>,
    /// The lives of each publication.
    pub publishes: Vec<Known>,
    /// The lives of each subscription.
    pub subscribes: Vec<Known>,
    /// The messages of every sender, sorted by topic and node.
    pub voices: Vec<Voice>,
    /// Transitions of lifecycle states, sorted by time.
    pub transitions: Vec<Transition>,
}

impl Lives {
    /// Nodes that restarted under the same name, with the times; sorted by time.
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
    /// The strongest degree of evidence for it.
    pub degree: Degree,
    /// The lives, in order, none overlapping.
    pub lives: Vec<Life>,
}

/// The fewest messages before a pause that make a rhythm.
const FEWEST: u64 = 5;
/// The number of periods of silence that break a rhythm.
const BREAK: i64 = 5;
/// The shortest silence that breaks a rhythm, in nanoseconds: a recorder starts and stops writing topics up to a second
/// apart.
const BREAK_NS: i64 = 2_000_000_000;
/// The most pauses of a regular sender: one that pauses more often, and for more than a fifth of the time, sends only
/// when needed.
const OFTEN: usize = 4;

/// The silences of a sender with a rhythm while it lived (`lives`, half-open): from the last message to the next, or
/// `None` for no other. A sender of bursts is never silent.
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

/// The times at which all of several senders are silent, of which at least one has a rhythm that broke.
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
