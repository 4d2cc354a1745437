//! Claims taken literally, with their times: signs, and ends by claims that revoke them.

use std::collections::BTreeMap;

use super::{Conclusions, ElementKey, Proof, Validity};
use crate::base::time::Stamp;
use crate::evidence::SOURCES;
use crate::evidence::claim::{Claim, ClaimRecord, Name, SourceId};

impl Conclusions<'_> {
    /// All claims of one source with their signs and ends, sorted.
    pub(crate) fn claims(
        &mut self,
        source: SourceId,
    ) -> Vec<(ClaimRecord, Vec<Stamp>, Vec<Stamp>)> {
        let endings = self.endings();
        let facts = self.facts.list.iter().filter(|f| f.source == source);
        let facts: Vec<ClaimRecord> = facts.copied().collect();
        let times = |fact: ClaimRecord| {
            let (signs, ends) = self.signs_and_ends(&fact, &endings);
            (fact, signs, ends)
        };
        facts.into_iter().map(times).collect()
    }

    /// Adds the proofs that the claims state without any rule: nodes, topics, publications and subscriptions.
    pub(crate) fn take_at_their_word(&mut self) {
        let endings = self.endings();
        let refusals = self.refusals();
        let facts = self.facts.list.iter();
        let records = facts.filter_map(|fact| match fact.claim {
            Claim::Node(node) => Some(((fact.source, node), self.facts.times.count(fact.times))),
            _ => None,
        });
        let records: BTreeMap<(SourceId, Name), u64> = records.collect();
        for fact in self.facts.list.clone() {
            let what = match fact.claim {
                Claim::Node(node) | Claim::Begins(node) => ElementKey::Node(node),
                Claim::Topic(topic) => ElementKey::Topic(topic),
                Claim::Publish(node, topic) => ElementKey::Publish(node, topic),
                Claim::Subscribe(node, topic)
                | Claim::Joins(node, topic)
                | Claim::Refused(node, topic) => ElementKey::Subscribe(topic, node),
                _ => continue,
            };
            let (mut signs, ends) = self.signs_and_ends(&fact, &endings);
            if let (Claim::Joins(..), Some(refused)) = (fact.claim, refusals.get(&what)) {
                signs.retain(|sign| !is_refused(*sign, refused));
            }
            if signs.is_empty() && matches!(fact.claim, Claim::Joins(..)) {
                continue;
            }
            // If every record has the first number, sequence numbers are unused.
            if let Claim::Begins(node) = fact.claim
                && signs.len() > 1
                && records.get(&(fact.source, node)) == Some(&(signs.len() as u64))
            {
                continue;
            }
            self.prove(Proof {
                what,
                source: fact.source,
                degree: fact.degree,
                when: match fact.claim {
                    Claim::Joins(..) | Claim::Begins(_) => Validity::Begins { signs, ends },
                    Claim::Refused(..) => Validity::Moments(signs),
                    _ => Validity::Signs { signs, ends },
                },
            });
        }
    }

    /// The times at which subscriptions were refused.
    fn refusals(&mut self) -> BTreeMap<ElementKey, Vec<Stamp>> {
        let mut refusals: BTreeMap<ElementKey, Vec<Stamp>> = BTreeMap::new();
        for fact in self.facts.list.clone() {
            if let Claim::Refused(node, topic) = fact.claim {
                let times = self.times(&fact);
                let key = ElementKey::Subscribe(topic, node);
                refusals.entry(key).or_default().extend(times);
            }
        }
        refusals
    }

    /// The times at which claims were revoked, and those of snapshots.
    fn endings(&mut self) -> BTreeMap<Claim, Vec<Stamp>> {
        let mut endings: BTreeMap<Claim, Vec<Stamp>> = BTreeMap::new();
        for fact in self.facts.list.clone() {
            if let Claim::NodeGone(_) | Claim::Unsubscribe(..) | Claim::Snapshot(_) = fact.claim {
                let times = self.times(&fact);
                endings.entry(fact.claim).or_default().extend(times);
            }
        }
        for times in endings.values_mut() {
            times.sort_unstable();
        }
        endings
    }

    /// The times at which a claim was made, and at which it was revoked, sorted.
    fn signs_and_ends(
        &mut self,
        fact: &ClaimRecord,
        endings: &BTreeMap<Claim, Vec<Stamp>>,
    ) -> (Vec<Stamp>, Vec<Stamp>) {
        let mut signs = self.times(fact);
        let ending = match fact.claim {
            Claim::Node(node) => Some(Claim::NodeGone(node)),
            Claim::Subscribe(node, topic)
            | Claim::Joins(node, topic)
            | Claim::SaysSubscribe(node, topic) => Some(Claim::Unsubscribe(node, topic)),
            _ => None,
        };
        let mut ends = ending
            .and_then(|e| endings.get(&e))
            .cloned()
            .unwrap_or_default();
        let snapshots = fact
            .snapshot
            .and_then(|name| endings.get(&Claim::Snapshot(name)));
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

/// Adds to the times of snapshots that show something the last moments before the next ones.
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

/// The snapshots that show an absence: the first and the last of each run without the claim. Both lists are sorted.
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
