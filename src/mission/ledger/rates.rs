//! Changes of rates: where two even stretches of one sender meet.

use super::make::{Drafts, LedgerInput};
use super::{Detail, Kind};
use crate::base::rhythm::{FEWEST_OF_RATE, RATE_HOLDS_NS, RATE_PAUSE_NS};
use crate::graph::Element;
use crate::graph::history::{Bound, Sender, Stretch};

/// Adds all changes of rates.
pub(super) fn tell(told: &LedgerInput<'_>, drafts: &mut Drafts) {
    let senders = told.history.sending.senders.iter();
    for sender in senders.filter(|v| !v.is_latched && !told.is_by_the_way(v.topic)) {
        for pair in sender.stretches.windows(2) {
            let [before, after] = pair else { continue };
            if changes(before, after, told.rate_change) && !is_away(told, sender, before, after) {
                let what = told.publication(sender);
                let width = before.period.max(after.period);
                let mut entry = told.entry(
                    Kind::Rate,
                    what,
                    Bound {
                        time: after.first,
                        earliest: before.last.min(after.first.plus(-width)),
                        latest: after.first.plus(width),
                    },
                );
                entry.detail = Detail::Rates {
                    from_hz: before.hz(),
                    to_hz: after.hz(),
                };
                drafts.add(entry);
            }
        }
    }
}

/// Whether a steady rate becomes another one.
fn changes(before: &Stretch, after: &Stretch, share: f64) -> bool {
    let holds = |s: &Stretch| {
        s.is_even && s.count >= FEWEST_OF_RATE && s.last.since(s.first) >= RATE_HOLDS_NS
    };
    let differs = (after.hz() - before.hz()).abs() > share * before.hz().min(after.hz());
    let meets = after.is_joined || after.first.since(before.last) <= RATE_PAUSE_NS;
    holds(before) && holds(after) && differs && meets
}

/// Whether the sender restarted between the two.
fn is_away(told: &LedgerInput<'_>, sender: &Sender, before: &Stretch, after: &Stretch) -> bool {
    let lives = told.lives(told.publication(sender)).iter();
    !after.is_joined
        && lives
            .filter_map(|life| life.ended)
            .any(|end| before.last <= end.latest && end.time <= after.first)
}

impl LedgerInput<'_> {
    /// The publication of a sender; its topic where the sender is unknown.
    pub(super) fn publication(&self, sender: &Sender) -> Element {
        let edge = sender
            .node
            .and_then(|node| self.elements.publication(node, sender.topic));
        edge.map_or(Element::Topic(sender.topic), Element::Publish)
    }
}
