//! The topic timeline: the picture of a mission with few known publishers. Rows are topics over the whole
//! time, with types and current rates; a playhead marks the window of a frame; nodes are labels below.

use std::collections::{BTreeMap, BTreeSet};

use super::picture::{PageFrame, Strip, unit};
use super::timeline::FigureSource;
use super::timeline::rows::{by_namespace, numbered, together};
use crate::base::geometry::{Rect, Size};
use crate::base::{cast, words};
use crate::draw::picture::PageOptions;
use crate::draw::picture::title::Title;
use crate::draw::scene::Scene;
use crate::draw::style::{Color, Style};
use crate::draw::text::Fonts;
use crate::draw::timeline::Timeline;
use crate::draw::timeline::canvas::{PaperCanvas, Sizes, Type, ink};
use crate::draw::timeline::drawer::{Density, Drawer, fitting};
use crate::draw::timeline::rows::{Row, of_topics};
use crate::graph::{Element, ElementState, NodeId};
use crate::mission::event_log::Kind;
use crate::view::{Frame, View, headline};

/// The least and the largest number of pixels per millimetre of the drawing, so that small text has at least
/// 9 pixels and text is not larger than titles.
const SCALE: (f64, f64) = (4.26, 5.6);
/// The width of the page if the user chose none: its text is legible in a column of a web page.
const NARROW: f64 = 960.0;
/// The height below the rows in millimetres, for nodes and for the line that explains why this is not a graph.
const BELOW: f64 = 9.0;
/// The height of the line of nodes in millimetres.
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
    /// The number of topics.
    topics: usize,
}

/// The whole timeline in one drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Overview {
    /// The timeline with all messages, without a playhead.
    pub scene: Scene,
    /// The title of the picture.
    pub title: String,
}

impl<'a> TopicTimeline<'a> {
    /// The timeline of the nodes and topics that pass the filters of `source`. The page is as high as its rows, and grows
    /// to `largest` unless all topics are legible; without one, it has the size that the user chose. If they still do not
    /// fit, those of a namespace that exist throughout are one row, else all that begin and end together.
    pub(crate) fn new(
        source: &'a FigureSource<'a>,
        view: &'a View,
        style: &'a Style,
        fonts: &'a Fonts,
        mut options: PageOptions,
        largest: Option<Size>,
    ) -> Self {
        let rows: Vec<Row> = of_topics(source).into_iter().map(Row::plain).collect();
        let (topics, pitch) = (rows.len(), Sizes::SCREEN.pitch());
        let rows = numbered(rows, source.span());
        let each = |is_folded| by_namespace(rows.clone(), source.span(), is_folded);
        let mut timeline = Timeline::named(source, each(false));
        let others = timeline.height(Sizes::SCREEN, 0.0) + BELOW;
        let most = |options: &PageOptions| {
            let free = room(style, options).h / SCALE.0 - others;
            cast::to_usize((free / pitch).max(1.0))
        };
        if let Some(largest) = largest {
            options.size.w = options.size.w.min(NARROW);
            if most(&options) < timeline.rows.len() {
                options.size = largest;
            }
        }
        let most = most(&options);
        if timeline.rows.len() > most {
            timeline.rows = each(true);
        }
        if timeline.rows.len() > most {
            timeline.rows = together(source, rows, most, true);
        }
        let room = room(style, &options);
        let high = others + timeline.rows.len() as f64 * pitch;
        let scale = (room.h / high).clamp(SCALE.0, SCALE.1 * unit(&options).max(1.0));
        let page = PageFrame::new(style, &options, 0, Strip::Timeline);
        if largest.is_some() {
            // A short timeline has no empty space below; encoders of video need an even number of rows.
            let end = libm::ceil(f64::midpoint(room.y, high * scale)) * 2.0;
            options.size.h = end.min(options.size.h);
        }
        let canvas = PaperCanvas::new(fonts, Sizes::SCREEN, scale);
        let drawer = Drawer::new(timeline, Density::Page, &canvas, room.scaled(1.0 / scale));
        Self {
            title: Title::new(style, fonts, &page, view, &options),
            view,
            source,
            style,
            fonts,
            options,
            scale,
            drawer,
            topics,
        }
    }

    /// The timeline in window `k` of the view; the only one is the whole mission.
    pub(crate) fn scene(&self, k: usize) -> Scene {
        let many = self.view.frames.len();
        if many == 1 {
            return self.overview().scene;
        }
        let phase = self.options.phases.get(k).map_or("", String::as_str);
        let page = self.view.frames.get(k);
        let page = page.map(|frame| self.page(frame, phase, true));
        Scene {
            title: format!("{}, window {} of {many}", self.options.title(), k + 1),
            ..page.unwrap_or_default()
        }
    }

    /// All windows in one drawing.
    pub(crate) fn overview(&self) -> Overview {
        let mut whole = Frame::empty(0, self.source.span());
        whole.messages = self.source.mission.messages;
        whole.caption = headline(self.source.mission, words::count(self.topics, "topic"));
        Overview {
            scene: Scene {
                title: format!("Topics over time of {}", self.options.title()),
                ..self.page(&whole, "", false)
            },
            title: self.options.title().to_owned(),
        }
    }

    /// The page of a window, or of the whole time, with its rates and nodes.
    fn page(&self, frame: &Frame, phase: &str, is_window: bool) -> Scene {
        let (mission, time) = (self.source.mission, frame.shown());
        let windows = &mission.windows;
        let at = windows.partition_point(|w| w.span.start < frame.span.start);
        let graph = mission.graphs.get(at).filter(|_| is_window);
        let seconds = windows.get(at).map_or(0.0, |w| w.span.nanos() as f64 / 1e9);
        let count = |row: &Row| {
            let state = graph.as_ref()?.get(Element::Topic(row.topic?));
            state.map(ElementState::messages).filter(|count| *count > 0)
        };
        let mut canvas = PaperCanvas::new(self.fonts, Sizes::SCREEN, self.scale);
        let end = self.drawer.ground(&mut canvas);
        let is_now = |row: &Row| match row.topic {
            Some(_) => !is_window || count(row).is_some(),
            None => row.is_in(time),
        };
        self.drawer.now(&mut canvas, time, &is_now);
        self.drawer.marks(&mut canvas);
        canvas.begin("rates");
        let rows = self.drawer.timeline.rows.iter().enumerate();
        for (k, row) in rows.filter(|(_, row)| row.topic.is_some()) {
            let rate = if is_window {
                count(row).map(|count| words::rate_of(count, seconds))
            } else {
                Some(row.rates())
            };
            let rate = rate.as_deref().map(|rate| (rate, ink::TEXT));
            let (text, color) = rate.unwrap_or(("–", ink::QUIET));
            self.drawer.rate(&mut canvas, self.drawer.y(k), text, color);
        }
        canvas.begin("nodes");
        let alive = graph.iter().flat_map(|g| g.nodes().map(|(id, _)| id));
        let alive: BTreeSet<NodeId> = alive.collect();
        self.nodes(&mut canvas, frame, &|id| !is_window || alive.contains(id));
        canvas.begin("why");
        let wide = self.options.size.w / self.scale - 2.0 * self.drawer.left;
        let why = self.why();
        let window = if is_window {
            "; frame: this window"
        } else {
            ""
        };
        let signs = format!("{why}. Tick: first message; cross: last{window}.");
        let (reason, _) = why.split_once("; ").unwrap_or((why, ""));
        let texts = [&signs, why, reason].into_iter();
        let mut texts = texts.filter(|text| canvas.width(text, Type::Small) <= wide);
        let why = texts.next().unwrap_or_default();
        let y = end + LABEL + 1.6 + Sizes::SCREEN.line() / 2.0;
        canvas.text(self.drawer.left, y, Type::Small, ink::QUIET, why);
        let mut groups = Vec::new();
        if !self.options.bare {
            groups.push(self.title.ground());
            groups.extend(self.title.words(frame, phase));
        }
        groups.extend(canvas.into_styled(self.style));
        if is_window {
            groups.push(self.drawer.playhead(time, self.scale, self.style));
        }
        Scene {
            size: self.options.size,
            width_mm: self.options.width_mm,
            background: self.style.background(),
            title: String::new(),
            groups,
        }
    }

    /// The reason why this is not a graph, and how to get one.
    fn why(&self) -> &'static str {
        if self.source.knows_publishers() {
            "a timeline of topics; --mode all draws the graph"
        } else if self.source.mission.elements.publishes.is_empty() {
            "the bag names no publishers; add them with --topology FILE; bagreel info says how to record them"
        } else {
            "most publishers are unknown; add them with --topology FILE, or draw what is known with --mode all"
        }
    }

    /// Writes as many of the known nodes as fit: those that start, stop or restart in this window in colour, then those that
    /// are there.
    fn nodes(
        &self,
        canvas: &mut PaperCanvas<'_>,
        frame: &Frame,
        is_there: &dyn Fn(&NodeId) -> bool,
    ) {
        let elements = &self.source.mission.elements;
        let is_known = |id: &NodeId| !elements.seen(Element::Node(*id)).evidence.is_guess();
        let news = self.source.mission.log.headlines(frame.span);
        let news = news.filter_map(|(_, event)| {
            let color = match event.kind {
                Kind::Started => ink::ADDED,
                Kind::Stopped => ink::REMOVED,
                Kind::Restarted => ink::CHANGED,
                _ => return None,
            };
            Some((event.what, color))
        });
        let news: BTreeMap<Element, Color> = news.collect();
        let color = |id: &NodeId| {
            let new = news.get(&Element::Node(*id)).copied();
            new.or_else(|| (is_known(id) && is_there(id)).then_some(ink::TEXT))
        };
        let (left, title) = (self.drawer.left, "nodes known");
        let after = left + canvas.width(title, Type::Small) + 1.2;
        let begin = self.drawer.axis.left.max(after);
        let mut x = begin;
        let end = self.options.size.w / self.scale - left;
        let y = self.drawer.end() + Sizes::SCREEN.line() + 2.0 + LABEL / 2.0;
        let groups = [ink::ADDED, ink::REMOVED, ink::CHANGED, ink::TEXT].map(|own| {
            let roles = self.source.roles.iter();
            let roles = roles.filter(|(_, nodes)| nodes.iter().find_map(color) == Some(own));
            let names: Vec<String> = roles.map(|(role, _)| role.to_string()).collect();
            (own, names)
        });
        let mut groups = groups.iter().filter(|(_, names)| !names.is_empty());
        while let Some((own, names)) = groups.next() {
            // Each later colour has at least the number of its nodes.
            let later = groups.clone().count() as f64 * (canvas.width("+99", Type::Small) + 1.2);
            let fits = |text: &str| canvas.width(text, Type::Small) <= end - later - x;
            let mut text = fitting(names, names.len(), fits);
            if !fits(&text) {
                text = format!("+{}", names.len());
            }
            if x <= begin {
                canvas.text(left, y, Type::Small, ink::QUIET, title);
            }
            canvas.text(x, y, Type::Small, *own, &text);
            x += canvas.width(&text, Type::Small) + 1.2;
        }
    }
}

/// The part of the page for the timeline.
fn room(style: &Style, options: &PageOptions) -> Rect {
    let page = PageFrame::new(style, options, 0, Strip::Timeline);
    let (margin, size) = (page.graph.x, options.size);
    let top = page.title.bottom().max(margin / 2.0) + margin / 2.0;
    let height = (size.h - top - margin / 2.0).max(1.0);
    Rect::new(margin, top, size.w - 2.0 * margin, height)
}
