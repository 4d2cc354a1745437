//! Writer of every element with its columns.

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::super::rows::{EdgeOf, NodeOf, TopicOf};
use super::super::write::List;
use super::columns::{JsonColumn, JsonRate};
use crate::graph::{Element, Graphs};
use crate::mission::Mission;

/// Writes the lists of all elements into the map of the mission.
pub(crate) fn elements<M: SerializeMap>(mission: &Mission, map: &mut M) -> Result<(), M::Error> {
    let all = &mission.elements;
    let seen = |what| In {
        what,
        graphs: &mission.graphs,
    };
    let nodes = (0..).zip(&all.nodes).map(|(id, node)| WithColumns {
        element: NodeOf::new(node),
        seen: seen(Element::Node(id)),
    });
    map.serialize_entry("nodes", &List(nodes))?;
    let topics = (0..).zip(&all.topics).map(|(id, topic)| WithColumns {
        element: TopicOf::new(topic),
        seen: seen(Element::Topic(id)),
    });
    map.serialize_entry("topics", &List(topics))?;
    let publishes = (0..).zip(&all.publishes).map(|(id, edge)| WithColumns {
        element: EdgeOf::new(edge, all),
        seen: seen(Element::Publish(id)),
    });
    map.serialize_entry("publishes", &List(publishes))?;
    let subscribes = (0..).zip(&all.subscribes).map(|(id, edge)| WithColumns {
        element: EdgeOf::new(edge, all),
        seen: seen(Element::Subscribe(id)),
    });
    map.serialize_entry("subscribes", &List(subscribes))
}

/// An element, with its states and their windows.
#[derive(Serialize)]
struct WithColumns<'a, E> {
    #[serde(flatten)]
    element: E,
    #[serde(rename = "in")]
    seen: In<'a>,
}

/// The windows in which an element exists, with its states in them.
struct In<'a> {
    what: Element,
    graphs: &'a Graphs,
}

impl Serialize for In<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Columns::of(self.graphs, self.what).serialize(serializer)
    }
}

#[derive(Default, Serialize)]
struct Columns<'a> {
    windows: Vec<(usize, usize)>,
    state: JsonColumn<&'static str>,
    degree: JsonColumn<&'static str>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    sent: JsonColumn<Option<u64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    count: JsonColumn<Option<u64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    bytes: JsonColumn<Option<u64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    median_period_s: JsonColumn<Option<f64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    max_gap_s: JsonColumn<Option<f64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    drops: JsonColumn<Option<u64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    jitter_s: JsonColumn<Option<f64>>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    age_s: JsonColumn<Option<f64>>,
    #[serde(skip_serializing_if = "is_counted")]
    hz: JsonColumn<JsonRate>,
    #[serde(skip_serializing_if = "JsonColumn::is_plain")]
    lifecycle: JsonColumn<Option<&'a str>>,
}

fn is_counted(rates: &JsonColumn<JsonRate>) -> bool {
    rates.0.iter().all(|(rate, _)| *rate == JsonRate::Counted)
}

impl<'a> Columns<'a> {
    fn of(graphs: &'a Graphs, what: Element) -> Self {
        let mut all = Self::default();
        for (at, row) in graphs.rows(what) {
            match all.windows.last_mut() {
                Some((_, last)) if *last + 1 == at => *last = at,
                _ => all.windows.push((at, at)),
            }
            all.state.push(row.state.word());
            all.degree.push(row.degree.word());
            match what {
                Element::Node(_) => all.sent.push(row.count),
                _ => all.count.push(row.count),
            }
            all.bytes.push(row.bytes);
            all.median_period_s.push(row.median.value());
            all.max_gap_s.push(row.gap.value());
            all.drops.push(row.drops);
            all.jitter_s.push(row.jitter.value());
            all.age_s.push(row.age.value());
            all.hz.push(JsonRate::of(&row));
            all.lifecycle.push(graphs.lifecycle(&row));
        }
        all
    }
}
