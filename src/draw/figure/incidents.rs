//! Incidents: events in rows that are marked with a letter or an arrow: returns, steps of rates, hand-overs.

use std::collections::{BTreeMap, BTreeSet};

use super::source::{FigureSource, merged};
use super::tracks::{SendingBar, Track, steps};
use crate::base::name::{last_part, namespace};
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::graph::TopicId;
use crate::mission::phases::{Configuration, configuration_of};

/// The least factor and the least difference in Hz of a step of a rate that is marked.
const STEP: (f64, f64) = (1.5, 0.3);
/// The most letters, and the most arrows.
const MOST: (usize, usize) = (10, 6);
/// The part of the mission, one in this many, up to which a silence may be a slow rate.
const BRIDGED: i64 = 20;
/// The least number of messages on both sides of a step.
const COUNTED: f64 = 3.0;
/// The least silence of a topic row that is marked, in multiples of the one that interrupts a bar.
const PAUSE: i64 = 2;

/// An incident that is marked with a letter.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Incident {
    pub(crate) at: Stamp,
    /// The row: a place among the tracks.
    pub(crate) track: usize,
    /// Its text, after its time: `planner: plan 1 → 0.2 Hz`.
    pub(crate) text: String,
    weight: f64,
}

/// Topics that another row sends from a phase on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Handover {
    pub(crate) at: Stamp,
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// The topics' last parts.
    pub(crate) topics: Vec<String>,
    pub(crate) ids: Vec<TopicId>,
}

/// The incidents to mark, in order of time, and the number of smaller ones that are not marked.
pub(crate) fn incidents(source: &FigureSource<'_>, tracks: &[Track]) -> (Vec<Incident>, usize) {
    let mut all = Vec::new();
    for (at, track) in tracks.iter().enumerate() {
        all.extend(returns(source, at, track));
        all.extend(rates(source, at, track));
    }
    all.sort_by(|a, b| b.weight.total_cmp(&a.weight).then(a.at.cmp(&b.at)));
    let left = all.len().saturating_sub(MOST.0);
    all.truncate(MOST.0);
    all.sort_by(|a, b| a.at.cmp(&b.at).then(a.track.cmp(&b.track)));
    (all, left)
}

/// Rows that were gone, or silent in topics, and are back.
fn returns(source: &FigureSource<'_>, at: usize, track: &Track) -> Vec<Incident> {
    let whole = source.span();
    let gap = |from: Stamp, to: Stamp, what: &str| {
        let away = to.since(from);
        let name = last_part(&track.name);
        Incident {
            at: to,
            track: at,
            text: format!(
                "{name} {what} after {}",
                words::duration(away / SECOND * SECOND)
            ),
            weight: 2.0 + away as f64 / whole.nanos().max(1) as f64,
        }
    };
    let lives: Vec<Span> = track.lives.iter().map(|l| l.span).collect();
    let mut all: Vec<Incident> = lives
        .windows(2)
        .map(|pair| gap(pair[0].end, pair[1].start, "back"))
        .collect();
    if track.topic.is_some() {
        let least = super::tracks::silence(whole) * PAUSE;
        let bars = track.bars.windows(2);
        let pauses = bars.map(|pair| (pair[0].span.end, pair[1].span.start));
        let long = pauses.filter(|(from, to)| to.since(*from) >= least);
        all.extend(long.map(|(from, to)| gap(from, to, "again")));
    }
    all
}

const SECOND: i64 = 1_000_000_000;

/// Steps of the rates of single publications, or of the topic that the row is.
fn rates(source: &FigureSource<'_>, at: usize, track: &Track) -> Vec<Incident> {
    let mut all = Vec::new();
    let bridged = source.span().nanos() / BRIDGED;
    if let Some(topic) = track.topic {
        let sent = source.topic_sent(topic);
        for stretch in merged(source.topic_sending(topic), bridged) {
            all.extend(stepped(
                source,
                at,
                (stretch, &sent),
                last_part(&track.name),
            ));
        }
    }
    for edge in source.publications(&track.nodes) {
        let sent = source.sent(edge);
        let Some(of) = source.mission.elements.publishes.get(edge as usize) else {
            continue;
        };
        let what = format!(
            "{}: {}",
            last_part(&track.name),
            relative(source.topic(of.topic), &track.name)
        );
        for stretch in merged(source.sending(edge), bridged) {
            all.extend(stepped(source, at, (stretch, &sent), &what));
        }
    }
    all
}

fn stepped(
    source: &FigureSource<'_>,
    at: usize,
    (stretch, sent): (Span, &[f64]),
    what: &str,
) -> Vec<Incident> {
    let bars = steps(source, stretch, sent);
    let pairs = bars.windows(2).filter_map(|pair| {
        let (from, to) = (pair[0].share, pair[1].share);
        let factor = (from / to).max(to / from);
        let counted = |b: &SendingBar| b.share * b.span.nanos() as f64 / 1e9 >= COUNTED;
        let is_marked = pair.iter().all(counted) && factor >= STEP.0 && (from - to).abs() >= STEP.1;
        let change = words::rate_change(words::significant(from, 2), words::significant(to, 2));
        is_marked.then(|| Incident {
            at: pair[1].span.start,
            track: at,
            text: format!("{what} {change}"),
            weight: libm::log2(factor) / 2.0,
        })
    });
    pairs.collect()
}

/// A topic's name inside the namespace of a node.
pub(crate) fn relative<'t>(topic: &'t str, node: &str) -> &'t str {
    let space = namespace(node);
    let inside = if space == "/" {
        topic.strip_prefix('/')
    } else {
        topic.strip_prefix(space).and_then(|t| t.strip_prefix('/'))
    };
    inside.unwrap_or_else(|| topic.strip_prefix('/').unwrap_or(topic))
}

/// The majority graph of every phase.
pub(crate) fn configurations(source: &FigureSource<'_>) -> Vec<Configuration> {
    let mission = source.mission;
    let of = |p: &crate::mission::ledger::Phase| {
        configuration_of(&mission.elements, &mission.activity, p.span)
    };
    source.phases.iter().map(of).collect()
}

/// Topics whose main sender in a phase differs from that in the phase before, put together by the two rows; the first
/// few of them, and the number of the others.
pub(crate) fn handovers(source: &FigureSource<'_>, tracks: &[Track]) -> (Vec<Handover>, usize) {
    let row = |role: &str| tracks.iter().position(|t| &*t.name == role);
    let found = configurations(source);
    let mut all: Vec<Handover> = Vec::new();
    for (pair, phase) in found.windows(2).zip(source.phases.iter().skip(1)) {
        let mut pairs: BTreeMap<(usize, usize), BTreeSet<TopicId>> = BTreeMap::new();
        for (topic, after) in pair[1].senders.iter().filter(|(t, _)| source.shows(**t)) {
            let before = pair[0].senders.get(topic).filter(|b| *b != after);
            if let Some((from, to)) = before.and_then(|b| row(b).zip(row(after))) {
                pairs.entry((from, to)).or_default().insert(*topic);
            }
        }
        all.extend(pairs.into_iter().map(|((from, to), ids)| {
            Handover {
                at: phase.span.start,
                from,
                to,
                topics: ids
                    .iter()
                    .map(|t| last_part(source.topic(*t)).to_owned())
                    .collect(),
                ids: ids.into_iter().collect(),
            }
        }));
    }
    let left = all.len().saturating_sub(MOST.1);
    all.truncate(MOST.1);
    (all, left)
}
