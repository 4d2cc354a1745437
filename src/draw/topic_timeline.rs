//! The topic timeline: the picture of a mission with few known publishers. Rows are topics over the whole
//! time, with types and current rates; a playhead marks the window of a frame; nodes are labels below.

use std::collections::BTreeSet;

use crate::base::cast;
use crate::base::geometry::{Rect, Size};
use crate::base::time::Span;
use crate::base::words;
use crate::draw::picture::PageOptions;
use crate::draw::picture::page::{PageFrame, unit};
use crate::draw::picture::title::Title;
use crate::draw::scene::{Form, Group, Piece, Scene, Shape, Stroke};
use crate::draw::style::{Color, Style};
use crate::draw::text::Fonts;
use crate::draw::timeline::band::Axis;
use crate::draw::timeline::canvas::{HAIRLINE, PaperCanvas, Sizes, Type, ink};
use crate::draw::timeline::lives::{LivesFigure, RowPlace};
use crate::draw::timeline::source::FigureSource;
use crate::draw::timeline::tracks::Track;
use crate::graph::{Element, ElementState, NodeId};
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
    lives: LivesFigure<'a>,
    title: Title<'a>,
    sizes: Sizes,
    scale: f64,
    place: RowPlace,
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
        let sizes = Sizes::of_names(7.0);
        if !is_sized {
            options.size.w = options.size.w.min(NARROW);
        }
        let mut lives = LivesFigure::new(source, true).opened();
        if !is_sized && most_rows(&lives, style, &options, fonts) < lives.rows.len() {
            options.size = LARGEST;
        }
        let mut most = most_rows(&lives, style, &options, fonts);
        if most < lives.rows.len() {
            lives = LivesFigure::new(source, true).plain();
            most = most_rows(&lives, style, &options, fonts);
        }
        let left_out = lives.shorten(most, &|track| messages(source, track));
        let page = PageFrame::new(style, &options, 0, true);
        let (place, scale) = placed(&lives, &page, &options, fonts);
        if !is_sized {
            // A short timeline has no empty space below; encoders of video need an even number of rows.
            let canvas = PaperCanvas::new(fonts, sizes, scale);
            let end = (place.top + lives.height(&canvas) + BELOW) * scale;
            options.size.h = (libm::ceil(end / 2.0) * 2.0).min(options.size.h);
        }
        let mission = source.mission;
        let window = |start| mission.windows.partition_point(|w| w.span.start < start);
        let mut timeline = Self {
            title: Title::new(style, fonts, &page, view, &options),
            windows: view.frames.iter().map(|f| window(f.span.start)).collect(),
            ground: Vec::new(),
            view,
            source,
            style,
            fonts,
            options,
            lives,
            sizes,
            scale,
            place,
            left_out,
        };
        timeline.ground = timeline.ground();
        timeline
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
        let mut canvas = self.canvas();
        canvas.begin("past");
        self.lives
            .past(&mut canvas, &self.place, self.source.span().end);
        canvas.begin("names");
        self.lives.names(&mut canvas, &self.place, &|_| true);
        canvas.begin("rates");
        self.rates(&mut canvas, &|track| track.hz.map(words::rate));
        canvas.begin("nodes");
        self.nodes(&mut canvas, &|_| true);
        if !self.options.bare {
            let span = self.source.span();
            let topics = words::count(self.lives.tracks.len(), "topic");
            let mut whole = Frame::empty(0, span);
            whole.messages = self.source.mission.messages;
            whole.note = format!("{topics} over {}", words::duration(span.nanos()));
            scene.groups.extend(self.title.words(&whole, ""));
        }
        scene.groups.extend(self.painted(canvas));
        scene.title = format!("Topics over time of {}", self.options.title());
        let heads = self
            .view
            .frames
            .iter()
            .map(|f| self.head(f.span).scaled(self.scale));
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
        PaperCanvas::new(self.fonts, self.sizes, self.scale)
    }

    /// The parts that are equal in every frame: band, pale bars, starts and ends, types, axis, and the reason
    /// why this is not a graph.
    fn ground(&self) -> Vec<Group> {
        let mut canvas = self.canvas();
        let end = self.lives.draw(&mut canvas, &self.place);
        canvas.begin("why");
        let y = end + LABEL + 1.6 + self.sizes.line() / 2.0;
        let wide = self.options.size.w / self.scale - 2.0 * self.place.left;
        let text = canvas.cut(&self.why(), Type::Small, wide);
        canvas.text(self.place.left, y, Type::Small, ink::QUIET, &text);
        let mut groups = Vec::new();
        if !self.options.bare {
            groups.push(self.title.ground());
        }
        groups.extend(self.painted(canvas));
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
        let count = |track: &Track| {
            let topic = Element::Topic(track.topic?);
            graph.as_ref()?.get(topic).map(ElementState::messages)
        };
        let mut canvas = self.canvas();
        canvas.begin("past");
        self.lives.past(&mut canvas, &self.place, span.end);
        canvas.begin("names");
        self.lives
            .names(&mut canvas, &self.place, &|t| count(t).unwrap_or(0) > 0);
        canvas.begin("rates");
        self.rates(&mut canvas, &|track| {
            let count = count(track).filter(|n| *n > 0)?;
            Some(words::rate_of(count, seconds))
        });
        canvas.begin("nodes");
        let alive: BTreeSet<NodeId> = graph
            .iter()
            .flat_map(|g| g.nodes().map(|(id, _)| id))
            .collect();
        self.nodes(&mut canvas, &|nodes| {
            nodes.iter().any(|n| alive.contains(n))
        });
        let mut groups = self.painted(canvas);
        let mut head = Group::named("playhead");
        let form = Form::Rect(self.head(span).scaled(self.scale), 2.0);
        head.shape(Shape::line(
            form,
            Stroke::solid(self.style.timeline.head, 1.5),
        ));
        groups.push(head);
        groups
    }

    fn rates(&self, canvas: &mut PaperCanvas<'_>, reported: &dyn Fn(&Track) -> Option<String>) {
        let right = self.place.axis.right + RATES;
        for (y, track, ..) in self.lives.lines(canvas, &self.place) {
            let (color, text) = match reported(track) {
                Some(text) => (ink::TEXT, text),
                None => (ink::QUIET, "–".to_owned()),
            };
            canvas.text_end(right, y, Type::Small, color, &text);
        }
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
        let y = self.lives.bottom(canvas, &self.place) + self.sizes.line() + 2.0 + LABEL / 2.0;
        canvas.text(self.place.left, y, Type::Small, ink::QUIET, "nodes known");
        let mut x = self.place.axis.left;
        let end = self.options.size.w / self.scale - self.place.left;
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

    /// The frame around the time of a window, in millimetres.
    fn head(&self, span: Span) -> Rect {
        let place = &self.place;
        let (left, right) = (place.axis.x(span.start), place.axis.x(span.end));
        let top = self.lives.top(place) - 0.4;
        let bottom = self.lives.bottom(&self.canvas(), place);
        Rect::new(left, top, (right - left).max(0.3), bottom - top)
    }

    /// The groups of a canvas in the colours of the style.
    fn painted(&self, canvas: PaperCanvas<'_>) -> Vec<Group> {
        let mut groups = canvas.into_groups();
        for piece in groups.iter_mut().flat_map(|g| &mut g.pieces) {
            match piece {
                Piece::Shape(Shape { fill, stroke, .. }) => {
                    *fill = self.color(*fill);
                    stroke.color = self.color(stroke.color);
                }
                Piece::Text(text) => text.color = self.color(text.color),
            }
        }
        groups
    }

    /// The style's colour for a colour of figures, which are on white paper.
    fn color(&self, of: Color) -> Color {
        let style = self.style;
        let table = [
            (ink::PAPER, style.page.background),
            (ink::TEXT, style.page.text),
            (ink::QUIET, style.page.quiet),
            (ink::BAR, style.timeline.past),
            (ink::FOLDED, style.timeline.future),
            (ink::LINE, style.timeline.axis),
            (ink::RULE, style.timeline.axis),
            (ink::TINT, style.cluster.fill),
            (ink::BAND[0], style.timeline.future),
            (ink::BAND[1], style.legend.fill),
            (ink::ADDED, style.added.color),
            (ink::REMOVED, style.removed.color),
            (ink::CHANGED, style.changed.color),
        ];
        let found = table.iter().find(|(ink, _)| *ink == of);
        found.map_or(of, |(_, color)| *color)
    }
}

/// The number of messages that the topic of a row carried.
fn messages(source: &FigureSource<'_>, track: &Track) -> u64 {
    let Some(topic) = track.topic else { return 0 };
    let rows = source.mission.graphs.rows(Element::Topic(topic));
    rows.map(|(_, row)| row.count.unwrap_or(0)).sum()
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
fn most_rows(
    lives: &LivesFigure<'_>,
    style: &Style,
    options: &PageOptions,
    fonts: &Fonts,
) -> usize {
    let page = PageFrame::new(style, options, 0, true);
    let canvas = PaperCanvas::new(fonts, Sizes::of_names(7.0), SCALE.0);
    let rows = lives.rows.len() as f64 * canvas.sizes.pitch();
    let others = lives.height(&canvas) - rows + BELOW;
    let free = room(&page, options).h / SCALE.0 - others;
    cast::to_usize((free / canvas.sizes.pitch()).max(1.0))
}

/// The positions of all parts in millimetres, and the number of pixels per millimetre.
fn placed(
    lives: &LivesFigure<'_>,
    page: &PageFrame,
    options: &PageOptions,
    fonts: &Fonts,
) -> (RowPlace, f64) {
    let room = room(page, options);
    let canvas = PaperCanvas::new(fonts, Sizes::of_names(7.0), 1.0);
    let high = lives.height(&canvas) + BELOW;
    let largest = SCALE.1 * unit(options).max(1.0);
    let scale = (room.h / high).clamp(SCALE.0, largest);
    let (left, wide) = (room.x / scale, room.w / scale);
    let names = lives.names_width(&canvas, wide * 0.8);
    let types = if wide > 150.0 { TYPES } else { 0.0 };
    let right = left + wide - types - RATES - BETWEEN;
    let place = RowPlace {
        top: room.y / scale,
        left,
        axis: Axis {
            left: left + names,
            right: right.max(left + names + 10.0),
            span: lives.source.span(),
        },
        rates: None,
        talk: (types > 0.0).then_some((left + wide - types + BETWEEN, types - BETWEEN)),
        is_live: true,
    };
    (place, scale)
}
