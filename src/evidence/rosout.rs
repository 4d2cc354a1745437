//! Log records of ROS 1: a node is alive, and the topics it names as its own.
//!
//! roscpp lists the topics that the node publishes, rospy also those it subscribes; rospy tells itself by the `.py` of
//! the file that logged.

use super::layout::{HEADER, Layout};
use super::Heard;
use crate::bag::Encoding;
use crate::facts::{Claim, Degree, SourceId};
use crate::proof::{Known, Proof, What, When};
use crate::wire::{self, Cursor};

/// `rosgraph_msgs/Log`.
pub(super) const LAYOUT: Layout = Layout {
    type_name: "rosgraph_msgs/Log",
    md5: "acffd30cd6b6de30f120938c17c593fb",
    encoding: Encoding::Ros1,
    fields: &[
        (
            "",
            "Header header;byte level;string name;string msg;string file;string function;uint32 line;string[] topics",
        ),
        HEADER,
    ],
    read,
};

/// The same before 2011.
pub(super) const OLD_LAYOUT: Layout = Layout {
    type_name: "roslib/Log",
    ..LAYOUT
};

fn read(heard: &mut Heard<'_>, payload: &mut Cursor<'_>) -> wire::Result<()> {
    let seq = payload.header()?;
    payload.u8()?;
    let name = payload.string()?;
    let message = payload.string()?;
    let file = payload.string()?;
    payload.skip_string()?;
    payload.u32()?;
    let count = payload.length(4)?;
    let topics = (0..count).map(|_| payload.string()).collect::<wire::Result<Vec<_>>>()?;
    payload.finish()?;
    heard.sequence(seq);
    if name.is_empty() {
        return Ok(());
    }
    let node = heard.name(name);
    heard.claim(Claim::Node(node), Degree::Stated, || format!("{name} logs: {message}"));
    if &*heard.stream.connection.topic.shared() == "/rosout"
        && let Some(publisher) = heard.stream.publisher
        && publisher != node
    {
        let claim = Claim::Carries(publisher, node);
        heard.claim(claim, Degree::Stated, String::new);
    }
    let rospy = file.ends_with(".py");
    for topic in topics {
        let text = || format!("{name} logs with {topic} in its list of topics: {message}");
        let topic = heard.name(topic);
        let claim = if rospy { Claim::Lists(node, topic) } else { Claim::Publish(node, topic) };
        heard.claim(claim, Degree::Stated, text);
    }
    Ok(())
}

/// A topic in a rospy node's list that others publish, and the node itself is not known to, is a subscription.
pub(super) fn conclude(source: SourceId, known: &mut Known<'_>) {
    for (claim, signs) in known.claims(source) {
        let Claim::Lists(node, topic) = claim else {
            continue;
        };
        let own = known.publishers(topic).any(|p| p == node);
        let others = known.publishers(topic).any(|p| p != node);
        let what = match (own, others) {
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
                ends: Vec::new(),
                held: false,
            },
        });
    }
}
