//! Drawings as values: style, measured text and the scene of each window; painters stand in `paint`.

pub mod board;
pub mod figure;
pub mod paint;
pub mod picture;
pub mod scene;
pub mod strip;
pub mod style;
pub mod text;
