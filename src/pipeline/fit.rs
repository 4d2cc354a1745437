//! Makes a drawing legible: enlarges the page, draws topics as lines, collapses constant elements, then changing ones.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::compose::Composed;
use super::{Drawing, Stage, Watch};
use crate::base::geometry::Size;
use crate::base::ids::grouped;
use crate::base::name::lies_in;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::words;
use crate::draw::picture::{self, PageOptions};
use crate::draw::style::Style;
use crate::graph::Element;
use crate::layout::{Layout, LayoutOptions, Plan};
use crate::mission::Mission;
use crate::view::{COMMON, ItemId, Mode, ViewOptions, headlines, inside};

/// The style used to decide what is drawn.
const PLAIN: &str = "light";
/// The largest page that `--fit auto` grows to.
pub(super) const LARGEST: Size = Size::new(1920.0, 1080.0);
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
struct Spared {
    space: Arc<str>,
    outside: Vec<Arc<str>>,
}

/// The best drawing so far.
struct Fitting<'a> {
    mission: &'a Mission,
    drawing: &'a Drawing,
    best: Attempt,
    layouts: Layouts,
}

/// Chooses what is shown and lays it out on a page. `--fit auto` enlarges the page, then collapses namespaces, those
/// with the fewest changes first, until the smallest text is legible or nothing is left to collapse; then it bundles
/// topics if necessary, and reopens namespaces that fit after all.
pub(super) fn fitted(mission: &Mission, drawing: &Drawing, watch: &mut dyn Watch) -> Composed {
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
    let (asked, drawing) = (drawing, &plain);
    let mut fitting = Fitting {
        mission,
        drawing,
        best: Attempt::default(),
        layouts: Layouts::default(),
    };
    fitting.best = fitting.attempt(drawing.view.clone(), drawing.page.clone());
    fitting.take_higher_page();
    if drawing.is_fitted && !fitting.is_readable() {
        fitting.make_readable();
    }
    fitting.drawing = asked;
    if plain.style != asked.style {
        fitting.draw_again(asked);
    }
    let mut composed = fitting.composed();
    if !asked.is_sized && asked.is_fitted && asked.page.width_mm.is_none() {
        composed.page = cropped(&composed, asked);
    }
    if asked.medium.as_ref().is_some_and(|m| m.paper.is_some()) {
        composed.page = lowered(&composed, asked);
    }
    let notices = &mut composed.notices;
    notices.extend(picture::unshown(&composed.view, &asked.fonts));
    let remarks = composed.layout.remarks.iter();
    notices.extend(remarks.map(|text| Notice::new(NoticeKind::Note, text.as_str())));
    composed
}

impl Fitting<'_> {
    fn is_readable(&self) -> bool {
        self.best.is_readable(self.drawing)
    }

    fn options(&self) -> &ViewOptions {
        &self.best.composed.options
    }

    fn page(&self) -> &PageOptions {
        &self.best.composed.page
    }

    /// An attempt, with a layout if it may be legible or `--fit none` was given.
    fn attempt(&mut self, options: ViewOptions, page: PageOptions) -> Attempt {
        let (mission, drawing) = (self.mission, self.drawing);
        let boxes = mission.elements.nodes.len() + mission.elements.topics.len();
        if drawing.is_fitted && is_crowded(boxes, drawing, &page) {
            let composed = Composed::outline(mission, options.clone(), page.clone());
            if is_crowded(composed.view.items.len(), drawing, &page) {
                return Attempt {
                    composed,
                    ..Attempt::default()
                };
            }
        }
        self.laid_out(drawing, options, page)
    }

    /// An attempt with a layout in any case.
    fn laid_out(&mut self, drawing: &Drawing, options: ViewOptions, page: PageOptions) -> Attempt {
        // The widest labels depend on rates, so the windows are needed too.
        let mut composed = Composed::new(self.mission, options, page);
        let measured = composed.measured(drawing);
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
            let make = || drawing.laid_out(plan, page, Some(&composed.view));
            let layout = self.layouts.of(plan, page, make);
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
        composed.layout = layout;
        Attempt {
            composed,
            is_laid_out: true,
            text,
        }
    }

    /// Takes these options on this page if everything is legible; returns whether it is.
    fn take_if_readable(&mut self, options: ViewOptions, page: PageOptions) -> bool {
        let attempt = self.attempt(options, page);
        let is_readable = attempt.is_readable(self.drawing);
        if is_readable {
            self.best = attempt;
        }
        is_readable
    }

    /// Takes these options on the page so far.
    fn show(&mut self, options: ViewOptions) {
        self.best = self.attempt(options, self.page().clone());
    }

    /// Takes what is shown so far as another drawing draws it, however small its text is.
    fn draw_again(&mut self, drawing: &Drawing) {
        let (options, page) = (self.options().clone(), self.page().clone());
        self.best = self.laid_out(drawing, options, page);
    }

    fn make_readable(&mut self) {
        if !self.drawing.is_sized && self.page().width_mm.is_none() {
            let page = self.page_of(LARGEST);
            let boxes = self.best.composed.view.items.len();
            if self.best.is_laid_out || !is_crowded(boxes, self.drawing, &page) {
                self.best = self.attempt(self.options().clone(), page);
            } else {
                self.best.composed.page = page;
            }
        }
        self.show_if(!self.options().mode.is_direct(), |own| {
            own.mode = Mode::Nodes;
            own.is_bundled = true;
        });
        self.show_if(self.options().is_bundled, |own| own.counts_rows = true);
        // One box for the nodes of a namespace that are there in the same phases.
        let phases = self.mission.log.phases.iter().map(|phase| phase.span);
        self.show_if(self.options().is_still == Some(true), |own| {
            own.alike_in = phases.collect();
        });
        self.show_if(true, |own| own.are_leaves_in_words = true);
        self.show_if(self.options().is_bundled, |own| {
            own.are_unlinked_in_words = true;
        });
        let spared = self.collapse_the_steady();
        self.collapse_the_rest(spared);
        if self.is_readable() {
            self.open_again();
            self.list_rows_again();
        } else {
            self.bundle();
        }
        self.take_lower_page();
    }

    /// Changes what is shown and takes a higher page, where something is not legible yet and this applies.
    fn show_if(&mut self, applies: bool, change: impl FnOnce(&mut ViewOptions)) {
        if applies && !self.is_readable() {
            let mut options = self.options().clone();
            change(&mut options);
            self.show(options);
            self.take_higher_page();
        }
    }

    /// Takes the lowest page of a purpose on which everything is legible, else the highest if its text is larger.
    fn take_higher_page(&mut self) {
        let Some(highest) = self.sizes().pop() else {
            return;
        };
        if self.is_readable() || self.page().size == highest {
            return;
        }
        let attempt = self.attempt(self.options().clone(), self.page_of(highest));
        let is_readable = attempt.is_readable(self.drawing);
        if attempt.text > self.best.text || !attempt.is_laid_out {
            self.best = attempt;
        }
        if is_readable {
            self.take_lower_page();
        }
    }

    /// Takes the lowest page of a purpose on which the remaining text is legible.
    fn take_lower_page(&mut self) {
        let height = self.page().size.h;
        let mut lower = self.sizes().into_iter().take_while(|size| size.h < height);
        lower.any(|size| self.take_if_readable(self.options().clone(), self.page_of(size)));
    }

    /// The pages of the medium, the lowest first.
    fn sizes(&self) -> Vec<Size> {
        let medium = self.drawing.medium.as_ref();
        medium.map_or_else(Vec::new, |medium| medium.sizes.clone())
    }

    fn page_of(&self, size: Size) -> PageOptions {
        PageOptions {
            size,
            ..self.page().clone()
        }
    }

    /// Collapses the constant elements of namespaces until the text is legible. Returns the namespaces with the boxes
    /// that were left outside.
    fn collapse_the_steady(&mut self) -> Vec<Spared> {
        let reported = self.changing();
        let mut left: Vec<Spared> = Vec::new();
        loop {
            let mut options = self.options().clone();
            let view = &self.best.composed.view;
            let tried = left.iter().map(|other| &other.space);
            let tried: BTreeSet<&Arc<str>> = tried.chain(&options.collapse).collect();
            let mut fresh = view.collapsible(self.mission, &options);
            fresh.retain(|candidate| !tried.contains(&candidate.name));
            if self.is_readable() || fresh.is_empty() {
                return left;
            }
            let is_hopeless = self.best.text < self.drawing.readable() * HOPELESS;
            let before = options.collapse.len();
            let many = self.at_once(fresh.len());
            let changing = view.holding(&reported);
            let mut open: BTreeSet<Arc<str>> = options.expand.iter().cloned().collect();
            for candidate in fresh.into_iter().take(many) {
                let outside = inside(&changing, &candidate.name).flatten().cloned();
                let outside = outside.filter(|name| !is_hopeless && !open.contains(name));
                let outside: Vec<Arc<str>> = outside.collect();
                if outside.is_empty() || candidate.items >= outside.len() + FEWEST_STEADY {
                    options.collapse.push(Arc::clone(&candidate.name));
                    options.expand.extend(outside.iter().cloned());
                    open.extend(outside.iter().cloned());
                }
                if !outside.is_empty() {
                    left.push(Spared {
                        space: candidate.name,
                        outside,
                    });
                }
            }
            if options.collapse.len() > before {
                self.show(options);
            }
        }
    }

    /// The changing elements, the nodes that they connect, and the neighbours of those.
    fn changing(&self) -> BTreeSet<Element> {
        let elements = &self.mission.elements;
        let view = &self.best.composed.view;
        let mut reported: BTreeSet<Element> = headlines(self.mission).collect();
        let topics = reported.iter();
        let topics: BTreeSet<_> = topics.filter_map(|what| elements.ends(*what).1).collect();
        let edges = elements.edges().map(|(_, edge)| edge);
        let edges = edges.filter(|edge| topics.contains(&edge.topic));
        reported.extend(edges.map(|edge| Element::Node(edge.node)));
        let is_reported = |item: ItemId| {
            let mut members = view.items[item].members.iter();
            members.any(|member| reported.contains(member))
        };
        let lines = view.arrows.iter();
        let lines = lines.filter(|a| is_reported(a.from) != is_reported(a.to));
        let partners: BTreeSet<ItemId> = lines.flat_map(|arrow| [arrow.from, arrow.to]).collect();
        let members = partners.iter().flat_map(|item| &view.items[*item].members);
        let members: Vec<Element> = members.copied().collect();
        reported.extend(members);
        reported
    }

    /// Collapses these namespaces including the boxes left outside, until the text is legible.
    fn collapse_the_rest(&mut self, mut left: Vec<Spared>) {
        while !self.is_readable() && !left.is_empty() {
            let mut options = self.options().clone();
            let rest = left.drain(..self.at_once(left.len()));
            let rest = rest.map(|of| (of.space, of.outside));
            let (mut spaces, outside): (Vec<_>, Vec<_>) = rest.unzip();
            let outside: BTreeSet<Arc<str>> = outside.into_iter().flatten().collect();
            options.expand.retain(|kept| !outside.contains(kept));
            let collapsed: BTreeSet<&Arc<str>> = options.collapse.iter().collect();
            spaces.retain(|space| !collapsed.contains(space));
            options.collapse.extend(spaces);
            self.show(options);
        }
    }

    /// How many of so many namespaces are collapsed at once: one; two if the text is too small for one to suffice, or a
    /// quarter if it is far too small, which saves a layout per namespace.
    fn at_once(&self, many: usize) -> usize {
        let share = self.best.text / self.drawing.readable();
        many.min(if share < FAR {
            many.div_ceil(4)
        } else if share < SMALL {
            2
        } else {
            1
        })
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
        let names: Vec<&str> = nodes.map(|node| node.name.as_str()).collect();
        let common = common_space(&names);
        let spaces = names.iter().filter_map(|name| outermost(name, common));
        let mut spaces: BTreeSet<Arc<str>> = spaces.map(Arc::from).collect();
        spaces.retain(|space| !bundled.expand.contains(space));
        bundled.collapse.extend(spaces);
        let attempt = self.attempt(bundled, self.page().clone());
        if attempt.text > self.best.text && attempt.composed.view.items.len() > 1 {
            self.best = attempt;
        }
    }

    /// Reopens namespaces that need not be collapsed, the outermost first: of a fleet, the namespaces inside a robot are
    /// collapsed before the robots, whose boxes then leave room for some of them.
    fn open_again(&mut self) {
        let asked = self.drawing.view.collapse.len();
        let collapsed = self.options().collapse[asked..].to_vec();
        for name in collapsed.iter().rev().take(MOST_REOPENED) {
            let mut opened = self.options().clone();
            opened.collapse.retain(|n| n != name);
            self.take_if_readable(opened, self.page().clone());
        }
    }

    /// Lists the rows of boxes again if there is room for them after all.
    fn list_rows_again(&mut self) {
        if self.options().counts_rows && !self.options().are_unlinked_in_words {
            let options = ViewOptions {
                counts_rows: false,
                ..self.options().clone()
            };
            self.take_if_readable(options, self.page().clone());
        }
    }

    /// The drawing with notices about what was done to make it legible, and whether that was sufficient.
    fn composed(mut self) -> Composed {
        let drawing = self.drawing;
        if drawing.is_fitted && !self.is_readable() {
            // No effort has been made to improve an illegible drawing.
            self.draw_again(&Drawing {
                is_fitted: false,
                ..drawing.clone()
            });
        }
        let (mut composed, text) = (self.best.composed, self.best.text);
        if drawing.is_fitted || drawing.medium.is_some() {
            let collapsed = &composed.options.collapse[drawing.view.collapse.len()..];
            let kept = &composed.options.expand[drawing.view.expand.len()..];
            let parts = parts(collapsed, kept);
            let reported = reported(drawing, &parts, &composed.page, text);
            composed.notices.extend(reported.iter());
            if composed.options.is_bundled != drawing.view.is_bundled {
                let text = format!(
                    "drew one line per pair of boxes{}; draw each topic with `--fit none`",
                    so_that(text >= drawing.readable())
                );
                let notice = Notice::new(NoticeKind::Hidden, text);
                composed.notices.add(notice);
            }
        }
        composed
    }
}

/// The first part of a name that has more than one: `/robot1` of `/robot1/nav/planner`; in a namespace that is common to
/// all names, the first part below it.
fn outermost<'n>(name: &'n str, common: &str) -> Option<&'n str> {
    let around = Some(common).filter(|space| lies_in(name, space));
    let start = around.map_or(0, str::len) + 1;
    let end = name.get(start..)?.find('/')? + start;
    name.get(..end)
}

/// The outermost namespace of nearly all of these names; empty if there is none.
fn common_space<'n>(names: &[&'n str]) -> &'n str {
    let spaces = names.iter().filter_map(|name| outermost(name, ""));
    let spaces = grouped(spaces.map(|space| (space, ())));
    let most = names.len() * COMMON.0 / COMMON.1;
    let common = spaces.into_iter().find(|(_, all)| all.len() > most);
    common.map_or("", |(space, _)| space)
}

/// The layouts by one engine so far: collapsing or opening a namespace inside a collapsed one changes nothing.
#[derive(Default)]
struct Layouts(Vec<(Plan, LayoutOptions, Layout)>);

impl Layouts {
    /// The layout of a plan, made unless there is one.
    fn of(&mut self, plan: &Plan, page: &LayoutOptions, make: impl FnOnce() -> Layout) -> Layout {
        let is_same = |made: &&(Plan, LayoutOptions, Layout)| made.1 == *page && made.0 == *plan;
        if let Some((_, _, layout)) = self.0.iter().find(is_same) {
            return layout.clone();
        }
        let layout = make();
        self.0.push((plan.clone(), *page, layout.clone()));
        layout
    }
}

/// What some options show on a page.
#[derive(Default)]
struct Attempt {
    composed: Composed,
    /// Whether it is laid out; not if there are too many boxes for any legible layout.
    is_laid_out: bool,
    /// The size of its smallest text in pixels; 0 without a layout.
    text: f64,
}

impl Attempt {
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

/// The size of names on a page cropped to its graph, in pixels.
const NAMES_PX: f64 = 15.0;
/// The space around the graph on such a page, in pixels.
const AROUND: f64 = 20.0;
/// The minimum width of such a page for an animation, which has a timeline, and for a still; and the minimum height.
const LEAST: (f64, f64, f64) = (720.0, 320.0, 140.0);
/// The minimum width of such a page with a legend.
const LEGEND: f64 = 480.0;
/// The width of a page with decorations (title, legend, timeline) of normal size, and their smallest legible scale.
const DECORATIONS: (f64, f64) = (1100.0, 0.8);

/// The page of a medium as high as its graph: paper is no wider or narrower, but need not stay empty.
fn lowered(composed: &Composed, drawing: &Drawing) -> PageOptions {
    let page = &composed.page;
    let measured = composed.measured(drawing);
    let graph = composed.layout.size.h * measured.scale(&composed.layout);
    let high = page.size.h - measured.layout_options().page.h + graph;
    PageOptions {
        size: Size::new(page.size.w, libm::ceil(high).min(page.size.h)),
        ..page.clone()
    }
}

/// The page cropped to its graph, if names of a legible size leave it empty.
fn cropped(composed: &Composed, drawing: &Drawing) -> PageOptions {
    let (view, page, natural) = (&composed.view, &composed.page, composed.layout.size);
    let largest = NAMES_PX / drawing.style.node.size;
    let measured = composed.measured(drawing);
    let scale = measured.scale(&composed.layout).min(largest);
    let least = if view.has_time() { LEAST.0 } else { LEAST.1 };
    let wide = (natural.w * scale + 2.0 * AROUND).max(least);
    let wide = wide.min(page.size.w);
    let mut cropped = PageOptions {
        size: Size::new(wide, page.size.h),
        unit: Some((wide / DECORATIONS.0).clamp(DECORATIONS.1, 1.0)),
        has_legend: page.has_legend && wide >= LEGEND,
        ..page.clone()
    };
    let measured = drawing.measured(view, cropped.clone());
    let decorations = page.size.h - measured.layout_options().page.h;
    let high = decorations + natural.h * scale + 1.2 * AROUND;
    cropped.size = Size::new(libm::ceil(wide), libm::ceil(high.max(LEAST.2)));
    if cropped.size.h < page.size.h {
        cropped
    } else {
        page.clone()
    }
}

/// The collapsed namespaces as text, each with the number of changing elements kept outside.
fn parts(collapsed: &[Arc<str>], kept: &[Arc<str>]) -> Vec<(Arc<str>, String)> {
    let kept = grouped(kept.iter().map(|name| (&**name, ())));
    let reported = |name: &Arc<str>| {
        let words = match inside(&kept, name).flatten().count() {
            0 => name.to_string(),
            many => format!("{name} except {} in it", words::count(many, "node")),
        };
        (Arc::clone(name), words)
    };
    collapsed.iter().map(reported).collect()
}

/// The notices about what `--fit auto` did, and whether it was sufficient: the smallest text is `text` pixels high.
fn reported(
    drawing: &Drawing,
    collapsed: &[(Arc<str>, String)],
    got: &PageOptions,
    text: f64,
) -> Notices {
    let mut notices = Notices::new();
    let is_readable = text >= drawing.readable();
    if drawing.page.size != got.size && drawing.medium.is_none() {
        let text = format!(
            "the page is {}x{}{} (change with `--size`)",
            got.size.w,
            got.size.h,
            so_that(is_readable)
        );
        notices.add(Notice::new(NoticeKind::Chosen, text));
    }
    if let Some((first, _)) = collapsed.first() {
        let text = format!(
            "drew namespaces as one box each{}: {}; keep one open with `--collapse -{first}`, all with `--fit none`",
            so_that(is_readable),
            words::some_of(collapsed.iter().map(|(_, words)| words), 3)
        );
        notices.add(Notice::new(NoticeKind::Hidden, text));
    }
    if drawing.medium.is_some() && !is_readable {
        let (size, unit, advice) = if let Some(mm) = got.width_mm {
            let advice = "draw less with `--ns-filter` or `--mode nodes`, or print it wider";
            (text * mm / got.size.w * 72.0 / 25.4, "pt", advice)
        } else {
            let advice = "draw less with `--ns-filter`, `--hide dead,leaf` or `--mode nodes`";
            (text, "pixels", advice)
        };
        let size = words::number(words::significant(size, 2));
        let text = format!("the smallest text will be {size} {unit}, too small to read; {advice}");
        notices.add(Notice::new(NoticeKind::Note, text));
    } else if !is_readable {
        let text = format!(
            "the smallest text is {} pixels high, too small to read; use `--ns-filter`, `--hide dead,leaf`, `--mode nodes` or a larger `--size`",
            words::number(text)
        );
        notices.add(Notice::new(NoticeKind::Note, text));
    }
    notices
}

fn so_that(is_readable: bool) -> &'static str {
    if is_readable {
        " to keep labels legible"
    } else {
        ""
    }
}
