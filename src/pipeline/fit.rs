//! Makes a drawing legible: enlarges the page, draws topics as lines, collapses constant elements, then changing ones.

mod crop;
mod notices;

use std::collections::BTreeSet;
use std::sync::Arc;

use super::draw::{Composed, Drawing, known};
use super::{Stage, Watch};
use crate::base::geometry::Size;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::draw::picture::{self, Measured, PageOptions};
use crate::draw::style::Style;
use crate::graph::Element;
use crate::layout::{Engine, Layout, LayoutOptions, Plan, extend, lay_out};
use crate::mission::Mission;
use crate::view::{Collapsible, ItemId, Mode, View, ViewOptions, headlines, outline, view};
use notices::{parts, reported, so_that};

/// The style used to decide what is drawn.
const PLAIN: &str = "light";
/// The largest page that `--fit auto` grows to.
const LARGEST: Size = Size::new(1920.0, 1080.0);
/// The fewest boxes that collapsing a namespace must save if its changing elements stay outside.
const FEWEST_STEADY: usize = 3;
/// The share of the smallest legible text below which changing elements of a namespace are collapsed too.
const HOPELESS: f64 = 0.3;
/// The shares of the smallest legible text below which a quarter of the remaining namespaces is collapsed at once, and
/// two: below 0.75, two at once cost a synthetic mission of 75 nodes four boxes; below 0.7, they cost none of 54 any.
const FAR: f64 = 0.5;
const SMALL: f64 = 0.7;
/// The most collapsed namespaces that are tentatively reopened.
const MOST_REOPENED: usize = 24;

/// A namespace, and those of its boxes that stay outside when it is collapsed.
type Spared = (Arc<str>, Vec<Arc<str>>);

/// The best drawing so far, with its page and options.
struct Fitting<'a> {
    mission: &'a Mission,
    drawing: &'a Drawing,
    page: PageOptions,
    options: ViewOptions,
    best: Attempt,
    layouts: Layouts,
}

/// Chooses what is shown and lays it out on a page. `--fit auto` enlarges the page, then collapses namespaces, those
/// with the fewest changes first, until the smallest text is legible or nothing is left to collapse; then it bundles
/// topics if necessary, and reopens namespaces that fit after all.
pub(super) fn compose(mission: &Mission, drawing: &Drawing, watch: &mut dyn Watch) -> Composed {
    watch.stage(Stage::Layout);
    // The choice of elements does not depend on the style.
    let style = Style::builtin(PLAIN).unwrap_or_else(|_| drawing.style.clone());
    let plain = Drawing {
        style: match &drawing.medium {
            Some(medium) => medium.styled(style),
            None => style,
        },
        ..drawing.clone()
    };
    let is_styled = plain.style != drawing.style;
    let (asked, drawing) = (drawing, &plain);
    let (page, options) = (drawing.page.clone(), drawing.view.clone());
    let mut layouts = Layouts::default();
    let best = Attempt::new(mission, drawing, (&options, &page), &mut layouts);
    let mut fitting = Fitting {
        mission,
        drawing,
        page,
        options,
        best,
        layouts,
    };
    fitting.take_higher_page();
    if drawing.is_fitted && !fitting.is_readable() {
        fitting.make_readable();
    }
    if is_styled {
        fitting.drawing = asked;
        let chosen = (&fitting.options, &fitting.page);
        fitting.best = Attempt::drawn(mission, asked, chosen, &mut Layouts::default());
    }
    let drawing = asked;
    let mut composed = fitting.composed();
    if !drawing.is_sized && drawing.is_fitted && drawing.page.width_mm.is_none() {
        composed.page = crop::cropped(&composed, drawing);
    }
    if drawing.medium.as_ref().is_some_and(|m| m.paper.is_some()) {
        composed.page = crop::lowered(&composed, drawing);
    }
    let notices = &mut composed.notices;
    notices.extend(picture::unshown(&composed.view, &drawing.fonts));
    let remarks = composed.layout.remarks.iter();
    notices.extend(remarks.map(|text| Notice::new(NoticeKind::Note, text.as_str())));
    composed
}

impl Fitting<'_> {
    fn is_readable(&self) -> bool {
        self.best.is_readable(self.drawing)
    }

    fn attempt(&mut self, options: &ViewOptions, page: &PageOptions) -> Attempt {
        let layouts = &mut self.layouts;
        Attempt::new(self.mission, self.drawing, (options, page), layouts)
    }

    fn again(&mut self) {
        let chosen = (&self.options, &self.page);
        self.best = Attempt::new(self.mission, self.drawing, chosen, &mut self.layouts);
    }

    fn make_readable(&mut self) {
        if !self.drawing.is_sized && self.page.width_mm.is_none() {
            self.page.size = LARGEST;
            if self.best.layout.is_some()
                || !is_crowded(self.best.view.items.len(), self.drawing, &self.page)
            {
                self.again();
            }
        }
        if !self.is_readable() && !self.options.mode.is_direct() {
            self.options.mode = Mode::Nodes;
            self.options.is_bundled = true;
            self.again();
            self.take_higher_page();
        }
        if !self.is_readable() && self.options.is_still == Some(true) {
            self.join_alike();
        }
        if !self.is_readable() {
            self.options.are_leaves_in_words = true;
            self.again();
            self.take_higher_page();
        }
        let spared = self.collapse_the_steady();
        self.collapse_the_rest(spared);
        if self.is_readable() {
            self.open_again();
        } else {
            self.bundle();
        }
        self.take_lower_page();
    }

    /// One box for the nodes of a namespace that are there in the same phases.
    fn join_alike(&mut self) {
        let phases = self.mission.log.phases.iter().map(|phase| phase.span);
        self.options.alike_in = phases.collect();
        self.again();
        self.take_higher_page();
    }

    /// Takes the lowest page of a purpose on which everything is legible, else the one with the largest text.
    fn take_higher_page(&mut self) {
        let sizes = self.sizes();
        for size in sizes.into_iter().skip(1) {
            if self.is_readable() {
                return;
            }
            let page = self.page_of(size);
            let attempt = self.attempt(&self.options.clone(), &page);
            if attempt.text > self.best.text || attempt.layout.is_none() {
                (self.page, self.best) = (page, attempt);
            }
        }
    }

    /// Takes the lowest page of a purpose on which the remaining text is legible.
    fn take_lower_page(&mut self) {
        let sizes = self.sizes();
        let height = self.page.size.h;
        for size in sizes.into_iter().take_while(|size| size.h < height) {
            let page = self.page_of(size);
            let attempt = self.attempt(&self.options.clone(), &page);
            if attempt.is_readable(self.drawing) {
                (self.page, self.best) = (page, attempt);
                return;
            }
        }
    }

    /// The pages of the medium, the lowest first.
    fn sizes(&self) -> Vec<Size> {
        let medium = self.drawing.medium.as_ref();
        medium.map_or_else(Vec::new, |medium| medium.sizes.clone())
    }

    fn page_of(&self, size: Size) -> PageOptions {
        PageOptions {
            size,
            ..self.page.clone()
        }
    }

    /// Collapses the constant elements of namespaces until the text is legible. Returns the namespaces with the boxes
    /// that were left outside.
    fn collapse_the_steady(&mut self) -> Vec<Spared> {
        let reported = self.changing();
        let mut left: Vec<Spared> = Vec::new();
        loop {
            let is_new = |name: &Arc<str>| {
                !self.options.collapse.contains(name)
                    && !left.iter().any(|(other, _)| other == name)
            };
            let candidates = self.best.view.collapsible(self.mission, &self.options);
            let fresh = candidates.into_iter().filter(|c| is_new(&c.name));
            let fresh: Vec<Collapsible> = fresh.collect();
            if self.is_readable() || fresh.is_empty() {
                return left;
            }
            let is_hopeless = self.best.text < self.drawing.readable() * HOPELESS;
            let before = self.options.collapse.len();
            for candidate in self.at_once(fresh) {
                let mut changing = self.best.view.holding(&reported, &candidate.name);
                changing.retain(|name| !is_hopeless && !self.options.expand.contains(name));
                if changing.is_empty() || candidate.items >= changing.len() + FEWEST_STEADY {
                    self.options.collapse.push(Arc::clone(&candidate.name));
                    self.options.expand.extend(changing.iter().cloned());
                }
                if !changing.is_empty() {
                    left.push((candidate.name, changing));
                }
            }
            if self.options.collapse.len() > before {
                self.again();
            }
        }
    }

    /// The changing elements, the nodes that they connect, and the neighbours of those.
    fn changing(&self) -> BTreeSet<Element> {
        let elements = &self.mission.elements;
        let view = &self.best.view;
        let mut reported: BTreeSet<Element> = headlines(self.mission).collect();
        let topics: BTreeSet<_> = reported
            .iter()
            .filter_map(|what| elements.ends(*what).1)
            .collect();
        let edges = elements
            .edges()
            .filter(|(_, edge)| topics.contains(&edge.topic));
        reported.extend(edges.map(|(_, edge)| Element::Node(edge.node)));
        let is_reported = |item: ItemId| {
            view.items[item]
                .members
                .iter()
                .any(|m| reported.contains(m))
        };
        let lines = view
            .arrows
            .iter()
            .filter(|a| is_reported(a.from) != is_reported(a.to));
        let partners: BTreeSet<ItemId> = lines.flat_map(|arrow| [arrow.from, arrow.to]).collect();
        let members = partners.iter().flat_map(|item| &view.items[*item].members);
        let members: Vec<Element> = members.copied().collect();
        reported.extend(members);
        reported
    }

    /// Collapses these namespaces including the boxes left outside, until the text is legible.
    fn collapse_the_rest(&mut self, mut left: Vec<Spared>) {
        while !self.is_readable() && !left.is_empty() {
            let now = self.at_once(left.clone());
            left.drain(..now.len());
            for (name, changing) in now {
                self.options.expand.retain(|kept| !changing.contains(kept));
                if !self.options.collapse.contains(&name) {
                    self.options.collapse.push(name);
                }
            }
            self.again();
        }
    }

    /// The first of these; two if the text is too small for one to suffice, or a quarter if it is far too small, which
    /// saves a layout per namespace.
    fn at_once<T>(&self, mut all: Vec<T>) -> Vec<T> {
        let share = self.best.text / self.drawing.readable();
        all.truncate(if share < FAR {
            all.len().div_ceil(4)
        } else if share < SMALL {
            2
        } else {
            1
        });
        all
    }

    /// The last resort: one box per outermost namespace, and one line for all topics between two boxes, if more
    /// legible.
    fn bundle(&mut self) {
        let mut bundled = ViewOptions {
            mode: Mode::Nodes,
            is_bundled: true,
            ..self.drawing.view.clone()
        };
        let nodes = self.mission.elements.nodes.iter();
        let outermost: BTreeSet<&str> = nodes.filter_map(|n| outermost(n.name.as_str())).collect();
        let is_open = |space: &&str| bundled.expand.iter().any(|open| &**open == *space);
        let outermost: Vec<&str> = outermost.into_iter().filter(|s| !is_open(s)).collect();
        let outermost = outermost.into_iter().map(Arc::from);
        bundled.collapse.extend(outermost);
        let attempt = self.attempt(&bundled, &self.page.clone());
        if attempt.text > self.best.text && outline(self.mission, &bundled).items.len() > 1 {
            (self.options, self.best) = (bundled, attempt);
        }
    }

    /// Reopens namespaces that need not be collapsed, the outermost first.
    fn open_again(&mut self) {
        let asked = self.drawing.view.collapse.len();
        let collapsed = self.options.collapse[asked..].to_vec();
        for name in collapsed.iter().rev().take(MOST_REOPENED) {
            let mut opened = self.options.clone();
            opened.collapse.retain(|n| n != name);
            let attempt = self.attempt(&opened, &self.page.clone());
            if attempt.is_readable(self.drawing) {
                (self.options, self.best) = (opened, attempt);
            }
        }
    }

    /// The drawing with notices about what was done to make it legible, and whether that was sufficient.
    fn composed(mut self) -> Composed {
        if self.drawing.is_fitted && !self.is_readable() {
            // No effort has been made to improve an illegible drawing.
            let drawing = Drawing {
                is_fitted: false,
                ..self.drawing.clone()
            };
            let chosen = (&self.options, &self.page);
            self.best = Attempt::drawn(self.mission, &drawing, chosen, &mut Layouts::default());
        }
        let (drawing, text) = (self.drawing, self.best.text);
        let mut notices = self.best.notices;
        if drawing.is_fitted || drawing.medium.is_some() {
            let collapsed = &self.options.collapse[drawing.view.collapse.len()..];
            let kept = &self.options.expand[drawing.view.expand.len()..];
            notices.extend(reported(drawing, &parts(collapsed, kept), &self.page, text).iter());
            if self.options.is_bundled != drawing.view.is_bundled {
                let text = format!(
                    "drew one line per pair of boxes{}; draw each topic with `--fit none`",
                    so_that(text >= drawing.readable())
                );
                notices.add(Notice::new(NoticeKind::Hidden, text));
            }
        }
        Composed {
            view: self.best.view,
            options: self.options,
            page: self.page,
            layout: self.best.layout.unwrap_or_default(),
            notices,
        }
    }
}

/// The first part of a name that has more than one: `/robot1` of `/robot1/nav/planner`.
fn outermost(name: &str) -> Option<&str> {
    let end = name.get(1..)?.find('/')? + 1;
    name.get(..end)
}

/// The layouts by one engine so far: collapsing or opening a namespace inside a collapsed one changes nothing.
#[derive(Default)]
struct Layouts(Vec<(Plan, LayoutOptions, Layout)>);

impl Layouts {
    fn of(&mut self, plan: &Plan, page: &LayoutOptions, engine: &dyn Engine) -> Layout {
        let is_same = |made: &&(Plan, LayoutOptions, Layout)| made.1 == *page && made.0 == *plan;
        if let Some((_, _, layout)) = self.0.iter().find(is_same) {
            return layout.clone();
        }
        let layout = lay_out(plan, page, engine);
        self.0.push((plan.clone(), *page, layout.clone()));
        layout
    }
}

/// A layout of the view with some options.
struct Attempt {
    /// The view; without its windows if there is no layout.
    view: View,
    notices: Notices,
    /// The layout; `None` if there are too many boxes for any legible layout.
    layout: Option<Layout>,
    /// The size of its smallest text in pixels.
    text: f64,
}

impl Attempt {
    /// An attempt, with a layout if it may be legible or `--fit none` was given.
    fn new(
        mission: &Mission,
        drawing: &Drawing,
        (options, page): (&ViewOptions, &PageOptions),
        layouts: &mut Layouts,
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
        Self::drawn(mission, drawing, (options, page), layouts)
    }

    /// An attempt with a layout in any case.
    fn drawn(
        mission: &Mission,
        drawing: &Drawing,
        (options, page): (&ViewOptions, &PageOptions),
        layouts: &mut Layouts,
    ) -> Self {
        // The widest labels depend on rates, so the windows are needed too.
        let (view, notices) = view(mission, options);
        let measured = Measured::new(&view, &drawing.style, &drawing.fonts, page.clone());
        let readable = drawing.readable();
        let plan = measured.plan();
        let least = readable / measured.smallest_text();
        let page = LayoutOptions {
            least: if drawing.is_fitted {
                ALMOST * least
            } else {
                0.0
            },
            ..measured.layout_options()
        };
        let mut placed = |page: &LayoutOptions| {
            let layout = match &drawing.kept {
                None => layouts.of(plan, page, drawing.engine),
                Some(kept) => extend(plan, page, drawing.engine, &known(&view, kept)),
            };
            (measured.text_px(&layout), layout)
        };
        let (mut text, mut layout) = placed(&page);
        if drawing.is_fitted && (ALMOST * readable..readable).contains(&text) {
            let tight = placed(&LayoutOptions {
                is_tight: true,
                least,
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

    fn is_readable(&self, drawing: &Drawing) -> bool {
        self.text >= drawing.readable()
    }
}

/// The share of the smallest legible text above which a drawing that fills the page better is tried: its text is at
/// most an eighth larger.
const ALMOST: f64 = 0.85;

/// The minimum area of a box in squares of its text height: it is at least as high as its text and four times as wide.
const LEAST_BOX: f64 = 4.0;

/// Whether these are more boxes than fit on a page with legible text.
fn is_crowded(boxes: usize, drawing: &Drawing, page: &PageOptions) -> bool {
    let text = drawing.readable();
    boxes as f64 > page.size.w * page.size.h / (LEAST_BOX * text * text)
}
