//! The facts of a mission by name: its nodes and topics, their times and rates, whether they are observable, and causes in
//! the event log.

use std::collections::{BTreeMap, BTreeSet};

use super::finding::Cause;
use super::values::Pattern;
use crate::base::cast;
use crate::base::name::is_quiet;
use crate::base::notice::NoticeKind;
use crate::base::rhythm::{CLOSING_NS, DISCOVERY_NS};
use crate::base::time::{Span, Stamp};
use crate::base::words;
use crate::evidence::{Confidence, Evidence};
use crate::graph::history::{Bound, Sending};
use crate::graph::{ById, Edge, Element, NodeId, PerElement, Row, State, TopicId, Wiring};
use crate::mission::event_log::{Event, Kind};
use crate::mission::rates::Rates;
use crate::mission::{Mission, Window};

/// A mission with precomputed facts.
pub(crate) struct Facts<'a> {
    pub(crate) mission: &'a Mission,
    /// The strongest confidence to which each element is known.
    confidences: PerElement<Confidence>,
    /// The number of messages of each topic.
    pub(crate) messages: ById<TopicId, u64>,
    /// Whether a tool rewrote the bag, so that merged publishers cannot be distinguished.
    pub(crate) is_rewritten: bool,
    /// Present nodes by role.
    roles: BTreeMap<&'a str, Vec<NodeId>>,
    /// The role of each of them.
    names: BTreeMap<&'a str, &'a str>,
    wiring: Wiring,
    rates: Rates<'a>,
    /// The events of each node, but not those of its edges.
    events: ById<NodeId, Vec<&'a Event>>,
    /// Whether the bag lists all subscribers.
    lists_all: bool,
}

/// A role of a mission and its nodes.
#[derive(Clone, Copy)]
pub(crate) struct Role<'a> {
    pub(crate) facts: &'a Facts<'a>,
    pub(crate) name: &'a str,
    pub(crate) nodes: &'a [NodeId],
}

/// A publisher or subscriber of a topic; one known only from code and launch files is declared.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peer {
    pub(crate) node: NodeId,
    pub(crate) edge: Element,
    pub(crate) confidence: Confidence,
    pub(crate) evidence: Evidence,
}

impl Peer {
    /// Whether it is measured or stated, not only inferred.
    pub(crate) fn is_sure(&self) -> bool {
        self.confidence <= Confidence::Stated
    }
}

/// A topic of one of several missions.
#[derive(Clone, Copy)]
pub(crate) struct TopicIn<'a> {
    pub(crate) facts: &'a Facts<'a>,
    pub(crate) id: TopicId,
}

impl<'a> TopicIn<'a> {
    pub(crate) fn name(&self) -> &'a str {
        self.facts.topic(self.id)
    }

    /// Whether its last message is longer before the mission's end than these nanoseconds.
    pub(crate) fn ends(&self, closing: i64) -> bool {
        let received = self.facts.received(self.id);
        received.is_some_and(|own| self.facts.mission.span.end.since(own.end) > closing)
    }

    pub(crate) fn types(&self) -> BTreeSet<String> {
        let own = &self.facts.mission.elements.topics[self.id];
        own.types.iter().map(|t| (**t).to_owned()).collect()
    }

    /// The nodes that publish it; `None` unless all of them are known.
    pub(crate) fn by(&self) -> Option<BTreeSet<String>> {
        let is_listed = self.facts.lists_publishers(self.id);
        is_listed.then(|| self.publishers())
    }

    /// The nodes that publish it, if measured or stated.
    pub(crate) fn publishers(&self) -> BTreeSet<String> {
        self.facts.sure_roles(&self.facts.publishers(self.id))
    }

    /// The nodes that subscribe to it, if measured or stated.
    pub(crate) fn to(&self) -> BTreeSet<String> {
        self.facts.sure_roles(&self.facts.subscribers(self.id))
    }

    /// Its rates in the whole mission.
    pub(crate) fn rates(&self, may_end: bool) -> Vec<Rate> {
        self.facts.rates(self.id, may_end, self.facts.mission.span)
    }
}

/// Kinds of evidence for what should have run, not for what did. The user's topology file states what did.
const DECLARING: [&str; 2] = ["source", "launch"];
/// Kinds of evidence that name every ROS 1 node with recorded messages.
const NAMING: [&str; 5] = [
    "connection",
    "statistics",
    "rosgraph",
    "discovery",
    "topology",
];
/// Evidence that names every ROS 2 node started during the recording: it declares parameters then.
const STARTING: [&str; 1] = ["parameter_events"];
/// Evidence that lists all subscribers of a topic.
const LISTING: [&str; 4] = ["rosgraph", "discovery", "statistics", "topic_statistics"];

/// The events that take messages away.
pub(crate) const ENDS: &[Kind] = &[Kind::Stopped, Kind::Restarted, Kind::Silent];

/// Whether an element was observed, not only declared.
fn is_seen(evidence: Evidence) -> bool {
    !evidence.is_guess() && evidence.words().any(|word| !DECLARING.contains(&word))
}

fn has(evidence: Evidence, words: &[&str]) -> bool {
    words.iter().any(|word| evidence.has(word))
}

/// The rate of a topic in a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rate {
    /// The window's index.
    pub(crate) window: usize,
    /// The part of it that counts.
    pub(crate) span: Span,
    pub(crate) count: u64,
    /// The median time between its messages in seconds.
    pub(crate) median_s: Option<f64>,
}

impl Rate {
    pub(crate) fn seconds(&self) -> f64 {
        self.span.nanos().max(1) as f64 / 1e9
    }

    /// Messages per second.
    pub(crate) fn hz(&self) -> f64 {
        self.count as f64 / self.seconds()
    }

    /// Messages per second with one more message, which may have just missed this window.
    pub(crate) fn at_most(&self) -> f64 {
        (self.count + 1) as f64 / self.seconds()
    }

    /// Messages per second with one message less.
    pub(crate) fn at_least(&self) -> f64 {
        self.count.saturating_sub(1) as f64 / self.seconds()
    }

    /// The number of messages in all of these.
    pub(crate) fn count(rates: &[Self]) -> u64 {
        rates.iter().map(|rate| rate.count).sum()
    }

    /// Messages per second in all of these.
    pub(crate) fn mean_hz(rates: &[Self]) -> f64 {
        let nanos: i64 = rates.iter().map(|rate| rate.span.nanos()).sum();
        Self::count(rates) as f64 / (nanos.max(1) as f64 / 1e9)
    }

    /// Whether messages are evenly spaced, judged by the median interval in each of these windows.
    pub(crate) fn are_even(rates: &[Self]) -> bool {
        let share = |rate: &Self| Some(rate.median_s? * rate.hz());
        let mut shares = rates.iter().filter_map(share).peekable();
        shares.peek().is_some() && shares.all(|share| (0.8..=1.25).contains(&share))
    }
}

impl<'a> Facts<'a> {
    /// The facts of a mission.
    pub(crate) fn new(mission: &'a Mission) -> Self {
        let elements = &mission.elements;
        let confidences = mission.graphs.confidences(elements);
        let is_there = |id| confidences.of(Element::Node(id)) < Some(&Confidence::Declared);
        let count = |id| messages(mission, Element::Topic(id));
        let mut roles: BTreeMap<&str, Vec<NodeId>> = BTreeMap::new();
        let mut names = BTreeMap::new();
        let mut notices = mission.notices.iter();
        let is_rewritten = notices.any(|notice| notice.kind == NoticeKind::Rewritten);
        for (id, node) in elements.nodes.with_ids() {
            // Elements in no window are outside the part that is checked.
            if is_there(id) && is_seen(node.seen.evidence) {
                roles.entry(&node.role).or_default().push(id);
                names.insert(node.name.as_str(), &*node.role);
            }
        }
        let mut events: ById<NodeId, Vec<&Event>> = ById::like(&elements.nodes, Vec::new());
        for event in &mission.log.events {
            if let Element::Node(id) = event.what {
                events[id].push(event);
            }
        }
        let lists =
            |edge: &Edge| has(edge.seen.evidence, &LISTING) && !elements.nodes[edge.node].is_tool();
        Self {
            events,
            lists_all: elements.subscribes.iter().any(lists),
            mission,
            confidences,
            messages: elements.topics.ids().map(count).collect(),
            is_rewritten,
            roles,
            names,
            wiring: elements.wiring(|_, _| true),
            rates: Rates::new(mission),
        }
    }

    /// The present roles.
    pub(crate) fn roles(&self) -> impl Iterator<Item = Role<'_>> {
        self.roles.iter().map(|own| self.role_of(own))
    }

    fn role_of<'s>(&'s self, (name, nodes): (&&'s str, &'s Vec<NodeId>)) -> Role<'s> {
        let facts = self;
        Role { facts, name, nodes }
    }

    /// The roles that a pattern matches; a node name matches its role too.
    pub(crate) fn nodes(&self, pattern: &Pattern) -> Vec<Role<'_>> {
        let name = pattern.as_str();
        if pattern.is_name() {
            let own = self.names.get(name).copied();
            let roles: BTreeSet<&str> = own.into_iter().chain([name]).collect();
            let found = roles.into_iter();
            let found = found.filter_map(|role| self.roles.get_key_value(role));
            return found.map(|own| self.role_of(own)).collect();
        }
        let fits = |role: &Role<'_>| {
            pattern.matches(role.name)
                || role.nodes.iter().any(|id| pattern.matches(self.node(*id)))
        };
        self.roles().filter(fits).collect()
    }

    /// Whether a pattern matches a node.
    pub(crate) fn fits(&self, pattern: &Pattern, node: NodeId) -> bool {
        pattern.matches(self.node(node)) || pattern.matches(self.role(node))
    }

    /// The present topics that a pattern matches.
    pub(crate) fn topics(&self, pattern: &Pattern) -> Vec<TopicId> {
        if pattern.is_name() {
            let own = self.mission.elements.topic(pattern.as_str());
            return own.into_iter().filter(|id| self.is_there(*id)).collect();
        }
        let fits = |id: &TopicId| pattern.matches(self.topic(*id)) && self.is_there(*id);
        self.mission.elements.topics.ids().filter(fits).collect()
    }

    /// Whether a topic was observed, not only declared: with messages, an observed publisher, or no observed
    /// subscriber.
    pub(crate) fn is_there(&self, topic: TopicId) -> bool {
        let any = |peers: &[Peer]| peers.iter().any(|peer| is_seen(peer.evidence));
        is_seen(self.mission.elements.topics[topic].seen.evidence)
            && (self.messages[topic] > 0
                || any(&self.publishers(topic))
                || !any(&self.subscribers(topic)))
    }

    pub(crate) fn node(&self, id: NodeId) -> &'a str {
        self.mission.elements.nodes[id].name.as_str()
    }

    pub(crate) fn role(&self, id: NodeId) -> &'a str {
        &self.mission.elements.nodes[id].role
    }

    pub(crate) fn topic(&self, id: TopicId) -> &'a str {
        self.mission.elements.topics[id].name.as_str()
    }

    /// Whether a role is housekeeping or the recorder's.
    pub(crate) fn is_tool(&self, nodes: &[NodeId]) -> bool {
        let own = &self.mission.elements.nodes;
        nodes.iter().any(|id| own[*id].is_tool())
    }

    /// Whether a topic is housekeeping.
    pub(crate) fn is_housekeeping(&self, topic: TopicId) -> bool {
        is_quiet(self.topic(topic))
    }

    fn confidence(&self, what: Element) -> Confidence {
        let known = self.confidences.of(what).copied();
        known.unwrap_or(Confidence::Declared)
    }

    /// Whether a role is measured or stated, not only inferred.
    pub(crate) fn is_sure(&self, nodes: &[NodeId]) -> bool {
        let sure = |id: &NodeId| self.confidence(Element::Node(*id)) <= Confidence::Stated;
        nodes.iter().any(sure)
    }

    /// The measured or stated roles, without tools.
    pub(crate) fn robot_roles(&self) -> impl Iterator<Item = Role<'_>> {
        let sure = |role: &Role<'_>| self.is_sure(role.nodes) && !self.is_tool(role.nodes);
        self.roles().filter(sure)
    }

    /// The topics with messages, without housekeeping.
    pub(crate) fn robot_topics(&self) -> impl Iterator<Item = TopicIn<'_>> {
        let all = self.topics(&Pattern::new("**")).into_iter();
        let own = all.filter(|id| !self.is_housekeeping(*id) && self.messages[*id] > 0);
        own.map(|id| TopicIn { facts: self, id })
    }

    /// The publishers of a topic, except unnamed nodes.
    pub(crate) fn publishers(&self, topic: TopicId) -> Vec<Peer> {
        let edge = |node| self.mission.elements.published((node, topic));
        self.peers(&self.wiring.publishers[topic], edge)
    }

    /// The subscribers of a topic, except unnamed nodes.
    pub(crate) fn subscribers(&self, topic: TopicId) -> Vec<Peer> {
        let edge = |node| self.mission.elements.subscribed((node, topic));
        self.peers(&self.wiring.subscribers[topic], edge)
    }

    /// The ends of edges at these nodes.
    fn peers(&self, nodes: &[NodeId], edge: impl Fn(NodeId) -> Option<Element>) -> Vec<Peer> {
        let peer = |node: &NodeId| {
            let edge = edge(*node)?;
            let evidence = self.mission.elements.evidence(edge);
            (!evidence.is_guess()).then(|| Peer {
                node: *node,
                edge,
                confidence: self.confidence(edge),
                evidence,
            })
        };
        nodes.iter().filter_map(peer).collect()
    }

    /// The roles of these, without tools and without what is only inferred.
    pub(crate) fn sure_roles(&self, peers: &[Peer]) -> BTreeSet<String> {
        let sure = peers.iter();
        let sure = sure.filter(|peer| peer.is_sure() && !self.is_tool(&[peer.node]));
        sure.map(|peer| self.role(peer.node).to_owned()).collect()
    }

    /// Whether the bag names nodes reliably, so that an unnamed one is absent; `lost` expected nodes are
    /// unnamed. Rewritten bags do not: publishers are merged, or only a log remains, to which most nodes
    /// never write. ROS 2 bags name nodes that start during the recording: if more are missing than named,
    /// they ran before the recorder.
    pub(crate) fn names_nodes(&self, lost: usize) -> bool {
        let named: Vec<Role<'_>> = self.robot_roles().collect();
        let any = |words: &[&str]| {
            let has_any = |id: &NodeId| has(self.mission.elements.nodes[*id].seen.evidence, words);
            named.iter().any(|role| role.nodes.iter().any(has_any))
        };
        !self.is_rewritten && (any(&NAMING) || any(&STARTING) && lost < named.len())
    }

    /// Whether ROS 1 nodes were recorded, judging by their logs.
    pub(crate) fn is_ros1(&self) -> bool {
        let mut types = self.mission.elements.topics.iter().flat_map(|t| &t.types);
        types.any(|word| &**word == "rosgraph_msgs/Log")
    }

    /// Whether the bag names all publishers of a topic.
    pub(crate) fn lists_publishers(&self, topic: TopicId) -> bool {
        let unknown = self.mission.elements.topics[topic].unknown_publishers;
        let is_known = self.publishers(topic).iter().any(Peer::is_sure);
        !self.is_rewritten && unknown.unwrap_or(0) == 0 && is_known
    }

    /// Whether the bag lists all subscribers, in general or for these nodes, so that an unlisted node is not a
    /// subscriber.
    pub(crate) fn lists_subscribers(&self, nodes: &[NodeId]) -> bool {
        let elements = &self.mission.elements;
        let is_linked = |id: NodeId| {
            let topics = self.wiring.subscribed[id].iter();
            let mut edges = topics.filter_map(|topic| elements.subscription(*topic, id));
            edges.any(|edge| has(elements.subscribes[edge].seen.evidence, &["links"]))
        };
        self.lists_all || nodes.iter().any(|id| is_linked(*id))
    }

    /// The times in which any of these nodes is present; sorted, without overlaps.
    pub(crate) fn lives(&self, nodes: &[NodeId]) -> Vec<Span> {
        let mut all: Vec<Span> = Vec::new();
        for id in nodes {
            let runs = &self.mission.elements.seen(Element::Node(*id)).lives;
            if runs.is_empty() {
                // A mission without finer times.
                let rows = self.mission.graphs.rows(Element::Node(*id));
                let windows = rows.filter_map(|(at, _)| self.mission.windows.get(at));
                all.extend(windows.map(|window| window.span));
            } else {
                all.extend(runs);
            }
        }
        Span::joined(all, 0)
    }

    /// The time in which a node published a topic, if known, and the number of its messages.
    pub(crate) fn sent(&self, node: NodeId, edge: Element) -> Option<(Span, u64)> {
        let runs = match &self.mission.elements.seen(edge).lives[..] {
            [] => self.lives(&[node]),
            runs => runs.to_vec(),
        };
        let span = Span::new(runs.first()?.start, runs.last()?.end);
        Some((span, messages(self.mission, edge)))
    }

    /// Entries of the event log about any of these nodes, but not about their edges.
    pub(crate) fn events(&self, nodes: &[NodeId], kind: Kind) -> Vec<&'a Event> {
        let all = nodes.iter().flat_map(|id| &self.events[*id]).copied();
        let mut own: Vec<&Event> = all.filter(|e| e.kind == kind).collect();
        own.sort_by_key(|e| e.time);
        own
    }

    /// The last known lifecycle state of a role.
    pub(crate) fn lifecycle(&self, nodes: &[NodeId]) -> Option<&'a str> {
        let graphs = &self.mission.graphs;
        let last = |node: &NodeId| {
            let rows = graphs.rows(Element::Node(*node));
            let named = rows.filter_map(|(at, row)| Some((at, *node, &**graphs.lifecycle(&row)?)));
            named.last()
        };
        let last = nodes.iter().filter_map(last).max();
        last.map(|(.., state)| state)
    }

    /// Whether a topic is latched; `None` if unknown.
    pub(crate) fn is_latched(&self, topic: TopicId) -> Option<bool> {
        let own = &self.mission.elements.topics[topic];
        let states = self.mission.graphs.rows(Element::Topic(topic));
        let states: BTreeSet<State> = states.map(|(_, row)| row.state).collect();
        match &own.qos {
            _ if states.contains(&State::Latched) => Some(true),
            Some(qos) => Some(qos.contains("transient_local")),
            // Without a message in the checked time it is unknown.
            None if states.contains(&State::Silent) && self.messages[topic] > 0 => Some(false),
            None => None,
        }
    }

    /// The best estimate of the time at which a role first appeared, with its bounds.
    pub(crate) fn began(&self, nodes: &[NodeId]) -> Option<Bound> {
        let first = self.lives(nodes).first()?.start;
        let started = self.events(nodes, Kind::Started);
        let event = started.into_iter().find(|e| e.time >= first);
        let is_first = |e: &&Event| e.time.since(first) < 1_000_000_000;
        Some(match event.filter(is_first) {
            Some(event) => Bound::new(event.time, event.earliest, event.latest),
            None => Bound::new(first, Stamp::MIN, first),
        })
    }

    /// The time at which a role was last present, with its bounds, if more than `closing` before the mission's end.
    pub(crate) fn ended(&self, nodes: &[NodeId], closing: i64) -> Option<Bound> {
        let time = self.lives(nodes).last()?.end;
        if self.mission.span.end.since(time) <= closing {
            return None;
        }
        let stopped = self.events(nodes, Kind::Stopped);
        let bounds = stopped.last().map(|e| (e.earliest, e.latest));
        let (earliest, latest) = bounds.unwrap_or((time, time));
        Some(Bound::new(time, earliest, latest))
    }

    /// Whether a role is only known from its log: nothing else of it was recorded, and no evidence lists all nodes.
    pub(crate) fn is_logged_only(&self, nodes: &[NodeId]) -> bool {
        let elements = &self.mission.elements;
        let is_listed = |id: &NodeId| {
            let evidence = elements.nodes[*id].seen.evidence;
            has(evidence, &LISTING) || has(evidence, &STARTING) || !has(evidence, &["rosout"])
        };
        !self.is_sender(nodes) && !nodes.iter().any(is_listed)
    }

    /// Whether any of these nodes sent a message on a topic other than housekeeping.
    pub(crate) fn is_sender(&self, nodes: &[NodeId]) -> bool {
        let sends = |node: NodeId, topic: TopicId| {
            let edge = self.mission.elements.publication(node, topic);
            let many = edge.map_or(0, |edge| messages(self.mission, Element::Publish(edge)));
            many > 0 && !self.is_housekeeping(topic)
        };
        let topics = |node| self.wiring.published[node].iter();
        let sends = |node: &NodeId| topics(*node).any(|topic| sends(*node, *topic));
        nodes.iter().any(sends)
    }

    /// The first and the last message of a topic, the latter 1 ns before the end; `None` if it has none.
    pub(crate) fn received(&self, topic: TopicId) -> Option<Span> {
        let (first, last) = Sending::bounds(self.mission.sending.of_topic(topic).iter())?;
        Some(Span::new(first, last.plus(1)))
    }

    /// The windows that contain a topic, each with its row of the graph.
    pub(crate) fn rows(&self, topic: TopicId) -> impl Iterator<Item = (&'a Window, Row)> + use<'a> {
        let windows = &self.mission.windows;
        let rows = self.mission.graphs.rows(Element::Topic(topic));
        rows.filter_map(|(at, row)| Some((windows.get(at)?, row)))
    }

    /// The rates by which a topic is checked: of every window, and of the last if it is longer than half of one or has
    /// enough expected messages of one sender, from its first message to the mission's end, or to its last if it `may_end`.
    pub(crate) fn rates(&self, topic: TopicId, may_end: bool, during: Span) -> Vec<Rate> {
        let Some(received) = self.received(topic) else {
            return Vec::new();
        };
        let mut rows = self.rows(topic).peekable();
        // Several senders end one after the other when the robot shuts down.
        let ends_in_turn = self.mission.sending.of_topic(topic).len() > 1;
        let (mut all, mut first) = (Vec::new(), None);
        for window in &self.mission.windows {
            let row = rows.next_if(|(own, _)| own.index == window.index);
            let row = row.as_ref().map(|(_, row)| row);
            let inside = during.start <= window.span.start && window.span.end <= during.end;
            // A window cut by the mission's end has a rate if it is long enough, or the topic was even until then.
            let is_short = window.span.nanos() < self.mission.period.nanos() / 2;
            let is_cut = window.partial && is_short;
            if is_cut && (ends_in_turn || !is_enough(&all, window.span)) || !inside {
                continue;
            }
            let rate = |span| Rate {
                window: window.index,
                span,
                count: row.and_then(|row| row.count).unwrap_or(0),
                median_s: row.and_then(|row| row.median.value()),
            };
            if let Some(span) = self.counted(window.span, received, may_end) {
                all.push(rate(span));
            } else if first.is_none() && received.end >= window.span.end {
                first = begun(window.span, received.start).map(rate);
            }
        }
        // A topic that exists for little more than a window rarely fills one, so a part is used.
        all.extend(first.filter(|_| all.is_empty()));
        all
    }

    /// The rate of a topic from its first to its last message, as one that covers all of it; `None` with fewer than
    /// two.
    pub(crate) fn mean(&self, topic: TopicId) -> Option<Rate> {
        let received = self.received(topic)?;
        let count = self.messages[topic].checked_sub(1)?;
        (count > 0).then_some(Rate {
            window: 0,
            span: received,
            count,
            median_s: None,
        })
    }

    /// The rate of a topic while it is sent, without its pauses.
    pub(crate) fn while_sending(&self, topic: TopicId) -> Option<f64> {
        self.rates.while_sending(&self.rates.of_topic(topic))
    }

    /// The time of the last message of these nodes that is not housekeeping.
    pub(crate) fn last_sent(&self, nodes: &[NodeId]) -> Option<Stamp> {
        let sending = &self.mission.sending;
        let senders = nodes.iter().flat_map(|id| {
            let topics = self.wiring.published[*id].iter();
            let topics = topics.filter(|topic| !self.is_housekeeping(**topic));
            topics.filter_map(|topic| sending.of_edge(*id, *topic))
        });
        Some(Sending::bounds(senders)?.1)
    }

    /// The part of a window in which a topic with messages in `received` counts; `None` if it is too short.
    fn counted(&self, window: Span, received: Span, may_end: bool) -> Option<Span> {
        let whole = self.mission.span;
        let mut span = window;
        if received.start > span.start {
            // A topic that exists when the recorder starts is received a moment later; others have a partial window.
            let found =
                span.start == whole.start && received.start.since(whole.start) <= DISCOVERY_NS;
            span.start = found.then_some(received.start)?;
        }
        if received.end < span.end {
            let is_over = whole.end.since(received.end) <= CLOSING_NS;
            match (is_over, may_end) {
                (true, _) => span.end = received.end,
                (false, true) => return None,
                (false, false) => {}
            }
        }
        (span.nanos() >= window.nanos() / 2).then_some(span)
    }

    /// The longest silences of a topic inside `during`: those of the whole mission, to the nanosecond if message times
    /// are known; the longest of each window; and, unless it `may_end`, from its last message to the mission's end.
    pub(crate) fn silences(&self, topic: TopicId, may_end: bool, during: Span) -> Vec<TopicGap> {
        let mut all = Vec::new();
        for (window, row) in self.rows(topic) {
            let inside = during.start <= window.span.start && window.span.end <= during.end;
            if let (true, Some(gap)) = (inside, row.gap.value()) {
                all.push(TopicGap {
                    span: window.span,
                    nanos: cast::to_i64(libm::round(gap * 1e9)),
                });
            }
        }
        // Known if single messages are.
        let pauses = self.mission.sending.pauses.of(topic).iter();
        all.extend(pauses.filter_map(|gap| clipped(*gap, during)));
        let whole = self.mission.span;
        if let (Some(received), false) = (self.received(topic), may_end) {
            let span = Span::new(received.end.plus(-1), whole.end);
            // An end at the robot's shutdown is not a silence.
            if span.nanos() > CLOSING_NS {
                all.extend(clipped(span, during));
            }
        }
        all
    }

    /// The longest silence of a topic between its first and its last message, in nanoseconds; at least a window's length
    /// if single messages are unknown.
    pub(crate) fn longest_silence(&self, topic: TopicId) -> i64 {
        let is_exact = self.mission.sending.knows_messages();
        let least = (!is_exact).then(|| self.mission.period.nanos());
        self.longest_of(topic, true).max(least).unwrap_or(0)
    }

    /// The longest of the topic's silences in the mission, in nanoseconds.
    pub(crate) fn longest_of(&self, topic: TopicId, may_end: bool) -> Option<i64> {
        let silences = self.silences(topic, may_end, self.mission.span);
        silences.iter().map(|silence| silence.nanos).max()
    }

    /// The cause in the event log for the change of a topic around a time: an event of one of these `kinds` of its publishers,
    /// or of the nodes that feed them.
    pub(crate) fn cause_for_topic(
        &self,
        topic: TopicId,
        kinds: &[Kind],
        around: Span,
    ) -> Option<Cause> {
        let direct: BTreeSet<NodeId> = self.publishers(topic).iter().map(|p| p.node).collect();
        let fed = direct.iter();
        let fed = fed.flat_map(|node| &self.wiring.subscribed[*node]);
        let fed: BTreeSet<&TopicId> = fed.filter(|id| **id != topic).collect();
        let feeders = fed.iter().flat_map(|topic| self.publishers(**topic));
        let feeders: BTreeSet<NodeId> = feeders.map(|peer| peer.node).collect();
        let feeders = &feeders - &direct;
        self.cause(&direct, kinds, around)
            .or_else(|| self.cause(&feeders, kinds, around))
    }

    /// The first event of these `kinds` of one of these nodes in a time range.
    pub(crate) fn cause(
        &self,
        nodes: &BTreeSet<NodeId>,
        kinds: &[Kind],
        around: Span,
    ) -> Option<Cause> {
        let events = self.mission.log.inside(around).map(|(_, event)| event);
        let mut events = events.filter(|e| kinds.contains(&e.kind));
        let event = events.find(|e| matches!(e.what, Element::Node(id) if nodes.contains(&id)))?;
        let role = self.role(self.mission.elements.ends(event.what).0?);
        let (word, clock) = (event.kind.word(), self.clock(event.time));
        Some(Cause {
            time: Some(event.time),
            text: format!("{role} {word} at {clock}"),
        })
    }

    /// A point in time of the mission as text for people.
    pub(crate) fn clock(&self, at: Stamp) -> String {
        words::offset_seconds(self.mission.offset(at))
    }

    /// A time range of the mission as text for people.
    pub(crate) fn stretch(&self, span: Span) -> String {
        format!("{}–{}", self.clock(span.start), self.clock(span.end))
    }
}

/// The number of messages of an element.
fn messages(mission: &Mission, what: Element) -> u64 {
    let rows = mission.graphs.rows(what);
    rows.filter_map(|(_, row)| row.count).sum()
}

/// The fewest expected messages of an even topic by which a window cut by the mission's end is checked: one more or
/// less is a twentieth.
const ENOUGH: f64 = 20.0;

/// Whether a topic with these rates before was even, and enough of its messages are expected in this time.
fn is_enough(before: &[Rate], span: Span) -> bool {
    let expected = |last: &Rate| last.hz() * span.nanos() as f64 / 1e9;
    before.last().is_some_and(|last| expected(last) >= ENOUGH) && Rate::are_even(before)
}

/// The part of a window from a topic's first message on; `None` if that is less than half of it.
fn begun(window: Span, first: Stamp) -> Option<Span> {
    let span = Span::new(first.max(window.start), window.end);
    (span.nanos() >= window.nanos() / 2).then_some(span)
}

/// A time without messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TopicGap {
    /// The time of the silence, or the window that it is in.
    pub(crate) span: Span,
    /// Its length in nanoseconds.
    pub(crate) nanos: i64,
}

/// The part of a silence within a time range.
fn clipped(gap: Span, during: Span) -> Option<TopicGap> {
    let span = Span::new(gap.start.max(during.start), gap.end.min(during.end));
    let nanos = span.end.since(span.start);
    (nanos > 0).then_some(TopicGap { span, nanos })
}
