//! The elements with their ids, and the graph of each window.

use std::collections::BTreeMap;

use super::Built;
use super::liveness::{Lifetime, Liveness};
use super::rates::{Rates, Sums};
use super::values::Values;
use super::windows::Windows;
use crate::base::role::role;
use crate::base::time::{Span, Stamp};
use crate::evidence::claim::Name;
use crate::evidence::collector::Collected;
use crate::evidence::proof::{Key, Reliability, offers};
use crate::graph::lives::{Known, Life, Stretch, Transition, Voice, all_silent, silences};
use crate::graph::{
    Edge, EdgeId, EdgeState, Graph, Node, NodeId, NodeState, State, Topic, TopicState,
};

/// What happened on each topic: its streams, and their messages per window.
pub(crate) type Traffic = BTreeMap<Name, (Vec<usize>, Rates)>;

/// Who looks when.
#[derive(Clone, Copy)]
pub(crate) struct Sight<'a> {
    pub(crate) windows: &'a Windows<'a>,
    /// Windows of silence before somebody who never speaks again counts as gone.
    pub(crate) grace: usize,
    /// The first and the last moment of the mission.
    pub(crate) mission: (Stamp, Stamp),
}

/// Windows shorter than this have no rates.
const SHORTEST_NS: i64 = 1_000_000;

/// Lists every element and its state in every window. Tracks come in the order of the elements' names.
pub(crate) fn assemble(
    tracks: &BTreeMap<Key, Liveness>,
    traffic: &Traffic,
    values: &Values,
    sight: &Sight<'_>,
    collected: &Collected,
) -> Built {
    let many = sight.windows.len();
    let mut all = Assembly {
        built: Built {
            graphs: vec![Graph::default(); many],
            messages: vec![0; many],
            ..Built::default()
        },
        sight,
        collected,
        values,
        traffic,
        nodes: BTreeMap::new(),
        topics: BTreeMap::new(),
        publishers: BTreeMap::new(),
        offers: offers(&collected.facts.offers, &collected.streams),
        sent: BTreeMap::new(),
    };
    all.count_sent();
    for what in tracks.keys() {
        if let Key::Publish(_, topic) = what {
            *all.publishers.entry(*topic).or_default() += 1;
        }
    }
    for (what, track) in tracks {
        match *what {
            Key::Node(node) => all.node(node, track),
            Key::Topic(topic) => all.topic(topic, track),
            Key::Publish(node, topic) => all.publish(node, topic, track),
            Key::Subscribe(topic, node) => all.subscribe(topic, node, track),
        }
    }
    all.voices();
    all.built
}

struct Assembly<'a> {
    built: Built,
    sight: &'a Sight<'a>,
    collected: &'a Collected,
    values: &'a Values,
    traffic: &'a Traffic,
    nodes: BTreeMap<Name, NodeId>,
    topics: BTreeMap<Name, u32>,
    /// How many nodes are known to publish each topic.
    publishers: BTreeMap<Name, u32>,
    /// How many publishers the bags count on each topic.
    offers: BTreeMap<Name, u32>,
    /// Messages of each known publisher: per topic, then per window.
    sent: BTreeMap<Name, BTreeMap<Name, BTreeMap<usize, u64>>>,
}

impl Assembly<'_> {
    /// Tells what every sender sent, and when nodes changed their states.
    fn voices(&mut self) {
        for (topic, (_, rates)) in self.traffic {
            let Some(id) = self.topics.get(topic) else {
                continue;
            };
            for sender in rates.senders.iter().filter(|s| !s.stretches.is_empty()) {
                self.built.lives.voices.push(Voice {
                    topic: *id,
                    node: sender.node.and_then(|node| self.nodes.get(&node)).copied(),
                    is_latched: sender.latched,
                    stretches: sender.stretches.clone(),
                });
            }
        }
        for (node, id) in &self.nodes {
            let states = self
                .values
                .transitions(*node)
                .map(|(time, state)| Transition {
                    node: *id,
                    time: *time,
                    state: std::sync::Arc::clone(state),
                });
            self.built.lives.transitions.extend(states);
        }
        let order = |t: &Transition| (t.time, t.node);
        self.built.lives.transitions.sort_by_key(order);
    }

    /// How the known sender of an edge sends on its topic.
    fn stretches(&self, node: Option<Name>, topic: Name) -> &[Stretch] {
        let senders = self.traffic.get(&topic).map(|(_, rates)| &rates.senders);
        let sender = senders.and_then(|all| all.iter().find(|s| s.node == node));
        sender.map_or(&[], |s| &s.stretches)
    }

    /// When all are silent who send on a topic.
    fn topic_silences(&self, topic: Name, lives: &[Span]) -> Vec<(Stamp, Option<Stamp>)> {
        let Some((_, rates)) = self.traffic.get(&topic) else {
            return Vec::new();
        };
        let of: Vec<&[Stretch]> = rates.senders.iter().map(|s| &s.stretches[..]).collect();
        all_silent(&of, lives)
    }

    /// When all is silent that a node sends.
    fn node_silences(&self, node: Name, lives: &[Span]) -> Vec<(Stamp, Option<Stamp>)> {
        let senders = self.traffic.values().flat_map(|(_, rates)| &rates.senders);
        let own = senders.filter(|s| s.node == Some(node) && !s.latched);
        let of: Vec<&[Stretch]> = own.map(|s| &s.stretches[..]).collect();
        all_silent(&of, lives)
    }

    /// Adds up the messages of each publisher.
    fn count_sent(&mut self) {
        for (topic, (streams, rates)) in self.traffic {
            for tally in &rates.tallies {
                self.built.messages[tally.window] += tally.count;
            }
            for (place, stream) in streams.iter().enumerate() {
                let stream = &self.collected.streams[*stream];
                let Some(node) = stream
                    .speaker
                    .filter(|_| stream.trust != Reliability::First)
                else {
                    continue;
                };
                let of = self
                    .sent
                    .entry(node)
                    .or_default()
                    .entry(*topic)
                    .or_default();
                for tally in rates.tallies.iter().filter(|t| t.streams[place] > 0) {
                    *of.entry(tally.window).or_default() += tally.streams[place];
                }
            }
        }
    }

    fn node(&mut self, name: Name, track: &Liveness) {
        let id = next(self.nodes.len());
        self.nodes.insert(name, id);
        let (first, last) = track.bounds();
        let text = self.collected.facts.text(name);
        self.built.elements.nodes.push(Node {
            role: role(&text).into(),
            name: text.into(),
            evidence: track.evidence,
            first,
            last,
            runs: spans(track),
        });
        let sent = self.sent.get(&name);
        let silent = self.node_silences(name, &spans(track));
        self.built.lives.nodes.push(known(track, self.sight));
        for (window, span) in self.sight.windows.0.iter().enumerate() {
            if !self.sight.sees(track, *span) {
                continue;
            }
            let state = match () {
                () if track.is_declared() => State::Declared,
                () if track.is_latched() && !track.speaks => State::Latched,
                () if is_silent(&silent, *span) => State::Silent,
                () => State::Active,
            };
            let count = sent.map(|topics| topics.values().filter_map(|w| w.get(&window)).sum());
            self.built.graphs[window].nodes.push(NodeState {
                id,
                state,
                degree: track.degree,
                hz: count.and_then(|n| per_second(n, *span)),
                lifecycle: self.values.lifecycle(name, *span),
            });
        }
    }

    fn topic(&mut self, name: Name, track: &Liveness) {
        let id = next(self.topics.len());
        self.topics.insert(name, id);
        let (first, last) = track.bounds();
        let traffic = self.traffic.get(&name);
        let mut types: Vec<_> = traffic
            .iter()
            .flat_map(|(streams, _)| streams)
            .map(|s| self.collected.streams[*s].connection.type_name.clone())
            .chain(self.values.types(name))
            .filter(|name| !name.is_empty())
            .collect();
        types.sort_unstable();
        types.dedup();
        self.built.elements.topics.push(Topic {
            name: self.collected.facts.text(name).into(),
            types,
            evidence: track.evidence,
            first,
            last,
            qos: self.values.quality(name),
            runs: spans(track),
            unknown_publishers: self.unknown_publishers(name),
        });
        let tallies = traffic.map_or(&[][..], |(_, rates)| &rates.tallies);
        let mut tallies = tallies.iter().peekable();
        let silent = self.topic_silences(name, &spans(track));
        self.built.lives.topics.push(known(track, self.sight));
        for (window, span) in self.sight.windows.0.iter().enumerate() {
            let tally = tallies.next_if(|t| t.window == window);
            if self.sight.sees(track, *span) {
                let state = match tally {
                    _ if track.is_declared() => State::Declared,
                    _ if track.is_latched() => State::Latched,
                    None if track.senders.0 == 0 || is_silent(&silent, *span) => State::Silent,
                    _ => State::Active,
                };
                self.built.graphs[window].topics.push(TopicState {
                    id,
                    state,
                    degree: track.degree,
                    count: tally.map_or(0, |t| t.count),
                    bytes: bytes(tally, traffic.is_some()),
                    hz: per_second(tally.map_or(0, |t| t.count), *span),
                    median_period_s: tally.and_then(|t| t.median_period_s),
                    max_gap_s: tally.and_then(|t| t.max_gap_s),
                });
            }
        }
    }

    /// How many publishers of a topic the bag counts beyond those that are known.
    fn unknown_publishers(&self, topic: Name) -> Option<u32> {
        let counted = *self.offers.get(&topic)?;
        let known = self.publishers.get(&topic).copied().unwrap_or(0);
        Some(counted.saturating_sub(known))
    }

    fn publish(&mut self, node: Name, topic: Name, track: &Liveness) {
        let id = next(self.built.elements.publishes.len());
        let edge = self.edge(node, topic, track);
        self.built.elements.publishes.push(edge);
        let sent = self.sent.get(&node).and_then(|topics| topics.get(&topic));
        let silent = silences(self.stretches(Some(node), topic), &spans(track));
        self.built.lives.publishes.push(known(track, self.sight));
        for (window, span) in self.sight.windows.0.iter().enumerate() {
            if !self.sight.sees(track, *span) {
                continue;
            }
            let count = sent.map(|windows| windows.get(&window).copied().unwrap_or(0));
            let state = match count {
                _ if track.is_declared() => State::Declared,
                _ if track.is_latched() => State::Latched,
                None | Some(0) if track.senders.0 == 0 || is_silent(&silent, *span) => {
                    State::Silent
                }
                _ => State::Active,
            };
            let state = edge_state(id, track, state, *span, count);
            self.built.graphs[window].publishes.push(state);
        }
    }

    /// A subscription is as lively as its topic.
    fn subscribe(&mut self, topic: Name, node: Name, track: &Liveness) {
        let id = next(self.built.elements.subscribes.len());
        let edge = self.edge(node, topic, track);
        let of = edge.topic;
        self.built.elements.subscribes.push(edge);
        self.built.lives.subscribes.push(known(track, self.sight));
        for (window, span) in self.sight.windows.0.iter().enumerate() {
            if !self.sight.sees(track, *span) {
                continue;
            }
            let graph = &mut self.built.graphs[window];
            let topics = &graph.topics;
            let place = topics.binary_search_by_key(&of, |t| t.id);
            let state = match place.map(|at| topics[at].state) {
                _ if track.is_declared() => State::Declared,
                Ok(state) => state,
                Err(_) => State::Silent,
            };
            graph
                .subscribes
                .push(edge_state(id, track, state, *span, None));
        }
    }

    fn edge(&self, node: Name, topic: Name, track: &Liveness) -> Edge {
        let (first, last) = track.bounds();
        Edge {
            node: self.nodes.get(&node).copied().unwrap_or(NodeId::MAX),
            topic: self.topics.get(&topic).copied().unwrap_or(u32::MAX),
            evidence: track.evidence,
            first,
            last,
            runs: spans(track),
        }
    }
}

impl Sight<'_> {
    /// Whether an element is seen in a window.
    fn sees(&self, track: &Liveness, span: Span) -> bool {
        let last = track.lives.len().saturating_sub(1);
        track.lives.iter().enumerate().any(|(at, life)| {
            let to = if at == last && self.grace > 0 {
                self.windows.last_moment(life.to, self.grace)
            } else {
                life.to
            };
            life.from < span.end && span.start <= to
        })
    }
}

/// When an element is there, half-open.
fn spans(track: &Liveness) -> Vec<Span> {
    let span = |life: &Lifetime| Span {
        start: life.from,
        end: life.to.plus(1),
    };
    track.lives.iter().map(span).collect()
}

/// What is known of an element's lives.
fn known(track: &Liveness, sight: &Sight<'_>) -> Known {
    let within = |bound: crate::graph::lives::Bound| crate::graph::lives::Bound {
        earliest: bound.earliest.max(sight.mission.0),
        latest: bound.latest.min(sight.mission.1),
        ..bound
    };
    let lives = spans(track).into_iter().zip(&track.lives);
    Known {
        degree: track.degree,
        lives: lives
            .map(|(span, life)| Life {
                span,
                began: life.began.map(within),
                ended: life.ended.map(within),
            })
            .collect(),
    }
}

/// Whether a window lies in a silence.
fn is_silent(silences: &[(Stamp, Option<Stamp>)], span: Span) -> bool {
    let covers = |(from, to): &(Stamp, Option<Stamp>)| {
        *from < span.start && to.is_none_or(|to| span.end <= to)
    };
    silences.iter().any(covers)
}

fn edge_state(
    id: EdgeId,
    track: &Liveness,
    state: State,
    span: Span,
    count: Option<u64>,
) -> EdgeState {
    EdgeState {
        id,
        state,
        degree: track.degree,
        count,
        hz: count.and_then(|n| per_second(n, span)),
    }
}

fn bytes(tally: Option<&Sums>, recorded: bool) -> Option<u64> {
    match tally {
        Some(tally) => tally.bytes,
        None => recorded.then_some(0),
    }
}

fn per_second(count: u64, span: Span) -> Option<f64> {
    let nanos = span.nanos();
    (nanos >= SHORTEST_NS).then(|| count as f64 / (nanos as f64 / 1e9))
}

fn next(len: usize) -> u32 {
    u32::try_from(len).unwrap_or(u32::MAX)
}
