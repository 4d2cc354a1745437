//! See how a robot's software reconfigures during a mission, straight from its bag files.
//!
//! ```text
//! bag ──> evidence ──> window ──> graph ──> diff ──> layout ──> scene ──> frame ──> encoder
//! ```
//!
//! [`pipeline`] is that line in the order it happens; everything before the scene decides, everything after it only draws.
//!
//! ```
//! use bagreel::bag::Input;
//! use bagreel::pipeline::{Reading, Unwatched, read};
//!
//! let bag = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
//! let reading = Reading { inputs: vec![Input::Path(bag.into())], ..Reading::default() };
//! let mission = read(&reading, &mut Unwatched)?;
//! for window in &mission.windows {
//!     println!("{}: {} nodes, {} changes", window.index, window.graph.nodes.len(), window.changes.len());
//! }
//! # assert!(mission.windows.len() >= 5 && mission.elements.nodes.len() > 5);
//! # Ok::<(), bagreel::error::Error>(())
//! ```
//!
//! Where to add things: a bag format is a file in `bag/` and a row in [`bag::FORMATS`], a kind of evidence one in
//! `evidence/` and [`evidence::SOURCES`], an output one in `encode/` and [`encode::FORMATS`], a style one in `styles/` and
//! [`style::BUILTIN`], a layout engine one in `layout/` and [`layout::ENGINES`].
//!
//! The library is silent and repeatable: it never prints (but for [`terminal`] and [`cli`]), reads no clock, and writes the
//! same bytes for the same bag.

pub mod bag;
pub mod cli;
pub mod collect;
mod decompress;
mod definition;
pub mod diff;
pub mod dot;
pub mod encode;
pub mod error;
pub mod events;
pub mod evidence;
pub mod evolution;
mod facts;
pub mod film;
pub mod geometry;
pub mod graph;
mod hash;
pub mod info;
pub mod layout;
pub mod mermaid;
pub mod name;
pub mod notice;
pub mod output;
pub mod page;
pub mod palette;
pub mod picture;
pub mod pipeline;
pub mod pixels;
mod proof;
pub mod reel;
pub mod report;
mod rhythm;
pub mod scene;
mod source;
pub mod spells;
pub mod stage;
pub mod stamps;
pub mod strip;
pub mod style;
pub mod svg;
mod table;
pub mod terminal;
pub mod text;
pub mod time;
pub mod topology;
mod trust;
mod value;
pub mod view;
pub mod window;
pub mod wire;
mod yaml;
