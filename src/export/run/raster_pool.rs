//! Those who draw: a canvas per core, and one palette from a few frames, which are kept so that none is drawn twice.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use crate::base::error::Result;
use crate::draw::paint::raster::{Canvas, Pixels};
use crate::draw::scene::Scene;
use crate::export::Needs;
use crate::export::palette::{Census, Packed, Palette};
use crate::export::sequence::{FrameTime, Sequence};

/// At most this many bytes of frames are held at a time.
const MOST_BYTES: f64 = 256e6;
/// At most this many frames per core are drawn in a row before the encoders get them.
const MOST_IN_A_ROW: usize = 8;
/// How many frames a palette is made from, at most: some of those with a change, some of all.
const SAMPLES: usize = 24;

/// A frame, drawn.
pub(crate) struct Drawn {
    pub(crate) frame_time: FrameTime,
    pub(crate) scene: Scene,
    /// Empty unless they are needed.
    pub(crate) pixels: Pixels,
    /// Empty unless they are needed.
    pub(crate) indices: Vec<u8>,
}

pub(crate) struct RasterPool<'a> {
    sequence: &'a Sequence<'a>,
    needs: Needs,
    palette: Arc<Palette>,
    canvases: Vec<Canvas<'a>>,
    /// The frames that the palette was made from, by window and phase.
    kept: BTreeMap<(usize, u64), (u32, u32, Packed)>,
}

impl<'a> RasterPool<'a> {
    /// Ready to draw these frames.
    pub(crate) fn new(
        sequence: &'a Sequence<'a>,
        needs: Needs,
        frame_times: &[FrameTime],
    ) -> Result<Self> {
        let canvas = |_| Canvas::new(sequence.painter, sequence.options.scale);
        let mut artists = Self {
            sequence,
            needs,
            palette: Arc::new(Palette::new(Vec::new())),
            canvases: (0..rayon::current_num_threads()).map(canvas).collect(),
            kept: BTreeMap::new(),
        };
        if needs >= Needs::Indices {
            artists.survey(frame_times)?;
        }
        Ok(artists)
    }

    /// The palette of the whole sequence; one black unless indices are needed.
    pub(crate) fn palette(&self) -> Arc<Palette> {
        Arc::clone(&self.palette)
    }

    /// How many frames to draw at a time.
    pub(crate) fn batch(&self, frame_times: &[FrameTime]) -> usize {
        let scene = |s: &FrameTime| self.sequence.picture.scene(s.window, s.phase);
        let page = frame_times
            .first()
            .map(|s| scene(s).size)
            .unwrap_or_default();
        let scale = self.sequence.options.scale;
        // Five bytes a pixel; one batch is drawn while the one before is written.
        let bytes = (page.w * scale * page.h * scale * 10.0).max(1.0);
        let cores = self.canvases.len();
        let fits = |each: &usize| (cores * each) as f64 * bytes <= MOST_BYTES;
        cores * (1..=MOST_IN_A_ROW).rev().find(fits).unwrap_or(1)
    }

    /// Draws frames that follow each other.
    pub(crate) fn draw(&mut self, frame_times: &[FrameTime]) -> Result<Vec<Drawn>> {
        let (sequence, needs) = (self.sequence, self.needs);
        let (palette, kept) = (&self.palette, &self.kept);
        share(&mut self.canvases, frame_times, |canvas, frame_time| {
            let scene = sequence.picture.scene(frame_time.window, frame_time.phase);
            let pixels = match kept.get(&key(frame_time)) {
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
                frame_time,
                scene,
                pixels,
                indices,
            })
        })
    }

    /// Makes the palette from a few frames and keeps them.
    fn survey(&mut self, frame_times: &[FrameTime]) -> Result<()> {
        let changed: Vec<usize> = (0..frame_times.len())
            .filter(|i| self.sequence.view.is_changed(frame_times[*i].window))
            .collect();
        let all: Vec<usize> = (0..frame_times.len()).collect();
        let mut places = spread(&changed, SAMPLES / 2);
        places.extend(spread(&all, SAMPLES / 2));
        places.sort_unstable();
        places.dedup();
        let sample: Vec<FrameTime> = places.into_iter().map(|i| frame_times[i]).collect();
        let sequence = self.sequence;
        let drawn = share(&mut self.canvases, &sample, |canvas, frame_time| {
            let pixels =
                canvas.draw(&sequence.picture.scene(frame_time.window, frame_time.phase))?;
            let packed = Packed::new(&pixels.rgba);
            Ok((key(frame_time), (pixels.width, pixels.height, packed)))
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
    frame_times: &[FrameTime],
    draw: impl Fn(&mut Canvas<'a>, FrameTime) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let in_a_row = frame_times.len().div_ceil(canvases.len().max(1)).max(1);
    let rows: Vec<Vec<T>> = frame_times
        .par_chunks(in_a_row)
        .zip(canvases)
        .map(|(row, canvas)| {
            row.iter()
                .map(|frame_time| draw(canvas, *frame_time))
                .collect()
        })
        .collect::<Result<_>>()?;
    Ok(rows.into_iter().flatten().collect())
}

fn key(frame_time: FrameTime) -> (usize, u64) {
    (frame_time.window, frame_time.phase.to_bits())
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
