//! Painters: each turns a [`scene`](crate::draw::scene) into an output form, without any decisions about its
//! content.

pub(crate) mod animated;
pub(crate) mod classes;
pub(crate) mod dot;
#[cfg(feature = "pdf")]
pub(crate) mod pdf;
pub mod raster;
pub(crate) mod svg;
pub(crate) mod xml;
