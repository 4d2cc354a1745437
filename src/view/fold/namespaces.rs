//! Namespaces: those that are collapsed to one box, in which order, and those with a box around their members.
//!
//! `/nav` collapsed is one box for `/nav/planner`, `/nav/costmap` and the topic `/nav/plan` between them; `/nav/goal`, which
//! comes from outside, stays beside it.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Bound;
use std::sync::Arc;

use crate::base::ids::{grouped, tally};
use crate::base::name::{lies_in, namespace};
use crate::graph::Element;
use crate::mission::Mission;
use crate::view::{Item, ItemKind, Namespace, View, ViewOptions};

/// The namespaces to collapse and those to keep open.
pub(crate) struct Collapse<'a> {
    pub(super) collapse: BTreeSet<&'a str>,
    /// The namespaces, and single elements, that are kept open.
    pub(super) expand: BTreeSet<&'a str>,
}

impl<'a> Collapse<'a> {
    pub(crate) fn new(options: &'a ViewOptions) -> Self {
        let set = |names: &'a [Arc<str>]| names.iter().map(|n| n.trim_end_matches('/')).collect();
        Self {
            collapse: set(&options.collapse),
            expand: set(&options.expand),
        }
    }

    /// The collapsed namespace that contains an element of this name: the outermost one without a namespace
    /// to keep open between it and the name. A node with the same name as the namespace goes inside too.
    pub(crate) fn of(&self, name: &str) -> Option<&'a str> {
        let mut found = None;
        let ends = name.match_indices('/').map(|(at, _)| at).skip(1);
        for space in ends.chain([name.len()]).filter_map(|end| name.get(..end)) {
            if self.expand.contains(space) {
                found = None;
            } else if found.is_none() {
                found = self.collapse.get(space).copied();
            }
        }
        found
    }

    /// Opens namespaces that would collapse fewer than two of these names, and those that would collapse a
    /// single node beside elements kept open: a box of one element would have that element's name.
    pub(crate) fn open_single(&mut self, nodes: &BTreeSet<&str>, topics: &BTreeSet<&str>) {
        let mut folded: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
        for (at, names) in [nodes, topics].into_iter().enumerate() {
            for space in names.iter().filter_map(|name| self.of(name)) {
                folded.entry(space).or_default()[at] += 1;
            }
        }
        let open: BTreeMap<&str, &str> = self.expand.iter().map(|name| (*name, *name)).collect();
        let is_rest = |space| inside(&open, space).next().is_some();
        let single = folded
            .into_iter()
            .filter(|(space, [nodes, topics])| nodes + topics < 2 || *nodes == 1 && is_rest(space));
        let single: BTreeSet<&str> = single.map(|(space, _)| space).collect();
        self.collapse.retain(|space| !single.contains(space));
    }
}

/// The collapsed namespace that contains a topic (or group): that of all its `publishers` and `subscribers`,
/// if it is also the topic's `own` or both kinds exist; without any connection, its `own`. Topics that cross
/// the border of a namespace stay outside as its interface.
pub(crate) fn swallows<'a>(
    own: Option<&'a str>,
    publishers: &[Option<&'a str>],
    subscribers: &[Option<&'a str>],
) -> Option<&'a str> {
    let mut ends = publishers.iter().chain(subscribers);
    let Some(first) = ends.next() else {
        return own;
    };
    let same = ends.all(|end| end == first);
    let both = !publishers.is_empty() && !subscribers.is_empty();
    (*first).filter(|_| same && (both || own == *first))
}

/// The collapsed namespace that contains a topic whose lines run from node to node: that of all its `publishers`; without
/// any, its `own`. Changes of topics that several boxes publish are only shown on the arrows, so these topics are in none.
pub(crate) fn sent_from<'a>(
    own: Option<&'a str>,
    publishers: &[Option<&'a str>],
) -> Option<&'a str> {
    let mut publishers = publishers.iter();
    let Some(first) = publishers.next() else {
        return own;
    };
    first.filter(|_| publishers.all(|other| other == first))
}

/// The share of the boxes above which a namespace is common to all of them: `/fleet` around forty robots. Collapsed, it
/// would be all that is drawn.
pub(crate) const COMMON: (usize, usize) = (9, 10);

/// A namespace that could be collapsed to one box.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Collapsible {
    /// The namespace: `/robot1/nav`.
    pub name: Arc<str>,
    /// The number of boxes it contains now.
    pub items: usize,
    /// The number of headlines about elements in it.
    pub headlines: usize,
}

/// The node or topic that each headline is about: an edge's topic.
pub(crate) fn headlines(mission: &Mission) -> impl Iterator<Item = Element> + '_ {
    let elements = &mission.elements;
    let events = mission.log.events.iter().filter(|e| e.is_headline());
    events.map(|event| match elements.ends(event.what) {
        (Some(_), Some(topic)) => Element::Topic(topic),
        _ => event.what,
    })
}

/// The number of headlines about each name: of a node, of a topic, of an edge by its topic.
pub(crate) fn changed(mission: &Mission) -> BTreeMap<&str, usize> {
    let name = |what| {
        let (node, topic) = mission.elements.names(what);
        node.or(topic).unwrap_or_default()
    };
    tally(headlines(mission).map(name))
}

/// The values of the names that lie in a namespace.
pub(crate) fn inside<'m, V>(
    names: &'m BTreeMap<&str, V>,
    space: &'m str,
) -> impl Iterator<Item = &'m V> {
    let below = format!("{space}/");
    let after = names.range::<str, _>((Bound::Included(below.as_str()), Bound::Unbounded));
    let inside = after.take_while(move |(name, _)| lies_in(name, space));
    inside.map(|(_, value)| value)
}

impl View {
    /// The boxes, except of namespaces, that contain one of these elements, by name.
    pub(crate) fn holding(&self, reported: &BTreeSet<Element>) -> BTreeMap<&str, Vec<Arc<str>>> {
        let changes = |item: &&Item| item.members.iter().any(|member| reported.contains(member));
        let open = self.items.iter();
        let open = open.filter(|item| item.kind != ItemKind::Namespace);
        let changing = open.filter(changes);
        grouped(changing.map(|item| (&*item.name, Arc::clone(&item.name))))
    }

    /// The namespaces that could be collapsed, in the order of collapsing: those with fewest changes per box,
    /// then inner before outer ones, larger before smaller ones, then by name. Those with fewer than two
    /// boxes, or with nearly all, or that `options` keeps open, are omitted.
    pub fn collapsible(&self, mission: &Mission, options: &ViewOptions) -> Vec<Collapsible> {
        let changed = changed(mission);
        let open = Collapse::new(options).expand;
        let mut sizes: BTreeMap<&str, usize> = BTreeMap::new();
        for item in &self.items {
            let mut space = match item.kind {
                // A node with the same name as a namespace would go inside.
                ItemKind::Node => item.name.as_ref(),
                _ => namespace(&item.name),
            };
            while space.len() > 1 {
                *sizes.entry(space).or_default() += 1;
                space = namespace(space);
            }
        }
        let most = self.items.len() * COMMON.0 / COMMON.1;
        sizes.retain(|space, size| *size > 1 && *size <= most && !open.contains(space));
        let mut all: Vec<(bool, Collapsible)> = sizes
            .iter()
            .map(|(space, size)| {
                let own = changed.get(space).copied().unwrap_or_default();
                let candidate = Collapsible {
                    name: Arc::from(*space),
                    items: *size,
                    headlines: own + inside(&changed, space).sum::<usize>(),
                };
                (inside(&sizes, space).next().is_some(), candidate)
            })
            .collect();
        all.sort_by(|a, b| {
            let key = |c: &(bool, Collapsible)| (c.0, usize::MAX - c.1.items);
            // Headlines per box, without dividing.
            let (here, there) = (a.1.headlines * b.1.items, b.1.headlines * a.1.items);
            let by_key = here.cmp(&there).then(key(a).cmp(&key(b)));
            by_key.then_with(|| a.1.name.cmp(&b.1.name))
        });
        all.into_iter().map(|(_, candidate)| candidate).collect()
    }
}

/// The largest depth of nested boxes; a name consisting of slashes must not create thousands of nested boxes.
const DEEPEST: usize = 16;

/// The namespaces of these items, sorted by name, parents before children, and each item's innermost one set.
///
/// `depth` levels follow `rqt_graph`'s rule for "Namespaces N": an item is in the box of its first N parts,
/// or of its whole namespace if that is shorter; names at the root stay outside. With `None` all levels are
/// drawn, but a namespace around a single item is omitted, unless it is one of `kept`; an item with the name
/// of one of those is in it.
pub(crate) fn clusters(
    items: &mut [Item],
    depth: Option<usize>,
    kept: &BTreeSet<&str>,
) -> Vec<Namespace> {
    let levels = depth.unwrap_or(DEEPEST).min(DEEPEST);
    let inner: Vec<String> = innermost_spaces(items, levels, kept);
    let mut spaces: BTreeSet<&str> = BTreeSet::new();
    for mut space in inner.iter().map(String::as_str) {
        while !space.is_empty() && spaces.insert(space) {
            space = parent(space);
        }
    }
    if depth.is_none() {
        fold(&mut spaces, &inner, kept);
    }
    let places: BTreeMap<&str, usize> = spaces.iter().copied().zip(0..).collect();
    let innermost = |mut space| {
        while !str::is_empty(space) && !places.contains_key(space) {
            space = parent(space);
        }
        places.get(space).copied()
    };
    for (item, space) in items.iter_mut().zip(&inner) {
        item.cluster = innermost(space.as_str());
    }
    spaces
        .iter()
        .map(|space| Namespace {
            name: Arc::from(*space),
            parent: innermost(parent(space)),
            replicas: Vec::new(),
        })
        .collect()
}

/// The namespace of each item; that of one of `kept`, and of a collapsed one beside members that were kept open, is
/// itself.
fn innermost_spaces(items: &[Item], levels: usize, kept: &BTreeSet<&str>) -> Vec<String> {
    let outer = items.iter();
    let outer: Vec<String> = outer.map(|item| outer_space(&item.name, levels)).collect();
    let around: BTreeSet<&str> = outer.iter().map(String::as_str).collect();
    let own = |(item, outer): (&Item, &String)| {
        let is_around = item.kind == ItemKind::Namespace && around.contains(&*item.name);
        if is_around {
            item.name.to_string()
        } else if kept.contains(&*item.name) {
            outer_space(&format!("{}/", item.name), levels)
        } else {
            outer.clone()
        }
    };
    items.iter().zip(&outer).map(own).collect()
}

/// The first parts of a name, at most `levels`, without its last; empty at the root.
fn outer_space(name: &str, levels: usize) -> String {
    let Some(rest) = name.strip_prefix('/') else {
        return String::new();
    };
    let mut parts: Vec<&str> = rest.split('/').collect();
    parts.pop();
    parts.truncate(levels);
    let empty = parts.iter().position(|part| part.is_empty());
    parts.truncate(empty.unwrap_or(parts.len()));
    parts.iter().flat_map(|part| ["/", part]).collect()
}

fn parent(space: &str) -> &str {
    space.rsplit_once('/').map_or("", |(parent, _)| parent)
}

/// Drops namespaces around a single item, which then belongs to the next outer one.
fn fold(spaces: &mut BTreeSet<&str>, inner: &[String], always: &BTreeSet<&str>) {
    let mut things = tally(inner.iter().map(String::as_str));
    let mut kept = BTreeSet::new();
    // Backwards, a namespace comes after those inside it.
    for space in spaces.iter().rev().copied() {
        let inside = things.get(space).copied().unwrap_or_default();
        if inside > 1 || always.contains(space) {
            kept.insert(space);
        }
        *things.entry(parent(space)).or_default() += inside.min(1);
    }
    *spaces = kept;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::outline;
    use crate::view::testing::mission;

    fn options(collapse: &[&str], expand: &[&str]) -> ViewOptions {
        let names = |names: &[&str]| names.iter().map(|n| Arc::from(*n)).collect();
        ViewOptions {
            collapse: names(collapse),
            expand: names(expand),
            ..ViewOptions::default()
        }
    }

    #[test]
    fn the_outermost_collapsed_namespace_wins_below_the_innermost_open_one() {
        let options = options(&["/a", "/a/b/c"], &["/a/b"]);
        let collapse = Collapse::new(&options);
        assert_eq!(collapse.of("/a/x"), Some("/a"));
        assert_eq!(collapse.of("/a"), Some("/a"));
        assert_eq!(collapse.of("/a/b/x"), None);
        assert_eq!(collapse.of("/a/b/c/x/y"), Some("/a/b/c"));
        assert_eq!(collapse.of("/ab"), None);
    }

    #[test]
    fn topics_without_known_nodes_go_inside_by_their_name() {
        let mission = mission(&["=/n/t =/t /m>/n/u /n/a>/w"]);
        let view = outline(&mission, &options(&["/n"], &[]));
        let names: Vec<&str> = view.items.iter().map(|i| i.name.as_ref()).collect();
        assert_eq!(names, ["/m", "/n/u", "/t", "/w", "/n"]);
    }

    #[test]
    fn innermost_namespaces_are_collapsed_first_and_the_largest_of_them() {
        let mission = mission(&["/a/b/x>/a/b/t /a/y /a/c/x>/a/c/t /a/c/u>/t /d/x /e>/e/t"]);
        let candidates = |options: &ViewOptions| -> Vec<String> {
            let all = outline(&mission, options).collapsible(&mission, options);
            all.iter()
                .map(|c| format!("{} {}", c.name, c.items))
                .collect()
        };
        assert_eq!(
            candidates(&options(&[], &[])),
            ["/a/c 3", "/a/b 2", "/e 2", "/a 6"]
        );
        assert_eq!(candidates(&options(&["/a/c"], &["/e"])), ["/a/b 2", "/a 4"]);
    }

    #[test]
    fn changing_elements_can_stay_outside_a_collapsed_box() {
        let mission = mission(&["/a/x>/a/t /a/y>/a/u /a/z>/a/u", "/a/x>/a/t /a/z>/a/u"]);
        let whole = outline(&mission, &options(&[], &[]));
        let open = whole.holding(&headlines(&mission).collect());
        let open: Vec<&Arc<str>> = inside(&open, "/a").flatten().collect();
        assert_eq!(open, [&Arc::from("/a/y")]);
        let view = outline(&mission, &options(&["/a"], &["/a/y"]));
        let boxes: Vec<(&str, usize)> = (view.items.iter())
            .map(|item| (&*item.name, item.members.len()))
            .collect();
        assert_eq!(boxes, [("/a/y", 1), ("/a/u", 1), ("/a", 3)]);
        let homes: BTreeSet<Option<usize>> = view.items.iter().map(|item| item.cluster).collect();
        assert_eq!(homes, [Some(0)].into());
    }

    #[test]
    fn a_collapsed_box_has_at_least_two_members() {
        let mission = mission(&["/a/x /b/y /b/z>/b/u", "/a/x /b/z>/b/u"]);
        let names = |options: &ViewOptions| -> Vec<String> {
            let view = outline(&mission, options);
            view.items
                .iter()
                .map(|item| item.name.to_string())
                .collect()
        };
        assert_eq!(names(&options(&["/a", "/b"], &[])), ["/a/x", "/b"]);
        let kept = options(&["/a", "/b"], &["/b/y"]);
        assert_eq!(names(&kept), ["/a/x", "/b/y", "/b/z", "/b/u"]);
    }

    #[test]
    fn namespaces_with_fewest_changes_are_collapsed_first() {
        let mission = mission(&["/a/x>/a/t /b/y>/b/u /b/z", "/a/x>/a/t /b/z"]);
        let options = options(&[], &[]);
        let all = outline(&mission, &options).collapsible(&mission, &options);
        let names: Vec<&str> = all.iter().map(|c| &*c.name).collect();
        assert_eq!(names, ["/a", "/b"]);
    }

    /// The boxes around these names: each item with the path of its innermost one, and each box with its parent.
    fn boxes(names: &[&str], depth: Option<usize>) -> Vec<String> {
        let item = |name: &&str| Item {
            kind: ItemKind::Node,
            name: Arc::from(*name),
            label: Arc::from(*name),
            others: Vec::new(),
            members: Vec::new(),
            counted: Vec::new(),
            is_replica: false,
            is_service: false,
            cluster: None,
        };
        let mut items: Vec<Item> = names.iter().map(item).collect();
        let spaces = clusters(&mut items, depth, &BTreeSet::new());
        let at = |place: Option<usize>| place.map_or("-", |at| spaces[at].name.as_ref());
        let homes = items
            .iter()
            .map(|item| format!("{} in {}", item.name, at(item.cluster)));
        let parents = spaces
            .iter()
            .map(|s| format!("{} < {}", s.name, at(s.parent)));
        homes.chain(parents).collect()
    }

    #[test]
    fn a_depth_follows_rqt_graph() {
        let names = ["/x", "/a/x", "/a/b/c/x"];
        assert_eq!(
            boxes(&names, Some(0)),
            ["/x in -", "/a/x in -", "/a/b/c/x in -"]
        );
        assert_eq!(
            boxes(&names, Some(1)),
            ["/x in -", "/a/x in /a", "/a/b/c/x in /a", "/a < -"]
        );
        assert_eq!(
            boxes(&names, Some(2)),
            [
                "/x in -",
                "/a/x in /a",
                "/a/b/c/x in /a/b",
                "/a < -",
                "/a/b < /a"
            ]
        );
    }

    #[test]
    fn all_namespace_levels_are_drawn_except_around_a_single_item() {
        let want = ["/a/b/x in /a/b", "/a/b/c/d/x in /a/b", "/a/b < -"];
        assert_eq!(boxes(&["/a/b/x", "/a/b/c/d/x"], None), want);
        let got = boxes(&["/a/x", "/a/b/c/x", "/a/b/c/y"], None);
        assert_eq!(got[3..], ["/a < -", "/a/b/c < /a"].map(str::to_owned));
        assert_eq!(boxes(&["/a/x"], None), ["/a/x in -"]);
    }

    #[test]
    fn unusual_names_are_boxed_correctly() {
        let slashes = "/".repeat(10_000);
        assert_eq!(boxes(&[&slashes, "", "a/b/c", "/"], None).len(), 4);
        let deep = "/a".repeat(10_000);
        assert_eq!(boxes(&[&deep, "/b/x"], None).len(), 2);
        assert!(boxes(&[&deep], Some(usize::MAX)).len() <= DEEPEST + 1);
    }
}
