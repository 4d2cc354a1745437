//! Publishers that the bag counts but does not name. ROS 2 stores with each topic the number of its
//! publishers, so a separate box with a question mark represents the remaining ones: `/scan ?`, `/scan ? ×2`.
//! If only one well-known program publishes messages of the topic's type, the box has its name: `/turtlesim
//! ?`.
//!
//! Runs after all other sources, since such a box only replaces unknown nodes.

use std::collections::BTreeMap;

use crate::base::name::{is_quiet, plain_type};
use crate::base::words::count;
use crate::evidence::inference::{Conclusions, ElementKey, Inference, Validity};
use crate::evidence::observation::{Confidence, Name, Observation};
use crate::evidence::source::contract::Owners;
use crate::evidence::source_id;

/// Adds a box for every topic that lacks publishers, according to its recording or to a recorded graph.
pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    let mut unnamed: BTreeMap<Name, usize> = BTreeMap::new();
    for fact in &known.facts.list {
        if let Observation::Unnamed(topic, many) = fact.observation {
            let most = unnamed.entry(topic).or_default();
            *most = (*most).max(known.text(many).parse().unwrap_or(0));
        }
    }
    // The types of topics that are not recorded themselves.
    let mut kinds: BTreeMap<Name, String> = BTreeMap::new();
    for fact in &known.facts.list {
        if let Observation::Type(topic, kind) = fact.observation
            && unnamed.contains_key(&topic)
        {
            kinds.insert(topic, plain_type(&known.text(kind)).into_owned());
        }
    }
    let is_shown = |topic: &Name| {
        let text = known.text(*topic);
        !is_quiet(&text) && !text.split('/').any(|part| part.starts_with('_'))
    };
    let mut topics = known.topics_of(|_| true);
    topics.extend(unnamed.keys());
    topics.retain(is_shown);
    topics.sort_by_key(|topic| known.text(*topic));
    topics.dedup();
    let owners = Owners::new(known);
    let kind_of = |known: &Conclusions<'_>, topic| match kinds.get(&topic) {
        Some(kind) => kind.clone(),
        None => known.kind(topic),
    };
    for topic in &topics {
        owned(known, &owners, &kind_of, *topic);
    }
    for topic in topics {
        let named = known.publishers(topic).count();
        let offered = known.offers(topic).map_or(0, |n| n as usize);
        let unnamed = unnamed.get(&topic).copied().unwrap_or(0);
        let missing = offered.saturating_sub(named).max(unnamed);
        let is_owned = known
            .publishers(topic)
            .any(|node| is_box(&known.text(node)));
        if missing == 0 || is_owned {
            continue;
        }
        let text = known.text(topic);
        let times = if missing > 1 {
            format!(" ×{missing}")
        } else {
            String::new()
        };
        let node = known.facts.name(&format!("{text} ?{times}"));
        let edge = ElementKey::Publish(node, topic);
        add(known, "unknown", node, edge, &|| {
            let counted = count(offered.max(unnamed), "publisher");
            format!("the recording counts {counted} of {text}, but does not name {missing}")
        });
    }
}

/// Whether a name is that of a box for an unknown node.
fn is_box(name: &str) -> bool {
    name.ends_with(" ?")
}

/// The number of publishers that a box stands for, at most 100.
pub(crate) fn unnamed(name: &str) -> usize {
    let times = name.split_once(" ? ×").map(|(_, times)| times.parse());
    times.map_or(1, |times| times.unwrap_or(1)).min(100)
}

/// Adds the box of the only program that publishes the type of a topic, with its other publications and
/// subscriptions.
fn owned(
    known: &mut Conclusions<'_>,
    owners: &Owners,
    kind_of: &impl Fn(&Conclusions<'_>, Name) -> String,
    topic: Name,
) {
    let (text, kind) = (known.text(topic), kind_of(known, topic));
    let Some(owner) = owners.node(&kind, &text) else {
        return;
    };
    if known.publishers(topic).next().is_some() {
        return;
    }
    let node = known.facts.name(&format!("{owner} ?"));
    let why =
        format!("the publisher of {text} is not named; only {owner} is known to publish {kind}");
    add(
        known,
        "owned_type",
        node,
        ElementKey::Publish(node, topic),
        &|| why.clone(),
    );
    for (publishes, other) in owners.others(known, kind_of, &kind, &owner) {
        let (verb, edge) = if publishes {
            ("publishes", ElementKey::Publish(node, other))
        } else {
            ("subscribes to", ElementKey::Subscribe(other, node))
        };
        let is_free = !publishes || known.publishers(other).next().is_none();
        if is_free && !known.knows(edge) {
            let of = known.text(other);
            add(known, "owned_type", node, edge, &|| {
                format!("{why}; it {verb} {of} as well")
            });
        }
    }
}

/// Adds a box with an edge.
fn add(
    known: &mut Conclusions<'_>,
    word: &str,
    node: Name,
    edge: ElementKey,
    words: &dyn Fn() -> String,
) {
    let source = source_id(word);
    let (ElementKey::Publish(_, topic) | ElementKey::Subscribe(topic, _)) = edge else {
        return;
    };
    // It appears and vanishes with its topic, and is not evidence for the topic.
    let topics = || Validity::Like(ElementKey::Topic(topic));
    let life = if word == "unknown" {
        topics()
    } else {
        Validity::Whole
    };
    for (what, when) in [(ElementKey::Node(node), life), (edge, topics())] {
        let inference = Inference::new(source, what, Confidence::Declared, when);
        known.because(inference, None, |_| words());
    }
}
