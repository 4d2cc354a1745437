//! The lives of nodes from those of their edges, of edges within those of their nodes, of topics from both.

use std::collections::BTreeMap;

use super::lives::{Life, Track};
use super::windows::Windows;
use crate::facts::Name;
use crate::proof::{Proof, What, When};
use crate::time::Stamp;

/// What lives are measured against.
#[derive(Clone, Copy)]
pub(super) struct Frame<'a> {
    pub(super) windows: Windows<'a>,
    /// The first and the last moment.
    pub(super) mission: (Stamp, Stamp),
    /// Windows of silence before somebody who never speaks again counts as gone.
    pub(super) grace: usize,
}

/// Works out all lives.
pub(super) fn settle(tracks: &mut BTreeMap<What, Track>, proofs: &[Proof], frame: &Frame<'_>) {
    for (what, track) in edges(tracks) {
        let (node, topic) = ends(what);
        tracks.entry(What::Node(node)).or_default().learn(&track);
        tracks.entry(What::Topic(topic)).or_default().learn(&track);
    }
    let linger = |last| frame.windows.last_moment(last, frame.grace);
    for (what, track) in tracks.iter_mut() {
        if matches!(what, What::Node(_)) {
            track.live(frame.mission, linger);
        }
    }
    let mut of_topics: BTreeMap<Name, Vec<Life>> = BTreeMap::new();
    for (what, mut track) in edges(tracks) {
        let (node, topic) = ends(what);
        let around = tracks.get(&What::Node(node)).map_or(&[][..], |t| &t.lives);
        track.live_within(around);
        of_topics.entry(topic).or_default().extend(&track.lives);
        tracks.insert(what, track);
    }
    for (what, lives) in live_like(tracks, proofs, false) {
        if !matches!(what, What::Node(_)) {
            of_topics.entry(ends(what).1).or_default().extend(lives);
        }
    }
    for (what, track) in tracks.iter_mut() {
        if let What::Topic(topic) = what {
            let edges = of_topics.remove(topic).unwrap_or_default();
            track.ceased = false;
            track.live(frame.mission, linger);
            track.lives.extend(edges);
        }
    }
    live_like(tracks, proofs, true);
}

/// Lets elements live like others, which are topics or not; tells which did.
fn live_like(
    tracks: &mut BTreeMap<What, Track>,
    proofs: &[Proof],
    topics: bool,
) -> Vec<(What, Vec<Life>)> {
    let mut done = Vec::new();
    for proof in proofs {
        if let When::Like(other) = proof.when
            && matches!(other, What::Topic(_)) == topics
            && let Some(lives) = tracks.get(&other).map(|t| t.lives.clone())
            && let Some(track) = tracks.get_mut(&proof.what)
            && track.signs.is_empty()
        {
            track.lives.clone_from(&lives);
            done.push((proof.what, lives));
        }
    }
    done
}

/// All edges.
fn edges(tracks: &BTreeMap<What, Track>) -> Vec<(What, Track)> {
    let is_edge = |what: &What| matches!(what, What::Publish(..) | What::Subscribe(..));
    let edges = tracks.iter().filter(|(what, _)| is_edge(what));
    edges.map(|(what, track)| (*what, track.clone())).collect()
}

/// The node and the topic of an edge.
fn ends(edge: What) -> (Name, Name) {
    match edge {
        What::Publish(node, topic) | What::Subscribe(topic, node) => (node, topic),
        What::Node(name) | What::Topic(name) => (name, name),
    }
}
