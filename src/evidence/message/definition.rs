//! The text of definitions as messages with fields: `.msg`, `.srv`, `.action` and `.idl` files, and what recorders make of them,
//! a text with a section for each file.

use std::collections::BTreeMap;
use std::fmt;

use crate::bag::Connection;
use crate::base::words::visible;

/// A field of a message.
#[derive(Debug, PartialEq, Eq)]
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
#[derive(Debug, PartialEq, Eq)]
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
#[derive(Clone, Copy, Default, PartialEq, Eq)]
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
            self.found.extend(idl_messages(&self.idl)?);
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

/// The most characters of a text that an error quotes: a notice is one line.
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

// OMG IDL, as ROS 2 writes it (<https://design.ros2.org/articles/idl_interface_definition.html>).

/// The member that ROS 2 adds to messages without fields, as IDL has no empty structures.
const NOTHING: &str = "structure_needs_at_least_one_member";

/// Types of IDL that `.msg` files call otherwise; those of several words first.
const NAMES: [(&str, &str); 10] = [
    ("unsigned long long", "uint64"),
    ("unsigned long", "uint32"),
    ("unsigned short", "uint16"),
    ("long long", "int64"),
    ("long", "int32"),
    ("short", "int16"),
    ("boolean", "bool"),
    ("octet", "byte"),
    ("float", "float32"),
    ("double", "float64"),
];

/// A type without its array, and the array.
type Kind = (String, Array);

/// The types and the numbers that names stand for.
type Aliases<'a> = BTreeMap<&'a str, Kind>;

/// All structures of a text, in order.
///
/// # Errors
/// The reason why it cannot be used.
pub(super) fn idl_messages(text: &str) -> Result<Vec<MessageFields>, String> {
    let mut read = 0_usize;
    let tokens = tokens(text);
    let mut counted = tokens.iter().copied().inspect(|_| read += 1);
    let found = structures(&mut counted);
    found.map_err(|reason| {
        let last = tokens.get(read.saturating_sub(1)).copied();
        // Tokens are parts of the text.
        let at = last.map_or(0, |token| token.as_ptr().addr() - text.as_ptr().addr());
        let line = text[..at].matches('\n').count() + 1;
        format!("{reason} in line {line}")
    })
}

fn structures(tokens: &mut dyn Iterator<Item = &str>) -> Result<Vec<MessageFields>, String> {
    let mut tokens = tokens.peekable();
    let (mut modules, mut statement, mut found) = (Vec::new(), Vec::new(), Vec::new());
    let mut is_inside = false;
    let mut aliases = Aliases::new();
    while let Some(token) = tokens.next() {
        match (token, &statement[..]) {
            // An annotation, with what is in its brackets.
            ("@", _) => {
                tokens.next();
                if tokens.next_if_eq(&"(").is_some() {
                    tokens.by_ref().find(|token| *token == ")");
                }
                continue;
            }
            ("{", ["module", name]) => modules.push(*name),
            ("{", ["struct", name]) => {
                is_inside = true;
                found.push(MessageFields {
                    package: modules.first().copied().unwrap_or_default().to_owned(),
                    ..MessageFields::new(name)
                });
            }
            ("{", ["enum", name]) => {
                tokens.by_ref().find(|token| *token == "}");
                aliases.insert(name, ("uint32".to_owned(), Array::No));
            }
            ("}", []) if is_inside => is_inside = false,
            ("}", []) => drop(modules.pop()),
            (";", ["const", .., name, "=", value]) => {
                aliases.insert(name, ((*value).to_owned(), Array::No));
            }
            (";", [] | ["const", ..]) => {}
            (";", ["typedef", rest @ ..]) => aliases.extend(named(rest, &aliases)?),
            (";", member) if is_inside => {
                let fields = named(member, &aliases)?.into_iter();
                let fields = fields.filter(|(name, _)| *name != NOTHING);
                let fields = fields.map(|(name, (kind, array))| Field {
                    name: name.to_owned(),
                    kind,
                    array,
                });
                if let Some(message) = found.last_mut() {
                    message.fields.extend(fields);
                }
            }
            ("{" | "}" | ";", other) => return Err(unexpected(other)),
            _ => {
                statement.push(token);
                continue;
            }
        }
        statement.clear();
    }
    let is_whole = statement.is_empty() && modules.is_empty() && !is_inside;
    match &found[..] {
        _ if !is_whole => Err("its definition in IDL ends early".to_owned()),
        [] => Err("its definition in IDL has no `struct`".to_owned()),
        _ => Ok(found),
    }
}

/// The names, with their modules, and the signs of a text, without comments, directives, quoted texts, and the lines that
/// rosbag2 writes between files.
fn tokens(text: &str) -> Vec<&str> {
    let (mut all, mut rest) = (Vec::new(), text.trim_start());
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    while let Some(first) = rest.chars().next() {
        let lines = ["//", "#", "===", "IDL:"];
        let end = if first == '"' {
            let mut is_escaped = false;
            let end = rest[1..].find(|c| {
                let is_end = c == '"' && !is_escaped;
                is_escaped = c == '\\' && !is_escaped;
                is_end
            });
            end.map(|at| at + 2)
        } else if rest.starts_with("/*") {
            rest.find("*/").map(|at| at + 2)
        } else if lines.iter().any(|line| rest.starts_with(line)) {
            rest.find('\n')
        } else {
            let end = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
            let end = end.max(first.len_utf8());
            all.push(&rest[..end]);
            Some(end)
        };
        rest = rest[end.unwrap_or(rest.len())..].trim_start();
    }
    all
}

/// The names that a type is given, each with its type: `sequence<long> a, b[3]`.
fn named<'a>(tokens: &[&'a str], aliases: &Aliases<'_>) -> Result<Vec<(&'a str, Kind)>, String> {
    let (kind, rest) = kind(tokens, aliases)?;
    let names = rest.split(|token| *token == ",").map(|one| match one {
        [name] => Ok((*name, kind.clone())),
        [name, "[", length, "]"] => {
            let constant = aliases.get(last(length)).map(|(value, _)| value.as_str());
            let count = constant.unwrap_or(length).parse();
            let count = count.map_err(|_| unexpected(tokens))?;
            Ok((*name, array_of(kind.clone(), Array::Fixed(count))?))
        }
        _ => Err(unexpected(tokens)),
    });
    names.collect()
}

/// The type at the beginning, and the tokens after it.
fn kind<'t, 'a>(
    tokens: &'t [&'a str],
    aliases: &Aliases<'_>,
) -> Result<(Kind, &'t [&'a str]), String> {
    let plain = |kind: &str| (kind.to_owned(), Array::No);
    match tokens {
        ["sequence", "<", "sequence", ..] => return Err(LISTS.to_owned()),
        ["sequence", "<", inner @ ..] => {
            let (inner, rest) = kind(inner, aliases)?;
            let ([">", rest @ ..] | [",", _, ">", rest @ ..]) = rest else {
                return Err(unexpected(tokens));
            };
            return Ok((array_of(inner, Array::Dynamic)?, rest));
        }
        [text @ ("string" | "wstring"), "<", _, ">", rest @ ..] => return Ok((plain(text), rest)),
        _ => {}
    }
    for (words, name) in NAMES {
        let count = words.split(' ').count();
        if let Some((first, rest)) = tokens.split_at_checked(count)
            && first.iter().copied().eq(words.split(' '))
        {
            return Ok((plain(name), rest));
        }
    }
    let Some((name, rest)) = tokens.split_first() else {
        return Err(unexpected(tokens));
    };
    let last = last(name);
    let package = name.trim_start_matches(':').split_once("::");
    let full = package.map_or_else(|| last.to_owned(), |(own, _)| format!("{own}/{last}"));
    let alias = aliases.get(last).cloned();
    Ok((alias.unwrap_or((full, Array::No)), rest))
}

/// A name without its modules.
fn last(name: &str) -> &str {
    name.rsplit("::").next().unwrap_or_default()
}

const LISTS: &str = "its definition has lists of lists";

fn array_of((kind, array): Kind, outer: Array) -> Result<Kind, String> {
    match array {
        Array::No => Ok((kind, outer)),
        _ => Err(LISTS.to_owned()),
    }
}

fn unexpected(statement: &[&str]) -> String {
    let statement = statement.join(" ");
    let start: String = statement.chars().take(LONGEST_QUOTE).collect();
    format!("its definition in IDL has an unexpected `{start}`")
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSE: &str = r##"// generated from rosidl_adapter/resource/msg.idl.em
#include "geometry_msgs/msg/Pose.idl"
module my_msgs {
  module msg {
    module Report_Constants { const uint8 A = 1; @verbatim (language="comment", text="a ; \" }") const string B = "};"; };
    typedef double double__36[36];
    typedef geometry_msgs::msg::Point corner[4], corners;
    /* of a robot { */
    @verbatim (language="comment", text=
      "struct Other {" "\n" "#")
    struct Report {
      @key
      std_msgs::msg::Header header;
      @default (value=3) @unit (value="m")
      unsigned long long far;
      long long deep; long near, low; unsigned short few; octet raw; boolean is_on; float f; double d; uint8 small; char c;
      sequence<uint8, 10> bytes; sequence<string<5>> words; string<7> word; wstring wide;
      double__36 covariance; corner corners; Part parts[3];
    };
  };
};
================================================================================
IDL: my_msgs/msg/Part
module my_msgs { module msg { struct Part { uint8 structure_needs_at_least_one_member; }; }; };
"##;

    #[test]
    fn the_structures_of_a_text_are_messages() {
        let all = idl_messages(POSE).unwrap();
        let names: Vec<(&str, &str)> = all
            .iter()
            .map(|m| (m.package.as_str(), m.name.as_str()))
            .collect();
        assert_eq!(names, [("my_msgs", "Report"), ("my_msgs", "Part")]);
        let fields = all[0].fields.iter();
        let fields: Vec<String> = fields
            .map(|f| format!("{}{} {}", f.kind, f.array, f.name))
            .collect();
        assert_eq!(
            fields.join(";"),
            "std_msgs/Header header;uint64 far;int64 deep;int32 near;int32 low;uint16 few;byte raw;bool is_on;float32 f;\
             float64 d;uint8 small;char c;uint8[] bytes;string[] words;string word;wstring wide;float64[36] covariance;\
             geometry_msgs/Point[4] corners;Part[3] parts"
        );
        assert_eq!(all[1].fields, []);
    }

    #[test]
    fn unknown_words_and_early_ends_are_errors() {
        for (text, why) in [
            ("module a { union b switch (long) {", "unexpected `union b"),
            (
                "module a { struct b { sequence<sequence<long>> c; };",
                "lists of lists",
            ),
            ("module a { struct b { long c", "ends early"),
            (
                "module a { struct b { long c[N]; };",
                "unexpected `long c [ N ]`",
            ),
            ("module a { const long N = 3; };", "has no `struct`"),
            ("module a { @verbatim (text=\"x", "ends early"),
            ("module a { struct b : c { };", "unexpected"),
        ] {
            let found = idl_messages(text).map_err(|found| found.contains(why));
            assert!(
                found == Err(true) || text.contains("verbatim"),
                "{text}: {found:?}"
            );
        }
        for cut in (0..POSE.len()).filter(|at| POSE.is_char_boundary(*at)) {
            let _ends = idl_messages(&POSE[..cut]);
        }
    }
}
