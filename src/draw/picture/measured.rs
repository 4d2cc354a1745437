//! The plan to lay out: every label at its widest, and every namespace with a box.

use std::collections::BTreeSet;

use super::boxes::{self, Card};
use super::gates::{self, Gate, larger};
use super::options;
use super::spaces::{self, Footer, Space, first_seen, spaces};
use super::texts::{
    self, BADGE_HEIGHT, BADGE_PAD, LINE, Label, NO_MESSAGE, ShownRates, arrow_label, counting,
    second_line, short_name, shown_rates,
};
use crate::base::geometry::Size;
use crate::base::name::namespace;
use crate::base::words;
use crate::draw::style::{Body, Style};
use crate::draw::text::{Fonts, Weight};
use crate::graph::{ById, Id as _};
use crate::layout::{self, Link, Outline, Plan, Vertex};
use crate::view::{Arrow, ArrowId, ArrowKind, Item, ItemId, ItemKind, Shown, ShownRuns, View};

/// The largest width of a name in pixels, and in heights of its letters if these are large; longer ones are shortened in
/// their middle. About 30 letters: of a wider box, a layer of the graph would be mostly space.
const WIDEST: (f64, f64) = (230.0, 16.4);
/// The most names below the first in a box; the others are counted. With six lines, a box
/// is as high as three.
const MOST_OTHERS: usize = 5;
/// The space above and below the name in a rounded box, relative to that in an ellipse, whose curve comes closer to the
/// letters.
const FLAT: f64 = 0.7;

/// The labels of a view, and the plan that follows from them.
pub(crate) struct MeasuredGraph {
    pub(crate) plan: Plan,
    pub(crate) labels: Vec<Label>,
    pub(crate) spaces: Vec<Space>,
    /// The names of the topics of each bundle as drawn; none for other arrows.
    pub(crate) topics: Vec<Vec<String>>,
    /// The lines of namespaces that are drawn as one, with the names of their topics.
    pub(crate) gates: Vec<(Gate, Vec<String>)>,
    /// The first window with any content, by namespace.
    pub(crate) first_seen: Vec<usize>,
    /// The rows of each box.
    pub(crate) cards: Vec<Card>,
    /// The words for nodes and topics that have no box. Those outside of all namespaces have the plan's last vertex.
    pub(crate) footers: Vec<Footer>,
}

impl MeasuredGraph {
    pub(crate) fn new(view: &View, style: &Style, fonts: &Fonts) -> Self {
        let spaces = spaces(view, fonts);
        let drafter = Measurer { view, style, fonts };
        let seconds = drafter.second_lines();
        let mut labels = Vec::new();
        let mut vertices = Vec::new();
        let mut cards = boxes::cards(view, style, fonts);
        for (at, item) in view.items.iter().enumerate() {
            let inside = item.cluster.and_then(|c| spaces.get(c));
            let inside = inside.map_or("", |space| space.name.as_str());
            let mut label = drafter.label(item, inside, seconds[at].is_some());
            let presence = view.presences.get(ItemId::of(at));
            label.has_bar = presence.is_some_and(|presence| !presence.times.is_empty());
            let has_rows = cards[at].room.h > 0.0;
            let looks = view.items_shown.get(ItemId::of(at));
            let looks = looks.map_or(&[][..], ShownRuns::distinct).iter();
            let unlined = looks.map(|look| look.unlined.len()).max().unwrap_or(0);
            let first = counting(&label.name, label.counted + unlined);
            let second = seconds[at].unwrap_or(0.0);
            let mut size = drafter.size(item, &label, (&first, second), has_rows);
            if has_rows {
                let room = cards[at].room;
                cards[at].head = size.h;
                size = Size::new(size.w.max(room.w), size.h + room.h);
            }
            vertices.push(Vertex {
                size,
                outline: outline(item, has_rows || !item.others.is_empty(), style),
                cluster: item.cluster,
            });
            labels.push(label);
        }
        let size = style.edge.size;
        let fitted = |arrow: &Arrow| -> Vec<String> {
            let names = texts::names(view, arrow).into_iter();
            names
                .map(|name| texts::fitted(&name, fonts, size))
                .collect()
        };
        let topics: Vec<Vec<String>> = view.arrows.iter().map(fitted).collect();
        let mut rooms = drafter.rooms(&topics);
        let named = |gate: Gate| {
            let names = fitted(&gate.arrow);
            (gate, names)
        };
        let gates: Vec<_> = gates::gates(view).into_iter().map(named).collect();
        let forks = gates::forks(view, &gates);
        gates::share(view, fonts, &style.edge, &mut rooms, &gates, &forks);
        let through: BTreeSet<ArrowId> = gates.iter().flat_map(|(gate, _)| gate.lines()).collect();
        let links = view.arrows.with_ids().zip(&rooms).zip(&forks);
        let links = links.map(|(((id, arrow), room), fork)| Link {
            from: arrow.from.at(),
            to: arrow.to.at(),
            label: *room,
            fork: *fork,
            is_outside: through.contains(&id),
        });
        let clusters = view.namespaces.iter().zip(&spaces);
        let clusters = clusters.map(|(namespace, space)| layout::Cluster {
            parent: namespace.parent,
            title: drafter.title(space),
            footer: Size::default(),
        });
        let mut clusters: Vec<layout::Cluster> = clusters.collect();
        let footers = spaces::footers(view, style, fonts);
        for footer in &footers {
            match footer.cluster {
                Some(at) => clusters[at].footer = footer.room,
                None => vertices.push(Vertex {
                    size: footer.room,
                    outline: Outline::Box,
                    cluster: None,
                }),
            }
        }
        let plan = Plan {
            vertices,
            links: links.collect(),
            clusters,
            // Lines between nodes name their topics.
            is_labelled: (view.arrows.iter().zip(&rooms)).any(|(arrow, room)| {
                let is_direct = matches!(arrow.kind, ArrowKind::Bundle | ArrowKind::Direct(_));
                is_direct && room.is_some()
            }),
        };
        Self {
            plan,
            labels,
            spaces,
            topics,
            gates,
            cards,
            footers,
            first_seen: first_seen(view),
        }
    }
}

/// The outline of a box: rows need straight sides.
fn outline(item: &Item, has_rows: bool, style: &Style) -> Outline {
    match item.kind {
        ItemKind::Node if has_rows => Outline::Box,
        ItemKind::Node if style.node.is_capsule() => Outline::Capsule,
        ItemKind::Node => Outline::Ellipse,
        _ => Outline::Box,
    }
}

struct Measurer<'a> {
    view: &'a View,
    style: &'a Style,
    fonts: &'a Fonts,
}

impl Measurer<'_> {
    fn title(&self, space: &Space) -> Size {
        let size = self.style.cluster.size;
        let title = self.fonts.width(&space.title, size, Weight::SemiBold);
        let last = spaces::badges(space, self.fonts, size).pop();
        let end = last.map_or(title, |(x, width)| x + width);
        Size::new(end, size * LINE)
    }

    fn label(&self, item: &Item, inside: &str, second: bool) -> Label {
        let body = options::body(self.style, item.kind);
        let whole = short_name(&item.label, inside);
        let mut name = self.fonts.shown(whole).into_owned();
        let unshown = (name != whole).then(|| words::visible(whole).into_owned());
        if item.kind == ItemKind::Namespace {
            let is_open =
                |other: &Item| other.kind == ItemKind::Node && other.cluster == item.cluster;
            name = if *item.name != *inside {
                name + "/…"
            } else if self.view.items.iter().any(is_open) {
                "all others".to_owned()
            } else {
                "all nodes".to_owned()
            };
        }
        let widest = WIDEST.0.max(WIDEST.1 * body.size);
        let fit = |name: &str, weight| {
            let fitted = self.fonts.fit(name, body.size, weight, widest);
            fitted.into_owned()
        };
        let named = item.others.len().min(MOST_OTHERS);
        let others = item.others.iter().take(named).map(|other| {
            // Below a name with its namespace, one without it is in the same.
            let inside = if inside.is_empty() {
                namespace(&item.label)
            } else {
                inside
            };
            let other = self.fonts.shown(short_name(other, inside)).into_owned();
            fit(&other, Weight::Regular)
        });
        let mut others: Vec<String> = others.collect();
        if item.others.len() > named {
            others.push(format!("+{} more", item.others.len() - named));
        }
        Label {
            name: fit(&name, body.weight()),
            counted: item.counted.len(),
            others,
            second,
            has_bar: false,
            unshown,
        }
    }

    /// The size of a box with this label, whose longest first line is `first` and whose changing smaller lines are at most
    /// `second` wide; for one with rows, that of the part above them.
    fn size(
        &self,
        item: &Item,
        label: &Label,
        (first, second): (&str, f64),
        has_rows: bool,
    ) -> Size {
        let body = options::body(self.style, item.kind);
        let width = self.fonts.width(first, body.size, body.weight());
        let others = label.others.iter();
        let others = others.map(|name| self.fonts.width(name, body.size, Weight::Regular));
        let width = others.fold(width.max(second), f64::max);
        let height = label.height(body);
        let depth = match item.kind {
            ItemKind::Node if has_rows || !label.others.is_empty() => 0.0,
            ItemKind::Node if body.is_capsule() => {
                let high = height + 2.0 * body.pad_y * FLAT;
                // The round ends hold 0.3 of the space that straight ends need.
                return Size::new((width + 1.7 * body.pad_x).max(high), high);
            }
            ItemKind::Node => return ellipse(width, height, body),
            ItemKind::Topic => 0.0,
            ItemKind::Group | ItemKind::Namespace => self.style.stack.depth,
        };
        let (x, y) = (2.0 * body.pad_x, 2.0 * body.pad_y);
        Size::new(width + x + depth, height + y + depth)
    }

    /// The width of the widest smaller line that each box shows in some window: lifecycle states and rates.
    fn second_lines(&self) -> Vec<Option<f64>> {
        let shown_rates = shown_rates(self.view);
        let mut widest = vec![None; self.view.items.len()];
        for shown in self.view.items_shown.iter().flat_map(ShownRuns::distinct) {
            let at = shown.id as usize;
            let Some(item) = self.view.items.get(shown.item()) else {
                continue;
            };
            if let Some(line) = second_line(shown, shown_rates[at]) {
                let size = options::body(self.style, item.kind).small;
                let width = |text: &str| self.fonts.width(text, size, Weight::SemiBold);
                widen(&mut widest[at], width(&line).max(width(NO_MESSAGE)));
            }
        }
        widest
    }

    /// The space for the widest label that each arrow shows in some window.
    fn rooms(&self, topics: &[Vec<String>]) -> ById<ArrowId, Option<Size>> {
        let style = &self.style.edge;
        let reported = shown_by_arrows(self.view);
        let nothing = ShownRuns::default();
        let all = self.view.arrows.iter();
        let all = all.zip(&self.view.arrows_shown).zip(reported).zip(topics);
        let rooms = all.map(|(((arrow, looks), is_reported), names)| {
            let mut widest = None;
            if arrow.kind == ArrowKind::Bundle {
                // The box of a topic has its name and its rate.
                let to = self.view.items.get(arrow.to)?;
                if to.kind.word() == "topic" {
                    return None;
                }
                let rooms = looks.distinct().iter();
                let rooms =
                    rooms.filter_map(|s| texts::room(&texts::rows(s, names), self.fonts, style));
                return rooms.fold(None, |a, b| larger(a, Some(b)));
            }
            // A subscription shows its rate if its topic has another.
            let topic = self.view.items_shown.get(arrow.from);
            let topic = topic.filter(|_| is_reported && arrow.kind == ArrowKind::Subscribe);
            let looks = if is_reported { looks } else { &nothing };
            let both = [looks, topic.unwrap_or(&nothing)];
            for window in ShownRuns::turns(both.into_iter()) {
                let [shown, topic] = both.map(|looks| looks.at(window as usize));
                let label = shown.and_then(|shown| arrow_label(arrow, shown, topic));
                let Some((text, is_badge)) = label else {
                    continue;
                };
                let (weight, pad) = if is_badge {
                    (Weight::SemiBold, style.size * BADGE_PAD)
                } else {
                    (Weight::Regular, style.halo_width)
                };
                let width = self.fonts.width(&text, style.size, weight);
                widen(&mut widest, width + pad);
            }
            Some(Size::new(widest?, style.size * BADGE_HEIGHT))
        });
        rooms.collect()
    }
}

fn widen(most: &mut Option<f64>, width: f64) {
    *most = Some(most.map_or(width, |m: f64| m.max(width)));
}

/// Whether each arrow shows its rate: a publication whose topic does not, a subscription with another rate.
fn shown_by_arrows(view: &View) -> Vec<bool> {
    let shown_rates = shown_rates(view);
    let reported = |arrow: &Arrow| {
        arrow.kind != ArrowKind::Publish
            || shown_rates.get(arrow.to.at()) != Some(&ShownRates::Rates)
    };
    view.arrows.iter().map(reported).collect()
}

/// The element with this id among those of a window, which are sorted.
pub(crate) fn find(shown: &[Shown], id: usize) -> Option<&Shown> {
    let at = shown.binary_search_by_key(&id, |s| s.id as usize).ok()?;
    Some(&shown[at])
}

/// The size of an ellipse around a text of this size.
fn ellipse(width: f64, height: f64, body: &Body) -> Size {
    let full = height + 2.0 * body.pad_y;
    // Letters fill about three quarters of their lines; the ellipse passes their corners.
    let part = 0.75 * height / full;
    let stretch = 1.0 / libm::sqrt(1.0 - part * part);
    Size::new(width * stretch + 2.0 * body.pad_x, full)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_relative_to_their_namespace() {
        assert_eq!(short_name("/a/b/c", "/a"), "b/c");
        assert_eq!(short_name("/a", ""), "/a");
        assert_eq!(short_name("/a/", "/a"), "/a/");
        assert_eq!(short_name("/ab/c", "/a"), "/ab/c");
    }
}
