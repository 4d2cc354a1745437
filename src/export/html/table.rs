//! The changes as an HTML table, for readers without scripts, for printing, and for links into the mission.

use crate::base::words;
use crate::base::words::visible;
use crate::draw::paint::xml::Xml;
use crate::draw::picture::title::SIDES;
use crate::view::{Frame, View};

/// The most windows with changes that have a row; the rest is counted.
const MOST_ROWS: usize = 200;

/// The most phrases in one row; the rest is counted.
const MOST_PHRASES: usize = 5;

fn has_headlines(frame: &Frame) -> bool {
    !frame.headlines.is_empty()
}

/// The number of windows, and of those with changes, as text.
pub(super) fn summary(view: &View) -> String {
    let all = view.frames.len();
    if view.compares {
        return "Differences:".to_owned();
    }
    match view.frames.iter().filter(|f| has_headlines(f)).count() {
        0 => format!("None in {all} windows."),
        n if n > MOST_ROWS => format!("In {n} of {all} windows; the first {MOST_ROWS}:"),
        n => format!("In {n} of {all} windows:"),
    }
}

/// A row per window with changes: its time as a link, and its changes in words.
pub(super) fn rows(view: &View) -> String {
    let mut xml = Xml::default();
    let Some(start) = view.frames.first().map(|f| f.span.start) else {
        return String::new();
    };
    for frame in view
        .frames
        .iter()
        .filter(|f| has_headlines(f))
        .take(MOST_ROWS)
    {
        let millis = frame.span.start.since(start) / 1_000_000;
        let secs = millis as f64 / 1e3;
        let events: Vec<String> = frame
            .headlines
            .iter()
            .map(|h| h.event.to_string())
            .collect();
        xml.open("tr");
        xml.attribute("data-entries", events.join(" "));
        xml.open("th").open("a");
        xml.attribute("href", format_args!("#t={secs}"));
        if view.compares {
            xml.text(SIDES[frame.index.min(1)]);
        } else {
            xml.text(&words::offset(millis * 1_000_000));
        }
        xml.close().close();
        let what = frame.words(MOST_PHRASES);
        xml.open("td")
            .text(&visible(&what))
            .close()
            .close()
            .raw("\n");
    }
    xml.finish()
}
