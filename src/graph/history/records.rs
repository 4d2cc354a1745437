//! The elements of the mission with everything that does not depend on windows: their lifetimes, publishing
//! and silences.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::base::error::Result;
use crate::base::ids::{Few, grouped};
use crate::base::name::role;
use crate::base::time::{Span, Stamp};
use crate::evidence::collector::{Recorded, spool_error};
use crate::evidence::conclude::Findings;
use crate::evidence::inference::{ElementKey, IncidentKind};
use crate::evidence::observation::Name;
use crate::evidence::{Confidence, Evidence};
use crate::graph::history::lifetimes::{Lifetime, Liveness, LivenessOf, compute_lifetimes};
use crate::graph::history::liveness::{collect, fall_silent};
use crate::graph::history::pauses::pauses;
use crate::graph::history::restarts::restarts;
use crate::graph::history::senders::{Sender as TopicSender, Traffic, doubled};
use crate::graph::history::simulation::{Simulation, simulation};
use crate::graph::history::{
    Bound, Life, Sender, Sending, Silence, Stretch, Transition, all_silent,
};
use crate::graph::{
    ById, Edge, Element, Elements, Existence, Node, NodeId, PerElement, State, Topic, TopicId,
};

/// The history of a mission: its elements with their lifetimes, and the messages of all senders, in
/// continuous time.
#[derive(Default)]
pub(crate) struct History {
    /// All nodes, topics and edges of the mission.
    pub(crate) elements: Elements,
    /// The record of each of them.
    pub(crate) records: PerElement<Record>,
    /// The messages of every sender.
    pub(crate) sending: Sending,
    /// The times at which nothing was recorded or the simulation stood still, sorted.
    pub(crate) pauses: Vec<Span>,
    /// The changes of simulated time.
    pub(crate) simulation: Simulation,
    /// The nodes that several recordings show at the same time.
    pub(crate) doubled: Vec<NodeId>,
    /// Transitions of lifecycle states, sorted by time.
    pub(crate) transitions: Vec<Transition>,
    /// Statements about elements other than that they exist, by element.
    pub(crate) incidents: Vec<Incident>,
    pub(crate) node_ids: ById<Name, Option<NodeId>>,
    pub(crate) topic_ids: ById<Name, Option<TopicId>>,
    /// The indices of each topic's streams.
    pub(crate) streams: ById<Name, Vec<usize>>,
}

/// A statement about an element other than that it exists.
#[derive(Debug)]
pub(crate) struct Incident {
    pub(crate) what: Element,
    pub(crate) kind: IncidentKind,
    pub(crate) time: Stamp,
    pub(crate) until: Option<Stamp>,
    pub(crate) evidence: Evidence,
}

/// The record of one element over the mission.
pub(crate) struct Record {
    /// The strongest confidence of evidence for it.
    pub(crate) confidence: Confidence,
    /// Its lifetimes, in order, without overlaps.
    pub(crate) lives: Vec<Life>,
    /// The state that it always has while it exists: declared or latched.
    fixed: Option<State>,
    /// Whether it is silent without a message in the window.
    needs_messages: bool,
    /// The times at which it was silent although it existed; `None` for a silence to the end.
    pub(crate) silences: Vec<Silence>,
}

impl Record {
    fn new(liveness: &Liveness, mission: (Stamp, Stamp), silences: Vec<Silence>) -> Self {
        let is_latched = liveness.is_latched().then_some(State::Latched);
        Self {
            confidence: liveness.confidence,
            lives: known(liveness, mission),
            fixed: (liveness.is_declared().then_some(State::Declared)).or(is_latched),
            needs_messages: !liveness.has_senders(),
            silences,
        }
    }

    /// The record of an element of which nothing but its lifetimes is known.
    pub(super) fn of_lives(confidence: Confidence, lives: Vec<Life>) -> Self {
        Self {
            confidence,
            lives,
            fixed: None,
            needs_messages: false,
            silences: Vec::new(),
        }
    }

    /// The intervals in which it exists, half-open.
    pub(crate) fn spans(&self) -> impl Iterator<Item = Span> + '_ {
        self.lives.iter().map(|life| life.span)
    }

    /// The state in a window in which it exists, with or without messages of its own.
    pub(crate) fn state(&self, window: Span, has_messages: bool) -> State {
        let covers =
            |(from, to): &Silence| *from < window.start && to.is_none_or(|to| window.end <= to);
        match self.fixed {
            Some(state) => state,
            None if has_messages => State::Active,
            None if self.needs_messages || self.silences.iter().any(covers) => State::Silent,
            None => State::Active,
        }
    }

    /// Whether it is known from a header or a file only.
    pub(crate) fn is_declared(&self) -> bool {
        self.fixed == Some(State::Declared)
    }
}

/// Makes the history from everything recorded and concluded, and from the messages of all senders
/// (`traffic`).
///
/// # Errors
/// If the temporary file of times cannot be read.
pub(crate) fn made(
    recorded: &Recorded,
    findings: &mut Findings,
    traffic: &Traffic,
) -> Result<History> {
    let doubled = doubled(recorded, &findings.streams);
    let restarts = restarts(recorded, findings, traffic, &doubled).map_err(spool_error)?;
    let simulation = simulation(recorded, traffic).map_err(spool_error)?;
    let pauses = pauses(recorded, traffic, &restarts, &findings.streams);
    let mut pauses = pauses.map_err(spool_error)?;
    pauses.retain(|pause| simulation.pauses().all(|own| own.shared(*pause) <= 0));
    pauses.extend(simulation.pauses());
    pauses.sort_unstable_by_key(|pause| pause.start);
    let all = collect(recorded, findings, traffic, (&restarts, &pauses));
    let (mut liveness_of, likes) = all.map_err(spool_error)?;
    fall_silent(&mut liveness_of, traffic, findings, &pauses);
    compute_lifetimes(&mut liveness_of, &likes, &restarts, findings.mission);
    let history = assembled(liveness_of, traffic, findings, (pauses, doubled));
    Ok(History {
        simulation,
        ..history
    })
}

/// Lists every element. `liveness_of` is sorted by the elements' names.
fn assembled(
    liveness_of: LivenessOf,
    traffic: &Traffic,
    findings: &Findings,
    (pauses, doubled): (Vec<Span>, BTreeSet<Name>),
) -> History {
    let streams = traffic.iter().map(|of| match of {
        Some(of) => of.streams.clone(),
        None => Vec::new(),
    });
    let mut all = Assembly {
        history: History {
            streams: streams.collect(),
            pauses,
            ..roomy(&liveness_of)
        },
        findings,
        traffic,
        publishers: ById::default(),
        sent: sent(traffic),
    };
    for (what, liveness) in &liveness_of {
        if let (ElementKey::Publish(_, topic), false) = (what, liveness.evidence.is_guess()) {
            *all.publishers.grown(*topic) += 1;
        }
    }
    for (what, liveness) in liveness_of {
        match what {
            ElementKey::Node(node) => all.node(node, &liveness),
            ElementKey::Topic(topic) => all.topic(topic, &liveness),
            ElementKey::Publish(node, topic) => all.publish(node, topic, &liveness),
            ElementKey::Subscribe(topic, node) => all.subscribe(topic, node, &liveness),
        }
    }
    all.senders();
    all.transitions();
    all.incidents();
    let ids = doubled.iter();
    let ids = ids.filter_map(|node| all.history.node_ids.some(*node));
    all.history.doubled = ids.copied().collect();
    all.history
}

/// A history with capacity for exactly these elements, since there may be very many.
fn roomy(liveness_of: &LivenessOf) -> History {
    let mut many = [0; 4];
    for what in liveness_of.keys() {
        many[match what {
            ElementKey::Node(_) => 0,
            ElementKey::Topic(_) => 1,
            ElementKey::Publish(..) => 2,
            ElementKey::Subscribe(..) => 3,
        }] += 1;
    }
    let mut all = History::default();
    let [nodes, topics, publishes, subscribes] = many;
    all.elements.nodes.reserve_exact(nodes);
    all.elements.topics.reserve_exact(topics);
    all.elements.publishes.reserve_exact(publishes);
    all.elements.subscribes.reserve_exact(subscribes);
    all.records.reserve_exact(many);
    all
}

/// The messages that each node sends, without latched ones.
fn sent(traffic: &Traffic) -> Few<Name, Vec<&TopicSender>> {
    let senders = traffic.iter().flatten().flat_map(|of| &of.list);
    let own = senders.filter(|sender| !sender.latched);
    let own = grouped(own.filter_map(|sender| Some((sender.node?, sender))));
    own.into_iter().collect()
}

struct Assembly<'a> {
    history: History,
    findings: &'a Findings,
    traffic: &'a Traffic,
    /// The number of known publishers of each topic.
    publishers: ById<Name, u32>,
    /// The messages that each node sends, without latched ones.
    sent: Few<Name, Vec<&'a TopicSender>>,
}

impl Assembly<'_> {
    /// Adds the messages of every sender.
    fn senders(&mut self) {
        for (topic, of) in self.traffic.somes() {
            let Some(id) = self.history.topic_ids.some(topic) else {
                continue;
            };
            for sender in of.list.iter().filter(|s| !s.stretches.is_empty()) {
                let node = sender.node.and_then(|n| self.history.node_ids.some(n));
                self.history.sending.senders.push(Sender {
                    topic: *id,
                    node: node.copied(),
                    is_latched: sender.latched,
                    stretches: sender.stretches.clone(),
                });
            }
        }
    }

    /// Adds the times at which nodes changed their lifecycle states.
    fn transitions(&mut self) {
        for (node, id) in self.history.node_ids.somes() {
            let states = self.findings.values.transitions(node);
            let states = states.map(|(time, state)| Transition {
                node: *id,
                time: *time,
                state: Arc::clone(state),
            });
            self.history.transitions.extend(states);
        }
        let order = |t: &Transition| (t.time, t.node);
        self.history.transitions.sort_by_key(order);
    }

    /// Adds the statements about existing elements.
    fn incidents(&mut self) {
        let all = &mut self.history;
        for incident in &self.findings.incidents {
            let [node, topic] = incident.what.ends();
            let node = node.and_then(|name| all.node_ids.some(name).copied());
            let topic = topic.and_then(|name| all.topic_ids.some(name).copied());
            let edge = node.zip(topic);
            let what = match &incident.what {
                ElementKey::Node(_) => node.map(Element::Node),
                ElementKey::Topic(_) => topic.map(Element::Topic),
                ElementKey::Publish(..) => edge.and_then(|of| all.elements.published(of)),
                ElementKey::Subscribe(..) => edge.and_then(|of| all.elements.subscribed(of)),
            };
            all.incidents.extend(what.map(|what| Incident {
                what,
                kind: incident.kind.clone(),
                time: incident.time,
                until: incident.until,
                evidence: Evidence::row(incident.source),
            }));
        }
    }

    fn node(&mut self, name: Name, liveness: &Liveness) {
        let silent = self.silences(self.sent.of(name).iter().copied(), &spans(liveness));
        let all = &mut self.history;
        let text = self.findings.text(name);
        let id = all.elements.nodes.push(Node {
            role: role(&text).into(),
            name: text.into(),
            seen: seen(liveness),
        });
        *all.node_ids.grown(name) = Some(id);
        let mut record = Record::new(liveness, self.findings.mission, silent);
        // A node's lifetime depends on more than messages.
        record.needs_messages = false;
        if liveness.speaks && !record.is_declared() {
            record.fixed = None;
        }
        all.records.push(Element::Node(id), record);
    }

    fn topic(&mut self, name: Name, liveness: &Liveness) {
        let traffic = self.traffic.some(name);
        let senders = traffic.iter().flat_map(|of| &of.list);
        let senders = senders.filter(|sender| !sender.latched);
        let silent = self.silences(senders, &spans(liveness));
        let unknown_publishers = self.unknown_publishers(name);
        let streams = traffic.iter().flat_map(|of| &of.streams);
        let values = &self.findings.values;
        let types = streams.map(|s| self.findings.streams[*s].connection.type_name.clone());
        let types = types.chain(values.types(name));
        let types: BTreeSet<Arc<str>> = types.filter(|name| !name.is_empty()).collect();
        let all = &mut self.history;
        let id = all.elements.topics.push(Topic {
            name: self.findings.text(name).into(),
            types: types.into_iter().collect(),
            seen: seen(liveness),
            qos: values.quality(name),
            unknown_publishers,
        });
        *all.topic_ids.grown(name) = Some(id);
        let pauses = traffic.map(|of| of.pauses.clone());
        all.sending.pauses.push(pauses.unwrap_or_default());
        self.keep(Element::Topic(id), liveness, silent);
    }

    /// The number of publishers of a topic that the bag counts beyond the known ones.
    fn unknown_publishers(&self, topic: Name) -> Option<u32> {
        let counted = self.findings.offers.get(topic).filter(|many| **many > 0)?;
        let known = self.publishers.get(topic).unwrap_or(&0);
        Some(counted.saturating_sub(*known))
    }

    fn publish(&mut self, node: Name, topic: Name, liveness: &Liveness) {
        let Some(edge) = self.edge(node, topic, liveness) else {
            return;
        };
        let senders = self.traffic.some(topic).map(|of| &of.list);
        let sender = senders.and_then(|all| all.iter().find(|s| s.node == Some(node)));
        let silent = self.silences(sender.into_iter(), &spans(liveness));
        let id = self.history.elements.publishes.push(edge);
        self.keep(Element::Publish(id), liveness, silent);
    }

    fn subscribe(&mut self, topic: Name, node: Name, liveness: &Liveness) {
        let Some(edge) = self.edge(node, topic, liveness) else {
            return;
        };
        let id = self.history.elements.subscribes.push(edge);
        self.keep(Element::Subscribe(id), liveness, Vec::new());
    }

    /// Adds the record of the newest element of a kind.
    fn keep(&mut self, what: Element, liveness: &Liveness, silent: Vec<Silence>) {
        let record = Record::new(liveness, self.findings.mission, silent);
        self.history.records.push(what, record);
    }

    /// An edge between elements that were added before; `None` if one of them was not.
    fn edge(&self, node: Name, topic: Name, liveness: &Liveness) -> Option<Edge> {
        Some(Edge {
            node: *self.history.node_ids.some(node)?,
            topic: *self.history.topic_ids.some(topic)?,
            seen: seen(liveness),
        })
    }

    /// The times at which some senders are silent, as far as their recordings reach and were not paused.
    fn silences<'s>(
        &self,
        senders: impl Iterator<Item = &'s TopicSender> + Clone,
        lives: &[Span],
    ) -> Vec<Silence> {
        let lives = TopicSender::within(senders.clone(), lives);
        let of: Vec<&[Stretch]> = senders.map(|sender| &sender.stretches[..]).collect();
        all_silent(&of, &lives, &self.history.pauses)
    }
}

/// The intervals in which an element exists, half-open.
fn seen(liveness: &Liveness) -> Existence {
    let (first, last) = liveness.bounds();
    Existence {
        evidence: liveness.evidence,
        first,
        last,
        lives: spans(liveness),
    }
}

fn spans(liveness: &Liveness) -> Vec<Span> {
    let span = |life: &Lifetime| Span::new(life.from, life.to.plus(1));
    liveness.lives.iter().map(span).collect()
}

/// The known lifetimes of an element, inside the mission.
fn known(liveness: &Liveness, mission: (Stamp, Stamp)) -> Vec<Life> {
    let within = |bound: Bound| Bound {
        earliest: bound.earliest.max(mission.0),
        latest: bound.latest.min(mission.1),
        ..bound
    };
    let lives = spans(liveness).into_iter().zip(liveness.lives.iter());
    let life = |(span, life): (Span, &Lifetime)| Life {
        span,
        began: life.began.map(within),
        ended: life.ended.map(within),
    };
    lives.map(life).collect()
}
