//! Drawings as SVG text: one per window, or the strip.

use std::io::Write as _;

use super::{Encoder, Frame, Needs, Single, Written, single};
use crate::base::error::Result;
use crate::draw::paint::svg;
use crate::draw::scene::Scene;
use crate::export::sequence::Sequence;
use crate::export::sink::Sink;
use crate::export::target::Target;

struct Drawings<'a> {
    /// The one drawing to write, if it is no sequence.
    strip: Option<&'a Scene>,
    target: Target,
    windows: usize,
    written: Written,
}

/// Begins a file per window; without `{n}` the single window or the strip.
///
/// # Errors
/// [`Error::Usage`](crate::base::error::Error::Usage) for several windows without `{n}`.
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    let strip = match single(sequence, target, sequence.options.is_one_drawing())? {
        Single::Windows => None,
        Single::Strip(scene) => Some(scene),
    };
    Ok(Box::new(Drawings {
        strip,
        target: target.clone(),
        windows: sequence.view.frames.len(),
        written: Written::to(target),
    }))
}

impl Encoder for Drawings<'_> {
    fn needs(&self) -> Needs {
        match self.strip {
            Some(_) => Needs::Nothing,
            None => Needs::Scene,
        }
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<()> {
        let target = self.target.numbered(frame.index, self.windows);
        self.written.add(write(frame.scene, &target)?);
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<Written> {
        if let Some(scene) = self.strip {
            self.written.add(write(scene, &self.target)?);
        }
        Ok(self.written)
    }
}

fn write(scene: &Scene, target: &Target) -> Result<u64> {
    let mut sink = Sink::create(target, None)?;
    let text = svg::write(scene);
    sink.write_all(text.as_bytes()).map_err(sink.error())?;
    sink.commit()
}
