//! A message as data, decoded by its own definition, for messages whose layout has changed over the years; and known layouts,
//! recognised by type, and by definition or hash: first of all log records.

use crate::bag::{Connection, Encoding};
use crate::base::name::plain_type;
use crate::evidence::message::cursor::{PayloadCursor, PayloadResult};
use crate::evidence::message::definition::{self, Form};

/// A part of a message.
#[derive(Debug, PartialEq)]
pub(crate) enum MessageValue {
    Text(String),
    /// An unsigned number of one byte.
    Byte(u8),
    /// Any other number, with its value if it is an integer.
    Number(Option<i128>),
    List(Vec<Self>),
    /// Fields by name.
    Fields(Vec<(String, Self)>),
}

impl MessageValue {
    /// A field by its name.
    pub(crate) fn field(&self, name: &str) -> Option<&Self> {
        match self {
            Self::Fields(fields) => fields.iter().find(|(n, _)| n == name).map(|(_, v)| v),
            _ => None,
        }
    }

    /// A text field; empty if there is none.
    pub(crate) fn text(&self, name: &str) -> &str {
        match self.field(name) {
            Some(Self::Text(text)) => text,
            _ => "",
        }
    }

    /// A list field; empty if there is none.
    pub(crate) fn list(&self, name: &str) -> &[Self] {
        match self.field(name) {
            Some(Self::List(list)) => list,
            _ => &[],
        }
    }
}

/// The deepest nesting of messages; deeper ones are hostile: messages that evidence reads nest four deep, and each level multiplies
/// the work.
const DEEPEST: usize = 12;

/// Types that definitions use without defining them.
const BUILT_IN: [(&str, &str); 2] = [
    ("Time", "int32 sec;uint32 nanosec"),
    ("Duration", "int32 sec;uint32 nanosec"),
];

/// A parsed definition.
#[derive(Debug)]
pub(crate) struct MessageSchema(Vec<(String, String)>);

impl MessageSchema {
    /// The schema of a connection's definition.
    pub(crate) fn of(connection: &Connection) -> Self {
        let text = connection.definition.as_deref().unwrap_or_default();
        Self(outline(text, &connection.type_name, Form::of(connection)))
    }

    /// The schema of the text of a `.msg` file.
    pub(crate) fn of_text(definition: &str) -> Self {
        Self(outline(definition, "", Form::Msg))
    }

    /// The message of this name in a definition of several; empty for the first one.
    pub(crate) fn of_part(definition: &str, name: &str) -> Option<Self> {
        let mut all = outline(definition, "", Form::Msg);
        let at = all.iter().position(|(own, _)| own == name)?;
        all[..=at].rotate_right(1);
        Some(Self(all))
    }

    /// The schema with the messages of another one, which it prefers less than its own.
    pub(crate) fn with(mut self, others: Self) -> Self {
        self.0.extend(others.0);
        self
    }

    /// The messages in it, as [`outline`] lists them.
    pub(crate) fn outline(&self) -> &[(String, String)] {
        &self.0
    }

    /// The fields of the message itself.
    fn own(&self) -> &str {
        self.0.first().map_or("", |(_, fields)| fields)
    }

    /// Whether the message begins with a header.
    pub(crate) fn has_header(&self) -> bool {
        self.own().starts_with("Header ")
    }

    /// Whether headers in messages of this encoding begin with a number: by their definition, otherwise as usual.
    pub(crate) fn numbers_headers(&self, encoding: &Encoding) -> bool {
        let mut nested = self.0.iter().skip(1);
        let header = nested.find(|(name, _)| name == "Header");
        header.map_or(*encoding == Encoding::Ros1, |(_, fields)| {
            fields.starts_with("uint32 seq;")
        })
    }

    /// Whether the message itself contains strings or integers.
    pub(crate) fn has_words(&self) -> bool {
        const KINDS: [&str; 7] = [
            "string", "int16", "uint16", "int32", "uint32", "int64", "uint64",
        ];
        self.own().split(';').any(|field| {
            let kind = field.split(' ').next().unwrap_or_default();
            KINDS.contains(&kind)
        })
    }

    /// Parses a whole payload.
    ///
    /// # Errors
    /// If it has another layout, or a type in it is unknown.
    pub(crate) fn read(&self, payload: &mut PayloadCursor<'_>) -> PayloadResult<MessageValue> {
        let value = self.read_begun(payload)?;
        payload.finish()?;
        Ok(value)
    }

    /// Parses the beginning of a payload.
    ///
    /// # Errors
    /// As [`MessageSchema::read`].
    pub(crate) fn read_begun(
        &self,
        payload: &mut PayloadCursor<'_>,
    ) -> PayloadResult<MessageValue> {
        self.fields(payload, self.own(), 0)
    }

    fn fields(
        &self,
        payload: &mut PayloadCursor<'_>,
        fields: &str,
        depth: usize,
    ) -> PayloadResult<MessageValue> {
        let mut values = Vec::new();
        for field in fields.split(';').filter(|f| !f.is_empty()) {
            let (kind, name) = field.split_once(' ').ok_or(payload.wrong("a field"))?;
            values.push((name.to_owned(), self.field(payload, kind, depth)?));
        }
        Ok(MessageValue::Fields(values))
    }

    fn field(
        &self,
        payload: &mut PayloadCursor<'_>,
        kind: &str,
        depth: usize,
    ) -> PayloadResult<MessageValue> {
        let Some((kind, array)) = kind.split_once('[') else {
            return self.one(payload, kind, depth);
        };
        let count = match array.trim_end_matches(']') {
            "" => payload.length(1)?,
            count => {
                let count = count.parse();
                let count = count.map_err(|_| payload.wrong("an array's length"))?;
                if count > payload.remaining() {
                    return Err(payload.wrong("a whole array"));
                }
                count
            }
        };
        let list = (0..count).map(|_| self.one(payload, kind, depth));
        Ok(MessageValue::List(list.collect::<PayloadResult<_>>()?))
    }

    fn one(
        &self,
        payload: &mut PayloadCursor<'_>,
        kind: &str,
        depth: usize,
    ) -> PayloadResult<MessageValue> {
        let whole = |number: i128| Ok(MessageValue::Number(Some(number)));
        match kind {
            "string" => payload
                .string()
                .map(|text| MessageValue::Text(text.to_owned())),
            "byte" => payload.u8().map(MessageValue::Byte),
            "int16" => whole(payload.u16()?.cast_signed().into()),
            "uint16" => whole(payload.u16()?.into()),
            "int32" => whole(payload.u32()?.cast_signed().into()),
            "uint32" => whole(payload.u32()?.into()),
            "int64" => whole(payload.i64()?.into()),
            "uint64" => whole(payload.u64()?.into()),
            "float32" => payload.u32().map(|_| MessageValue::Number(None)),
            "float64" => payload.u64().map(|_| MessageValue::Number(None)),
            _ => {
                let known = self.0.iter().map(|(n, f)| (n.as_str(), f.as_str())).skip(1);
                let fields = known.chain(BUILT_IN).find(|(name, _)| *name == kind);
                match fields {
                    Some((_, fields)) if depth < DEEPEST => self.fields(payload, fields, depth + 1),
                    _ => Err(payload.wrong("a known type")),
                }
            }
        }
    }
}

/// A message layout.
pub(crate) struct MessageLayout {
    /// The type, without ROS 2's `/msg`: `rosgraph_msgs/Log`. A star at its start is a wildcard.
    pub(crate) type_name: &'static str,
    /// The type's md5 sum in ROS 1, used if the definition is missing; empty in ROS 2.
    pub(crate) md5: &'static str,
    /// The fields of the message as [`outline`] writes them, with `time` and `duration` as in ROS 1; then a line for each
    /// message inside it but [`STANDARD`], which begins with its name. Empty if the reader looks at the definition itself.
    pub(crate) fields: &'static str,
}

/// The confidence to which a connection fits a layout.
#[derive(Clone, Copy, PartialEq, Eq)]
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
    fields: "Header header;byte level;string name;string msg;string file;string function;uint32 line;string[] topics",
};

/// `rosgraph_msgs/Log` before 2011.
pub(crate) const OLD_LOG: MessageLayout = MessageLayout {
    type_name: "roslib/Log",
    ..LOG
};

/// `rcl_interfaces/msg/Log`.
pub(crate) const LOG2: MessageLayout = MessageLayout::ros2(
    "rcl_interfaces/Log",
    "time stamp;byte level;string name;string msg;string file;string function;uint32 line",
);

/// Log records of ROS 1.
pub(crate) const ROS1_LOGS: &[MessageLayout] = &[LOG, OLD_LOG];

/// All log records.
pub(crate) const LOGS: &[MessageLayout] = &[LOG, OLD_LOG, LOG2];

impl MessageLayout {
    /// The layout of a type of ROS 2, which has no checksum.
    pub(crate) const fn ros2(type_name: &'static str, fields: &'static str) -> Self {
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
        let named = |line: &'static str| line.trim().split_once(": ").unwrap_or(("", line));
        outline.iter().enumerate().all(|(at, (name, fields))| {
            let name = if at == 0 { "" } else { name.as_str() };
            let fields = fields.replace("Time ", "time ");
            let fields = fields.replace("Duration ", "duration ");
            let all = self.fields.lines().map(named).chain(STANDARD);
            let mut known = all.filter(|(known, _)| *known == name).peekable();
            let is_nested = at != 0;
            is_nested && known.peek().is_none() || known.any(|(_, known)| known == fields)
        })
    }
}

/// The messages in the definition of a type, the outermost first: the last part of the name, then `type name` of each field,
/// separated by `;`. Comments, constants, defaults, bounds and packages are left out; all types of one byte are `byte`.
pub(crate) fn outline(definition: &str, type_name: &str, form: Form) -> Vec<(String, String)> {
    let messages = definition::messages(definition, type_name, form).unwrap_or_default();
    let fields = |message: &definition::MessageFields| {
        let fields = message.fields.iter().map(|field| {
            let kind = match field.kind.rsplit('/').next().unwrap_or_default() {
                "int8" | "uint8" | "char" | "bool" => "byte",
                other => other,
            };
            format!("{kind}{} {}", field.array, field.name)
        });
        fields.collect::<Vec<_>>().join(";")
    };
    let named = messages.iter().map(|of| (of.name.clone(), fields(of)));
    named.collect()
}

// A log record of ROS 1 (`rosgraph_msgs/Log`) or ROS 2 (`rcl_interfaces/msg/Log`): its logger, text and source file.

/// A log record.
#[derive(Default)]
pub(crate) struct LogRecord<'a> {
    /// The name of the node or logger in the record.
    pub(crate) name: &'a str,
    /// The full name of the node, or of the logger, which is a node or a part of one.
    pub(crate) logger: String,
    pub(crate) text: &'a str,
    /// `logs`, or for a warning or an error `logs WARN`, `logs ERROR` or `logs FATAL`.
    pub(crate) logs: &'static str,
    /// The path of the source file as recorded by the compiler or interpreter.
    pub(crate) file: &'a str,
    /// The number of the record among those of its node; `None` in ROS 2.
    pub(crate) number: Option<u32>,
    /// The topics of the node, as far as roscpp and rospy list them; none in ROS 2.
    pub(crate) topics: Vec<&'a str>,
}

/// The full name of a node that ROS 2 names with dots in a logger.
pub(crate) fn full_name(logger: &str) -> String {
    format!("/{}", logger.trim_start_matches('/').replace('.', "/"))
}

/// Whether a type is that of log records of ROS 1.
pub(crate) fn is_ros1_log(type_name: &str) -> bool {
    ["rosgraph_msgs/Log", "roslib/Log"].contains(&&*plain_type(type_name))
}

impl<'a> LogRecord<'a> {
    /// Reads a whole record, of ROS 1 or of ROS 2.
    ///
    /// # Errors
    /// If it has another layout.
    pub(crate) fn read(payload: &mut PayloadCursor<'a>, is_ros1: bool) -> PayloadResult<Self> {
        let number = if is_ros1 {
            payload.header()?.number
        } else {
            payload.time()?;
            None
        };
        let level = payload.u8()?;
        let name = payload.string()?;
        let logger = if is_ros1 || name.is_empty() {
            name.to_owned()
        } else {
            full_name(name)
        };
        let (text, file) = (payload.string()?, payload.string()?);
        payload.skip_string()?;
        payload.u32()?;
        let listed = if is_ros1 { payload.length(4)? } else { 0 };
        let topics = (0..listed).map(|_| payload.string());
        let topics = topics.collect::<PayloadResult<_>>()?;
        payload.finish()?;
        Ok(Self {
            name,
            logger,
            text,
            logs: match (is_ros1, level) {
                (true, 4) | (false, 30) => "logs WARN",
                (true, 8) | (false, 40) => "logs ERROR",
                (true, 16) | (false, 50) => "logs FATAL",
                _ => "logs",
            },
            file,
            number,
            topics,
        })
    }

    /// The source file's name without folders.
    pub(crate) fn file_name(&self) -> &'a str {
        self.file.rsplit(['/', '\\']).next().unwrap_or(self.file)
    }
}

#[cfg(test)]
mod tests {
    mod values {
        use super::super::*;

        #[test]
        fn a_message_is_decoded_by_its_definition() {
            let schema = MessageSchema::of_text(
                "Part[] parts\nuint8 last\n===\nMSG: a/Part\nuint16 n\nstring name\n",
            );
            let data = [0, 1, 0, 0, 1, 0, 0, 0, 7, 0, 0, 0, 2, 0, 0, 0, b'x', 0, 9];
            let value = schema
                .read(&mut PayloadCursor::cdr(&data).unwrap())
                .unwrap();
            assert_eq!(value.list("parts")[0].text("name"), "x");
            assert_eq!(value.field("last"), Some(&MessageValue::Byte(9)));
        }

        #[test]
        fn a_recursive_definition_is_refused() {
            let schema = MessageSchema::of_text("A a\n===\nMSG: x/A\nA a\n");
            assert!(schema.read(&mut PayloadCursor::ros1(&[0; 64])).is_err());
        }
    }

    mod layouts {
        use super::super::*;

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
}
