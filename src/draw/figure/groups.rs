//! Groups: nodes of one namespace that live in the same phases. A group hides no change, for its members come and go
//! together.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::incidents::configurations;
use super::source::{FigureSource, merged};
use super::tracks::{SendingBar, Track, TrackLife};
use crate::base::name::namespace;
use crate::base::time::Span;

/// Some nodes that are drawn as one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NodeGroup {
    pub(crate) space: String,
    /// The phases it lives in, counted from 0; empty where there are no phases.
    pub(crate) phases: BTreeSet<usize>,
    /// Places of its members in the list of names given.
    pub(crate) members: Vec<usize>,
}

/// The phases that each of these roles lives in: those whose configuration holds it, else the one it is first seen in.
pub(crate) fn phases_of(source: &FigureSource<'_>, tracks: &[Track]) -> Vec<BTreeSet<usize>> {
    let found = configurations(source);
    let of = |track: &Track| {
        let inside = (0..found.len()).filter(|k| found[*k].names.contains(&track.name));
        let mut inside: BTreeSet<usize> = inside.collect();
        if inside.is_empty() && !found.is_empty() {
            inside.insert(source.phase_at(track.start()));
        }
        inside
    };
    tracks.iter().map(of).collect()
}

/// The groups of some tracks, by namespace and first phase.
pub(crate) fn groups(source: &FigureSource<'_>, tracks: &[Track]) -> Vec<NodeGroup> {
    let phases = phases_of(source, tracks);
    let mut all: BTreeMap<(&str, Vec<usize>), Vec<usize>> = BTreeMap::new();
    for (at, (track, phases)) in tracks.iter().zip(&phases).enumerate() {
        let key = (namespace(&track.name), phases.iter().copied().collect());
        all.entry(key).or_default().push(at);
    }
    all.into_iter()
        .map(|((space, phases), members)| NodeGroup {
            space: space.to_owned(),
            phases: phases.into_iter().collect(),
            members,
        })
        .collect()
}

/// A row per group: alive while a member is, busy by what all send.
pub(crate) fn tracks(source: &FigureSource<'_>, tracks: &[Track]) -> Vec<Track> {
    groups(source, tracks)
        .iter()
        .map(|group| match group.members[..] {
            [only] => tracks[only].clone(),
            _ => together(source, group, tracks),
        })
        .collect()
}

fn together(source: &FigureSource<'_>, group: &NodeGroup, tracks: &[Track]) -> Track {
    let members = || group.members.iter().map(|at| &tracks[*at]);
    let lives = members().flat_map(|t| &t.lives).map(|l| l.span).collect();
    let whole = source.span();
    let life = |span: Span| TrackLife {
        span,
        begins: members().any(|t| {
            t.lives
                .iter()
                .any(|l| l.begins && l.span.start == span.start)
        }),
        ends: members().any(|t| t.lives.iter().any(|l| l.ends && l.span.end == span.end)),
        is_inferred: false,
    };
    let sends = members().flat_map(|t| &t.bars).map(|b| b.span).collect();
    let bar = |span: Span| SendingBar { span, share: 1.0 };
    let first = members().next();
    let more = group.members.len() - 1;
    let name = first.map_or_else(String::new, |t| format!("{} +{more}", t.name));
    Track {
        name: Arc::from(name),
        nodes: members().flat_map(|t| &t.nodes).copied().collect(),
        topic: None,
        lives: merged(lives, 0).into_iter().map(life).collect(),
        bars: merged(sends, whole.nanos() / 83)
            .into_iter()
            .map(bar)
            .collect(),
        hz: members().filter_map(|t| t.hz).reduce(|a, b| a + b),
    }
}
