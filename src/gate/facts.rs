//! What a mission answers when it is asked by name: who is there, when, how often, and whether the bag can tell at all.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::finding::Cause;
use super::pattern::Pattern;
use crate::base::name::is_quiet;
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::evidence::{Degree, Evidence};
use crate::graph::lives::Bound;
use crate::graph::{Edge, Element, NodeId, State, TopicId, TopicState};
use crate::mission::activity::is_hidden_node;
use crate::mission::ledger::{Entry, Kind};
use crate::mission::{Mission, Window};

/// Robots are shut down before their recorder is: what ends so shortly before the mission does, stays.
pub(crate) const SHUTDOWN_NS: i64 = 5_000_000_000;
/// A recorder has found the topics that are there when it starts after so long.
const FOUND_NS: i64 = 2_500_000_000;

/// A mission, with what is asked often worked out once.
pub(crate) struct Facts<'a> {
    pub(crate) mission: &'a Mission,
    degrees: Degrees,
    /// Messages of each topic.
    messages: Vec<u64>,
    /// Nodes that are there, by role.
    roles: BTreeMap<&'a str, Vec<NodeId>>,
}

/// How well each element is known at its best.
struct Degrees {
    nodes: Vec<Degree>,
    publishes: Vec<Degree>,
    subscribes: Vec<Degree>,
}

/// How often a topic was sent in a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rate {
    /// The window's place.
    pub(crate) window: usize,
    /// The part of it that counts.
    pub(crate) span: Span,
    pub(crate) count: u64,
}

impl Rate {
    fn seconds(&self) -> f64 {
        self.span.nanos().max(1) as f64 / 1e9
    }

    /// Messages per second.
    pub(crate) fn hz(&self) -> f64 {
        self.count as f64 / self.seconds()
    }

    /// The same with a message more, which may have come a moment too late for this window.
    pub(crate) fn at_most(&self) -> f64 {
        (self.count + 1) as f64 / self.seconds()
    }

    /// The same with a message less.
    pub(crate) fn at_least(&self) -> f64 {
        self.count.saturating_sub(1) as f64 / self.seconds()
    }
}

/// Evidence that says what should be, not what was.
const DECLARING: [&str; 4] = ["source", "source_only", "launch", "topology"];
/// Evidence that lists all subscribers of a topic.
const LISTING: [&str; 4] = ["rosgraph", "discovery", "statistics", "topic_statistics"];

/// Whether something was seen, not only declared.
fn is_seen(evidence: Evidence) -> bool {
    evidence.words().any(|word| !DECLARING.contains(&word))
}

fn has(evidence: Evidence, words: &[&str]) -> bool {
    evidence.words().any(|word| words.contains(&word))
}

impl<'a> Facts<'a> {
    /// The facts of a mission.
    pub(crate) fn new(mission: &'a Mission) -> Self {
        let elements = &mission.elements;
        let mut degrees = Degrees {
            nodes: vec![Degree::Declared; elements.nodes.len()],
            publishes: vec![Degree::Declared; elements.publishes.len()],
            subscribes: vec![Degree::Declared; elements.subscribes.len()],
        };
        let mut messages = vec![0; elements.topics.len()];
        for graph in mission.windows.iter().map(|w| &w.graph) {
            raise(
                &mut degrees.nodes,
                graph.nodes.iter().map(|s| (s.id, s.degree)),
            );
            let edges = graph.publishes.iter().map(|s| (s.id, s.degree));
            raise(&mut degrees.publishes, edges);
            let edges = graph.subscribes.iter().map(|s| (s.id, s.degree));
            raise(&mut degrees.subscribes, edges);
            for topic in &graph.topics {
                if let Some(sum) = messages.get_mut(topic.id as usize) {
                    *sum += topic.count;
                }
            }
        }
        let mut roles: BTreeMap<&str, Vec<NodeId>> = BTreeMap::new();
        for (id, node) in (0..).zip(&elements.nodes) {
            if is_seen(node.evidence) {
                roles.entry(&node.role).or_default().push(id);
            }
        }
        Self {
            mission,
            degrees,
            messages,
            roles,
        }
    }

    /// The roles that are there, each with its nodes.
    pub(crate) fn roles(&self) -> impl Iterator<Item = (&'a str, &[NodeId])> {
        self.roles
            .iter()
            .map(|(role, nodes)| (*role, nodes.as_slice()))
    }

    /// The roles that a pattern stands for; a name that has a role stands for it too.
    pub(crate) fn nodes(&self, pattern: &Pattern) -> Vec<(&'a str, &[NodeId])> {
        let own = |nodes: &[NodeId]| {
            let names = nodes.iter().map(|id| self.node(*id));
            names.into_iter().any(|name| pattern.matches(name))
        };
        self.roles()
            .filter(|(role, nodes)| pattern.matches(role) || own(nodes))
            .collect()
    }

    /// Whether a pattern stands for a node.
    pub(crate) fn fits(&self, pattern: &Pattern, node: NodeId) -> bool {
        pattern.matches(self.node(node)) || pattern.matches(self.role(node))
    }

    /// The topics that are there and that a pattern stands for.
    pub(crate) fn topics(&self, pattern: &Pattern) -> Vec<TopicId> {
        let topics = (0..).zip(&self.mission.elements.topics);
        topics
            .filter(|(id, topic)| pattern.matches(topic.name.as_str()) && self.is_there(*id))
            .map(|(id, _)| id)
            .collect()
    }

    /// Whether a topic has messages, or somebody who could send some.
    pub(crate) fn is_there(&self, topic: TopicId) -> bool {
        let own = &self.mission.elements.topics[topic as usize];
        let is_heard = || {
            edges(&self.mission.elements.subscribes, topic)
                .next()
                .is_some()
        };
        is_seen(own.evidence)
            && (self.messages[topic as usize] > 0
                || edges(&self.mission.elements.publishes, topic)
                    .next()
                    .is_some()
                || !is_heard())
    }

    /// Messages of a topic.
    pub(crate) fn messages(&self, topic: TopicId) -> u64 {
        self.messages[topic as usize]
    }

    pub(crate) fn node(&self, id: NodeId) -> &'a str {
        self.mission.elements.nodes[id as usize].name.as_str()
    }

    pub(crate) fn role(&self, id: NodeId) -> &'a str {
        &self.mission.elements.nodes[id as usize].role
    }

    pub(crate) fn topic(&self, id: TopicId) -> &'a str {
        self.mission.elements.topics[id as usize].name.as_str()
    }

    /// Whether a role is housekeeping or the recorder's.
    pub(crate) fn is_tool(&self, nodes: &[NodeId]) -> bool {
        let own = &self.mission.elements.nodes;
        nodes.iter().any(|id| is_hidden_node(&own[*id as usize]))
    }

    /// Whether a topic is housekeeping.
    pub(crate) fn is_housekeeping(&self, topic: TopicId) -> bool {
        is_quiet(self.topic(topic))
    }

    /// Whether a role is measured or stated, not only inferred.
    pub(crate) fn is_sure(&self, nodes: &[NodeId]) -> bool {
        let sure = |id: &NodeId| self.degrees.nodes[*id as usize] <= Degree::Stated;
        nodes.iter().any(sure)
    }

    /// Who publishes a topic, with how well that is known.
    pub(crate) fn publishers(&self, topic: TopicId) -> Vec<(NodeId, u32, Degree)> {
        let edges = edges(&self.mission.elements.publishes, topic);
        edges
            .map(|(id, edge)| (edge.node, id, self.degrees.publishes[id as usize]))
            .collect()
    }

    /// Who subscribes a topic, with how well that is known.
    pub(crate) fn subscribers(&self, topic: TopicId) -> Vec<(NodeId, u32, Degree)> {
        let edges = edges(&self.mission.elements.subscribes, topic);
        edges
            .map(|(id, edge)| (edge.node, id, self.degrees.subscribes[id as usize]))
            .collect()
    }

    /// Whether the bag names nodes at all.
    pub(crate) fn names_nodes(&self) -> bool {
        self.roles()
            .any(|(_, nodes)| self.is_sure(nodes) && !self.is_tool(nodes))
    }

    /// Whether the bag tells all publishers of a topic.
    pub(crate) fn tells_publishers(&self, topic: TopicId) -> bool {
        let unknown = self.mission.elements.topics[topic as usize].unknown_publishers;
        let known = self.publishers(topic);
        unknown.unwrap_or(0) == 0 && known.iter().any(|(.., degree)| *degree <= Degree::Stated)
    }

    /// Whether the bag lists subscribers, so that a node that is not listed is none: everywhere, or of these nodes.
    pub(crate) fn tells_subscribers(&self, nodes: &[NodeId]) -> bool {
        self.mission.elements.subscribes.iter().any(|edge| {
            let own = nodes.contains(&edge.node) && has(edge.evidence, &["links"]);
            own || has(edge.evidence, &LISTING) && !self.is_tool(&[edge.node])
        })
    }

    /// When nodes are there, taken together; in order, none overlapping.
    pub(crate) fn lives(&self, nodes: &[NodeId]) -> Vec<Span> {
        let mut all: Vec<Span> = Vec::new();
        for id in nodes {
            let runs = self.mission.elements.runs(Element::Node(*id));
            if runs.is_empty() {
                all.extend(self.windows_of(*id));
            } else {
                all.extend(runs);
            }
        }
        all.sort_by_key(|span| (span.start, span.end));
        let mut joined: Vec<Span> = Vec::new();
        for span in all {
            match joined.last_mut() {
                Some(last) if span.start <= last.end => last.end = last.end.max(span.end),
                _ => joined.push(span),
            }
        }
        joined
    }

    /// The windows in which a node is, of a mission of which nothing finer is known.
    fn windows_of(&self, node: NodeId) -> impl Iterator<Item = Span> + use<'a> {
        let is_in = move |w: &&Window| w.graph.nodes.binary_search_by_key(&node, |s| s.id).is_ok();
        self.mission.windows.iter().filter(is_in).map(|w| w.span)
    }

    /// Entries of the ledger about any of these nodes, but not about their edges.
    pub(crate) fn entries(&self, nodes: &[NodeId], kind: Kind) -> Vec<&'a Entry> {
        let own = |e: &&Entry| matches!(e.what, Element::Node(id) if nodes.contains(&id));
        let all = self.mission.ledger.entries.iter().filter(own);
        all.filter(|e| e.kind == kind).collect()
    }

    /// The lifecycle state that a role was last seen in.
    pub(crate) fn lifecycle(&self, nodes: &[NodeId]) -> Option<Arc<str>> {
        let states = |w: &'a Window| {
            let states = w.graph.nodes.iter().filter(|s| nodes.contains(&s.id));
            states.filter_map(|s| s.lifecycle.clone()).next_back()
        };
        self.mission.windows.iter().rev().find_map(states)
    }

    /// The first and the last message of a topic, the latter 1 ns before the end; `None` if it has none.
    pub(crate) fn heard(&self, topic: TopicId) -> Option<Span> {
        if let Some(stretches) = self.mission.activity.sending.topics.get(topic as usize)
            && let (Some(first), Some(last)) = (stretches.first(), stretches.last())
        {
            return Some(Span {
                start: first.start,
                end: last.end,
            });
        }
        let mut windows = self.mission.windows.iter().filter(|w| count(w, topic) > 0);
        let first = windows.next()?.span;
        Some(Span {
            start: first.start,
            end: windows.next_back().map_or(first, |w| w.span).end,
        })
    }

    /// The rates by which a topic is judged: of every whole window from its first message to the mission's end, or to
    /// its last message if it `may_end`.
    pub(crate) fn rates(&self, topic: TopicId, may_end: bool, during: Span) -> Vec<Rate> {
        let Some(heard) = self.heard(topic) else {
            return Vec::new();
        };
        let whole = self.mission.span;
        let windows = self.mission.windows.iter().filter(|w| !w.partial);
        let inside = windows.filter(|w| during.start <= w.span.start && w.span.end <= during.end);
        let rate = |w: &Window| {
            let mut span = w.span;
            if heard.start > span.start {
                // What is there when the recorder starts is heard a moment later; all else is not whole.
                let found = span.start == whole.start && heard.start.since(whole.start) <= FOUND_NS;
                span.start = found.then_some(heard.start)?;
            }
            if heard.end < span.end {
                let is_over = whole.end.since(heard.end) <= SHUTDOWN_NS;
                match (is_over, may_end) {
                    (true, _) => span.end = heard.end,
                    (false, true) => return None,
                    (false, false) => {}
                }
            }
            (span.nanos() >= w.span.nanos() / 2).then(|| Rate {
                window: w.index,
                span,
                count: count(w, topic),
            })
        };
        inside.filter_map(rate).collect()
    }

    /// Whether a topic's messages come at even times, by the median in each of these windows.
    pub(crate) fn is_even(&self, topic: TopicId, rates: &[Rate]) -> bool {
        let median = |rate: &Rate| {
            let window = self.mission.windows.get(rate.window)?;
            Some(state(window, topic)?.median_period_s? * rate.hz())
        };
        let mut shares = rates.iter().filter_map(median).peekable();
        shares.peek().is_some() && shares.all(|share| (0.8..=1.25).contains(&share))
    }

    /// The longest silences of a topic, each with when: within windows, and of 4 s or more across them.
    pub(crate) fn gaps(&self, topic: TopicId, during: Span) -> Vec<(Span, i64)> {
        let inside = |span: &Span| during.start <= span.start && span.end <= during.end;
        let mut all = Vec::new();
        for window in self.mission.windows.iter().filter(|w| inside(&w.span)) {
            if let Some(gap) = state(window, topic).and_then(|s| s.max_gap_s) {
                all.push((window.span, nanos(gap)));
            }
        }
        let stretches = self.mission.activity.sending.topics.get(topic as usize);
        for pair in stretches.map_or(&[][..], Vec::as_slice).windows(2) {
            let span = Span {
                start: pair[0].end,
                end: pair[1].start,
            };
            if inside(&span) {
                all.push((span, span.nanos()));
            }
        }
        all
    }

    /// Whether a topic's last message stands for it; `None` where the bag does not tell.
    pub(crate) fn is_latched(&self, topic: TopicId) -> Option<bool> {
        let own = &self.mission.elements.topics[topic as usize];
        let states = self.mission.windows.iter().filter_map(|w| state(w, topic));
        let states: BTreeSet<State> = states.map(|s| s.state).collect();
        match &own.qos {
            _ if states.contains(&State::Latched) => Some(true),
            Some(qos) => Some(qos.contains("transient_local")),
            None if states.contains(&State::Silent) => Some(false),
            None => None,
        }
    }

    /// When a role first appeared, as well as it is known: the time, and between which the truth lies.
    pub(crate) fn began(&self, nodes: &[NodeId]) -> Option<Bound> {
        let first = self.lives(nodes).first()?.start;
        let started = self.entries(nodes, Kind::Started);
        let entry = started.into_iter().find(|e| e.time >= first);
        let is_first = |e: &&Entry| e.time.since(first) < 1_000_000_000;
        Some(match entry.filter(is_first) {
            Some(entry) => Bound {
                time: entry.time,
                earliest: entry.earliest,
                latest: entry.latest,
            },
            None => Bound {
                time: first,
                earliest: Stamp::MIN,
                latest: first,
            },
        })
    }

    /// What the ledger tells about why a topic changed around a time: its publishers, and those who feed them.
    pub(crate) fn cause_for_topic(&self, topic: TopicId, around: Span) -> Option<Cause> {
        let direct: BTreeSet<NodeId> = self.publishers(topic).iter().map(|p| p.0).collect();
        let fed: BTreeSet<TopicId> = {
            let edges = self.mission.elements.subscribes.iter();
            let own = edges.filter(|e| direct.contains(&e.node) && e.topic != topic);
            own.map(|e| e.topic).collect()
        };
        let feeders: BTreeSet<NodeId> = fed
            .iter()
            .flat_map(|topic| self.publishers(*topic))
            .map(|p| p.0)
            .filter(|node| !direct.contains(node))
            .collect();
        self.cause(&direct, around)
            .or_else(|| self.cause(&feeders, around))
    }

    /// The first thing that the ledger tells of one of these nodes in a stretch of time.
    pub(crate) fn cause(&self, nodes: &BTreeSet<NodeId>, around: Span) -> Option<Cause> {
        let wanted = [Kind::Stopped, Kind::Restarted, Kind::Silent];
        let entries = self.mission.ledger.inside(around).map(|(_, entry)| entry);
        let mut entries = entries.filter(|e| wanted.contains(&e.kind));
        let entry = entries.find(|e| matches!(e.what, Element::Node(id) if nodes.contains(&id)))?;
        self.mission.elements.ends(entry.what).0.map(|node| Cause {
            time: Some(entry.time),
            text: format!(
                "{} {} at {}",
                self.role(node),
                entry.kind.word(),
                self.clock(entry.time)
            ),
        })
    }

    /// A moment of the mission, for people.
    pub(crate) fn clock(&self, at: Stamp) -> String {
        words::offset_seconds(self.mission.offset(at))
    }

    /// A stretch of the mission, for people.
    pub(crate) fn stretch(&self, span: Span) -> String {
        format!("{}–{}", self.clock(span.start), self.clock(span.end))
    }
}

/// A topic in a window.
fn state(window: &Window, topic: TopicId) -> Option<&TopicState> {
    let states = &window.graph.topics;
    let place = states.binary_search_by_key(&topic, |s| s.id).ok()?;
    states.get(place)
}

/// Messages of a topic in a window.
pub(crate) fn count(window: &Window, topic: TopicId) -> u64 {
    state(window, topic).map_or(0, |s| s.count)
}

/// The edges of a topic that were seen.
fn edges(edges: &[Edge], topic: TopicId) -> impl Iterator<Item = (u32, &Edge)> {
    let own = (0..).zip(edges);
    own.filter(move |(_, edge)| edge.topic == topic && is_seen(edge.evidence))
}

/// Keeps the best degree of each element.
fn raise(best: &mut [Degree], seen: impl Iterator<Item = (u32, Degree)>) {
    for (id, degree) in seen {
        if let Some(own) = best.get_mut(id as usize) {
            *own = degree.min(*own);
        }
    }
}

/// Seconds in nanoseconds, held within an `i64`.
fn nanos(seconds: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "casts saturate")]
    let nanos = libm::round(seconds * 1e9) as i64;
    nanos
}
