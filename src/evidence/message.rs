//! Payloads as values: a cursor over ROS 1 and CDR bytes, and the message definitions that describe them.

pub(crate) mod cursor;
pub(crate) mod definition;
pub(crate) mod dynamic;
pub(crate) mod fields;
pub(crate) mod log;
pub(crate) mod parameters;
