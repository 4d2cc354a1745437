//! Those who draw: a canvas per core, and one palette from a few frames, which are kept so that none is drawn twice.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use crate::encode::Needs;
use crate::error::Result;
use crate::film::{Film, Shot, is_changed};
use crate::palette::{Census, Packed, Palette};
use crate::pixels::{Canvas, Pixels};
use crate::scene::Scene;

/// At most this many bytes of frames are held at a time.
const MOST_BYTES: f64 = 256e6;
/// At most this many frames per core are drawn in a row before the encoders get them.
const MOST_IN_A_ROW: usize = 8;
/// How many frames a palette is made from, at most: some of those with a change, some of all.
const SAMPLES: usize = 24;

/// A frame, drawn.
pub(super) struct Drawn {
    pub(super) shot: Shot,
    pub(super) scene: Scene,
    /// Empty unless they are needed.
    pub(super) pixels: Pixels,
    /// Empty unless they are needed.
    pub(super) indices: Vec<u8>,
}

pub(super) struct Artists<'a> {
    film: &'a Film<'a>,
    needs: Needs,
    palette: Arc<Palette>,
    canvases: Vec<Canvas<'a>>,
    /// The frames that the palette was made from, by window and phase.
    kept: BTreeMap<(usize, u64), (u32, u32, Packed)>,
}

impl<'a> Artists<'a> {
    /// Ready to draw these frames.
    pub(super) fn new(film: &'a Film<'a>, needs: Needs, shots: &[Shot]) -> Result<Self> {
        let canvas = |_| Canvas::new(film.painter, film.options.scale);
        let mut artists = Self {
            film,
            needs,
            palette: Arc::new(Palette::new(Vec::new())),
            canvases: (0..rayon::current_num_threads()).map(canvas).collect(),
            kept: BTreeMap::new(),
        };
        if needs >= Needs::Indices {
            artists.survey(shots)?;
        }
        Ok(artists)
    }

    /// The palette of the whole film; one black unless indices are needed.
    pub(super) fn palette(&self) -> Arc<Palette> {
        Arc::clone(&self.palette)
    }

    /// How many frames to draw at a time.
    pub(super) fn batch(&self, shots: &[Shot]) -> usize {
        let scene = |s: &Shot| self.film.picture.scene(s.window, s.phase);
        let page = shots.first().map(|s| scene(s).size).unwrap_or_default();
        let scale = self.film.options.scale;
        // Five bytes a pixel; one batch is drawn while the one before is written.
        let bytes = (page.w * scale * page.h * scale * 10.0).max(1.0);
        let cores = self.canvases.len();
        let fits = |each: &usize| (cores * each) as f64 * bytes <= MOST_BYTES;
        cores * (1..=MOST_IN_A_ROW).rev().find(fits).unwrap_or(1)
    }

    /// Draws frames that follow each other.
    pub(super) fn draw(&mut self, shots: &[Shot]) -> Result<Vec<Drawn>> {
        let (film, needs) = (self.film, self.needs);
        let (palette, kept) = (&self.palette, &self.kept);
        share(&mut self.canvases, shots, |canvas, shot| {
            let scene = film.picture.scene(shot.window, shot.phase);
            let pixels = match kept.get(&key(shot)) {
                _ if needs < Needs::Pixels => nothing(),
                Some((width, height, packed)) => Pixels {
                    width: *width,
                    height: *height,
                    rgba: packed.rgba(),
                },
                None => canvas.draw(&scene)?,
            };
            let indices = match needs {
                Needs::Indices => palette.map(&pixels.rgba),
                _ => Vec::new(),
            };
            Ok(Drawn {
                shot,
                scene,
                pixels,
                indices,
            })
        })
    }

    /// Makes the palette from a few frames and keeps them.
    fn survey(&mut self, shots: &[Shot]) -> Result<()> {
        let changed: Vec<usize> = (0..shots.len())
            .filter(|i| is_changed(self.film.view, shots[*i].window))
            .collect();
        let all: Vec<usize> = (0..shots.len()).collect();
        let mut places = spread(&changed, SAMPLES / 2);
        places.extend(spread(&all, SAMPLES / 2));
        places.sort_unstable();
        places.dedup();
        let sample: Vec<Shot> = places.into_iter().map(|i| shots[i]).collect();
        let film = self.film;
        let drawn = share(&mut self.canvases, &sample, |canvas, shot| {
            let pixels = canvas.draw(&film.picture.scene(shot.window, shot.phase))?;
            let packed = Packed::new(&pixels.rgba);
            Ok((key(shot), (pixels.width, pixels.height, packed)))
        })?;
        self.kept = drawn.into_iter().collect();
        let mut census = Census::default();
        for (_, _, packed) in self.kept.values() {
            census.count(packed);
        }
        self.palette = Arc::new(census.palette(255));
        Ok(())
    }
}

/// Draws with all canvases at once, each taking frames that follow each other; gives what came of them in order.
fn share<'a, T: Send>(
    canvases: &mut [Canvas<'a>],
    shots: &[Shot],
    draw: impl Fn(&mut Canvas<'a>, Shot) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let in_a_row = shots.len().div_ceil(canvases.len().max(1)).max(1);
    let rows: Vec<Vec<T>> = shots
        .par_chunks(in_a_row)
        .zip(canvases)
        .map(|(row, canvas)| row.iter().map(|shot| draw(canvas, *shot)).collect())
        .collect::<Result<_>>()?;
    Ok(rows.into_iter().flatten().collect())
}

fn key(shot: Shot) -> (usize, u64) {
    (shot.window, shot.phase.to_bits())
}

fn nothing() -> Pixels {
    Pixels {
        width: 0,
        height: 0,
        rgba: Vec::new(),
    }
}

/// At most `most` of `all`, evenly spread, the first and the last among them.
fn spread(all: &[usize], most: usize) -> Vec<usize> {
    let count = all.len().min(most);
    let last = all.len().saturating_sub(1);
    (0..count)
        .map(|i| all[i * last / (count - 1).max(1)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_holds_both_ends() {
        let all: Vec<usize> = (0..100).collect();
        assert_eq!(spread(&all, 4), [0, 33, 66, 99]);
        assert_eq!(spread(&all[..3], 4), [0, 1, 2]);
        assert_eq!(spread(&[], 4), Vec::<usize>::new());
    }
}
