//! The view of a mission: the full graph filtered, grouped and collapsed; the full graph stays as it is.
//!
//! In come a mission and [`ViewOptions`]; out comes a [`View`]: boxes, arrows and namespaces, and for each window their looks
//! and the words for its changes. Open `items` first: it asks `choose` which elements are visible, `fold` which of them are
//! one box, and `listed` which are only words. `frames` then goes through the windows: `state` says what exists, `marked`
//! what changes, `caption` puts it into words; `shown` keeps their looks, without flicker between windows.

mod caption;
mod choose;
mod filtered;
mod fold;
mod frames;
mod items;
mod listed;
pub(crate) mod marked;
mod omitted;
mod options;
mod shown;
mod state;
mod still;

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::ids::{grouped, ids};
use crate::base::notice::Notices;
use crate::graph::{ById, Element};
use crate::mission::Mission;
pub(crate) use filtered::filtered;
pub use fold::box_rows::BoxRow;
pub use fold::namespaces::Collapsible;
pub(crate) use fold::namespaces::{COMMON, headlines, inside};
pub(crate) use frames::{BETWEEN_PHRASES, Words, joined};
pub use frames::{Frame, Headline, Phrase};
pub(crate) use listed::{DrawnPart, drawn_part};
pub use marked::OngoingEvent;
pub(crate) use omitted::{check_filters, none_pass, nothing, unmatched, unmatched_topics};
pub use options::{Grouping, Hide, Mode, NameFilter, ViewOptions};
use shown::sum;
pub use shown::{Mark, Members, Shown, ShownRuns, TopicRow};
pub(crate) use shown::{STEPS, decades};
pub use still::Presence;
pub(crate) use still::{headline, union};

/// The part of a mission that the picture shows, and a notice for everything that it leaves out.
pub fn view(mission: &Mission, options: &ViewOptions) -> (View, Notices) {
    let viewed = items::Viewed::new(mission, options);
    let notices = omitted::notes(&mission.elements, &viewed, options);
    let windows = frames::frames(mission, options, &viewed);
    let mut view = assembled(viewed, options, windows);
    let is_still = options.is_still.unwrap_or(view.frames.len() == 1);
    if is_still && !view.compares {
        view = still::still(view, mission);
    }
    (view, notices)
}

/// The boxes, arrows and namespaces of [`view`] without the windows, to try whether they fit on a page.
pub(crate) fn outline(mission: &Mission, options: &ViewOptions) -> View {
    let viewed = items::Viewed::new(mission, options);
    assembled(viewed, options, View::default())
}

fn assembled(viewed: items::Viewed<'_>, options: &ViewOptions, windows: View) -> View {
    let mut view = View {
        items: viewed.items,
        arrows: viewed.arrows,
        lists_few: options.is_bundled,
        ..windows
    };
    let boxes = view.items.len() - viewed.in_words;
    let words = view.items.split_off(boxes);
    let words_shown = view
        .items_shown
        .split_off(boxes.min(view.items_shown.len()));
    if options.is_picture {
        view.fold_leaves(options.hide.quiet);
        view.join_twins();
    }
    let fleets = &viewed.fleets.all;
    let names = fleets.iter().map(|fleet| &*fleet.name).collect();
    let depth = options.group.namespaces;
    view.namespaces = fold::namespaces::clusters(&mut view.items, depth, &names);
    let mut equal = Vec::new();
    for namespace in &mut view.namespaces {
        if let Some(at) = viewed.fleets.named(&namespace.name) {
            namespace.replicas = fleets[at].indices();
            equal.push(at);
        }
    }
    for frame in &mut view.frames {
        let member_list = |at: &usize| frame.member_lists.get(*at).cloned().unwrap_or_default();
        frame.member_lists = equal.iter().map(member_list).collect();
    }
    view.also = listed::also_here(words, words_shown, &view.namespaces);
    view
}

/// The kind of element that a box of the picture represents.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ItemKind {
    /// A node: drawn as an ellipse.
    Node,
    /// A topic: drawn as a rectangle.
    Topic,
    /// Several topics in one box (`box3d` in `rqt_graph`): an action, `/tf` with `/tf_static`, image transports.
    Group,
    /// A whole namespace, collapsed to one box.
    Namespace,
}

impl ItemKind {
    /// The word for its class in SVG: groups are topics, collapsed namespaces are nodes.
    pub fn word(self) -> &'static str {
        match self {
            Self::Node | Self::Namespace => "node",
            Self::Topic | Self::Group => "topic",
        }
    }
}

ids! {
    /// The id of an item: its index in [`View::items`].
    ItemId,
    /// The id of an arrow: its index in [`View::arrows`].
    ArrowId,
}

/// A box of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// The kind of element it represents.
    pub kind: ItemKind,
    /// The full name, unique among items of its word: `/base/driver`, `/go/action_topics`, `/tf`.
    pub name: Arc<str>,
    /// The full name as drawn: for a node, without the part that differs from run to run.
    pub label: Arc<str>,
    /// The nodes and topics it represents, sorted; one for a plain node or topic.
    pub members: Vec<Element>,
    /// The names of its other nodes, sorted, if several that are alike share the box.
    pub others: Vec<Arc<str>>,
    /// The names of topics that it alone is connected to and that have no row; they are counted beside its name.
    pub counted: Vec<Arc<str>>,
    /// Whether its members are the counterparts of each other in several equal namespaces.
    pub is_replica: bool,
    /// Whether it is a service: its clients write to it, and its server reads it.
    pub is_service: bool,
    /// The innermost namespace whose box contains it: an index into [`View::namespaces`].
    pub cluster: Option<usize>,
}

impl Item {
    /// The words for its class in SVG.
    pub(crate) fn class(&self) -> &'static str {
        if self.is_service {
            "topic service"
        } else {
            self.kind.word()
        }
    }
}

/// A namespace drawn as a box around its members.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Namespace {
    /// The full path: `/robot1/nav`.
    pub name: Arc<str>,
    /// The namespace around it: an index into [`View::namespaces`], smaller than its own.
    pub parent: Option<usize>,
    /// The indices of the equal namespaces drawn as this one: `01`, `02`; empty where it represents only itself.
    pub replicas: Vec<Arc<str>>,
}

/// Nodes and topics that are listed as words in a namespace, because no line leads to them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlsoHere {
    /// The innermost namespace with a box around them: an index into [`View::namespaces`].
    pub cluster: Option<usize>,
    /// The nodes, then the topics, each sorted by name.
    pub items: Vec<Item>,
    /// The looks of each, window by window.
    pub shown: Vec<ShownRuns>,
}

/// The presence of one of several equal namespaces in a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemberState {
    /// Absent.
    Away,
    /// Present from the beginning to the end.
    Here,
    /// Absent at the beginning, present at the end.
    Joined,
    /// Present at the beginning, absent at the end.
    Left,
}

impl MemberState {
    /// Whether it is present at the end.
    pub(crate) fn is_here(self) -> bool {
        matches!(self, Self::Here | Self::Joined)
    }
}

/// The kind of connection that an arrow of the picture represents.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ArrowKind {
    /// From a node to a topic that it publishes.
    Publish,
    /// From a topic to a node that subscribes to it.
    Subscribe,
    /// From a node to a node over this topic or action ([`Mode::Nodes`] in graph files).
    Direct(Arc<str>),
    /// Between two boxes, over all topics between them in both directions ([`Mode::Nodes`] in pictures).
    Bundle,
}

impl ArrowKind {
    /// The word for its class in SVG.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Publish => "publish",
            Self::Subscribe => "subscribe",
            Self::Direct(_) => "direct",
            Self::Bundle => "bundle",
        }
    }
}

/// An arrow of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrow {
    /// The item it begins at.
    pub from: ItemId,
    /// The item it ends at.
    pub to: ItemId,
    /// The kind of connection it represents.
    pub kind: ArrowKind,
    /// The edges it represents, sorted.
    pub members: Vec<Element>,
    /// The names of the topics of a bundle, sorted, with those of an action or of an image's transports as
    /// one; empty for all other arrows.
    pub topics: Vec<Arc<str>>,
    /// Whether it represents only calls of services.
    pub is_service: bool,
}

impl Arrow {
    /// The words for its class in SVG.
    pub(crate) fn class(&self) -> String {
        let service = if self.is_service { " service" } else { "" };
        format!("{}{service}", self.kind.word())
    }

    /// The topic that an arrow from node to node carries, or the topics of a bundle in a window (`/scan +5`), those
    /// with the highest rate first; `None` for one from or to a topic.
    pub fn carries(&self, shown: &Shown) -> Option<String> {
        let topic = match &self.kind {
            ArrowKind::Publish | ArrowKind::Subscribe => return None,
            ArrowKind::Direct(topic) => topic,
            ArrowKind::Bundle => self.topics.get(shown.by_rate().next()?.topic as usize)?,
        };
        let more = shown.topics.len().saturating_sub(1);
        Some(if more > 0 {
            format!("{topic} +{more}")
        } else {
            topic.to_string()
        })
    }

    /// The names of the topics that a bundle carries in a window.
    pub(crate) fn topics_in(&self, shown: &Shown) -> Vec<&str> {
        let names = shown.topics.iter();
        let names = names.map(|row| self.topics.get(row.topic as usize));
        names.flatten().map(|name| &**name).collect()
    }
}

/// The number of headlines of each kind in a window, for badges and captions. They count the whole graph,
/// even if several elements are drawn as one box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// The number of nodes that started.
    pub nodes_added: usize,
    /// The number of nodes that stopped.
    pub nodes_removed: usize,
    /// The number of topics of unknown publisher that appeared.
    pub topics_added: usize,
    /// The number of topics of unknown publisher that vanished.
    pub topics_removed: usize,
    /// The number of new connections of running nodes.
    pub edges_added: usize,
    /// The number of connections that running nodes closed.
    pub edges_removed: usize,
    /// The number of nodes that ended and returned.
    pub restarted: usize,
    /// The number of nodes and topics that paused.
    pub silent: usize,
    /// The number of topics that other senders took over.
    pub handed_over: usize,
    /// The number of rates that changed.
    pub rates: usize,
    /// The number of lifecycle states, types and qualities of service that changed.
    pub values: usize,
}

/// The items and arrows of a window, ghosts included, each list sorted by id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeenWindow {
    /// The items.
    pub items: Vec<Shown>,
    /// The arrows.
    pub arrows: Vec<Shown>,
}

/// The whole sequence as the picture shows it. Items are sorted by (kind, name), arrows by (from, to, kind),
/// namespaces by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View {
    /// Every box ever shown.
    pub items: ById<ItemId, Item>,
    /// Every arrow ever shown.
    pub arrows: ById<ArrowId, Arrow>,
    /// Every namespace with a box around its members; parents before children.
    pub namespaces: Vec<Namespace>,
    /// The topics that are listed as rows in boxes.
    pub rows: Vec<BoxRow>,
    /// Whether a box lists at most three of these, else two and the number of the others.
    pub lists_few: bool,
    /// The nodes and topics that are listed as words, by namespace.
    pub also: Vec<AlsoHere>,
    /// The windows.
    pub frames: Vec<Frame>,
    /// The looks of each item, window by window.
    pub items_shown: ById<ItemId, ShownRuns>,
    /// The looks of each arrow, window by window.
    pub arrows_shown: ById<ArrowId, ShownRuns>,
    /// The times at which each item of a still was there; none for a film, and where nothing comes or goes.
    pub presences: ById<ItemId, Presence>,
    /// Whether two missions are compared, A and B, so that times, windows and the timeline are meaningless;
    /// the first of the two windows is A alone.
    pub compares: bool,
}

/// The namespaces, by index, and the items that a window shows directly in each namespace, and outside of all. Namespaces
/// nest at most 16 deep.
pub(crate) struct Contents<'a> {
    pub(crate) spaces: BTreeMap<Option<usize>, Vec<usize>>,
    pub(crate) items: BTreeMap<Option<usize>, Vec<(&'a Shown, &'a Item)>>,
}

impl View {
    /// The namespaces with a box around an item, the innermost first.
    pub(crate) fn around(&self, item: ItemId) -> impl Iterator<Item = usize> + '_ {
        let first = self.items.get(item).and_then(|item| item.cluster);
        // Parents have smaller indices, so this terminates.
        std::iter::successors(first, |at| self.namespaces.get(*at)?.parent)
    }

    /// For each namespace with a box, whether anything inside it is visible.
    pub(crate) fn inhabited(&self, seen: &SeenWindow) -> Vec<bool> {
        let mut inhabited = vec![false; self.namespaces.len()];
        let items = seen.items.iter().map(Shown::item);
        for at in items.flat_map(|item| self.around(item)) {
            inhabited[at] = true;
        }
        inhabited
    }

    /// What is in each namespace in a window.
    pub(crate) fn contents<'a>(&'a self, seen: &'a SeenWindow) -> Contents<'a> {
        let inhabited = self.inhabited(seen);
        let spaces = self.namespaces.iter().enumerate();
        let spaces = spaces.filter(|(at, _)| inhabited[*at]);
        let items = seen.items.iter().filter_map(|shown| {
            let item = self.items.get(shown.item())?;
            Some((item.cluster, (shown, item)))
        });
        Contents {
            spaces: grouped(spaces.map(|(at, space)| (space.parent, at))),
            items: grouped(items),
        }
    }

    /// Whether there is a time axis to show: not for two compared missions, and not for one window.
    pub(crate) fn has_time(&self) -> bool {
        !self.compares && self.frames.len() > 1
    }

    /// Whether it is a still: one window, in which nothing changes.
    pub(crate) fn is_still(&self) -> bool {
        !self.compares && self.frames.len() == 1
    }

    /// Whether window `k` shows a change.
    pub fn is_changed(&self, k: usize) -> bool {
        self.frames.get(k).is_some_and(Frame::is_changed)
    }

    /// The items and arrows visible in window `k`; none past the last one.
    pub fn seen(&self, k: usize) -> SeenWindow {
        let of = |all: &[ShownRuns]| all.iter().filter_map(|one| self.seen_at(one, k)).collect();
        SeenWindow {
            items: of(&self.items_shown),
            arrows: of(&self.arrows_shown),
        }
    }

    /// The look of an element in window `k`.
    pub(crate) fn seen_at(&self, looks: &ShownRuns, k: usize) -> Option<Shown> {
        let mut shown = looks.at(k)?.clone();
        shown.is_one_of_many = self.frames.get(k)?.is_one_of_many(&shown.events);
        Some(shown)
    }

    /// Every look of any item or arrow, in no particular order.
    pub fn all_shown(&self) -> impl Iterator<Item = &Shown> {
        let all = self.items_shown.iter().chain(&self.arrows_shown);
        let also = self.also.iter().flat_map(|also| &also.shown);
        let rows = self.rows.iter().map(|row| &row.shown);
        all.chain(also).chain(rows).flat_map(ShownRuns::distinct)
    }

    /// The index of the window with most headlines, the first of several; [`View::busiest`] if there are
    /// none.
    pub(crate) fn busiest_change(&self) -> usize {
        let headlines = |k: &usize| self.frames[*k].headlines.len();
        let best = (0..self.frames.len()).rev().max_by_key(headlines);
        let best = best.filter(|k| headlines(k) > 0);
        best.unwrap_or_else(|| self.busiest())
    }

    /// Whether a part of it represents several elements that could be drawn separately: a namespace, a fleet,
    /// a bundle.
    pub(crate) fn is_folded(&self) -> bool {
        let is_one = |i: &Item| i.kind == ItemKind::Namespace || i.is_replica;
        let is_bundle = |a: &Arrow| a.kind == ArrowKind::Bundle;
        self.items.iter().any(is_one) || self.arrows.iter().any(is_bundle)
    }

    /// The index of the window that shows most; the first of several.
    pub fn busiest(&self) -> usize {
        let is_there = |s: &Shown| s.mark != Some(Mark::Removed);
        // The increase since the previous window.
        let mut more = vec![0_i64; self.frames.len()];
        let rows = self.rows.iter().map(|row| &row.shown);
        let all = self.items_shown.iter().chain(&self.arrows_shown);
        for looks in all.chain(rows) {
            let mut was = false;
            for (window, shown) in looks.runs() {
                let is = shown.is_some_and(is_there);
                if let Some(more) = more.get_mut(window as usize) {
                    *more += i64::from(is) - i64::from(was);
                }
                was = is;
            }
        }
        let (mut best, mut there) = ((0, 0), 0);
        for (at, more) in more.into_iter().enumerate() {
            there += more;
            if there > best.1 {
                best = (at, there);
            }
        }
        best.0
    }
}

#[cfg(test)]
pub(crate) mod testing;
