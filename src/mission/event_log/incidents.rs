//! Statements that are events as they are: subscribers that receive nothing, duplicate names, messages that the recorder lost,
//! which explain silences, the input switches of a mux, and lifecycle states.
//!
//! For example, the recorder reports at 31 s that it lost 80 messages of `/scan`, which was silent from 28 s to 30 s: that silence
//! is a part of the loss.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::drafts::{Drafts, LogInput, exact};
use super::{Detail, Event, EventId, Kind};
use crate::base::rhythm::CLOSE_NS;
use crate::base::time::Stamp;
use crate::evidence::inference::IncidentKind;
use crate::evidence::observation::Name;
use crate::evidence::{Confidence, Evidence};
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
            IncidentKind::Lost(many) => (Kind::Lost, Detail::Count { count: *many }),
            IncidentKind::Switch(from, to) => {
                let [from, to] = [from, to].map(|topic| publishers(context, *topic));
                if from.is_empty() || to.is_empty() || from == to {
                    continue;
                }
                (Kind::HandedOver, Detail::Senders { from, to })
            }
        };
        let id = drafts.add(Event {
            until: incident.until,
            detail,
            confidence: match kind {
                Kind::HandedOver => Confidence::Inferred,
                _ => Confidence::Stated,
            },
            evidence: incident.evidence,
            ..context.event(kind, incident.what, exact(incident.time))
        });
        if kind == Kind::Lost {
            let until = incident.until.unwrap_or(incident.time);
            explain(drafts, id, incident.what, (incident.time, until));
        }
    }
}

/// Adds the changes of nodes' lifecycle states. A node that starts again has none of its earlier states.
pub(super) fn add_lifecycles(context: &LogInput<'_>, drafts: &mut Drafts) {
    let mut states: BTreeMap<(NodeId, Option<usize>), Arc<str>> = BTreeMap::new();
    let is_of_windows = !context.history.sending.knows_messages();
    for change in &context.history.transitions {
        let what = Element::Node(change.node);
        let mut lives = context.lives(what).iter();
        let life = lives.position(|life| life.span.contains(change.time));
        let before = states.insert((change.node, life), change.state.clone());
        // The first window of a node shows its state, and no change.
        let is_first = before.is_none() && is_of_windows;
        let (from, to) = (before.unwrap_or_default(), change.state.clone());
        if from != to && !is_first {
            drafts.add(Event {
                confidence: Confidence::Stated,
                evidence: Evidence::of("lifecycle"),
                detail: Detail::Values { from, to },
                ..context.event(Kind::Lifecycle, what, exact(change.time))
            });
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
    let silences = drafts.list.with_ids().filter(|(_, e)| {
        let is_then = e.time <= to && e.until.is_none_or(|end| from <= end.plus(CLOSE_NS));
        e.kind == Kind::Silent && e.what == topic && is_then
    });
    let wholes: Vec<EventId> = silences.map(|(id, e)| e.part_of.unwrap_or(id)).collect();
    for whole in wholes {
        if drafts.get(whole).kind == Kind::Silent {
            drafts.fold(whole, loss);
        }
    }
}
