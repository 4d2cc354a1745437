//! The report in Markdown: a file of its own, or at the end of one that a job collects.

use std::fs;

use super::{AtOnce, Encoder};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::output::Target;
use crate::report::report;

/// Begins the report; it follows what is in the file already if that is the file to append to.
///
/// # Errors
/// As [`AtOnce::start`]; [`Error::Io`] where the file to append to cannot be read.
pub(super) fn start<'a>(film: &'a Film<'a>, target: &Target) -> Result<Box<dyn Encoder + 'a>> {
    let path = target.path();
    let is_appended = film.options.append_to.as_deref() == Some(path) && path.exists();
    let before = if is_appended {
        fs::read_to_string(path).map_err(Error::io("read", path))?
    } else {
        String::new()
    };
    AtOnce::start(target, move || {
        let report = report(film);
        let text = match before.trim_end() {
            "" => report,
            before => format!("{before}\n\n{report}"),
        };
        (text, Vec::new())
    })
}
