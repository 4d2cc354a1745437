//! The signs of a page: its badges, and the legend of those that occur.

use std::fmt::Write as _;

use crate::draw::paint::classes::badge_shapes;
use crate::draw::paint::xml::Xml;
use crate::draw::picture::{LegendSign, signs};
use crate::draw::style::Style;
use crate::draw::timeline::Timeline;
use crate::draw::timeline::marks::Sign;
use crate::graph::State;
use crate::view::{Mark, View};

/// Writes the definitions of all badges, as a comparison of two windows may need one that no window shows.
pub(super) fn badges(xml: &mut Xml, style: &Style) {
    xml.open("defs");
    for mark in Mark::BADGED {
        badge_shapes(xml, style, mark);
    }
    xml.close();
}

const BOX: &str = "<rect x=\"5\" y=\"4\" width=\"26\" height=\"12\" rx=\"2\"/>";
const LINE: &str = "<path d=\"M3 10h24\"/><path d=\"M34 10l-8-4v8z\"/>";

/// The meaning of the signs that occur in these views, as HTML.
pub(super) fn legend(views: &[&View], rate_change: f64) -> String {
    let mut out = String::new();
    let mut shown: Vec<String> = Vec::new();
    for (sign, words) in views.iter().flat_map(|view| signs(view, rate_change)) {
        if !shown.contains(&words) {
            let mut text = Xml::default();
            text.text(&words);
            let _ = write!(
                out,
                "<span><svg viewBox=\"0 0 40 20\">{}</svg> {}</span>",
                picture(&sign),
                text.finish()
            );
            shown.push(words);
        }
    }
    out
}

/// The meaning of the marks that occur on the timeline, as HTML.
pub(super) fn timeline(timeline: &Timeline) -> String {
    let marks = timeline.marks();
    let has = |signs: &[Sign]| marks.iter().any(|(_, mark)| signs.contains(&mark.sign));
    let mut out = String::new();
    let mut add = |signs: &[Sign], class: &str, path: &str, words: &str| {
        if has(signs) {
            let path = format!("<path class=\"{class}\" d=\"{path}\"/>");
            let svg = format!("<svg viewBox=\"0 0 40 20\" class=\"marks\">{path}</svg>");
            let _ = write!(out, "<span>{svg} {words}</span>");
        }
    };
    let dots = [Sign::Dot, Sign::Letter];
    add(&[Sign::Start], "start", "M18 3v14", "begins");
    add(&[Sign::End], "end", "M13 5l10 10m0 -10l-10 10", "ends");
    add(&dots, "event", "M13 10l5 -5l5 5l-5 5z", "changes");
    let arrow = "M18 3V17m-3 -4l3 4l3 -4";
    add(&[Sign::Handover], "takeover", arrow, "handed over");
    out
}

fn picture(sign: &LegendSign) -> String {
    let front = BOX
        .replace("y=\"4\"", "y=\"7\"")
        .replace("\"26\"", "\"23\"");
    match sign {
        LegendSign::Node => group(
            "node",
            "<rect x=\"3\" y=\"3\" width=\"30\" height=\"14\" rx=\"7\"/>",
        ),
        LegendSign::Topic => group("topic", BOX),
        LegendSign::Group => group("topic", &format!("{BOX}{front}")),
        LegendSign::Namespace => group("node", &format!("{BOX}{front}")),
        LegendSign::Change(mark) => {
            let word = mark.badge();
            let badge = format!("<use href=\"#{word}\" class=\"{word}\" x=\"31\" y=\"5\"/>");
            group(
                &format!("topic {} {word}", mark.class()),
                &(BOX.to_owned() + &badge),
            )
        }
        LegendSign::Box(State::Latched) => {
            let bar = "<rect class=\"l\" x=\"6\" y=\"5\" width=\"3\" height=\"10\"/>";
            group("topic latched", &(BOX.to_owned() + bar))
        }
        LegendSign::Box(state) => group(&format!("topic {}", state.word()), BOX),
        LegendSign::Line(confidence) => group(&format!("edge active {}", confidence.word()), LINE),
        // Pages draw every topic as a box.
        LegendSign::Row => String::new(),
        LegendSign::Service => group("topic", "<path d=\"M3 10l6 -6h18l6 6l-6 6h-18z\"/>"),
        LegendSign::Starved => group(
            "edge active stated",
            "<path d=\"M3 10h24\"/><path d=\"M27 4h3v12h-3z\"/>",
        ),
        LegendSign::Width => group("edge active w5", LINE),
    }
}

fn group(class: &str, inside: &str) -> String {
    format!("<g class=\"{class}\">{inside}</g>")
}
