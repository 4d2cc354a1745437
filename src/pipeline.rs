//! The whole program in order: read, divide, build, compare, draw and write.
//!
//! In comes the job of a command, such as [`Render`]; out come files and what the command reports. Open `read` first: from
//! bags to a mission. `render` goes on from there: it decides which picture there is, `fit` chooses what is shown so that it
//! is legible, `compose` shows and lays out. The other files are the jobs of the other commands.

use crate::base::words::worded;
mod collect;
#[cfg(feature = "render")]
mod compose;
mod copies;
#[cfg(feature = "render")]
mod drawing;
#[cfg(feature = "render")]
mod extract;
#[cfg(feature = "render")]
mod figure;
#[cfg(feature = "render")]
mod fit;
#[cfg(feature = "cli")]
pub mod follow;
#[cfg(feature = "render")]
mod gate;
mod inputs;
mod phases;
mod probe;
mod read;
#[cfg(feature = "render")]
mod render;
#[cfg(feature = "render")]
mod survey;
#[cfg(feature = "render")]
mod tables;
#[cfg(feature = "render")]
mod times;
#[cfg(feature = "render")]
mod unfolded;
mod verify;

pub use phases::Phases;
pub use read::{Reading, explain, read};
#[cfg(feature = "render")]
pub(crate) use {
    drawing::Medium,
    render::{render, show},
};
#[cfg(feature = "render")]
pub use {
    drawing::{Body, Drawing, Purpose},
    extract::{Extract, Extracted, extract},
    gate::{
        Baseline, BaselineWritten, Check, Checked, Compared, Diff, Report, baseline, check, diff,
    },
    render::{Render, Rendered},
    survey::{Survey, is_survey, survey, survey_file},
    tables::{Counted, Counting, Tabled, Tables, count, tables},
};
#[cfg(feature = "cli")]
pub(crate) use {
    gate::{expectation, put},
    read::mission_file,
    render::check as check_outputs,
    survey::each,
};

worded! {
    /// A stage of the work, for progress.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    #[non_exhaustive]
    pub enum Stage {
        /// Bags are read; progress counts bytes.
        Read = "reading",
        /// Bags are read a second time and compared; progress counts bytes.
        Verify = "verifying",
        /// Messages of many bags are counted; progress counts bags.
        Count = "counting",
        /// Graphs are built; progress counts windows.
        Graphs = "graphs",
        /// Everything is laid out.
        Layout = "layout",
        /// Frames are drawn and written; progress counts frames.
        Draw = "drawing",
    }
}

/// An observer of the work, which receives its progress and may stop it.
pub trait Watch {
    /// A new stage begins and the previous one ends.
    fn stage(&mut self, _stage: Stage) {}

    /// The stage has done `done` of `total`.
    fn progress(&mut self, _done: u64, _total: u64) {}

    /// A note for the user before the next stage begins, in a sentence.
    fn note(&mut self, _text: &str) {}

    /// Whether to stop as soon as possible, leaving no partial files.
    fn stopped(&self) -> bool {
        false
    }
}

/// An observer that does nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unwatched;

impl Watch for Unwatched {}
