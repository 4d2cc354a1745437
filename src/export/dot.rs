//! Graphs as DOT text: one per window, or their union.

use crate::draw::paint::dot::DotView;
use crate::draw::style::Style;
use crate::draw::text::Fonts;
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::export::{Started, at_end, text_per_window};

/// Begins the files, one per window; without `{n}` one file with the single window or the union of all.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let (view, style) = (sequence.view, Style::builtin("light")?);
    let drawing = DotView::new(sequence.mission, view, style, &Fonts::bundled());
    let target = target.clone();
    Ok(at_end(move || {
        text_per_window(view, &target, |sink, seen| drawing.write(sink, seen))
    }))
}
