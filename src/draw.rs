//! Drawings as values: style, measured text and the scene of each window; painters are in `paint`.

pub(crate) mod figure;
pub(crate) mod paint;
pub mod picture;
pub mod scene;
pub mod strip;
pub mod style;
pub mod text;
pub(crate) mod timeline;
pub(crate) mod topic_timeline;
