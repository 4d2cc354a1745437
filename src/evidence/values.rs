//! Stated values of elements: lifecycle states, types and quality of service.

use std::collections::BTreeSet;
use std::io;
use std::sync::Arc;

use crate::base::ids::Few;
use crate::base::name::SERVICE;
use crate::base::time::{Span, Stamp};
use crate::evidence::observation::{Name, Observation, Observations};

/// The states of a node in transition, each with the state to which it leads.
const STEPS: [(&str, &str); 5] = [
    ("configuring", "inactive"),
    ("activating", "active"),
    ("deactivating", "inactive"),
    ("cleaningup", "unconfigured"),
    ("shuttingdown", "finalized"),
];
/// Two transitions within this time may be recorded in either order: simulated time advances in steps.
const UNORDERED_NS: i64 = 50_000_000;

/// Puts each transition before its result where both were recorded at about the same time.
fn arrange(states: &mut [(Stamp, Arc<str>)]) {
    for at in 1..states.len() {
        let ((before, result), (after, step)) = (&states[at - 1], &states[at]);
        let is_result = STEPS.contains(&(&**step, &**result));
        if is_result && after.since(*before) <= UNORDERED_NS {
            let swapped = (step.clone(), result.clone());
            (states[at - 1].1, states[at].1) = swapped;
        }
    }
}

/// Stated values by node or topic.
#[derive(Debug, Default)]
pub(crate) struct StatedValues {
    /// The states of each node with the times of its transitions, sorted.
    states: Few<Name, Vec<(Stamp, Arc<str>)>>,
    types: Few<Name, BTreeSet<Arc<str>>>,
    qualities: Few<Name, BTreeSet<Arc<str>>>,
}

impl StatedValues {
    pub(crate) fn new(facts: &Observations) -> io::Result<Self> {
        let mut all = Self::default();
        for fact in &facts.list {
            match fact.observation {
                Observation::Lifecycle(node, state) => {
                    let state = facts.text(state);
                    let times = facts.times(fact)?.into_iter();
                    let states = all.states.grown(node);
                    states.extend(times.map(|time| (time, Arc::clone(&state))));
                }
                Observation::Type(topic, kind) => {
                    all.types.grown(topic).insert(facts.text(kind));
                }
                Observation::Quality(topic, words) => {
                    all.qualities.grown(topic).insert(facts.text(words));
                }
                _ => {}
            }
        }
        for states in all.states.iter_mut() {
            states.sort();
            arrange(states);
        }
        Ok(all)
    }

    /// Adds a type that the user states. The type of services is ignored if the actual type is known.
    pub(crate) fn state_type(&mut self, topic: Name, kind: &str) {
        let kinds = self.types.grown(topic);
        if kind != SERVICE || kinds.is_empty() {
            kinds.remove(SERVICE);
            kinds.insert(kind.into());
        }
    }

    /// The state of a node at the end of a window; `None` before its first transition.
    pub(crate) fn lifecycle(&self, node: Name, window: Span) -> Option<Arc<str>> {
        let states = self.states.of(node);
        let next = states.partition_point(|(time, _)| *time < window.end);
        states
            .get(next.checked_sub(1)?)
            .map(|(_, state)| Arc::clone(state))
    }

    /// The transitions of a node with their times, in order.
    pub(crate) fn transitions(&self, node: Name) -> impl Iterator<Item = &(Stamp, Arc<str>)> {
        self.states.of(node).iter()
    }

    /// The stated types of a topic.
    pub(crate) fn types(&self, topic: Name) -> impl Iterator<Item = Arc<str>> + '_ {
        self.types.get(topic).into_iter().flatten().cloned()
    }

    /// The quality of service of a topic.
    pub(crate) fn quality(&self, topic: Name) -> Option<Arc<str>> {
        let all: Vec<&str> = self.qualities.get(topic)?.iter().map(|q| &**q).collect();
        (!all.is_empty()).then(|| all.join(", ").into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transition_precedes_its_result() {
        let arranged = |states: &[(i64, &str)]| {
            let states = states.iter();
            let mut states: Vec<(Stamp, Arc<str>)> = states
                .map(|(ms, state)| (Stamp(ms * 1_000_000), (*state).into()))
                .collect();
            arrange(&mut states);
            let states = states
                .into_iter()
                .map(|(time, state)| format!("{} {state}", time.0 / 1_000_000));
            states.collect::<Vec<_>>().join(", ")
        };
        let mixed = [
            (0, "configuring"),
            (1, "inactive"),
            (2, "active"),
            (5, "activating"),
        ];
        assert_eq!(
            arranged(&mixed),
            "0 configuring, 1 inactive, 2 activating, 5 active"
        );
        // The messages between them are not recorded.
        assert_eq!(
            arranged(&[(0, "active"), (60, "activating")]),
            "0 active, 60 activating"
        );
    }
}
