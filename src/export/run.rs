//! Runs a sequence once through all its outputs: each frame is drawn once, by all cores, and passed to every output in
//! order.

use std::ops::{ControlFlow, Range};
use std::sync::mpsc::{Receiver, sync_channel};
use std::{io, thread};

use rayon::prelude::*;

use super::check::make_folder;
use super::palette::{Census, Matcher, Palette};
use super::sequence::{FrameTime, Sequence, SequenceOptions};
use super::{DrawnFrame, Encoder, Needs, Output, Pack, Packet, Written};
use crate::base::error::{Error, Result};
use crate::base::geometry::Size;
use crate::base::words;
use crate::draw::paint::raster::{Canvas, DrawnScene};
use crate::draw::scene::Scene;

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
        None => fit(sequence, output, progress),
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
        let is_one = |job: &&mut OutputJob<'_>| {
            job.output.format.is_film() == is_film && job.needs() > Needs::Nothing
        };
        let mut some: Vec<_> = jobs.iter_mut().filter(is_one).collect();
        if !some.is_empty() {
            play(sequence, &mut some, is_film, progress)?;
        }
    }
    jobs.into_iter().map(OutputJob::finish).collect()
}

/// An output being written.
struct OutputJob<'a> {
    output: &'a Output,
    /// Its encoder, or the error that ended it early.
    encoder: Result<Box<dyn Encoder + 'a>>,
}

impl<'a> OutputJob<'a> {
    fn start(sequence: &'a Sequence<'a>, output: &'a Output) -> Result<Self> {
        Ok(Self {
            output,
            encoder: Ok((output.format.start)(sequence, &output.target)?),
        })
    }

    /// The data that it needs for every frame; none once it has ended.
    fn needs(&self) -> Needs {
        let encoder = self.encoder.as_ref();
        encoder.map_or(Needs::Nothing, |encoder| encoder.needs())
    }

    /// Takes packets, unless it has ended.
    fn take(&mut self, size: (u32, u32), palette: &Palette, packets: Vec<(FrameTime, Packet)>) {
        let Ok(encoder) = &mut self.encoder else {
            return;
        };
        let begun = encoder.begin(size, palette);
        let mut packets = packets.into_iter();
        let mut take = |(frame_time, packet)| encoder.take(frame_time, packet);
        if let Err(error) = begun.and_then(|()| packets.try_for_each(&mut take)) {
            self.encoder = Err(error);
        }
    }

    /// The error that must end the whole run, if any.
    fn failure(&mut self) -> Result<()> {
        match std::mem::replace(&mut self.encoder, Err(Error::Interrupted)) {
            Err(error) if !is_harmless(self.output, &error) => Err(error),
            other => {
                self.encoder = other;
                Ok(())
            }
        }
    }

    fn finish(self) -> Result<Option<Written>> {
        match self.encoder.and_then(Encoder::finish) {
            Ok(written) => Ok(Some(written)),
            Err(error) if is_too_large(self.output, &error) => Ok(None),
            Err(error) if is_harmless(self.output, &error) => {
                Ok(Some(Written::to(&self.output.target)))
            }
            Err(error) => Err(error),
        }
    }
}

/// Whether an error ends only this output: its reader closed the pipe, or it is too large and will be retried.
fn is_harmless(output: &Output, error: &Error) -> bool {
    kind(error) == Some(io::ErrorKind::BrokenPipe) || is_too_large(output, error)
}

fn is_too_large(output: &Output, error: &Error) -> bool {
    output.format.takes("max-bytes", false) && kind(error) == Some(io::ErrorKind::FileTooLarge)
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

/// Draws all frames, of films or of files, and passes them on in order while the next ones are drawn.
fn play(
    sequence: &Sequence<'_>,
    jobs: &mut [&mut OutputJob<'_>],
    is_film: bool,
    progress: &mut Progress<'_>,
) -> Result<()> {
    let frame_times = sequence.frame_times(is_film);
    let needs = jobs.iter().map(|job| job.needs()).max();
    let packs = jobs.iter().flat_map(|job| &job.encoder);
    let packs: Vec<Pack> = packs.map(|encoder| encoder.pack()).collect();
    let needs = needs.unwrap_or(Needs::Nothing);
    let pool = RasterPool::new(sequence, &frame_times, needs, &packs)?;
    let mut done = 0;
    pool.run(|row| {
        done += row.len();
        let size = row.first().map_or((0, 0), |packed| packed.size);
        let queues = by_output(row, jobs.len());
        let each = jobs.par_iter_mut().zip(queues);
        each.for_each(|(job, packets)| job.take(size, &pool.palette, packets));
        jobs.iter_mut().try_for_each(|job| job.failure())?;
        if progress(done, frame_times.len()).is_break() {
            return Err(Error::Interrupted);
        }
        Ok(if jobs.iter().all(|job| job.encoder.is_err()) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        })
    })
}

/// The packets of each output.
fn by_output(row: Vec<Packed>, outputs: usize) -> Vec<Vec<(FrameTime, Packet)>> {
    let mut queues: Vec<Vec<_>> = (0..outputs).map(|_| Vec::new()).collect();
    for packed in row {
        for (queue, packet) in queues.iter_mut().zip(packed.packets) {
            queue.push((packed.frame_time, packet));
        }
    }
    queues
}

// `--max-bytes`: drops resolution, then windows, until an animation is small enough.

/// Scales that are tried while all windows are shown.
const SCALES: [f64; 4] = [0.85, 0.7, 0.6, 0.5];
/// Steps between shown windows that are tried, at the smallest of these scales.
const EVERY: [usize; 4] = [2, 3, 5, 10];
/// Scales that are tried when only changes are shown.
const LAST_SCALES: [f64; 4] = [0.5, 0.35, 0.25, 0.15];

/// Writes `output` within `max_bytes`; a remark reports what was dropped.
///
/// # Errors
/// [`Error::Output`] if nothing is small enough; otherwise as [`run`].
pub(crate) fn fit(
    sequence: &Sequence<'_>,
    output: &Output,
    progress: &mut Progress<'_>,
) -> Result<Written> {
    for options in steps(&sequence.options) {
        let mut smaller = sequence.clone();
        smaller.options = options;
        let outcome = pass(&smaller, std::slice::from_ref(output), progress)?;
        if let Some(Some(mut written)) = outcome.into_iter().next() {
            let remark = given_up(&sequence.options, &smaller.options);
            written.remarks.push(remark);
            return Ok(written);
        }
    }
    let most = words::bytes(sequence.options.max_bytes.unwrap_or(0));
    let reason = format!("it does not fit in {most}, even small and with changes only");
    let hint = "raise `--max-bytes`, or show less: a longer `--period`, `--ns-filter`";
    Err(Error::output(output.target.path(), reason, hint))
}

/// The options that are tried, in order.
fn steps(asked: &SequenceOptions) -> Vec<SequenceOptions> {
    let scaled = |by: f64| SequenceOptions {
        scale: asked.scale * by,
        ..asked.clone()
    };
    let mut steps = SCALES.map(scaled).to_vec();
    let smallest = || scaled(SCALES[SCALES.len() - 1]);
    steps.extend(EVERY.map(|every| SequenceOptions {
        every,
        ..smallest()
    }));
    steps.extend(LAST_SCALES.map(|by| SequenceOptions {
        changes_only: true,
        ..scaled(by)
    }));
    steps
}

/// What was dropped between `asked` and `now`, as text.
fn given_up(asked: &SequenceOptions, now: &SequenceOptions) -> String {
    let mut words = Vec::new();
    let (percent, every) = (now.scale / asked.scale * 100.0, now.every);
    if now.scale < asked.scale {
        words.push(format!("scaled to {percent:.0} %"));
    }
    if now.changes_only {
        words.push("showed only the windows with a change".to_owned());
    } else if every > asked.every {
        words.push(format!(
            "showed one of every {every} windows, and all with a change"
        ));
    }
    let most = now.max_bytes.unwrap_or(0);
    format!("{} to stay within {most} bytes", words.join(", "))
}

// The drawing threads: each draws runs of consecutive frames and encodes them immediately, so that only frames in
// flight take memory, independent of the number of windows.

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
    /// The most that an output needs for every frame.
    needs: Needs,
    packs: &'a [Pack],
    /// The palette of the whole sequence; one black unless indices are needed.
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
        needs: Needs,
        packs: &'a [Pack],
    ) -> Result<Self> {
        let mut pool = Self {
            sequence,
            frame_times,
            needs,
            packs,
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
        let outputs = self.packs.len() as f64;
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
        self.sequence.picture.scene(frame_time.window)
    }

    /// A palette from a few frames.
    fn survey(&self) -> Result<Palette> {
        let view = self.sequence.view;
        let is_changed = |at: &usize| view.is_changed(self.frame_times[*at].window);
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
                let drawn = canvas.draw(self.scene(self.frame_times[*at]))?;
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
        row.map(|at| self.frame(at, self.pool.packs)).collect()
    }

    fn frame(&mut self, at: usize, packs: &[Pack]) -> Result<Packed> {
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
                let places = &mut self.indices[bytes.start / 4..bytes.end / 4];
                self.matcher.map(&pixels.rgba[bytes], places);
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
        let packets = packs.iter().map(|pack| pack(&frame));
        Ok(Packed {
            frame_time,
            size: (pixels.width, pixels.height),
            packets: packets.collect::<Result<_>>()?,
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
    fn size_goes_first_then_windows() {
        let asked = SequenceOptions {
            max_bytes: Some(5000),
            ..SequenceOptions::default()
        };
        let steps = steps(&asked);
        assert!(steps.iter().all(|s| s.scale < 1.0));
        let first_left_out = steps.iter().position(|s| s.every > 1).unwrap();
        assert!(steps[..first_left_out].iter().any(|s| s.scale <= 0.5));
        assert!(steps[steps.len() - 1].changes_only);
    }

    #[test]
    fn reductions_are_reported() {
        let asked = SequenceOptions {
            max_bytes: Some(5000),
            ..SequenceOptions::default()
        };
        let now = SequenceOptions {
            scale: 0.7,
            ..asked.clone()
        };
        let expected = "scaled to 70 % to stay within 5000 bytes";
        assert_eq!(given_up(&asked, &now), expected);
    }

    #[test]
    fn a_spread_includes_both_ends() {
        let all: Vec<usize> = (0..100).collect();
        assert!(spread(&all, 4).eq([0, 33, 66, 99]));
        assert!(spread(&all[..3], 4).eq([0, 1, 2]));
        assert_eq!(spread::<usize>(&[], 4).next(), None);
    }
}
