//! The presence of each element of the graph in the cells of the activity, by which phases are cut.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::base::name::is_quiet;
use crate::base::time::{Span, Stamp};
use crate::graph::{Edge, Element, Elements, Node, Row, State, Topic};
use crate::mission::activity::{Activity, is_hidden_node};

/// The longest absence, as a part of the mission (one in so many), that does not count inside an element's life: a slow
/// topic has no message in some cells.
const FILLED: i64 = 50;

/// An element whose presence is recorded.
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

/// An element, and the cells in which it exists.
#[derive(Clone, Debug)]
pub(crate) struct Presence {
    pub(crate) subject: PresentThing,
    pub(crate) cells: Vec<bool>,
}

impl Presence {
    /// Whether it counts for the names of phases: nodes, or topics where there are only topics.
    pub(crate) fn counts(&self, topics: bool) -> bool {
        match self.subject {
            PresentThing::Node(_) => !topics,
            PresentThing::Topic(_) => topics,
            PresentThing::Publication(..) => false,
        }
    }
}

/// Whether phases are found in topics.
pub(crate) fn is_topics(present: &[Presence]) -> bool {
    present
        .iter()
        .any(|p| matches!(p.subject, PresentThing::Topic(_)))
}

/// Every element's presence, sorted: nodes by role and their publications that carry messages; topics with messages
/// where less than half of these have a known publisher. Housekeeping and recorders are left out.
pub(crate) fn presences(elements: &Elements, activity: &Activity) -> Vec<Presence> {
    let subjects = Subjects::new(elements, knows_publishers(elements, activity));
    let all = subjects.sorted();
    let [nodes, publishes, topics] = subjects.places(&all);
    let mut cells = vec![vec![false; activity.cells().len()]; all.len()];
    let mut see = |places: &[Option<usize>], what: fn(u32) -> Element, is: fn(&Row) -> bool| {
        for (id, place) in (0..).zip(places) {
            let Some(place) = *place else {
                continue;
            };
            let rows = activity.graphs.rows(what(id));
            rows.filter(|(_, row)| is(row))
                .for_each(|(at, _)| cells[place][at] = true);
        }
    };
    let carries = |row: &Row| matches!(row.state, State::Active | State::Latched);
    see(&nodes, Element::Node, |_| true);
    see(&publishes, Element::Publish, carries);
    see(&topics, Element::Topic, |row| row.count > Some(0));
    let widths: Vec<i64> = activity.cells().iter().map(Span::nanos).collect();
    let most = activity.span().nanos() / FILLED;
    let seen = all
        .into_iter()
        .zip(cells)
        .filter(|(_, cells)| cells.contains(&true));
    let filled = |(subject, cells): (&PresentThing, _)| Presence {
        subject: subject.clone(),
        cells: filled(cells, &widths, most),
    };
    seen.map(filled).collect()
}

/// The subject of each node, publication and topic in the activity, by id; `None` for those left out.
struct Subjects([Vec<Option<PresentThing>>; 3]);

impl Subjects {
    /// The subjects: nodes and their publications, or topics.
    fn new(elements: &Elements, knows_publishers: bool) -> Self {
        let told = |topic: &Topic| Some(topic.name.shared()).filter(|name| !is_quiet(name));
        if !knows_publishers {
            let topics = elements.topics.iter();
            let topics = topics.map(|topic| told(topic).map(PresentThing::Topic));
            return Self([Vec::new(), Vec::new(), topics.collect()]);
        }
        let role = |node: &Node| (!is_hidden_node(node)).then(|| Arc::clone(&node.role));
        let roles: Vec<Option<Arc<str>>> = elements.nodes.iter().map(role).collect();
        let publication = |edge: &Edge| {
            let role = roles.get(edge.node as usize)?.clone()?;
            let topic = elements.topics.get(edge.topic as usize)?;
            Some(PresentThing::Publication(role, told(topic)?))
        };
        let publishes = elements.publishes.iter().map(publication).collect();
        let nodes = roles
            .iter()
            .map(|role| role.clone().map(PresentThing::Node));
        Self([nodes.collect(), publishes, Vec::new()])
    }

    fn sorted(&self) -> Vec<&PresentThing> {
        let mut all: Vec<&PresentThing> = self.0.iter().flatten().flatten().collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The places of all subjects in the sorted list.
    fn places(&self, all: &[&PresentThing]) -> [Vec<Option<usize>>; 3] {
        let place = |subject: &PresentThing| all.binary_search(&subject).ok();
        self.0.each_ref().map(|list| {
            let places = list.iter().map(|subject| place(subject.as_ref()?));
            places.collect()
        })
    }
}

/// Whether at least half of the messages are on topics of which some publisher is known.
pub(crate) fn knows_publishers(elements: &Elements, activity: &Activity) -> bool {
    let graphs = &activity.graphs;
    // Per topic the cells in which some publisher is known; of most topics of a large mission none.
    let mut heard = vec![Vec::new(); elements.topics.len()];
    for (id, edge) in (0..).zip(&elements.publishes) {
        let Some(heard) = heard.get_mut(edge.topic as usize) else {
            continue;
        };
        if !edge.evidence.is_guess() {
            heard.resize(graphs.len(), false);
            let rows = graphs.rows(Element::Publish(id));
            rows.for_each(|(at, _)| heard[at] = true);
        }
    }
    let (mut all, mut known) = (0_u64, 0_u64);
    for ((id, topic), heard) in (0..).zip(&elements.topics).zip(&heard) {
        if is_quiet(topic.name.as_str()) {
            continue;
        }
        for (at, row) in graphs.rows(Element::Topic(id)) {
            let count = row.count.unwrap_or(0);
            all = all.saturating_add(count);
            if heard.get(at) == Some(&true) {
                known = known.saturating_add(count);
            }
        }
    }
    known >= all - known
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
type Ends = Vec<(Option<Stamp>, Option<Stamp>)>;

/// The exact first and last signs by role, or by topic.
pub(crate) fn ends(elements: &Elements, topics: bool) -> BTreeMap<&str, Ends> {
    let mut ends: BTreeMap<&str, Ends> = BTreeMap::new();
    if topics {
        for topic in &elements.topics {
            let of = ends.entry(topic.name.as_str()).or_default();
            of.push((topic.first, topic.last));
        }
    } else {
        for node in &elements.nodes {
            let of = ends.entry(&*node.role).or_default();
            of.push((node.first, node.last));
        }
    }
    ends
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
