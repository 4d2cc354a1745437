//! Publishers that the bag counts but nothing names. ROS 2 stores with each topic the number of its publishers, so that
//! a separate box stands for the remaining ones, with a question mark: `/scan ?`, `/scan ? ×2`. Where one well-known
//! program alone publishes messages of the topic's type, the box bears its name: `/turtlesim ?`.
//!
//! Runs after all other sources, for such a box only stands in for unknown nodes.

use crate::base::name::is_quiet;
use crate::base::words::count;
use crate::evidence::SOURCES;
use crate::evidence::claim::{Degree, Name};
use crate::evidence::proof::{Conclusions, ElementKey, Proof, Validity};
use crate::evidence::source::contract::Owners;

/// Adds a box for every recorded topic that lacks publishers.
pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    let owners = Owners::new();
    for topic in known.topics_of(|_| true) {
        let text = known.text(topic);
        if is_quiet(&text) || text.split('/').any(|part| part.starts_with('_')) {
            continue;
        }
        let named = known.publishers(topic).count();
        let offered = known.offers(topic).map_or(0, |n| n as usize);
        let owner = owners
            .node(&known.kind(topic), &text)
            .filter(|_| named == 0);
        let missing = offered.saturating_sub(named);
        if let Some(owner) = owner {
            let kind = known.kind(topic);
            add(known, "owned_type", &format!("{owner} ?"), topic, &|| {
                format!(
                    "nothing names the publisher of {text}; only {owner} is known to publish {kind}"
                )
            });
        } else if missing > 0 {
            let times = if missing > 1 {
                format!(" ×{missing}")
            } else {
                String::new()
            };
            add(
                known,
                "unknown",
                &format!("{text} ?{times}"),
                topic,
                &|| {
                    let counted = count(offered, "publisher");
                    format!(
                        "the recording counts {counted} of {text}, of which nothing names {missing}"
                    )
                },
            );
        }
    }
}

/// Adds a box with its edge.
fn add(
    known: &mut Conclusions<'_>,
    word: &str,
    name: &str,
    topic: Name,
    words: &dyn Fn() -> String,
) {
    let source = SOURCES.iter().position(|s| s.word == word).unwrap_or(0);
    let node = known.facts.name(name);
    // It appears and vanishes with its topic, about whose life it says nothing.
    let topics = || Validity::Like(ElementKey::Topic(topic));
    let life = if word == "unknown" {
        topics()
    } else {
        Validity::Whole
    };
    let edge = (ElementKey::Publish(node, topic), topics());
    for (what, when) in [(ElementKey::Node(node), life), edge] {
        let proof = Proof {
            what,
            source,
            degree: Degree::Declared,
            when,
        };
        known.because(proof, None, |_| words());
    }
}
