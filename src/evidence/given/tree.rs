//! A launch file as a tree of elements, from XML or from ROS 2's YAML, so that one reader handles them and Python.

use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};
use serde_json::Value;

use crate::base::error::{Error, Result};
use crate::base::yaml;

/// An element of a launch file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tree {
    pub(super) tag: String,
    /// Attributes in order.
    pub(super) attributes: Vec<(String, String)>,
    pub(super) children: Vec<Self>,
    /// The line, ≥ 1; 0 if unknown.
    pub(super) line: usize,
}

impl Tree {
    /// An attribute by its name.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(n, _)| n == name);
        found.map(|(_, value)| value.as_str())
    }
}

/// The longest text of an attribute after substitution, in bytes: longer than any path.
pub(super) const LONGEST: usize = 64 << 10;
/// The deepest nesting of elements; deeper ones are hostile: those in use nest six deep.
pub(super) const DEEPEST: usize = 64;
/// The most attributes of an element, whose parsing takes the square of their number: a hundredth of a second for so many.
const MOST_ATTRIBUTES: usize = 2000;
const XML_HINT: &str = "a launch file begins with `<launch>`";
const YAML_HINT: &str = "a launch file begins with `launch:` and a list";

/// The tree of a launch file in XML.
pub(super) fn of_xml(path: &Path, text: &str) -> Result<Tree> {
    let mut line = 1;
    for tag in text.split('<') {
        let is_element = tag.starts_with(char::is_alphabetic);
        if is_element && tag.matches('=').nth(MOST_ATTRIBUTES).is_some() {
            let what = format!("an element has more than {MOST_ATTRIBUTES} attributes");
            return Err(Error::bad_file(path, line, what, XML_HINT));
        }
        line += tag.matches('\n').count();
    }
    let options = ParsingOptions {
        nodes_limit: 4_000_000,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let line = usize::try_from(error.pos().row).unwrap_or(0);
        Error::bad_file(path, line, error.to_string(), XML_HINT)
    })?;
    let file = XmlLaunch {
        path,
        lines: text.match_indices('\n').map(|(at, _)| at).collect(),
    };
    let root = document.root_element();
    if root.tag_name().name() != "launch" {
        let what = format!("`{}` is not `launch`", root.tag_name().name());
        return Err(file.wrong(root, what));
    }
    file.element(root, 0)
}

struct XmlLaunch<'a> {
    path: &'a Path,
    /// The ends of the lines, in bytes.
    lines: Vec<usize>,
}

impl XmlLaunch<'_> {
    fn line(&self, node: Node<'_, '_>) -> usize {
        self.lines.partition_point(|end| *end < node.range().start) + 1
    }

    fn wrong(&self, node: Node<'_, '_>, reason: String) -> Error {
        Error::bad_file(self.path, self.line(node), reason, XML_HINT)
    }

    fn element(&self, node: Node<'_, '_>, depth: usize) -> Result<Tree> {
        if depth >= DEEPEST {
            return Err(self.wrong(node, format!("elements are nested deeper than {DEEPEST}")));
        }
        let inside = node.children().filter(Node::is_element);
        Ok(Tree {
            tag: node.tag_name().name().to_owned(),
            attributes: node
                .attributes()
                .map(|a| (a.name().to_owned(), a.value().to_owned()))
                .collect(),
            children: inside
                .map(|child| self.element(child, depth + 1))
                .collect::<Result<_>>()?,
            line: self.line(node),
        })
    }
}

/// The tree of a launch file in YAML; `None` if the document has no key `launch`.
pub(super) fn of_yaml(path: &Path, text: &str) -> Result<Option<Tree>> {
    let data =
        yaml::parse(text).map_err(|e| Error::bad_file(path, e.at.line, e.reason, YAML_HINT))?;
    let Some(launch) = data.get("launch") else {
        return Ok(None);
    };
    let Value::Array(list) = launch else {
        let reason = "`launch` is not a list";
        return Err(Error::bad_file(path, 1, reason, YAML_HINT));
    };
    Ok(Some(Tree {
        tag: "launch".to_owned(),
        children: list.iter().flat_map(entities).collect(),
        ..Tree::default()
    }))
}

/// The elements of a list in YAML: `- node: {…}` is an element `node`; the depth is bounded by the reader of YAML.
fn entities(value: &Value) -> Vec<Tree> {
    let Value::Object(map) = value else {
        return Vec::new();
    };
    map.iter().map(|(tag, value)| entity(tag, value)).collect()
}

fn entity(tag: &str, value: &Value) -> Tree {
    let mut tree = Tree {
        tag: tag.to_owned(),
        ..Tree::default()
    };
    match value {
        // A group: its list contains entities.
        Value::Array(list) => tree.children = list.iter().flat_map(entities).collect(),
        Value::Object(map) => {
            for (key, value) in map {
                match value {
                    Value::Array(list) => tree.children.extend(list.iter().map(|v| entity(key, v))),
                    Value::Object(_) => tree.children.push(entity(key, value)),
                    scalar => tree.attributes.push((key.clone(), plain(scalar))),
                }
            }
        }
        scalar => tree.attributes.push(("value".to_owned(), plain(scalar))),
    }
    tree
}

fn plain(scalar: &Value) -> String {
    match scalar {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
