//! Arrows from publisher to subscriber, one per pair, with the topics on it.

use std::collections::BTreeMap;

use super::source::FigureSource;
use super::tracks::Track;
use crate::base::name::last_part;
use crate::base::words;
use crate::evidence::Degree;
use crate::graph::{Element, TopicId};

/// All topics from one box to another.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Talk {
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// The topics with their rates in messages per second while they are sent, the fastest first.
    pub(crate) topics: Vec<(TopicId, f64)>,
    /// Whether all of them are known by inference only.
    pub(crate) is_inferred: bool,
}

impl Talk {
    /// The rate of all topics.
    pub(crate) fn hz(&self) -> f64 {
        self.topics.iter().map(|(_, hz)| hz).sum()
    }

    /// The texts that a label may have, the best first, each as lines: the fastest `most` topics and the number of the
    /// others, then fewer topics down to one, at last all on one line.
    pub(crate) fn labels(&self, source: &FigureSource<'_>, most: usize) -> Vec<Vec<String>> {
        let mut names: Vec<String> = Vec::new();
        for (topic, _) in &self.topics {
            let name = words::shorten(last_part(source.topic(*topic)), LONGEST).into_owned();
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let lines = |most: usize| {
            let mut lines: Vec<String> = names.iter().take(most).cloned().collect();
            if names.len() > most {
                lines.push(format!("+{}", names.len() - most));
            }
            lines
        };
        let mut all: Vec<Vec<String>> = (1..=most).rev().map(lines).collect();
        all.push(vec![lines(1).join(" ")]);
        all.dedup();
        all
    }
}

/// The longest name on an arrow, in characters.
const LONGEST: usize = 22;

/// The presence of an edge, cell by cell.
struct EdgePresence {
    track: usize,
    topic: TopicId,
    cells: Vec<bool>,
    degree: Degree,
    hz: f64,
}

/// Every edge of the tracks, so that talks of any stretch can be told.
pub(crate) struct Talks<'a> {
    source: &'a FigureSource<'a>,
    sends: Vec<EdgePresence>,
    hears: Vec<EdgePresence>,
}

impl<'a> Talks<'a> {
    pub(crate) fn new(source: &'a FigureSource<'a>, tracks: &[Track]) -> Self {
        let elements = &source.mission.elements;
        let mut track_of = vec![None; elements.nodes.len()];
        for (at, track) in tracks.iter().enumerate() {
            for node in &track.nodes {
                if let Some(of) = track_of.get_mut(*node as usize) {
                    *of = Some(at);
                }
            }
        }
        let activity = &source.mission.activity;
        let heard = |edges: &[crate::graph::Edge], what: fn(u32) -> Element, sent: bool| {
            let heard = (0..).zip(edges).filter_map(|(id, edge)| {
                let shown = source.shows(edge.topic) && !source.is_hub(edge.topic);
                let track = track_of.get(edge.node as usize).copied().flatten();
                let degrees = || activity.graphs.rows(what(id)).map(|(_, row)| row.degree);
                track.filter(|_| shown).map(|track| EdgePresence {
                    track,
                    topic: edge.topic,
                    cells: activity.presence(what(id), |_| true),
                    degree: degrees().min().unwrap_or(Degree::Declared),
                    hz: if sent { rate(source, id) } else { 0.0 },
                })
            });
            heard.collect::<Vec<EdgePresence>>()
        };
        Self {
            source,
            sends: heard(&elements.publishes, Element::Publish, true),
            hears: heard(&elements.subscribes, Element::Subscribe, false),
        }
    }

    /// The talks between boxes, `vertex` being the box of each track, that hold in at least one cell of `range`, or in
    /// half of them.
    pub(crate) fn between(
        &self,
        vertex: &[Option<usize>],
        range: (usize, usize),
        is_majority: bool,
    ) -> Vec<Talk> {
        let least = if is_majority {
            (range.1 - range.0).div_ceil(2).max(1)
        } else {
            1
        };
        let mut all: BTreeMap<(usize, usize), (BTreeMap<TopicId, f64>, bool)> = BTreeMap::new();
        for send in &self.sends {
            for hear in self.hears.iter().filter(|h| h.topic == send.topic) {
                let ends = (
                    vertex.get(send.track).copied().flatten(),
                    vertex.get(hear.track).copied().flatten(),
                );
                let (Some(from), Some(to)) = ends else {
                    continue;
                };
                let both = send.cells[range.0..range.1]
                    .iter()
                    .zip(&hear.cells[range.0..range.1]);
                if from == to || both.filter(|(a, b)| **a && **b).count() < least {
                    continue;
                }
                let inferred = send.degree.max(hear.degree) >= Degree::Inferred;
                let (topics, all_inferred) =
                    all.entry((from, to)).or_insert((BTreeMap::new(), true));
                let hz = topics.entry(send.topic).or_insert(0.0);
                *hz = hz.max(send.hz);
                *all_inferred &= inferred;
            }
        }
        all.into_iter()
            .map(|((from, to), (topics, is_inferred))| {
                let mut topics: Vec<(TopicId, f64)> = topics.into_iter().collect();
                topics.sort_by(|a, b| {
                    b.1.total_cmp(&a.1)
                        .then_with(|| self.source.topic(a.0).cmp(self.source.topic(b.0)))
                });
                Talk {
                    from,
                    to,
                    topics,
                    is_inferred,
                }
            })
            .collect()
    }
}

/// Messages per second of a publication while it sends; 0 where that is not known.
fn rate(source: &FigureSource<'_>, edge: u32) -> f64 {
    let count: f64 = source.sent(edge).iter().sum();
    let seconds = source
        .sending(edge)
        .iter()
        .map(|s| s.nanos() as f64 / 1e9)
        .sum::<f64>();
    if seconds > 1e-3 { count / seconds } else { 0.0 }
}
