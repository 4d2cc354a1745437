//! In which cells of the activity each element of the graph is there, which is what phases are cut by.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::name::is_quiet;
use crate::base::time::Stamp;
use crate::graph::{Elements, State};
use crate::mission::activity::{Activity, Cell, is_hidden_node};

/// Absences up to this share of the mission, one in so many, inside an element's life are none: a slow topic has no
/// message in some cells.
const FILLED: i64 = 50;

/// What is there or not.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum PresentThing {
    /// A node, by role.
    Node(Arc<str>),
    /// A publication: role and topic.
    Publication(Arc<str>, Arc<str>),
    /// A topic, where publishers are unknown.
    Topic(Arc<str>),
}

impl PresentThing {
    /// The name of a node or topic; a publication's topic.
    pub(crate) fn name(&self) -> Arc<str> {
        match self {
            Self::Node(name) | Self::Publication(_, name) | Self::Topic(name) => Arc::clone(name),
        }
    }
}

/// Something, and the cells in which it is there.
#[derive(Clone, Debug)]
pub(crate) struct Presence {
    pub(crate) subject: PresentThing,
    pub(crate) cells: Vec<bool>,
}

impl Presence {
    /// Whether phases are told by it: nodes, or topics where there are only these.
    pub(crate) fn counts(&self, topics: bool) -> bool {
        match self.subject {
            PresentThing::Node(_) => !topics,
            PresentThing::Topic(_) => topics,
            PresentThing::Publication(..) => false,
        }
    }
}

/// Whether phases were found in topics.
pub(crate) fn is_topics(present: &[Presence]) -> bool {
    present
        .iter()
        .any(|p| matches!(p.subject, PresentThing::Topic(_)))
}

/// Every element's presence, sorted: nodes by role and their publications that carry messages; topics with messages
/// where less than half of these have a known publisher. Housekeeping and recorders are left out.
pub(crate) fn presences(elements: &Elements, activity: &Activity) -> Vec<Presence> {
    let mut all: BTreeMap<PresentThing, Vec<bool>> = BTreeMap::new();
    let many = activity.cells.len();
    let known = knows_publishers(elements, activity);
    for (at, cell) in activity.cells.iter().enumerate() {
        let subjects = if known {
            nodes(elements, cell)
        } else {
            topics(elements, cell)
        };
        for subject in subjects {
            all.entry(subject).or_insert_with(|| vec![false; many])[at] = true;
        }
    }
    let widths: Vec<i64> = activity.cells.iter().map(|c| c.span.nanos()).collect();
    let most = activity.span().nanos() / FILLED;
    let filled = |(subject, cells)| Presence {
        subject,
        cells: filled(cells, &widths, most),
    };
    all.into_iter().map(filled).collect()
}

/// Whether at least half of the messages are on topics of which some publisher is known.
pub(crate) fn knows_publishers(elements: &Elements, activity: &Activity) -> bool {
    let (mut all, mut known) = (0_u64, 0_u64);
    for cell in &activity.cells {
        let mut sent = vec![false; elements.topics.len()];
        for edge in &cell.graph.publishes {
            let edge = elements.publishes.get(edge.id as usize);
            let known = edge.filter(|e| !e.evidence.is_guess());
            if let Some(is) = known
                .map(|e| e.topic)
                .and_then(|t| sent.get_mut(t as usize))
            {
                *is = true;
            }
        }
        for topic in &cell.graph.topics {
            let id = topic.id as usize;
            let quiet = |t: &crate::graph::Topic| is_quiet(t.name.as_str());
            if elements.topics.get(id).is_none_or(quiet) {
                continue;
            }
            all = all.saturating_add(topic.count);
            if sent.get(id) == Some(&true) {
                known = known.saturating_add(topic.count);
            }
        }
    }
    known >= all - known
}

/// Nodes that are alive and publications that are active or latched.
fn nodes(elements: &Elements, cell: &Cell) -> Vec<PresentThing> {
    let node = |id: u32| {
        let node = elements.nodes.get(id as usize);
        node.filter(|n| !is_hidden_node(n))
            .map(|n| Arc::clone(&n.role))
    };
    let alive = cell.graph.nodes.iter().filter_map(|n| node(n.id));
    let sends = cell.graph.publishes.iter().filter_map(|edge| {
        let carries = matches!(edge.state, State::Active | State::Latched);
        let of = elements
            .publishes
            .get(edge.id as usize)
            .filter(|_| carries)?;
        let topic = elements.topics.get(of.topic as usize)?;
        let name = topic.name.shared();
        (!is_quiet(&name)).then_some(PresentThing::Publication(node(of.node)?, name))
    });
    alive.map(PresentThing::Node).chain(sends).collect()
}

/// Topics that carry messages.
fn topics(elements: &Elements, cell: &Cell) -> Vec<PresentThing> {
    let active = cell.graph.topics.iter().filter(|t| t.count > 0);
    let names = active.filter_map(|t| elements.topics.get(t.id as usize));
    let names = names.map(|t| t.name.shared()).filter(|n| !is_quiet(n));
    names.map(PresentThing::Topic).collect()
}

/// The cells with every absence of at most `most` nanoseconds between two presences filled.
fn filled(mut cells: Vec<bool>, widths: &[i64], most: i64) -> Vec<bool> {
    let mut last: Option<usize> = None;
    for at in 0..cells.len() {
        if !cells[at] {
            continue;
        }
        if let Some(last) = last {
            let absent: i64 = widths[last + 1..at].iter().sum();
            if absent <= most {
                cells[last + 1..at].fill(true);
            }
        }
        last = Some(at);
    }
    cells
}

/// The exact first and last signs of the nodes of a role, or of a topic.
pub(crate) fn ends(elements: &Elements, name: &str, topics: bool) -> (Vec<Stamp>, Vec<Stamp>) {
    let (mut first, mut last) = (Vec::new(), Vec::new());
    if topics {
        for topic in elements.topics.iter().filter(|t| t.name.as_str() == name) {
            first.extend(topic.first);
            last.extend(topic.last);
        }
    } else {
        for node in elements.nodes.iter().filter(|n| &*n.role == name) {
            first.extend(node.first);
            last.extend(node.last);
        }
    }
    (first, last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_absences_inside_a_life_are_filled() {
        let cells = |text: &str| text.chars().map(|c| c == '#').collect::<Vec<_>>();
        let widths = [10; 9];
        let filled = |text: &str| filled(cells(text), &widths, 20);
        assert_eq!(filled(".#..#...#"), cells(".####...#"));
        assert_eq!(filled("..#......"), cells("..#......"));
    }
}
