//! Groups: nodes of one namespace that exist in the same phases. A group hides no change, since its members
//! start and stop together. If there are too many groups of whole namespaces, shorter namespaces make fewer
//! of them.

use std::collections::{BTreeMap, BTreeSet};

use crate::base::name::namespace;
use crate::draw::timeline::rows::Row;
use crate::draw::timeline::source::FigureSource;
use crate::mission::phases::configurations;

/// Some nodes that are drawn as one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NodeGroup {
    pub(crate) space: String,
    /// The phases in which it exists, counted from 0; empty without phases.
    pub(crate) phases: BTreeSet<usize>,
    /// Indices of its members in the given list of names.
    pub(crate) members: Vec<usize>,
}

/// The phases that each of these roles belongs to: those whose configuration contains it, otherwise the one in which it is first seen.
pub(crate) fn phases_of(source: &FigureSource<'_>, tracks: &[Row]) -> Vec<BTreeSet<usize>> {
    let found = configurations(source.mission, source.phases);
    let of = |track: &Row| {
        let inside = (0..found.len()).filter(|k| found[*k].names.contains(&track.name));
        let mut inside: BTreeSet<usize> = inside.collect();
        if inside.is_empty() && !found.is_empty() {
            inside.insert(source.phase_at(track.start()));
        }
        inside
    };
    tracks.iter().map(of).collect()
}

/// The most parts of namespaces that distinguish groups: each number requires a layout, and names come from
/// the bag.
const MOST_PARTS: usize = 8;

/// The numbers of parts of namespaces that may distinguish groups, from all of them down to one.
pub(crate) fn depths(tracks: &[Row]) -> impl Iterator<Item = usize> + use<> {
    let parts = |t: &Row| namespace(&t.name).matches('/').count();
    let deepest = tracks.iter().map(parts).max().unwrap_or(1).max(1);
    (1..=deepest.min(MOST_PARTS)).rev()
}

/// The first `depth` parts of a namespace.
pub(crate) fn cut(space: &str, depth: usize) -> &str {
    let end = space.match_indices('/').nth(depth);
    end.map_or(space, |(end, _)| &space[..end])
}

/// The groups of some tracks, by the first `depth` parts of their namespace and by their phases.
pub(crate) fn groups(source: &FigureSource<'_>, tracks: &[Row], depth: usize) -> Vec<NodeGroup> {
    let phases = phases_of(source, tracks);
    let mut all: BTreeMap<(&str, BTreeSet<usize>), Vec<usize>> = BTreeMap::new();
    for (at, (track, phases)) in tracks.iter().zip(phases).enumerate() {
        let space = cut(namespace(&track.name), depth);
        all.entry((space, phases)).or_default().push(at);
    }
    all.into_iter()
        .map(|((space, phases), members)| NodeGroup {
            space: space.to_owned(),
            phases,
            members,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn namespaces_are_cut_to_their_first_parts() {
        assert_eq!(["/", "/a", "/a/b"].map(|s| cut(s, 1)), ["/", "/a", "/a"]);
        assert_eq!(cut("/a/b/c", 2), "/a/b");
        assert_eq!(cut("/a/b/c", 9), "/a/b/c");
    }
}
