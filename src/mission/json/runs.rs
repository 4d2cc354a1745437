//! The form of an evolution with very many windows: each element once, with the windows in which it exists and its
//! states in them as columns.
//!
//! ```text
//! "form": "runs",
//! "windows": [{"index": 0, "start_ns": …, "end_ns": …, "messages": …, "changes": […]}, …],
//! "topics": [{"name": "/scan", "types": […], …, "in": {"windows": [[0, 99], [120, 35999]],
//!   "state": [["active", 35979]], "degree": [["measured", 35979]], "count": [9, [10, 700], 11, …], …}}, …]
//! ```
//!
//! `windows` are pairs of the first and the last place. A column has a value per window of these in order; `[value,
//! times]` stands for as many equal ones; a column that is left out is `null` in all of them. The rate is the count
//! over the window's length, unless a column `hz` says otherwise (there `"="` is that rate); of a node the count is
//! `sent`.

mod columns;
mod read;
mod write;

#[cfg(test)]
mod tests;

pub(crate) use read::{RawElements, RawWhole, graphs};
pub(crate) use write::elements;
