//! YAML text as plain data, bounded against documents that unfold to more than they are.

use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_saphyr::{Location, Spanned};

use super::budget::YAML;

pub(crate) use serde_json::Value;

/// What is wrong with a YAML document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BadYaml {
    /// The line, 1..; 0 where none can be named.
    pub(crate) line: usize,
    /// The character in it, 1..; 0 where none can be named.
    pub(crate) column: usize,
    /// What is wrong, in the parser's words, one line.
    pub(crate) reason: String,
}

/// The document as JSON data: mappings as objects with keys in order, scalars typed as YAML 1.2 has it.
///
/// # Errors
/// [`BadYaml`] with its line: broken syntax, several documents, nesting past 64, more than 8 MiB, or aliases that
/// unfold past 100,000 values.
pub(crate) fn parse(text: &str) -> Result<Value, BadYaml> {
    read(text)
}

/// The document as data of which every part knows where it stands, with the same limits.
///
/// # Errors
/// As [`parse`], and for keys that are not text or stand twice in one mapping.
pub(crate) fn parse_placed(text: &str) -> Result<YamlPart, BadYaml> {
    read::<Spanned<Plain>>(text).map(YamlPart::from)
}

fn read<T: for<'de> Deserialize<'de>>(text: &str) -> Result<T, BadYaml> {
    if text.len() > YAML {
        return Err(BadYaml {
            line: 0,
            column: 0,
            reason: "longer than 8 MiB".to_owned(),
        });
    }
    let options = serde_saphyr::options! {
        alias_limits: serde_saphyr::alias_limits! {
            max_total_replayed_events: 100_000,
            max_replay_stack_depth: 16,
            max_alias_expansions_per_anchor: 10_000,
        },
    };
    serde_saphyr::from_str_with_options(text, options).map_err(|e| {
        let at = e.location().map_or(YamlPlace::default(), YamlPlace::from);
        BadYaml {
            line: at.line,
            column: at.column,
            reason: reason(&e),
        }
    })
}

/// Where something stands in a document.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct YamlPlace {
    /// The line, 1..; 0 where none can be named.
    pub(crate) line: usize,
    /// The character in it, 1...
    pub(crate) column: usize,
}

impl From<Location> for YamlPlace {
    fn from(at: Location) -> Self {
        Self {
            line: usize::try_from(at.line()).unwrap_or(0),
            column: usize::try_from(at.column()).unwrap_or(0),
        }
    }
}

/// A part of a document, with its place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct YamlPart {
    pub(crate) at: YamlPlace,
    pub(crate) data: YamlData,
}

/// What stands there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum YamlData {
    /// A scalar as text: `true`, `2.5`, `/scan`; empty for null.
    Scalar(String),
    List(Vec<YamlPart>),
    /// In the document's order: the key, its place, the value.
    Map(Vec<(String, YamlPlace, YamlPart)>),
}

impl From<Spanned<Plain>> for YamlPart {
    fn from(part: Spanned<Plain>) -> Self {
        Self {
            at: part.referenced.into(),
            data: part.value.0,
        }
    }
}

/// [`YamlData`] as the parser gives it.
struct Plain(YamlData);

impl<'de> Deserialize<'de> for Plain {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(PlainVisitor)
    }
}

struct PlainVisitor;

impl PlainVisitor {
    fn scalar(text: impl fmt::Display) -> Plain {
        Plain(YamlData::Scalar(text.to_string()))
    }
}

impl<'de> Visitor<'de> for PlainVisitor {
    type Value = Plain;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value, a list or a mapping")
    }

    fn visit_bool<E>(self, value: bool) -> Result<Plain, E> {
        Ok(Self::scalar(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Plain, E> {
        Ok(Self::scalar(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Plain, E> {
        Ok(Self::scalar(value))
    }

    fn visit_f64<E>(self, value: f64) -> Result<Plain, E> {
        Ok(Self::scalar(value))
    }

    fn visit_str<E>(self, value: &str) -> Result<Plain, E> {
        Ok(Self::scalar(value))
    }

    fn visit_unit<E>(self) -> Result<Plain, E> {
        Ok(Self::scalar(""))
    }

    fn visit_none<E>(self) -> Result<Plain, E> {
        Ok(Self::scalar(""))
    }

    fn visit_some<D: Deserializer<'de>>(self, inner: D) -> Result<Plain, D::Error> {
        Plain::deserialize(inner)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut parts: A) -> Result<Plain, A::Error> {
        let mut list = Vec::new();
        while let Some(part) = parts.next_element::<Spanned<Plain>>()? {
            list.push(part.into());
        }
        Ok(Plain(YamlData::List(list)))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut parts: A) -> Result<Plain, A::Error> {
        let mut map = Vec::new();
        while let Some(key) = parts.next_key::<Spanned<String>>()? {
            let value = parts.next_value::<Spanned<Plain>>()?;
            map.push((key.value, key.referenced.into(), value.into()));
        }
        Ok(Plain(YamlData::Map(map)))
    }
}

/// The parser's words, but for its own limits, whose names mean nothing to anybody else.
fn reason(error: &serde_saphyr::Error) -> String {
    let text = error.to_string();
    let first = text.lines().next().unwrap_or_default();
    if first.contains("budget") {
        return "it holds too many values, or nests them too deep".to_owned();
    }
    first.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn documents_become_plain_data() {
        let text = "a: 1\nb: [x, 2.5, true, null]\nc:\n  - d: 'yes'\n    e: \"0x10\"\n";
        let data = json!({"a": 1, "b": ["x", 2.5, true, null], "c": [{"d": "yes", "e": "0x10"}]});
        assert_eq!(parse(text), Ok(data));
    }

    #[test]
    fn numbers_past_an_i64_and_empty_documents_are_data_too() {
        assert_eq!(parse("a: 9223372036854775807"), Ok(json!({"a": i64::MAX})));
        assert_eq!(parse("a: 18446744073709551615"), Ok(json!({"a": u64::MAX})));
        assert_eq!(parse(""), Ok(Value::Null));
    }

    #[test]
    fn a_broken_document_names_its_line() {
        let bad = parse("a: 1\nb: [1, 2\nc: 3\n").unwrap_err();
        assert!(bad.line >= 2 && !bad.reason.is_empty(), "{bad:?}");
    }

    #[test]
    fn every_part_knows_its_place() {
        let parts = parse_placed("a:\n  - {b: 1.5, c: ''}\n").unwrap();
        let YamlData::Map(map) = parts.data else {
            panic!()
        };
        let (key, _, value) = &map[0];
        let YamlData::List(list) = &value.data else {
            panic!()
        };
        let YamlData::Map(inner) = &list[0].data else {
            panic!()
        };
        let place = |line, column| YamlPlace { line, column };
        assert_eq!((key.as_str(), list[0].at), ("a", place(2, 5)));
        assert_eq!((inner[0].1, inner[0].2.at), (place(2, 6), place(2, 9)));
        assert_eq!(inner[0].2.data, YamlData::Scalar("1.5".to_owned()));
        assert_eq!(inner[1].2.data, YamlData::Scalar(String::new()));
        let twice = parse_placed("a: 1\na: 2\n").unwrap_err();
        assert_eq!(twice.line, 2, "{twice:?}");
    }

    #[test]
    fn an_alias_bomb_is_refused() {
        let mut text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned();
        for i in 1..12 {
            let one = format!("*a{}, ", i - 1).repeat(10);
            text = format!("{text}a{i}: &a{i} [{one}]\n");
        }
        assert!(parse(&text).is_err());
        assert!(parse_placed(&text).is_err());
        assert!(parse(&"[".repeat(100_000)).is_err());
    }

    #[test]
    fn a_document_past_the_limits_is_refused_in_words_of_ours() {
        let many = parse(&format!("[{}]", "a, ".repeat(400_000))).unwrap_err();
        assert!(many.reason.contains("too many values"), "{many:?}");
    }
}
