//! Changes of rates: where two even stretches of one sender meet.

use super::make::{Drafts, LedgerInput};
use super::{Detail, Kind};
use crate::graph::Element;
use crate::graph::lives::{Bound, Stretch, Voice};

/// The fewest messages (5 intervals) of a rate that counts.
const FEWEST: u64 = 6;
/// The shortest time for which a rate must hold, in nanoseconds.
const HOLDS_NS: i64 = 3_000_000_000;
/// The longest pause of a sender while it takes another rate, in nanoseconds.
const PAUSE_NS: i64 = 5_000_000_000;

/// Adds all changes of rates.
pub(super) fn tell(told: &LedgerInput<'_>, drafts: &mut Drafts) {
    let voices = told.lives.voices.iter();
    for voice in voices.filter(|v| !v.is_latched && !told.is_by_the_way(v.topic)) {
        for pair in voice.stretches.windows(2) {
            let [before, after] = pair else { continue };
            if changes(before, after, told.rate_change) && !is_away(told, voice, before, after) {
                let what = told.sender(voice);
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
    let holds = |s: &Stretch| s.is_even && s.count >= FEWEST && s.last.since(s.first) >= HOLDS_NS;
    let differs = (after.hz() - before.hz()).abs() > share * before.hz().min(after.hz());
    let meets = after.is_joined || after.first.since(before.last) <= PAUSE_NS;
    holds(before) && holds(after) && differs && meets
}

/// Whether the sender restarted between the two.
fn is_away(told: &LedgerInput<'_>, voice: &Voice, before: &Stretch, after: &Stretch) -> bool {
    let known = told.known(told.sender(voice));
    let lives = known.into_iter().flat_map(|k| &k.lives);
    !after.is_joined
        && lives
            .filter_map(|life| life.ended)
            .any(|end| before.last <= end.latest && end.time <= after.first)
}

impl LedgerInput<'_> {
    /// The publication of a voice; its topic where the sender is unknown.
    pub(super) fn sender(&self, voice: &Voice) -> Element {
        let place = voice.node.and_then(|node| {
            let key = |e: &crate::graph::Edge| (e.node, e.topic);
            let edges = &self.elements.publishes;
            edges.binary_search_by_key(&(node, voice.topic), key).ok()
        });
        place
            .and_then(|at| u32::try_from(at).ok())
            .map_or(Element::Topic(voice.topic), Element::Publish)
    }
}
