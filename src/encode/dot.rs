//! Graphs as DOT text: one per window, or their union.

use std::io::Write as _;

use super::{Encoder, Written};
use crate::dot::{Drawing, Profile, union};
use crate::error::Result;
use crate::film::Film;
use crate::output::{Sink, Target};
use crate::style::Style;
use crate::text::Fonts;
use crate::time::offset;

struct Graphs<'a> {
    film: &'a Film<'a>,
    target: Target,
    drawing: Drawing<'a>,
}

/// Begins a file per window; without `{n}` one file with the single window or the union of all.
pub(super) fn start<'a>(film: &'a Film<'a>, target: &Target) -> Result<Box<dyn Encoder + 'a>> {
    let drawing = Drawing::new(film.evolution, film.view, Style::builtin("light")?);
    let drawing = match film.options.dot_profile {
        Profile::Rqt => drawing.laid_out(&Fonts::bundled()),
        Profile::Plain => drawing,
    };
    Ok(Box::new(Graphs {
        film,
        target: target.clone(),
        drawing,
    }))
}

impl Encoder for Graphs<'_> {
    fn finish(self: Box<Self>) -> Result<Written> {
        let mut written = Written::to(&self.target);
        let frames = &self.film.view.frames;
        let mut write = |target: &Target, text: &str| -> Result<()> {
            let mut sink = Sink::create(target, None)?;
            sink.write_all(text.as_bytes()).map_err(sink.error())?;
            written.add(sink.commit()?);
            Ok(())
        };
        if self.target.is_numbered() {
            for frame in frames {
                let target = self.target.numbered(frame.index, frames.len());
                write(
                    &target,
                    &self.drawing.write(frame, &self.title(Some(frame.index))),
                )?;
            }
        } else if let [frame] = &frames[..] {
            write(&self.target, &self.drawing.write(frame, &self.title(None)))?;
        } else if let Some(frame) = union(self.film.view) {
            write(&self.target, &self.drawing.write(&frame, &self.title(None)))?;
        }
        Ok(written)
    }
}

impl Graphs<'_> {
    /// The bags' names, and the window with its time.
    fn title(&self, window: Option<usize>) -> String {
        let evolution = self.film.evolution;
        let names: Vec<&str> = evolution.bags.iter().map(|b| b.name.as_str()).collect();
        let name = match &names[..] {
            [first, _, ..] => format!("{first} and {} more", names.len() - 1),
            _ => names.concat(),
        };
        let frames = &self.film.view.frames;
        let Some(frame) = window.and_then(|at| frames.iter().find(|f| f.index == at)) else {
            return name;
        };
        let time = |at| offset(evolution.offset(at));
        let (from, to) = (time(frame.span.start), time(frame.span.end));
        format!(
            "{name}: window {} of {}, {from} to {to}",
            frame.index + 1,
            frames.len()
        )
    }
}
