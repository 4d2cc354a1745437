//! The report in Markdown: a separate file, or appended to a job's summary.

use crate::base::file;
use crate::export::report::report;
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::export::{Started, one_text};

/// Begins the report; it follows the text already in the file if that is the file to append to.
///
/// # Errors
/// As [`one_text`]; as [`file::text_before`] for the file to append to.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let before = file::text_before(target.path(), sequence.options.append_to.as_deref())?;
    one_text(target, move || before + &report(sequence))
}
