//! Silences without proof of an end: of nodes, and of topics whose senders all paused.

use std::collections::BTreeMap;

use super::make::{Drafts, LedgerInput};
use super::{EntryId, Kind};
use crate::base::rhythm::TOGETHER_NS;
use crate::base::time::Stamp;
use crate::graph::history::{Bound, Sender};
use crate::graph::{Element, NodeId, Record, TopicId};

/// The beginning and end of a silence; `None` if to the end of the mission.
type Silence = (Stamp, Option<Stamp>);

/// Adds all silences.
pub(super) fn tell(context: &LedgerInput<'_>, drafts: &mut Drafts) {
    let gone = Gone::new(drafts);
    let mut of_nodes: BTreeMap<NodeId, Vec<(Silence, EntryId)>> = BTreeMap::new();
    for (node, senders) in by(context, |v| v.node.filter(|_| !v.is_latched)) {
        let what = Element::Node(node);
        for silence in silences(context, what) {
            let id = drafts.add(entry(context, what, *silence, &senders));
            of_nodes.entry(node).or_default().push((*silence, id));
        }
    }
    for (topic, senders) in by(context, |v| Some(v.topic).filter(|_| !v.is_latched)) {
        if context.is_by_the_way(topic) {
            continue;
        }
        for silence in silences(context, Element::Topic(topic)) {
            let mut entry = entry(context, Element::Topic(topic), *silence, &senders);
            let nodes = senders.iter().filter_map(|v| of_nodes.get(&v.node?));
            let whole = nodes.flatten().find(|(of, _)| meet(*of, *silence));
            let whole = whole.map(|(_, id)| *id);
            entry.part_of = whole.or_else(|| gone.at(&senders, silence.0));
            drafts.add(entry);
        }
    }
}

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
    fn at(&self, senders: &[&Sender], time: Stamp) -> Option<EntryId> {
        let of = senders.iter().filter_map(|v| self.0.get(&v.node?));
        of.flatten()
            .find(|(end, _)| end.since(time).abs() <= TOGETHER_NS)
            .map(|(_, id)| *id)
    }
}

/// The senders of each node, or of each topic.
fn by<'a>(
    context: &LedgerInput<'a>,
    key: impl Fn(&Sender) -> Option<u32>,
) -> BTreeMap<TopicId, Vec<&'a Sender>> {
    let mut of: BTreeMap<u32, Vec<&Sender>> = BTreeMap::new();
    for voice in &context.history.sending.senders {
        if let Some(key) = key(voice) {
            of.entry(key).or_default().push(voice);
        }
    }
    of
}

/// The silences of an element.
fn silences<'a>(context: &LedgerInput<'a>, what: Element) -> &'a [Silence] {
    context
        .history
        .records
        .of(what)
        .map_or(&[], Record::silences)
}

fn entry(
    context: &LedgerInput<'_>,
    what: Element,
    (from, to): Silence,
    senders: &[&Sender],
) -> super::Entry {
    let last = senders
        .iter()
        .flat_map(|v| &v.stretches)
        .filter(|s| s.last == from);
    let period = last.map(|s| s.period).max().unwrap_or(0);
    let mut entry = context.entry(
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

/// Whether two silences overlap.
fn meet(a: Silence, b: Silence) -> bool {
    let before = |a: Silence, b: Silence| a.1.is_some_and(|end| end <= b.0);
    !before(a, b) && !before(b, a)
}
