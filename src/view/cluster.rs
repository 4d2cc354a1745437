//! The namespaces that are drawn as boxes around their members.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{Item, ItemKind, Namespace};

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
    let homes: Vec<String> = homes(items, levels, kept);
    let mut spaces: BTreeSet<&str> = BTreeSet::new();
    for mut space in homes.iter().map(String::as_str) {
        while !space.is_empty() && spaces.insert(space) {
            space = parent(space);
        }
    }
    if depth.is_none() {
        fold(&mut spaces, &homes, kept);
    }
    let places: BTreeMap<&str, usize> = spaces.iter().copied().zip(0..).collect();
    let innermost = |mut space| {
        while !str::is_empty(space) && !places.contains_key(space) {
            space = parent(space);
        }
        places.get(space).copied()
    };
    for (item, home) in items.iter_mut().zip(&homes) {
        item.cluster = innermost(home.as_str());
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
fn homes(items: &[Item], levels: usize, kept: &BTreeSet<&str>) -> Vec<String> {
    let outer: Vec<String> = items.iter().map(|item| home(&item.name, levels)).collect();
    let around: BTreeSet<&str> = outer.iter().map(String::as_str).collect();
    let own = |(item, outer): (&Item, &String)| {
        let is_around = item.kind == ItemKind::Namespace && around.contains(&*item.name);
        if is_around {
            item.name.to_string()
        } else if kept.contains(&*item.name) {
            home(&format!("{}/", item.name), levels)
        } else {
            outer.clone()
        }
    };
    items.iter().zip(&outer).map(own).collect()
}

/// The first parts of a name, at most `levels`, without its last; empty at the root.
fn home(name: &str, levels: usize) -> String {
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
    space
        .rfind('/')
        .and_then(|at| space.get(..at))
        .unwrap_or_default()
}

/// Drops namespaces around a single item, which then belongs to the next outer one.
fn fold(spaces: &mut BTreeSet<&str>, homes: &[String], always: &BTreeSet<&str>) {
    let mut things: BTreeMap<&str, usize> = BTreeMap::new();
    for home in homes {
        *things.entry(home).or_default() += 1;
    }
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

    /// The boxes around these names: each item with the path of its innermost one, and each box with its parent.
    fn boxes(names: &[&str], depth: Option<usize>) -> Vec<String> {
        let item = |name: &&str| Item {
            kind: ItemKind::Node,
            name: Arc::from(*name),
            label: Arc::from(*name),
            members: Vec::new(),
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
