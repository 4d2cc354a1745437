//! The lifetimes of nodes from those of their edges, of edges within those of their nodes, of topics from
//! both.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use super::lifetime::Lifetime;
use super::restarts::Restarts;
use super::tracks::Tracks;
use crate::base::time::Stamp;
use crate::evidence::Confidence;
use crate::evidence::inference::ElementKey;
use crate::evidence::observation::Name;

/// No edge has a smaller key: nodes and topics come before.
const FIRST_EDGE: ElementKey = ElementKey::Publish(Name(0), Name(0));

/// Computes all lifetimes; `mission` contains the first and last moments.
pub(crate) fn compute_lifetimes(
    tracks: &mut Tracks,
    likes: &[(ElementKey, ElementKey)],
    restarts: &Restarts,
    mission: (Stamp, Stamp),
) {
    let mut closed: BTreeMap<Name, Option<Stamp>> = BTreeMap::new();
    // An edge that exists as long as its node is evidence for its topic, but not for the node.
    let of_nodes = likes
        .iter()
        .filter(|(_, other)| matches!(other, ElementKey::Node(_)));
    let followers: BTreeSet<ElementKey> = of_nodes.map(|(what, _)| *what).collect();
    let mut edges = tracks.split_off(&FIRST_EDGE);
    // A recorder subscribes to topics because they exist, so its subscriptions do not show how long they do.
    let nodes = tracks.iter().filter_map(|(what, track)| match what {
        ElementKey::Node(node) if track.evidence.has("recorder") => Some(*node),
        _ => None,
    });
    let recorders: BTreeSet<Name> = nodes.collect();
    let is_recorded = |what: &ElementKey| matches!(what, ElementKey::Subscribe(_, node) if recorders.contains(node));
    for (what, track) in &edges {
        let [Some(node), Some(topic)] = what.ends() else {
            continue;
        };
        let last = closed.entry(node).or_insert(Some(Stamp::MIN));
        *last = last.and_then(|last| track.closed(last));
        let learner = tracks.entry(ElementKey::Node(node)).or_default();
        if followers.contains(what)
            && track.signs.is_empty()
            && track.confidence > Confidence::Stated
        {
            learner.evidence = learner.evidence.and(track.evidence);
        } else {
            learner.learn(track);
        }
        let known = tracks.entry(ElementKey::Topic(topic)).or_default();
        known.know(track, is_recorded(what));
    }
    // A node ended if its last connection was closed and it has no later sign.
    for (node, end) in closed {
        let end = end.filter(|end| *end > Stamp::MIN);
        if let (Some(end), Some(track)) = (end, tracks.get_mut(&ElementKey::Node(node)))
            && track.signs.iter().all(|sign| *sign <= end)
        {
            track.ends.push(end);
        }
    }
    for (what, track) in tracks.iter_mut() {
        if let ElementKey::Node(node) = what {
            track.live(mission, true);
            for restart in restarts.get(node).into_iter().flatten() {
                track.restart(restart);
            }
        }
    }
    let mut of_topics: BTreeMap<Name, Vec<Lifetime>> = BTreeMap::new();
    let mut of_recorders: BTreeMap<Name, Vec<Lifetime>> = BTreeMap::new();
    let mut recorded: Vec<ElementKey> = Vec::new();
    for (what, track) in &mut edges {
        let [Some(node), Some(topic)] = what.ends() else {
            continue;
        };
        let around = tracks.get(&ElementKey::Node(node));
        track.live_within(&around.map(|t| Rc::clone(&t.lives)).unwrap_or_default());
        if is_recorded(what) {
            add(of_recorders.entry(topic).or_default(), &track.lives);
            recorded.push(*what);
        } else {
            add(of_topics.entry(topic).or_default(), &track.lives);
        }
    }
    tracks.append(&mut edges);
    live_like(tracks, likes, false, |what, lives| {
        if let [_, Some(topic)] = what.ends() {
            add(of_topics.entry(topic).or_default(), lives);
        }
    });
    for (what, track) in tracks.iter_mut() {
        if let ElementKey::Topic(topic) = what {
            let edges = of_topics.remove(topic).unwrap_or_default();
            track.live(mission, false);
            track.live_with(edges);
            if track.lives.is_empty() {
                track.live_with(of_recorders.remove(topic).unwrap_or_default());
            }
        }
    }
    for what in recorded {
        let [_, Some(topic)] = what.ends() else {
            continue;
        };
        let around = tracks.get(&ElementKey::Topic(topic));
        let around = around.map(|t| Rc::clone(&t.lives)).unwrap_or_default();
        if let Some(track) = tracks.get_mut(&what) {
            track.stay_within(&around);
        }
    }
    live_like(tracks, likes, true, |_, _| {});
}

/// Adds the lifetimes of an edge to those of its topic's edges, very many of which may be equal.
fn add(all: &mut Vec<Lifetime>, lives: &[Lifetime]) {
    for life in lives {
        if all.last() != Some(life) {
            all.push(*life);
        }
    }
}

/// Gives elements the lifetimes of others, either topics or not; those with signs of their own, the beginnings.
fn live_like(
    tracks: &mut Tracks,
    likes: &[(ElementKey, ElementKey)],
    topics: bool,
    mut given: impl FnMut(ElementKey, &[Lifetime]),
) {
    for (what, other) in likes {
        if matches!(other, ElementKey::Topic(_)) == topics
            && let Some(lives) = tracks.get(other).map(|t| Rc::clone(&t.lives))
            && let Some(track) = tracks.get_mut(what)
        {
            if track.signs.is_empty() {
                track.lives = lives;
            } else if !track.begin_with(&lives) {
                continue;
            }
            given(*what, &track.lives);
        }
    }
}
