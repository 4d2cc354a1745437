//! The lifelines of two missions, one above the other, for everything that differs, aligned at the first messages.

use std::collections::{BTreeMap, BTreeSet};

use super::{DiffSubject, Difference};
use crate::base::time::{Span, Stamp};
use crate::draw::figure::course::{LifeLine, LifeLines};
use crate::draw::figure::source::FigureSource;
use crate::draw::figure::tracks::{SendingBar, Track, TrackLife, of_nodes, of_topics};
use crate::graph::Element;
use crate::mission::Mission;
use crate::view::NameFilter;

/// The most nodes and topics that are drawn.
const MOST: usize = 200;

/// The tracks of one name in both missions, and the node or topic that is drawn for it.
type Pair = ([Option<Track>; 2], Element);

/// A title for each node and topic that differs, and below it a row for each mission; times count from 0. `drawn` is
/// the mission of both.
pub(crate) fn pairs(
    missions: [&Mission; 2],
    subject: &DiffSubject,
    differing: &[Difference],
    drawn: &Mission,
) -> LifeLines {
    let known = differing.iter().filter(|d| d.is_known);
    // An edge's name is that of both its ends.
    let names: BTreeSet<&str> = known.flat_map(|d| d.element.split(" → ")).collect();
    let all = NameFilter::default();
    let nodes = drawn.elements.nodes.with_ids();
    let nodes = nodes.map(|(id, n)| (n.name.as_str(), Element::Node(id)));
    let topics = drawn.elements.topics.with_ids();
    let topics = topics.map(|(id, t)| (t.name.as_str(), Element::Topic(id)));
    let tracks: [fn(&FigureSource<'_>) -> Vec<Track>; 2] = [of_nodes, of_topics];
    let places: [BTreeMap<&str, Element>; 2] = [nodes.collect(), topics.collect()];
    let mut rows = Vec::new();
    for (of, places) in tracks.into_iter().zip(places) {
        let mut pairs: BTreeMap<String, Pair> = BTreeMap::new();
        for (side, mission) in missions.iter().enumerate() {
            for track in of(&FigureSource::new(mission, &all, &all, false)) {
                let name = &*track.name;
                if let (true, Some(what)) = (names.contains(name), places.get(name)) {
                    let pair = pairs.entry(name.to_owned());
                    pair.or_insert(([None, None], *what)).0[side] = Some(track);
                }
            }
        }
        let starts = missions.map(|mission| mission.span.start);
        rows.extend(pairs.into_iter().flat_map(|(name, (tracks, what))| {
            let [first, second] = &tracks;
            let hz = |track: &Option<Track>| track.as_ref().and_then(|t| t.hz).unwrap_or(0.0);
            let most = hz(first).max(hz(second));
            let row = |label: &str, track: &Option<Track>, start| {
                let share = if most > 0.0 { hz(track) / most } else { 1.0 };
                line(label, what, track.as_ref(), start, share)
            };
            let title = LifeLine {
                label: name,
                is_inside: false,
                what: None,
                lives: Vec::new(),
                bars: Vec::new(),
            };
            [
                title,
                row(&format!("A {}", subject.first), first, starts[0]),
                row(&format!("B {}", subject.second), second, starts[1]),
            ]
        }));
    }
    rows.truncate(3 * MOST);
    LifeLines {
        rows,
        ..LifeLines::default()
    }
}

/// The row of a track, its times counted from `start`, and its highest rate drawn as `share` of all.
fn line(label: &str, what: Element, track: Option<&Track>, start: Stamp, share: f64) -> LifeLine {
    let moved =
        |span: Span| Span::new(Stamp(span.start.since(start)), Stamp(span.end.since(start)));
    let lives = track.iter().flat_map(|t| &t.lives).map(|life| TrackLife {
        span: moved(life.span),
        ..*life
    });
    let bars = track.iter().flat_map(|t| &t.bars).map(|bar| SendingBar {
        span: moved(bar.span),
        share: bar.share * share,
    });
    LifeLine {
        label: label.to_owned(),
        is_inside: true,
        what: Some(what),
        lives: lives.collect(),
        bars: bars.collect(),
    }
}
