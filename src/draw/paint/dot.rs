//! The viewed graph as DOT text, laid out as `rqt_graph` saves and loads it; Graphviz draws it, too.
//!
//! Names, shapes and attributes are those of `rqt_graph`'s `dotcode.py` and `qt_dotgraph`'s
//! `pydotfactory.py`; everything that is written can be loaded by `dot_to_qt.py`.

mod names;
mod rqt;

use crate::base::geometry::Size;
use crate::base::words;
use crate::draw::picture::options;
use crate::draw::style::Style;
use crate::draw::text::{Fonts, Weight};
use crate::evidence::Evidence;
use crate::graph::{ById, Element, Elements, Id as _, State};
use crate::layout::{self, Layout, Link, Orientation, Outline, Plan, Vertex};
use crate::mission::Mission;
use crate::view::{Arrow, ArrowKind, ItemKind, Mark, Shown, ShownRuns, View};

/// The font size of `qt_dotgraph`, in points; one point is one pixel of ours.
const FONT: f64 = 11.0;
/// The factor by which texts may be wider there: it draws with the system's sans, not with our font.
const SLACK: f64 = 1.15;
/// The height of nodes and topics, Graphviz's half inch.
const HEIGHT: f64 = 36.0;
/// The height of a line of text of that font, in points.
const LINE: f64 = 15.0;

/// A view with the parts that all its DOT files share: unique ids and one layout.
pub(crate) struct DotView<'a> {
    elements: &'a Elements,
    view: &'a View,
    style: Style,
    ids: names::DotIds,
    /// Sizes, with full names as labels.
    plan: Plan,
    layout: Layout,
}

impl<'a> DotView<'a> {
    /// Lays a view out, with sizes by full names as in `qt_dotgraph`; its colours for changes come from `style`.
    pub(crate) fn new(mission: &'a Mission, view: &'a View, style: Style, fonts: &Fonts) -> Self {
        let plan = plan(view, fonts);
        let options = layout::LayoutOptions {
            page: Size::new(1600.0, 900.0),
            orientation: Some(Orientation::LeftRight),
            ..layout::LayoutOptions::default()
        };
        Self {
            elements: &mission.elements,
            view,
            style,
            ids: names::DotIds::new(view),
            layout: layout::lay_out(&plan, &options, layout::ENGINES[0].1),
            plan,
        }
    }

    /// The words of the evidence for an item or arrow.
    fn evidence(&self, members: &[Element]) -> String {
        let known = members.iter().map(|what| self.elements.evidence(*what));
        let words: Vec<&str> = known.fold(Evidence::NONE, Evidence::and).words().collect();
        words.join(" ")
    }

    /// The colour of a change; `None` for an unchanged element.
    fn colour(&self, shown: &Shown) -> Option<String> {
        let change = options::change(&self.style, shown.mark?);
        Some(change.color.to_string().to_lowercase())
    }
}

/// The line of an arrow: solid for one that is known, dashed for one that is inferred or gone, dotted for one that is
/// silent.
fn line(shown: &Shown) -> &'static str {
    use crate::evidence::Confidence;
    match (shown.mark, shown.confidence, shown.state) {
        (Some(Mark::Away), ..) => "dotted",
        (Some(Mark::Removed), ..) | (_, Confidence::Inferred, _) => "dashed",
        (_, Confidence::Declared, _) | (.., State::Silent | State::Declared) => "dotted",
        _ => "solid",
    }
}

/// The label of an arrow in a window, with lines separated by newlines: the topic between two nodes, and the
/// rate.
fn label(arrow: &Arrow, shown: &Shown) -> Option<String> {
    match (arrow.carries(shown), rate(shown)) {
        (Some(topic), Some(rate)) => Some(format!("{topic}\n{rate}")),
        (topic, rate) => topic.or(rate),
    }
}

/// A rate as in `rqt_graph`; `None` if there are no messages.
fn rate(shown: &Shown) -> Option<String> {
    let hz = shown.hz.filter(|hz| *hz > 0.0 && hz.is_finite())?;
    (shown.mark != Some(Mark::Removed)).then(|| words::rate(hz))
}

/// The width of a line in whole points, 1 to 5, a step per factor of ten from 1 Hz on.
fn pen_width(shown: &Shown) -> u8 {
    match shown.hz.unwrap_or(0.0) {
        hz if hz >= 1000.0 => 5,
        hz if hz >= 100.0 => 4,
        hz if hz >= 10.0 => 3,
        hz if hz >= 1.0 => 2,
        _ => 1,
    }
}

fn plan(view: &View, fonts: &Fonts) -> Plan {
    let width = |text: &str| fonts.width(text, FONT, Weight::Regular) * SLACK;
    let vertices = view.items.iter().map(|item| {
        let text = width(&item.name);
        let (outline, width) = match item.kind {
            ItemKind::Node | ItemKind::Namespace => (Outline::Ellipse, text * 1.2 + 20.0),
            ItemKind::Topic => (Outline::Box, text + 16.0),
            ItemKind::Group => (Outline::Box, text + 24.0),
        };
        Vertex {
            size: Size::new(width.max(54.0), HEIGHT),
            outline,
            cluster: item.cluster,
        }
    });
    let mut widest = ById::like(&view.arrows, None::<Size>);
    for shown in view.arrows_shown.iter().flat_map(ShownRuns::distinct) {
        let arrow = view.arrows.get(shown.arrow());
        let label = arrow.and_then(|arrow| label(arrow, shown));
        if let (Some(label), Some(most)) = (label, widest.get_mut(shown.arrow())) {
            let room = most.get_or_insert_default();
            room.w = label.lines().map(width).fold(room.w, f64::max);
            room.h = room.h.max(LINE * label.lines().count() as f64);
        }
    }
    let links = view.arrows.iter().zip(widest).map(|(arrow, widest)| Link {
        from: arrow.from.at(),
        to: arrow.to.at(),
        label: widest.map(|room| Size::new(room.w + 8.0, room.h)),
        ..Link::default()
    });
    let clusters = view.namespaces.iter().map(|space| layout::Cluster {
        parent: space.parent,
        title: Size::new(width(&space.name), LINE),
        footer: Size::default(),
    });
    Plan {
        vertices: vertices.collect(),
        links: links.collect(),
        clusters: clusters.collect(),
        // The labels of several topics between two nodes need space between their lines.
        is_labelled: view
            .arrows
            .iter()
            .any(|arrow| matches!(arrow.kind, ArrowKind::Direct(_))),
    }
}
