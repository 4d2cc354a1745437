//! The topic timeline: the picture of a mission with few known publishers. Rows are topics over the whole
//! time, with types and current rates; a playhead marks the window of a frame; nodes are labels below.

use std::collections::BTreeSet;

use crate::base::cast;
use crate::base::geometry::{Rect, Size};
use crate::base::time::Span;
use crate::base::words;
use crate::draw::picture::PageOptions;
use crate::draw::picture::page::{PageFrame, Strip, unit};
use crate::draw::picture::title::Title;
use crate::draw::scene::{Group, Scene, Stroke};
use crate::draw::style::{Color, Style};
use crate::draw::text::Fonts;
use crate::draw::timeline::Timeline;
use crate::draw::timeline::canvas::{HAIRLINE, PaperCanvas, Sizes, Type, ink};
use crate::draw::timeline::drawer::{Axis, Density, Drawer};
use crate::draw::timeline::marks::marked;
use crate::draw::timeline::phases;
use crate::draw::timeline::rows::{Level, Row, of_topics};
use crate::draw::timeline::source::FigureSource;
use crate::graph::{Element, ElementState, NodeId, TopicId};
use crate::view::{Frame, View};

/// The least and the largest number of pixels per millimetre of the drawing, so that small text has at least
/// 9 pixels and text is not larger than titles.
const SCALE: (f64, f64) = (4.26, 5.6);
/// The width of the page if the user chose none: its text is legible in a column of a web page.
const NARROW: f64 = 960.0;
/// The largest page that a timeline grows to if the user chose none.
const LARGEST: Size = Size::new(1920.0, 1080.0);
/// The widths of types and of rates, in millimetres, and the space between columns.
const TYPES: f64 = 58.0;
const RATES: f64 = 15.0;
const BETWEEN: f64 = 2.4;
/// The largest fraction of the width for the names of topics.
const MOST_NAMES: f64 = 0.29;
/// The height below the rows in millimetres, for nodes and for the line that explains why this is not a graph.
const BELOW: f64 = 9.0;
/// The height of a node in millimetres.
const LABEL: f64 = 3.5;

/// A topic timeline ready to be drawn, one scene per window.
pub(crate) struct TopicTimeline<'a> {
    view: &'a View,
    source: &'a FigureSource<'a>,
    style: &'a Style,
    fonts: &'a Fonts,
    options: PageOptions,
    title: Title<'a>,
    /// Pixels per millimetre.
    scale: f64,
    drawer: Drawer,
    /// The window of the mission that each frame shows.
    windows: Vec<usize>,
    ground: Vec<Group>,
    /// The number of topics that have no row because they do not fit.
    left_out: usize,
}

/// The whole timeline in one drawing, and the position of the playhead in each window.
#[derive(Clone, Debug, PartialEq)]
pub struct Overview {
    /// The timeline with all messages, without a playhead.
    pub scene: Scene,
    /// The playhead in pixels, per window.
    pub heads: Vec<Rect>,
    /// The colour of the playhead.
    pub color: Color,
    /// The title of the picture.
    pub title: String,
}

impl<'a> TopicTimeline<'a> {
    /// The timeline of the nodes and topics that pass the filters of `source`. Unless `is_sized`, the page
    /// grows until all topics are legible; topics that still do not fit are counted.
    pub(crate) fn new(
        source: &'a FigureSource<'a>,
        view: &'a View,
        style: &'a Style,
        fonts: &'a Fonts,
        mut options: PageOptions,
        is_sized: bool,
    ) -> Self {
        if !is_sized {
            options.size.w = options.size.w.min(NARROW);
        }
        let rows = marked(source, of_topics(source));
        let rows: Vec<Row> = rows.into_iter().map(Row::plain).collect();
        let timeline = |is_folded| Timeline {
            phases: phases::named(source),
            ..Timeline::by_namespace(source, rows.clone(), is_folded)
        };
        let mut shown = timeline(false);
        if !is_sized && most_rows(&shown, style, &options) < shown.rows.len() {
            options.size = LARGEST;
        }
        let mut most = most_rows(&shown, style, &options);
        if most < shown.rows.len() {
            shown = timeline(true);
            most = most_rows(&shown, style, &options);
        }
        let left_out = shorten(&mut shown, most, source);
        let page = PageFrame::new(style, &options, 0, Strip::Timeline);
        let (drawer, scale) = placed(shown, &page, &options, fonts);
        if !is_sized {
            // A short timeline has no empty space below; encoders of video need an even number of rows.
            let end = drawer.top + drawer.timeline.height(sizes(), drawer.pitch) + BELOW;
            options.size.h = (libm::ceil(end * scale / 2.0) * 2.0).min(options.size.h);
        }
        let mission = source.mission;
        let window = |start| mission.windows.partition_point(|w| w.span.start < start);
        let mut page = Self {
            title: Title::new(style, fonts, &page, view, &options),
            windows: view.frames.iter().map(|f| window(f.span.start)).collect(),
            ground: Vec::new(),
            view,
            source,
            style,
            fonts,
            options,
            drawer,
            scale,
            left_out,
        };
        page.ground = page.ground();
        page
    }

    /// Remarks for the user; lower case, no period.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let many = words::count(self.left_out, "topic");
        let remark = format!(
            "{many} with the fewest messages do not fit; show them with `--topic-filter` or a larger `--size`"
        );
        (self.left_out > 0).then_some(remark).into_iter().collect()
    }

    /// The timeline in window `k` of the view.
    pub(crate) fn scene(&self, k: usize) -> Scene {
        let mut scene = self.empty();
        let Some(frame) = self.view.frames.get(k) else {
            return scene;
        };
        if !self.options.bare {
            let phase = self.options.phases.get(k).map_or("", String::as_str);
            scene.groups.extend(self.title.words(frame, phase));
        }
        let window = self.windows.get(k).copied().unwrap_or(0);
        scene.groups.extend(self.now(window, frame.shown()));
        scene.title = format!(
            "{}, window {} of {}",
            self.options.title(),
            frame.index + 1,
            self.view.frames.len()
        );
        scene
    }

    /// All windows in one drawing.
    pub(crate) fn overview(&self) -> Overview {
        let mut scene = self.empty();
        if !self.options.bare {
            let span = self.source.span();
            let rows = self.drawer.timeline.rows.iter();
            let shown = rows.map(|row| row.folded.len() + usize::from(row.topic.is_some()));
            let topics = words::count(shown.sum::<usize>() + self.left_out, "topic");
            let mut whole = Frame::empty(0, span);
            whole.messages = self.source.mission.messages;
            whole.note = format!("{topics} over {}", words::duration(span.nanos()));
            scene.groups.extend(self.title.words(&whole, ""));
        }
        let mut canvas = self.canvas();
        let rate = |row: &Row| row.hz.map(words::rate);
        self.window(&mut canvas, self.source.span(), &|_| true, &rate, &|_| true);
        scene.groups.extend(canvas.into_styled(self.style));
        scene.groups.extend(self.marks());
        scene.title = format!("Topics over time of {}", self.options.title());
        let heads = self
            .view
            .frames
            .iter()
            .map(|f| self.drawer.window(f.span).scaled(self.scale));
        Overview {
            scene,
            heads: heads.collect(),
            color: self.style.timeline.head,
            title: self.options.title().to_owned(),
        }
    }

    fn empty(&self) -> Scene {
        Scene {
            size: self.options.size,
            width_mm: self.options.width_mm,
            background: self.style.background(),
            title: String::new(),
            groups: self.ground.clone(),
        }
    }

    fn canvas(&self) -> PaperCanvas<'a> {
        PaperCanvas::new(self.fonts, sizes(), self.scale)
    }

    /// The parts that are equal in every frame: band, pale bars, starts and ends, types, axis, and the reason
    /// why this is not a graph.
    fn ground(&self) -> Vec<Group> {
        let mut canvas = self.canvas();
        let end = self.drawer.ground(&mut canvas);
        canvas.begin("why");
        let y = end + LABEL + 1.6 + sizes().line() / 2.0;
        let wide = self.options.size.w / self.scale - 2.0 * self.drawer.left;
        let text = canvas.cut(&self.why(), Type::Small, wide);
        canvas.text(self.drawer.left, y, Type::Small, ink::QUIET, &text);
        let mut groups = Vec::new();
        if !self.options.bare {
            groups.push(self.title.ground());
        }
        groups.extend(canvas.into_styled(self.style));
        groups
    }

    /// The reason why this is not a graph, and how to get one.
    fn why(&self) -> String {
        let elements = &self.source.mission.elements;
        let why = if self.source.knows_publishers() {
            "a timeline of topics; --mode all draws the graph".to_owned()
        } else if elements.publishes.is_empty() {
            "the bag names no publishers; add them with --topology FILE; bagreel info says how to record them".to_owned()
        } else {
            "most publishers are unknown; add them with --topology FILE, or draw what is known with --mode all".to_owned()
        };
        let left_out = match self.left_out {
            0 => String::new(),
            more => format!("{} more not drawn; ", words::count(more, "topic")),
        };
        format!("{left_out}{why}. Tick: first message; cross: last; frame: this window.")
    }

    /// The parts that change from frame to frame.
    fn now(&self, window: usize, span: Span) -> Vec<Group> {
        let mission = self.source.mission;
        let graph = mission.graphs.get(window);
        let seconds = mission
            .windows
            .get(window)
            .map_or(0.0, |w| w.span.nanos() as f64 / 1e9);
        let count = |row: &Row| {
            let topic = Element::Topic(row.topic?);
            graph.as_ref()?.get(topic).map(ElementState::messages)
        };
        let rate = |row: &Row| {
            let count = count(row).filter(|n| *n > 0)?;
            Some(words::rate_of(count, seconds))
        };
        let nodes = graph.iter().flat_map(|g| g.nodes().map(|(id, _)| id));
        let alive: BTreeSet<NodeId> = nodes.collect();
        let is_there = |nodes: &[NodeId]| nodes.iter().any(|n| alive.contains(n));
        let mut canvas = self.canvas();
        let is_now = |row: &Row| count(row).unwrap_or(0) > 0;
        self.window(&mut canvas, span, &is_now, &rate, &is_there);
        let mut groups = canvas.into_styled(self.style);
        groups.extend(self.marks());
        groups.push(self.drawer.playhead(span, self.scale, self.style));
        groups
    }

    /// Draws what depends on the window: bars and names, rates, and nodes.
    fn window(
        &self,
        canvas: &mut PaperCanvas<'_>,
        span: Span,
        is_now: &dyn Fn(&Row) -> bool,
        rate: &dyn Fn(&Row) -> Option<String>,
        is_there: &dyn Fn(&[NodeId]) -> bool,
    ) {
        self.drawer.now(canvas, span, is_now);
        canvas.begin("rates");
        for (k, row) in self.drawer.timeline.rows.iter().enumerate() {
            let (y, rate) = (self.drawer.y(k), rate(row));
            match rate {
                Some(rate) => self.drawer.rate(canvas, y, &rate, ink::TEXT),
                None if row.topic.is_some() => self.drawer.rate(canvas, y, "–", ink::QUIET),
                None => {}
            }
        }
        canvas.begin("nodes");
        self.nodes(canvas, is_there);
    }

    fn marks(&self) -> Vec<Group> {
        let mut canvas = self.canvas();
        self.drawer.marks(&mut canvas);
        canvas.into_styled(self.style)
    }

    /// Draws as many of the known nodes as fit, as labels in a row; those for which `is_there` is true are
    /// emphasized.
    fn nodes(&self, canvas: &mut PaperCanvas<'_>, is_there: &dyn Fn(&[NodeId]) -> bool) {
        let elements = &self.source.mission.elements;
        let is_known = |id: &NodeId| {
            let node = elements.nodes.get(*id);
            node.is_some_and(|n| !n.seen.evidence.is_guess())
        };
        let roles = self.source.roles.iter();
        let all: Vec<_> = roles.filter(|(_, n)| n.iter().any(is_known)).collect();
        if all.is_empty() {
            return;
        }
        let y = self.drawer.end() + sizes().line() + 2.0 + LABEL / 2.0;
        canvas.text(self.drawer.left, y, Type::Small, ink::QUIET, "nodes known");
        let mut x = self.drawer.axis.left;
        let end = self.options.size.w / self.scale - self.drawer.left;
        for (k, &(role, nodes)) in all.iter().enumerate() {
            let wide = canvas.width(role, Type::Small) + 2.4;
            let more = format!("+{}", all.len() - k);
            let rest = if k + 1 < all.len() { 8.0 } else { 0.0 };
            if x + wide + rest > end {
                canvas.text(x, y, Type::Small, ink::QUIET, &more);
                return;
            }
            let (fill, color) = if is_there(nodes) {
                (ink::BAND[1], ink::TEXT)
            } else {
                (ink::PAPER, ink::QUIET)
            };
            let place = Rect::new(x, y - LABEL / 2.0, wide, LABEL);
            canvas.frame(
                place,
                LABEL / 2.0,
                fill,
                &Stroke::solid(ink::RULE, HAIRLINE),
            );
            canvas.text(x + 1.2, y, Type::Small, color, role);
            x += wide + 1.4;
        }
    }
}

fn sizes() -> Sizes {
    Sizes::of_names(7.0)
}

/// Keeps the rows of the busiest topics, at most `most` rows; returns the number of topics left out.
fn shorten(timeline: &mut Timeline, most: usize, source: &FigureSource<'_>) -> usize {
    let messages = |topic: &TopicId| -> u64 {
        let rows = source.mission.graphs.rows(Element::Topic(*topic));
        rows.map(|(_, row)| row.count.unwrap_or(0)).sum()
    };
    let rows = &mut timeline.rows;
    let mut order: Vec<TopicId> = rows.iter().filter_map(|row| row.topic).collect();
    order.sort_by_cached_key(|topic| std::cmp::Reverse(messages(topic)));
    let mut left = 0;
    while rows.len() > most {
        let least = order.pop();
        let is_least = |row: &Row| row.topic.is_some() && row.topic == least;
        let Some(at) = rows.iter().position(is_least) else {
            break;
        };
        rows.remove(at);
        left += 1;
        // The title of a namespace whose last row this was.
        let is_last = rows.get(at).is_none_or(|row| row.level != Level::Inside);
        if is_last && at > 0 && rows[at - 1].level == Level::Title {
            rows.remove(at - 1);
        }
    }
    left
}

/// The part of the page for the timeline.
fn room(page: &PageFrame, options: &PageOptions) -> Rect {
    let margin = page.graph.x;
    let top = page.title.bottom().max(margin / 2.0) + margin / 2.0;
    let size = options.size;
    Rect::new(
        margin,
        top,
        size.w - 2.0 * margin,
        (size.h - top - margin / 2.0).max(1.0),
    )
}

/// The number of rows that are legible on this page.
fn most_rows(timeline: &Timeline, style: &Style, options: &PageOptions) -> usize {
    let page = PageFrame::new(style, options, 0, Strip::Timeline);
    let pitch = sizes().pitch();
    let others = timeline.height(sizes(), pitch) - timeline.rows.len() as f64 * pitch + BELOW;
    let free = room(&page, options).h / SCALE.0 - others;
    cast::to_usize((free / pitch).max(1.0))
}

/// The timeline at its place, and the number of pixels per millimetre.
fn placed(
    timeline: Timeline,
    page: &PageFrame,
    options: &PageOptions,
    fonts: &Fonts,
) -> (Drawer, f64) {
    let room = room(page, options);
    let canvas = PaperCanvas::new(fonts, sizes(), 1.0);
    let pitch = sizes().pitch();
    let high = timeline.height(sizes(), pitch) + BELOW;
    let largest = SCALE.1 * unit(options).max(1.0);
    let scale = (room.h / high).clamp(SCALE.0, largest);
    let (left, wide) = (room.x / scale, room.w / scale);
    let names = timeline.names_width(&canvas, Type::Name, wide * MOST_NAMES);
    let types = if wide > 150.0 { TYPES } else { 0.0 };
    let right = (left + wide - types - RATES - BETWEEN).max(left + names + 10.0);
    let drawer = Drawer {
        density: Density::Page,
        top: room.y / scale,
        left,
        axis: Axis {
            left: left + names,
            right,
            span: timeline.span,
        },
        pitch,
        rates: Some(right + RATES),
        beside: (types > 0.0).then_some((left + wide - types + BETWEEN, types - BETWEEN)),
        timeline,
    };
    (drawer, scale)
}
