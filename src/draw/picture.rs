//! The picture: a view, a layout and a style become one scene per window, with fixed positions.

mod arrows;
mod badge;
mod boxes;
mod gates;
mod legend;
mod measured;
pub(crate) mod options;
mod room;
pub(crate) mod spaces;
mod texts;
pub(crate) mod title;
mod union;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::scene::{Group, Piece, Scene};
use super::style::Style;
use super::text::Fonts;
use super::timeline::Timeline;
use super::timeline::below::{Below, BelowSizes};
use crate::base::geometry::{Point, Rect, Size};
use crate::graph::Id as _;
use crate::layout::{self, Layout, Orientation, Plan};
use crate::view::{ArrowId, ArrowKind, Frame, ItemId, SeenWindow, View};
use arrows::ArrowPath;
use boxes::ItemBox;
use gates::Gate;
pub(crate) use legend::{LegendSign, signs};
use measured::{MeasuredGraph, find};
use options::Spotlight;
pub use texts::unshown;
use texts::{arrow_id, encoded, item_id};
pub(crate) use texts::{change_counts, short_name};
use title::Title;
pub use union::{Union, UnionElement, rate_label, sign};

/// The user's options of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct PageOptions {
    /// The page in pixels.
    pub size: Size,
    /// The page's width on paper in millimetres, for vector output.
    pub width_mm: Option<f64>,
    /// The graph alone, without title, caption, legend and timeline.
    pub bare: bool,
    /// The title, if not the names of the bags.
    pub title: Option<String>,
    /// The direction in which the edges run; `None` for the one that fits better.
    pub orientation: Option<Orientation>,
    /// The mission's phase in each window, by index of the view's frames; empty for none.
    pub phases: Vec<String>,
    /// The scale of title, legend and timeline; by the size of the page if `None`.
    pub unit: Option<f64>,
    /// The largest scale of the graph, so that its text has an exact size on paper; by `unit` if `None`.
    pub largest: Option<f64>,
    /// Whether there is a legend of the signs.
    pub has_legend: bool,
    /// The phases and rows of the timeline at the bottom; without rows it shows messages per second.
    pub timeline: Timeline,
    /// The least relative change of a rate that is reported, for the legend.
    pub rate_change: f64,
}

impl Default for PageOptions {
    fn default() -> Self {
        Self {
            size: Size::new(1280.0, 720.0),
            width_mm: None,
            bare: false,
            title: None,
            orientation: None,
            phases: Vec::new(),
            unit: None,
            largest: None,
            has_legend: true,
            timeline: Timeline::default(),
            rate_change: 0.25,
        }
    }
}

impl PageOptions {
    /// The strip at the bottom of a picture of this view.
    pub(crate) fn strip(&self, view: &View) -> Strip {
        if view.has_time() {
            Strip::Timeline
        } else if view.is_still() && !self.timeline.phases.is_empty() {
            Strip::Phases
        } else {
            Strip::Nothing
        }
    }

    /// The title of the page; empty if none is given.
    pub(crate) fn title(&self) -> &str {
        self.title.as_deref().unwrap_or_default()
    }
}

/// The labels and sizes of a view, measured for layout, with the page: the stage before [`Picture`].
pub struct Measured<'a> {
    view: &'a View,
    style: &'a Style,
    fonts: &'a Fonts,
    options: PageOptions,
    graph: MeasuredGraph,
    legend: Vec<Vec<(legend::LegendSign, String, f64)>>,
    page: PageFrame,
}

impl<'a> Measured<'a> {
    /// Labels, sizes and namespaces of a view, and the parts of the page.
    pub fn new(view: &'a View, style: &'a Style, fonts: &'a Fonts, options: PageOptions) -> Self {
        let graph = MeasuredGraph::new(view, style, fonts);
        let signs = legend::signs(view, options.rate_change);
        let unit = unit(&options);
        let legend = if options.has_legend {
            legend::rows(&signs, style, fonts, unit, options.size.w)
        } else {
            Vec::new()
        };
        let page = PageFrame::new(style, &options, legend.len(), options.strip(view));
        Self {
            view,
            style,
            fonts,
            options,
            graph,
            legend,
            page,
        }
    }

    /// The plan to lay out: a vertex per item, a link per arrow, a cluster per namespace with a box.
    pub fn plan(&self) -> &Plan {
        &self.graph.plan
    }

    /// The legend, equal in every frame, and its place on the page.
    pub(crate) fn legend(&self) -> (Group, Rect) {
        let legend = legend::legend(&self.legend, self.style, &self.page);
        (legend, self.page.legend)
    }

    /// The options for the layout engine that follow from the page.
    pub fn layout_options(&self) -> layout::LayoutOptions {
        layout::LayoutOptions {
            page: Size::new(self.page.graph.w, self.page.graph.h),
            orientation: self.options.orientation,
            ..layout::LayoutOptions::default()
        }
    }

    /// The smallest text of the graph in pixels if it is laid out like this.
    pub fn text_px(&self, layout: &Layout) -> f64 {
        self.smallest_text() * self.scale(layout)
    }

    /// The smallest text of the graph at its natural size, in pixels.
    pub(crate) fn smallest_text(&self) -> f64 {
        let (style, graph) = (self.style, &self.graph);
        let mut smallest = style.topic.size.min(style.node.size);
        let is_labelled = graph.plan.links.iter().any(|link| link.label.is_some());
        if is_labelled || !graph.footers.is_empty() {
            smallest = smallest.min(style.edge.size);
        }
        if graph.labels.iter().any(|l| l.second) || !self.view.rows.is_empty() {
            smallest = smallest.min(style.node.small).min(style.topic.small);
        }
        smallest
    }

    /// The scale of the graph if it is laid out like this.
    pub(crate) fn scale(&self, layout: &Layout) -> f64 {
        self.page.fit(layout.size).scale
    }

    /// The picture with this layout, which must be one of [`Measured::plan`].
    pub fn with(self, layout: Layout) -> Picture<'a> {
        let (view, style, fonts, page) = (self.view, self.style, self.fonts, &self.page);
        let fit = page.fit(layout.size);
        let (cards, tracks, shifts) = places(&self, &layout, fit);
        let mut order: Vec<ArrowId> = view.arrows.ids().collect();
        let is_publish = |id: ArrowId| view.arrows[id].kind == ArrowKind::Publish;
        order.sort_by(|&a, &b| {
            let length = tracks[b.at()].length.total_cmp(&tracks[a.at()].length);
            is_publish(a)
                .cmp(&is_publish(b))
                .then(length)
                .then(a.cmp(&b))
        });
        let gates = self.graph.gates.iter().filter_map(|(gate, names)| {
            let mut path = gate.path(view, &tracks[gate.lead.at()], &layout, fit)?;
            path.topics.clone_from(names);
            Some((gate.clone(), path))
        });
        let sizes = below(style, &self.options, self.options.strip(view));
        let timeline = self.options.timeline.clone();
        let mut picture = Picture {
            gates: gates.collect(),
            shifts,
            cards,
            tracks,
            order,
            title: Title::new(style, fonts, page, view, &self.options),
            timeline: Below::new(sizes, fonts, page.timeline, view, timeline),
            ground: Vec::new(),
            measured: self,
            layout,
            fit,
        };
        picture.ground = picture.ground();
        picture
    }
}

/// A sequence of scenes. It may be shared among threads.
pub struct Picture<'a> {
    measured: Measured<'a>,
    layout: Layout,
    fit: GraphFit,
    /// The constant parts of each item, then those of each arrow.
    cards: Vec<ItemBox>,
    tracks: Vec<ArrowPath>,
    /// The lines of namespaces that are drawn as one.
    gates: Vec<(Gate, ArrowPath)>,
    /// The distance of each namespace's title from the top left of its frame, so that no line crosses it.
    shifts: Vec<Point>,
    /// The arrows in the order they are painted: longer ones first, so that rates on short ones stay readable.
    order: Vec<ArrowId>,
    title: Title<'a>,
    timeline: Below<'a>,
    /// The groups that are equal in every frame, behind the graph and the moving parts.
    ground: Vec<Group>,
}

impl Picture<'_> {
    /// The number of frames: one per window.
    pub fn len(&self) -> usize {
        self.measured.view.frames.len()
    }

    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The plan of its layout.
    pub fn plan(&self) -> &Plan {
        self.measured.plan()
    }

    /// All positions, in the layout's own pixels.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The name of the phase of window `k`, if phases have names.
    pub fn phase(&self, k: usize) -> Option<&str> {
        self.measured.options.phases.get(k).map(String::as_str)
    }

    /// The smallest text of the graph in pixels.
    pub fn text_px(&self) -> f64 {
        self.measured.text_px(&self.layout)
    }

    /// The scene of window `k` of the view, without a transition. An empty page past the last one.
    pub fn scene(&self, k: usize) -> Scene {
        let measured = &self.measured;
        let mut scene = Scene {
            size: measured.options.size,
            width_mm: measured.options.width_mm,
            background: measured.style.background(),
            title: String::new(),
            groups: self.ground.clone(),
        };
        let Some(frame) = measured.view.frames.get(k) else {
            return scene;
        };
        self.graph((k, frame), &measured.view.seen(k), &mut scene.groups);
        if !measured.options.bare {
            self.decorations(k, frame, &mut scene.groups);
        }
        measured.options.title().clone_into(&mut scene.title);
        if !measured.view.compares {
            let (window, all) = (frame.index + 1, self.len());
            scene.title = format!("{}, window {window} of {all}", scene.title);
        }
        if !frame.caption.is_empty() {
            scene.title = format!("{}: {}", scene.title, frame.words(usize::MAX));
        }
        scene
    }

    fn ground(&self) -> Vec<Group> {
        let measured = &self.measured;
        let mut groups = Vec::new();
        if !measured.options.bare {
            groups.push(self.title.ground());
            if measured.options.has_legend {
                groups.push(measured.legend().0);
            }
            if measured.options.strip(measured.view) != Strip::Nothing {
                groups.extend(self.timeline.ground());
            }
        }
        groups
    }

    fn decorations(&self, k: usize, frame: &Frame, groups: &mut Vec<Group>) {
        // The timeline names the phase, if there is one.
        let is_named = !self.measured.options.timeline.phases.is_empty();
        let has_time = self.measured.view.has_time();
        let phase = self.phase(k).filter(|_| !is_named || !has_time);
        groups.extend(self.title.words(frame, phase.unwrap_or("")));
        if has_time {
            groups.extend(self.timeline.head(frame));
        }
    }

    fn graph(&self, (k, frame): (usize, &Frame), seen: &SeenWindow, groups: &mut Vec<Group>) {
        let view = self.measured.view;
        let pen = self.pen();
        let full = view.inhabited(seen);
        let spotlight = Spotlight::new(&self.measured, (k, frame), seen);
        let pale = |mut group: Group| {
            if let Some(spotlight) = &spotlight {
                spotlight.pale(&mut group);
            }
            group
        };
        let spaces = self.measured.graph.spaces.iter().zip(&self.layout.clusters);
        let mut titles = Vec::new();
        let mut member_lists = frame.member_lists.iter().peekable();
        for (at, (space, place)) in spaces.enumerate() {
            let id = encoded(&space.name);
            let who = member_lists.next_if(|_| !space.replicas.is_empty());
            let member_list =
                who.map(|who| pen.member_list(space, *place, self.shifts[at], &id, who));
            let empty = (!full[at]).then(|| {
                if self.measured.graph.first_seen[at] > frame.index {
                    "not on yet"
                } else {
                    "off"
                }
            });
            let mut space = pen.space(space, *place, &id, empty);
            titles.push(pen.title_of(&mut space, self.shifts[at]));
            titles.extend(member_list.filter(|member_list| !member_list.pieces.is_empty()));
            groups.push(space);
        }
        for (footer, also) in self.measured.graph.footers.iter().zip(&view.also) {
            let place = match footer.cluster {
                Some(at) => self.layout.clusters.get(at),
                None => self.layout.boxes.get(view.items.len()),
            };
            let words = place.and_then(|place| pen.footer(footer, also, *place, view, k));
            let is_news = words.as_ref().is_some_and(spaces::is_news);
            titles.extend(if is_news { words } else { words.map(pale) });
        }
        let [line_glows, lines, labels] = self.lines(seen, spotlight.as_ref());
        let items = seen.items.iter().filter_map(|shown| {
            let at = shown.id as usize;
            Some((view.items.get(shown.item())?, self.cards.get(at)?, shown))
        });
        let glows = items
            .clone()
            .filter_map(|(item, card, shown)| pen.glow(item, card, shown));
        // Lines do not cross words.
        groups.extend(glows.chain(line_glows).chain(lines));
        groups.extend(titles.into_iter().chain(labels));
        for (item, card, shown) in items {
            let mut drawn = pen.item(item, card, shown);
            if let Some(presence) = view.presences.get(shown.item()) {
                pen.presence(&mut drawn, presence, card, item.kind);
            }
            let rows = card.card.iter();
            let rows = rows.flat_map(|rows| pen.card_rows(rows, &card.id, card.place, view, k));
            let all = std::iter::once(drawn).chain(rows);
            let is_lit = |spot: &Spotlight<'_>| spot.lit.contains(&shown.item());
            if spotlight.as_ref().is_none_or(is_lit) {
                groups.extend(all);
            } else {
                groups.extend(all.map(pale));
            }
        }
    }

    /// The lines of a window, those of a namespace merged while they are unchanged, with one label for each fork: the glows,
    /// which cover no head of another, the lines, and their labels; changed ones last, so that they are on top.
    fn lines(&self, seen: &SeenWindow, spotlight: Option<&Spotlight<'_>>) -> [Vec<Group>; 3] {
        let measured = &self.measured;
        let links = &measured.graph.plan.links;
        let look = |id: ArrowId| find(&seen.arrows, id.at());
        let mut drawn = Vec::new();
        let mut in_gates = BTreeSet::new();
        for (gate, path) in &self.gates {
            if let Some((shown, lines)) = gate.shown(measured.view, look) {
                in_gates.extend(lines);
                let fork = links[gate.lead.at()].fork;
                drawn.push((&gate.arrow, path, Cow::Owned(shown), fork));
            }
        }
        for &id in self.order.iter().filter(|id| !in_gates.contains(id)) {
            let (arrow, path) = (&measured.view.arrows[id], &self.tracks[id.at()]);
            if let Some(shown) = look(id) {
                drawn.push((arrow, path, Cow::Borrowed(shown), links[id.at()].fork));
            }
        }
        drawn.sort_by_key(|(.., shown, _)| shown.mark.is_some());
        // The lines of a fork have one label: that of a line that changed, which is on top.
        let mut last: BTreeMap<usize, usize> = BTreeMap::new();
        for (k, (.., fork)) in drawn.iter().enumerate() {
            last.extend(fork.map(|fork| (fork, k)));
        }
        let pen = self.pen();
        let mut groups = [(); 3].map(|()| Vec::new());
        for (arrow, path, shown, fork) in &drawn {
            let ends = [arrow.from, arrow.to].map(|id| find(&seen.items, id.at()));
            let mut parts = pen.arrow_parts(arrow, path, shown, ends);
            let spot = spotlight.filter(|spot| !spot.has_line(arrow, shown));
            for part in &mut parts {
                spot.inspect(|spot| spot.pale(part));
            }
            let named = fork.and_then(|fork| last.get(&fork)).map(|at| drawn[*at].1);
            if named.is_some_and(|other| {
                !std::ptr::eq(other, *path) && other.label_area() == path.label_area()
            }) {
                let label = &mut parts[2].pieces;
                label.retain(|piece| !matches!(piece, Piece::Text(_)));
            }
            for (group, part) in groups.iter_mut().zip(parts) {
                group.extend(Some(part).filter(|part| !part.pieces.is_empty()));
            }
        }
        groups
    }

    fn pen(&self) -> GraphPen<'_> {
        GraphPen {
            style: self.measured.style,
            fonts: self.measured.fonts,
            fit: self.fit,
        }
    }
}

/// The parts of items and arrows that never change, with badges where they fit, and the shifts of titles.
fn places(
    measured: &Measured<'_>,
    layout: &Layout,
    fit: GraphFit,
) -> (Vec<ItemBox>, Vec<ArrowPath>, Vec<Point>) {
    let mut cards = cards(measured, layout, fit);
    let mut tracks = tracks(measured, layout, fit);
    // Slightly beyond the badge's edge.
    let radius = measured.style.badge.radius * fit.pen + 1.0;
    let frames = layout.clusters.iter().zip(&measured.graph.plan.clusters);
    let titles = frames.map(|(frame, cluster)| {
        let (title, has_footer) = (cluster.title.scaled(fit.scale), cluster.footer.h > 0.0);
        (fit.rect(*frame), title, has_footer)
    });
    let titles: Vec<_> = titles.collect();
    let (shifts, titles) = room::place_titles(&titles, &cards, &tracks, fit.scale)
        .into_iter()
        .unzip();
    room::place_badges(&mut cards, &mut tracks, titles, radius, fit.scale);
    (cards, tracks, shifts)
}

fn cards(measured: &Measured<'_>, layout: &Layout, fit: GraphFit) -> Vec<ItemBox> {
    let shown_rates = texts::shown_rates(measured.view);
    let items = measured.view.items.iter().zip(&layout.boxes);
    let labels = measured.graph.labels.iter().zip(&measured.graph.cards);
    items
        .zip(labels.zip(shown_rates))
        .map(|((item, place), ((label, card), shown_rates))| ItemBox {
            id: item_id(item),
            label: label.clone(),
            shown_rates,
            card: Some(card).filter(|card| card.head > 0.0).cloned(),
            place: fit.rect(*place),
            badge: Point::default(),
        })
        .collect()
}

fn tracks(measured: &Measured<'_>, layout: &Layout, fit: GraphFit) -> Vec<ArrowPath> {
    let view = measured.view;
    let name = |id: ItemId| view.items.get(id).map_or("", |item| &*item.name);
    let empty = layout::Route::default();
    let arrows = view.arrows.iter();
    let arrows = arrows.zip(&measured.graph.plan.links).enumerate();
    arrows
        .map(|(at, (arrow, link))| {
            let ends = [arrow.from, arrow.to].map(|id| name(id).to_owned());
            let route = layout.routes.get(at).unwrap_or(&empty);
            let mut path = ArrowPath::new(arrow_id(arrow, &ends), ends, route, link.label, fit);
            path.topics.clone_from(&measured.graph.topics[at]);
            path
        })
        .collect()
}

// The page: its parts for title, graph, legend and timeline, and the scale of the graph in its part.

/// The page size for which lengths of title, legend and timeline are given: the smallest common size of a screen.
const STANDARD: Size = Size::new(1280.0, 720.0);
/// The largest scale of the graph, over its natural size: beyond it, the names of a small graph are nearly as
/// large as the headline.
const LARGEST: f64 = 1.35;

/// The positions of all parts of the page, equal in every frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PageFrame {
    pub(crate) size: Size,
    /// The scale of title, legend and timeline: 1 on a page of 1280 × 720.
    pub(crate) unit: f64,
    /// The largest scale of the graph.
    largest: f64,
    /// Empty parts (`--bare`) have no height.
    pub(crate) title: Rect,
    pub(crate) graph: Rect,
    pub(crate) legend: Rect,
    pub(crate) timeline: Rect,
}

/// What is at the bottom of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Strip {
    /// Nothing: two missions are compared, or a mission has a single window and no phases.
    Nothing,
    /// The phases of a still.
    Phases,
    /// The timeline of a film.
    Timeline,
}

/// The scale and the position of the graph in its part of the page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GraphFit {
    pub(crate) scale: f64,
    /// The scale of strokes and badges: they shrink less than the elements that they surround, to stay visible.
    pub(crate) pen: f64,
    pub(crate) origin: Point,
}

/// The style, the fonts and the scale that the graph is drawn with.
pub(crate) struct GraphPen<'a> {
    pub(crate) style: &'a Style,
    pub(crate) fonts: &'a Fonts,
    pub(crate) fit: GraphFit,
}

impl PageFrame {
    /// The page of these options, with `rows` rows of legend.
    pub(crate) fn new(style: &Style, options: &PageOptions, rows: usize, bottom: Strip) -> Self {
        let size = options.size;
        let unit = unit(options);
        let strip = |y: f64, height: f64| Rect::new(0.0, y, size.w, height);
        let (mut title, mut legend, mut timeline) = (0.0, 0.0, 0.0);
        if !options.bare {
            title = style.title.height * unit;
            if options.has_legend {
                // Rows at nearly twice the text's size, so that signs of two rows do not touch.
                legend = (style.legend.size * 1.9 * rows as f64 + 8.0) * unit;
            }
            if bottom != Strip::Nothing {
                timeline = below(style, options, bottom).height(&options.timeline);
            }
        }
        // On a small page the graph keeps nine tenths of each side.
        let margin = (style.page.margin * unit)
            .min(size.w / 20.0)
            .min(size.h / 20.0);
        let top = title;
        let bottom = (size.h - legend - timeline).max(top + 1.0);
        // The title's bar separates already.
        let above = if options.bare { margin } else { margin / 4.0 };
        let high = bottom - top - above - margin;
        let graph = Rect::new(margin, top + above, size.w - 2.0 * margin, high);
        Self {
            size,
            unit,
            largest: options.largest.unwrap_or(LARGEST * unit.max(0.8)),
            title: strip(0.0, title),
            graph: Rect::new(graph.x, graph.y, graph.w.max(1.0), graph.h.max(1.0)),
            legend: strip(bottom, legend),
            timeline: strip(bottom + legend, timeline),
        }
    }

    /// The largest scale at which a layout of this size fits, and the position of its corner, so that it is
    /// centred.
    pub(crate) fn fit(&self, layout: Size) -> GraphFit {
        let (w, h) = (layout.w.max(1.0), layout.h.max(1.0));
        let scale = (self.graph.w / w).min(self.graph.h / h).min(self.largest);
        let middle = self.graph.centre();
        GraphFit {
            scale,
            pen: libm::sqrt(scale),
            origin: Point::new(middle.x - w * scale / 2.0, middle.y - h * scale / 2.0),
        }
    }
}

/// The sizes of the timeline on a page.
pub(crate) fn below<'a>(style: &'a Style, options: &PageOptions, strip: Strip) -> BelowSizes<'a> {
    BelowSizes {
        style,
        unit: unit(options),
        is_paper: options.width_mm.is_some(),
        is_still: strip == Strip::Phases,
    }
}

/// The scale of title, legend and timeline on a page, by its size unless given: on a larger page it grows
/// less than the graph.
pub(crate) fn unit(options: &PageOptions) -> f64 {
    if let Some(unit) = options.unit {
        return unit;
    }
    let size = options.size;
    // Below 0.62, the words of the legend would be smaller than 7 pixels.
    let ratio = (size.w / STANDARD.w)
        .min(size.h / STANDARD.h)
        .clamp(0.62, 4.0);
    // On a page twice as large, words are 1.6 times as large: the rest of it is for the graph.
    if ratio > 1.0 {
        libm::pow(ratio, 0.7)
    } else {
        ratio
    }
}

impl GraphFit {
    pub(crate) fn point(&self, p: Point) -> Point {
        let Point { x, y } = self.origin;
        Point::new(x + p.x * self.scale, y + p.y * self.scale)
    }

    pub(crate) fn rect(&self, r: Rect) -> Rect {
        r.scaled(self.scale).moved(self.origin)
    }
}

#[cfg(test)]
mod tests;
