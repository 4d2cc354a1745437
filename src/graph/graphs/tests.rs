//! Tests that graphs read back are those written.

use proptest::prelude::*;

use super::*;
use crate::base::time::Stamp;
use crate::evidence::Confidence;
use crate::graph::{ElementState, Measures, NodeId, State, TopicId};

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

/// A state of some element of a kind, with the numbers that this kind has.
fn state(kind: fn(usize) -> Element) -> impl Strategy<Value = ElementState> {
    let lifecycle = prop_oneof![
        Just(None),
        Just(Some(Arc::from("active"))),
        Just(Some(Arc::from("x")))
    ];
    let numbers = (count(), count(), number(), number(), number(), measures());
    (look(), numbers, lifecycle).prop_map(move |((state, confidence), numbers, lifecycle)| {
        let (count, bytes, hz, median_period_s, max_gap_s, measures) = numbers;
        let all = ElementState {
            hz,
            ..ElementState::new(kind(0), state, confidence)
        };
        match all.what {
            Element::Node(_) => ElementState { lifecycle, ..all },
            Element::Topic(_) => ElementState {
                count: Some(count.unwrap_or(0)),
                bytes,
                median_period_s,
                max_gap_s,
                measures,
                ..all
            },
            _ => ElementState {
                count,
                bytes,
                measures,
                ..all
            },
        }
    })
}

/// The states of some of three elements of a kind.
fn some(kind: fn(usize) -> Element) -> impl Strategy<Value = Vec<ElementState>> {
    let one = proptest::option::of(state(kind));
    proptest::collection::vec(one, 3).prop_map(move |list| {
        let there = (0..).zip(list).filter_map(|(id, state)| {
            let what = kind(id);
            Some(ElementState { what, ..state? })
        });
        there.collect()
    })
}

pub(crate) fn graph() -> impl Strategy<Value = Graph> {
    let kinds = Element::KINDS.map(some);
    kinds.prop_map(|states| Graph {
        states: states.concat(),
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
            let states = now.iter().filter_map(|(what, row): (&Element, &Option<Row>)| {
                row.as_ref().map(|row| row.state(*what, *span, all.lifecycle(row)))
            });
            prop_assert_eq!(states.collect::<Vec<_>>(), put.states.clone());
        }
        let topic = Element::Topic(TopicId(1));
        let of_topic: Vec<_> = all.rows(topic).map(|(at, row)| row.state(topic, graphs[at].0, None)).collect();
        let put = graphs.iter().filter_map(|(_, g)| g.get(topic));
        prop_assert_eq!(of_topic, put.cloned().collect::<Vec<_>>());
    }
}

#[test]
fn constant_states_take_no_memory() {
    let second = |n: i64| Span::new(Stamp(n * 1_000_000_000), Stamp((n + 1) * 1_000_000_000));
    let topic = ElementState {
        count: Some(10),
        hz: Some(10.0),
        median_period_s: Some(0.1),
        max_gap_s: Some(0.1),
        ..ElementState::new(
            Element::Topic(TopicId(0)),
            State::Active,
            Confidence::Measured,
        )
    };
    let graph = Graph {
        states: vec![topic],
    };
    let all: Graphs = (0..100_000).map(|n| (second(n), graph.clone())).collect();
    assert!(all.columns.0[1][0].bytes.len() < 32, "{:?}", all.columns);
}

#[test]
fn memory_is_proportional_to_the_states_of_elements() {
    let node = |id| ElementState::new(Element::Node(id), State::Active, Confidence::Stated);
    let graph = Graph {
        states: (0..1000).map(NodeId).map(node).collect(),
    };
    let span = Span::new(Stamp(0), Stamp(1));
    let all: Graphs = [(span, graph)].into_iter().collect();
    assert_eq!(all.columns.0[0].capacity(), 1000);
}
