//! What the user gives in addition to the bags: files of nodes and edges, launch files, and recordings of graphs by other tools.
//!
//! In: paths. Out: a [`Topology`], the entries of all files with their places; they never overwrite measurements, and nothing is
//! executed. [`read`] names the format of each file; `launch` reads launch files, which XML, YAML and Python all make a `tree`.

mod csv;
mod dot;
pub(crate) mod launch;
#[cfg(feature = "source")]
mod python;
mod tree;
mod yaml;

use std::path::{Path, PathBuf};

use crate::bag::{self, Input, OpenOptions};
use crate::base::budget::TOPOLOGY;
use crate::base::error::{Error, Result};
use crate::base::file;
use crate::base::notice::{Notice, NoticeKind};
use crate::evidence::collector::{CollectOptions, Collector};
use crate::evidence::observation::Observation;
use crate::evidence::source_word;

/// An element by its names.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum NamedElement {
    /// A node.
    Node(String),
    /// A topic.
    Topic(String),
    /// A node and a topic that it publishes.
    Publish(String, String),
    /// A node and a topic that it subscribes to.
    Subscribe(String, String),
    /// A topic and its type.
    Type(String, String),
}

impl NamedElement {
    /// A node publishes a topic, or subscribes to it.
    fn edge(publishes: bool, node: String, topic: String) -> Self {
        if publishes {
            Self::Publish(node, topic)
        } else {
            Self::Subscribe(node, topic)
        }
    }
}

/// A node or edge in a file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TopologyEntry {
    /// The element.
    pub element: NamedElement,
    /// The start, in nanoseconds after the mission's start; `None`: from the start.
    pub from_ns: Option<i64>,
    /// The end, exclusive, in nanoseconds after the mission's start; `None`: to the end.
    pub to_ns: Option<i64>,
    /// Whether it is only declared to run (by a launch file), not stated to have run.
    pub declared: bool,
    /// The file's own name and the line, for `why`: `robot.csv line 3`.
    pub place: String,
}

impl TopologyEntry {
    /// An entry for the whole mission, stated to have run.
    fn new(element: NamedElement, place: String) -> Self {
        Self {
            element,
            from_ns: None,
            to_ns: None,
            declared: false,
            place,
        }
    }
}

/// All entries of a file, sorted, and the parts of it that could not be used.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Nodes and edges.
    pub entries: Vec<TopologyEntry>,
    /// Notices about unusable parts: includes that were not found, nodes without a name.
    pub notices: Vec<Notice>,
    /// The files that were read, including included ones.
    pub files: Vec<PathBuf>,
}

/// Reads a file of any of the formats, distinguished by extension and content.
///
/// # Errors
/// [`Error::BadFile`] with the line of the mistake.
pub fn read(path: &Path) -> Result<Topology> {
    let text = text(path)?;
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let mut topology = match ending.as_deref().unwrap_or_default() {
        "csv" => csv::read(path, &text)?,
        "dot" | "gv" => dot::read(path, &text)?,
        "launch" | "xml" => launch::read(path, &tree::of_xml(path, &text)?)?,
        "yaml" | "yml" => match tree::of_yaml(path, &text)? {
            Some(tree) => launch::read(path, &tree)?,
            None => yaml::read(path, &text)?,
        },
        "py" => launch::read(path, &python::of_python(path, &text)?)?,
        _ => {
            let reason = "unknown topology format".to_owned();
            let hint = "rename it to .csv, .yaml, .mcap, .dot, .launch, .xml or .launch.py";
            return Err(Error::bad_file(path, 0, reason, hint));
        }
    };
    topology.files.push(path.to_owned());
    topology.entries.sort();
    topology.entries.dedup();
    Ok(topology)
}

/// The text of a file; an error if it is too long.
fn text(path: &Path) -> Result<String> {
    let bytes = file::read(path, TOPOLOGY)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The location of an entry; without a line if there is none.
fn place(path: &Path, line: usize) -> String {
    let name = crate::bag::file_name(path);
    match line {
        0 => name,
        _ => format!("{name} line {line}"),
    }
}

/// A name with the leading slash of resolved names.
fn resolved(name: &str) -> String {
    format!("/{}", name.trim().trim_start_matches('/'))
}

/// A notice about an unused part of a file.
fn unused(path: &Path, line: usize, what: &str) -> Notice {
    Notice::new(NoticeKind::Note, format!("{}: {what}", place(path, line)))
}

/// Replaces the parsers if the feature `source` is disabled.
#[cfg(not(feature = "source"))]
mod python {
    use std::collections::BTreeMap;
    use std::path::Path;

    use super::tree::Tree;
    use crate::base::error::{Error, Result};

    pub(super) const UNREAD: &str = "unread";

    pub(super) fn of_python(path: &Path, _text: &str) -> Result<Tree> {
        let reason = "launch files in Python need the feature `source`".to_owned();
        let hint = "build with `--features source`";
        Err(Error::bad_file(path, 0, reason, hint))
    }

    pub(super) fn evaluate(_expression: &str, _names: &BTreeMap<String, String>) -> Option<String> {
        None
    }
}

/// Reads several files into one topology.
///
/// # Errors
/// As [`read`] and [`bag::open`], for the first file with a mistake.
pub(crate) fn read_all<P: AsRef<Path>>(paths: &[P]) -> Result<Topology> {
    let mut all = Topology::default();
    for path in paths.iter().map(AsRef::as_ref) {
        let is_bag = path.extension().is_some_and(|word| word == "mcap");
        let one = if is_bag { recorded(path) } else { read(path) }?;
        all.entries.extend(one.entries);
        all.notices.extend(one.notices);
        all.files.extend(one.files);
    }
    Ok(all)
}

/// All elements of the graphs in an MCAP file: `/rosgraph`, or the nodes that nodl observed.
fn recorded(path: &Path) -> Result<Topology> {
    let mut reader = bag::open(&Input::Path(path.to_owned()), &OpenOptions::default())?;
    let mut collector = Collector::new(CollectOptions {
        payload_bytes: 0,
        ..CollectOptions::default()
    });
    reader.read(None, &mut collector.bag(&mut |_, _| ()))?;
    let recorded = collector.finish()?;
    let text = |name| recorded.facts.text(name).to_string();
    let element = |observation: &Observation| match *observation {
        Observation::Node(node) => Some(NamedElement::Node(text(node))),
        Observation::Publish(node, topic) => Some(NamedElement::Publish(text(node), text(topic))),
        Observation::Subscribe(node, topic) => {
            Some(NamedElement::Subscribe(text(node), text(topic)))
        }
        Observation::Type(topic, kind) => Some(NamedElement::Type(text(topic), text(kind))),
        _ => None,
    };
    let facts = recorded.facts.list.iter();
    let facts = facts.filter(|fact| source_word(fact.source) == "rosgraph");
    let elements = facts.filter_map(|fact| element(&fact.observation));
    let entry = |element| TopologyEntry::new(element, bag::file_name(path));
    let mut entries: Vec<_> = elements.map(entry).collect();
    if entries.is_empty() {
        let hint = "give a recording of `/rosgraph` or of `/nodl/observed_node`";
        let reason = "it contains no recorded graph";
        return Err(Error::bad_file(path, 0, reason, hint));
    }
    entries.sort();
    entries.dedup();
    Ok(Topology {
        entries,
        notices: recorded.notices.iter().collect(),
        files: vec![path.to_owned()],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_extension_lists_the_known_ones() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("robot.txt");
        std::fs::write(&path, "hello").unwrap();
        assert!(read(&path).unwrap_err().hint().contains(".yaml"));
    }
}
