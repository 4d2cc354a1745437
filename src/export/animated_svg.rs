//! The whole sequence as one animated SVG.

use super::{AtOnce, Encoder};
use crate::base::error::Result;
use crate::draw::paint::animated;
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::view::View;

/// Above this many elements, browsers take most of a processor core to show it.
const MANY: usize = 300;

/// Begins the animation.
///
/// # Errors
/// As [`AtOnce::start`].
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    AtOnce::start(target, move || {
        let Some(whole) = sequence.picture.graph() else {
            return (String::new(), Vec::new());
        };
        let remarks = remark(sequence.view).into_iter().collect();
        let frame_ms = sequence.options.frame_ms;
        let svg = animated::write(
            sequence.view,
            &whole.union,
            whole.style,
            whole.title,
            frame_ms,
        );
        (svg, remarks)
    })
}

fn remark(view: &View) -> Option<String> {
    let elements = view.items.len() + view.arrows.len();
    (elements > MANY).then(|| {
        format!("an animated SVG of {elements} elements keeps a browser busy: a GIF shows the same at a tenth of the cost")
    })
}
