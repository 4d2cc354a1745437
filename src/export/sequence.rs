//! The displayed sequence: the windows in order with their durations, and the drawings.

use std::path::PathBuf;

use super::OneDrawing;
use super::target::Target;
use crate::base::notice::Notices;
pub use crate::draw::figure::FigureOptions;
use crate::draw::figure::Latex;
use crate::draw::paint::raster::Painter;
use crate::draw::picture::{Picture, Union};
use crate::draw::scene::Scene;
pub use crate::draw::strip::Choice;
use crate::draw::style::Style;
use crate::draw::text::Fonts;
pub use crate::draw::timeline::Timeline;
pub use crate::draw::topic_timeline::Overview;
use crate::draw::topic_timeline::TopicTimeline;
use crate::mission::{Mission, Places};
use crate::view::{Frame, View};

/// The drawings of the windows of a sequence.
pub trait Drawings: Sync {
    /// The drawing of a window, an index into [`View::frames`]; all drawings have the same size.
    fn scene(&self, _window: usize) -> Scene {
        Scene::default()
    }

    /// The title of the drawing of a graph; `None` for other drawings.
    fn title(&self) -> Option<&str> {
        None
    }

    /// The graph of all windows and its style, for outputs that draw the graph once, if any.
    fn graph(&self) -> Option<(Union, &Style)> {
        None
    }

    /// All windows in one drawing over time, for the same outputs if there is no graph.
    fn overview(&self) -> Option<Overview> {
        None
    }
}

/// No drawings, for outputs that show none.
impl Drawings for () {}

impl Drawings for Picture<'_> {
    fn scene(&self, window: usize) -> Scene {
        self.scene(window)
    }

    fn title(&self) -> Option<&str> {
        Some(self.title_text())
    }

    fn graph(&self) -> Option<(Union, &Style)> {
        Some((self.union(), self.style()))
    }
}

impl Drawings for TopicTimeline<'_> {
    fn scene(&self, window: usize) -> Scene {
        self.scene(window)
    }

    fn overview(&self) -> Option<Overview> {
        Some(self.overview())
    }
}

/// The view with all elements separately, even those that the picture groups, for pages and reports.
#[derive(Clone, Copy)]
pub struct Unfolded<'a> {
    /// The view with everything expanded.
    pub view: &'a View,
    /// The drawings of that view, if an output needs them.
    pub picture: Option<&'a dyn Drawings>,
    /// The lifelines of the mission, if an output needs them.
    pub lives: Option<&'a Timeline>,
    /// The smallest relative change of a rate that is reported.
    pub rate_change: f64,
}

/// A mission with everything needed to show it.
#[derive(Clone)]
pub struct Sequence<'a> {
    /// The whole sequence.
    pub mission: &'a Mission,
    /// The mission for data files: the whole sequence, or the filtered part.
    pub data: &'a Mission,
    /// The positions of everything, if it is drawn.
    pub places: Option<&'a Places>,
    /// The notices for the user.
    pub notices: &'a Notices,
    /// The view of the mission that the picture shows.
    pub view: &'a View,
    /// The drawings of the windows.
    pub picture: &'a dyn Drawings,
    /// The view with everything expanded, if an output needs it.
    pub unfolded: Option<Unfolded<'a>>,
    /// The view with one line per pair of nodes, for charts with many lines, if an output needs it.
    pub paired: Option<&'a View>,
    /// The painter that turns a drawing into pixels.
    pub painter: &'a Painter,
    /// The fonts for all text.
    pub fonts: &'a Fonts,
    /// The film strip, for outputs with all windows in one drawing.
    pub strip: Option<&'a Scene>,
    /// The LaTeX code that includes the figure, if there is one.
    pub latex: Option<&'a Latex>,
    /// The options of the sequence.
    pub options: SequenceOptions,
}

/// One frame of the sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameTime {
    /// The window: an index into [`View::frames`].
    pub window: usize,
    /// The time for which it is shown, in milliseconds.
    pub ms: u32,
}

/// What an output shows of a sequence.
#[derive(Clone, Copy)]
pub(crate) enum Shows<'a> {
    /// All windows in one animation.
    Film,
    /// A drawing per window, or that of the only window.
    Windows,
    /// One drawing of the whole mission.
    Whole(&'a Scene),
}

impl<'a> Sequence<'a> {
    /// What a target shows whose format can contain one drawing of the whole as `whole` says.
    pub(crate) fn shows(&self, target: &Target, whole: OneDrawing) -> Shows<'a> {
        let is_whole = match whole {
            OneDrawing::Never => false,
            OneDrawing::Asked => self.options.strip.is_some() || self.options.figure.is_some(),
            OneDrawing::Always => true,
        };
        match self.strip.filter(|_| is_whole) {
            _ if target.is_numbered() => Shows::Windows,
            Some(scene) => Shows::Whole(scene),
            None if self.view.frames.len() > 1 => Shows::Film,
            None => Shows::Windows,
        }
    }

    /// The frames in order: of an animation (`is_film`), or of files with a window each. A long time without messages is one
    /// frame.
    pub fn frame_times(&self, is_film: bool) -> Vec<FrameTime> {
        let frames = &self.view.frames;
        let changed: Vec<bool> = frames.iter().map(Frame::is_changed).collect();
        let mut times = frame_times(&changed, &self.options);
        let empty = |time: &FrameTime| frames[time.window].empty;
        times.dedup_by(|later, before| empty(later).is_some() && empty(later) == empty(before));
        if is_film && self.options.frame_ms.is_none() {
            let words = |window: usize| {
                let frame = &frames[window];
                let text = frame.words(READ_PHRASES);
                frame.is_changed().then(|| text.split_whitespace().count())
            };
            times = paced(&times, words);
        }
        times
    }
}

/// The duration of each window's frame if none was requested, in milliseconds.
const FRAME_MS: u32 = 1000;
/// The duration of a frame without news, in milliseconds: long enough to see that nothing changes.
const QUIET_MS: u32 = 400;
/// The duration of a frame with news, in milliseconds: the time to find it, the time for each word (readers of subtitles take
/// about 300 ms, but most words here are names that were seen before), and the most, after which a film seems to stand.
const NEWS_MS: u32 = 800;
const WORD_MS: u32 = 120;
const MOST_MS: u32 = 3500;
/// The number of phrases of a headline that count as read.
const READ_PHRASES: usize = 4;
/// The most frames without news in a row; more become one frame.
const MOST_QUIET: usize = 2;

/// The frames with the time that it takes to read their news: `words` is the number of words, or `None` without news. More than
/// two frames without news in a row are one, unless nothing changes in the whole film.
fn paced(times: &[FrameTime], words: impl Fn(usize) -> Option<usize>) -> Vec<FrameTime> {
    let is_news = |time: &FrameTime| words(time.window).is_some();
    let has_news = times.iter().any(is_news);
    let mut paced = Vec::with_capacity(times.len());
    for run in times.chunk_by(|a, b| !is_news(a) && !is_news(b)) {
        let shown = if has_news && run.len() > MOST_QUIET {
            &run[..1]
        } else {
            run
        };
        paced.extend(shown.iter().map(|time| {
            let read = |words: usize| u32::try_from(words).unwrap_or(u32::MAX);
            let ms = words(time.window).map_or(QUIET_MS, |words| {
                NEWS_MS.saturating_add(WORD_MS.saturating_mul(read(words)))
            });
            FrameTime {
                ms: ms.min(MOST_MS),
                ..*time
            }
        }));
    }
    paced
}

/// The total duration is constant: the time of an omitted window is added to the previous one.
fn frame_times(changed: &[bool], options: &SequenceOptions) -> Vec<FrameTime> {
    let mut frame_times: Vec<FrameTime> = Vec::with_capacity(changed.len());
    for (window, &changed) in changed.iter().enumerate() {
        let ms = options.frame_ms.unwrap_or(FRAME_MS);
        let stays = if options.changes_only {
            window == 0
        } else {
            window % options.every.max(1) == 0
        };
        if let (false, false, Some(before)) = (stays, changed, frame_times.last_mut()) {
            before.ms = before.ms.saturating_add(ms);
            continue;
        }
        frame_times.push(FrameTime { window, ms });
    }
    frame_times
}

// The options of a sequence and of its formats.

/// The options of a sequence.
#[derive(Clone, Debug, PartialEq)]
pub struct SequenceOptions {
    /// The time for which each window is shown, in milliseconds, ≥ 20; `None`: as long as its headline takes to read.
    pub frame_ms: Option<u32>,
    /// The step from one window that is shown to the next, in windows, ≥ 1; windows with a change are shown in any
    /// case.
    pub every: usize,
    /// Whether windows without a change are left out.
    pub changes_only: bool,
    /// Pixels of an image per pixel of the picture, above 0.
    pub scale: f64,
    /// The size limit of an animation in bytes.
    pub max_bytes: Option<u64>,
    /// The windows of a film strip, if requested; it also replaces a sequence of drawings.
    pub strip: Option<Choice>,
    /// The figure, if requested; it replaces a strip.
    pub figure: Option<FigureOptions>,
    /// The lifelines of two compared missions, which replace the mission's own.
    pub pairs: Option<Timeline>,
    /// Links for the report: name and address.
    pub links: Vec<(String, String)>,
    /// A file to which reports are appended; all others are overwritten.
    pub append_to: Option<PathBuf>,
}

impl Default for SequenceOptions {
    fn default() -> Self {
        Self {
            frame_ms: None,
            every: 1,
            changes_only: false,
            scale: 1.0,
            max_bytes: None,
            strip: None,
            figure: None,
            pairs: None,
            links: Vec::new(),
            append_to: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUIET_LOUD_QUIET: [bool; 3] = [false, true, false];

    /// Window and milliseconds of every frame.
    fn plan(changed: &[bool], options: &SequenceOptions) -> Vec<(usize, u32)> {
        let times = frame_times(changed, options).into_iter();
        times.map(|time| (time.window, time.ms)).collect()
    }

    #[test]
    fn news_is_shown_as_long_as_it_takes_to_read() {
        let paced = |words: &[Option<usize>]| -> Vec<(usize, u32)> {
            let times: Vec<FrameTime> = (0..words.len())
                .map(|window| FrameTime { window, ms: 1000 })
                .collect();
            let times = super::paced(&times, |window| words[window]);
            times.iter().map(|time| (time.window, time.ms)).collect()
        };
        let film = [None, None, Some(5), None, None, None, Some(11), Some(80)];
        assert_eq!(
            paced(&film),
            [
                (0, 400),
                (1, 400),
                (2, 1400),
                (3, 400),
                (6, 2120),
                (7, 3500)
            ]
        );
        assert_eq!(paced(&[None; 3]), [(0, 400), (1, 400), (2, 400)]);
    }

    #[test]
    fn every_window_is_shown_once() {
        let expected = [(0, 1000), (1, 1000), (2, 1000)];
        assert_eq!(
            plan(&QUIET_LOUD_QUIET, &SequenceOptions::default()),
            expected
        );
    }

    #[test]
    fn omitted_windows_pass_on_their_time_and_changes_stay() {
        let options = SequenceOptions {
            every: 3,
            ..SequenceOptions::default()
        };
        let changed = [false, false, true, false, false, false, false];
        let expected = [(0, 2000), (2, 1000), (3, 3000), (6, 1000)];
        assert_eq!(plan(&changed, &options), expected);
        let options = SequenceOptions {
            changes_only: true,
            ..SequenceOptions::default()
        };
        assert_eq!(plan(&changed, &options), [(0, 2000), (2, 5000)]);
    }
}
