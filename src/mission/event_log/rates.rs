//! Rate changes: between two adjacent even stretches of one sender.
//!
//! For example, `/camera` sends `/image` at 30 Hz for 20 s and then at 5 Hz for 10 s: a change of its rate at the first message of
//! the second stretch. At 5 Hz for 2 s it would be none, and none after a pause in which `/camera` restarted.

use super::drafts::{Drafts, LogInput};
use super::{Detail, Kind};
use crate::base::rhythm::{ABOUT_NONE, FEWEST, RATE_PAUSE_NS};
use crate::graph::Element;
use crate::graph::history::{Bound, Sender, Stretch, hide};

/// The error of a rate as a fraction of it: a step from 8 to 10 Hz is not more than a quarter.
const EXACT: f64 = 0.01;

/// Adds all changes of rates.
pub(super) fn add(context: &LogInput<'_>, drafts: &mut Drafts) {
    let senders = context.history.sending.senders.iter();
    for sender in senders.filter(|v| !v.is_latched && !context.is_by_the_way(v.topic)) {
        let mut start = 0;
        for (pair, end) in sender.stretches.windows(2).zip(1..) {
            let (before, after) = (&pair[0], &pair[1]);
            start = if before.has_rate() { end } else { start };
            let gap = (before.last, Some(after.first));
            let none = about_none(&sender.stretches[start..end], after);
            let none = none.filter(|_| !hide(&context.history.pauses, gap));
            let is_change = changes(before, after, context.rate_change);
            let from_hz = none.or_else(|| is_change.then(|| before.hz()));
            let Some(from_hz) = from_hz.filter(|_| !is_away(context, sender, before, after)) else {
                continue;
            };
            let factor = after.hz() / before.hz();
            if context.history.simulation.explains(after.first, factor) {
                continue;
            }
            // Stray messages are not uncertain: the rate begins with its first message.
            let last = none.map_or(before.last, |_| after.first);
            let at = Bound::new(
                after.first,
                last.min(after.first.plus(-before.period)),
                after.first.plus(after.period),
            );
            let mut event = context.event(Kind::Rate, context.publication(sender), at);
            event.detail = Detail::Rates {
                from_hz,
                to_hz: after.hz(),
            };
            drafts.add(event);
        }
    }
}

/// The rate of the stray messages, since the last rate, from which a steady rate begins, such as 0.01 Hz of one message 90 s before;
/// `None` if it does not, or if they are enough to show a rhythm.
fn about_none(strays: &[Stretch], after: &Stretch) -> Option<f64> {
    // Each has a message, so that many need not be counted at each of many stretches.
    let count: u64 = strays.iter().zip(0..FEWEST).map(|(s, _)| s.count).sum();
    let (first, last) = (strays.first()?.first, strays.last()?.last);
    let hz = count as f64 * 1e9 / after.first.since(first).max(1) as f64;
    let begins = count < FEWEST && after.has_rate() && hz * ABOUT_NONE < after.hz();
    (begins && after.first.since(last) > RATE_PAUSE_NS).then_some(hz)
}

/// Whether a steady rate changes to another one.
fn changes(before: &Stretch, after: &Stretch, share: f64) -> bool {
    let step = (after.hz() - before.hz()).abs() / before.hz().min(after.hz());
    let differs = step > share + EXACT;
    let meets = after.is_joined || after.first.since(before.last) <= RATE_PAUSE_NS;
    before.has_rate() && after.has_rate() && differs && meets
}

/// Whether the sender restarted between the two.
fn is_away(context: &LogInput<'_>, sender: &Sender, before: &Stretch, after: &Stretch) -> bool {
    let lives = context.lives(context.publication(sender)).iter();
    let mut ends = lives.filter_map(|life| life.ended);
    !after.is_joined && ends.any(|end| before.last <= end.latest && end.time <= after.first)
}

impl LogInput<'_> {
    /// The publication of a sender; its topic if the sender is unknown.
    pub(super) fn publication(&self, sender: &Sender) -> Element {
        let edge = |node| self.elements.publication(node, sender.topic);
        let edge = sender.node.and_then(edge);
        edge.map_or(Element::Topic(sender.topic), Element::Publish)
    }
}
