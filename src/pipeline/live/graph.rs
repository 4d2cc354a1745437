//! The graph of a live system.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use crate::base::budget::{NAME, NAMES, NAMES_BYTES};
use crate::base::words;
use crate::export::mcap::{GraphEnd, GraphNode, graph};

/// The ends of all connections: the names of publishers, subscribers, clients and servers by topic or
/// service.
#[derive(Default)]
pub(super) struct LiveGraph {
    ends: [BTreeMap<String, BTreeSet<String>>; 4],
    /// The types of topics.
    pub(super) types: BTreeMap<String, String>,
}

/// The indices in [`LiveGraph::ends`].
pub(super) const PUBLISHERS: usize = 0;
pub(super) const SUBSCRIBERS: usize = 1;
pub(super) const SERVERS: usize = 3;

impl LiveGraph {
    #[cfg(feature = "live")]
    pub(super) fn is_empty(&self) -> bool {
        self.ends.iter().all(BTreeMap::is_empty)
    }

    /// Sets the nodes of a topic or service; none if it no longer exists.
    pub(super) fn set(&mut self, side: usize, name: &str, nodes: BTreeSet<String>) {
        if nodes.is_empty() {
            self.ends[side].remove(name);
        } else {
            self.ends[side].insert(name.to_owned(), nodes);
        }
    }

    /// # Errors
    /// If there are implausibly many or long names. Each end counts once, with the name and type of its topic, as in
    /// the payload.
    pub(super) fn check(&self) -> io::Result<()> {
        let types = self.types.iter().flat_map(|(name, kind)| [name, kind]);
        let (mut count, mut bytes) = (self.types.len(), 0);
        let mut longest = 0;
        for text in types {
            bytes += text.len();
            longest = longest.max(text.len());
        }
        for (name, nodes) in self.ends.iter().flatten() {
            let of_each = name.len() + self.types.get(name).map_or(0, String::len);
            count += nodes.len();
            longest = longest.max(name.len());
            for node in nodes {
                bytes += of_each + node.len();
                longest = longest.max(node.len());
            }
        }
        let why = if count > NAMES {
            format!("more than {NAMES} names")
        } else if longest > NAME {
            format!("a name of more than {NAME} bytes")
        } else if bytes > NAMES_BYTES {
            format!("names of more than {}", words::bytes(NAMES_BYTES as u64))
        } else {
            return Ok(());
        };
        Err(io::Error::other(why))
    }

    pub(super) fn payload(&self) -> Vec<u8> {
        let mut nodes: BTreeMap<&str, GraphNode<'_>> = BTreeMap::new();
        for (side, ends) in self.ends.iter().enumerate() {
            for (name, at) in ends {
                let kind = self.types.get(name).map_or("", String::as_str);
                for node in at {
                    let node = nodes.entry(node).or_insert_with(|| GraphNode::new(node));
                    node.ends[side].push(GraphEnd {
                        name,
                        kind,
                        qos: None,
                    });
                }
            }
        }
        graph(&nodes.into_values().collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reason for refusing nodes that publish one topic.
    fn refused(nodes: usize, name: usize, kind: usize) -> String {
        let mut graph = LiveGraph::default();
        let name = "n".repeat(name);
        let nodes = (0..nodes).map(|node| format!("/{node}"));
        graph.set(PUBLISHERS, &name, nodes.collect());
        graph.types.insert(name, "k".repeat(kind));
        let why = graph.check().err().map(|error| error.to_string());
        why.unwrap_or_default()
    }

    #[test]
    fn long_names_and_their_repetitions_are_refused() {
        assert_eq!(refused(2000, 20, 20), "");
        assert_eq!(refused(1, NAME, NAME), "");
        assert_eq!(refused(1, 20, NAME + 1), "a name of more than 65536 bytes");
        assert_eq!(refused(1, NAME + 1, 20), "a name of more than 65536 bytes");
        assert_eq!(refused(2000, 10, 60_000), "names of more than 33.6 MB");
        assert_eq!(refused(2000, 60_000, 10), "names of more than 33.6 MB");
        assert_eq!(refused(NAMES, 1, 1), "more than 65536 names");
    }
}
