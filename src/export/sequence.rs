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
    /// The drawing of a window, an index into [`View::frames`]; all drawings have the same size. `phase`, above 0 to 1,
    /// is the progress of the transition into it: 1 is the window itself.
    fn scene(&self, window: usize, phase: f64) -> Scene;

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
    fn scene(&self, window: usize, phase: f64) -> Scene {
        self.between(window, phase)
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
    fn scene(&self, window: usize, phase: f64) -> Scene {
        self.scene(window, phase)
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTime {
    /// The window: an index into [`View::frames`].
    pub window: usize,
    /// The progress of the transition into this window, above 0 up to 1; 1 is the window itself.
    pub phase: f64,
    /// The time for which it is shown, in milliseconds.
    pub ms: u32,
}

impl FrameTime {
    /// Whether it shows the window itself rather than the transition.
    pub fn is_settled(&self) -> bool {
        self.phase >= 1.0
    }
}

/// The longest and shortest time of a staged frame in milliseconds.
const STAGED_MS: (u32, u32) = (20, 100);

impl Sequence<'_> {
    /// The frames in order. The total duration is constant: staged frames are taken from their window's time, and the
    /// time of an omitted window is added to the previous one. A long time without messages is one frame of normal
    /// duration.
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
    let (shortest, longest) = STAGED_MS;
    let mut frame_times: Vec<FrameTime> = Vec::with_capacity(changed.len());
    for (window, &changed) in changed.iter().enumerate() {
        let hold = if changed { options.hold_changes } else { 1 };
        let mut ms = options.frame_ms.saturating_mul(hold.max(1));
        let stays = if options.changes_only {
            window == 0
        } else {
            window % options.every.max(1) == 0
        };
        if let (false, false, Some(before)) = (stays, changed, frame_times.last_mut()) {
            before.ms = before.ms.saturating_add(ms);
            continue;
        }
        if changed && options.tween > 0 {
            let each = (ms / 2 / options.tween).clamp(shortest, longest);
            for step in 1..=options.tween {
                let phase = f64::from(step) / f64::from(options.tween + 1);
                frame_times.push(FrameTime {
                    window,
                    phase,
                    ms: each,
                });
            }
            ms = ms.saturating_sub(each * options.tween).max(shortest);
        }
        frame_times.push(FrameTime {
            window,
            phase: 1.0,
            ms,
        });
    }
    frame_times
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUIET_LOUD_QUIET: [bool; 3] = [false, true, false];

    /// Window, phase and milliseconds of every frame.
    fn plan(changed: &[bool], options: &SequenceOptions) -> Vec<(usize, f64, u32)> {
        let numbers = |s: FrameTime| (s.window, s.phase, s.ms);
        frame_times(changed, options)
            .into_iter()
            .map(numbers)
            .collect()
    }

    #[test]
    fn every_window_is_shown_once() {
        let expected = [(0, 1.0, 1000), (1, 1.0, 1000), (2, 1.0, 1000)];
        assert_eq!(
            plan(&QUIET_LOUD_QUIET, &SequenceOptions::default()),
            expected
        );
    }

    #[test]
    fn staged_frames_only_precede_changes_and_take_no_extra_time() {
        let options = SequenceOptions {
            tween: 3,
            ..SequenceOptions::default()
        };
        let expected = [
            (0, 1.0, 1000),
            (1, 0.25, 100),
            (1, 0.5, 100),
            (1, 0.75, 100),
            (1, 1.0, 700),
            (2, 1.0, 1000),
        ];
        assert_eq!(plan(&QUIET_LOUD_QUIET, &options), expected);
    }

    #[test]
    fn a_change_may_be_held_longer() {
        let options = SequenceOptions {
            hold_changes: 2,
            ..SequenceOptions::default()
        };
        let expected = [(0, 1.0, 1000), (1, 1.0, 2000), (2, 1.0, 1000)];
        assert_eq!(plan(&QUIET_LOUD_QUIET, &options), expected);
    }

    #[test]
    fn omitted_windows_pass_on_their_time_and_changes_stay() {
        let options = SequenceOptions {
            every: 3,
            ..SequenceOptions::default()
        };
        let changed = [false, false, true, false, false, false, false];
        let expected = [
            (0, 1.0, 2000),
            (2, 1.0, 1000),
            (3, 1.0, 3000),
            (6, 1.0, 1000),
        ];
        assert_eq!(plan(&changed, &options), expected);
        let options = SequenceOptions {
            changes_only: true,
            ..SequenceOptions::default()
        };
        assert_eq!(plan(&changed, &options), [(0, 1.0, 2000), (2, 1.0, 5000)]);
    }

    #[test]
    fn a_fast_animation_still_shows_every_frame() {
        let options = SequenceOptions {
            frame_ms: 20,
            tween: 8,
            ..SequenceOptions::default()
        };
        let plan = plan(&[false, true], &options);
        assert!(plan.iter().all(|frame_time| frame_time.2 >= 20));
        assert_eq!(plan.len(), 10);
    }
}
