//! Arrows from publisher to subscriber, one per pair, with the topics on it.

use std::collections::BTreeMap;

use crate::base::name::last_part;
use crate::base::time::Span;
use crate::base::words;
use crate::draw::timeline::canvas::HAIRLINE;
use crate::draw::timeline::rows::{Row, Steps, mean};
use crate::draw::timeline::source::FigureSource;
use crate::evidence::Confidence;
use crate::graph::{ById, Element, TopicId};
use crate::layout::Link;

/// All topics from one box to another.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Talk {
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// The topics with their rates in messages per second while they are published, the fastest first.
    pub(crate) topics: Vec<(TopicId, f64)>,
    /// Whether all of them are known by inference only.
    pub(crate) is_inferred: bool,
}

impl Talk {
    /// The width of its line in millimetres, by the rate of all topics.
    pub(crate) fn pen(&self) -> f64 {
        let hz: f64 = self.topics.iter().map(|(_, hz)| hz).sum();
        (0.14 + 0.12 * libm::log10(1.0 + hz)).max(HAIRLINE)
    }

    /// Its arrow without the label, which is placed afterwards.
    pub(crate) fn link(&self) -> Link {
        Link {
            from: self.from,
            to: self.to,
            ..Link::default()
        }
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

/// The lifetimes of an edge.
struct EdgePresence {
    track: usize,
    topic: TopicId,
    lives: Vec<Span>,
    confidence: Confidence,
    hz: f64,
}

/// Every edge of the tracks, from which the arrows of any time are made.
pub(crate) struct Talks<'a> {
    source: &'a FigureSource<'a>,
    sends: Vec<EdgePresence>,
    receives: Vec<EdgePresence>,
}

impl<'a> Talks<'a> {
    pub(crate) fn new(source: &'a FigureSource<'a>, tracks: &[Row]) -> Self {
        let elements = &source.mission.elements;
        let mut track_of = ById::like(&elements.nodes, None);
        for (at, track) in tracks.iter().enumerate() {
            for node in &track.nodes {
                if let Some(of) = track_of.get_mut(*node) {
                    *of = Some(at);
                }
            }
        }
        let steps = Steps::new(source);
        let presence = |what: Element| {
            let (node, topic) = elements.ends(what);
            let (node, topic) = (node?, topic?);
            let track = track_of.get(node).copied().flatten()?;
            let shown = source.shows(topic) && !source.is_hub(topic);
            let sender = match what {
                Element::Publish(id) => source.senders(&[id]).into_iter().next(),
                _ => None,
            };
            let hz = sender.and_then(|s| mean(&steps.pieces(s, source.span())));
            shown.then(|| EdgePresence {
                track,
                topic,
                lives: source.lives(what).collect(),
                confidence: source.confidence(what),
                hz: hz.unwrap_or(0.0),
            })
        };
        let edges = |is: fn(&Element) -> bool| elements.all().filter(is).filter_map(presence);
        Self {
            source,
            sends: edges(|what| matches!(what, Element::Publish(_))).collect(),
            receives: edges(|what| matches!(what, Element::Subscribe(_))).collect(),
        }
    }

    /// The arrows between boxes that exist at any moment of `time`, or in half of it; `vertex` is the box of
    /// each track.
    pub(crate) fn between(
        &self,
        vertex: &[Option<usize>],
        time: Span,
        is_majority: bool,
    ) -> Vec<Talk> {
        let least = if is_majority { time.nanos() / 2 } else { 0 };
        let mut all: BTreeMap<(usize, usize), (BTreeMap<TopicId, f64>, bool)> = BTreeMap::new();
        for send in &self.sends {
            for other in self.receives.iter().filter(|r| r.topic == send.topic) {
                let ends = (
                    vertex.get(send.track).copied().flatten(),
                    vertex.get(other.track).copied().flatten(),
                );
                let (Some(from), Some(to)) = ends else {
                    continue;
                };
                if from == to || shared(&send.lives, &other.lives, time) <= least {
                    continue;
                }
                let inferred = send.confidence.max(other.confidence) >= Confidence::Inferred;
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

/// The overlap of both lists of lifetimes inside `time`, in nanoseconds.
fn shared(a: &[Span], b: &[Span], time: Span) -> i64 {
    let both = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
    let inside = both.map(|(a, b)| {
        Span::new(
            a.start.max(b.start).max(time.start),
            a.end.min(b.end).min(time.end),
        )
    });
    inside.map(|span| span.nanos().max(0)).sum()
}
