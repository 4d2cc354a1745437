//! Parameter events of ROS 2: a node is alive.

use super::SourceContext;
use crate::bag::Encoding;
use crate::evidence::claim::{Claim, Degree};
use crate::evidence::message::cursor::{self, Cursor};
use crate::evidence::message::definition::{Shape, TIME2};

/// `rcl_interfaces/msg/ParameterEvent`.
pub(crate) const SHAPE: Shape = Shape {
    type_name: "rcl_interfaces/ParameterEvent",
    md5: "",
    encoding: Encoding::Cdr,
    fields: &[
        (
            "",
            "Time stamp;string node;Parameter[] new_parameters;Parameter[] changed_parameters;Parameter[] deleted_parameters",
        ),
        ("Parameter", "string name;ParameterValue value"),
        (
            "ParameterValue",
            "byte type;byte bool_value;int64 integer_value;float64 double_value;string string_value;byte[] byte_array_value;\
             byte[] bool_array_value;int64[] integer_array_value;float64[] double_array_value;string[] string_array_value",
        ),
        TIME2,
    ],
};

pub(crate) fn read(heard: &mut SourceContext<'_>, payload: &mut Cursor<'_>) -> cursor::Result<()> {
    payload.time()?;
    let name = payload.string()?;
    for _ in 0..3 {
        for _ in 0..payload.length(4)? {
            skip_parameter(payload)?;
        }
    }
    payload.finish()?;
    if !name.is_empty() {
        let node = heard.name(name);
        heard.claim(Claim::Node(node), Degree::Stated, || {
            format!("{name} tells of its parameters")
        });
        let topic = heard.stream.topic;
        heard.claim(Claim::Publish(node, topic), Degree::Stated, || {
            format!("{name} tells of its parameters")
        });
    }
    Ok(())
}

fn skip_parameter(payload: &mut Cursor<'_>) -> cursor::Result<()> {
    payload.skip_string()?;
    payload.u8()?;
    payload.u8()?;
    payload.i64()?;
    payload.f64()?;
    payload.skip_string()?;
    for least in [1, 1] {
        let count = payload.length(least)?;
        payload.bytes(count)?;
    }
    for _ in 0..2 {
        for _ in 0..payload.length(8)? {
            payload.u64()?;
        }
    }
    for _ in 0..payload.length(4)? {
        payload.skip_string()?;
    }
    Ok(())
}
