//! The messages of a definition in OMG IDL, as ROS 2 writes it
//! (<https://design.ros2.org/articles/idl_interface_definition.html>).

use std::collections::BTreeMap;

use super::text::{Array, Field, LONGEST_QUOTE, MessageFields};

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
pub(super) fn messages(text: &str) -> Result<Vec<MessageFields>, String> {
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
                    name: (*name).to_owned(),
                    fields: Vec::new(),
                    wrong: None,
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
        let all = messages(POSE).unwrap();
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
            let found = messages(text).map_err(|found| found.contains(why));
            assert!(
                found == Err(true) || text.contains("verbatim"),
                "{text}: {found:?}"
            );
        }
        for cut in (0..POSE.len()).filter(|at| POSE.is_char_boundary(*at)) {
            let _ends = messages(&POSE[..cut]);
        }
    }
}
