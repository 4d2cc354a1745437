//! The types and helpers that all other modules share: times, names, errors, notices, points, and the small formats
//! around them.
//!
//! Nothing comes in; out come types without knowledge of robots. Open `time` and `error` first, then `words`, through which
//! everything that people read goes.

pub(crate) mod budget;
pub(crate) mod cast;
pub(crate) mod columns;
pub(crate) mod csv;
pub(crate) mod digest;
pub mod error;
pub(crate) mod file;
pub mod geometry;
pub(crate) mod ids;
pub mod name;
pub(crate) mod nearest;
pub mod notice;
pub(crate) mod rhythm;
pub(crate) mod runs;
pub(crate) mod table;
pub mod time;
pub(crate) mod varint;
pub mod words;
pub(crate) mod yaml;
