//! Remarks about elements: subscribers that receive nothing, duplicate names, messages that the recorder lost, which
//! explain silences, and the input switches of a mux.

use super::make::{Drafts, LedgerInput, exact};
use super::{Detail, EntryId, Kind};
use crate::base::rhythm::CLOSE_NS;
use crate::base::time::Stamp;
use crate::evidence::Degree;
use crate::evidence::claim::Name;
use crate::evidence::proof::IncidentKind;
use crate::graph::{Element, NodeId};

/// Adds all of them.
pub(super) fn tell(context: &LedgerInput<'_>, drafts: &mut Drafts) {
    for incident in &context.history.incidents {
        let (kind, detail) = match &incident.kind {
            IncidentKind::Starved(policy) => {
                let (from, to) = ("".into(), policy.clone());
                (Kind::Starved, Detail::Values { from, to })
            }
            IncidentKind::Duplicate => (Kind::Duplicate, Detail::None),
            IncidentKind::Lost(many) => (Kind::Lost, Detail::Count(*many)),
            IncidentKind::Turn(from, to) => {
                let [from, to] = [from, to].map(|topic| publishers(context, *topic));
                if from.is_empty() || to.is_empty() || from == to {
                    continue;
                }
                (Kind::HandedOver, Detail::Senders { from, to })
            }
        };
        let mut entry = context.entry(kind, incident.what, exact(incident.time));
        entry.until = incident.until;
        entry.detail = detail;
        entry.degree = match kind {
            Kind::HandedOver => Degree::Inferred,
            _ => Degree::Stated,
        };
        entry.evidence = incident.evidence;
        let id = drafts.add(entry);
        if kind == Kind::Lost {
            let until = incident.until.unwrap_or(incident.time);
            explain(drafts, id, incident.what, (incident.time, until));
        }
    }
}

/// The known publishers of a topic.
fn publishers(context: &LedgerInput<'_>, topic: Name) -> Vec<NodeId> {
    let topic = context.history.topic_ids.get(&topic);
    let edges = context.elements.publishes.iter();
    let own = edges.filter(|edge| Some(&edge.topic) == topic && !edge.evidence.is_guess());
    own.map(|edge| edge.node).collect()
}

/// Makes the silences of a topic and of its nodes parts of the loss that explains them. A loss is reported after it
/// happened.
fn explain(drafts: &mut Drafts, loss: EntryId, topic: Element, (from, to): (Stamp, Stamp)) {
    let list = &mut drafts.list;
    let silences = (0..).zip(list.iter()).filter(|(_, e)| {
        let is_then = e.time <= to && e.until.is_none_or(|end| from <= end.plus(CLOSE_NS));
        e.kind == Kind::Silent && e.what == topic && is_then
    });
    let wholes: Vec<EntryId> = silences.map(|(id, e)| e.part_of.unwrap_or(id)).collect();
    for whole in wholes {
        let is_silence = list
            .get(whole as usize)
            .is_some_and(|e| e.kind == Kind::Silent);
        for (id, entry) in (0..).zip(list.iter_mut()) {
            if is_silence && (id == whole || entry.part_of == Some(whole)) {
                entry.part_of = Some(loss);
            }
        }
    }
}
