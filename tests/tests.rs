//! The integration tests: one binary, so that it links once.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking"
)]

mod architecture;
mod aside;
mod boxes;
mod causes;
mod ci;
mod cli;
mod clocks;
mod counts;
mod damaged;
mod docs;
mod edges;
mod encode;
mod evidence;
mod exchange;
mod figures;
mod folders;
mod follow;
mod gate;
mod given;
mod hostile;
mod info;
mod layout;
mod library;
mod lines;
mod many;
mod marks;
mod options;
mod pages;
mod pairs;
mod parts;
mod phases;
mod pictures;
mod properties;
mod questions;
mod ratchet;
mod rates;
mod reading;
mod restarts;
mod ros2_example;
mod source;
mod starts;
mod story;
mod support;
mod tables;
mod telling;
mod terminal;
mod topic_timeline;
mod values;
mod variants;
mod warehouse;
