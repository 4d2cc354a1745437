//! Our own form of a topology: under `nodes` each node with `publishes`, `subscribes`, and `start` and `end` in seconds
//! after the bag's start.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use super::{NamedElement, Topology, TopologyEntry, bad, place, resolved};
use crate::base::error::{Error, Result};
use crate::base::yaml;

const HINT: &str =
    "write `nodes:`, then below it `/name: {publishes: [/a], subscribes: [/b], start: 0, end: 60}`";

pub(super) fn read(path: &Path, text: &str) -> Result<Topology> {
    let file = TopologyYaml::new(path, text);
    let data = yaml::parse(text).map_err(|e| bad(path, e.line, e.reason, HINT))?;
    let Some(Value::Object(nodes)) = data.get("nodes") else {
        return Err(file.wrong("nodes", "there is no mapping `nodes`"));
    };
    let mut topology = Topology::default();
    for (name, value) in nodes {
        topology.entries.extend(file.node(name, value)?);
    }
    Ok(topology)
}

/// The most lines with the same beginning that are searched for the first one.
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

    /// The error about a key, at the first line that holds it.
    fn wrong(&self, key: &str, reason: &str) -> Error {
        bad(self.path, self.line(key), reason.to_owned(), HINT)
    }

    /// The first line that begins with a key; 0 if none does.
    fn line(&self, key: &str) -> usize {
        // All that begin with it stand together in the order of their text.
        let from = self.lines.range(key..);
        let own = from
            .take_while(|(line, _)| line.starts_with(key))
            .take(MOST_ALIKE);
        own.map(|(_, number)| *number).min().unwrap_or(0)
    }

    fn node(&self, name: &str, value: &Value) -> Result<Vec<TopologyEntry>> {
        let empty = serde_json::Map::new();
        let fields = match value {
            Value::Null => &empty,
            Value::Object(fields) => fields,
            _ => return Err(self.wrong(name, &format!("`{name}` holds no mapping"))),
        };
        let known = ["publishes", "subscribes", "start", "end"];
        if let Some(key) = fields.keys().find(|key| !known.contains(&key.as_str())) {
            return Err(self.wrong(key, &format!("unknown key `{key}`")));
        }
        let (from_ns, to_ns) = (
            self.time(fields.get("start"))?,
            self.time(fields.get("end"))?,
        );
        if let (Some(from), Some(to)) = (from_ns, to_ns)
            && to < from
        {
            let reason = format!("the end of `{name}` lies before its start");
            return Err(self.wrong(name, &reason));
        }
        let node = resolved(name);
        let entry = |element| TopologyEntry {
            element,
            from_ns,
            to_ns,
            declared: false,
            place: place(self.path, self.line(name)),
        };
        let mut entries = vec![entry(NamedElement::Node(node.clone()))];
        for topic in self.names(fields.get("publishes"), name)? {
            entries.push(entry(NamedElement::Publish(node.clone(), topic)));
        }
        for topic in self.names(fields.get("subscribes"), name)? {
            entries.push(entry(NamedElement::Subscribe(node.clone(), topic)));
        }
        Ok(entries)
    }

    fn names(&self, value: Option<&Value>, node: &str) -> Result<Vec<String>> {
        let name = |value: &Value| value.as_str().map(resolved);
        let names = match value {
            None | Some(Value::Null) => Some(Vec::new()),
            Some(Value::Array(list)) => list.iter().map(name).collect(),
            Some(one) => name(one).map(|name| vec![name]),
        };
        names.ok_or_else(|| {
            self.wrong(
                node,
                &format!("the topics of `{node}` are not a list of names"),
            )
        })
    }

    fn time(&self, value: Option<&Value>) -> Result<Option<i64>> {
        let Some(value) = value.filter(|v| !v.is_null()) else {
            return Ok(None);
        };
        let seconds = value.as_f64().filter(|s| s.abs() < 9e9);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "less than 2^63 by the check above"
        )]
        let nanos = seconds.map(|s| (s * 1e9) as i64);
        nanos.map_or_else(
            || Err(self.wrong("start", &format!("`{value}` is not a number of seconds"))),
            |n| Ok(Some(n)),
        )
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

    #[test]
    fn a_bad_line_is_named() {
        let text = "nodes:\n  /a:\n    publishs: [x]\n";
        let error = read(Path::new("t.yaml"), text).unwrap_err().to_string();
        assert!(
            error.contains("line 3") && error.contains("publishs"),
            "{error}"
        );
    }
}
