//! The whole sequence as one animated SVG.

use std::io::Write as _;

use super::{Started, one_file};
use crate::draw::paint::animated::AnimatedScenes;
use crate::export::sequence::{FrameTime, Sequence};
use crate::export::target::Target;
use crate::view::View;

/// The number of elements above which browsers need a third of a core or more to show it, even with reduced motion.
const MANY: usize = 100;

/// Begins the animation.
///
/// # Errors
/// As [`one_file`].
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    one_file(target, "all windows are in one file", move |sink| {
        let remarks = remark(sequence.view).into_iter().collect();
        let times = sequence.frame_times(true);
        let busiest = sequence.view.busiest();
        let still = times.iter().rposition(|time| time.window <= busiest);
        let scene = |time: &FrameTime| (sequence.picture.scene(time.window), time.ms);
        let scenes = AnimatedScenes::new(times.iter().map(scene));
        let title = sequence.picture.title().unwrap_or_default();
        let text = scenes.write(title, still.unwrap_or(0));
        sink.write_all(text.as_bytes()).map(|()| remarks)
    })
}

fn remark(view: &View) -> Option<String> {
    let elements = view.items.len() + view.arrows.len();
    (elements > MANY).then(|| {
        format!("an animated SVG of {elements} elements is slow in browsers; prefer a GIF")
    })
}
