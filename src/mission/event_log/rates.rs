//! Rate changes: between two adjacent even stretches of one sender.
//!
//! For example, `/camera` sends `/image` at 30 Hz for 20 s and then at 5 Hz for 10 s: a change of its rate at the first message of
//! the second stretch. At 5 Hz for 2 s it would be none, and none after a pause in which `/camera` restarted.

use super::drafts::{Drafts, LogInput};
use super::{Detail, Kind};
use crate::base::rhythm::{FEWEST_OF_RATE, RATE_HOLDS_NS, RATE_PAUSE_NS};
use crate::graph::Element;
use crate::graph::history::{Bound, Sender, Stretch};

/// The error of a rate as a fraction of it: a step from 8 to 10 Hz is not more than a quarter.
const EXACT: f64 = 0.01;

/// Adds all changes of rates.
pub(super) fn add(context: &LogInput<'_>, drafts: &mut Drafts) {
    let senders = context.history.sending.senders.iter();
    for sender in senders.filter(|v| !v.is_latched && !context.is_by_the_way(v.topic)) {
        for pair in sender.stretches.windows(2) {
            let (before, after) = (&pair[0], &pair[1]);
            if !changes(before, after, context.rate_change)
                || is_away(context, sender, before, after)
            {
                continue;
            }
            let factor = after.hz() / before.hz();
            if context.history.simulation.explains(after.first, factor) {
                continue;
            }
            let at = Bound {
                time: after.first,
                earliest: before.last.min(after.first.plus(-before.period)),
                latest: after.first.plus(after.period),
            };
            let mut event = context.event(Kind::Rate, context.publication(sender), at);
            event.detail = Detail::Rates {
                from_hz: before.hz(),
                to_hz: after.hz(),
            };
            drafts.add(event);
        }
    }
}

/// Whether a steady rate changes to another one.
fn changes(before: &Stretch, after: &Stretch, share: f64) -> bool {
    let holds = |s: &Stretch| {
        s.is_even && s.count >= FEWEST_OF_RATE && s.last.since(s.first) >= RATE_HOLDS_NS
    };
    let step = (after.hz() - before.hz()).abs() / before.hz().min(after.hz());
    let differs = step > share + EXACT;
    let meets = after.is_joined || after.first.since(before.last) <= RATE_PAUSE_NS;
    holds(before) && holds(after) && differs && meets
}

/// Whether the sender restarted between the two.
fn is_away(context: &LogInput<'_>, sender: &Sender, before: &Stretch, after: &Stretch) -> bool {
    let lives = context.lives(context.publication(sender)).iter();
    !after.is_joined
        && lives
            .filter_map(|life| life.ended)
            .any(|end| before.last <= end.latest && end.time <= after.first)
}

impl LogInput<'_> {
    /// The publication of a sender; its topic if the sender is unknown.
    pub(super) fn publication(&self, sender: &Sender) -> Element {
        let edge = sender
            .node
            .and_then(|node| self.elements.publication(node, sender.topic));
        edge.map_or(Element::Topic(sender.topic), Element::Publish)
    }
}
