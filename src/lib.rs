//! See how a robot's software reconfigures during a mission, straight from its bag files.
//!
//! ```text
//! bag ──> evidence ──> window ──> graph ──> diff ──> layout ──> scene ──> frame ──> encoder
//! ```

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
