//! The whole sequence as one animated SVG.

use super::{AtOnce, Encoder};
use crate::base::error::Result;
use crate::base::geometry::Rect;
use crate::draw::paint::animated;
use crate::draw::paint::svg;
use crate::export::sequence::{Overview, Sequence};
use crate::export::target::Target;
use crate::view::View;

/// The number of elements above which browsers take a third of a processor core and more to show it, whether or not
/// their user asked for less motion.
const MANY: usize = 100;

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
            let overview = sequence.picture.overview();
            let played = overview.map(|o| played(&o, sequence.options.frame_ms));
            return (played.unwrap_or_default(), Vec::new());
        };
        let remarks = remark(sequence.view).into_iter().collect();
        let frame_ms = sequence.options.frame_ms;
        let svg = animated::write(
            sequence.view,
            &sequence.mission.ledger.phases,
            (&whole.union, whole.style),
            sequence.picture.title().unwrap_or_default(),
            frame_ms,
        );
        (svg, remarks)
    })
}

/// The SVG text of an overview over time with a head that goes from window to window.
fn played(overview: &Overview, frame_ms: u32) -> String {
    let list = |of: fn(&Rect) -> f64| overview.heads_list(of, ";");
    let seconds = overview.heads.len() as f64 * f64::from(frame_ms) / 1e3;
    let head = overview.heads.first().copied().unwrap_or_default();
    let turn = |name: &str, values: String| {
        format!(
            "<animate attributeName=\"{name}\" calcMode=\"discrete\" dur=\"{seconds}s\" repeatCount=\"indefinite\" values=\"{values}\"/>"
        )
    };
    let head = format!(
        "<rect id=\"playhead\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"2\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\">{}{}</rect>\n</svg>\n",
        head.x,
        head.y,
        head.w,
        head.h,
        overview.color,
        turn("x", list(|h| h.x)),
        turn("width", list(|h| h.w)),
    );
    let still = svg::write(&overview.scene);
    let open = still.trim_end().strip_suffix("</svg>").unwrap_or(&still);
    open.to_owned() + &head
}

fn remark(view: &View) -> Option<String> {
    let elements = view.items.len() + view.arrows.len();
    (elements > MANY).then(|| {
        format!("an animated SVG of {elements} elements keeps a browser busy: a GIF shows the same at a tenth of the cost")
    })
}
