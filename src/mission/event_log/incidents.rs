//! Remarks about elements: subscribers that receive nothing, duplicate names, messages that the recorder lost, which
//! explain silences, and the input switches of a mux.

use super::make::{Drafts, LogInput, exact};
use super::{Detail, EventId, Kind};
use crate::base::rhythm::CLOSE_NS;
use crate::base::time::Stamp;
use crate::evidence::Confidence;
use crate::evidence::inference::IncidentKind;
use crate::evidence::observation::Name;
use crate::graph::{Element, NodeId};

/// Adds all of them.
pub(super) fn add(context: &LogInput<'_>, drafts: &mut Drafts) {
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
        let mut event = context.event(kind, incident.what, exact(incident.time));
        event.until = incident.until;
        event.detail = detail;
        event.confidence = match kind {
            Kind::HandedOver => Confidence::Inferred,
            _ => Confidence::Stated,
        };
        event.evidence = incident.evidence;
        let id = drafts.add(event);
        if kind == Kind::Lost {
            let until = incident.until.unwrap_or(incident.time);
            explain(drafts, id, incident.what, (incident.time, until));
        }
    }
}

/// The known publishers of a topic.
fn publishers(context: &LogInput<'_>, topic: Name) -> Vec<NodeId> {
    let topic = context.history.topic_ids.some(topic);
    let edges = context.elements.publishes.iter();
    let own = edges.filter(|edge| Some(&edge.topic) == topic && !edge.seen.evidence.is_guess());
    own.map(|edge| edge.node).collect()
}

/// Makes the silences of a topic and of its nodes parts of the loss that explains them. A loss is reported after it
/// happened.
fn explain(drafts: &mut Drafts, loss: EventId, topic: Element, (from, to): (Stamp, Stamp)) {
    let list = &mut drafts.list;
    let silences = list.with_ids().filter(|(_, e)| {
        let is_then = e.time <= to && e.until.is_none_or(|end| from <= end.plus(CLOSE_NS));
        e.kind == Kind::Silent && e.what == topic && is_then
    });
    let wholes: Vec<EventId> = silences.map(|(id, e)| e.part_of.unwrap_or(id)).collect();
    for whole in wholes {
        let is_silence = list.get(whole).is_some_and(|e| e.kind == Kind::Silent);
        for (id, event) in list.ids().zip(list.iter_mut()) {
            if is_silence && (id == whole || event.part_of == Some(whole)) {
                event.part_of = Some(loss);
            }
        }
    }
}
