//! The picture: a view, a layout and a style become one scene per window, with everything at the same place in each.

mod arrows;
mod badge;
mod boxes;
mod draft;
mod legend;
mod look;
mod page;
mod timeline;
mod title;
mod tween;
mod words;

use self::arrows::{Arrows, Track};
use self::boxes::Boxes;
use self::draft::{Draft, Tells};
use self::page::{Fit, Page};
use self::timeline::Timeline;
use self::title::Title;
use crate::geometry::{Rect, Size};
use crate::layout::{self, Engine, Layout, Orientation, Plan};
use crate::scene::{Group, Scene};
use crate::style::Style;
use crate::text::Fonts;
use crate::view::{ArrowKind, Frame, Item, Mark, Shown, View};

/// What the user wishes of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Wish {
    /// The page in pixels.
    pub size: Size,
    /// The page's width on paper in millimetres, for vector output.
    pub width_mm: Option<f64>,
    /// The graph alone, without title, caption, legend and timeline.
    pub bare: bool,
    /// The title, such as the bag's name.
    pub title: String,
    /// Which way the edges run; `None` takes what fits better.
    pub orientation: Option<Orientation>,
    /// The mission's phase in each window, by place among the view's frames; empty for none.
    pub phases: Vec<String>,
    /// From which relative change of a rate on it is told, for the legend.
    pub rate_change: f64,
}

impl Default for Wish {
    fn default() -> Self {
        Self {
            size: Size::new(1280.0, 720.0),
            width_mm: None,
            bare: false,
            title: String::new(),
            orientation: None,
            phases: Vec::new(),
            rate_change: 0.25,
        }
    }
}

/// What there is to lay out, with the page it is for: the stage before [`Picture`].
pub struct Sketch<'a> {
    view: &'a View,
    style: &'a Style,
    fonts: &'a Fonts,
    wish: Wish,
    draft: Draft,
    legend: Vec<Vec<(legend::Sign, String, f64)>>,
    page: Page,
}

impl<'a> Sketch<'a> {
    /// Labels, sizes and namespaces of a view, and the parts of the page.
    pub fn new(view: &'a View, style: &'a Style, fonts: &'a Fonts, wish: Wish) -> Self {
        let draft = Draft::new(view, style, fonts);
        let signs = legend::signs(view, wish.rate_change);
        let legend = legend::rows(&signs, style, fonts, page::unit(wish.size), wish.size.w);
        let page = Page::new(style, &wish, legend.len());
        Self {
            view,
            style,
            fonts,
            wish,
            draft,
            legend,
            page,
        }
    }

    /// What to lay out: a vertex per item, a link per arrow, a cluster per namespace with a box.
    pub fn plan(&self) -> &Plan {
        &self.draft.plan
    }

    /// What to tell the layout engine of the page.
    pub fn layout_wish(&self) -> layout::Wish {
        layout::Wish {
            page: Size::new(self.page.graph.w, self.page.graph.h),
            orientation: self.wish.orientation,
        }
    }

    /// The smallest text of the graph in pixels if it is laid out like this.
    pub fn text_px(&self, layout: &Layout) -> f64 {
        let (style, draft) = (self.style, &self.draft);
        let mut smallest = style.topic.size.min(style.node.size);
        if draft.rated.contains(&true) {
            smallest = smallest.min(style.edge.size);
        }
        if draft.labels.iter().any(|l| l.second) {
            smallest = smallest.min(style.node.small).min(style.topic.small);
        }
        smallest * self.page.fit(layout.size).scale
    }

    /// The picture with this layout, which must be one of [`Sketch::plan`].
    pub fn with(self, layout: Layout) -> Picture<'a> {
        Picture::new(self, layout)
    }

    /// The picture as `engine` lays it out.
    pub fn laid_out(self, engine: &dyn Engine) -> Picture<'a> {
        let layout = layout::lay_out(self.plan(), &self.layout_wish(), engine);
        self.with(layout)
    }
}

/// A sequence of scenes. It may be shared among threads.
pub struct Picture<'a> {
    sketch: Sketch<'a>,
    layout: Layout,
    fit: Fit,
    tracks: Vec<Track>,
    /// The arrows in the order they are painted: longer ones first, so that rates on short ones stay readable.
    order: Vec<usize>,
    item_ids: Vec<String>,
    arrow_ids: Vec<String>,
    /// What each item tells of its rate.
    tells: Vec<Tells>,
    /// What is the same in every frame, behind the graph and before what moves.
    ground: Vec<Group>,
}

impl<'a> Picture<'a> {
    fn new(sketch: Sketch<'a>, layout: Layout) -> Self {
        let view = sketch.view;
        let fit = sketch.page.fit(layout.size);
        let plan = &sketch.draft.plan;
        let empty = layout::Route::default();
        let tracks: Vec<Track> = plan
            .links
            .iter()
            .enumerate()
            .map(|(at, link)| Track::new(layout.routes.get(at).unwrap_or(&empty), link.label, fit))
            .collect();
        let mut order: Vec<usize> = (0..tracks.len()).collect();
        order.sort_by(|a, b| {
            let by_kind = (view.arrows[*a].kind == ArrowKind::Publish)
                .cmp(&(view.arrows[*b].kind == ArrowKind::Publish));
            by_kind
                .then(tracks[*b].length.total_cmp(&tracks[*a].length))
                .then(a.cmp(b))
        });
        let mut picture = Self {
            item_ids: view.items.iter().map(item_id).collect(),
            arrow_ids: (0..view.arrows.len())
                .map(|at| arrow_id(view, at))
                .collect(),
            tells: draft::tells(view),
            ground: Vec::new(),
            sketch,
            layout,
            fit,
            tracks,
            order,
        };
        picture.ground = picture.ground();
        picture
    }

    /// How many frames there are: one per window.
    pub fn len(&self) -> usize {
        self.sketch.view.frames.len()
    }

    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where everything is, in the layout's own pixels.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The smallest text of the graph in pixels.
    pub fn text_px(&self) -> f64 {
        self.sketch.text_px(&self.layout)
    }

    /// The window at place `k` of the view, settled. An empty page past the last one.
    pub fn scene(&self, k: usize) -> Scene {
        let sketch = &self.sketch;
        let mut scene = Scene {
            size: sketch.wish.size,
            width_mm: sketch.wish.width_mm,
            background: sketch.style.background(),
            title: String::new(),
            groups: self.ground.clone(),
        };
        let Some(frame) = sketch.view.frames.get(k) else {
            return scene;
        };
        self.graph(frame, &mut scene.groups);
        if !sketch.wish.bare {
            self.furniture(k, frame, &mut scene.groups);
        }
        scene.title = format!(
            "{}, window {} of {}",
            sketch.wish.title,
            frame.index + 1,
            self.len()
        );
        if !frame.caption.is_empty() {
            scene.title = format!("{}: {}", scene.title, frame.caption.join("; "));
        }
        scene
    }

    /// The way from window `k - 1` to window `k`, `phase` (0..=1) of it done: first what goes fades, then what changes
    /// cross-fades in place, then what comes appears. Nothing moves. At 1 it is [`Picture::scene`].
    pub fn between(&self, k: usize, phase: f64) -> Scene {
        let after = self.scene(k);
        if k == 0 || phase >= 1.0 {
            return after;
        }
        tween::tween(&self.scene(k - 1), after, phase.max(0.0))
    }

    fn ground(&self) -> Vec<Group> {
        let sketch = &self.sketch;
        let boxes = self.boxes();
        let spaces = sketch.draft.spaces.iter().zip(&self.layout.clusters);
        let mut groups: Vec<Group> = spaces
            .map(|(space, place)| boxes.space(space, *place, &encoded(&space.name)))
            .collect();
        if !sketch.wish.bare {
            groups.push(self.title().ground());
            groups.push(legend::legend(&sketch.legend, sketch.style, &sketch.page));
            groups.extend(self.timeline().ground(sketch.view));
        }
        groups
    }

    fn furniture(&self, k: usize, frame: &Frame, groups: &mut Vec<Group>) {
        let sketch = &self.sketch;
        let title = self.title();
        let phase = sketch.wish.phases.get(k).map_or("", String::as_str);
        groups.push(title.window(sketch.view, frame));
        groups.push(title.chips(frame));
        groups.push(title.clock(frame));
        groups.push(title.caption(frame, phase));
        groups.extend(self.timeline().head(k));
    }

    fn graph(&self, frame: &Frame, groups: &mut Vec<Group>) {
        let sketch = &self.sketch;
        let (view, draft) = (sketch.view, &sketch.draft);
        let arrows = Arrows {
            style: sketch.style,
            fonts: sketch.fonts,
            fit: self.fit,
        };
        // What changed lies on top.
        let mut changed = Vec::new();
        for &at in &self.order {
            let Some(shown) = draft::find(&frame.arrows, at) else {
                continue;
            };
            let arrow = &view.arrows[at];
            let (Some(from), Some(to)) = (
                view.items.get(arrow.from as usize),
                view.items.get(arrow.to as usize),
            ) else {
                continue;
            };
            let ends = [arrow.from, arrow.to].map(|id| draft::find(&frame.items, id as usize));
            let badged = is_badged(shown, ends);
            let id = self.arrow_ids[at].clone();
            let group = arrows.arrow(
                arrow,
                (from, to),
                &self.tracks[at],
                shown,
                ends[0],
                badged,
                id,
            );
            if shown.mark.is_some() {
                changed.push(group)
            } else {
                groups.push(group)
            }
        }
        groups.append(&mut changed);
        let boxes = self.boxes();
        for shown in &frame.items {
            let at = shown.id as usize;
            if let (Some(item), Some(place)) = (view.items.get(at), self.layout.boxes.get(at)) {
                let id = self.item_ids[at].clone();
                groups.push(boxes.item(item, &draft.labels[at], *place, shown, self.tells[at], id));
            }
        }
    }

    fn boxes(&self) -> Boxes<'_> {
        Boxes {
            style: self.sketch.style,
            fit: self.fit,
        }
    }

    fn title(&self) -> Title<'_> {
        let s = &self.sketch;
        Title::new(
            s.style,
            s.fonts,
            &s.page,
            s.view,
            &s.wish.title,
            &s.wish.phases,
        )
    }

    fn timeline(&self) -> Timeline<'_> {
        let s = &self.sketch;
        Timeline::new(s.style, s.fonts, &s.page, s.view)
    }

    /// Where an item stands on the page, by its place in the view.
    pub fn place(&self, item: usize) -> Option<Rect> {
        self.layout.boxes.get(item).map(|r| self.fit.rect(*r))
    }
}

/// Whether a changed arrow carries a badge: not where one of its ends tells the same, and not where its rate does.
fn is_badged(shown: &Shown, ends: [Option<&Shown>; 2]) -> bool {
    let Some(mark) = shown.mark else { return false };
    let rate = matches!(mark, Mark::Faster | Mark::Slower);
    let told = ends
        .into_iter()
        .flatten()
        .filter_map(|end| end.mark)
        .any(|m| m.class() == mark.class());
    !rate && !told
}

fn item_id(item: &Item) -> String {
    let prefix = if item.kind.word() == "node" { "n" } else { "t" };
    format!("{prefix}{}", encoded(&item.name))
}

fn arrow_id(view: &View, at: usize) -> String {
    let arrow = &view.arrows[at];
    let name = |id: u32| {
        view.items
            .get(id as usize)
            .map_or_else(String::new, |item| encoded(&item.name))
    };
    let (from, to) = (name(arrow.from), name(arrow.to));
    match &arrow.kind {
        ArrowKind::Publish => format!("p{from}..{to}"),
        ArrowKind::Subscribe => format!("s{from}..{to}"),
        ArrowKind::Direct(topic) => format!("d{from}..{to}..{}", encoded(topic)),
    }
}

/// A name as part of an XML id, different for different names: `/` becomes `-`, anything but letters, digits and `_`
/// becomes `.` with its number in six hexadecimal digits.
fn encoded(name: &str) -> String {
    let mut out = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            '/' => out.push('-'),
            '_' | 'a'..='z' | 'A'..='Z' | '0'..='9' => out.push(c),
            _ => out.push_str(&format!(".{:06x}", u32::from(c))),
        }
    }
    out
}

#[cfg(test)]
mod tests;
