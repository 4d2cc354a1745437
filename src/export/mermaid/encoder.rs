//! Graphs as Mermaid flow charts: one per window, or their union.

use crate::draw::style::Style;
use crate::export::mermaid::chart;
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::export::{Started, at_end, text_per_window};
use crate::view::SeenWindow;

/// Begins the files, one per window; without `{n}` one file with the single window or the union of all.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let (view, style) = (sequence.view, Style::builtin("light")?);
    let target = target.clone();
    Ok(at_end(move || {
        text_per_window(
            view,
            &target,
            |seen, _| chart(view, &style, seen),
            too_large,
        )
    }))
}

/// The numbers of edges and of characters above which Mermaid refuses to draw unless it is configured otherwise (its
/// `maxEdges` and `maxTextSize`).
const MOST: (usize, usize) = (500, 50_000);

fn too_large(target: &Target, seen: &SeenWindow, text: &str) -> Option<String> {
    let (edges, bytes) = (seen.arrows.len(), text.len());
    (edges > MOST.0 || bytes > MOST.1).then(|| {
        format!(
            "`{}` has {edges} edges in {bytes} characters: Mermaid draws at most {} in {}; hide or collapse some elements",
            target.path().display(),
            MOST.0,
            MOST.1
        )
    })
}
