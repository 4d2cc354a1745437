//! Painters, all alike: each turns a [`scene`](crate::draw::scene) into a form that can be written, and decides
//! nothing.

pub(crate) mod animated;
pub(crate) mod classes;
pub(crate) mod dot;
#[cfg(feature = "pdf")]
pub(crate) mod pdf;
pub mod raster;
pub(crate) mod svg;
pub(crate) mod xml;
