//! From the mission to the picture: the choice of what is shown, made readable on its page.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{Purpose, Stage, Watch};
use crate::base::geometry::{Rect, Size};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::words;
use crate::draw::picture::{self, Measured, PageOptions};
use crate::draw::style::Style;
use crate::draw::text::Fonts;
use crate::layout::{Engine, Layout, LayoutOptions, RING, engine, extend, lay_out};
use crate::mission::phases::knows_publishers;
use crate::mission::{Mission, Place, Places};
use crate::view::{Collapsible, Mode, View, ViewOptions, outline, view};

/// The kind of picture of a mission.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Body {
    /// A graph, or a board where the publishers of most messages are unknown.
    #[default]
    Auto,
    /// The computation graph.
    Graph,
    /// The board of topics over time.
    Board,
}

impl Body {
    /// Whether it is a board for this mission.
    pub(super) fn is_board(self, mission: &Mission) -> bool {
        match self {
            Self::Graph => false,
            Self::Board => true,
            Self::Auto => !knows_publishers(&mission.elements, &mission.activity),
        }
    }
}

/// The options of the picture.
#[derive(Clone)]
#[non_exhaustive]
pub struct Drawing {
    /// The kind of picture: graph or board.
    pub body: Body,
    /// The choice of what is shown.
    pub view: ViewOptions,
    /// Colours, strokes and fonts.
    pub style: Style,
    /// The fonts for all text.
    pub fonts: Fonts,
    /// The page with its title and orientation.
    pub page: PageOptions,
    /// Whether the user chose the size of the page, so that it may not grow.
    pub is_sized: bool,
    /// The place where it will be seen, if that decides the page: see [`Drawing::seen`].
    pub(crate) purpose: Option<Purpose>,
    /// Whether to grow the page and collapse namespaces until the text can be read.
    pub is_fitted: bool,
    /// Whether hubs, topics that half the system is connected to, have a box in each namespace that uses them.
    pub(crate) splits_hubs: bool,
    /// The layout engine.
    pub engine: &'static (dyn Engine + Sync),
    /// Places of an earlier drawing, which are kept; new elements are placed beside them.
    pub kept: Option<Places>,
}

impl Drawing {
    /// The light style on a page of 1280×720 that may grow, as the command line has it.
    ///
    /// # Errors
    /// None that a user can cause: the built-in style is known to be valid.
    pub fn new() -> crate::base::error::Result<Self> {
        Ok(Self {
            body: Body::default(),
            view: ViewOptions::default(),
            style: Style::builtin("light")?,
            fonts: Fonts::bundled(),
            page: PageOptions::default(),
            is_sized: false,
            purpose: None,
            is_fitted: true,
            splits_hubs: true,
            engine: crate::layout::ENGINES[0].1,
            kept: None,
        })
    }
}

impl Drawing {
    /// The same drawing for this place where it is seen: page, size of text and furniture follow from it, whatever they
    /// were.
    #[must_use]
    pub fn seen(self, purpose: Purpose) -> Self {
        Self {
            page: purpose.page(self.page),
            is_sized: true,
            purpose: Some(purpose),
            ..self
        }
    }

    /// The smallest text that can be read, in pixels.
    fn readable(&self) -> f64 {
        self.purpose.map_or(READABLE, Purpose::readable)
    }
}

/// The smallest text that `--fit auto` accepts, in pixels.
const READABLE: f64 = 9.0;

/// The largest page that `--fit auto` grows to.
const LARGEST: Size = Size::new(1920.0, 1080.0);

/// A view with its page and its layout.
pub(super) struct Composed {
    pub(super) view: View,
    pub(super) options: ViewOptions,
    pub(super) page: PageOptions,
    pub(super) layout: Layout,
    pub(super) notices: Notices,
}

/// Chooses what is shown and lays it out. With `--fit auto` the page grows, then those namespaces are collapsed in which
/// least changes, until the smallest text is at least 9 pixels high or nothing is left to collapse; then topics are
/// bundled, if need be, and namespaces that turn out to fit are opened again.
pub(super) fn compose(mission: &Mission, drawing: &Drawing, watch: &mut dyn Watch) -> Composed {
    watch.stage(Stage::Layout);
    let mut page = drawing.page.clone();
    let mut options = drawing.view.clone();
    let (asked, expanded) = (options.collapse.len(), options.expand.len());
    let mut best = Attempt::new(mission, drawing, &options, &page);
    if let Some(purpose) = drawing.purpose {
        for size in purpose.sizes().into_iter().skip(1) {
            if best.is_readable(drawing) {
                break;
            }
            let higher = PageOptions {
                size,
                ..page.clone()
            };
            let attempt = Attempt::new(mission, drawing, &options, &higher);
            if attempt.text > best.text || attempt.layout.is_none() {
                (page, best) = (higher, attempt);
            }
        }
    }
    if drawing.is_fitted && !best.is_readable(drawing) {
        if !drawing.is_sized && page.width_mm.is_none() {
            page.size = LARGEST;
            best = best.grown(mission, drawing, &options, &page);
        }
        collapse(mission, drawing, &page, &mut options, &mut best);
        if best.is_readable(drawing) {
            open_again(mission, drawing, &page, (&mut options, asked), &mut best);
        } else {
            bundle(mission, drawing, &page, &mut options, &mut best);
        }
        tighten(mission, drawing, &mut page, &options, &mut best);
    }
    if best.layout.is_none() {
        best = Attempt::drawn(mission, drawing, &options, &page);
    }
    let Attempt {
        view,
        mut notices,
        layout,
        text,
    } = best;
    let layout = layout.unwrap_or_else(Layout::empty);
    if drawing.is_fitted || drawing.purpose.is_some() {
        let collapsed = &options.collapse[asked..];
        let parts = parts(collapsed, &options.expand[expanded..]);
        notices.extend(told(drawing, &parts, &page, text).iter());
        if options.mode != drawing.view.mode {
            let text = format!(
                "one arrow for all topics between two boxes{}; `--mode {}` draws each",
                so_that(text >= drawing.readable()),
                drawing.view.mode.word()
            );
            notices.add(Notice::new(NoticeKind::Hidden, text));
        }
    }
    notices.extend(picture::unshown(&view, &drawing.fonts));
    let remarks = layout.remarks.iter();
    notices.extend(remarks.map(|text| Notice::new(NoticeKind::Note, text.as_str())));
    Composed {
        view,
        options,
        page,
        layout,
        notices,
    }
}

/// The view where nothing is drawn: everything asked for, without places.
pub(super) fn unplaced(mission: &Mission, drawing: &Drawing) -> Composed {
    Composed {
        view: view(mission, &drawing.view).0,
        options: drawing.view.clone(),
        page: drawing.page.clone(),
        layout: Layout::empty(),
        notices: Notices::new(),
    }
}

/// The view where only the data itself is written: an empty one.
pub(super) fn unseen(drawing: &Drawing) -> Composed {
    Composed {
        view: View::default(),
        options: drawing.view.clone(),
        page: drawing.page.clone(),
        layout: Layout::empty(),
        notices: Notices::new(),
    }
}

/// A layout of the view that some options give.
struct Attempt {
    /// The view; without its windows where there is no layout.
    view: View,
    notices: Notices,
    /// The layout; `None` where there are too many boxes to be read in any layout.
    layout: Option<Layout>,
    /// The size of its smallest text in pixels.
    text: f64,
}

impl Attempt {
    /// An attempt with a layout if it may be readable or `--fit none` was given, else without.
    fn new(
        mission: &Mission,
        drawing: &Drawing,
        options: &ViewOptions,
        page: &PageOptions,
    ) -> Self {
        let elements = &mission.elements;
        let boxes = elements.nodes.len() + elements.topics.len();
        if drawing.is_fitted && is_crowded(boxes, drawing, page) {
            let view = outline(mission, options);
            if is_crowded(view.items.len(), drawing, page) {
                return Self {
                    view,
                    notices: Notices::new(),
                    layout: None,
                    text: 0.0,
                };
            }
        }
        Self::drawn(mission, drawing, options, page)
    }

    /// An attempt with a layout in any case.
    fn drawn(
        mission: &Mission,
        drawing: &Drawing,
        options: &ViewOptions,
        page: &PageOptions,
    ) -> Self {
        // The widest labels depend on rates, so that the windows are needed too.
        let (view, notices) = view(mission, options);
        let view = if drawing.splits_hubs {
            view.with_hubs_split()
        } else {
            view
        };
        let measured = Measured::new(&view, &drawing.style, &drawing.fonts, page.clone());
        let (plan, page) = (measured.plan(), measured.layout_options());
        let placed = |page: &LayoutOptions| {
            let layout = match &drawing.kept {
                None => lay_out(plan, page, drawing.engine),
                Some(kept) => extend(plan, page, drawing.engine, &known(&view, kept)),
            };
            (measured.text_px(&layout), layout)
        };
        let (mut text, mut layout) = placed(&page);
        let readable = drawing.readable();
        if drawing.is_fitted && (ALMOST * readable..readable).contains(&text) {
            let tight = placed(&LayoutOptions {
                is_tight: true,
                ..page
            });
            if tight.0 >= readable {
                (text, layout) = tight;
            }
        }
        Self {
            view,
            notices,
            layout: Some(layout),
            text,
        }
    }

    /// The same attempt on a larger page.
    fn grown(
        self,
        mission: &Mission,
        drawing: &Drawing,
        options: &ViewOptions,
        page: &PageOptions,
    ) -> Self {
        if self.layout.is_none() && is_crowded(self.view.items.len(), drawing, page) {
            return self;
        }
        Self::new(mission, drawing, options, page)
    }

    fn is_readable(&self, drawing: &Drawing) -> bool {
        self.text >= drawing.readable()
    }
}

/// The share of the smallest text that can be read from which a drawing that fills the page better is tried.
const ALMOST: f64 = 0.7;

/// The least area of a box in squares of its text's height: no box is lower than its text, nor narrower than four
/// times that.
const LEAST_BOX: f64 = 4.0;

/// Whether these are more boxes than a page holds with text that can be read.
fn is_crowded(boxes: usize, drawing: &Drawing, page: &PageOptions) -> bool {
    let text = drawing.readable();
    boxes as f64 > page.size.w * page.size.h / (LEAST_BOX * text * text)
}

/// The least number of boxes that must vanish in a collapsed namespace from which those that change are left out.
const FEWEST_STEADY: usize = 3;

/// Collapses namespaces until the text can be read: first what does not change in them, then the whole of them.
fn collapse(
    mission: &Mission,
    drawing: &Drawing,
    page: &PageOptions,
    options: &mut ViewOptions,
    best: &mut Attempt,
) {
    let mut left: Vec<(Arc<str>, Vec<Arc<str>>)> = Vec::new();
    loop {
        let is_new = |name: &Arc<str>| {
            !options.collapse.contains(name) && !left.iter().any(|(other, _)| other == name)
        };
        let candidates = best.view.collapsible(mission, options).into_iter();
        let fresh: Vec<Collapsible> = candidates.filter(|c| is_new(&c.name)).collect();
        if best.is_readable(drawing) || fresh.is_empty() {
            break;
        }
        for candidate in at_once(fresh, best, drawing) {
            let mut changing = best.view.changing(mission, &candidate.name);
            changing.retain(|name| !options.expand.contains(name));
            if changing.is_empty() || candidate.items >= changing.len() + FEWEST_STEADY {
                options.collapse.push(Arc::clone(&candidate.name));
                options.expand.extend(changing.iter().cloned());
            }
            if !changing.is_empty() {
                left.push((candidate.name, changing));
            }
        }
        *best = Attempt::new(mission, drawing, options, page);
    }
    while !best.is_readable(drawing) && !left.is_empty() {
        for (name, changing) in at_once(left.clone(), best, drawing) {
            options.expand.retain(|kept| !changing.contains(kept));
            if !options.collapse.contains(&name) {
                options.collapse.push(Arc::clone(&name));
            }
            left.retain(|(other, _)| *other != name);
        }
        *best = Attempt::new(mission, drawing, options, page);
    }
}

/// The first of these, or a quarter of them where the text is far too small: that is not worth a layout for every
/// namespace on the way.
fn at_once<T>(all: Vec<T>, best: &Attempt, drawing: &Drawing) -> Vec<T> {
    let many = if best.text < drawing.readable() / 2.0 {
        all.len().div_ceil(4)
    } else {
        1
    };
    all.into_iter().take(many).collect()
}

/// The last resort: outermost namespaces as one box each, and one arrow for all topics between two boxes; if that can
/// be read better.
fn bundle(
    mission: &Mission,
    drawing: &Drawing,
    page: &PageOptions,
    options: &mut ViewOptions,
    best: &mut Attempt,
) {
    if options.mode.is_direct() {
        return;
    }
    let mut bundled = options.clone();
    bundled.mode = Mode::Bundles;
    bundled.collapse.clone_from(&drawing.view.collapse);
    let nodes = mission.elements.nodes.iter().map(|n| n.name.as_str());
    let outermost: BTreeSet<&str> = nodes.filter_map(outermost).collect();
    bundled
        .collapse
        .extend(outermost.into_iter().map(Arc::from));
    let boxes = outline(mission, &bundled);
    // Few boxes with many arrows among them stand best around the page.
    let drawing = if boxes.items.len() <= RING && boxes.namespaces.is_empty() {
        let ring = engine("ring").unwrap_or(drawing.engine);
        &Drawing {
            engine: ring,
            ..drawing.clone()
        }
    } else {
        drawing
    };
    let attempt = Attempt::new(mission, drawing, &bundled, page);
    if boxes.items.len() > 1 && attempt.text > best.text {
        (*options, *best) = (bundled, attempt);
    }
}

/// The first part of a name that has more than one: `/robot1` of `/robot1/nav/planner`.
fn outermost(name: &str) -> Option<&str> {
    let end = name.get(1..)?.find('/')? + 1;
    name.get(..end)
}

/// Takes the lowest page of a purpose on which what is left can be read.
fn tighten(
    mission: &Mission,
    drawing: &Drawing,
    page: &mut PageOptions,
    options: &ViewOptions,
    best: &mut Attempt,
) {
    let sizes = drawing.purpose.map(Purpose::sizes).unwrap_or_default();
    let lower = sizes.into_iter().take_while(|size| size.h < page.size.h);
    for size in lower.collect::<Vec<_>>() {
        let lower = PageOptions {
            size,
            ..page.clone()
        };
        let attempt = Attempt::new(mission, drawing, options, &lower);
        if attempt.is_readable(drawing) {
            (*page, *best) = (lower, attempt);
            return;
        }
    }
}

/// The largest number of collapsed namespaces that are tried to be opened again.
const MOST_REOPENED: usize = 24;

/// Opens namespaces that were collapsed on the way and need not have been, the outermost first.
fn open_again(
    mission: &Mission,
    drawing: &Drawing,
    page: &PageOptions,
    options: (&mut ViewOptions, usize),
    best: &mut Attempt,
) {
    let (options, asked) = options;
    let collapsed = options.collapse[asked..].to_vec();
    if !best.is_readable(drawing) {
        return;
    }
    for name in collapsed.iter().rev().take(MOST_REOPENED) {
        let mut opened = options.clone();
        opened.collapse.retain(|n| n != name);
        let attempt = Attempt::new(mission, drawing, &opened, page);
        if attempt.is_readable(drawing) {
            (*options, *best) = (opened, attempt);
        }
    }
}

/// The collapsed namespaces in words, with the number of those in it that were kept open because they change.
fn parts(collapsed: &[Arc<str>], kept: &[Arc<str>]) -> Vec<(Arc<str>, String)> {
    let told = |name: &Arc<str>| {
        let inside = |other: &&Arc<str>| {
            let rest = other.strip_prefix(&**name);
            rest.is_some_and(|rest| rest.starts_with('/'))
        };
        let words = match kept.iter().filter(inside).count() {
            0 => name.to_string(),
            many => format!("{name} but for {} in it", words::count(many, "change")),
        };
        (Arc::clone(name), words)
    };
    collapsed.iter().map(told).collect()
}

/// The notices about what `--fit auto` did, and whether it was enough: the smallest text is `text` pixels high.
fn told(
    drawing: &Drawing,
    collapsed: &[(Arc<str>, String)],
    got: &PageOptions,
    text: f64,
) -> Notices {
    let mut notices = Notices::new();
    let is_readable = text >= drawing.readable();
    if drawing.page.size != got.size && drawing.purpose.is_none() {
        let text = format!(
            "the page is {}x{}{}; `--size` takes another",
            got.size.w,
            got.size.h,
            so_that(is_readable)
        );
        notices.add(Notice::new(NoticeKind::Chosen, text));
    }
    if let Some((first, _)) = collapsed.first() {
        let collapsed: Vec<&String> = collapsed.iter().map(|(_, words)| words).collect();
        let text = format!(
            "drawn as one box each{}: {}; `--expand {first}` opens one, `--fit none` all",
            so_that(is_readable),
            words::some_of(&collapsed, 3)
        );
        notices.add(Notice::new(NoticeKind::Hidden, text));
    }
    if let Some(purpose) = drawing.purpose.filter(|_| !is_readable) {
        let size = match got.width_mm {
            Some(mm) => {
                let pt = text * mm / got.size.w * 72.0 / 25.4;
                format!("{} pt", words::number(words::significant(pt, 2)))
            }
            None => format!("{} pixels", words::number(words::significant(text, 2))),
        };
        let advice = purpose.advice();
        let text =
            format!("the smallest text is {size} where it is seen, too small to be read; {advice}");
        notices.add(Notice::new(NoticeKind::Note, text));
    } else if !is_readable {
        let text = format!(
            "the smallest text is {} pixels high, too small to be read; `--ns-filter`, `--hide dead,leaf`, `--mode nodes` or a larger `--size` help",
            words::number(text)
        );
        notices.add(Notice::new(NoticeKind::Note, text));
    }
    notices
}

fn so_that(is_readable: bool) -> &'static str {
    if is_readable {
        " so that the text can be read"
    } else {
        ""
    }
}

/// The place of each item in an earlier drawing; `None` for new ones.
fn known(view: &View, kept: &Places) -> Vec<Option<Rect>> {
    let places: BTreeMap<(&str, &str), Rect> = kept
        .boxes
        .iter()
        .map(|b| ((b.what.as_str(), b.name.as_str()), b.rect))
        .collect();
    view.items
        .iter()
        .map(|item| places.get(&(item.kind.word(), &*item.name)).copied())
        .collect()
}

/// The places of a layout, for the JSON.
pub(super) fn places(view: &View, layout: &Layout) -> Places {
    let boxes = view.items.iter().zip(&layout.boxes);
    let mut boxes: Vec<Place> = boxes
        .map(|(item, rect)| Place {
            what: item.kind.word().to_owned(),
            name: item.name.to_string(),
            rect: *rect,
        })
        .collect();
    boxes.sort_by(|a, b| (&a.what, &a.name).cmp(&(&b.what, &b.name)));
    Places {
        width: layout.size.w,
        height: layout.size.h,
        orientation: layout.orientation.word().to_owned(),
        boxes,
    }
}
