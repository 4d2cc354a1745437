//! The drawing threads: each draws runs of consecutive frames and encodes them immediately, so that only frames in
//! flight take memory, independent of the number of windows.

use std::ops::{ControlFlow, Range};
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread;

use rayon::prelude::*;

use crate::base::error::Result;
use crate::base::geometry::Size;
use crate::draw::paint::raster::{Canvas, DrawnScene};
use crate::draw::scene::Scene;
use crate::export::palette::{Census, Matcher, Palette};
use crate::export::sequence::{FrameTime, Sequence};
use crate::export::{DrawnFrame, Needs, Pack, Packet};

/// The most bytes of queued packets.
const MOST_BYTES: f64 = 48e6;
/// The most frames in a row: enough that little is drawn twice at the ends of rows, few enough that progress is
/// visible.
const MOST_IN_A_ROW: usize = 8;
/// Unwritten rows per core: one in progress, one queued.
const ROWS_AHEAD: usize = 2;
/// The most groups on the pages of all threads together, except on those of a single thread: a thread keeps the scene
/// and the drawing of each group, up to 10 kB, and tens of thousands of boxes must fit into 512 MB.
const MOST_GROUPS: usize = 50_000;
/// The frames whose groups are counted: a mission may grow or shrink.
const LOOKED_AT: usize = 3;
/// The most frames that a palette is made from: some of those with a change, some of all.
const SAMPLES: usize = 12;

/// The data that an output needs for every frame.
#[derive(Clone, Copy)]
pub(crate) struct FrameWant {
    pub(crate) needs: Needs,
    pub(crate) pack: Pack,
}

/// A frame, drawn and packed.
pub(crate) struct Packed {
    pub(crate) frame_time: FrameTime,
    /// Its size in pixels; 0 if no output needs pixels.
    pub(crate) size: (u32, u32),
    /// A packet per output.
    pub(crate) packets: Vec<Packet>,
}

pub(crate) struct RasterPool<'a> {
    sequence: &'a Sequence<'a>,
    frame_times: &'a [FrameTime],
    wants: &'a [FrameWant],
    needs: Needs,
    palette: Palette,
    /// The size of a page, in the pixels of the picture.
    page: Size,
    threads: usize,
}

impl<'a> RasterPool<'a> {
    /// The drawing threads for these frames, with their palette.
    pub(crate) fn new(
        sequence: &'a Sequence<'a>,
        frame_times: &'a [FrameTime],
        wants: &'a [FrameWant],
    ) -> Result<Self> {
        let needs = wants.iter().map(|want| want.needs).max();
        let mut pool = Self {
            sequence,
            frame_times,
            wants,
            needs: needs.unwrap_or(Needs::Nothing),
            palette: Palette::new(Vec::new()),
            page: Size::new(1.0, 1.0),
            threads: rayon::current_num_threads(),
        };
        for at in spread(frame_times, LOOKED_AT) {
            let scene = pool.scene(at);
            pool.page = scene.size;
            let most = MOST_GROUPS / scene.groups.len().max(1);
            pool.threads = pool.threads.min(most).max(1);
        }
        if pool.needs >= Needs::Indices {
            pool.palette = pool.survey()?;
        }
        Ok(pool)
    }

    /// The palette of the whole sequence; one black unless indices are needed.
    pub(crate) fn palette(&self) -> &Palette {
        &self.palette
    }

    /// Draws all frames and passes them to `take`, row by row in order, until it cancels.
    ///
    /// # Errors
    /// If a frame cannot be drawn or encoded, and the errors of `take`.
    pub(crate) fn run(
        &self,
        mut take: impl FnMut(Vec<Packed>) -> Result<ControlFlow<()>>,
    ) -> Result<()> {
        let rows = self.rows();
        let cores = self.threads.min(rows.len());
        thread::scope(|scope| {
            // Dropping the receivers, in any case, ends the drawing threads.
            let drawn: Vec<Receiver<Result<Vec<Packed>>>> = (0..cores)
                .map(|core| {
                    let (send, receive) = sync_channel(ROWS_AHEAD - 1);
                    let own = rows.iter().skip(core).step_by(cores);
                    scope.spawn(move || {
                        let mut artist = Drawer::new(self);
                        for row in own {
                            if send.send(artist.row(row.clone())).is_err() {
                                return;
                            }
                        }
                    });
                    receive
                })
                .collect();
            for at in 0..rows.len() {
                // A thread that ended has reported its error before.
                let Ok(row) = drawn[at % cores].recv() else {
                    break;
                };
                if take(row?)?.is_break() {
                    break;
                }
            }
            Ok(())
        })
    }

    /// The frames in rows of about equal length, as long as memory allows.
    fn rows(&self) -> Vec<Range<usize>> {
        let count = self.frame_times.len();
        let cores = self.threads;
        let scale = self.sequence.options.scale;
        let pixels = self.page.w * self.page.h * scale * scale;
        // A packet has at most a byte per pixel.
        let outputs = self.wants.len() as f64;
        let fits =
            |each: &usize| (ROWS_AHEAD * cores * each) as f64 * pixels * outputs <= MOST_BYTES;
        let most = (1..=MOST_IN_A_ROW).rev().find(fits).unwrap_or(1);
        // Equally many rows per core, so that none waits for the last.
        let rows = count.div_ceil(most * cores).max(1) * cores;
        let each = count.div_ceil(rows).max(1);
        let starts = (0..count).step_by(each);
        starts.map(|at| at..(at + each).min(count)).collect()
    }

    fn scene(&self, frame_time: FrameTime) -> Scene {
        let picture = self.sequence.picture;
        picture.scene(frame_time.window)
    }

    /// A palette from a few frames.
    fn survey(&self) -> Result<Palette> {
        let is_changed = |at: &usize| {
            let window = self.frame_times[*at].window;
            self.sequence.view.is_changed(window)
        };
        let all: Vec<usize> = (0..self.frame_times.len()).collect();
        let changed: Vec<usize> = all.iter().copied().filter(is_changed).collect();
        let mut sample: Vec<usize> = spread(&changed, SAMPLES / 2).collect();
        sample.extend(spread(&all, SAMPLES / 2));
        sample.sort_unstable();
        sample.dedup();
        let each = sample.len().div_ceil(self.threads).max(1);
        let count = |places: &[usize]| -> Result<Census> {
            let mut canvas = Canvas::new(self.sequence.painter, self.sequence.options.scale);
            let mut census = Census::default();
            for at in places {
                let scene = self.scene(self.frame_times[*at]);
                let drawn = canvas.draw(scene)?;
                census.count(&drawn.pixels.rgba);
            }
            Ok(census)
        };
        let counted = sample.par_chunks(each).map(count);
        let census = counted.try_reduce(Census::default, |a, b| Ok(a.and(b)))?;
        Ok(census.palette(255))
    }
}

/// A drawing thread.
struct Drawer<'a> {
    pool: &'a RasterPool<'a>,
    canvas: Canvas<'a>,
    matcher: Matcher<'a>,
    /// The index of the frame on the canvas.
    at: Option<usize>,
    indices: Vec<u8>,
    before: Vec<u8>,
}

impl<'a> Drawer<'a> {
    fn new(pool: &'a RasterPool<'a>) -> Self {
        Self {
            pool,
            canvas: Canvas::new(pool.sequence.painter, pool.sequence.options.scale),
            matcher: Matcher::new(&pool.palette),
            at: None,
            indices: Vec::new(),
            before: Vec::new(),
        }
    }

    /// Draws consecutive frames, and the one before them if it is needed and another thread drew it.
    fn row(&mut self, row: Range<usize>) -> Result<Vec<Packed>> {
        if let Some(before) = row.start.checked_sub(1)
            && self.at != Some(before)
            && self.pool.needs >= Needs::Indices
        {
            self.frame(before, &[])?;
        }
        row.map(|at| self.frame(at, self.pool.wants)).collect()
    }

    fn frame(&mut self, at: usize, wants: &[FrameWant]) -> Result<Packed> {
        let needs = self.pool.needs;
        let frame_time = self.pool.frame_times[at];
        let scene = self.pool.scene(frame_time);
        let undrawn;
        let drawn = if needs >= Needs::Pixels {
            self.canvas.draw(scene)?
        } else {
            undrawn = scene;
            DrawnScene::without_pixels(&undrawn)
        };
        let DrawnScene { scene, pixels, .. } = drawn;
        if needs >= Needs::Indices {
            std::mem::swap(&mut self.before, &mut self.indices);
            self.indices.clone_from(&self.before);
            self.indices.resize(pixels.rgba.len() / 4, 0);
            for bytes in drawn.changed() {
                let places = bytes.start / 4..bytes.end / 4;
                self.matcher
                    .map(&pixels.rgba[bytes], &mut self.indices[places]);
            }
        }
        self.at = Some(at);
        let frame = DrawnFrame {
            scene,
            pixels,
            palette: &self.pool.palette,
            indices: &self.indices,
            before: if at == 0 { &[] } else { &self.before },
        };
        let pack = |want: &FrameWant| match want.needs {
            Needs::Nothing => Ok(Packet::Nothing),
            _ => (want.pack)(&frame),
        };
        Ok(Packed {
            frame_time,
            size: (pixels.width, pixels.height),
            packets: wants.iter().map(pack).collect::<Result<_>>()?,
        })
    }
}

/// At most `most` of `all`, evenly spread, the first and the last among them.
fn spread<T: Copy>(all: &[T], most: usize) -> impl Iterator<Item = T> {
    let count = all.len().min(most);
    let last = all.len().saturating_sub(1);
    (0..count).map(move |i| all[i * last / (count - 1).max(1)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_includes_both_ends() {
        let all: Vec<usize> = (0..100).collect();
        assert!(spread(&all, 4).eq([0, 33, 66, 99]));
        assert!(spread(&all[..3], 4).eq([0, 1, 2]));
        assert_eq!(spread::<usize>(&[], 4).next(), None);
    }
}
