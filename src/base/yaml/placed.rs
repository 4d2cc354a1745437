//! YAML as data with a position for every part, for files whose mistakes are reported with line and column.

use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_saphyr::Spanned;

use super::{BadYaml, YamlPlace, read};

/// The document as data with a position for every part, with the limits of [`super::parse`].
///
/// # Errors
/// As for [`super::parse`], and for keys that are not text or occur twice in one mapping.
pub(crate) fn parse_placed(text: &str) -> Result<YamlPart, BadYaml> {
    read::<Spanned<Plain>>(text).map(YamlPart::from)
}

/// A part of a document, with its position.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct YamlPart {
    pub(crate) at: YamlPlace,
    pub(crate) data: YamlData,
}

/// The content of a part.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum YamlData {
    /// A scalar as text: `true`, `2.5`, `/scan`; empty for null.
    Scalar(String),
    List(Vec<YamlPart>),
    /// A mapping in the document's order: the key, its position, the value.
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

/// [`YamlData`] as the parser builds it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_has_its_position() {
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
        assert_eq!(twice.at.line, 2, "{twice:?}");
    }

    #[test]
    fn an_alias_bomb_is_refused_too() {
        let mut text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned();
        for i in 1..12 {
            let one = format!("*a{}, ", i - 1).repeat(10);
            text = format!("{text}a{i}: &a{i} [{one}]\n");
        }
        assert!(parse_placed(&text).is_err());
    }
}
