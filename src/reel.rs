//! Runs a film once through all its outputs: each frame is drawn once, by all cores, and given to everyone in order.

mod artists;
mod shrink;

use std::io;
use std::ops::ControlFlow;

use rayon::prelude::*;

use self::artists::{Artists, Drawn};
use crate::encode::{Encoder, Frame, Needs, Output, Written};
use crate::error::{Error, Result};
use crate::film::{Film, Shot};
use crate::output;
use crate::palette::Palette;

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
    film: &Film<'_>,
    outputs: &[Output],
    progress: &mut Progress<'_>,
) -> Result<Vec<Written>> {
    for output in outputs {
        output::make_folder(&output.target)?;
    }
    let outcomes = pass(film, outputs, progress)?;
    let each = outputs.iter().zip(outcomes);
    each.map(|(output, outcome)| match outcome {
        Some(written) => Ok(written),
        None => shrink::fit(film, output, progress),
    })
    .collect()
}

/// One run of the film. `None` stands for an output that would exceed `max_bytes`.
fn pass(
    film: &Film<'_>,
    outputs: &[Output],
    progress: &mut Progress<'_>,
) -> Result<Vec<Option<Written>>> {
    let start = |output| Work::start(film, output);
    let mut works: Vec<Work<'_>> = outputs.iter().map(start).collect::<Result<_>>()?;
    let needs = works.iter().map(Work::needs).max();
    if needs > Some(Needs::Nothing) {
        play(film, &mut works, progress)?;
    }
    works.into_iter().map(Work::finish).collect()
}

/// An output in the making.
struct Work<'a> {
    output: &'a Output,
    encoder: Option<Box<dyn Encoder + 'a>>,
    /// Why it ended early.
    ended: Option<Error>,
}

impl<'a> Work<'a> {
    fn start(film: &'a Film<'a>, output: &'a Output) -> Result<Self> {
        Ok(Self {
            output,
            encoder: Some((output.format.start)(film, &output.target)?),
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
    fn take(&mut self, frames: &[Drawn], palette: &Palette, film: &Film<'_>) {
        let Some(encoder) = &mut self.encoder else {
            return;
        };
        if encoder.needs() == Needs::Nothing {
            return;
        }
        let wanted = frames
            .iter()
            .filter(|f| f.shot.is_settled() || encoder.plays());
        let wanted: Vec<_> = wanted.collect();
        let result = wanted.iter().try_for_each(|drawn| {
            encoder.frame(&Frame {
                index: film
                    .view
                    .frames
                    .get(drawn.shot.window)
                    .map_or(0, |f| f.index),
                shot: drawn.shot,
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
fn play(film: &Film<'_>, works: &mut [Work<'_>], progress: &mut Progress<'_>) -> Result<()> {
    let mut shots = film.shots();
    if !works.iter().any(Work::plays) {
        shots.retain(Shot::is_settled);
    }
    let needs = works
        .iter()
        .map(Work::needs)
        .max()
        .unwrap_or(Needs::Nothing);
    let mut artists = Artists::new(film, needs, &shots)?;
    let palette = artists.palette();
    let (mut done, mut ready) = (0, Vec::new());
    // The empty batch at the end lets the last one be taken.
    for batch in shots.chunks(artists.batch(&shots)).chain([&[][..]]) {
        let take = || {
            works
                .par_iter_mut()
                .for_each(|w| w.take(&ready, &palette, film));
        };
        let (next, ()) = rayon::join(|| artists.draw(batch), take);
        works.iter_mut().try_for_each(Work::failure)?;
        done += ready.len();
        if progress(done, shots.len()).is_break() {
            return Err(Error::Interrupted);
        }
        if works.iter().all(|w| w.encoder.is_none()) {
            break;
        }
        ready = next?;
    }
    Ok(())
}
