//! `ros_discovery_info`: the nodes of each participant of DDS (`rmw_dds_common/msg/ParticipantEntitiesInfo`).

use super::SourceContext;
use crate::base::digest::hex_of;
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::dynamic::MessageLayout;
use crate::evidence::observation::Observation;

/// `rmw_dds_common/msg/ParticipantEntitiesInfo`; its identifiers have 24 bytes up to Humble, 16 since.
pub(crate) const SHAPE: MessageLayout =
    MessageLayout::ros2("rmw_dds_common/ParticipantEntitiesInfo", "");

/// The nodes of a participant: namespace and name.
type ParticipantNodes<'a> = Vec<(&'a str, &'a str)>;

pub(crate) fn read(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let mut long = payload.clone();
    let (id, nodes) = nodes(payload, 16).or_else(|_| nodes(&mut long, 24))?;
    let id = hex_of(id);
    let group = context.name(&format!("participant {id}"));
    for (space, name) in nodes {
        let full = format!("{}/{name}", space.trim_end_matches('/'));
        let node = context.name(&full);
        let words = || format!("{full} is a node of participant {id}");
        context.states_in(group, Observation::Node(node), words);
    }
    context.states(Observation::Snapshot(group), String::new);
    Ok(())
}

/// The participant and its nodes, if identifiers of `gid` bytes use the payload up exactly.
fn nodes<'a>(
    payload: &mut PayloadCursor<'a>,
    gid: usize,
) -> cursor::PayloadResult<(&'a [u8], ParticipantNodes<'a>)> {
    let id = payload.bytes(gid)?;
    let mut nodes = Vec::new();
    for _ in 0..payload.length(16)? {
        nodes.push((payload.string()?, payload.string()?));
        for _ in 0..2 {
            for _ in 0..payload.length(gid)? {
                payload.bytes(gid)?;
            }
        }
    }
    payload.finish()?;
    Ok((id, nodes))
}
