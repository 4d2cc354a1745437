//! Drawings as SVG text: one per window, or the strip.

use super::{Encoder, Needs, Pack, Packet, Single, Started, Written, single};
use crate::base::error::Result;
use crate::draw::paint::svg;
use crate::draw::scene::Scene;
use crate::export::sequence::{FrameTime, Sequence};
use crate::export::sink::write_file;
use crate::export::target::Target;

struct SvgEncoder<'a> {
    /// The one drawing to write, if it is not a sequence.
    strip: Option<&'a Scene>,
    target: Target,
    windows: usize,
    written: Written,
}

/// Begins the files, one per window; without `{n}` the single window or the strip.
///
/// # Errors
/// [`Error::Usage`](crate::base::error::Error::Usage) for several windows without `{n}`.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let strip = match single(sequence, target, sequence.options.is_one_drawing())? {
        Single::Windows => None,
        Single::Strip(scene) => Some(scene),
    };
    Ok(Box::new(SvgEncoder {
        strip,
        target: target.clone(),
        windows: sequence.view.frames.len(),
        written: Written::to(target),
    }))
}

impl Encoder for SvgEncoder<'_> {
    fn needs(&self) -> Needs {
        match self.strip {
            Some(_) => Needs::Nothing,
            None => Needs::Scene,
        }
    }

    fn pack(&self) -> Pack {
        |frame| Ok(Packet::Bytes(svg::write(frame.scene).into_bytes()))
    }

    fn take(&mut self, index: usize, _: FrameTime, packet: Packet) -> Result<()> {
        let Packet::Bytes(bytes) = packet else {
            return Ok(());
        };
        let target = self.target.numbered(index, self.windows);
        self.written.add(write_file(&target, &bytes)?);
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<Written> {
        if let Some(scene) = self.strip {
            let text = svg::write(scene);
            self.written.add(write_file(&self.target, text.as_bytes())?);
        }
        Ok(self.written)
    }
}
