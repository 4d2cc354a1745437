//! What the picture shows: the full graph filtered, grouped and collapsed; the full graph stays as it is.

mod caption;
mod cluster;
mod collapse;
mod counts;
mod filter;
mod filtered;
mod frames;
mod group;
mod hidden;
mod items;
mod marks;
mod names;
mod options;
pub mod runs;
mod select;
mod state;
pub mod union;

use std::sync::Arc;

use crate::base::notice::Notices;
use crate::base::time::Span;
use crate::evidence::Degree;
use crate::graph::{Element, State};
use crate::mission::Mission;

pub use collapse::Candidate;
pub use filter::NameFilter;
pub use filtered::filtered;
pub use options::{Grouping, Hide, Mode, ViewOptions};

/// What the picture shows of a mission, and a notice for everything that it leaves out.
pub fn view(mission: &Mission, options: &ViewOptions) -> (View, Notices) {
    let viewed = items::Viewed::new(&mission.elements, options);
    let notices = hidden::notes(&mission.elements, &viewed, options);
    let frames = frames::frames(mission, options, &viewed);
    (stage(viewed, options, frames), notices)
}

/// The boxes, arrows and namespaces of [`view`] without the windows, for trying what fits on a page.
pub fn outline(mission: &Mission, options: &ViewOptions) -> View {
    let viewed = items::Viewed::new(&mission.elements, options);
    stage(viewed, options, Vec::new())
}

fn stage(viewed: items::Viewed, options: &ViewOptions, frames: Vec<Frame>) -> View {
    let mut items = viewed.items;
    let namespaces = cluster::clusters(&mut items, options.group.namespaces);
    View {
        items,
        arrows: viewed.arrows,
        namespaces,
        frames,
    }
}

/// What a box of the picture stands for.
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

/// A box of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// What it stands for.
    pub kind: ItemKind,
    /// The full name, unique among items of its word: `/base/driver`, `/go/action_topics`, `/tf`.
    pub name: Arc<str>,
    /// The nodes and topics it stands for, sorted; one for a plain node or topic.
    pub members: Vec<Element>,
    /// The innermost namespace whose box it stands in: a place in [`View::namespaces`].
    pub cluster: Option<usize>,
}

/// A namespace drawn as a box around its members.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Namespace {
    /// The full path: `/robot1/nav`.
    pub name: Arc<str>,
    /// The namespace around it: a place in [`View::namespaces`], smaller than its own.
    pub parent: Option<usize>,
}

/// What an arrow of the picture stands for.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ArrowKind {
    /// From a node to a topic that it publishes.
    Publish,
    /// From a topic to a node that subscribes it.
    Subscribe,
    /// From a node to a node, over this topic (mode *nodes only*).
    Direct(Arc<str>),
}

impl ArrowKind {
    /// The word for its class in SVG.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Publish => "publish",
            Self::Subscribe => "subscribe",
            Self::Direct(_) => "direct",
        }
    }
}

/// An arrow of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrow {
    /// Where it begins: a place in [`View::items`].
    pub from: u32,
    /// Where it ends: a place in [`View::items`].
    pub to: u32,
    /// What it stands for.
    pub kind: ArrowKind,
    /// The edges it stands for, sorted.
    pub members: Vec<Element>,
}

/// What happened to an item or arrow since the window before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Mark {
    /// It was not there.
    Added,
    /// It is gone: listed in this one window as a ghost.
    Removed,
    /// Its rate rose by more than the threshold.
    Faster,
    /// Its rate fell by more than the threshold.
    Slower,
    /// A topic whose publishers were replaced by others.
    HandedOver,
    /// A node that began anew under the same name.
    Restarted,
    /// Its lifecycle state, type or quality of service changed.
    Changed,
    /// Something inside a group or a collapsed namespace was added, removed or changed.
    Inside,
}

impl Mark {
    /// The class in SVG: `added`, `removed` or `changed`.
    pub fn class(self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::Removed => "removed",
            _ => "changed",
        }
    }
}

/// An item or arrow in one window.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Its place in [`View::items`] or [`View::arrows`].
    pub id: u32,
    /// How alive; for a ghost, how alive it was.
    pub state: State,
    /// How well known.
    pub degree: Degree,
    /// What happened to it.
    pub mark: Option<Mark>,
    /// Messages per second, if known (0 for a ghost).
    pub hz: Option<f64>,
    /// Messages per second in the window before, where `mark` is `Faster` or `Slower`.
    pub from_hz: Option<f64>,
    /// Messages in the window, if known.
    pub count: Option<u64>,
    /// The lifecycle state of a node, if it has one.
    pub lifecycle: Option<Arc<str>>,
}

/// How many changes of each kind a window shows, for chips and captions; they count the viewed graph.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Nodes that appeared.
    pub nodes_added: usize,
    /// Nodes that vanished.
    pub nodes_removed: usize,
    /// Topics that appeared.
    pub topics_added: usize,
    /// Topics that vanished.
    pub topics_removed: usize,
    /// Edges that appeared between items that were there before.
    pub edges_added: usize,
    /// Edges that vanished between items that are still there.
    pub edges_removed: usize,
    /// Topics whose rate changed.
    pub rates: usize,
    /// Hand-overs, restarts, lifecycle and other changes.
    pub others: usize,
}

/// One window of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The window's index, 0...
    pub index: usize,
    /// Its time.
    pub span: Span,
    /// Whether it is shorter than the others.
    pub partial: bool,
    /// All messages of the bag in the window, hidden topics included.
    pub messages: u64,
    /// Items in the window, ghosts included, sorted by id.
    pub items: Vec<Shown>,
    /// Arrows in the window, ghosts included, sorted by id.
    pub arrows: Vec<Shown>,
    /// Changes counted.
    pub tally: Counts,
    /// What changed, in words, the most important first: `camera_driver appeared`; empty when nothing did.
    pub caption: Vec<String>,
}

/// The whole sequence as the picture shows it. Items are sorted by (kind, name), arrows by (from, to, kind),
/// namespaces by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View {
    /// Every box ever shown.
    pub items: Vec<Item>,
    /// Every arrow ever shown.
    pub arrows: Vec<Arrow>,
    /// Every namespace with a box around its members; parents before children.
    pub namespaces: Vec<Namespace>,
    /// The windows.
    pub frames: Vec<Frame>,
}

impl View {
    /// Whether window `k` shows a change.
    pub fn is_changed(&self, k: usize) -> bool {
        self.frames.get(k).is_some_and(|frame| {
            let mut shown = frame.items.iter().chain(&frame.arrows);
            shown.any(|s| s.mark.is_some()) || !frame.caption.is_empty()
        })
    }

    /// The place of the window that shows most; the first of several.
    pub fn busiest(&self) -> usize {
        let is_there = |s: &&Shown| s.mark != Some(Mark::Removed);
        let mut best = (0, 0);
        for (at, frame) in self.frames.iter().enumerate() {
            let there = frame
                .items
                .iter()
                .chain(&frame.arrows)
                .filter(is_there)
                .count();
            if there > best.1 {
                best = (at, there);
            }
        }
        best.0
    }
}

#[cfg(test)]
pub(crate) mod testing;
