//! Rows over time: when each node or topic existed, published and changed.

pub(crate) mod band;
pub(crate) mod canvas;
pub(crate) mod course;
pub(crate) mod legend;
pub(crate) mod live;
pub(crate) mod lives;
pub(crate) mod marks;
pub(crate) mod notes;
pub(crate) mod rows;
pub(crate) mod signs;
pub(crate) mod source;
pub(crate) mod tracks;
