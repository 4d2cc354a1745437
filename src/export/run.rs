//! Runs a sequence once through all its outputs: each frame is drawn once, by all cores, and given to everyone in order.

mod raster_pool;
mod size_limit;

use std::io;
use std::ops::ControlFlow;

use rayon::prelude::*;

use self::raster_pool::{Drawn, RasterPool};
use crate::base::error::{Error, Result};
use crate::export::check;
use crate::export::palette::Palette;
use crate::export::sequence::{FrameTime, Sequence};
use crate::export::{Encoder, Frame, Needs, Output, Written};

/// Told after every batch of frames: how many are done, of how many. May break off the run.
pub type Progress<'a> = dyn FnMut(usize, usize) -> ControlFlow<()> + 'a;

/// Writes every output, in the order given, and tells what was written. Each file appears when it is whole.
///
/// A closed pipe ends that output and is no error.
///
/// # Errors
/// [`Error::Interrupted`] where `progress` breaks off, otherwise what the first failing output says; outputs that
/// were not finished leave no trace then.
pub fn run(
    sequence: &Sequence<'_>,
    outputs: &[Output],
    progress: &mut Progress<'_>,
) -> Result<Vec<Written>> {
    for output in outputs {
        check::make_folder(&output.target)?;
    }
    let outcomes = pass(sequence, outputs, progress)?;
    let each = outputs.iter().zip(outcomes);
    each.map(|(output, outcome)| match outcome {
        Some(written) => Ok(written),
        None => size_limit::fit(sequence, output, progress),
    })
    .collect()
}

/// One run of the sequence. `None` stands for an output that would exceed `max_bytes`.
pub(crate) fn pass(
    sequence: &Sequence<'_>,
    outputs: &[Output],
    progress: &mut Progress<'_>,
) -> Result<Vec<Option<Written>>> {
    let start = |output| OutputJob::start(sequence, output);
    let mut jobs: Vec<OutputJob<'_>> = outputs.iter().map(start).collect::<Result<_>>()?;
    let needs = jobs.iter().map(OutputJob::needs).max();
    if needs > Some(Needs::Nothing) {
        play(sequence, &mut jobs, progress)?;
    }
    jobs.into_iter().map(OutputJob::finish).collect()
}

/// An output in the making.
struct OutputJob<'a> {
    output: &'a Output,
    encoder: Option<Box<dyn Encoder + 'a>>,
    /// Why it ended early.
    ended: Option<Error>,
}

impl<'a> OutputJob<'a> {
    fn start(sequence: &'a Sequence<'a>, output: &'a Output) -> Result<Self> {
        Ok(Self {
            output,
            encoder: Some((output.format.start)(sequence, &output.target)?),
            ended: None,
        })
    }

    fn needs(&self) -> Needs {
        let needs = self.encoder.as_ref().map(|e| e.needs());
        needs.unwrap_or(Needs::Nothing)
    }

    fn plays(&self) -> bool {
        self.encoder.as_ref().is_some_and(|e| e.plays())
    }

    /// Takes frames, unless it has ended.
    fn take(&mut self, frames: &[Drawn], palette: &Palette, sequence: &Sequence<'_>) {
        let Some(encoder) = &mut self.encoder else {
            return;
        };
        if encoder.needs() == Needs::Nothing {
            return;
        }
        let wanted = frames
            .iter()
            .filter(|f| f.frame_time.is_settled() || encoder.plays());
        let wanted: Vec<_> = wanted.collect();
        let result = wanted.iter().try_for_each(|drawn| {
            encoder.frame(&Frame {
                index: sequence
                    .view
                    .frames
                    .get(drawn.frame_time.window)
                    .map_or(0, |f| f.index),
                time: drawn.frame_time,
                scene: &drawn.scene,
                pixels: &drawn.pixels,
                palette,
                indices: &drawn.indices,
            })
        });
        if let Err(error) = result {
            self.encoder = None;
            self.ended = Some(error);
        }
    }

    /// The error that has to end the whole run, if there is one.
    fn failure(&mut self) -> Result<()> {
        match self.ended.take() {
            Some(error) if !self.is_harmless(&error) => Err(error),
            other => {
                self.ended = other;
                Ok(())
            }
        }
    }

    /// Whether only this output ends: its reader has left, or it grew too large and is tried again.
    fn is_harmless(&self, error: &Error) -> bool {
        kind(error) == Some(io::ErrorKind::BrokenPipe) || self.is_too_large(error)
    }

    fn is_too_large(&self, error: &Error) -> bool {
        self.output.format.is_limited && kind(error) == Some(io::ErrorKind::FileTooLarge)
    }

    fn finish(mut self) -> Result<Option<Written>> {
        let result = match (self.encoder.take(), self.ended.take()) {
            (Some(encoder), _) => encoder.finish(),
            (None, Some(error)) => Err(error),
            (None, None) => Ok(Written::default()),
        };
        match result {
            Ok(written) => Ok(Some(written)),
            Err(error) if self.is_too_large(&error) => Ok(None),
            Err(error) if self.is_harmless(&error) => Ok(Some(Written {
                path: self.output.target.path().to_owned(),
                ..Written::default()
            })),
            Err(error) => Err(error),
        }
    }
}

fn kind(error: &Error) -> Option<io::ErrorKind> {
    match error {
        Error::Io { source, .. } => Some(source.kind()),
        _ => None,
    }
}

/// Draws all frames and hands them out: while the encoders take one batch, the next is drawn.
fn play(
    sequence: &Sequence<'_>,
    jobs: &mut [OutputJob<'_>],
    progress: &mut Progress<'_>,
) -> Result<()> {
    let mut frame_times = sequence.frame_times();
    if !jobs.iter().any(OutputJob::plays) {
        frame_times.retain(FrameTime::is_settled);
    }
    let needs = jobs
        .iter()
        .map(OutputJob::needs)
        .max()
        .unwrap_or(Needs::Nothing);
    let mut artists = RasterPool::new(sequence, needs, &frame_times)?;
    let palette = artists.palette();
    let (mut done, mut ready) = (0, Vec::new());
    // The empty batch at the end lets the last one be taken.
    for batch in frame_times
        .chunks(artists.batch(&frame_times))
        .chain([&[][..]])
    {
        let take = || {
            jobs.par_iter_mut()
                .for_each(|w| w.take(&ready, &palette, sequence));
        };
        let (next, ()) = rayon::join(|| artists.draw(batch), take);
        jobs.iter_mut().try_for_each(OutputJob::failure)?;
        done += ready.len();
        if progress(done, frame_times.len()).is_break() {
            return Err(Error::Interrupted);
        }
        if jobs.iter().all(|w| w.encoder.is_none()) {
            break;
        }
        ready = next?;
    }
    Ok(())
}
