//! Statements about the graph other than about which elements exist: subscribers that receive nothing, names
//! used twice, messages that the recorder lost.

use std::sync::Arc;

use super::{Conclusions, ElementKey};
use crate::base::rhythm::CLOSE_NS;
use crate::base::time::Stamp;
use crate::evidence::observation::{Name, SourceId};

/// The kind of an incident, with what is stated about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum IncidentKind {
    /// A subscriber receives nothing, because this policy of its quality of service is incompatible; empty if none is named.
    Starved(Arc<str>),
    /// Two nodes have the same name.
    Duplicate,
    /// The recorder lost so many messages.
    Lost(u64),
    /// A node that forwarded the messages of one topic now forwards those of another.
    Turn(Name, Name),
}

/// A statement about an element.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Incident {
    pub(crate) what: ElementKey,
    pub(crate) kind: IncidentKind,
    pub(crate) source: SourceId,
    pub(crate) time: Stamp,
    /// The time of the last statement of a run of equal ones.
    pub(crate) until: Option<Stamp>,
}

impl Conclusions<'_> {
    /// Adds an incident; one shortly after another of its kind about the same element is merged with it.
    pub(crate) fn incident(
        &mut self,
        source: SourceId,
        what: ElementKey,
        kind: IncidentKind,
        time: Stamp,
    ) {
        let own = |old: &&mut Incident| old.what == what && (old.source == source);
        if let Some(last) = self.incidents.iter_mut().rev().find(own)
            && time.since(last.until.unwrap_or(last.time)) <= CLOSE_NS
        {
            let is_same = match (&mut last.kind, &kind) {
                (IncidentKind::Lost(all), IncidentKind::Lost(more)) => {
                    *all = all.saturating_add(*more);
                    true
                }
                (old, new) => old == new,
            };
            if is_same {
                last.until = Some(time).filter(|time| *time > last.time);
                return;
            }
        }
        self.incidents.push(Incident {
            what,
            kind,
            source,
            time,
            until: None,
        });
    }
}
