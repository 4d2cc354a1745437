//! Checks of rates and gaps of topics: in every whole window, or in those that a rule selects.

use super::Judge;
use crate::base::rhythm::{CLOSING_NS, DISCOVERY_NS};
use crate::base::time::Span;
use crate::base::words;
use crate::gate::expectation::{At, TopicFacts, While, YamlPlace};
use crate::gate::facts::{Rate, TopicSilence};
use crate::gate::finding::{Finding, FindingKind};
use crate::gate::range::{During, Range};
use crate::graph::TopicId;

impl Judge<'_> {
    /// The findings on whether a topic's rate is in its range in the required share of windows.
    pub(super) fn rate(&self, topic: TopicId, facts: &TopicFacts, hz: &At<Range>) -> Vec<Finding> {
        let At { at, value: range } = *hz;
        let rates = self.judged(topic, facts);
        if rates.is_empty() {
            return self.no_window(topic, facts, at);
        }
        let low: Vec<Rate> = rates
            .iter()
            .filter(|r| range.is_above(r.at_most()))
            .copied()
            .collect();
        let high: Vec<Rate> = rates
            .iter()
            .filter(|r| range.is_below(r.at_least()))
            .copied()
            .collect();
        let allowed = rates.len() as f64 * (1.0 - facts.percent.unwrap_or(100.0) / 100.0);
        if (low.len() + high.len()) as f64 <= allowed {
            return Vec::new();
        }
        let lines = [
            (FindingKind::TopicRateLow, low),
            (FindingKind::TopicRateHigh, high),
        ];
        lines
            .iter()
            .filter_map(|(kind, bad)| self.off(topic, *kind, bad, rates.len(), range, at))
            .collect()
    }

    /// The findings on whether a topic's rate from its first to its last message is in its range.
    pub(super) fn mean(&self, topic: TopicId, facts: &TopicFacts, hz: &At<Range>) -> Vec<Finding> {
        let At { at, value: range } = *hz;
        let in_windows = facts.hz.as_ref().map(|hz| self.rate(topic, facts, hz));
        if in_windows.is_some_and(|found| !found.is_empty()) {
            return Vec::new();
        }
        let rates = if facts.during.is_none() && facts.whilst.is_none() {
            self.facts.mean(topic).into_iter().collect()
        } else {
            self.judged(topic, facts)
        };
        let (Some(first), Some(last)) = (rates.first(), rates.last()) else {
            return self.no_window(topic, facts, at);
        };
        let count: u64 = rates.iter().map(|r| r.count).sum();
        let nanos: i64 = rates.iter().map(|r| r.span.nanos()).sum();
        let mean = count as f64 / (nanos.max(1) as f64 / 1e9);
        if range.holds(mean) {
            return Vec::new();
        }
        let kind = if range.is_above(mean) {
            FindingKind::TopicRateLow
        } else {
            FindingKind::TopicRateHigh
        };
        let name = self.facts.topic(topic);
        let hz = words::rate(mean);
        let span = Span::new(first.span.start, last.span.end);
        let text = format!("{name} at {hz} from first to last message, expected {range}");
        let finding = Finding::new(kind, name, at, text)
            .saw(&hz, words::rate_range(range.from, range.to))
            .at(span)
            .detail(self.facts.stretch(span));
        vec![finding]
    }

    /// The findings on whether a topic's first message was in time.
    pub(super) fn first(
        &self,
        topic: TopicId,
        facts: &TopicFacts,
        within: &At<During>,
    ) -> Vec<Finding> {
        let whole = self.facts.mission.span;
        let Some(active) = self.facts.received(topic) else {
            return Vec::new();
        };
        let allowed = within.value.on(whole);
        // A topic present when the recorder starts has an unknown start time.
        let is_early =
            active.start < allowed.start && active.start.since(whole.start) > DISCOVERY_NS;
        if active.start <= allowed.end && !is_early {
            return Vec::new();
        }
        let name = self.facts.topic(topic);
        let clock = self.facts.clock(active.start);
        let expected = format!("within {}", self.facts.stretch(allowed));
        let text = format!("{name} began at {clock}, expected {expected}");
        let finding = Finding::new(FindingKind::TopicLate, name, within.at, text);
        let span = Span::new(whole.start, active.start);
        let mut finding = finding.saw(format!("at {clock}"), expected).at(span);
        finding.details.extend(Self::senders(facts));
        vec![finding]
    }

    /// The findings on whether a topic ended in the time in which it may.
    pub(super) fn last(
        &self,
        topic: TopicId,
        facts: &TopicFacts,
        may_end: &At<During>,
    ) -> Vec<Finding> {
        let whole = self.facts.mission.span;
        let Some(active) = self.facts.received(topic) else {
            return Vec::new();
        };
        let allowed = may_end.value.on(whole);
        let is_over = whole.end.since(active.end) <= CLOSING_NS;
        if is_over || allowed.start <= active.end && active.end <= allowed.end {
            return Vec::new();
        }
        let name = self.facts.topic(topic);
        let clock = self.facts.clock(active.end);
        let expected = format!("to end within {}", self.facts.stretch(allowed));
        let text = format!("{name} ended at {clock}, expected {expected}");
        let around = Span::new(active.end.plus(-CLOSING_NS), active.end.plus(CLOSING_NS));
        let mut finding = Finding::new(FindingKind::TopicGone, name, may_end.at, text)
            .saw(format!("ended at {clock}"), expected)
            .at(Span::new(active.end, whole.end));
        finding.details.extend(Self::senders(facts));
        finding.cause = self.facts.cause_for_topic(topic, around);
        vec![finding]
    }

    /// The findings if no window is checked: none for a condition that was never met, else that it is undecidable.
    fn no_window(&self, topic: TopicId, facts: &TopicFacts, at: YamlPlace) -> Vec<Finding> {
        if facts.whilst.is_some() {
            return Vec::new();
        }
        let name = self.facts.topic(topic);
        let text = format!("cannot tell the rate of {name}: it has no whole window to check");
        let finding = Finding::new(FindingKind::TopicRateLow, name, at, text).unknown();
        vec![finding.hint("use a shorter period: `period: 5s`, or `--period 5`")]
    }

    /// The windows in which a topic is checked.
    pub(super) fn judged(&self, topic: TopicId, facts: &TopicFacts) -> Vec<Rate> {
        let whole = self.facts.mission.span;
        let during = facts.during.map_or(whole, |d| d.on(whole));
        let mut rates = self.facts.rates(topic, facts.may_end.is_some(), during);
        if let Some(whilst) = &facts.whilst {
            let holds = self.holds(whilst);
            rates.retain(|rate| holds.get(rate.window) == Some(&true));
        }
        rates
    }

    /// Whether a condition is met, for each window.
    fn holds(&self, whilst: &While) -> Vec<bool> {
        let windows = &self.facts.mission.windows;
        let mut holds = vec![false; windows.len()];
        match whilst {
            While::Rate(pattern, range) => {
                for topic in self.facts.topics(pattern) {
                    let counts = self.facts.counts(topic).into_iter().zip(windows);
                    for (own, (count, window)) in holds.iter_mut().zip(counts) {
                        let seconds = window.span.nanos().max(1) as f64 / 1e9;
                        *own |= range.holds(count as f64 / seconds);
                    }
                }
            }
            While::Node(pattern) => {
                for (_, nodes) in self.facts.nodes(pattern) {
                    let lives = self.facts.lives(nodes);
                    for (own, window) in holds.iter_mut().zip(windows) {
                        let span = window.span;
                        let is_in = |l: &Span| l.start <= span.start && span.end <= l.end;
                        *own |= lives.iter().any(is_in);
                    }
                }
            }
        }
        holds
    }

    /// The finding for the windows in which a rate was out of range.
    fn off(
        &self,
        topic: TopicId,
        kind: FindingKind,
        bad: &[Rate],
        judged: usize,
        range: Range,
        at: YamlPlace,
    ) -> Option<Finding> {
        let (first, last) = (bad.first()?, bad.last()?);
        let name = self.facts.topic(topic);
        let span = Span::new(first.span.start, last.span.end);
        let count: u64 = bad.iter().map(|r| r.count).sum();
        let nanos: i64 = bad.iter().map(|r| r.span.nanos()).sum();
        let hz = words::rate(count as f64 / (nanos.max(1) as f64 / 1e9));
        let by = |a: &&Rate, b: &&Rate| a.hz().total_cmp(&b.hz());
        let (word, worst) = if kind == FindingKind::TopicRateLow {
            ("lowest", bad.iter().min_by(by)?)
        } else {
            ("highest", bad.iter().max_by(by)?)
        };
        let text = format!("{name} at {hz}, expected {range}");
        let detail = format!(
            "{} ({} of {}), {word} {} at {}, {}",
            self.facts.stretch(span),
            bad.len(),
            words::count(judged, "window"),
            words::rate(worst.hz()),
            self.facts.clock(worst.span.start),
            words::count(count, "message"),
        );
        let mut finding = Finding::new(kind, name, at, text)
            .saw(hz, words::rate_range(range.from, range.to))
            .at(span)
            .detail(detail);
        let around = Span::new(
            first.span.start.plus(-first.span.nanos() / 2),
            first.span.end,
        );
        finding.cause = self.facts.cause_for_topic(topic, around);
        Some(finding)
    }

    /// The findings on whether a topic was never silent for too long.
    pub(super) fn gap(&self, topic: TopicId, facts: &TopicFacts, most: &At<i64>) -> Vec<Finding> {
        let At { at, value: most } = *most;
        let whole = self.facts.mission.span;
        let during = facts.during.map_or(whole, |d| d.on(whole));
        let silences = self.facts.silences(topic, facts.may_end.is_some(), during);
        let longest = silences.iter().max_by_key(|silence| silence.nanos);
        let Some(TopicSilence { span, nanos }) = longest.filter(|s| s.nanos > most) else {
            return Vec::new();
        };
        let name = self.facts.topic(topic);
        let (seen, expected) = (words::duration(*nanos), words::duration(most));
        let text = format!("{name} was silent for {seen}, expected at most {expected}");
        let mut finding = Finding::new(FindingKind::TopicGap, name, at, text)
            .saw(seen, format!("at most {expected}"))
            .at(*span)
            .detail(format!("within {}", self.facts.stretch(*span)));
        finding.cause = self.facts.cause_for_topic(topic, *span);
        vec![finding]
    }
}
