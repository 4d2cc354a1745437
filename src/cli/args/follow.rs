//! The arguments of `follow`.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::Args;

use super::values::{length, one_of, period};
use crate::base::time::Period;
use crate::graph::window::Length;
use crate::mission::event_log::LogFormat;

#[derive(Debug, Args)]
pub(crate) struct FollowArgs {
    /// The recording: `.bag.active`, `.bag`, `.mcap`, `.db3`, a rosbag2 folder, or a folder whose newest recording
    /// is followed.
    #[arg(value_name = "WHAT")]
    pub(crate) what: PathBuf,
    /// Output format: a line per event for people, or an object per line for programs.
    #[arg(long, value_name = "text|ndjson", default_value = "text", value_parser = one_of([LogFormat::Text, LogFormat::Ndjson]))]
    pub(crate) format: LogFormat,
    /// Check the recording against this expectations file: print findings when they are certain, and exit
    /// as `check` does.
    #[arg(long, value_name = "FILE")]
    pub(crate) expect: Option<PathBuf>,
    /// Output file, written at the end as `render` writes it from the closed recording. Repeatable.
    #[arg(long = "output", short, value_name = "FILE")]
    pub(crate) outputs: Vec<OsString>,
    /// Length of a window in outputs, and for rules about rates.
    #[arg(long, short, value_parser = length)]
    pub(crate) period: Option<Length>,
    /// Stop when nothing was written for this long. [default: when the recorder closes the recording, or at a signal]
    #[arg(long, value_name = "TIME", value_parser = period)]
    pub(crate) idle: Option<Period>,
}

pub(crate) const FOLLOW_HELP: &str = "Nothing is written to the recording, and a database is never locked. A line is marked `(so far)` until it is certain.\n\n\
    Exit codes: 0 done, 1 failed or a rule is broken, 2 usage error, 3 done but data was skipped (damaged bag).";
