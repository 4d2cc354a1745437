//! Sister namespaces: if a node's twin in another namespace publishes the same topics there and is known to
//! subscribe to one, the node subscribes to it too. For example, `/r1/nav` and `/r2/nav` publish `plan` and `status` in their
//! namespaces, and `/r1/nav` is known to subscribe to `/r1/scan`: `/r2/nav` subscribes to `/r2/scan`.

use std::collections::{BTreeMap, BTreeSet};

use crate::base::ids::Few;
use crate::evidence::inference::{Conclusions, ElementKey};
use crate::evidence::observation::{Name, SourceId};

/// The fewest topics of their namespace that twins publish: one alone may be chance.
const FEWEST: usize = 2;
/// The most twins that are compared one by one, since the work is the square of it: larger than any fleet in one recording.
const MOST: usize = 200;

/// A node with its namespace, and the topics it publishes inside it.
struct Twin {
    node: Name,
    space: String,
    own: BTreeSet<String>,
}

pub(crate) fn conclude(source: SourceId, known: &mut Conclusions<'_>) {
    for twins in families(known)
        .into_values()
        .filter(|twins| twins.len() <= MOST)
    {
        for one in &twins {
            let alike = twins
                .iter()
                .filter(|other| other.node != one.node && other.own == one.own);
            for other in alike {
                copy(source, known, one, other);
            }
        }
    }
}

/// The nodes that share their last part, each with its namespace and publications.
fn families(known: &Conclusions<'_>) -> BTreeMap<String, Vec<Twin>> {
    let mut published: Few<Name, Vec<Name>> = Few::default();
    for (node, topic) in known.publications() {
        published.grown(node).push(topic);
    }
    let mut families: BTreeMap<String, Vec<Twin>> = BTreeMap::new();
    for (node, topics) in published.with_ids() {
        let name = known.text(node);
        let Some((space, last)) = name.rsplit_once('/').filter(|(space, _)| !space.is_empty())
        else {
            continue;
        };
        let own: BTreeSet<String> = topics
            .iter()
            .filter_map(|t| inside(&known.text(*t), space))
            .collect();
        if own.len() >= FEWEST {
            families.entry(last.to_owned()).or_default().push(Twin {
                node,
                space: space.to_owned(),
                own,
            });
        }
    }
    for twins in families.values_mut() {
        twins.sort_by(|a, b| a.space.cmp(&b.space));
    }
    families
}

/// A topic's name inside a namespace.
fn inside(topic: &str, space: &str) -> Option<String> {
    let rest = topic.strip_prefix(space)?;
    rest.starts_with('/').then(|| rest.to_owned())
}

/// Adds for `to` the subscriptions of `from`, if the bag has the topics.
fn copy(source: SourceId, known: &mut Conclusions<'_>, from: &Twin, to: &Twin) {
    let subscribed = known.subscriptions().filter(|(_, node)| *node == from.node);
    let topics: Vec<Name> = subscribed.map(|(topic, _)| topic).collect();
    for topic in topics {
        let twin = match inside(&known.text(topic), &from.space) {
            Some(rest) => known.facts.known(&format!("{}{rest}", to.space)),
            None => Some(topic),
        };
        let own = |twin| known.knows(ElementKey::Publish(to.node, twin));
        if let Some(twin) = twin.filter(|t| known.is_recorded(*t) && !own(*t)) {
            let what = ElementKey::Subscribe(twin, to.node);
            known.infer(source, what, ElementKey::Node(to.node), |known| {
                format!(
                    "{} publishes the same topics in its namespace and subscribes to {}",
                    known.text(from.node),
                    known.text(topic)
                )
            });
        }
    }
}
