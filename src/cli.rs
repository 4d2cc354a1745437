//! What was typed, turned into work; the only file (with its folder) that knows clap and the environment.

mod typed;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{CommandFactory as _, Parser as _};
