//! The signs of a page: its badges, and the legend of all that occur.

use std::fmt::Write as _;

use crate::draw::paint::classes::badge_shapes;
use crate::draw::paint::xml::Xml;
use crate::draw::picture::{LegendSign, signs};
use crate::draw::style::Style;
use crate::graph::State;
use crate::view::runs::word;
use crate::view::{Mark, View};

const MARKS: [Mark; 9] = [
    Mark::Added,
    Mark::Removed,
    Mark::Faster,
    Mark::Slower,
    Mark::HandedOver,
    Mark::Restarted,
    Mark::Paused,
    Mark::Changed,
    Mark::Inside,
];

/// Writes the definitions of all badges, for a comparison of two windows may need one that no window shows.
pub(super) fn badges(xml: &mut Xml, style: &Style) {
    xml.open("defs");
    for mark in MARKS {
        badge_shapes(xml, style, mark);
    }
    xml.close();
}

const BOX: &str = "<rect x=\"5\" y=\"4\" width=\"26\" height=\"12\" rx=\"2\"/>";
const LINE: &str = "<path d=\"M3 10h24\"/><path d=\"M34 10l-8-4v8z\"/>";

/// The meaning of the signs that occur in these views, as HTML.
pub(super) fn legend(views: &[&View], rate_change: f64) -> String {
    let mut out = String::new();
    let mut told: Vec<String> = Vec::new();
    for (sign, words) in views.iter().flat_map(|view| signs(view, rate_change)) {
        if !told.contains(&words) {
            let mut text = Xml::default();
            text.text(&words);
            let _ = write!(
                out,
                "<span><svg viewBox=\"0 0 40 20\">{}</svg> {}</span>",
                picture(&sign),
                text.finish()
            );
            told.push(words);
        }
    }
    out
}

fn picture(sign: &LegendSign) -> String {
    let front = BOX
        .replace("y=\"4\"", "y=\"7\"")
        .replace("\"26\"", "\"23\"");
    match sign {
        LegendSign::Node => group("node", "<ellipse cx=\"18\" cy=\"10\" rx=\"15\" ry=\"7\"/>"),
        LegendSign::Topic => group("topic", BOX),
        LegendSign::Hub => group("topic", &format!("{BOX}{LINE}")),
        LegendSign::Group => group("topic", &format!("{BOX}{front}")),
        LegendSign::Namespace => group("node", &format!("{BOX}{front}")),
        LegendSign::Change(mark) => {
            let word = word(*mark);
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
        LegendSign::Line(degree) => group(&format!("edge active {}", degree.word()), LINE),
        LegendSign::Width => group("edge active w5", LINE),
    }
}

fn group(class: &str, inside: &str) -> String {
    format!("<g class=\"{class}\">{inside}</g>")
}
