//! The activity of a mission as JSON, so that phases and figures from a file equal those from its bag.
//!
//! ```text
//! "activity": {"bounds_ns": [0, 2000000000, …],
//!   "topics": [{"name": "/scan", "sending": [[17, 90000000], …], "in": {"windows": [[0, 44]], …}}, …], …}
//! ```
//!
//! `bounds_ns` are the starts of the cells and the end of the last. `sending` are the intervals of sending, first
//! message to last plus 1 ns, and `pauses` the longest pauses, from message to message; both are present where single
//! messages were read. `in` is the state of an element in the cells, in the columns of the form `runs`: its `windows`
//! are cells.

use serde::Serialize;
use serde::ser::{SerializeMap as _, Serializer};

use super::names::Ids;
use super::raw::RawState;
use super::rows::{RunRows, ends};
use super::runs::{self, In, RawElements, WithColumns};
use super::write::List;
use crate::base::time::{Span, Stamp};
use crate::graph::sending::Sending;
use crate::graph::{Edge, Element, Elements};
use crate::mission::activity::{Activity, MOST_CELLS};

/// The activity in the form for writing.
pub(super) struct ActivityOf<'a> {
    activity: &'a Activity,
    elements: &'a Elements,
}

impl<'a> ActivityOf<'a> {
    pub(super) fn new(activity: &'a Activity, elements: &'a Elements) -> Self {
        Self { activity, elements }
    }

    fn seen<E>(&self, what: Element, element: E) -> WithColumns<'_, E> {
        let seen = In {
            what,
            graphs: &self.activity.graphs,
        };
        WithColumns { element, seen }
    }
}

#[derive(Serialize)]
struct ElementSending<'a> {
    name: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    sending: Option<RunRows<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pauses: Option<RunRows<'a>>,
}

#[derive(Serialize)]
struct EdgeSending<'a> {
    node: &'a str,
    topic: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    sending: Option<RunRows<'a>>,
}

impl<'a> EdgeSending<'a> {
    fn new(edge: &Edge, elements: &'a Elements, sending: Option<&'a Vec<Span>>) -> Self {
        let (node, topic) = ends(edge, elements);
        let sending = sending.map(|spans| RunRows(spans));
        Self {
            node,
            topic,
            sending,
        }
    }
}

impl Serialize for ActivityOf<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self { activity, elements } = self;
        let (cells, sending) = (activity.cells(), &activity.sending);
        let mut map = serializer.serialize_map(None)?;
        let starts = cells.iter().map(|cell| cell.start.0);
        let end = cells.last().map(|cell| cell.end.0);
        map.serialize_entry("bounds_ns", &List(starts.chain(end)))?;
        let nodes = (0..).zip(&elements.nodes).map(|(id, node)| {
            let named = ElementSending {
                name: node.name.as_str(),
                sending: None,
                pauses: None,
            };
            self.seen(Element::Node(id), named)
        });
        map.serialize_entry("nodes", &List(nodes))?;
        let topics = (0..).zip(&elements.topics).map(|(id, topic)| {
            let spans = sending.topics.get(id as usize);
            let pauses = sending.pauses.get(id as usize);
            let told = spans.map(|spans| RunRows(spans));
            let named = ElementSending {
                name: topic.name.as_str(),
                sending: told,
                pauses: pauses.map(|spans| RunRows(spans)),
            };
            self.seen(Element::Topic(id), named)
        });
        map.serialize_entry("topics", &List(topics))?;
        let publishes = (0..).zip(&elements.publishes).map(|(id, edge)| {
            let spans = sending.publishes.get(id as usize);
            self.seen(
                Element::Publish(id),
                EdgeSending::new(edge, elements, spans),
            )
        });
        map.serialize_entry("publishes", &List(publishes))?;
        let subscribes = (0..).zip(&elements.subscribes).map(|(id, edge)| {
            self.seen(
                Element::Subscribe(id),
                EdgeSending::new(edge, elements, None),
            )
        });
        map.serialize_entry("subscribes", &List(subscribes))?;
        map.end()
    }
}

/// Reads the activity of a mission with these names.
///
/// # Errors
/// The mistake in the cells, or in the intervals of sending.
pub(super) fn read(bounds: &[i64], raw: &RawElements, ids: &Ids) -> Result<Activity, String> {
    let spans = cells(bounds)?;
    Ok(Activity {
        graphs: runs::graphs(raw, ids, &spans),
        sending: sending(raw, ids)?,
    })
}

fn cells(bounds: &[i64]) -> Result<Vec<Span>, String> {
    let pairs = bounds.windows(2);
    let cells = pairs.map(|pair| Span {
        start: Stamp(pair[0]),
        end: Stamp(pair[1]),
    });
    let cells: Vec<Span> = cells.collect();
    if cells.iter().any(|cell| cell.start >= cell.end) {
        return Err("the bounds of its activity do not ascend".to_owned());
    }
    if i64::try_from(cells.len()).is_ok_and(|many| many > MOST_CELLS) {
        return Err(format!(
            "its activity has {} cells, and may have {MOST_CELLS}",
            cells.len()
        ));
    }
    Ok(cells)
}

fn sending(raw: &RawElements, ids: &Ids) -> Result<Sending, String> {
    let topics = raw
        .topics
        .iter()
        .map(|t| (ids.of_topic(&t.element.name), &t.element.rest));
    let publishes = raw
        .publishes
        .iter()
        .map(|e| (ids.of_publish(&e.element), &e.element.rest));
    Ok(Sending {
        topics: stretches(topics.clone(), ids.topics(), RawState::sending)?,
        pauses: stretches(topics, ids.topics(), RawState::pauses)?,
        publishes: stretches(publishes, ids.publishes(), RawState::sending)?,
    })
}

/// The intervals by id; an empty list where there are none at all.
fn stretches<'a>(
    raw: impl Iterator<Item = (u32, &'a RawState)>,
    many: usize,
    spans: impl Fn(&RawState) -> Option<Vec<Span>>,
) -> Result<Vec<Vec<Span>>, String> {
    let told = raw.filter_map(|(id, state)| Some((id, spans(state)?)));
    let mut all = Vec::new();
    for (id, spans) in told {
        let disjoint = |pair: &[Span]| pair[0].end <= pair[1].start;
        if !spans.windows(2).all(disjoint) {
            return Err("stretches of sending in its activity overlap".to_owned());
        }
        all.resize(many, Vec::new());
        all[id as usize] = spans;
    }
    Ok(all)
}
