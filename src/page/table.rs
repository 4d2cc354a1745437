//! What changed as a table of HTML, for readers without scripts, for paper, and for links into the mission.

use std::fmt::Write as _;

use crate::spells::Spells;
use crate::svg::escape;
use crate::text::visible;
use crate::time::offset;
use crate::view::{Frame, View};

/// More windows with changes than this are counted.
const MOST_ROWS: usize = 200;

fn is_told(frame: &Frame) -> bool {
    !frame.caption.is_empty()
}

/// How many windows there are, and how many of them have changes.
pub(super) fn summary(view: &View) -> String {
    let all = view.frames.len();
    match view.frames.iter().filter(|f| is_told(f)).count() {
        0 => format!("None in {all} windows."),
        n if n > MOST_ROWS => format!("In {n} of {all} windows; the first {MOST_ROWS}:"),
        n => format!("In {n} of {all} windows:"),
    }
}

/// How much changed, window by window, as paths in a box 60 high and a window wide for each: what was added above the
/// line in the middle, what was removed below it, what changed on the ground.
pub(crate) fn bars(spells: &Spells) -> String {
    let mut out = String::new();
    for (kind, base, up) in [
        ("added", 30.0, -1.0),
        ("removed", 30.0, 1.0),
        ("changed", 60.0, -1.0),
    ] {
        let counts = spells.counts(kind);
        let most = counts.values().max().copied().unwrap_or(1) as f64;
        let _ = write!(out, "<path class=\"{kind}\" d=\"");
        for (window, count) in counts {
            // Logarithms, so that one change is seen beside a hundred.
            let part = libm::log(count as f64) / libm::log(most.max(9.0));
            let height = up * libm::round(6.0 + 20.0 * part);
            let _ = write!(out, "M{window} {base}h1v{height}h-1z");
        }
        out.push_str("\"/>");
    }
    out
}

/// A row per window with changes: its time as a link, and what changed in words.
pub(super) fn rows(view: &View) -> String {
    let mut out = String::new();
    let Some(start) = view.frames.first().map(|f| f.span.start) else {
        return out;
    };
    for frame in view.frames.iter().filter(|f| is_told(f)).take(MOST_ROWS) {
        let at = frame.span.start.since(start);
        let millis = at / 1_000_000;
        let secs = millis as f64 / 1e3;
        let _ = write!(
            out,
            "<tr><th><a href=\"#t={secs}\">{}</a><td>",
            offset(millis * 1_000_000)
        );
        escape(&mut out, &visible(&frame.caption.join("; ")));
        out.push('\n');
    }
    out
}
