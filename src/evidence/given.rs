//! The graph that the user supplies in addition to the bags: files of [`topology`], and recordings of graphs
//! by other tools.

use std::path::Path;

use crate::bag::{self, Input, OpenOptions};
use crate::base::error::{Error, Result};
use crate::evidence::SOURCES;
use crate::evidence::collector::{CollectOptions, Collector};
use crate::evidence::observation::Observation;
use crate::evidence::topology::{self, NamedElement, Topology, TopologyEntry};

/// Reads several files into one topology.
///
/// # Errors
/// As [`topology::read`] and [`bag::open`], for the first file with a mistake.
pub(crate) fn read_all<P: AsRef<Path>>(paths: &[P]) -> Result<Topology> {
    let mut all = Topology::default();
    for path in paths.iter().map(AsRef::as_ref) {
        let is_bag = path.extension().is_some_and(|word| word == "mcap");
        let one = if is_bag {
            recorded(path)
        } else {
            topology::read(path)
        }?;
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
    let observations = recorded.facts.list.iter();
    let observations = observations.filter(|fact| {
        SOURCES
            .get(fact.source)
            .is_some_and(|s| s.word == "rosgraph")
    });
    let entry = |element| TopologyEntry::new(element, bag::file_name(path));
    let mut entries: Vec<_> = observations
        .filter_map(|fact| element(&fact.observation))
        .map(entry)
        .collect();
    if entries.is_empty() {
        let hint = "give a recording of `/rosgraph` or of `/nodl/observed_node`";
        return Err(Error::bad_file(
            path,
            0,
            "it contains no recorded graph",
            hint,
        ));
    }
    entries.sort();
    entries.dedup();
    Ok(Topology {
        entries,
        notices: recorded.notices.iter().collect(),
        files: vec![path.to_owned()],
    })
}
