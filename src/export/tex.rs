//! The `LaTeX` code that includes a figure, written beside its picture.

use super::{Started, one_text};
use crate::base::error::Error;
use crate::export::sequence::Sequence;
use crate::export::target::Target;

/// Writes the code.
///
/// # Errors
/// [`Error::Usage`] without a figure, and for a name with `{n}`.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let Some(latex) = sequence.latex else {
        return Err(needs_figure(target));
    };
    let text = latex.file(target.path());
    one_text(target, move || text)
}

/// The error for `LaTeX` code without a figure.
pub(crate) fn needs_figure(target: &Target) -> Error {
    let what = format!("`{}` includes a figure in LaTeX", target.path().display());
    Error::usage(what, "`bagreel figure BAG -o fig.pdf -o fig.tex` draws one")
}
