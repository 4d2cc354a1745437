//! Ramps: merges many consecutive short phases that only add or only remove, such as a fleet that joins one by one.

use super::Configuration;
use crate::base::time::Span;

/// The fewest phases of a ramp: fewer are told apart one by one, and a launch in three steps is not a fleet that joins.
const FEWEST: usize = 5;
/// The share of the mission, in hundredths, that each phase of a ramp must stay below: five of them are less than half of it, and a
/// phase may not be shorter than 5 anyway.
const SHORT: i64 = 8;

/// The effect of a phase on the one before it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum PhaseEffect {
    Up,
    Down,
}

/// The phases with ramps merged, and flags of the ramps. A ramp's configuration is its last one.
pub(crate) fn joined(
    spans: &[Span],
    found: &[Configuration],
    whole: i64,
) -> (Vec<Span>, Vec<Configuration>, Vec<bool>) {
    let ways: Vec<Option<PhaseEffect>> = (0..found.len())
        .map(|k| {
            let short = i128::from(spans[k].nanos()) * 100 < i128::from(whole) * i128::from(SHORT);
            let before = &found[k.checked_sub(1)?].names;
            let now = &found[k].names;
            match (short, before.is_subset(now), now.is_subset(before)) {
                (true, true, false) => Some(PhaseEffect::Up),
                (true, false, true) => Some(PhaseEffect::Down),
                _ => None,
            }
        })
        .collect();
    let (mut out, mut kept, mut ramps) = (Vec::new(), Vec::new(), Vec::new());
    let mut at = 0;
    for run in ways.chunk_by(|a, b| a.is_some() && a == b) {
        let end = at + run.len();
        if run[0].is_some() && run.len() >= FEWEST {
            out.push(Span::new(spans[at].start, spans[end - 1].end));
            kept.push(found[end - 1].clone());
            ramps.push(true);
        } else {
            out.extend(&spans[at..end]);
            kept.extend(found[at..end].iter().cloned());
            ramps.extend(run.iter().map(|_| false));
        }
        at = end;
    }
    (out, kept, ramps)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::base::time::Stamp;

    /// The lengths of the phases that are left, of phases with this number of nodes and this length.
    fn lengths(phases: &[(usize, i64)]) -> Vec<(i64, bool)> {
        let mut start = Stamp(0);
        let span = |(_, length): &(usize, i64)| {
            let span = Span::new(start, start.plus(*length));
            start = span.end;
            span
        };
        let spans: Vec<Span> = phases.iter().map(span).collect();
        let whole = spans.last().unwrap().end.0;
        let found = phases.iter().map(|(nodes, _)| Configuration {
            names: (0..*nodes).map(|n| Arc::from(format!("/n{n}"))).collect(),
            ..Configuration::default()
        });
        let (spans, _, ramps) = joined(&spans, &found.collect::<Vec<_>>(), whole);
        spans.iter().map(Span::nanos).zip(ramps).collect()
    }

    #[test]
    fn a_fleet_that_joins_one_by_one_is_a_ramp() {
        let fleet = [(1, 50), (2, 5), (3, 5), (4, 5), (5, 5), (6, 5), (6, 25)];
        assert_eq!(lengths(&fleet), [(50, false), (25, true), (25, false)]);
    }

    #[test]
    fn four_steps_or_a_long_one_are_not_a_ramp() {
        assert_eq!(lengths(&[(1, 80), (2, 5), (3, 5), (4, 5), (5, 5)]).len(), 5);
        let long = [(1, 40), (2, 5), (3, 5), (4, 35), (5, 5), (6, 5), (7, 5)];
        assert_eq!(lengths(&long).len(), 7);
    }
}
