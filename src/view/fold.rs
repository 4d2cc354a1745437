//! Several elements shown as one: nodes, topics, lines, rows of boxes, and changes.
//!
//! In come the elements of a mission and the options; out comes the box of each node and topic, and boxes and arrows that
//! are rows of others. [`keys`] applies the rules one after the other and is the file to open first.

pub(super) mod crowded;
pub(super) mod equal;
pub(super) mod keys;
pub(super) mod namespaces;
pub(super) mod roles;
pub(super) mod rows;
pub(super) mod topics;
