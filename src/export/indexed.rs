//! Animations of indexed colours, in which only the pixels that change are stored.

use std::io::{self, Write};

use super::encoder::{Encoder, Needs, Pack, Packet, Started, Written};
use crate::base::error::{Error, Result};
use crate::export::palette::Palette;
use crate::export::sequence::{FrameTime, Sequence};
use crate::export::sink::OutputSink;
use crate::export::target::Target;

/// An animation in progress.
pub(super) trait IndexedAnimation<W: Write>: Sized {
    /// The function that encodes its frames.
    const PACK: Pack;

    /// Refuses sizes in pixels that the format cannot represent.
    fn check(_size: (u32, u32), _target: &Target) -> Result<()> {
        Ok(())
    }

    /// Begins an endless loop of `frames` frames; the palette has at most 255 colours.
    fn new(out: W, size: (u32, u32), palette: &Palette, frames: usize) -> io::Result<Self>;

    /// Shows a frame for `ms` milliseconds.
    fn add(&mut self, packet: Packet, ms: u32) -> io::Result<()>;

    /// Ends the file.
    fn finish(self) -> io::Result<W>;
}

/// The file of an animation.
struct AnimationFile<A> {
    target: Target,
    frames: usize,
    /// The file, until the first frame.
    sink: Option<OutputSink>,
    animation: Option<A>,
}

/// Begins the file of an animation.
///
/// # Errors
/// [`Error::Usage`] for a name with `{n}`.
pub(super) fn start<'a, A: IndexedAnimation<OutputSink> + Send + 'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Started<'a> {
    target.must_be_one("an animation contains all windows")?;
    Ok(Box::new(AnimationFile::<A> {
        target: target.clone(),
        frames: sequence.frame_times().len(),
        sink: Some(OutputSink::create(target, sequence.options.max_bytes)?),
        animation: None,
    }))
}

impl<A> AnimationFile<A> {
    fn error(&self) -> impl FnOnce(io::Error) -> Error + use<A> {
        Error::io("write", self.target.path())
    }
}

impl<A: IndexedAnimation<OutputSink> + Send> Encoder for AnimationFile<A> {
    fn needs(&self) -> Needs {
        Needs::Indices
    }

    fn plays(&self) -> bool {
        true
    }

    fn pack(&self) -> Pack {
        A::PACK
    }

    fn begin(&mut self, size: (u32, u32), palette: &Palette) -> Result<()> {
        if let Some(sink) = self.sink.take() {
            A::check(size, &self.target)?;
            let animation = A::new(sink, size, palette, self.frames);
            self.animation = Some(animation.map_err(self.error())?);
        }
        Ok(())
    }

    fn take(&mut self, _: usize, frame_time: FrameTime, packet: Packet) -> Result<()> {
        let failed = self.error();
        match &mut self.animation {
            Some(animation) => animation.add(packet, frame_time.ms).map_err(failed),
            None => Ok(()),
        }
    }

    fn finish(mut self: Box<Self>) -> Result<Written> {
        let failed = self.error();
        let mut written = Written::to(&self.target);
        if let Some(animation) = self.animation.take() {
            written.add(animation.finish().map_err(failed)?.commit()?);
        }
        Ok(written)
    }
}
