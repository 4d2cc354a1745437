//! Runs a film once through all its outputs: each frame is drawn once, by all cores, and given to everyone in order.

mod shrink;

use std::io;
use std::ops::ControlFlow;

use rayon::prelude::*;

use crate::encode::{Encoder, Frame, Needs, Output, Written};
use crate::error::{Error, Result};
use crate::film::{Film, Shot};
use crate::output;
use crate::palette::{Census, Palette};
use crate::pixels::{Canvas, Pixels};
use crate::scene::Scene;

/// Told after every batch of frames: how many are done, of how many. May break off the run.
pub type Progress<'a> = dyn FnMut(usize, usize) -> ControlFlow<()> + 'a;

/// At most this many bytes of frames are held at a time.
const MOST_BYTES: usize = 256 << 20;
/// At most this many frames per core are drawn in a row before the encoders get them.
const MOST_IN_A_ROW: usize = 8;
/// How many frames a palette is made from, at most.
const SAMPLES: usize = 24;

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

/// A frame, drawn.
struct Drawn {
    shot: Shot,
    scene: Scene,
    pixels: Pixels,
    indices: Vec<u8>,
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
    let palette = match needs {
        Needs::Indices => survey(film, &shots)?,
        _ => Palette::new(Vec::new()),
    };
    let mut artists = Artists::new(film, needs, &palette);
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

/// A canvas per core, each drawing frames that follow each other.
struct Artists<'a> {
    film: &'a Film<'a>,
    needs: Needs,
    palette: &'a Palette,
    canvases: Vec<Canvas<'a>>,
}

impl<'a> Artists<'a> {
    fn new(film: &'a Film<'a>, needs: Needs, palette: &'a Palette) -> Self {
        let canvas = |_| Canvas::new(film.painter, film.options.scale);
        let canvases = (0..rayon::current_num_threads()).map(canvas).collect();
        Self {
            film,
            needs,
            palette,
            canvases,
        }
    }

    /// How many frames to draw at a time.
    fn batch(&self, shots: &[Shot]) -> usize {
        let page = shots
            .first()
            .map(|s| self.film.picture.scene(s.window, s.phase).size);
        let side = |length: f64| length * self.film.options.scale;
        // Five bytes a pixel; one batch is drawn while the one before is written.
        let bytes = page.map_or(0.0, |p| side(p.w) * side(p.h) * 10.0).max(1.0);
        let cores = self.canvases.len();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "1 to 256 million"
        )]
        let fit = (MOST_BYTES as f64 / bytes) as usize;
        cores * (fit / cores).clamp(1, MOST_IN_A_ROW)
    }

    fn draw(&mut self, shots: &[Shot]) -> Result<Vec<Drawn>> {
        let in_a_row = shots.len().div_ceil(self.canvases.len()).max(1);
        let (film, needs, palette) = (self.film, self.needs, self.palette);
        let rows: Vec<Vec<Drawn>> = shots
            .par_chunks(in_a_row)
            .zip(&mut self.canvases)
            .map(|(shots, canvas)| {
                let draw = |shot: &Shot| draw(film, needs, palette, canvas, *shot);
                shots.iter().map(draw).collect()
            })
            .collect::<Result<_>>()?;
        Ok(rows.into_iter().flatten().collect())
    }
}

fn draw(
    film: &Film<'_>,
    needs: Needs,
    palette: &Palette,
    canvas: &mut Canvas<'_>,
    shot: Shot,
) -> Result<Drawn> {
    let scene = film.picture.scene(shot.window, shot.phase);
    let mut drawn = Drawn {
        shot,
        pixels: Pixels {
            width: 0,
            height: 0,
            rgba: Vec::new(),
        },
        indices: Vec::new(),
        scene,
    };
    if needs >= Needs::Pixels {
        drawn.pixels = canvas.draw(&drawn.scene)?;
    }
    if needs >= Needs::Indices {
        drawn.indices = palette.map(&drawn.pixels.rgba);
    }
    Ok(drawn)
}

/// One palette from a few frames: some of those in which something changes, some of all.
fn survey(film: &Film<'_>, shots: &[Shot]) -> Result<Palette> {
    let changed = |s: &&Shot| crate::film::is_changed(film.view, s.window);
    let mut sample = spread(
        &shots.iter().filter(changed).collect::<Vec<_>>(),
        SAMPLES / 2,
    );
    sample.extend(spread(&shots.iter().collect::<Vec<_>>(), SAMPLES / 2));
    let scenes = sample
        .par_iter()
        .map(|s| film.picture.scene(s.window, s.phase));
    let census = scenes.map(|scene| {
        let mut census = Census::default();
        census.count(&film.painter.paint(&scene, film.options.scale)?.rgba);
        Ok(census)
    });
    let empty = || Ok(Census::default());
    let census = census.reduce(empty, |a, b| Ok(a?.and(b?)))?;
    Ok(census.palette(255))
}

/// At most `most` of `all`, evenly spread, the first and the last among them.
fn spread<'a>(all: &[&'a Shot], most: usize) -> Vec<&'a Shot> {
    let count = all.len().min(most);
    let last = all.len().saturating_sub(1);
    (0..count)
        .map(|i| all[i * last / (count - 1).max(1)])
        .collect()
}
