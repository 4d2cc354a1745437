//! Parts of YAML with their positions, for files whose mistakes are reported with line and column, or that are edited.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Range;

use serde::de::value::MapAccessDeserializer;
use serde::de::{
    Deserialize, DeserializeSeed, Deserializer, IntoDeserializer as _, MapAccess, SeqAccess,
    Visitor,
};
use serde_saphyr::Spanned;

use super::{YamlPlace, bytes};

/// A value and its position in the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct At<T> {
    pub(crate) at: YamlPlace,
    pub(crate) value: T,
}

impl<T> At<T> {
    pub(crate) fn map<U>(self, value: impl FnOnce(T) -> U) -> At<U> {
        At {
            at: self.at,
            value: value(self.value),
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for At<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let part = Spanned::<T>::deserialize(deserializer)?;
        Ok(Self {
            at: part.referenced.into(),
            value: part.value,
        })
    }
}

/// A mapping of names in the document's order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pairs<T>(pub(crate) Vec<(At<String>, T)>);

impl<T> Default for Pairs<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Pairs<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(PairsVisitor(PhantomData))
    }
}

struct PairsVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for PairsVisitor<T> {
    type Value = Pairs<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a mapping")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Pairs<T>, A::Error> {
        let mut pairs = Vec::new();
        while let Some(pair) = map.next_entry()? {
            pairs.push(pair);
        }
        Ok(Pairs(pairs))
    }
}

/// A mapping read as a type, with its keys in the document's order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Keyed<T> {
    pub(crate) keys: Vec<At<String>>,
    pub(crate) value: T,
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Keyed<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(KeyedVisitor(PhantomData))
    }
}

struct KeyedVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for KeyedVisitor<T> {
    type Value = Keyed<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a mapping")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Keyed<T>, A::Error> {
        let mut keys = Vec::new();
        let noting = NotingKeys {
            map,
            keys: &mut keys,
        };
        let value = T::deserialize(MapAccessDeserializer::new(noting))?;
        Ok(Keyed { keys, value })
    }
}

/// A mapping whose keys are noted while a type reads it.
struct NotingKeys<'a, A> {
    map: A,
    keys: &'a mut Vec<At<String>>,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for NotingKeys<'_, A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, A::Error> {
        let Some(key) = self.map.next_key::<At<String>>()? else {
            return Ok(None);
        };
        let text = key.value.clone();
        self.keys.push(key);
        seed.deserialize(text.into_deserializer()).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(seed)
    }
}

/// A part of a document that is edited.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct YamlNode {
    /// The bytes of a scalar; of a list or mapping, those of its first sign.
    pub(crate) bytes: Range<usize>,
    pub(crate) data: YamlData,
}

/// The parts of a part.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum YamlData {
    Scalar,
    List(Vec<YamlNode>),
    Map(Vec<YamlPair>),
}

/// A key of a mapping and its value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct YamlPair {
    pub(crate) key: String,
    /// The bytes of the key.
    pub(crate) bytes: Range<usize>,
    pub(crate) value: YamlNode,
}

impl<'de> Deserialize<'de> for YamlNode {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let part = Spanned::<YamlData>::deserialize(deserializer)?;
        Ok(Self {
            bytes: bytes(part.referenced),
            data: part.value,
        })
    }
}

impl<'de> Deserialize<'de> for YamlData {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(DataVisitor)
    }
}

struct DataVisitor;

impl<'de> Visitor<'de> for DataVisitor {
    type Value = YamlData;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value, a list or a mapping")
    }

    fn visit_bool<E>(self, _: bool) -> Result<YamlData, E> {
        Ok(YamlData::Scalar)
    }

    fn visit_i64<E>(self, _: i64) -> Result<YamlData, E> {
        Ok(YamlData::Scalar)
    }

    fn visit_u64<E>(self, _: u64) -> Result<YamlData, E> {
        Ok(YamlData::Scalar)
    }

    fn visit_f64<E>(self, _: f64) -> Result<YamlData, E> {
        Ok(YamlData::Scalar)
    }

    fn visit_str<E>(self, _: &str) -> Result<YamlData, E> {
        Ok(YamlData::Scalar)
    }

    fn visit_unit<E>(self) -> Result<YamlData, E> {
        Ok(YamlData::Scalar)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut parts: A) -> Result<YamlData, A::Error> {
        let mut list = Vec::new();
        while let Some(part) = parts.next_element()? {
            list.push(part);
        }
        Ok(YamlData::List(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut parts: A) -> Result<YamlData, A::Error> {
        let mut map = Vec::new();
        while let Some((key, value)) = parts.next_entry::<Spanned<String>, _>()? {
            map.push(YamlPair {
                bytes: bytes(key.referenced),
                key: key.value,
                value,
            });
        }
        Ok(YamlData::Map(map))
    }
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::*;

    #[test]
    fn every_part_has_its_position() {
        let pairs: Pairs<Vec<Pairs<At<String>>>> = read("a:\n  - {b: 1.5, c: ''}\n").unwrap();
        let (key, list) = &pairs.0[0];
        let place = |line, column| YamlPlace { line, column };
        assert_eq!((key.value.as_str(), key.at), ("a", place(1, 1)));
        let [(b, first), (_, second)] = &list[0].0[..] else {
            panic!()
        };
        assert_eq!((b.at, first.at), (place(2, 6), place(2, 9)));
        assert_eq!((first.value.as_str(), second.value.as_str()), ("1.5", ""));
        let twice = read::<Pairs<At<String>>>("a: 1\na: 2\n").unwrap_err();
        assert_eq!(twice.at.line, 2, "{twice:?}");
    }

    #[test]
    fn parts_that_are_edited_have_their_bytes() {
        let text = "a:\n  - {\"b ü\": 1.5 , c: 'x'} # no\n";
        let node: YamlNode = read(text).unwrap();
        let YamlData::Map(map) = &node.data else {
            panic!()
        };
        let YamlData::List(list) = &map[0].value.data else {
            panic!()
        };
        let YamlData::Map(inner) = &list[0].data else {
            panic!()
        };
        let texts: Vec<&str> = inner
            .iter()
            .flat_map(|pair| [&text[pair.bytes.clone()], &text[pair.value.bytes.clone()]])
            .collect();
        assert_eq!(texts, ["\"b ü\"", "1.5", "c", "'x'"]);
    }

    #[test]
    fn an_alias_bomb_is_refused_too() {
        let mut text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned();
        for i in 1..12 {
            let one = format!("*a{}, ", i - 1).repeat(10);
            text = format!("{text}a{i}: &a{i} [{one}]\n");
        }
        assert!(read::<YamlNode>(&text).is_err());
    }
}
