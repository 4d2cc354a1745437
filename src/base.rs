//! The nouns that all stations share: times, names, errors, notices, points, and the small formats around them.

pub(crate) mod csv;
pub(crate) mod digest;
pub mod error;
pub mod geometry;
pub mod name;
pub mod notice;
pub mod time;
pub mod words;
pub(crate) mod yaml;
