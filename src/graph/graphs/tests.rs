//! Tests that graphs read back are those written.

use proptest::prelude::*;

use super::*;
use crate::base::time::Stamp;
use crate::evidence::Confidence;
use crate::graph::{EdgeId, Measures, NodeId, State, TopicId};

fn number() -> impl Strategy<Value = Option<f64>> {
    prop_oneof![
        Just(None),
        Just(Some(0.1)),
        (0..2_000_000_000_i64).prop_map(|halves| Some(halves as f64 / 2.0 / 1e9)),
        // With more digits, JSON would read another number than it wrote.
        (0..1_000_000_u32).prop_map(|n| Some(f64::from(n) * 1024.0)),
    ]
}

fn count() -> impl Strategy<Value = Option<u64>> {
    prop_oneof![
        Just(None),
        Just(Some(10)),
        (0..20_u64).prop_map(Some),
        any::<u64>().prop_map(Some),
        Just(Some(u64::MAX)),
    ]
}

fn look() -> impl Strategy<Value = (State, Confidence)> {
    (0..4_usize, 0..4_usize)
        .prop_map(|(state, confidence)| (State::ALL[state], Confidence::ALL[confidence]))
}

fn measures() -> impl Strategy<Value = Measures> {
    (count(), number(), number()).prop_map(|(drops, jitter_s, age_s)| Measures {
        drops,
        jitter_s,
        age_s,
    })
}

fn topic() -> impl Strategy<Value = TopicState> {
    (
        look(),
        count(),
        count(),
        number(),
        number(),
        number(),
        measures(),
    )
        .prop_map(
            |((state, confidence), count, bytes, hz, median_period_s, max_gap_s, measures)| {
                TopicState {
                    id: TopicId(0),
                    state,
                    confidence,
                    count: count.unwrap_or(0),
                    bytes,
                    hz,
                    median_period_s,
                    max_gap_s,
                    measures,
                }
            },
        )
}

fn node() -> impl Strategy<Value = NodeState> {
    let lifecycle = prop_oneof![
        Just(None),
        Just(Some(Arc::from("active"))),
        Just(Some(Arc::from("x")))
    ];
    (look(), number(), lifecycle).prop_map(|((state, confidence), hz, lifecycle)| NodeState {
        id: NodeId(0),
        state,
        confidence,
        hz,
        lifecycle,
    })
}

fn edge() -> impl Strategy<Value = EdgeState> {
    (look(), count(), number(), count(), measures()).prop_map(
        |((state, confidence), count, hz, bytes, measures)| EdgeState {
            id: EdgeId(0),
            state,
            confidence,
            count,
            hz,
            bytes,
            measures,
        },
    )
}

/// Some of three elements, by id.
fn some<T: std::fmt::Debug + Clone>(
    one: impl Strategy<Value = T> + 'static,
    number: impl Fn(&mut T, u32) + Clone + 'static,
) -> impl Strategy<Value = Vec<T>> {
    proptest::collection::vec(proptest::option::of(one), 3).prop_map(move |list| {
        let there = (0..).zip(list).filter_map(|(id, state)| Some((id, state?)));
        let with_id = |(id, mut state): (u32, T)| {
            number(&mut state, id);
            state
        };
        there.map(with_id).collect()
    })
}

pub(crate) fn graph() -> impl Strategy<Value = Graph> {
    let nodes = some(node(), |state, id| state.id = NodeId(id));
    let topics = some(topic(), |state, id| state.id = TopicId(id));
    let edges = || some(edge(), |state: &mut EdgeState, id| state.id = EdgeId(id));
    (nodes, topics, edges(), edges()).prop_map(|(nodes, topics, publishes, subscribes)| Graph {
        nodes,
        topics,
        publishes,
        subscribes,
    })
}

proptest! {
    #[test]
    fn stored_graphs_round_trip(list in proptest::collection::vec((graph(), 1..4_usize, 1..5_000_000_000_i64), 0..12)) {
        // Some windows repeat the one before; some are shorter than others.
        let mut at = Stamp(0);
        let mut graphs: Vec<(Span, Graph)> = Vec::new();
        for (graph, times, length) in list {
            for _ in 0..times {
                graphs.push((Span::new(at, at.plus(length)), graph.clone()));
                at = at.plus(length);
            }
        }
        let all: Graphs = graphs.iter().cloned().collect();
        prop_assert_eq!(all.len(), graphs.len());
        for (got, (_, put)) in all.iter().zip(&graphs) {
            prop_assert_eq!(&got, put);
        }
        if let Some((_, last)) = graphs.last() {
            prop_assert_eq!(&all.get(graphs.len() - 1).unwrap(), last);
        }
        let (mut walk, mut now) = (all.walk(), std::collections::BTreeMap::new());
        for (span, put) in &graphs {
            walk.next(|what, row| {
                now.insert(what, row);
            });
            let topics = now.iter().filter_map(|(what, row)| match (what, row) {
                (Element::Topic(id), Some(row)) => Some(row.topic(*id, *span)),
                _ => None,
            });
            prop_assert_eq!(topics.collect::<Vec<_>>(), put.topics.clone());
        }
        let of_topic: Vec<_> = all.rows(Element::Topic(TopicId(1))).map(|(at, row)| row.topic(TopicId(1), graphs[at].0)).collect();
        let put = graphs.iter().flat_map(|(_, g)| g.topics.iter().filter(|t| t.id == TopicId(1)));
        prop_assert_eq!(of_topic, put.cloned().collect::<Vec<_>>());
    }
}

#[test]
fn constant_states_take_no_memory() {
    let second = |n: i64| Span::new(Stamp(n * 1_000_000_000), Stamp((n + 1) * 1_000_000_000));
    let topic = TopicState {
        id: TopicId(0),
        state: State::Active,
        confidence: Confidence::Measured,
        count: 10,
        bytes: None,
        hz: Some(10.0),
        median_period_s: Some(0.1),
        max_gap_s: Some(0.1),
        measures: Measures::default(),
    };
    let graph = Graph {
        topics: vec![topic],
        ..Graph::default()
    };
    let all: Graphs = (0..100_000).map(|n| (second(n), graph.clone())).collect();
    assert!(all.columns.0[1][0].len() < 32, "{:?}", all.columns);
}

#[test]
fn memory_is_proportional_to_the_states_of_elements() {
    let node = |id| NodeState {
        id,
        state: State::Active,
        confidence: Confidence::Stated,
        hz: None,
        lifecycle: None,
    };
    let graph = Graph {
        nodes: (0..1000).map(NodeId).map(node).collect(),
        ..Graph::default()
    };
    let span = Span::new(Stamp(0), Stamp(1));
    let all: Graphs = [(span, graph)].into_iter().collect();
    assert_eq!(all.columns.0[0].capacity(), 1000);
}
