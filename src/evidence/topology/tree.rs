//! A launch file as a tree of elements, from XML or from the YAML of ROS 2, so that one reader serves both.

use std::path::Path;

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};
use serde_json::Value;

use super::bad;
use crate::base::error::Result;
use crate::base::yaml;

/// An element of a launch file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Tree {
    pub(super) tag: String,
    /// Attributes in order.
    pub(super) attributes: Vec<(String, String)>,
    pub(super) children: Vec<Self>,
    /// Its line, 1..; 0 where not known.
    pub(super) line: usize,
}

impl Tree {
    /// An attribute by its name.
    pub(super) fn get(&self, name: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(n, _)| n == name);
        found.map(|(_, value)| value.as_str())
    }
}

/// Elements inside elements deeper than this are hostile.
const DEEPEST: usize = 64;
const XML_HINT: &str = "a launch file begins with `<launch>`";
const YAML_HINT: &str = "a launch file begins with `launch:` and a list";

/// The tree of a launch file in XML.
pub(super) fn of_xml(path: &Path, text: &str) -> Result<Tree> {
    let mut reader = Reader::from_str(text);
    let mut open: Vec<Tree> = Vec::new();
    loop {
        let line = |reader: &Reader<&[u8]>| {
            let at = usize::try_from(reader.buffer_position())
                .unwrap_or(0)
                .min(text.len());
            text.get(..at).unwrap_or(text).matches('\n').count() + 1
        };
        let wrong = |line, reason: String| bad(path, line, reason, XML_HINT);
        let event = reader
            .read_event()
            .map_err(|e| wrong(line(&reader), e.to_string()))?;
        let here = line(&reader);
        let done = match event {
            Event::Start(start) => {
                if open.len() >= DEEPEST {
                    return Err(wrong(here, format!("elements nest deeper than {DEEPEST}")));
                }
                open.push(element(&start, here).map_err(|e| wrong(here, e))?);
                None
            }
            Event::Empty(start) => Some(element(&start, here).map_err(|e| wrong(here, e))?),
            Event::End(_) => open.pop(),
            Event::Eof => {
                return Err(wrong(
                    here,
                    "the element `launch` is missing or not closed".to_owned(),
                ));
            }
            _ => None,
        };
        if let Some(tree) = done {
            match open.last_mut() {
                Some(parent) => parent.children.push(tree),
                None if tree.tag == "launch" => return Ok(tree),
                None => return Err(wrong(tree.line, format!("`{}` is no `launch`", tree.tag))),
            }
        }
    }
}

fn element(start: &BytesStart<'_>, line: usize) -> Result<Tree, String> {
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|e| e.to_string())?;
        let value = attribute
            .normalized_value(XmlVersion::Implicit1_0)
            .map_err(|e| e.to_string())?;
        let name = attribute.key.local_name();
        attributes.push((name.as_ref().to_owned(), value.into_owned()));
    }
    Ok(Tree {
        tag: start.local_name().as_ref().to_owned(),
        attributes,
        children: Vec::new(),
        line,
    })
}

/// The tree of a launch file in YAML; `None` if the document has no key `launch`.
pub(super) fn of_yaml(path: &Path, text: &str) -> Result<Option<Tree>> {
    let data = yaml::parse(text).map_err(|e| bad(path, e.line, e.reason, YAML_HINT))?;
    let Some(launch) = data.get("launch") else {
        return Ok(None);
    };
    let Value::Array(list) = launch else {
        return Err(bad(path, 1, "`launch` holds no list".to_owned(), YAML_HINT));
    };
    Ok(Some(Tree {
        tag: "launch".to_owned(),
        children: list.iter().flat_map(entities).collect(),
        ..Tree::default()
    }))
}

/// `- node: {…}` as an element `node`; the depth is bounded by the reader of YAML.
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
        // A group: its list holds entities.
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
