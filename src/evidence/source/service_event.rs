//! Service introspection (`<service>/_service_event`): requests and replies of a service, and its client and
//! its server if the recorder names publishers.

use super::SourceContext;
use crate::base::digest::hex_of;
use crate::base::name::SERVICE;
use crate::evidence::message::cursor::{self, PayloadCursor};
use crate::evidence::message::dynamic::MessageLayout;
use crate::evidence::observation::{Confidence, Observation};

/// `<service type>_Event`: it begins with `service_msgs/msg/ServiceEventInfo`, with any fields after it.
pub(crate) const SHAPE: MessageLayout = MessageLayout::ros2("*_Event", "");

pub(crate) fn read(
    context: &mut SourceContext<'_>,
    payload: &mut PayloadCursor<'_>,
) -> cursor::PayloadResult<()> {
    let topic = context.stream.connection.topic.shared();
    let Some(service) = topic.strip_suffix("/_service_event") else {
        return Ok(());
    };
    let kind = payload.u8()?;
    payload.time()?;
    let client = payload.bytes(16)?;
    payload.i64()?;
    let word = match kind {
        0 => "request sent",
        1 => "request received",
        2 => "reply sent",
        3 => "reply received",
        _ => return Err(payload.wrong("a kind of event")),
    };
    let client = hex_of(client);
    let of = context.stream.topic;
    if !service.contains("/_action/") {
        let kind = context.stream.connection.type_name.clone();
        let kind = context.name(kind.strip_suffix("_Event").unwrap_or(SERVICE));
        let called = context.name(service);
        let end = match (context.stream.publisher, word) {
            (None, _) => Observation::Topic(called),
            (Some(node), "request sent" | "reply received") => Observation::Publish(node, called),
            (Some(node), _) => Observation::Subscribe(node, called),
        };
        context.observation(end, Confidence::Measured, || {
            format!("{service}: {word}, client {client}")
        });
        if context.stream.publisher.is_none() {
            let client = context.name(&client);
            context.states(Observation::Calls(called, client), String::new);
        }
        let known = Observation::Type(called, kind);
        context.observation(known, Confidence::Measured, String::new);
    }
    let words = || format!("{service}: {word}, client {client}");
    context.observation(Observation::Topic(of), Confidence::Measured, words);
    Ok(())
}
