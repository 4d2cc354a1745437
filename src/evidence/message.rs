//! Payloads as values. In: bytes of ROS 1 or CDR, and the definitions that describe them. Out: numbers and texts read one by one
//! (`cursor`, with which to begin), a message as data (`dynamic`), or columns of a table (`fields`).

pub(crate) mod cursor;
pub(crate) mod definition;
pub(crate) mod dynamic;
pub(crate) mod fields;
