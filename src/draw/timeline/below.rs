//! The timeline below a frame: phases and rows of elements that start or stop, or messages per second if none do, and the
//! playhead at the window.

use super::Timeline;
use super::canvas::{MM_PER_PT, PaperCanvas, Sizes};
use super::drawer::{Density, Drawer};
use super::rows::{Row, SendingBar};
use crate::base::cast;
use crate::base::geometry::Rect;
use crate::base::time::{Span, Stamp};
use crate::draw::scene::{Form, Group, Shape};
use crate::draw::style::Style;
use crate::draw::text::Fonts;
use crate::view::{Frame, View};

/// The smallest text on a screen, in pixels.
const SMALLEST_TEXT: f64 = 10.0;
/// The space above and below everything, in units of the page.
const AROUND: f64 = 7.0;
/// The narrowest bar of messages, in pixels.
const NARROWEST: f64 = 2.5;

/// The scale and the page of a timeline below a frame.
#[derive(Clone, Copy)]
pub(crate) struct BelowSizes<'a> {
    pub(crate) style: &'a Style,
    /// The scale of title, legend and timeline.
    pub(crate) unit: f64,
    /// Whether the page is on paper, where text may be smaller than on a screen.
    pub(crate) is_paper: bool,
    /// Whether it is below a still, which only needs the phases: nothing is before or after it.
    pub(crate) is_still: bool,
}

impl BelowSizes<'_> {
    /// Pixels per millimetre: all text is small.
    fn scale(&self) -> f64 {
        let least = if self.is_paper { 0.0 } else { SMALLEST_TEXT };
        let text = (self.style.timeline.size * self.unit).max(least);
        text / (Sizes::SCREEN.small * MM_PER_PT)
    }

    /// The distance from row to row in millimetres; messages have one high row.
    fn pitch(&self, timeline: &Timeline) -> f64 {
        if self.is_still {
            0.0
        } else if timeline.rows.is_empty() {
            self.style.timeline.height * self.unit / self.scale()
        } else {
            Sizes::SCREEN.pitch()
        }
    }

    /// The height of the strip in pixels.
    pub(crate) fn height(&self, timeline: &Timeline) -> f64 {
        let height = timeline.height(Sizes::SCREEN, self.pitch(timeline));
        height * self.scale() + 2.0 * AROUND * self.unit
    }
}

/// The strip with its fixed positions.
pub(crate) struct Below<'a> {
    style: &'a Style,
    fonts: &'a Fonts,
    strip: Rect,
    scale: f64,
    drawer: Drawer,
}

impl<'a> Below<'a> {
    /// The timeline in a strip of the page, over the windows of a view.
    pub(crate) fn new(
        sizes: BelowSizes<'a>,
        fonts: &'a Fonts,
        strip: Rect,
        view: &View,
        mut timeline: Timeline,
    ) -> Self {
        let scale = sizes.scale();
        let start = view.frames.first().map_or(Stamp(0), |f| f.span.start);
        let end = view.frames.last().map_or(Stamp(1), |f| f.span.end);
        let pitch = sizes.pitch(&timeline);
        let margin = sizes.style.page.margin * sizes.unit / scale;
        let wide = strip.w / scale - 2.0 * margin;
        if sizes.is_still {
            timeline.rows.clear();
        } else if timeline.rows.is_empty() {
            timeline.rows = vec![messages(view, wide * scale)];
        }
        timeline.span = Span::new(start, end);
        let canvas = PaperCanvas::new(fonts, Sizes::SCREEN, scale);
        let place = Rect::new(margin, (strip.y + AROUND * sizes.unit) / scale, wide, 0.0);
        let mut drawer = Drawer::new(timeline, Density::Frame, &canvas, place);
        drawer.pitch = pitch;
        Self {
            style: sizes.style,
            fonts,
            strip,
            scale,
            drawer,
        }
    }

    fn canvas(&self) -> PaperCanvas<'a> {
        PaperCanvas::new(self.fonts, Sizes::SCREEN, self.scale)
    }

    /// The groups that are equal in every frame.
    pub(crate) fn ground(&self) -> Vec<Group> {
        let mut strip = Group::named("timeline");
        let form = Form::Rect(self.strip, 0.0);
        strip.shape(Shape::filled(form, self.style.legend.fill));
        let mut canvas = self.canvas();
        self.drawer.ground(&mut canvas);
        let mut groups = vec![strip];
        groups.extend(canvas.into_styled(self.style));
        groups
    }

    /// The groups that change from frame to frame: the elements that exist in the window, and the playhead over
    /// exactly its time.
    pub(crate) fn head(&self, frame: &Frame) -> Vec<Group> {
        let time = frame.shown();
        let mut canvas = self.canvas();
        self.drawer.now(&mut canvas, time, &|row| row.is_in(time));
        self.drawer.marks(&mut canvas);
        let mut groups = canvas.into_styled(self.style);
        groups.push(self.drawer.playhead(time, self.scale, self.style));
        groups
    }
}

/// The messages of all windows as one row: a bar per window, or per several if they would be too narrow on a line of
/// `width` pixels. Its rates are those of the windows' own time, so that short and overlapping windows are not misleading.
fn messages(view: &View, width: f64) -> Row {
    let most = cast::to_usize((width / NARROWEST).max(1.0));
    let per_bar = view.frames.len().div_ceil(most).max(1);
    let rate = |frames: &[Frame]| {
        let messages: u64 = frames.iter().fold(0, |n, f| n.saturating_add(f.messages));
        let nanos: f64 = frames.iter().map(|f| f.span.nanos() as f64).sum();
        messages as f64 * 1e9 / nanos.max(1.0)
    };
    let busiest = view.frames.chunks(per_bar).map(rate).fold(0.0, f64::max);
    let bars = view.frames.chunks(per_bar).filter_map(|frames| {
        let (first, last) = (frames.first()?, frames.last()?);
        let span = Span::new(first.span.start, last.span.end);
        (busiest > 0.0).then(|| SendingBar::new(span, rate(frames) / busiest))
    });
    Row {
        labels: vec!["messages/s".to_owned()],
        bars: bars.collect(),
        ..Row::default()
    }
}
