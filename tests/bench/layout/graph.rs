//! The test graphs: the union of all windows of a mission, with sizes as for labels.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use bagreel::internals::base::geometry::Size;
use bagreel::internals::graph::Element;
use bagreel::internals::layout::{Cluster, Link, Outline, Plan, Vertex};

/// A graph with its names.
pub(crate) struct Graph {
    pub(crate) plan: Plan,
    /// The name of each vertex; nodes first, then topics.
    pub(crate) names: Vec<String>,
    pub(crate) nodes: usize,
    /// The name of each cluster.
    pub(crate) clusters: Vec<String>,
}

/// The elements of all windows of a mission, by their names.
#[derive(Default)]
struct Union {
    nodes: BTreeSet<String>,
    topics: BTreeSet<String>,
    /// The highest rate of each publication, by node and topic.
    publishes: BTreeMap<(String, String), f64>,
    /// Topics and nodes.
    subscribes: BTreeSet<(String, String)>,
}

/// The union of all windows of a test graph.
pub(crate) fn read(path: &Path) -> Graph {
    let text = std::fs::read_to_string(path).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let word =
        |value: &serde_json::Value, key: &str| value[key].as_str().unwrap_or_default().to_owned();
    let list =
        |value: &serde_json::Value, key: &str| value[key].as_array().cloned().unwrap_or_default();
    let mut all = Union::default();
    for window in list(&json, "windows") {
        let names = |key| list(&window, key).into_iter().map(|x| word(&x, "name"));
        all.nodes.extend(names("nodes"));
        all.topics.extend(names("topics"));
        for x in list(&window, "publishes") {
            let hz = x["hz"].as_f64().unwrap_or(0.0);
            all.publish(word(&x, "node"), word(&x, "topic"), hz);
        }
        let subscribes = list(&window, "subscribes").into_iter();
        all.subscribes
            .extend(subscribes.map(|x| (word(&x, "topic"), word(&x, "node"))));
    }
    all.graph()
}

/// The union of all windows of a bag.
pub(crate) fn of_bag(path: &str) -> Graph {
    let mission = bagreel::read(&bagreel::Reading::of([path])).unwrap();
    let elements = &mission.elements;
    let mut all = Union::default();
    for state in mission.each().flat_map(|(_, graph)| graph.states) {
        let (node, topic) = elements.ends(state.what);
        let node = node.map(|id| elements.nodes[id].name.to_string());
        let topic = topic.map(|id| elements.topics[id].name.to_string());
        match (state.what, node, topic) {
            (Element::Node(_), Some(node), _) => drop(all.nodes.insert(node)),
            (Element::Topic(_), _, Some(topic)) => drop(all.topics.insert(topic)),
            (Element::Publish(_), Some(node), Some(topic)) => {
                all.publish(node, topic, state.hz.unwrap_or(0.0));
            }
            (Element::Subscribe(_), Some(node), Some(topic)) => {
                all.subscribes.insert((topic, node));
            }
            _ => {}
        }
    }
    all.graph()
}

impl Union {
    fn publish(&mut self, node: String, topic: String, hz: f64) {
        let highest = self.publishes.entry((node, topic)).or_insert(0.0);
        *highest = highest.max(hz);
    }

    fn graph(self) -> Graph {
        let Self {
            nodes,
            topics,
            publishes,
            subscribes,
        } = self;
        let mut clusters: BTreeSet<String> = BTreeSet::new();
        for name in nodes.iter().chain(&topics) {
            for (at, _) in name.match_indices('/').filter(|(at, _)| *at > 0) {
                clusters.insert(name[..at].to_owned());
            }
        }
        let clusters: Vec<String> = clusters.into_iter().collect();
        let cluster = |name: &str| {
            let (space, _) = name.rsplit_once('/').unwrap_or_default();
            clusters.iter().position(|c| c == space)
        };
        let vertex = |name: &String, per_char: f64, pad: f64, h: f64, outline| Vertex {
            size: Size::new(
                per_char * name.rsplit('/').next().unwrap_or("").len() as f64 + pad,
                h,
            ),
            outline,
            cluster: cluster(name),
        };
        let place_of =
            |set: &BTreeSet<String>, name: &String| set.iter().position(|n| n == name).unwrap();
        let mut plan = Plan::default();
        plan.vertices.extend(
            nodes
                .iter()
                .map(|n| vertex(n, 0.56 * 14.0, 24.0, 30.0, Outline::Ellipse)),
        );
        plan.vertices.extend(
            topics
                .iter()
                .map(|n| vertex(n, 0.5 * 12.5, 16.0, 22.0, Outline::Box)),
        );
        for ((node, topic), hz) in &publishes {
            let label = format!("{hz:.1} Hz");
            plan.links.push(Link {
                from: place_of(&nodes, node),
                to: nodes.len() + place_of(&topics, topic),
                label: Some(Size::new(label.len() as f64 * 5.5 + 2.0, 13.0)),
                ..Link::default()
            });
        }
        for (topic, node) in &subscribes {
            plan.links.push(Link {
                from: nodes.len() + place_of(&topics, topic),
                to: place_of(&nodes, node),
                ..Link::default()
            });
        }
        plan.clusters = clusters
            .iter()
            .map(|name| Cluster {
                parent: name
                    .rsplit_once('/')
                    .and_then(|(up, _)| clusters.iter().position(|c| c == up)),
                title: Size::new(
                    (1 + name.rsplit('/').next().unwrap_or("").len()) as f64 * 6.0,
                    14.0,
                ),
                footer: Size::default(),
            })
            .collect();
        let count = nodes.len();
        Graph {
            plan,
            names: nodes.into_iter().chain(topics).collect(),
            nodes: count,
            clusters,
        }
    }
}
