//! The text of a message definition as fields, with the messages inside it.

use std::fmt;
use std::sync::Arc;

use super::idl;
use super::known::{Carried, KnownTypes};

/// A field of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Field {
    pub(crate) name: String,
    /// The type without array and bounds, as written: `float64`, `Point`, `geometry_msgs/Point`.
    pub(crate) kind: String,
    pub(crate) array: Array,
}

/// The kind of array that a field is, if any.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Array {
    No,
    /// An array of this length.
    Fixed(usize),
    /// An array whose length is in the payload.
    Dynamic,
}

impl fmt::Display for Array {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::No => Ok(()),
            Self::Fixed(length) => write!(f, "[{length}]"),
            Self::Dynamic => f.write_str("[]"),
        }
    }
}

/// A message: its package, its name without it, its fields.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MessageFields {
    pub(super) package: String,
    pub(crate) name: String,
    pub(crate) fields: Vec<Field>,
    /// The reason why its definition cannot be used.
    pub(super) wrong: Option<String>,
}

/// A parsed definition, the outermost message first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Definition {
    pub(super) messages: Vec<Arc<MessageFields>>,
    /// Whether the text names nested messages, in some old bags without their packages.
    is_loose: bool,
}

impl Definition {
    /// Reads the definition of `type_name`. The definition of a message without fields is empty, so an empty text is
    /// accepted only for types known to be empty.
    ///
    /// # Errors
    /// The reason why it cannot be used.
    pub(super) fn parse(text: &str, type_name: &str) -> Result<Self, String> {
        let is_empty = text.lines().all(|l| without_comment(l).is_empty());
        if is_empty && !type_name.ends_with("/Empty") {
            return Err("the bag contains no definition of its type".to_owned());
        }
        let messages = messages(text, type_name)?;
        Ok(Self {
            messages: messages.into_iter().map(Arc::new).collect(),
            is_loose: true,
        })
    }

    /// The definition of a type that the bag does not define.
    pub(super) fn known(types: &KnownTypes, type_name: &str, carried: Carried) -> Option<Self> {
        let name = MessageFields::new(type_name);
        let all = types.all(carried);
        let same = |m: &&&Arc<MessageFields>| m.name == name.name && m.package == name.package;
        let own = all.iter().find(same).map(|m| Arc::clone(m))?;
        Some(Self {
            messages: std::iter::once(own)
                .chain(all.into_iter().cloned())
                .collect(),
            is_loose: false,
        })
    }

    /// The index of the message that `kind` refers to in the message with index `from`: in the named package, in the
    /// same package, in any.
    ///
    /// # Errors
    /// If the definition does not contain it.
    pub(super) fn find(&self, from: usize, kind: &str) -> Result<usize, String> {
        let wanted = MessageFields::new(kind);
        let own = &self.messages[from].package;
        let package = if wanted.package.is_empty() {
            own
        } else {
            &wanted.package
        };
        let inside = || self.messages.iter().enumerate().skip(1);
        let found = inside()
            .find(|(_, m)| m.name == wanted.name && m.package == *package)
            .or_else(|| {
                // `Header` alone always refers to that of `std_msgs`.
                let by_name = |m: &MessageFields| self.is_loose || m.name == "Header";
                inside().find(|(_, m)| m.name == wanted.name && by_name(m))
            });
        found
            .map(|(at, _)| at)
            .ok_or_else(|| format!("its definition lacks the type `{kind}`"))
    }
}

/// The messages of a text: `type_name`, whose fields come first, and those after `MSG:` lines, or the structures of IDL.
///
/// # Errors
/// The reason why it cannot be used.
pub(super) fn messages(text: &str, type_name: &str) -> Result<Vec<MessageFields>, String> {
    let own = MessageFields::new(type_name);
    if idl::is_idl(text) {
        let mut messages = idl::messages(text)?;
        let is_own = |m: &MessageFields| m.name == own.name && m.package == own.package;
        let first = messages.iter().position(is_own).unwrap_or(0);
        messages[..=first].rotate_right(1);
        return Ok(messages);
    }
    let mut messages = vec![own];
    for (number, line) in (1..).zip(text.lines()) {
        let line = without_comment(line);
        let at_line = |reason| format!("{reason} in line {number}");
        if let Some(name) = line.strip_prefix("MSG:") {
            messages.push(MessageFields::new(name.trim()));
        } else if let (Some(field), Some(message)) =
            (field(line).map_err(at_line)?, messages.last_mut())
        {
            message.fields.push(field);
        }
    }
    Ok(messages)
}

impl MessageFields {
    /// Whether it is ROS 2's time, two numbers of 32 bits.
    pub(super) fn is_time(&self) -> bool {
        let fields = self.fields.iter().map(|f| f.kind.as_str());
        self.package == "builtin_interfaces"
            && self.name == "Time"
            && fields.eq(["int32", "uint32"])
    }

    /// A message `std_msgs/Header`, `std_msgs/msg/Header` or `Header`, without fields yet.
    fn new(name: &str) -> Self {
        let mut parts = name.split('/');
        let last = parts.next_back().unwrap_or_default();
        Self {
            package: parts.next().unwrap_or_default().to_owned(),
            name: last.to_owned(),
            fields: Vec::new(),
            wrong: None,
        }
    }

    /// A message whose definition cannot be used for this reason.
    pub(super) fn malformed(name: &str, reason: String) -> Self {
        Self {
            wrong: Some(reason),
            ..Self::new(name)
        }
    }
}

fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or_default().trim()
}

/// The first line of a `.msg` file that is none of a field, a constant, a comment and a separator, with its number.
pub(super) fn unreadable(text: &str) -> Option<(usize, &str)> {
    let is_readable = |line: &str| {
        let (kind, name) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let is_name = |text: &str| text.starts_with(|c: char| c.is_ascii_alphabetic());
        let is_separator = line.bytes().all(|byte| byte == b'=');
        is_separator || kind == "MSG:" || is_name(kind) && is_name(name.trim_start())
    };
    let lines = (1..).zip(text.lines().map(without_comment));
    let mut lines = lines.filter(|(_, line)| !line.is_empty());
    lines.find(|(_, line)| !is_readable(line))
}

/// The field of a line; `None` for a constant, a separator or nothing.
fn field(line: &str) -> Result<Option<Field>, String> {
    let Some((kind, rest)) = line.split_once(char::is_whitespace) else {
        return Ok(None);
    };
    let rest = rest.trim_start();
    let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_'));
    let (name, tail) = rest.split_at(end.unwrap_or(rest.len()));
    if name.is_empty() || tail.trim_start().starts_with('=') {
        return Ok(None);
    }
    let (kind, array) = kind.split_at(kind.find('[').unwrap_or(kind.len()));
    let kind = kind.split("<=").next().unwrap_or(kind);
    Ok(Some(Field {
        name: name.to_owned(),
        kind: kind.to_owned(),
        array: length(array)?,
    }))
}

/// The length in `[]`, `[<=3]` or `[3]`.
fn length(array: &str) -> Result<Array, String> {
    match array.strip_prefix('[').and_then(|a| a.strip_suffix(']')) {
        None if array.is_empty() => Ok(Array::No),
        Some(inner) if inner.is_empty() || inner.starts_with("<=") => Ok(Array::Dynamic),
        Some(inner) => inner
            .parse()
            .map(Array::Fixed)
            .map_err(|_| format!("its definition has an array `{array}`")),
        None => Err(format!("its definition has an array `{array}`")),
    }
}
