//! Stated values of elements: lifecycle states, types and quality of service.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::Arc;

use crate::base::name::SERVICE;
use crate::base::time::{Span, Stamp};
use crate::evidence::observation::{Name, Observation, Observations};

/// Stated values by node or topic.
#[derive(Debug, Default)]
pub(crate) struct StatedValues {
    /// The states of each node with the times of its transitions, sorted.
    states: BTreeMap<Name, Vec<(Stamp, Arc<str>)>>,
    types: BTreeMap<Name, BTreeSet<Arc<str>>>,
    qualities: BTreeMap<Name, BTreeSet<Arc<str>>>,
}

impl StatedValues {
    pub(crate) fn new(facts: &Observations, role: impl Fn(Name) -> Name) -> io::Result<Self> {
        let mut all = Self::default();
        for fact in &facts.list {
            match fact.observation {
                Observation::Lifecycle(node, state) => {
                    let state = facts.text(state);
                    let times = facts.times(fact)?.into_iter();
                    let states = all.states.entry(role(node)).or_default();
                    states.extend(times.map(|time| (time, Arc::clone(&state))));
                }
                Observation::Type(topic, kind) => {
                    all.types.entry(topic).or_default().insert(facts.text(kind));
                }
                Observation::Quality(topic, words) => {
                    all.qualities
                        .entry(topic)
                        .or_default()
                        .insert(facts.text(words));
                }
                _ => {}
            }
        }
        for states in all.states.values_mut() {
            states.sort();
        }
        Ok(all)
    }

    /// Adds a type that the user states. The type of services is ignored if the actual type is known.
    pub(crate) fn state_type(&mut self, topic: Name, kind: &str) {
        let kinds = self.types.entry(topic).or_default();
        if kind != SERVICE || kinds.is_empty() {
            kinds.remove(SERVICE);
            kinds.insert(kind.into());
        }
    }

    /// The state of a node at the end of a window; `None` before its first transition.
    pub(crate) fn lifecycle(&self, node: Name, window: Span) -> Option<Arc<str>> {
        let states = self.states.get(&node)?;
        let next = states.partition_point(|(time, _)| *time < window.end);
        states
            .get(next.checked_sub(1)?)
            .map(|(_, state)| Arc::clone(state))
    }

    /// The transitions of a node with their times, in order.
    pub(crate) fn transitions(&self, node: Name) -> impl Iterator<Item = &(Stamp, Arc<str>)> {
        self.states.get(&node).into_iter().flatten()
    }

    /// The stated types of a topic.
    pub(crate) fn types(&self, topic: Name) -> impl Iterator<Item = Arc<str>> + '_ {
        self.types.get(&topic).into_iter().flatten().cloned()
    }

    /// The quality of service of a topic.
    pub(crate) fn quality(&self, topic: Name) -> Option<Arc<str>> {
        let all: Vec<&str> = self.qualities.get(&topic)?.iter().map(|q| &**q).collect();
        Some(all.join(", ").into())
    }
}
