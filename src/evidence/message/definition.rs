//! Known message layouts, recognised by type, and by definition or hash.

use super::fields::{self, Form};
use crate::bag::{Connection, Encoding};

/// A message layout.
pub(crate) struct MessageLayout {
    /// The type, without ROS 2's `/msg`: `rosgraph_msgs/Log`. A star at its start is a wildcard.
    pub(crate) type_name: &'static str,
    /// The type's md5 sum in ROS 1, used if the definition is missing; empty in ROS 2.
    pub(crate) md5: &'static str,
    /// The fields of the message and of all messages inside it but [`STANDARD`], as [`outline`] writes them, with `time`
    /// and `duration` as in ROS 1; empty if the reader looks at the definition itself.
    pub(crate) fields: &'static [(&'static str, &'static str)],
}

/// The confidence to which a connection fits a layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LayoutFit {
    /// The connection has another type or encoding.
    OtherType,
    /// The connection has the type, but not its fields.
    OtherFields,
    /// The connection has the layout, as far as known.
    Same,
}

/// Messages that cursors read in all their forms, so that a layout is the same in recordings converted from one version of
/// ROS to the other.
const STANDARD: [(&str, &str); 4] = [
    ("Header", "uint32 seq;time stamp;string frame_id"),
    ("Header", "time stamp;string frame_id"),
    ("Time", "int32 sec;uint32 nanosec"),
    ("Duration", "int32 sec;uint32 nanosec"),
];

/// `rosgraph_msgs/Log`.
pub(crate) const LOG: MessageLayout = MessageLayout {
    type_name: "rosgraph_msgs/Log",
    md5: "acffd30cd6b6de30f120938c17c593fb",
    fields: &[(
        "",
        "Header header;byte level;string name;string msg;string file;string function;uint32 line;string[] topics",
    )],
};

/// `rosgraph_msgs/Log` before 2011.
pub(crate) const OLD_LOG: MessageLayout = MessageLayout {
    type_name: "roslib/Log",
    ..LOG
};

/// `rcl_interfaces/msg/Log`.
pub(crate) const LOG2: MessageLayout = MessageLayout::ros2(
    "rcl_interfaces/Log",
    &[(
        "",
        "time stamp;byte level;string name;string msg;string file;string function;uint32 line",
    )],
);

/// Log records of ROS 1.
pub(crate) const ROS1_LOGS: &[MessageLayout] = &[LOG, OLD_LOG];

/// All log records.
pub(crate) const LOGS: &[MessageLayout] = &[LOG, OLD_LOG, LOG2];

impl MessageLayout {
    /// The layout of a type of ROS 2, which has no checksum.
    pub(crate) const fn ros2(
        type_name: &'static str,
        fields: &'static [(&'static str, &'static str)],
    ) -> Self {
        Self {
            type_name,
            md5: "",
            fields,
        }
    }

    /// Whether the messages of a connection, whose type is this one without `/msg`, can be read, in either encoding;
    /// `outline` is that of its definition.
    pub(crate) fn fit(
        &self,
        connection: &Connection,
        type_name: &str,
        outline: &[(String, String)],
    ) -> LayoutFit {
        let named = match self.type_name.strip_prefix('*') {
            Some(end) => type_name.ends_with(end),
            None => type_name == self.type_name,
        };
        if !named || matches!(connection.encoding, Encoding::Other(_)) {
            return LayoutFit::OtherType;
        }
        if self.fields.is_empty() {
            return LayoutFit::Same;
        }
        let definition = connection.definition.as_deref().unwrap_or_default();
        let hash = connection.type_hash.as_deref().unwrap_or_default();
        let same = if definition.trim().is_empty() {
            // There is nothing to compare; a payload that is not consumed exactly is still refused.
            let has_md5 = connection.encoding == Encoding::Ros1 && !self.md5.is_empty();
            !has_md5 || ["", "*", self.md5].contains(&hash)
        } else {
            self.matches(outline)
        };
        if same {
            LayoutFit::Same
        } else {
            LayoutFit::OtherFields
        }
    }

    /// The message itself must have the fields; nested messages are compared if the definition contains them.
    fn matches(&self, outline: &[(String, String)]) -> bool {
        outline.iter().enumerate().all(|(at, (name, fields))| {
            let name = if at == 0 { "" } else { name.as_str() };
            let fields = fields.replace("Time ", "time ");
            let fields = fields.replace("Duration ", "duration ");
            let all = self.fields.iter().chain(&STANDARD);
            let mut known = all.filter(|(known, _)| *known == name).peekable();
            let is_nested = at != 0;
            is_nested && known.peek().is_none() || known.any(|(_, known)| *known == fields)
        })
    }
}

/// The messages in the definition of a type, the outermost first: the last part of the name, then `type name` of each field,
/// separated by `;`. Comments, constants, defaults, bounds and packages are left out; all types of one byte are `byte`.
pub(crate) fn outline(definition: &str, type_name: &str, form: Form) -> Vec<(String, String)> {
    let messages = fields::messages(definition, type_name, form).unwrap_or_default();
    let fields = |message: &fields::MessageFields| {
        let fields = message.fields.iter().map(|field| {
            let kind = match field.kind.rsplit('/').next().unwrap_or_default() {
                "int8" | "uint8" | "char" | "bool" => "byte",
                other => other,
            };
            format!("{kind}{} {}", field.array, field.name)
        });
        fields.collect::<Vec<_>>().join(";")
    };
    messages
        .iter()
        .map(|message| (message.name.clone(), fields(message)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_definition_is_boiled_down_to_its_fields() {
        let text = "# a comment\nbyte OK=0 # fine\nstd_msgs/Header header\nuint8 level # how bad\nstring<=255 id\n\
                    KeyValue[<=3] values\nint32 n 5\n===\nMSG: some_msgs/KeyValue\nstring key\nstring X = a;b\n";
        let fields = |at: usize| outline(text, "a/B", Form::Msg)[at].clone();
        assert_eq!(
            fields(0).1,
            "Header header;byte level;string id;KeyValue[] values;int32 n"
        );
        assert_eq!(fields(1), ("KeyValue".to_owned(), "string key".to_owned()));
    }
}
