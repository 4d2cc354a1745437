//! A mission in other windows, each of which joins those that it overlaps: for pictures of its reconfigurations.

use std::collections::BTreeMap;

use super::{Mission, Window};
use crate::base::time::{Span, Stamp};
use crate::graph::window::cut_at;
use crate::graph::{Element, ElementState, Graph};

impl Mission {
    /// The mission in windows from its start to the first of `cuts`, from there to the next, and so on to its end.
    ///
    /// Changes are those of the log, at their exact times; states are those of the windows that overlap a new one, and
    /// rates are not those of the new windows.
    pub(crate) fn joined(&self, cuts: &[Stamp]) -> Self {
        let spans = cut_at(self.span, cuts.iter().copied());
        let mut all: Vec<BTreeMap<Element, ElementState>> = vec![BTreeMap::new(); spans.len()];
        let mut messages = vec![0_u64; spans.len()];
        for (window, graph) in self.each() {
            let first = spans.partition_point(|span| span.end <= window.span.start);
            let last = spans.partition_point(|span| span.start < window.span.end);
            for at in first..last {
                messages[at] = messages[at].saturating_add(window.messages);
                for state in &graph.states {
                    let known = all[at].entry(state.what);
                    let known = known.and_modify(|known| join(known, state));
                    known.or_insert_with(|| state.clone());
                }
            }
        }
        let states = all.into_iter().map(|states| states.into_values().collect());
        let graphs = states.map(|states| Graph { states });
        let graphs = spans.iter().copied().zip(graphs);
        let windows = spans.iter().zip(messages).enumerate();
        let window = |(index, (span, messages)): (usize, (&Span, u64))| Window {
            index,
            span: *span,
            messages,
            ..Window::default()
        };
        let mut mission = Self {
            graphs: graphs.collect(),
            windows: windows.map(window).collect(),
            ..self.clone()
        };
        mission.explain();
        mission
    }
}

/// Adds the state of a later window.
fn join(known: &mut ElementState, state: &ElementState) {
    known.state = known.state.min(state.state);
    known.confidence = known.confidence.min(state.confidence);
    let counts = known.count.zip(state.count);
    known.count = counts.map(|(a, b)| a.saturating_add(b));
    known.hz = known.hz.zip(state.hz).map(|(a, b)| a.max(b));
    known.lifecycle.clone_from(&state.lifecycle);
}
