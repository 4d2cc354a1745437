//! The text of definitions as messages with fields: `.msg`, `.srv`, `.action` and `.idl` files, and what recorders make of them,
//! a text with a section for each file.

use std::fmt;

use super::idl;
use crate::bag::Connection;
use crate::base::words::visible;

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

impl MessageFields {
    /// A message `std_msgs/Header`, `std_msgs/msg/Header`, `std_msgs::msg::Header` or `Header`, without fields yet.
    pub(super) fn new(name: &str) -> Self {
        let mut parts = name.split(['/', ':']);
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

    /// Whether the names and the packages are the same.
    pub(super) fn is_called(&self, other: &Self) -> bool {
        self.name == other.name && self.package == other.package
    }

    /// Whether it is ROS 2's time, two numbers of 32 bits.
    pub(super) fn is_time(&self) -> bool {
        let fields = self.fields.iter().map(|f| f.kind.as_str());
        self.package == "builtin_interfaces"
            && self.name == "Time"
            && fields.eq(["int32", "uint32"])
    }
}

/// The form of a definition's text, or of one of its sections.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Form {
    #[default]
    Msg,
    Srv,
    Action,
    /// OMG IDL.
    Idl,
}

impl Form {
    /// The form `MSG`, `SRV`, `ACTION` or `IDL`.
    pub(super) fn named(word: &str) -> Option<Self> {
        match word {
            "MSG" => Some(Self::Msg),
            "SRV" => Some(Self::Srv),
            "ACTION" => Some(Self::Action),
            "IDL" => Some(Self::Idl),
            _ => None,
        }
    }

    /// The form in which the definition of a connection begins.
    pub(crate) fn of(connection: &Connection) -> Self {
        if connection.is_idl {
            Self::Idl
        } else {
            Self::Msg
        }
    }

    /// The ends of the names of the messages in a file, which `---` separates.
    fn parts(self) -> &'static [&'static str] {
        match self {
            Self::Msg => &[""],
            Self::Srv => &["_Request", "_Response"],
            Self::Action => &["_Goal", "_Result", "_Feedback"],
            Self::Idl => &[],
        }
    }

    /// Whether a file is of several messages.
    pub(super) fn has_parts(self) -> bool {
        self.parts().len() > 1
    }

    /// The messages that ROS 2 derives from the service or action `name`.
    fn derived(self, name: &str) -> String {
        match self {
            Self::Srv => EVENT.replace('@', name) + EVENT_INFO,
            Self::Action => ACTION.replace('@', name) + EVENT_INFO,
            Self::Msg | Self::Idl => String::new(),
        }
    }
}

/// The bytes of names and derived texts after which no more are derived; recorders write one service or action in a text.
const MOST_DERIVED: usize = 1 << 16;

/// What the introspection of a service records.
const EVENT: &str = "MSG: @_Event\nservice_msgs/ServiceEventInfo info\n\
                     @_Request[<=1] request\n@_Response[<=1] response\n";

const EVENT_INFO: &str = "MSG: service_msgs/ServiceEventInfo\nuint8 event_type\n\
                          builtin_interfaces/Time stamp\nchar[16] client_gid\nint64 sequence_number\n";

/// The messages and services of an action besides goal, result and feedback (<https://design.ros2.org/articles/actions.html>).
const ACTION: &str = "MSG: @_FeedbackMessage\nunique_identifier_msgs/UUID goal_id\n@_Feedback feedback\n\
                      SRV: @_SendGoal\nunique_identifier_msgs/UUID goal_id\n@_Goal goal\n---\n\
                      bool accepted\nbuiltin_interfaces/Time stamp\n\
                      SRV: @_GetResult\nunique_identifier_msgs/UUID goal_id\n---\nint8 status\n@_Result result\n\
                      SRV: action_msgs/CancelGoal\nGoalInfo goal_info\n---\n\
                      int8 return_code\nGoalInfo[] goals_canceling\n";

/// The messages of a text: first `type_name`, then all others. A message with a line that is not a field is marked as wrong.
///
/// # Errors
/// The reason why a text in IDL cannot be used.
pub(crate) fn messages(
    text: &str,
    type_name: &str,
    form: Form,
) -> Result<Vec<MessageFields>, String> {
    let mut sections = Sections {
        found: vec![MessageFields::new(type_name)],
        form,
        ..Sections::default()
    };
    if form.has_parts() {
        sections.begin(form, type_name);
    }
    for (number, line) in (1..).zip(text.lines()) {
        sections.line(number, line);
    }
    sections.messages()
}

/// A text while its lines are read.
#[derive(Default)]
struct Sections<'a> {
    found: Vec<MessageFields>,
    /// The lines in IDL, in their places.
    idl: String,
    form: Form,
    /// Whether the previous line separates sections; the title after it may be cut.
    is_between: bool,
    /// The name of the present section's file, and the ends of the names of its messages that have not begun.
    name: &'a str,
    parts: &'static [&'static str],
    /// The text of the messages derived from services and actions.
    derived: String,
}

impl<'a> Sections<'a> {
    fn line(&mut self, number: usize, line: &'a str) {
        let is_between = std::mem::replace(&mut self.is_between, line.starts_with("==="));
        let title = line.split_once(':');
        let title = title.and_then(|(word, name)| Some((Form::named(word)?, name)));
        if let Some((form, name)) = title {
            self.begin(form, without_comment(name));
        } else if self.form == Form::Idl {
            self.idl.push_str(line);
        } else if self.form != Form::Msg && line.trim() == "---" {
            self.next_part();
        } else if let Some(message) = self.found.last_mut() {
            match field(without_comment(line)) {
                Ok(field) => message.fields.extend(field),
                Err(_) if is_between => {}
                Err(line) => {
                    let line: String = visible(line).chars().take(LONGEST_QUOTE).collect();
                    message.wrong.get_or_insert_with(|| {
                        format!("line {number} of its definition is not a field: `{line}`")
                    });
                }
            }
        }
        self.idl.push('\n');
    }

    fn begin(&mut self, form: Form, name: &'a str) {
        (self.form, self.name, self.parts) = (form, name, form.parts());
        if self.derived.len() + name.len() < MOST_DERIVED {
            self.derived += &form.derived(name);
        }
        self.next_part();
    }

    fn next_part(&mut self) {
        if let Some((end, rest)) = self.parts.split_first() {
            let name = format!("{}{end}", self.name);
            self.found.push(MessageFields::new(&name));
            self.parts = rest;
        }
    }

    fn messages(mut self) -> Result<Vec<MessageFields>, String> {
        let is_idl = !self.idl.trim().is_empty();
        if is_idl {
            self.found.extend(idl::messages(&self.idl)?);
        }
        if !self.derived.is_empty() {
            let derived = messages(&self.derived, "", Form::Msg)?;
            self.found.extend(derived.into_iter().skip(1));
        }
        let mut found = self.found;
        if found[0].fields.is_empty() && found.len() > 1 {
            // All sections have titles; in IDL, types are sometimes recorded under other names.
            let own = (1..found.len()).find(|at| found[*at].is_called(&found[0]));
            match own.or(is_idl.then_some(1)) {
                Some(own) => found[0] = found.remove(own),
                None => found[0].wrong = Some("its definition is that of other types".to_owned()),
            }
        }
        Ok(found)
    }
}

/// The most characters of a text that an error quotes.
pub(super) const LONGEST_QUOTE: usize = 60;

pub(super) fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or_default().trim()
}

/// The field of a line; `None` for a constant, a separator or nothing.
///
/// # Errors
/// The line, if it is none of them.
fn field(line: &str) -> Result<Option<Field>, &str> {
    let (kind, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    let rest = rest.trim_start();
    let is_separator = line.bytes().all(|byte| byte == b'=');
    let is_name = |text: &str| text.starts_with(|c: char| c.is_ascii_alphabetic());
    if is_separator {
        return Ok(None);
    }
    if !is_name(kind) || !is_name(rest) {
        return Err(line);
    }
    let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_'));
    let (name, tail) = rest.split_at(end.unwrap_or(rest.len()));
    if tail.trim_start().starts_with('=') {
        return Ok(None);
    }
    let (kind, array) = kind.split_at(kind.find('[').unwrap_or(kind.len()));
    let kind = kind.split("<=").next().unwrap_or(kind);
    Ok(Some(Field {
        name: name.to_owned(),
        kind: kind.to_owned(),
        array: length(array).ok_or(line)?,
    }))
}

/// The length in `[]`, `[<=3]` or `[3]`.
fn length(array: &str) -> Option<Array> {
    match array.strip_prefix('[').and_then(|a| a.strip_suffix(']')) {
        None => array.is_empty().then_some(Array::No),
        Some(inner) if inner.is_empty() || inner.starts_with("<=") => Some(Array::Dynamic),
        Some(inner) => inner.parse().ok().map(Array::Fixed),
    }
}
