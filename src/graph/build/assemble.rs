//! The elements with their ids, and the graph of each window.

use std::collections::{BTreeMap, BTreeSet};

use super::Built;
use super::liveness::Liveness;
use super::rates::{Rates, Sums};
use super::roles::role;
use super::values::Values;
use super::windows::Windows;
use crate::base::time::Span;
use crate::evidence::claim::Name;
use crate::evidence::collector::Collected;
use crate::evidence::proof::{Key, Reliability, offers};
use crate::graph::{
    Edge, EdgeId, EdgeState, Graph, Node, NodeId, NodeState, State, Topic, TopicState,
};

/// What happened on each topic: its streams, and their messages per window.
pub(crate) type Traffic = BTreeMap<Name, (Vec<usize>, Rates)>;

/// Windows shorter than this have no rates.
const SHORTEST_NS: i64 = 1_000_000;

/// Lists every element and its state in every window. Tracks come in the order of the elements' names.
pub(crate) fn assemble(
    tracks: &BTreeMap<Key, Liveness>,
    traffic: &Traffic,
    values: &Values,
    windows: &Windows<'_>,
    collected: &Collected,
) -> Built {
    let mut all = Assembly {
        built: Built {
            graphs: vec![Graph::default(); windows.len()],
            messages: vec![0; windows.len()],
            ..Built::default()
        },
        windows,
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
    all.let_go();
    all.built
}

struct Assembly<'a> {
    built: Built,
    windows: &'a Windows<'a>,
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
    /// A latched message does not outlive its publishers: once all that are known are gone, and nobody known listens,
    /// the topic is gone too.
    fn let_go(&mut self) {
        let Built {
            elements, graphs, ..
        } = &mut self.built;
        let sent_on: BTreeSet<u32> = elements.publishes.iter().map(|e| e.topic).collect();
        for graph in graphs {
            let publishes = graph
                .publishes
                .iter()
                .map(|s| elements.publishes[s.id as usize].topic);
            let subscribes = graph
                .subscribes
                .iter()
                .map(|s| elements.subscribes[s.id as usize].topic);
            let linked: BTreeSet<u32> = publishes.chain(subscribes).collect();
            graph.topics.retain(|topic| {
                let is_held = topic.state == State::Latched && sent_on.contains(&topic.id);
                !is_held || linked.contains(&topic.id)
            });
        }
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
        });
        let sent = self.sent.get(&name);
        for (window, span) in self.windows.0.iter().enumerate() {
            let Some((state, degree)) = track.state(window, *span) else {
                continue;
            };
            let count = sent.map(|topics| topics.values().filter_map(|w| w.get(&window)).sum());
            self.built.graphs[window].nodes.push(NodeState {
                id,
                state,
                degree,
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
            unknown_publishers: self.unknown_publishers(name),
        });
        let tallies = traffic.map_or(&[][..], |(_, rates)| &rates.tallies);
        let mut tallies = tallies.iter().peekable();
        for (window, span) in self.windows.0.iter().enumerate() {
            let tally = tallies.next_if(|t| t.window == window);
            if let Some((state, degree)) = track.state(window, *span) {
                self.built.graphs[window].topics.push(TopicState {
                    id,
                    state,
                    degree,
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
        for (window, span) in self.windows.0.iter().enumerate() {
            let count = sent.map(|windows| windows.get(&window).copied().unwrap_or(0));
            let state = edge_state(id, track, window, *span, count);
            self.built.graphs[window].publishes.extend(state);
        }
    }

    fn subscribe(&mut self, topic: Name, node: Name, track: &Liveness) {
        let id = next(self.built.elements.subscribes.len());
        let edge = self.edge(node, topic, track);
        self.built.elements.subscribes.push(edge);
        for (window, span) in self.windows.0.iter().enumerate() {
            let state = edge_state(id, track, window, *span, None);
            self.built.graphs[window].subscribes.extend(state);
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
        }
    }
}

fn edge_state(
    id: EdgeId,
    track: &Liveness,
    window: usize,
    span: Span,
    count: Option<u64>,
) -> Option<EdgeState> {
    let (state, degree) = track.state(window, span)?;
    Some(EdgeState {
        id,
        state,
        degree,
        count,
        hz: count.and_then(|n| per_second(n, span)),
    })
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
