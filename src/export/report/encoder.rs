//! The report in Markdown: a separate file, or appended to a job's summary.

use crate::base::{budget, file};
use crate::export::report::report;
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::export::{Started, one_text};

/// Begins the report; it follows the text already in the file if that is the file to append to.
///
/// # Errors
/// As [`one_text`]; as [`file::read_text`] for the file to append to.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let path = target.path();
    let is_appended = sequence.options.append_to.as_deref() == Some(path) && path.is_file();
    let before = if is_appended {
        file::read_text(path, budget::SUMMARY)?
    } else {
        String::new()
    };
    one_text(target, move || {
        let report = report(sequence);
        match before.trim_end() {
            "" => report,
            before => format!("{before}\n\n{report}"),
        }
    })
}
