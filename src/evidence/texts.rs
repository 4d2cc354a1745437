//! Log texts of nodes and values of small messages, kept together so that a log text that repeats a message
//! can be found. Bounded: beyond the limit, the first are kept.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::time::{Span, Stamp};

/// A text of a logger.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct LoggedText {
    pub(crate) time: Stamp,
    pub(crate) logger: Arc<str>,
    pub(crate) text: Box<str>,
}

/// A value in a message of a stream.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ShownValue {
    pub(crate) time: Stamp,
    pub(crate) stream: usize,
    /// The index of the field in the message.
    pub(crate) field: usize,
    pub(crate) value: Box<str>,
}

/// The kept log texts and message values.
#[derive(Clone, Debug, Default)]
pub(crate) struct LoggedTexts {
    said: Vec<LoggedText>,
    shown: Vec<ShownValue>,
    /// The number of bytes of log texts and of values.
    bytes: [usize; 2],
}

/// The most bytes of log texts, and of values, that are kept.
const MOST: usize = 2 << 20;
/// The overhead of a short text in bytes.
const ENTRY: usize = 48;

impl LoggedTexts {
    /// Adds a log text.
    pub(crate) fn add(&mut self, time: Stamp, logger: &str, text: &str) {
        self.bytes[0] += text.len() + ENTRY;
        if self.bytes[0] <= MOST {
            self.said.push(LoggedText {
                time,
                logger: logger.into(),
                text: text.into(),
            });
        }
    }

    /// Adds a value in a message.
    pub(crate) fn show(&mut self, time: Stamp, (stream, field): (usize, usize), value: &str) {
        self.bytes[1] += value.len() + ENTRY;
        if self.bytes[1] <= MOST {
            self.shown.push(ShownValue {
                time,
                stream,
                field,
                value: value.into(),
            });
        }
    }

    /// Drops those at other times than these.
    pub(crate) fn clip(&mut self, span: Span) {
        self.said.retain(|text| span.contains(text.time));
        self.shown.retain(|value| span.contains(value.time));
    }

    /// Log texts and values, sorted; of values that a field repeats, only the first.
    pub(crate) fn sorted(&self) -> (Vec<LoggedText>, Vec<ShownValue>) {
        let (mut said, mut shown) = (self.said.clone(), self.shown.clone());
        said.sort_unstable();
        shown.sort_unstable();
        let mut last: BTreeMap<(usize, usize), Box<str>> = BTreeMap::new();
        shown.retain(|message| {
            let place = (message.stream, message.field);
            let before = last.insert(place, message.value.clone());
            before.is_none_or(|value| value != message.value)
        });
        (said, shown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_field_values_are_kept_once() {
        let mut texts = LoggedTexts::default();
        for (time, value) in [(3, "b"), (1, "a"), (2, "a"), (4, "a")] {
            texts.show(Stamp(time), (0, 0), value);
        }
        let times: Vec<_> = texts.sorted().1.iter().map(|s| s.time.0).collect();
        assert_eq!(times, [1, 3, 4]);
    }

    #[test]
    fn either_side_is_bounded() {
        let mut texts = LoggedTexts::default();
        let long = "x".repeat(1 << 20);
        (0..9).for_each(|n| texts.add(Stamp(n), "/a", &long));
        texts.show(Stamp(0), (0, 0), "kept");
        let (said, shown) = texts.sorted();
        assert_eq!((said.len(), shown.len()), (1, 1));
    }
}
