//! Small missions for tests, written as text.

use std::collections::BTreeSet;

use crate::base::notice::Notices;
use crate::base::time::{Period, Span, Stamp};
use crate::evidence::Confidence;
use crate::graph::{
    Edge, Element, ElementState, Elements, Existence, Graph, Node, NodeId, State, Topic, TopicId,
};
use crate::mission::event_log::{EventId, Kind};
use crate::mission::{Mission, Window};
use crate::view::Headline;

/// The length of a window.
const LENGTH: i64 = 10_000_000_000;

/// The start of a node.
pub(crate) fn started() -> Headline {
    Headline {
        event: EventId(0),
        kind: Kind::Started,
        what: Element::Node(NodeId(0)),
        time: Stamp(0),
        leaves: false,
    }
}

/// A mission with a window per text. `/a>/t` is a publication and `/b</t` a subscription, `/a` alone a node, `=/t`
/// a topic; `@15` after one of them is its rate (of the topic too, for a publication), `~` makes it silent. Windows last ten seconds.
pub(crate) fn mission(windows: &[&str]) -> Mission {
    let parsed: Vec<Vec<Word>> = windows
        .iter()
        .map(|w| w.split_whitespace().map(Word::new).collect())
        .collect();
    let elements = elements(&parsed);
    let graphs = parsed.iter().zip(0..);
    let graphs = graphs.map(|(words, index)| (span(index), graph(words, &elements)));
    let graphs = graphs.collect();
    let windows = (0..parsed.len()).map(|index| Window {
        index,
        span: span(index),
        partial: false,
        messages: 0,
        changes: Vec::new(),
        events: Vec::new(),
    });
    let windows: Vec<Window> = windows.collect();
    let period = Period::from_nanos(LENGTH).unwrap();
    let mut mission = Mission {
        undrawn: Vec::new(),
        logged: Vec::new(),
        bags: Vec::new(),
        span: Span::new(span(0).start, span(windows.len()).start),
        messages: 0,
        period,
        step: period,
        elements,
        windows,
        graphs,
        log: crate::mission::EventLog::default(),
        sending: crate::graph::history::Sending::default(),
        layout: None,
        notices: Notices::new(),
    };
    mission.find_changes(0.25);
    mission
}

fn span(index: usize) -> Span {
    let start = i64::try_from(index).unwrap() * LENGTH;
    Span::new(Stamp(start), Stamp(start + LENGTH))
}

#[derive(Clone, Copy, PartialEq)]
enum EdgeKind {
    Publish,
    Subscribe,
    Node,
    Topic,
}

struct Word<'a> {
    kind: EdgeKind,
    node: &'a str,
    topic: &'a str,
    hz: Option<f64>,
    state: State,
}

impl<'a> Word<'a> {
    fn new(text: &'a str) -> Self {
        let (text, hz) = text
            .split_once('@')
            .map_or((text, None), |(t, hz)| (t, Some(hz.parse().unwrap())));
        let (text, state) = text
            .strip_suffix('~')
            .map_or((text, State::Active), |t| (t, State::Silent));
        let (kind, node, topic) = match (text.split_once('>'), text.split_once('<')) {
            (Some((node, topic)), _) => (EdgeKind::Publish, node, topic),
            (_, Some((node, topic))) => (EdgeKind::Subscribe, node, topic),
            _ => match text.strip_prefix('=') {
                Some(topic) => (EdgeKind::Topic, "", topic),
                None => (EdgeKind::Node, text, ""),
            },
        };
        Self {
            kind,
            node,
            topic,
            hz,
            state,
        }
    }
}

impl Word<'_> {
    fn is(&self, kind: EdgeKind, node: Option<&str>, topic: Option<&str>) -> bool {
        self.kind == kind && Some(self.node) == node && Some(self.topic) == topic
    }
}

fn elements(windows: &[Vec<Word<'_>>]) -> Elements {
    let words = || windows.iter().flatten();
    let nodes: BTreeSet<&str> = words().map(|w| w.node).filter(|n| !n.is_empty()).collect();
    let topics: BTreeSet<&str> = words().map(|w| w.topic).filter(|t| !t.is_empty()).collect();
    let place = |set: &BTreeSet<&str>, name: &str| {
        u32::try_from(set.iter().position(|n| *n == name).unwrap()).unwrap()
    };
    let edges = |kind: EdgeKind| {
        let of_kind = words().filter(|w| w.kind == kind);
        let mut all: Vec<(u32, u32)> = of_kind
            .map(|w| (place(&nodes, w.node), place(&topics, w.topic)))
            .collect();
        all.sort_unstable_by_key(|(node, topic)| {
            if kind == EdgeKind::Publish {
                (*node, *topic)
            } else {
                (*topic, *node)
            }
        });
        all.dedup();
        all.into_iter()
            .map(|(node, topic)| Edge {
                node: NodeId(node),
                topic: TopicId(topic),
                seen: Existence::default(),
            })
            .collect()
    };
    Elements {
        publishes: edges(EdgeKind::Publish),
        subscribes: edges(EdgeKind::Subscribe),
        nodes: nodes
            .iter()
            .map(|n| Node {
                name: (*n).into(),
                role: (*n).into(),
                seen: Existence::default(),
            })
            .collect(),
        topics: topics
            .iter()
            .map(|t| Topic {
                name: (*t).into(),
                ..Topic::default()
            })
            .collect(),
    }
}

fn graph(words: &[Word<'_>], elements: &Elements) -> Graph {
    let states = elements.all().filter_map(|what| {
        let (node, topic) = elements.names(what);
        let own = |w: &&Word<'_>| match what {
            Element::Node(_) => Some(w.node) == node,
            Element::Topic(_) => Some(w.topic) == topic,
            Element::Publish(_) => w.is(EdgeKind::Publish, node, topic),
            Element::Subscribe(_) => w.is(EdgeKind::Subscribe, node, topic),
        };
        let own = words.iter().filter(own);
        let own: Vec<&Word<'_>> = own
            .take(if what.is_edge() { 1 } else { usize::MAX })
            .collect();
        let hz = own.iter().filter_map(|w| w.hz).reduce(|a, b| a + b);
        let state = own.iter().map(|w| w.state).min()?;
        let count = match what {
            Element::Node(_) => None,
            Element::Topic(_) => Some(count(hz).unwrap_or(0)),
            _ => count(hz),
        };
        Some(ElementState {
            count,
            hz,
            ..ElementState::new(what, state, Confidence::Measured)
        })
    });
    Graph {
        states: states.collect(),
    }
}

/// The number of messages in a window.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "small rates of tests"
)]
fn count(hz: Option<f64>) -> Option<u64> {
    hz.map(|hz| (hz * LENGTH as f64 / 1e9).round() as u64)
}

/// Each window of a mission as the text that [`mission`] reads, without rates.
pub(crate) fn text(mission: &Mission) -> Vec<String> {
    let all = &mission.elements;
    let ends = |edge: &Edge| {
        let node = all.nodes[edge.node].name.to_string();
        (node, all.topics[edge.topic].name.to_string())
    };
    let windows = mission.graphs.iter().map(|graph| {
        let nodes = graph.nodes();
        let nodes = nodes.map(|(id, _)| all.nodes[id].name.to_string());
        let topics = graph.topics();
        let topics = topics.map(|(id, _)| format!("={}", all.topics[id].name));
        let publishes = graph.publishes().map(|(id, _)| {
            let (node, topic) = ends(&all.publishes[id]);
            format!("{node}>{topic}")
        });
        let subscribes = graph.subscribes().map(|(id, _)| {
            let (node, topic) = ends(&all.subscribes[id]);
            format!("{node}<{topic}")
        });
        let words = nodes.chain(topics).chain(publishes).chain(subscribes);
        words.collect::<Vec<_>>().join(" ")
    });
    windows.collect()
}
