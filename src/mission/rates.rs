//! The rate of every sender over the mission, in pieces: a piece ends where the log has another rate, or at a long silence.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::Mission;
use super::event_log::Kind;
use crate::base::ids::grouped;
use crate::base::name::is_unnamed;
use crate::base::rhythm::FEWEST;
use crate::base::time::{Span, Stamp};
use crate::graph::history::{Sender, Sending, Stretch};
use crate::graph::{ById, EdgeId, Element, NodeId, TopicId};

/// The length above which a silence visibly interrupts a rate: in nanoseconds, and as a fraction of the
/// mission (one in so many).
const SILENCE: (i64, i64) = (4_000_000_000, 83);
/// The shortest visible piece, as a fraction of the mission (one in so many). Shorter ones join the previous one.
const SEEN: i64 = 400;

/// An interval at one rate, in messages per second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    pub(crate) span: Span,
    pub(crate) hz: f64,
}

/// A role that sends a topic, with the times in which it does: at least one, sorted and disjoint.
pub(crate) struct Holder<'a> {
    pub(crate) role: &'a str,
    pub(crate) times: Vec<Span>,
}

impl Holder<'_> {
    pub(crate) fn start(&self) -> Stamp {
        self.times.first().map_or(Stamp::MAX, |time| time.start)
    }

    pub(crate) fn end(&self) -> Stamp {
        self.times.last().map_or(Stamp::MIN, |time| time.end)
    }
}

/// The rates of a mission's senders.
pub(crate) struct Rates<'a> {
    mission: &'a Mission,
    /// The times at which the log has steps of rates, by topic and node.
    steps: BTreeSet<(TopicId, Option<NodeId>, Stamp)>,
    /// The only publication of each topic; `None` if there are several.
    sole: ById<TopicId, Option<EdgeId>>,
}

impl<'a> Rates<'a> {
    pub(crate) fn new(mission: &'a Mission) -> Self {
        let events = mission.log.events.iter();
        let steps = events.filter(|e| e.kind == Kind::Rate).filter_map(|e| {
            let (node, topic) = mission.elements.ends(e.what);
            Some((topic?, node, e.time))
        });
        Self {
            steps: steps.collect(),
            sole: mission.elements.sole_publishers(),
            mission,
        }
    }

    /// The messages of some publications; for the only one of its topic, and for those of unknown publishers, all that are
    /// not known to come from others. A latched publication represents its node by its message, and has no rate.
    pub(crate) fn senders(&self, edges: &[EdgeId]) -> Vec<&'a Sender> {
        let sending = &self.mission.sending;
        let sender = |id: &EdgeId| {
            let edge = self.mission.elements.publishes.get(*id)?;
            let own = sending.of_edge(edge.node, edge.topic);
            let is_sole = self.sole.get(edge.topic) == Some(&Some(*id))
                || is_unnamed(self.mission.elements.nodes[edge.node].name.as_str());
            let mut of_topic = sending.of_topic(edge.topic).iter();
            own.or_else(|| of_topic.find(|s| s.node.is_none()).filter(|_| is_sole))
        };
        let senders = edges.iter().filter_map(sender);
        senders.filter(|sender| !sender.is_latched).collect()
    }

    /// The messages on a topic, as far as they are not latched.
    pub(crate) fn of_topic(&self, topic: TopicId) -> Vec<&'a Sender> {
        let senders = self.mission.sending.of_topic(topic).iter();
        senders.filter(|sender| !sender.is_latched).collect()
    }

    /// The roles that send a topic with the times in which they do, in order of these.
    pub(crate) fn holders(&self, topic: TopicId) -> Vec<Holder<'a>> {
        let nodes = &self.mission.elements.nodes;
        let senders = self.of_topic(topic).into_iter();
        let roles = grouped(senders.filter_map(|s| Some((&nodes[s.node?].role, s))));
        let holder = |(role, senders): (&'a Arc<str>, Vec<&Sender>)| {
            let times = self.of(&senders).iter().map(|piece| piece.span).collect();
            let times = Span::joined(times, 0);
            (!times.is_empty()).then_some(Holder { role, times })
        };
        let mut holders: Vec<Holder<'_>> = roles.into_iter().filter_map(holder).collect();
        holders.sort_by_key(Holder::start);
        holders
    }

    /// The publications among some elements; on the topic of this name, if one is given.
    pub(crate) fn publications(&self, among: &[Element], topic: Option<&str>) -> Vec<EdgeId> {
        let elements = &self.mission.elements;
        let is_on =
            |id: &EdgeId| topic.is_none_or(|_| elements.names(Element::Publish(*id)).1 == topic);
        let edges = among.iter().filter_map(|what| match what {
            Element::Publish(id) => Some(*id),
            _ => None,
        });
        edges.filter(is_on).collect()
    }

    /// The rate of some senders together over time. Pieces too short to be visible belong to their neighbours, and so do
    /// silences.
    pub(crate) fn of(&self, senders: &[&Sender]) -> Vec<Piece> {
        let rates: Vec<Vec<Piece>> = senders.iter().map(|sender| self.pieces(sender)).collect();
        summed(&rates, self.mission.span)
    }

    /// The mean rate of some senders together while they send: their pauses are left out. `None` with fewer messages than
    /// show a rhythm: four within 35 ms are not 113 Hz.
    pub(crate) fn while_sending(&self, senders: &[&Sender]) -> Option<f64> {
        let count = Sending::count(senders.iter().copied());
        if count < FEWEST {
            return None;
        }
        if let [_] = senders {
            return mean(&self.of(senders));
        }
        // Several that rarely send have no rates of their own, so their messages are counted.
        let stretches = senders.iter().flat_map(|sender| &sender.stretches);
        let spans = stretches.map(|s| Span::new(s.first, s.last.plus(1)));
        let spans = Span::joined(spans.collect(), silence(self.mission.span));
        let nanos: i64 = spans.iter().map(|span| span.nanos() - 1).sum();
        let intervals = count.checked_sub(spans.len() as u64)?;
        (nanos > 1_000_000 && intervals > 0).then(|| intervals as f64 * 1e9 / nanos as f64)
    }

    /// The rates of a sender: its stretches, joined unless a step of the log or a long silence separates
    /// them.
    fn pieces(&self, sender: &Sender) -> Vec<Piece> {
        let least = silence(self.mission.span);
        let is_step = |at: Stamp| {
            let is = |node| self.steps.contains(&(sender.topic, node, at));
            is(sender.node) || is(None)
        };
        let joins = |a: &Stretch, b: &Stretch| !is_step(b.first) && b.first.since(a.last) < least;
        let runs = sender.stretches.chunk_by(joins);
        let piece = |run: &[Stretch]| {
            let (start, end) = (run.first()?.first, run.last()?.last);
            let nanos = end.since(start);
            let count: u64 = run.iter().fold(0, |n, s| n.saturating_add(s.count));
            let mean = count.saturating_sub(1) as f64 * 1e9 / nanos.max(1) as f64;
            Some(Piece {
                span: Span::new(start, end.plus(1)),
                hz: match run {
                    [one] => one.hz(),
                    _ if nanos > 0 => mean,
                    _ => 0.0,
                },
            })
        };
        runs.filter_map(piece).collect()
    }
}

/// The smallest relative difference of two rates after each other that is written as a step: of the same rate before and
/// after a silence, the measured ones differ by a few hundredths.
const STEP: f64 = 0.05;

/// The rates of some pieces in order, those that are nearly equal as one; none if there is only one.
pub(crate) fn steps(pieces: &[Piece]) -> Vec<f64> {
    let mut steps: Vec<f64> = pieces.iter().map(|piece| piece.hz).collect();
    steps.dedup_by(|a, b| are_close(*a, *b));
    steps.truncate(if steps.len() > 1 { steps.len() } else { 0 });
    steps
}

/// Whether two rates look the same.
pub(crate) fn are_close(a: f64, b: f64) -> bool {
    (a - b).abs() <= STEP * a.max(b)
}

/// The mean rate over some pieces; `None` if they have no length.
fn mean(pieces: &[Piece]) -> Option<f64> {
    let seconds = |p: &Piece| (p.span.nanos() - 1) as f64 / 1e9;
    let time: f64 = pieces.iter().map(seconds).sum();
    let count: f64 = pieces.iter().map(|p| p.hz * seconds(p)).sum();
    (time > 1e-3).then(|| count / time)
}

/// The length above which a silence visibly interrupts a rate in a mission of this length.
pub(crate) fn silence(whole: Span) -> i64 {
    SILENCE.0.max(whole.nanos() / SILENCE.1)
}

/// The sum of several rates over time. Pieces too short to be visible belong to their neighbours, and so do silences.
fn summed(rates: &[Vec<Piece>], whole: Span) -> Vec<Piece> {
    // The changes of the rate, and of the number of senders.
    let mut turns: BTreeMap<Stamp, (f64, i64)> = BTreeMap::new();
    for piece in rates.iter().flatten() {
        for (at, sign) in [(piece.span.start, 1), (piece.span.end, -1)] {
            let turn = turns.entry(at).or_default();
            *turn = (turn.0 + piece.hz * sign as f64, turn.1 + sign);
        }
    }
    let is_short = |span: Span| span.nanos() < whole.nanos() / SEEN;
    let mut found: Vec<Piece> = Vec::new();
    let (mut hz, mut many) = (0.0, 0);
    for ((at, turn), end) in turns.iter().zip(turns.keys().skip(1)) {
        (hz, many) = (hz + turn.0, many + turn.1);
        let new = Piece {
            span: Span::new(*at, *end),
            hz: f64::max(hz, 0.0),
        };
        let before = found.last_mut();
        match before.filter(|last| at.since(last.span.end) < silence(whole)) {
            _ if many == 0 => {}
            Some(last) if same(last.hz, new.hz) || is_short(new.span) => last.span.end = *end,
            Some(last) if is_short(last.span) => (last.span.end, last.hz) = (*end, new.hz),
            Some(last) => {
                last.span.end = *at;
                found.push(new);
            }
            None => found.push(new),
        }
    }
    found
}

/// Whether two rates cannot be distinguished as heights of bars.
pub(crate) fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 0.01 * a.max(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    fn span(from: i64, to: i64) -> Span {
        Span::new(Stamp(from * SECOND), Stamp(to * SECOND))
    }

    fn reported(rates: &[&[(i64, i64, f64)]]) -> Vec<(i64, i64, f64)> {
        let pieces = |all: &&[(i64, i64, f64)]| {
            let piece = |(from, to, hz): &(i64, i64, f64)| Piece {
                span: span(*from, *to),
                hz: *hz,
            };
            all.iter().map(piece).collect::<Vec<Piece>>()
        };
        let rates: Vec<Vec<Piece>> = rates.iter().map(pieces).collect();
        let second = |at: Stamp| at.0 / SECOND;
        let all = summed(&rates, span(0, 800)).into_iter();
        all.map(|p| (second(p.span.start), second(p.span.end), libm::round(p.hz)))
            .collect()
    }

    #[test]
    fn rates_add_up_while_they_overlap() {
        let found = reported(&[&[(0, 100, 10.0)], &[(50, 200, 5.0)]]);
        assert_eq!(found, [(0, 50, 10.0), (50, 100, 15.0), (100, 200, 5.0)]);
    }

    #[test]
    fn invisibly_short_runs_are_not_steps() {
        let found = reported(&[&[(0, 100, 10.0)], &[(1, 100, 5.0)]]);
        assert_eq!(found, [(0, 100, 15.0)]);
        let found = reported(&[&[(0, 100, 10.0), (103, 200, 10.0)]]);
        assert_eq!(found, [(0, 200, 10.0)]);
        let found = reported(&[&[(0, 100, 10.0), (150, 200, 10.0)]]);
        assert_eq!(found, [(0, 100, 10.0), (150, 200, 10.0)]);
    }
}
