//! Graphs in YAML. In our own format, `nodes` contains each node with `publishes`, `subscribes`, `services`, `clients`,
//! `actions`,
//! `action_clients`, and `start` and `end` in seconds after the bag's start. Other tools list nodes (`/rosgraph` as
//! `ros2 topic echo` prints it, the `architecture.yaml` of CARET), or describe a single one (`NoDL` 2).

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use super::{NamedElement, Topology, TopologyEntry, place, resolved};
use crate::base::cast;
use crate::base::error::{Error, Result};
use crate::base::name::SERVICE;
use crate::base::yaml;

const HINT: &str =
    "write `nodes:`, then below it `/name: {publishes: [/a], subscribes: [/b], start: 0, end: 60}`";

/// What an endpoint belongs to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum EndKind {
    Topic,
    Service,
    Action,
}

/// The keys of lists of endpoints, in our format and in those of other tools, and whether the node publishes: the client of a
/// service does, and the server of an action.
const ENDS: [(&str, bool, EndKind); 11] = [
    ("publishes", true, EndKind::Topic),
    ("publishers", true, EndKind::Topic),
    ("subscribes", false, EndKind::Topic),
    ("subscriptions", false, EndKind::Topic),
    ("services", false, EndKind::Service),
    ("service_servers", false, EndKind::Service),
    ("clients", true, EndKind::Service),
    ("service_clients", true, EndKind::Service),
    ("actions", true, EndKind::Action),
    ("action_servers", true, EndKind::Action),
    ("action_clients", false, EndKind::Action),
];

pub(super) fn read(path: &Path, text: &str) -> Result<Topology> {
    let file = TopologyYaml::new(path, text);
    let data = yaml::parse(text).map_err(|e| Error::bad_file(path, e.at.line, e.reason, HINT))?;
    let mut topology = Topology::default();
    match data.get("nodes") {
        Some(Value::Object(nodes)) => {
            for (name, value) in nodes {
                topology.entries.extend(file.node(name, value)?);
            }
        }
        Some(Value::Array(nodes)) => {
            for node in nodes {
                let name = text_of(node, &["name", "node_name"]);
                let name = name.ok_or_else(|| file.wrong("nodes", "a node has no `name`"))?;
                topology.entries.extend(file.node_of_others(name, node)?);
            }
        }
        _ if data.get("nodl_version").is_some() => {
            // The file is named after the node, `nav.planner.nodl.yaml` after `/nav/planner`.
            let name = crate::bag::file_name(path);
            let name = name.strip_suffix(".yaml").or(name.strip_suffix(".yml"));
            let name = name.unwrap_or_default();
            let name = name.strip_suffix(".nodl").unwrap_or(name).replace('.', "/");
            topology.entries.extend(file.node_of_others(&name, &data)?);
        }
        _ => return Err(file.wrong("nodes", "there is no mapping `nodes`")),
    }
    Ok(topology)
}

/// The first of these fields that is a text.
fn text_of<'a>(value: &'a Value, keys: &[&str]) -> Option<&'a str> {
    keys.iter().find_map(|key| value.get(key)?.as_str())
}

/// The most lines with the same beginning that are searched for the first one: it only bounds the work for an error.
const MOST_ALIKE: usize = 100;

struct TopologyYaml<'a> {
    path: &'a Path,
    /// The start of every line, after blanks, dashes and quotes, with the first line that has it, ≥ 1.
    lines: BTreeMap<&'a str, usize>,
}

impl<'a> TopologyYaml<'a> {
    fn new(path: &'a Path, text: &'a str) -> Self {
        let mut lines = BTreeMap::new();
        for (number, line) in (1..).zip(text.lines()) {
            let start = line.trim_start_matches([' ', '\t', '-', '"', '\'']);
            lines.entry(start).or_insert(number);
        }
        Self { path, lines }
    }

    /// The error for a key, at the first line that contains it.
    fn wrong(&self, key: &str, reason: &str) -> Error {
        Error::bad_file(self.path, self.line(key), reason, HINT)
    }

    /// The first line that begins with a key, or contains it; 0 if none does.
    fn line(&self, key: &str) -> usize {
        // Lines with the same prefix are contiguous in this order.
        let from = self.lines.range(key..);
        let own = from
            .take_while(|(line, _)| line.starts_with(key))
            .take(MOST_ALIKE);
        let inside = || self.lines.iter().filter(|(line, _)| line.contains(key));
        let first = own.map(|(_, number)| *number).min();
        first
            .or_else(|| inside().map(|(_, number)| *number).min())
            .unwrap_or(0)
    }

    fn node(&self, name: &str, value: &Value) -> Result<Vec<TopologyEntry>> {
        let empty = serde_json::Map::new();
        let fields = match value {
            Value::Null => &empty,
            Value::Object(fields) => fields,
            _ => return Err(self.wrong(name, &format!("`{name}` is not a mapping"))),
        };
        let is_known = |key: &str| {
            ["start", "end"].contains(&key) || ENDS.iter().any(|(known, ..)| *known == key)
        };
        if let Some(key) = fields.keys().find(|key| !is_known(key)) {
            return Err(self.wrong(key, &format!("unknown key `{key}`")));
        }
        let from_ns = self.time(fields.get("start"))?;
        let to_ns = self.time(fields.get("end"))?;
        if let (Some(from), Some(to)) = (from_ns, to_ns)
            && to < from
        {
            let reason = format!("the end of `{name}` is before its start");
            return Err(self.wrong(name, &reason));
        }
        let mut entries = self.node_of_others(name, value)?;
        for entry in &mut entries {
            (entry.from_ns, entry.to_ns) = (from_ns, to_ns);
        }
        Ok(entries)
    }

    /// A node with its endpoints; other keys are ignored.
    fn node_of_others(&self, name: &str, value: &Value) -> Result<Vec<TopologyEntry>> {
        let node = resolved(name);
        let entry = |element| TopologyEntry::new(element, place(self.path, self.line(name)));
        let mut entries = vec![entry(NamedElement::Node(node.clone()))];
        for (key, publishes, kind) in ENDS {
            for (topic, own) in self.names(value.get(key), &node)? {
                let edge = |topic| entry(NamedElement::edge(publishes, node.clone(), topic));
                if kind == EndKind::Action {
                    let part = |part| edge(format!("{topic}/_action/{part}"));
                    entries.extend(["feedback", "status"].map(part));
                    continue;
                }
                let is_service = kind == EndKind::Service;
                let own = own.or_else(|| is_service.then(|| SERVICE.to_owned()));
                entries.extend(own.map(|own| entry(NamedElement::Type(topic.clone(), own))));
                entries.push(edge(topic));
            }
        }
        Ok(entries)
    }

    /// The names in a list, with their types: texts, or mappings with a name; a private name is below its node.
    fn names(&self, value: Option<&Value>, node: &str) -> Result<Vec<(String, Option<String>)>> {
        let name = |value: &Value| {
            let text = value.as_str().or(text_of(value, &["name", "topic_name"]))?;
            let name = match text.strip_prefix('~') {
                Some(private) => format!("{node}/{}", private.trim_start_matches('/')),
                None => resolved(text),
            };
            let kind = value.get("type").or(value.get("request_type"));
            let kind = kind.and_then(|kind| kind.as_str().or(text_of(kind, &["name"])));
            let kind = kind.map(|kind| kind.strip_suffix("_Request").unwrap_or(kind).to_owned());
            Some((name, kind))
        };
        let names = match value {
            None | Some(Value::Null) => Some(Vec::new()),
            Some(Value::Array(list)) => list.iter().map(name).collect(),
            Some(one) => name(one).map(|name| vec![name]),
        };
        let reason = || format!("the topics of `{node}` are not a list of names");
        names.ok_or_else(|| self.wrong(node, &reason()))
    }

    fn time(&self, value: Option<&Value>) -> Result<Option<i64>> {
        let Some(value) = value.filter(|v| !v.is_null()) else {
            return Ok(None);
        };
        let seconds = value.as_f64().filter(|s| s.abs() < 9e9);
        match seconds.map(|s| cast::to_i64(s * 1e9)) {
            None => Err(self.wrong("start", &format!("`{value}` is not a number of seconds"))),
            nanos => Ok(nanos),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_have_topics_and_times() {
        let text = "nodes:\n  /planner:\n    publishes: [plan]\n    subscribes: /map\n    start: 2.5\n  /idle:\n";
        let entries = read(Path::new("t.yaml"), text).unwrap().entries;
        let elements: Vec<_> = entries.iter().map(|e| e.element.clone()).collect();
        assert!(elements.contains(&NamedElement::Publish("/planner".into(), "/plan".into())));
        assert!(elements.contains(&NamedElement::Subscribe("/planner".into(), "/map".into())));
        assert!(elements.contains(&NamedElement::Node("/idle".into())));
        let planner = entries
            .iter()
            .find(|e| e.element == NamedElement::Node("/planner".into()));
        assert_eq!(planner.unwrap().from_ns, Some(2_500_000_000));
    }

    /// The elements of a file as lines.
    fn lines(name: &str, text: &str) -> Vec<String> {
        let entries = read(Path::new(name), text).unwrap().entries;
        let line = |e: TopologyEntry| match e.element {
            NamedElement::Publish(node, topic) => format!("{node} > {topic}"),
            NamedElement::Subscribe(node, topic) => format!("{node} < {topic}"),
            NamedElement::Node(name) | NamedElement::Topic(name) => name,
            NamedElement::Type(topic, kind) => format!("{topic}: {kind}"),
        };
        entries.into_iter().map(line).collect()
    }

    #[test]
    fn graphs_of_other_tools_are_read() {
        let nodl = "nodl_version: 2\npublishers:\n  - {name: ~/plan, type: nav_msgs/msg/Path}\n\
                    service_servers:\n  - {name: /clear, type: std_srvs/srv/Empty}\n";
        assert_eq!(
            lines("planner.nodl.yaml", nodl),
            [
                "/planner",
                "/planner/plan: nav_msgs/msg/Path",
                "/planner > /planner/plan",
                "/clear: std_srvs/srv/Empty",
                "/planner < /clear"
            ]
        );
        let rosgraph = "nodes:\n- name: /a\n  parameters: []\n  subscriptions:\n  - name: /t\n    qos: {depth: 1}\n\
                        - name: /b\n  action_clients:\n  - name: /go\n";
        assert_eq!(
            lines("graph.yaml", rosgraph),
            [
                "/a",
                "/a < /t",
                "/b",
                "/b < /go/_action/feedback",
                "/b < /go/_action/status"
            ]
        );
        let caret = "named_paths: []\nexecutors: []\nnodes:\n- node_name: /a\n  callbacks: []\n  publishes:\n\
                     \x20 - topic_name: /t\n    callback_names: [x]\n";
        assert_eq!(lines("architecture.yaml", caret), ["/a", "/a > /t"]);
    }

    #[test]
    fn errors_have_their_line() {
        for (text, line) in [
            ("nodes:\n  /a:\n    publishs: [x]\n", "line 3"),
            ("nodes:\n  /a: {publishs: [x]}\n", "line 2"),
        ] {
            let error = read(Path::new("t.yaml"), text).unwrap_err().to_string();
            assert!(
                error.contains(line) && error.contains("publishs"),
                "{error}"
            );
        }
    }
}
