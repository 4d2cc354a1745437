//! What holds for every graph and every mission, tried on random ones.

use bagreel::internals::evidence::Degree;
use bagreel::internals::graph::diff::{apply, diff};
use bagreel::internals::graph::{EdgeState, Graph, NodeState, State, TopicState};
use proptest::collection::btree_map;
use proptest::prelude::*;

fn state() -> impl Strategy<Value = State> {
    prop::sample::select(State::ALL.to_vec())
}

fn degree() -> impl Strategy<Value = Degree> {
    prop::sample::select(Degree::ALL.to_vec())
}

fn edges() -> impl Strategy<Value = Vec<EdgeState>> {
    let one = (state(), degree(), prop::option::of(0..500_u64));
    btree_map(0..40_u32, one, 0..20).prop_map(|edges| {
        let made = edges
            .into_iter()
            .map(|(id, (state, degree, count))| EdgeState {
                id,
                state,
                degree,
                count,
                hz: count.map(|n| n as f64 / 10.0),
            });
        made.collect()
    })
}

fn graph() -> impl Strategy<Value = Graph> {
    let nodes = btree_map(0..30_u32, (state(), degree()), 0..15);
    let topics = btree_map(0..30_u32, (state(), degree(), 0..500_u64), 0..15);
    (nodes, topics, edges(), edges()).prop_map(|(nodes, topics, publishes, subscribes)| Graph {
        nodes: nodes
            .into_iter()
            .map(|(id, (state, degree))| NodeState {
                id,
                state,
                degree,
                hz: None,
                lifecycle: None,
            })
            .collect(),
        topics: topics
            .into_iter()
            .map(|(id, (state, degree, count))| TopicState {
                id,
                state,
                degree,
                count,
                bytes: None,
                hz: Some(count as f64 / 10.0),
                median_period_s: None,
                max_gap_s: None,
            })
            .collect(),
        publishes,
        subscribes,
    })
}

proptest! {
    #[test]
    fn a_graph_does_not_differ_from_itself(graph in graph()) {
        prop_assert!(diff(&graph, &graph).is_empty());
    }

    #[test]
    fn a_diff_turns_one_graph_into_the_other(before in graph(), after in graph()) {
        let diff = diff(&before, &after);
        prop_assert_eq!(diff.is_empty(), before == after);
        prop_assert_eq!(apply(&before, &diff), after);
    }
}
