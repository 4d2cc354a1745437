//! Draws the requested figure and generates its LaTeX code.

use super::Drawing;
use crate::base::error::{Error, Result};
use crate::draw::figure::{self, Figure};
use crate::export::Output;
use crate::export::options::FigureOptions;
use crate::mission::Mission;

/// The figure and its LaTeX code.
///
/// # Errors
/// As [`figure::figure`].
pub(super) fn draw(
    mission: &Mission,
    drawing: &Drawing,
    options: &FigureOptions,
    outputs: &[Output],
) -> Result<(Figure, String)> {
    let filters = (&drawing.view.ns_filter, &drawing.view.topic_filter);
    let drawn = figure::figure(mission, filters, &drawing.fonts, options)?;
    let picture = outputs
        .iter()
        .find(|o| ["pdf", "png", "svg"].contains(&o.format.word))
        .and_then(|o| o.target.path().file_name())
        .map_or_else(
            || format!("{}.pdf", options.kind.word()),
            |name| name.to_string_lossy().into_owned(),
        );
    let is_special = |c: char| c.is_control() || "\\{}%#~^$&".contains(c);
    if picture.contains(is_special) && outputs.iter().any(|o| o.format.word == "tex") {
        let what = format!("LaTeX cannot include a file called `{picture}`");
        let hint = "give the picture a name of letters, digits, `.`, `-` and `_`";
        return Err(Error::usage(what, hint));
    }
    let latex = figure::latex(&drawn, &picture, options);
    Ok((drawn, latex))
}
