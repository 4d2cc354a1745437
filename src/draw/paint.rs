//! Painters of one shape: each turns a [`scene`](crate::draw::scene) into what can be written, and decides nothing.

pub mod classes;
pub(crate) mod pdf;
pub mod raster;
pub mod svg;
pub(crate) mod xml;
