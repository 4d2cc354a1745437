//! Observations taken literally, with their times: signs, and ends by observations that revoke them.

use std::collections::BTreeMap;

use super::{Conclusions, ElementKey, Inference, Validity};
use crate::base::time::Stamp;
use crate::evidence::SOURCES;
use crate::evidence::observation::{Name, Observation, ObservationRecord, SourceId};

impl Conclusions<'_> {
    /// All observations of one source with their signs and ends, sorted.
    pub(crate) fn observations(
        &mut self,
        source: SourceId,
    ) -> Vec<(ObservationRecord, Vec<Stamp>, Vec<Stamp>)> {
        let endings = self.endings();
        let facts = self.observed(source).into_iter();
        let times = |fact: ObservationRecord| {
            let (signs, ends) = self.signs_and_ends(&fact, &endings);
            (fact, signs, ends)
        };
        facts.map(times).collect()
    }

    /// Adds the inferences that follow from single observations without a rule: nodes, topics, publications
    /// and subscriptions.
    pub(crate) fn take_at_their_word(&mut self) {
        let endings = self.endings();
        let refusals = self.refusals();
        let facts = self.facts.list.iter();
        let records = facts.filter_map(|fact| match fact.observation {
            Observation::Node(node) => {
                Some(((fact.source, node), self.facts.times.count(fact.times)))
            }
            _ => None,
        });
        let records: BTreeMap<(SourceId, Name), u64> = records.collect();
        for fact in self.facts.list.clone() {
            let what = match fact.observation {
                Observation::Node(node) | Observation::Begins(node) => ElementKey::Node(node),
                Observation::Topic(topic) => ElementKey::Topic(topic),
                Observation::Publish(node, topic) => ElementKey::Publish(node, topic),
                Observation::Subscribe(node, topic)
                | Observation::Joins(node, topic)
                | Observation::Refused(node, topic) => ElementKey::Subscribe(topic, node),
                _ => continue,
            };
            let (mut signs, ends) = self.signs_and_ends(&fact, &endings);
            if let (Observation::Joins(..), Some(refused)) = (fact.observation, refusals.get(&what))
            {
                signs.retain(|sign| !is_refused(*sign, refused));
            }
            if signs.is_empty() && matches!(fact.observation, Observation::Joins(..)) {
                continue;
            }
            // If every record has the first number, sequence numbers are unused.
            if let Observation::Begins(node) = fact.observation
                && signs.len() > 1
                && records.get(&(fact.source, node)) == Some(&(signs.len() as u64))
            {
                continue;
            }
            let when = match fact.observation {
                Observation::Joins(..) | Observation::Begins(_) => Validity::Begins { signs, ends },
                Observation::Refused(..) => Validity::Moments(signs),
                _ => Validity::Signs { signs, ends },
            };
            self.add(Inference::new(fact.source, what, fact.confidence, when));
        }
    }

    /// The times at which subscriptions were refused.
    fn refusals(&mut self) -> BTreeMap<ElementKey, Vec<Stamp>> {
        let mut refusals: BTreeMap<ElementKey, Vec<Stamp>> = BTreeMap::new();
        for fact in self.facts.list.clone() {
            if let Observation::Refused(node, topic) = fact.observation {
                let times = self.times(&fact);
                let key = ElementKey::Subscribe(topic, node);
                refusals.entry(key).or_default().extend(times);
            }
        }
        refusals
    }

    /// The times at which observations were revoked, and those of snapshots.
    fn endings(&mut self) -> BTreeMap<Observation, Vec<Stamp>> {
        let mut endings: BTreeMap<Observation, Vec<Stamp>> = BTreeMap::new();
        for fact in self.facts.list.clone() {
            if let Observation::NodeGone(_)
            | Observation::Unsubscribe(..)
            | Observation::Snapshot(_) = fact.observation
            {
                let times = self.times(&fact);
                endings.entry(fact.observation).or_default().extend(times);
            }
        }
        for times in endings.values_mut() {
            times.sort_unstable();
        }
        endings
    }

    /// The times at which an observation was made, and at which it was revoked, sorted.
    fn signs_and_ends(
        &mut self,
        fact: &ObservationRecord,
        endings: &BTreeMap<Observation, Vec<Stamp>>,
    ) -> (Vec<Stamp>, Vec<Stamp>) {
        let mut signs = self.times(fact);
        let ending = match fact.observation {
            Observation::Node(node) => Some(Observation::NodeGone(node)),
            Observation::Subscribe(node, topic)
            | Observation::Joins(node, topic)
            | Observation::SaysSubscribe(node, topic) => {
                Some(Observation::Unsubscribe(node, topic))
            }
            _ => None,
        };
        let mut ends = ending
            .and_then(|e| endings.get(&e))
            .cloned()
            .unwrap_or_default();
        let snapshots = fact
            .snapshot
            .and_then(|name| endings.get(&Observation::Snapshot(name)));
        if let Some(taken) = snapshots {
            let mut absent = absences(&signs, taken);
            if SOURCES.get(fact.source).is_some_and(|source| source.holds) {
                hold(&mut signs, taken);
                hold(&mut absent, taken);
            }
            ends.extend(absent);
        }
        ends.sort_unstable();
        ends.dedup();
        (signs, ends)
    }
}

/// Extends snapshots that show an element to the last moments before the next ones.
fn hold(times: &mut Vec<Stamp>, snapshots: &[Stamp]) {
    let next = |time: &Stamp| snapshots.get(snapshots.partition_point(|t| t <= time));
    let last: Vec<Stamp> = times
        .iter()
        .filter_map(next)
        .map(|next| next.plus(-1))
        .collect();
    times.extend(last);
    times.sort_unstable();
    times.dedup();
}

/// The longest time from a client's connection to its refusal, in nanoseconds: both are logged together.
const REFUSED_NS: i64 = 1_000_000_000;

/// Whether a connection made at `time` was refused at once.
fn is_refused(time: Stamp, refusals: &[Stamp]) -> bool {
    let soon = |refusal: &Stamp| (0..=REFUSED_NS).contains(&refusal.since(time));
    refusals.iter().any(soon)
}

/// The snapshots that show an absence: the first and the last of each run without the observation. Both lists are sorted.
fn absences(signs: &[Stamp], snapshots: &[Stamp]) -> Vec<Stamp> {
    let mut absent = Vec::new();
    let mut from = 0;
    for sign in signs {
        let run = &snapshots[from..snapshots.partition_point(|t| t < sign).max(from)];
        absent.extend(run.first());
        absent.extend(run.last());
        from = snapshots.partition_point(|t| t <= sign);
    }
    absent.extend(snapshots.get(from));
    absent
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_missing_in_a_snapshot_is_an_absence() {
        let stamps = |times: &[i64]| times.iter().map(|t| Stamp(*t)).collect::<Vec<_>>();
        let absent = absences(&stamps(&[4, 8]), &stamps(&[1, 2, 3, 4, 5, 6, 7, 8, 9]));
        assert_eq!(absent, stamps(&[1, 3, 5, 7, 9]));
        assert_eq!(absences(&stamps(&[1, 2]), &stamps(&[1, 2])), []);
    }
}
