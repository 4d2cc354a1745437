//! Columns of values in which equal neighbours are joined.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeSeq as _, Serializer};
use serde::{Deserialize, Deserializer};

use crate::graph::{Number, Row};

/// Values, each with the number of its repetitions.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct JsonColumn<T>(pub(crate) Vec<(T, u32)>);

impl<T> Default for JsonColumn<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: PartialEq> JsonColumn<T> {
    pub(crate) fn push(&mut self, value: T) {
        match self.0.last_mut() {
            Some((last, times)) if *last == value => *times = times.saturating_add(1),
            _ => self.0.push((value, 1)),
        }
    }
}

impl<T: Default + PartialEq> JsonColumn<T> {
    /// Whether all windows have the default value.
    pub(crate) fn is_plain(&self) -> bool {
        self.0.iter().all(|(value, _)| *value == T::default())
    }
}

impl<T> JsonColumn<T> {
    /// The meaning of every value, in order.
    pub(crate) fn values<'a, U: Copy + 'a>(
        &'a self,
        mut meaning: impl FnMut(&T) -> U + 'a,
    ) -> impl Iterator<Item = U> + 'a {
        let values = self.0.iter();
        values.flat_map(move |(value, times)| std::iter::repeat_n(meaning(value), *times as usize))
    }
}

impl<T: Serialize> Serialize for JsonColumn<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut seq = serializer.serialize_seq(Some(self.0.len()))?;
        for (value, times) in &self.0 {
            match times {
                1 => seq.serialize_element(value)?,
                _ => seq.serialize_element(&(value, times))?,
            }
        }
        seq.end()
    }
}

/// One value, or one with the number of its repetitions.
#[derive(Deserialize)]
#[serde(untagged)]
enum RawCell<T> {
    Repeated((T, u32)),
    One(T),
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for JsonColumn<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Cells(PhantomData))
    }
}

struct Cells<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for Cells<T> {
    type Value = JsonColumn<T>;

    fn expecting(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str("a list of values and of `[value, times]`")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<JsonColumn<T>, A::Error> {
        let mut column = JsonColumn::default();
        while let Some(cell) = list.next_element::<RawCell<T>>()? {
            column.0.push(match cell {
                RawCell::Repeated(both) => both,
                RawCell::One(value) => (value, 1),
            });
        }
        Ok(column)
    }
}

/// A rate: computed from the count, or another.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum JsonRate {
    /// The rate that follows from the count.
    Counted,
    Other(Option<f64>),
}

impl JsonRate {
    pub(crate) fn of(row: &Row) -> Self {
        row.rate
            .map_or(Self::Counted, |rate| Self::Other(rate.value()))
    }

    pub(crate) fn number(&self) -> Option<Number> {
        match self {
            Self::Counted => None,
            Self::Other(hz) => Some(Number::of(*hz)),
        }
    }
}

impl Serialize for JsonRate {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Counted => serializer.serialize_str("="),
            Self::Other(hz) => hz.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for JsonRate {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Raw {
            Hz(Option<f64>),
            Counted(serde::de::IgnoredAny),
        }
        Ok(match Raw::deserialize(deserializer)? {
            Raw::Hz(hz) => Self::Other(hz),
            Raw::Counted(_) => Self::Counted,
        })
    }
}
