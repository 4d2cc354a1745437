//! Names as they are written in a headline: without the namespace of most of them, and without the transports of images.

use std::collections::BTreeMap;

use crate::base::name::namespace;

/// The namespace below which names are written without it: the one around all names that have one, else that
/// of most of them; empty if all are at the root.
pub(super) fn home<'n>(names: impl Iterator<Item = &'n str>) -> &'n str {
    let spaces = names.map(|name| namespace(without_transport(name)));
    let spaces: Vec<&str> = spaces.filter(|space| *space != "/").collect();
    let Some(first) = spaces.first() else {
        return "";
    };
    let around = spaces.iter().fold(*first, |a, b| shared(a, b));
    if !around.is_empty() {
        return around;
    }
    let mut most: BTreeMap<&str, (usize, &str)> = BTreeMap::new();
    for space in spaces {
        let end = space[1..].find('/').map_or(space.len(), |at| at + 1);
        let (count, around) = most.entry(&space[..end]).or_insert((0, space));
        (*count, *around) = (*count + 1, shared(around, space));
    }
    // The first of equal ones.
    let best = most.values().rev().max_by_key(|(count, _)| *count);
    best.map_or("", |(_, around)| around)
}

/// The namespace around two others; empty for the root.
pub(super) fn shared<'n>(a: &'n str, b: &str) -> &'n str {
    let mut end = 0;
    for (x, y) in a.split('/').zip(b.split('/')) {
        if x != y {
            break;
        }
        end += x.len() + 1;
    }
    &a[..end.saturating_sub(1).min(a.len())]
}

/// The name of an image topic without its transport.
pub(super) fn without_transport(name: &str) -> &str {
    const TRANSPORTS: [&str; 3] = ["/compressed", "/compressedDepth", "/theora"];
    let cut = TRANSPORTS.iter().find_map(|end| name.strip_suffix(end));
    cut.filter(|rest| !rest.is_empty()).unwrap_or(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_namespace_of_most_names_is_left_out() {
        assert_eq!(home(["/r1/a", "/r1/nav/b", "/c"].into_iter()), "/r1");
        assert_eq!(home(["/r1/x/a", "/r2/b", "/r2/c"].into_iter()), "/r2");
        assert_eq!(home(["/a", "/b"].into_iter()), "");
        assert_eq!(home(["/cam/image/compressed"].into_iter()), "/cam");
        assert_eq!(shared("/robot1", "/robot10"), "");
    }
}
