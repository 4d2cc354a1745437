//! Graphs as DOT text: one per window, or their union.

use std::io::Write as _;

use crate::base::error::Result;
use crate::base::words;
use crate::draw::paint::dot::DotView;
use crate::draw::style::Style;
use crate::draw::text::Fonts;
use crate::export::options::Profile;
use crate::export::sequence::Sequence;
use crate::export::sink::OutputSink;
use crate::export::target::Target;
use crate::export::{Encoder, Written};
use crate::view::union::union;

struct DotEncoder<'a> {
    sequence: &'a Sequence<'a>,
    target: Target,
    drawing: DotView<'a>,
}

/// Begins the files, one per window; without `{n}` one file with the single window or the union of all.
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    let drawing = DotView::new(sequence.mission, sequence.view, Style::builtin("light")?);
    let drawing = match sequence.options.dot_profile {
        Profile::Rqt => drawing.laid_out(&Fonts::bundled()),
        Profile::Plain => drawing,
    };
    Ok(Box::new(DotEncoder {
        sequence,
        target: target.clone(),
        drawing,
    }))
}

impl Encoder for DotEncoder<'_> {
    fn finish(self: Box<Self>) -> Result<Written> {
        let mut written = Written::to(&self.target);
        let view = self.sequence.view;
        let frames = &view.frames;
        let mut write = |target: &Target, text: &str| -> Result<()> {
            let mut sink = OutputSink::create(target, None)?;
            sink.write_all(text.as_bytes()).map_err(sink.error())?;
            written.add(sink.commit()?);
            Ok(())
        };
        if self.target.is_numbered() {
            for (k, frame) in frames.iter().enumerate() {
                let target = self.target.numbered(frame.index, frames.len());
                let title = self.title(Some(frame.index));
                write(&target, &self.drawing.write(&view.seen(k), &title))?;
            }
        } else if frames.len() == 1 {
            write(
                &self.target,
                &self.drawing.write(&view.seen(0), &self.title(None)),
            )?;
        } else if let Some(all) = union(view) {
            write(&self.target, &self.drawing.write(&all, &self.title(None)))?;
        }
        Ok(written)
    }
}

impl DotEncoder<'_> {
    /// The bags' names, and the window with its time.
    fn title(&self, window: Option<usize>) -> String {
        let mission = self.sequence.mission;
        let names: Vec<&str> = mission.bags.iter().map(|b| b.name.as_str()).collect();
        let name = match &names[..] {
            [first, _, ..] => format!("{first} and {} more", names.len() - 1),
            _ => names.concat(),
        };
        let frames = &self.sequence.view.frames;
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
}
