//! Names as DOT ids and labels, escaped as in `rqt_graph`, and unique.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::base::words::is_invisible;
use crate::view::{ItemKind, View};

/// The longest id in characters; a longer one is cut, and the label has the whole name.
const LONGEST_ID: usize = 1000;

/// A name as part of a DOT id, as `PydotFactory.escape_name` makes it: percent-encoded, then `/` as `__`, `%` and
/// `-` as `_`. Different names may become equal.
pub(crate) fn escape_name(name: &str) -> String {
    let mut out = String::new();
    for byte in name.trim().bytes() {
        match byte {
            b'/' => out.push_str("__"),
            b'-' => out.push('_'),
            b'_' | b'.' | b'~' => out.push(char::from(byte)),
            _ if byte.is_ascii_alphanumeric() => out.push(char::from(byte)),
            _ => {
                let _ = write!(out, "_{byte:02X}");
            }
        }
    }
    match out.as_str() {
        "graph" | "subgraph" | "node" | "edge" => out + "_",
        _ => out,
    }
}

/// The id of every item and namespace of a view, ready to be written.
#[derive(Clone, Debug, Default)]
pub(super) struct DotIds {
    pub(super) items: Vec<String>,
    pub(super) namespaces: Vec<String>,
}

impl DotIds {
    pub(super) fn new(view: &View) -> Self {
        let mut taken = BTreeSet::new();
        let item = |kind, name: &str| match kind {
            ItemKind::Node | ItemKind::Namespace => escape_name(&format!("n_{name}")),
            ItemKind::Topic => escape_name(&format!("t_{name}")),
            ItemKind::Group => escape_name(&format!("n_n{name}")),
        };
        let items = view.items.iter().map(|i| item(i.kind, &i.name));
        let items: Vec<String> = items.map(|id| unlike(id, &mut taken)).collect();
        let namespaces = view.namespaces.iter();
        let ids = namespaces.map(|n| format!("cluster_{}", escape_name(&n.name)));
        let namespaces = ids.map(|id| unlike(id, &mut taken)).collect();
        Self { items, namespaces }
    }
}

/// The id, cut if it is too long, with a number if it was taken, in quotes if DOT requires them.
fn unlike(mut id: String, taken: &mut BTreeSet<String>) -> String {
    // Ids are ASCII.
    id.truncate(LONGEST_ID);
    let mut unique = id.clone();
    let mut number = 1_u64;
    while !taken.insert(unique.clone()) {
        number += 1;
        unique = format!("{id}_{number}");
    }
    if unique
        .bytes()
        .all(|b| b.is_ascii_alphanumeric() || b == b'_')
    {
        unique
    } else {
        format!("\"{unique}\"")
    }
}

/// A text as a quoted DOT string that `qt_dotgraph` reads back as the same text: it strips quotes from the
/// ends and then decodes the escapes of Python's strings. Of these, Graphviz supports `\\`, `\"` and `\n`.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    // A quote at the end would be stripped with ours, leaving its backslash.
    let end = text.trim_end_matches('"').len();
    for (at, c) in text.char_indices() {
        match c {
            '"' if at >= end => out.push_str("\\x22"),
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            c if is_invisible(c) => {
                let _ = match u32::from(c) {
                    code @ ..=0xff => write!(out, "\\x{code:02x}"),
                    code @ ..=0xffff => write!(out, "\\u{code:04x}"),
                    code => write!(out, "\\U{code:08x}"),
                };
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{Hide, ViewOptions, outline};

    #[test]
    fn names_are_escaped_like_in_rqt_graph() {
        let all = [
            ("n_/talker", "n___talker"),
            ("t_/robot1/image", "t___robot1__image"),
            ("n_/ns/a_b", "n___ns__a_b"),
            ("topic:/chatter", "topic_3A__chatter"),
            ("n_/é b-c~d.e", "n____C3_A9_20b_c~d.e"),
            ("node", "node_"),
        ];
        for (name, id) in all {
            assert_eq!(escape_name(name), id);
        }
    }

    #[test]
    fn equal_ids_get_numbers() {
        let mission = mission(&["/a/b /a__b /a-/b /a_/b =/a/b =/x.y"]);
        let hide = Hide::NONE;
        let view = outline(
            &mission,
            &ViewOptions {
                hide,
                ..ViewOptions::default()
            },
        );
        let ids = DotIds::new(&view);
        let want = [
            "n___a___b",
            "n___a__b",
            "n___a___b_2",
            "n___a__b_2",
            "t___a__b",
            "\"t___x.y\"",
        ];
        assert_eq!(ids.items, want);
    }

    #[test]
    fn strings_keep_quotes_backslashes_and_lines() {
        for (text, want) in [
            ("/a", r#""/a""#),
            ("a\"b\"", r#""a\"b\x22""#),
            ("\"\"", r#""\x22\x22""#),
            ("a\\", r#""a\\""#),
            ("a\nb\u{1}", r#""a\nb\x01""#),
            ("ü\u{9b}\u{202e}", r#""ü\x9b\u202e""#),
        ] {
            assert_eq!(quoted(text), want);
        }
    }
}
