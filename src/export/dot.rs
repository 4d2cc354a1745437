//! Graphs as DOT text: one per window, or their union.

use crate::draw::paint::dot::DotView;
use crate::draw::style::Style;
use crate::draw::text::Fonts;
use crate::export::sequence::Sequence;
use crate::export::sink::OutputSink;
use crate::export::target::Target;
use crate::export::{Started, text_per_window};
use crate::view::SeenWindow;

/// Begins the files, one per window; without `{n}` one file with the single window or the union of all.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let (view, style) = (sequence.view, Style::builtin("light")?);
    let drawing = DotView::new(sequence.mission, view, style, &Fonts::bundled());
    let write = move |sink: &mut OutputSink, seen: &SeenWindow| drawing.write(sink, seen);
    Ok(text_per_window(view, target, write))
}
