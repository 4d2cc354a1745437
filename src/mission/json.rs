//! A mission as JSON, written as a stream and read back.

pub(crate) mod changes;
pub(crate) mod elements;
pub(crate) mod events;
pub(crate) mod lines;
mod raw;
pub(crate) mod read;
pub(crate) mod runs;
mod sending;
pub(crate) mod write;
