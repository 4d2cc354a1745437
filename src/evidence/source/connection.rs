//! What a recording states of a connection: the publisher of each message in ROS 1 headers and MCAP channel metadata
//! (`callerid`), and the offered quality of service of ROS 2.

use serde_json::Value;

use crate::base::name::is_log;
use crate::base::yaml;
use crate::evidence::inference::{Conclusions, ElementKey, Reliability, Validity};
use crate::evidence::observation::{Confidence, Observation};
use crate::evidence::source::SourceContext;

/// Every stream is evidence for its topic, and for its publisher if that name is reliable.
pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    let streams = known.streams;
    for (at, stream) in streams.iter().enumerate() {
        let topic = ElementKey::Topic(stream.topic);
        known.add(topic, Confidence::Measured, Validity::Messages(at));
        let Some(node) = stream.publisher else {
            continue;
        };
        let edge = ElementKey::Publish(node, stream.topic);
        match stream.trust {
            Reliability::Player
                if known.named_by_others(stream.topic, node)
                    && !is_log(stream.connection.topic.as_str()) => {}
            Reliability::Whole | Reliability::Player => {
                known.add(edge, Confidence::Measured, Validity::Messages(at));
            }
            Reliability::Likely => {
                known.add(edge, Confidence::Inferred, Validity::Messages(at));
            }
            // The tool that wrote this header does not know the publishers of the other messages.
            Reliability::First => {
                known.add(edge, Confidence::Stated, Validity::First(at));
            }
            Reliability::Gone => {}
        }
    }
}

// Quality of service that ROS 2 recordings keep per topic (`offered_qos_profiles`): publishers at record time, and
// whether messages stay valid after their time (`transient_local`).

/// The quality of service that one publisher offers.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Offer {
    reliability: &'static str,
    durability: &'static str,
    history: String,
}

/// Whether a topic's messages are kept for late subscribers.
pub(crate) fn is_transient_local(text: &str) -> bool {
    let offers = offers(text);
    !offers.is_empty() && offers.iter().all(|o| o.durability == "transient_local")
}

/// Keeps the topic's quality of service in short words: `reliable transient_local depth 1`.
pub(crate) fn announced(context: &mut SourceContext<'_>) {
    let Some(text) = context.stream.connection.qos.clone() else {
        return;
    };
    let mut offers = offers(&text);
    offers.sort();
    if let Ok(count @ 1..) = u32::try_from(offers.len()) {
        *context.facts.offers.grown(context.place) = count;
    }
    let same = offers.chunk_by(|a, b| a == b).map(|same| {
        let times = if same.len() > 1 {
            format!("{} × ", same.len())
        } else {
            String::new()
        };
        let Offer {
            reliability,
            durability,
            history,
        } = &same[0];
        format!("{times}{reliability} {durability} {history}")
    });
    let words = same.collect::<Vec<_>>().join(", ");
    if !words.is_empty() {
        let (topic, quality) = (context.stream.topic, context.name(&words));
        let offered = || format!("offered as {words}");
        let stated = Observation::Quality(topic, quality);
        context.observation(stated, Confidence::Declared, offered);
    }
}

/// Declares every topic with an offer, even without messages.
pub(crate) fn conclude_offers(known: &mut Conclusions<'_>) {
    for fact in known.observed(known.source) {
        if let Observation::Quality(topic, _) = fact.observation {
            let what = ElementKey::Topic(topic);
            known.add(what, Confidence::Declared, Validity::Whole);
        }
    }
}

/// The offers in a text of YAML; empty if it is not a list of them.
fn offers(text: &str) -> Vec<Offer> {
    match yaml::parse(text) {
        Ok(Value::Array(list)) => list.iter().filter_map(offer).collect(),
        _ => Vec::new(),
    }
}

/// One offer; values are words since rosbag2 version 9, before that numbers of rmw.
fn offer(value: &Value) -> Option<Offer> {
    let value = value.as_object()?;
    let word = |key, words: [&'static str; 5]| match value.get(key) {
        Some(Value::Number(n)) => n
            .as_u64()
            .and_then(|n| words.get(usize::try_from(n).ok()?))
            .copied(),
        Some(Value::String(text)) => words.into_iter().find(|w| w == text),
        _ => None,
    };
    let unknown = "unknown";
    let reliability = [
        "system_default",
        "reliable",
        "best_effort",
        unknown,
        "best_available",
    ];
    let durability = [
        "system_default",
        "transient_local",
        "volatile",
        unknown,
        "best_available",
    ];
    let history = ["system_default", "keep_last", "keep_all", unknown, unknown];
    let depth = value.get("depth").and_then(Value::as_u64).unwrap_or(0);
    Some(Offer {
        reliability: word("reliability", reliability)?,
        durability: word("durability", durability)?,
        history: match word("history", history)? {
            "keep_last" => format!("depth {depth}"),
            other => other.to_owned(),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_words_mean_the_same() {
        let numbers = "- history: 1\n  depth: 10\n  reliability: 1\n  durability: 1\n  deadline:\n    sec: 9223372036\n    nsec: 854775807\n";
        let words = "- history: keep_last\n  depth: 10\n  reliability: reliable\n  durability: transient_local\n";
        assert_eq!(offers(numbers), offers(words));
        assert!(is_transient_local(numbers));
        assert_eq!(offers(numbers)[0].history, "depth 10");
    }

    #[test]
    fn invalid_qos_lists_have_no_offers() {
        assert!(offers("").is_empty() && offers("a: b").is_empty() && offers("- 5").is_empty());
        assert!(!is_transient_local(""));
    }
}
