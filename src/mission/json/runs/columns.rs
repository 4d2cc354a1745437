//! Run-length encoded columns.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

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

/// One value with the number of its repetitions, or one alone.
#[derive(Deserialize, Serialize)]
#[serde(untagged)]
enum JsonCell<T> {
    Repeated(T, u32),
    One(T),
}

impl<T: Serialize> Serialize for JsonColumn<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|(value, times)| match times {
            1 => JsonCell::One(value),
            _ => JsonCell::Repeated(value, *times),
        }))
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for JsonColumn<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let cells = Vec::<JsonCell<T>>::deserialize(deserializer)?;
        let cells = cells.into_iter().map(|cell| match cell {
            JsonCell::Repeated(value, times) => (value, times),
            JsonCell::One(value) => (value, 1),
        });
        Ok(Self(cells.collect()))
    }
}

/// A rate: computed from the count, which is written as `=`, or another.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum JsonRate {
    Other(Option<f64>),
    Counted(char),
}

impl Default for JsonRate {
    fn default() -> Self {
        Self::Counted('=')
    }
}

impl JsonRate {
    pub(crate) fn of(row: &Row) -> Self {
        row.rate
            .map_or_else(Self::default, |rate| Self::Other(rate.value()))
    }

    pub(crate) fn number(&self) -> Option<Number> {
        match self {
            Self::Counted(_) => None,
            Self::Other(hz) => Some(Number::of(*hz)),
        }
    }
}
