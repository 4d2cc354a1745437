//! Graphs as DOT text: one per window, or their union.

use crate::base::words;
use crate::draw::paint::dot::DotView;
use crate::draw::style::Style;
use crate::draw::text::Fonts;
use crate::export::options::Profile;
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::export::{Started, at_end, text_per_window};

/// Begins the files, one per window; without `{n}` one file with the single window or the union of all.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let drawing = DotView::new(sequence.mission, sequence.view, Style::builtin("light")?);
    let drawing = match sequence.options.dot_profile {
        Profile::Rqt => drawing.laid_out(&Fonts::bundled()),
        Profile::Plain => drawing,
    };
    let target = target.clone();
    Ok(at_end(move || {
        let text = |seen: &_, index| drawing.write(seen, &title(sequence, index));
        text_per_window(sequence.view, &target, text, |_, _, _| None)
    }))
}

/// The bags' names, and the window with its time.
fn title(sequence: &Sequence<'_>, window: Option<usize>) -> String {
    let mission = sequence.mission;
    let names: Vec<&str> = mission.bags.iter().map(|b| b.name.as_str()).collect();
    let name = match &names[..] {
        [first, _, ..] => format!("{first} and {} more", names.len() - 1),
        _ => names.concat(),
    };
    let frames = &sequence.view.frames;
    let Some(frame) = window.and_then(|at| frames.iter().find(|f| f.index == at)) else {
        return name;
    };
    let time = |at| words::offset(mission.offset(at));
    let (from, to) = (time(frame.span.start), time(frame.span.end));
    format!(
        "{name}: window {} of {}, {from} to {to}",
        frame.index + 1,
        frames.len()
    )
}
