//! The figure that was asked for, drawn and put into LaTeX.

use super::Drawing;
use crate::base::error::Result;
use crate::draw::figure::{self, Figure};
use crate::export::Output;
use crate::export::options::FigureOptions;
use crate::mission::Mission;

/// The figure, and the lines for LaTeX.
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
    let latex = figure::latex(&drawn, &picture, options);
    Ok((drawn, latex))
}
