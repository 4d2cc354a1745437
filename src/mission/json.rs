//! A mission as JSON. In: a [`Mission`](super::Mission), or its text. Out: the other of the two, equal to what it was.
//!
//! Begin with `write`, which lists the keys of a mission; `elements`, `columns` and `events` are their values, each one struct for
//! writing and for reading.

mod columns;
mod elements;
mod events;
mod formatter;
mod read;
mod write;

use std::borrow::Cow;

use serde::Serialize;

pub(crate) use events::event_rows;
pub use read::read_json;
pub(crate) use write::Json;
pub use write::write_json;

/// A text, borrowed when written.
type Text<'a> = Cow<'a, str>;

/// The schema that is written and read.
const SCHEMA: &str = "bagreel.mission/3";

/// A value as JSON on one line.
pub(crate) fn text(value: &impl Serialize) -> String {
    // Only maps with keys that are not strings fail, and there are none.
    serde_json::to_string(value).unwrap_or_default()
}

#[cfg(test)]
mod tests;
