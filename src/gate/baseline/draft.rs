//! The facts that runs have in common, by name: those that hold in each of them, widened by no more than noise needs.

use std::collections::{BTreeMap, BTreeSet};

use super::{list, mapping, scalar};
use crate::base::rhythm::{CLOSING_NS, FEWEST};
use crate::evidence::Degree;
use crate::gate::facts::{Facts, Rate};
use crate::gate::pattern::Pattern;
use crate::gate::range::Range;
use crate::graph::{NodeId, TopicId};
use crate::mission::Mission;
use crate::mission::ledger::Kind;

/// The share by which a rate may differ from run to run.
const SHARE: f64 = 0.1;
/// The number of times the spread between windows by which a rate may differ besides.
const SPREADS: f64 = 3.0;

/// The facts that hold in all runs.
#[derive(Debug, Default)]
pub(crate) struct Draft {
    pub(crate) nodes: BTreeMap<String, NodeLine>,
    pub(crate) topics: BTreeMap<String, TopicLine>,
}

/// The facts that hold of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct NodeLine {
    pub(crate) optional: bool,
    pub(crate) may_end: bool,
    pub(crate) restarts: usize,
    pub(crate) lifecycle: Option<String>,
}

/// The facts that hold of a topic.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TopicLine {
    pub(crate) optional: bool,
    pub(crate) may_end: bool,
    pub(crate) kind: Option<String>,
    pub(crate) by: Option<BTreeSet<String>>,
    pub(crate) to: BTreeSet<String>,
    pub(crate) hz: Option<Range>,
    pub(crate) is_latched: bool,
}

impl NodeLine {
    /// The text behind the name: its facts as a mapping of YAML.
    pub(crate) fn text(&self) -> String {
        let mut pairs = Vec::new();
        if let Some(state) = &self.lifecycle {
            pairs.push(("lifecycle", scalar(state)));
        }
        if self.may_end {
            pairs.push(("may_end", "true".to_owned()));
        }
        if self.optional {
            pairs.push(("optional", "true".to_owned()));
        }
        pairs.push(("restarts", format!("..{}", self.restarts)));
        mapping(&pairs)
    }
}

impl TopicLine {
    /// The text behind the name: its facts as a mapping of YAML.
    pub(crate) fn text(&self) -> String {
        let mut pairs = Vec::new();
        if let Some(kind) = &self.kind {
            pairs.push(("type", scalar(kind)));
        }
        if let Some(by) = &self.by {
            pairs.push(("by", list(by.iter())));
        }
        if !self.to.is_empty() {
            pairs.push(("to", list(self.to.iter())));
        }
        if let Some(hz) = &self.hz {
            pairs.push(("hz", hz.to_string()));
        }
        if self.may_end && self.hz.is_some() {
            pairs.push(("may_end", "true".to_owned()));
        }
        if self.is_latched {
            pairs.push(("latched", "true".to_owned()));
        }
        if self.optional {
            pairs.push(("optional", "true".to_owned()));
        }
        mapping(&pairs)
    }
}

impl Draft {
    /// The facts that all of these runs have in common.
    pub(crate) fn of(runs: &[Mission]) -> Self {
        let runs: Vec<Facts<'_>> = runs.iter().map(Facts::new).collect();
        Self {
            nodes: nodes(&runs),
            topics: topics(&runs),
        }
    }
}

fn nodes(runs: &[Facts<'_>]) -> BTreeMap<String, NodeLine> {
    let mut all: BTreeMap<String, Vec<NodeLine>> = BTreeMap::new();
    for facts in runs {
        for (role, nodes) in facts.roles() {
            if facts.is_sure(nodes) && !facts.is_tool(nodes) {
                all.entry(role.to_owned())
                    .or_default()
                    .push(node(facts, nodes));
            }
        }
    }
    let join = |(name, lines): (String, Vec<NodeLine>)| {
        let state = lines.first().and_then(|l| l.lifecycle.clone());
        let line = NodeLine {
            optional: lines.len() < runs.len(),
            may_end: lines.iter().any(|l| l.may_end),
            restarts: lines.iter().map(|l| l.restarts).max().unwrap_or(0),
            lifecycle: state.filter(|s| lines.iter().all(|l| l.lifecycle.as_ref() == Some(s))),
        };
        (name, line)
    };
    all.into_iter().map(join).collect()
}

fn node(facts: &Facts<'_>, nodes: &[NodeId]) -> NodeLine {
    let end = facts.lives(nodes).last().map(|life| life.end);
    let whole = facts.mission.span.end;
    NodeLine {
        optional: false,
        may_end: end.is_some_and(|end| whole.since(end) > CLOSING_NS),
        restarts: facts.entries(nodes, Kind::Restarted).len(),
        lifecycle: facts.lifecycle(nodes).map(str::to_owned),
    }
}

/// A topic in one of the runs.
struct TopicInRun<'a> {
    facts: &'a Facts<'a>,
    id: TopicId,
}

fn topics(runs: &[Facts<'_>]) -> BTreeMap<String, TopicLine> {
    let mut all: BTreeMap<String, Vec<TopicInRun<'_>>> = BTreeMap::new();
    for facts in runs {
        for id in facts.topics(&Pattern::new("**")) {
            if !facts.is_housekeeping(id) && facts.messages(id) > 0 {
                let name = facts.topic(id).to_owned();
                all.entry(name).or_default().push(TopicInRun { facts, id });
            }
        }
    }
    let line = |(name, seen): (String, Vec<TopicInRun<'_>>)| {
        let mut line = topic(&seen);
        line.optional = seen.len() < runs.len();
        (name, line)
    };
    all.into_iter().map(line).collect()
}

fn topic(seen: &[TopicInRun<'_>]) -> TopicLine {
    let may_end = seen.iter().any(TopicInRun::ends);
    let same = |get: &dyn Fn(&TopicInRun<'_>) -> Option<BTreeSet<String>>| {
        let first = seen.first().and_then(get)?;
        seen.iter()
            .all(|s| get(s).as_ref() == Some(&first))
            .then_some(first)
    };
    let kinds = same(&|s| Some(s.kinds())).filter(|kinds| kinds.len() == 1);
    let mut to = seen.first().map(TopicInRun::to).unwrap_or_default();
    for other in seen.iter().skip(1) {
        let other = other.to();
        to.retain(|name| other.contains(name));
    }
    let judged = |s: &TopicInRun<'_>| s.facts.rates(s.id, may_end, s.facts.mission.span);
    let rates: Vec<Vec<Rate>> = seen.iter().map(judged).collect();
    let is_rated = rates.iter().all(|own| !own.is_empty());
    let is_even = rates.iter().all(|own| Rate::are_even(own));
    TopicLine {
        optional: false,
        may_end,
        kind: kinds.and_then(|kinds| kinds.into_iter().next()),
        by: same(&|s| s.by()).filter(|by| !by.is_empty()),
        to,
        hz: band(&rates.concat(), is_even).filter(|_| is_rated),
        is_latched: seen.iter().all(|s| s.facts.is_latched(s.id) == Some(true)),
    }
}

impl TopicInRun<'_> {
    fn ends(&self) -> bool {
        let heard = self.facts.heard(self.id);
        heard.is_some_and(|h| self.facts.mission.span.end.since(h.end) > CLOSING_NS)
    }

    fn kinds(&self) -> BTreeSet<String> {
        let own = &self.facts.mission.elements.topics[self.id as usize];
        own.types.iter().map(|t| (**t).to_owned()).collect()
    }

    /// The nodes that publish it; `None` unless all of them are known.
    fn by(&self) -> Option<BTreeSet<String>> {
        let known = self.facts.publishers(self.id);
        let sure = known
            .iter()
            .filter(|(.., degree)| *degree <= Degree::Stated);
        let names = sure
            .map(|(node, ..)| *node)
            .filter(|node| !self.facts.is_tool(&[*node]));
        self.facts
            .tells_publishers(self.id)
            .then(|| names.map(|node| self.facts.role(node).to_owned()).collect())
    }

    /// The nodes that subscribe it, as far as that is measured or stated.
    fn to(&self) -> BTreeSet<String> {
        let known = self.facts.subscribers(self.id);
        let sure = known
            .iter()
            .filter(|(.., degree)| *degree <= Degree::Stated);
        let names = sure
            .map(|(node, ..)| *node)
            .filter(|node| !self.facts.is_tool(&[*node]));
        names.map(|node| self.facts.role(node).to_owned()).collect()
    }
}

/// The range around the median rate that noise explains, and that holds every window seen; `None` for topics that come
/// in bursts, where it would hold everything. The count of an uneven topic may differ by its square root, as chance
/// does.
fn band(rates: &[Rate], is_even: bool) -> Option<Range> {
    let count: u64 = rates.iter().map(|r| r.count).sum();
    let mut values: Vec<f64> = rates.iter().map(Rate::hz).collect();
    values.sort_by(f64::total_cmp);
    let (least, most) = (*values.first()?, *values.last()?);
    let median = values[values.len() / 2];
    if count < FEWEST || median <= 0.0 {
        return None;
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n;
    let typical = rates
        .iter()
        .map(|r| r.hz() / (r.count as f64).max(1.0))
        .fold(0.0, f64::max);
    let chance = libm::sqrt(median * typical);
    let spread = libm::sqrt(variance).max(if is_even { 0.0 } else { chance });
    let margin = (median * SHARE).max(spread * SPREADS);
    let (from, to) = ((median - margin).min(least), (median + margin).max(most));
    (from > 0.0).then(|| Range {
        from: Some(rounded(from, libm::floor)),
        to: Some(rounded(to, libm::ceil)),
    })
}

/// The value to three digits, rounded by `round`.
fn rounded(value: f64, round: fn(f64) -> f64) -> f64 {
    let power = 2.0 - libm::floor(libm::log10(value));
    let scale = libm::pow(10.0, libm::fabs(power));
    // A sum of 110.00000000000001 is 110, whichever way it is rounded.
    let whole = |digits: f64| match libm::round(digits) {
        near if (digits - near).abs() < 1e-9 * near => near,
        _ => round(digits),
    };
    // Dividing by a power of ten keeps 0.3 what it is.
    if power >= 0.0 {
        whole(value * scale) / scale
    } else {
        whole(value / scale) * scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::{Span, Stamp};

    fn rates(counts: &[u64]) -> Vec<Rate> {
        let rate = |(window, count): (usize, &u64)| Rate {
            window,
            span: Span {
                start: Stamp(0),
                end: Stamp(10_000_000_000),
            },
            count: *count,
            median_s: None,
        };
        counts.iter().enumerate().map(rate).collect()
    }

    fn written(counts: &[u64], is_even: bool) -> Option<String> {
        band(&rates(counts), is_even).map(|range| range.to_string())
    }

    #[test]
    fn a_steady_rate_has_a_tenth_of_room() {
        assert_eq!(written(&[100, 100, 100], true).as_deref(), Some("9..11"));
        assert_eq!(written(&[10, 10, 10], true).as_deref(), Some("0.9..1.1"));
    }

    #[test]
    fn every_window_seen_lies_inside() {
        assert_eq!(
            written(&[100, 100, 100, 100, 100, 100, 60], true).as_deref(),
            Some("5.8..14.2")
        );
    }

    #[test]
    fn bursts_have_no_rate() {
        assert_eq!(written(&[1, 8, 0, 3], false), None);
        assert_eq!(written(&[2, 2], true), None);
        assert_eq!(written(&[7, 7, 7], false), None);
    }
}
