//! Runs a sequence once through all its outputs: each frame is drawn once, by all cores, and passed to every output in
//! order.

mod raster_pool;
mod size_limit;

use std::io;
use std::ops::ControlFlow;

use rayon::prelude::*;

use self::raster_pool::{FrameWant, Packed, RasterPool};
use crate::base::error::{Error, Result};
use crate::export::check::make_folder;
use crate::export::palette::Palette;
use crate::export::sequence::{FrameTime, Sequence};
use crate::export::{Encoder, Needs, Output, Packet, Written};

/// A function called after every batch of frames with the number of frames done and their total. It may cancel the run.
pub type Progress<'a> = dyn FnMut(usize, usize) -> ControlFlow<()> + 'a;

/// Writes every output, in the order given, and returns the files written. Each file appears when it is complete.
///
/// A closed pipe ends that output and is not an error.
///
/// # Errors
/// [`Error::Interrupted`] if `progress` cancels, otherwise the error of the first failing output; unfinished outputs
/// leave no files.
pub fn run(
    sequence: &Sequence<'_>,
    outputs: &[Output],
    progress: &mut Progress<'_>,
) -> Result<Vec<Written>> {
    for output in outputs {
        make_folder(&output.target)?;
    }
    let outcomes = pass(sequence, outputs, progress)?;
    let each = outputs.iter().zip(outcomes);
    each.map(|(output, outcome)| match outcome {
        Some(written) => Ok(written),
        None => size_limit::fit(sequence, output, progress),
    })
    .collect()
}

/// One run of the sequence; `None` for an output that would exceed `max_bytes`. No file appears before all are drawn.
pub(crate) fn pass(
    sequence: &Sequence<'_>,
    outputs: &[Output],
    progress: &mut Progress<'_>,
) -> Result<Vec<Option<Written>>> {
    let start = |output| OutputJob::start(sequence, output);
    let mut jobs: Vec<OutputJob<'_>> = outputs.iter().map(start).collect::<Result<_>>()?;
    // Films leave windows out that files have, and are the same whatever else is written.
    for is_film in [true, false] {
        let some = jobs.iter_mut();
        let some = some.filter(|job| job.output.format.is_film() == is_film);
        let mut some: Vec<&mut OutputJob<'_>> = some.collect();
        if some.iter().any(|job| job.needs() > Needs::Nothing) {
            play(sequence, &mut some, is_film, progress)?;
        }
    }
    jobs.into_iter().map(OutputJob::finish).collect()
}

/// An output being written.
struct OutputJob<'a> {
    output: &'a Output,
    encoder: Option<Box<dyn Encoder + 'a>>,
    has_begun: bool,
    /// The error that ended it early.
    ended: Option<Error>,
}

impl<'a> OutputJob<'a> {
    fn start(sequence: &'a Sequence<'a>, output: &'a Output) -> Result<Self> {
        Ok(Self {
            output,
            encoder: Some((output.format.start)(sequence, &output.target)?),
            has_begun: false,
            ended: None,
        })
    }

    fn needs(&self) -> Needs {
        let needs = self.encoder.as_ref().map(|e| e.needs());
        needs.unwrap_or(Needs::Nothing)
    }

    /// The data that it needs for every frame; none once it has ended.
    fn want(&self) -> FrameWant {
        let encoder = self.encoder.as_ref();
        FrameWant {
            needs: self.needs(),
            pack: encoder.map_or(|_| Ok(Packet::Nothing), |e| e.pack()),
        }
    }

    /// Takes packets, unless it has ended.
    fn take(&mut self, size: (u32, u32), palette: &Palette, packets: Vec<Waiting>) {
        let Some(mut encoder) = self.encoder.take() else {
            return;
        };
        let needs = encoder.needs();
        let take = || -> Result<()> {
            if needs > Needs::Nothing && !self.has_begun {
                encoder.begin(size, palette)?;
                self.has_begun = true;
            }
            for Waiting(index, frame_time, packet) in packets {
                if needs > Needs::Nothing {
                    encoder.take(index, frame_time, packet)?;
                }
            }
            Ok(())
        };
        match take() {
            Ok(()) => self.encoder = Some(encoder),
            Err(error) => self.ended = Some(error),
        }
    }

    /// The error that must end the whole run, if any.
    fn failure(&mut self) -> Result<()> {
        match self.ended.take() {
            Some(error) if !self.is_harmless(&error) => Err(error),
            other => {
                self.ended = other;
                Ok(())
            }
        }
    }

    /// Whether only this output ends: its reader closed the pipe, or it is too large and will be retried.
    fn is_harmless(&self, error: &Error) -> bool {
        kind(error) == Some(io::ErrorKind::BrokenPipe) || self.is_too_large(error)
    }

    fn is_too_large(&self, error: &Error) -> bool {
        self.output.format.takes("max-bytes", false)
            && kind(error) == Some(io::ErrorKind::FileTooLarge)
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

/// The number of frames that are drawn at a time.
pub(crate) fn cores() -> usize {
    rayon::current_num_threads()
}

/// A packet with the index of its window and the time of its frame.
struct Waiting(usize, FrameTime, Packet);

/// Draws all frames, of films or of files, and passes them on in order while the next ones are drawn.
fn play(
    sequence: &Sequence<'_>,
    jobs: &mut [&mut OutputJob<'_>],
    is_film: bool,
    progress: &mut Progress<'_>,
) -> Result<()> {
    let frame_times = sequence.frame_times(is_film);
    let wants: Vec<FrameWant> = jobs.iter().map(|job| job.want()).collect();
    let pool = RasterPool::new(sequence, &frame_times, &wants)?;
    let mut done = 0;
    pool.run(|row| {
        done += row.len();
        let size = row.first().map_or((0, 0), |packed| packed.size);
        let queues = by_output(sequence, row, jobs.len());
        let each = jobs.par_iter_mut().zip(queues);
        each.for_each(|(job, packets)| job.take(size, pool.palette(), packets));
        jobs.iter_mut().try_for_each(|job| job.failure())?;
        if progress(done, frame_times.len()).is_break() {
            return Err(Error::Interrupted);
        }
        Ok(if jobs.iter().all(|job| job.encoder.is_none()) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        })
    })
}

/// The packets of each output.
fn by_output(sequence: &Sequence<'_>, row: Vec<Packed>, outputs: usize) -> Vec<Vec<Waiting>> {
    let mut queues: Vec<Vec<Waiting>> = (0..outputs).map(|_| Vec::new()).collect();
    for packed in row {
        let window = sequence.view.frames.get(packed.frame_time.window);
        let index = window.map_or(0, |frame| frame.index);
        for (queue, packet) in queues.iter_mut().zip(packed.packets) {
            queue.push(Waiting(index, packed.frame_time, packet));
        }
    }
    queues
}
