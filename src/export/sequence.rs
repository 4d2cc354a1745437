//! The displayed sequence: the windows in order with their durations, and the drawings.

pub use super::options::SequenceOptions;

pub use crate::draw::figure::course::LifeLines;
pub use crate::draw::topic_timeline::Overview;

use crate::base::notice::Notices;
use crate::draw::paint::raster::Painter;
use crate::draw::picture::{Picture, Union};
use crate::draw::scene::Scene;
use crate::draw::style::Style;
use crate::draw::text::Fonts;
use crate::draw::topic_timeline::TopicTimeline;
use crate::mission::{Mission, Places};
use crate::view::{Frame, View};

/// The drawings of the windows of a sequence.
pub trait Drawings: Sync {
    /// The drawing of a window, an index into [`View::frames`]; all drawings have the same size.
    fn scene(&self, window: usize) -> Scene;

    /// The title of the drawing of a graph; `None` for other drawings.
    fn title(&self) -> Option<&str> {
        None
    }

    /// The graph of all windows, for outputs that draw the graph once, if any.
    fn graph(&self) -> Option<UnionDrawings<'_>> {
        None
    }

    /// All windows in one drawing over time, for the same outputs if there is no graph.
    fn overview(&self) -> Option<Overview> {
        None
    }
}

/// The graph of all windows, drawn once.
#[derive(Clone, Debug)]
pub struct UnionDrawings<'a> {
    /// The drawing of every element.
    pub union: Union,
    /// The style of the drawing.
    pub style: &'a Style,
}

impl Drawings for Picture<'_> {
    fn scene(&self, window: usize) -> Scene {
        self.scene(window)
    }

    fn title(&self) -> Option<&str> {
        Some(self.title_text())
    }

    fn graph(&self) -> Option<UnionDrawings<'_>> {
        Some(UnionDrawings {
            union: self.union(),
            style: self.style(),
        })
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
    pub lives: Option<&'a LifeLines>,
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
    /// The painter that turns a drawing into pixels.
    pub painter: &'a Painter,
    /// The fonts for all text.
    pub fonts: &'a Fonts,
    /// The film strip, for outputs with all windows in one drawing.
    pub strip: Option<&'a Scene>,
    /// The LaTeX code that includes the figure, if there is one.
    pub latex: Option<&'a str>,
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

impl Sequence<'_> {
    /// The frames in order. The total duration is constant: the time of an omitted window is added to the previous one. A
    /// long time without messages is one frame of normal duration.
    pub fn frame_times(&self) -> Vec<FrameTime> {
        let frames = &self.view.frames;
        let changed: Vec<bool> = frames.iter().map(Frame::is_changed).collect();
        let mut times = frame_times(&changed, &self.options);
        let empty = |time: &FrameTime| frames[time.window].empty;
        times.dedup_by(|later, before| empty(later).is_some() && empty(later) == empty(before));
        times
    }
}

fn frame_times(changed: &[bool], options: &SequenceOptions) -> Vec<FrameTime> {
    let mut frame_times: Vec<FrameTime> = Vec::with_capacity(changed.len());
    for (window, &changed) in changed.iter().enumerate() {
        let ms = options.frame_ms;
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
