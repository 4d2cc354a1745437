//! Checks of optional measures of topics: age, bytes and losses of messages, in each window.

use std::collections::BTreeSet;

use super::Judge;
use crate::base::time::Span;
use crate::base::words;
use crate::gate::expectation::{At, TopicFacts};
use crate::gate::finding::Finding;
use crate::gate::measure::Measure;
use crate::gate::range::Range;
use crate::graph::TopicId;

impl Judge<'_> {
    /// The finding on whether a measure of a topic is in its range in the required share of windows.
    pub(super) fn measured(
        &self,
        topic: TopicId,
        measure: &Measure,
        range: &At<Range>,
        facts: &TopicFacts,
    ) -> Option<Finding> {
        let At { at, value: range } = *range;
        let name = self.facts.topic(topic);
        let key = measure.key;
        let judged = self.judged(topic, facts);
        let windows: BTreeSet<usize> = judged.iter().map(|rate| rate.window).collect();
        let rows = self.facts.rows(topic);
        let rows = rows.filter(|(window, _)| windows.contains(&window.index));
        let known: Vec<(Span, f64)> = rows
            .filter_map(|(window, row)| Some((window.span, (measure.of)(&row, window.span)?)))
            .collect();
        if known.is_empty() {
            let text = format!("cannot tell the {key} of {name}: this bag does not record it");
            let hint = "enable topic statistics, or record `/statistics`";
            return Some(
                Finding::new(measure.kind, name, at, text)
                    .unknown()
                    .hint(hint),
            );
        }
        let bad: Vec<&(Span, f64)> = known.iter().filter(|(_, v)| !range.holds(*v)).collect();
        if bad.len() as f64 <= known.len() as f64 * (1.0 - facts.percent.unwrap_or(100.0) / 100.0) {
            return None;
        }
        let (from, to) = (range.from.unwrap_or(0.0), range.to.unwrap_or(f64::INFINITY));
        let off = |value: f64| (value - to).max(from - value);
        let worst = bad.iter().max_by(|a, b| off(a.1).total_cmp(&off(b.1)))?;
        let span = Span::new(bad.first()?.0.start, bad.last()?.0.end);
        let (seen, expected) = ((measure.shown)(worst.1), measure.range_shown(range));
        let text = format!("{name} has {key} {seen}, expected {expected}");
        let detail = format!(
            "{} ({} of {}), worst at {}",
            self.facts.stretch(span),
            bad.len(),
            words::count(known.len(), "window"),
            self.facts.clock(worst.0.start),
        );
        let mut finding = Finding::new(measure.kind, name, at, text)
            .saw(seen, expected)
            .at(span)
            .detail(detail);
        finding.cause = self
            .facts
            .cause_for_topic(topic, Span::new(span.start, span.start));
        Some(finding)
    }
}
