//! Publishers that the bag counts but does not name. ROS 2 stores with each topic the number of its
//! publishers, so a separate box with a question mark represents the remaining ones: `/scan ?`, `/scan ? ×2`.
//! If only one well-known program publishes messages of the topic's type, the box has its name: `/turtlesim
//! ?`. So do the clients and the server of a service whose events are recorded: `/add client ? ×2`, `/add server ?`.
//!
//! Runs after all other sources, since such a box only replaces unknown nodes.

use crate::base::ids::grouped;
use crate::base::name::is_quiet;
use crate::base::words::count;
use crate::evidence::inference::{Conclusions, ElementKey, Validity, verb};
use crate::evidence::observation::{Confidence, Name, Observation};
use crate::evidence::source::contract::Owners;
use crate::evidence::source_id;

/// Adds a box for every topic that lacks publishers according to its recording.
pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    let is_shown = |topic: &Name| {
        let text = known.text(*topic);
        !is_quiet(&text) && !text.split('/').any(|part| part.starts_with('_'))
    };
    let mut topics = known.topics_of(|_| true);
    topics.retain(is_shown);
    topics.sort_by_key(|topic| known.text(*topic));
    topics.dedup();
    let owners = Owners::new(known);
    for topic in &topics {
        owned(known, &owners, *topic);
    }
    for topic in topics {
        let named = known.publishers(topic).count();
        let offered = known.offers(topic).map_or(0, |n| n as usize);
        let missing = offered.saturating_sub(named);
        let is_box = |node| known.text(node).ends_with(" ?");
        let is_owned = known.publishers(topic).any(is_box);
        if missing == 0 || is_owned {
            continue;
        }
        let text = known.text(topic);
        let node = known.facts.name(&format!("{text} ?{}", times(missing)));
        let edge = ElementKey::Publish(node, topic);
        add(known, "unknown", node, edge, &|| {
            let counted = count(offered, "publisher");
            format!("the recording counts {counted} of {text}, but does not name {missing}")
        });
    }
    callers(known);
}

/// Adds the clients and the server of services of which only events are recorded, which do not name them.
fn callers(known: &mut Conclusions<'_>) {
    let facts = known.facts.list.iter();
    let calls = facts.filter_map(|fact| match fact.observation {
        Observation::Calls(service, client) => Some((service, client)),
        _ => None,
    });
    for (service, clients) in grouped(calls) {
        let (text, many) = (known.text(service), clients.len());
        let counted = count(many, "client");
        let words = || format!("events of {text} show {counted}, but do not name nodes");
        let ends = [
            (format!("{text} client ?{}", times(many)), true),
            (format!("{text} server ?"), false),
        ];
        let named = known.publishers(service).chain(known.subscribers(service));
        let is_free = named.count() == 0;
        for (name, calls) in ends.into_iter().filter(|_| is_free) {
            let node = known.facts.name(&name);
            let edge = ElementKey::edge(calls, node, service);
            add(known, "unknown", node, edge, &words);
        }
    }
}

/// The end of the name of a box for several nodes.
fn times(many: usize) -> String {
    if many > 1 {
        format!(" ×{many}")
    } else {
        String::new()
    }
}

/// Adds the box of the only program that publishes the type of a topic, with its other publications and
/// subscriptions.
fn owned(known: &mut Conclusions<'_>, owners: &Owners, topic: Name) {
    let (text, kind) = (known.text(topic), known.kind(topic));
    let Some(owner) = owners.node(&kind, &text) else {
        return;
    };
    if known.publishers(topic).next().is_some() {
        return;
    }
    let node = known.facts.name(&format!("{owner} ?"));
    let why =
        format!("the publisher of {text} is not named; only {owner} is known to publish {kind}");
    let edge = ElementKey::Publish(node, topic);
    add(known, "owned_type", node, edge, &|| why.clone());
    for (publishes, other) in owners.others(known, &kind, &owner) {
        let edge = ElementKey::edge(publishes, node, other);
        let is_free = !publishes || known.publishers(other).next().is_none();
        if is_free && !known.knows(edge) {
            let of = known.text(other);
            add(known, "owned_type", node, edge, &|| {
                format!("{why}; it {} {of} as well", verb(publishes))
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
    known.source = source_id(word);
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
        known.because(what, Confidence::Declared, when, None, |_| words());
    }
}
