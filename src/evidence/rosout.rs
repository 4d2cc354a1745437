//! Log records of ROS 1: a node is alive, and the topics it names as its own.
//!
//! roscpp lists the topics that the node publishes, rospy also those it subscribes; rospy tells itself by the `.py` of
//! the file that logged.

use std::collections::BTreeSet;
use std::io;

use super::Heard;
use crate::facts::{Claim, Degree, Fact, Name, Said, SourceId};
use crate::proof::{Known, Proof, What, When};
use crate::wire::{self, Cursor};

pub(super) fn read(heard: &mut Heard<'_>, payload: &mut Cursor<'_>) -> wire::Result<()> {
    let seq = payload.header()?;
    payload.u8()?;
    let name = payload.string()?;
    let message = payload.string()?;
    let file = payload.string()?;
    payload.skip_string()?;
    payload.u32()?;
    let count = payload.length(4)?;
    let topics = (0..count)
        .map(|_| payload.string())
        .collect::<wire::Result<Vec<_>>>()?;
    payload.finish()?;
    heard.sequence(seq);
    if name.is_empty() {
        return Ok(());
    }
    let node = heard.name(name);
    heard.claim(Claim::Node(node), Degree::Stated, || {
        format!("{name} logs: {message}")
    });
    if &*heard.stream.connection.topic.shared() == "/rosout"
        && let Some(publisher) = heard.stream.publisher
        && publisher != node
    {
        let claim = Claim::Carries(publisher, node);
        heard.claim(claim, Degree::Stated, String::new);
    }
    // The list is whole: what is in an earlier one and not in this one is no longer the node's.
    let list = heard.name(&format!("topics of {name}"));
    let rospy = file.ends_with(".py");
    for topic in topics {
        let words = || format!("{name} logs with {topic} in its list of topics: {message}");
        let topic = heard.name(topic);
        let claim = if rospy {
            Claim::Lists(node, topic)
        } else {
            Claim::Publish(node, topic)
        };
        heard.say(
            Said {
                claim,
                degree: Degree::Stated,
                snapshot: Some(list),
            },
            words,
        );
    }
    heard.claim(Claim::Snapshot(list), Degree::Stated, String::new);
    Ok(())
}

/// A topic in a rospy node's list that it is known to publish is a publication; one that others publish is a
/// subscription. If nobody is known to publish it, a recorder of all topics knows whether somebody advertises it.
pub(super) fn conclude(source: SourceId, known: &mut Known<'_>) -> io::Result<()> {
    let advertised = advertised(known);
    for (fact, signs, ends) in known.claims(source)? {
        let Claim::Lists(node, topic) = fact.claim else {
            continue;
        };
        let own = known.publishers(topic).any(|p| p == node);
        let others = known.publishers(topic).any(|p| p != node);
        let silent = advertised.as_ref().is_some_and(|all| !all.contains(&topic));
        let what = match (own, others || silent) {
            (true, _) => What::Publish(node, topic),
            (false, true) => What::Subscribe(topic, node),
            (false, false) => continue,
        };
        known.prove(Proof {
            what,
            source,
            degree: Degree::Stated,
            when: When::Signs {
                signs,
                ends,
                held: false,
            },
        });
    }
    Ok(())
}

/// Every topic that a recorder of all topics has seen advertised; `None` if none tells.
fn advertised(known: &Known<'_>) -> Option<BTreeSet<Name>> {
    let appears = |fact: &Fact| match fact.claim {
        Claim::Appears(topic) => Some(topic),
        _ => None,
    };
    let topics: BTreeSet<_> = known.facts.list.iter().filter_map(appears).collect();
    // Nobody asks for this topic by name: the recorder was told to take all.
    let all = known.facts.known("/rosout_agg")?;
    topics.contains(&all).then_some(topics)
}
