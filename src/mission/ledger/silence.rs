//! Silences without a proof of an end: of nodes, and of topics whose senders all paused.

use std::collections::BTreeMap;

use super::make::{Drafts, LedgerInput};
use super::{EntryId, Kind};
use crate::base::time::{Span, Stamp};
use crate::graph::lives::{Bound, Known, Stretch, Voice, all_silent};
use crate::graph::{Element, NodeId, TopicId};

/// The beginning and end of a silence; `None` if to the end of the mission.
type Silence = (Stamp, Option<Stamp>);

/// Adds all silences.
pub(super) fn tell(told: &LedgerInput<'_>, drafts: &mut Drafts) {
    let pauses = Pauses::new(&told.lives.voices);
    let gone = Gone::new(drafts);
    let mut of_nodes: BTreeMap<NodeId, Vec<(Silence, EntryId)>> = BTreeMap::new();
    for (node, voices) in by(told, |v| v.node.filter(|_| !v.is_latched)) {
        let what = Element::Node(node);
        for silence in silences(told, what, &voices, &pauses) {
            let id = drafts.add(entry(told, what, silence, &voices));
            of_nodes.entry(node).or_default().push((silence, id));
        }
    }
    for (topic, voices) in by(told, |v| Some(v.topic).filter(|_| !v.is_latched)) {
        if told.is_by_the_way(topic) {
            continue;
        }
        for silence in silences(told, Element::Topic(topic), &voices, &pauses) {
            let mut entry = entry(told, Element::Topic(topic), silence, &voices);
            let nodes = voices.iter().filter_map(|v| of_nodes.get(&v.node?));
            let whole = nodes.flatten().find(|(of, _)| meet(*of, silence));
            let whole = whole.map(|(_, id)| *id);
            entry.part_of = whole.or_else(|| gone.at(&voices, silence.0));
            drafts.add(entry);
        }
    }
}

/// The longest time between the end of a sender and the silence of its topic caused by it, before or after, in
/// nanoseconds.
const WITH_ITS_SENDER_NS: i64 = 5_000_000_000;

/// The ends of nodes with their times, and the entries about them.
struct Gone(BTreeMap<NodeId, Vec<(Stamp, EntryId)>>);

impl Gone {
    fn new(drafts: &Drafts) -> Self {
        let mut gone: BTreeMap<NodeId, Vec<(Stamp, EntryId)>> = BTreeMap::new();
        for (id, entry) in (0..).zip(&drafts.list) {
            let whole = entry.part_of.unwrap_or(id);
            if let (Element::Node(node), Kind::Stopped | Kind::Restarted) = (entry.what, entry.kind)
            {
                gone.entry(node).or_default().push((entry.time, whole));
            }
        }
        Self(gone)
    }

    /// The entry about the end of one of these senders at that time.
    fn at(&self, voices: &[&Voice], time: Stamp) -> Option<EntryId> {
        let of = voices.iter().filter_map(|v| self.0.get(&v.node?));
        of.flatten()
            .find(|(end, _)| end.since(time).abs() <= WITH_ITS_SENDER_NS)
            .map(|(_, id)| *id)
    }
}

/// The voices of each node, or of each topic.
fn by<'a>(
    told: &LedgerInput<'a>,
    key: impl Fn(&Voice) -> Option<u32>,
) -> BTreeMap<TopicId, Vec<&'a Voice>> {
    let mut of: BTreeMap<u32, Vec<&Voice>> = BTreeMap::new();
    for voice in &told.lives.voices {
        if let Some(key) = key(voice) {
            of.entry(key).or_default().push(voice);
        }
    }
    of
}

fn silences(
    told: &LedgerInput<'_>,
    what: Element,
    voices: &[&Voice],
    pauses: &Pauses,
) -> Vec<Silence> {
    let spans = told.known(what).map(spans).unwrap_or_default();
    let stretches: Vec<&[Stretch]> = voices.iter().map(|v| &v.stretches[..]).collect();
    let mut all = all_silent(&stretches, &spans);
    all.retain(|silence| !pauses.hold(*silence));
    all
}

fn spans(known: &Known) -> Vec<Span> {
    known.lives.iter().map(|life| life.span).collect()
}

fn entry(
    told: &LedgerInput<'_>,
    what: Element,
    (from, to): Silence,
    voices: &[&Voice],
) -> super::Entry {
    let last = voices
        .iter()
        .flat_map(|v| &v.stretches)
        .filter(|s| s.last == from);
    let period = last.map(|s| s.period).max().unwrap_or(0);
    let mut entry = told.entry(
        Kind::Silent,
        what,
        Bound {
            time: from,
            earliest: from,
            latest: from.plus(period),
        },
    );
    entry.until = to;
    entry
}

/// Whether two silences share time.
fn meet(a: Silence, b: Silence) -> bool {
    let before = |a: Silence, b: Silence| a.1.is_some_and(|end| end <= b.0);
    !before(a, b) && !before(b, a)
}

/// The times without any message: the recording paused, not the robot.
struct Pauses(Vec<(Stamp, Stamp)>);

impl Pauses {
    fn new(voices: &[Voice]) -> Self {
        let sending = voices.iter().flat_map(|v| &v.stretches);
        let mut sending: Vec<_> = sending.map(|s| (s.first, s.last)).collect();
        sending.sort_unstable();
        let mut pauses = Vec::new();
        let mut until = sending.first().map_or(Stamp::MAX, |s| s.0);
        for (first, last) in sending {
            if first > until {
                pauses.push((until, first));
            }
            until = until.max(last);
        }
        Self(pauses)
    }

    /// Whether most of a silence lies in a pause of the recording.
    fn hold(&self, (from, to): Silence) -> bool {
        let Some(to) = to else {
            return false;
        };
        let inside = |(a, b): &(Stamp, Stamp)| (*b.min(&to)).since(*a.max(&from)).max(0);
        let paused: i64 = self.0.iter().map(inside).sum();
        paused > to.since(from) / 2
    }
}
