//! The last step: from the counts of one mission to a mission with states, rates and changes between windows.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::counts::{Count, merge};
use crate::base::budget;
use crate::base::error::{Error, Result};
use crate::base::role;
use crate::base::time::{Period, Span, Stamp};
use crate::graph::diff::RATE_CHANGE;
use crate::graph::{State, per_second};
use crate::mission::raw::{
    BagJson, EdgeJson, EdgeNumbers, KnownJson, LifeJson, NodeJson, NodeNumbers, PublishJson, Raw,
    RawWindow, Text, TopicJson, TopicNumbers,
};
use crate::mission::{Mission, mission_of};

/// Makes a mission from the counts of all its bags, in any order: every window from the first message to the
/// last, a publication `active` in windows with messages and `silent` in those between. A node is present
/// while it publishes. Facts from payloads (subscribers, `/rosout`) and medians are missing.
///
/// # Errors
/// [`Error::Usage`] for no counts, for those of several missions or periods, and for more than 100,000 windows.
pub fn finish(counts: impl IntoIterator<Item = Count>) -> Result<Mission> {
    let counts = merge(counts);
    let (period, wins) = check(&counts)?;
    let mut windows: Vec<WindowSums> = Vec::new();
    windows.resize_with(wins, WindowSums::default);
    let first = counts.iter().map(|c| c.win).min().unwrap_or_default();
    let mut lives = WindowLives::default();
    for count in &counts {
        let at = usize::try_from(count.win.saturating_sub(first)).unwrap_or(0);
        lives.take(at, count);
        if let Some(window) = windows.get_mut(at) {
            window.take(count);
        }
    }
    let span = span(&counts, period);
    let start = counts.iter().map(|c| c.start).min().unwrap_or_default();
    let windows = windows.iter().enumerate().map(|(at, sums)| {
        let begins = start.plus(
            period
                .nanos()
                .saturating_mul(i64::try_from(at).unwrap_or(0)),
        );
        let whole = Span::new(
            begins.max(span.start),
            begins.plus(period.nanos()).min(span.end),
        );
        window(at, whole, period, sums, &lives)
    });
    let mission = mission_of(Raw {
        bags: bags(&counts),
        start_ns: Some(span.start.0),
        end_ns: Some(span.end.0),
        period_ns: Some(period.nanos()),
        windows: windows.collect(),
        ..Raw::default()
    });
    let mut mission = mission.map_err(|reason| Error::usage(reason, ""))?;
    mission.find_changes(RATE_CHANGE, &[]);
    Ok(mission)
}

/// The period of the counts, and the number of windows.
fn check(counts: &[Count]) -> Result<(Period, usize)> {
    let Some(one) = counts.first() else {
        let hint = "a mission without a message has no windows";
        return Err(Error::usage("there are no counts", hint));
    };
    let is_other = |c: &&Count| c.mission != one.mission || c.period != one.period;
    if let Some(other) = counts.iter().find(is_other) {
        return Err(Error::usage(
            format!(
                "`{}` in windows of {} and `{}` in windows of {} are not one mission",
                one.mission, one.period, other.mission, other.period
            ),
            "finish each mission separately",
        ));
    }
    let wins = || counts.iter().map(|c| i128::from(c.win));
    let many = wins().max().unwrap_or(0) - wins().min().unwrap_or(0) + 1;
    if many > i128::from(budget::WINDOWS) {
        return Err(Error::usage(
            format!("its messages are {many} windows apart"),
            "remove the counts at impossible times, or use a longer period",
        ));
    }
    Ok((one.period, usize::try_from(many).unwrap_or(usize::MAX)))
}

/// The time of the mission: from the first message to the last plus 1 ns; from the first window to the last if no
/// message times are known.
fn span(counts: &[Count], period: Period) -> Span {
    let first = counts.iter().map(|c| c.first.unwrap_or(c.start)).min();
    let last = |c: &Count| {
        let end = c.start.plus(period.nanos());
        c.last.map_or(end, |last| last.plus(1))
    };
    Span::new(
        first.unwrap_or_default(),
        counts.iter().map(last).max().unwrap_or_default(),
    )
}

fn bags(counts: &[Count]) -> Vec<BagJson<'static>> {
    let all: BTreeSet<(&str, &str)> = counts.iter().map(|c| (&*c.bag, &*c.format)).collect();
    let bag = |(name, format): (&str, &str)| BagJson {
        name: name.to_owned().into(),
        format: format.to_owned().into(),
        ..BagJson::default()
    };
    all.into_iter().map(bag).collect()
}

/// A topic, and a node that publishes it.
type Publication = (Arc<str>, Arc<str>);

/// The messages sent in a window.
#[derive(Default)]
struct WindowSums {
    topics: BTreeMap<Arc<str>, CountSum>,
    edges: BTreeMap<Publication, CountSum>,
}

#[derive(Clone, Copy, Default)]
struct CountSum {
    n: u64,
    bytes: Option<u64>,
    /// The number of counts in the sum.
    parts: usize,
    gap: Option<i64>,
}

impl CountSum {
    fn take(&mut self, count: &Count) {
        self.bytes = match self.parts {
            0 => count.bytes,
            _ => self
                .bytes
                .zip(count.bytes)
                .map(|(a, b)| a.saturating_add(b)),
        };
        self.n = self.n.saturating_add(count.n);
        // Gaps between the messages of two publishers are unknown.
        self.gap = count.max_gap_ns.filter(|_| self.parts == 0);
        self.parts += 1;
    }
}

impl WindowSums {
    fn take(&mut self, count: &Count) {
        let topic = self.topics.entry(Arc::clone(&count.topic));
        topic.or_default().take(count);
        if let Some(node) = &count.node {
            let key = (Arc::clone(&count.topic), Arc::clone(node));
            self.edges.entry(key).or_default().take(count);
        }
    }
}

/// The first and last window of an element, and its first and last message.
#[derive(Clone, Copy)]
struct WindowLife {
    from: usize,
    to: usize,
    first: Option<Stamp>,
    last: Option<Stamp>,
}

impl WindowLife {
    fn of(at: usize, count: &Count) -> Self {
        Self {
            from: at,
            to: at,
            first: count.first,
            last: count.last,
        }
    }

    fn take(&mut self, other: Self) {
        self.from = self.from.min(other.from);
        self.to = self.to.max(other.to);
        self.first = self.first.zip(other.first).map(|(a, b)| a.min(b));
        self.last = self.last.zip(other.last).map(|(a, b)| a.max(b));
    }

    fn json(&self) -> LifeJson {
        LifeJson {
            first_ns: self.first.map(|at| at.0),
            last_ns: self.last.map(|at| at.0),
            lives: Vec::new(),
        }
    }

    fn holds(&self, at: usize) -> bool {
        (self.from..=self.to).contains(&at)
    }
}

#[derive(Default)]
struct WindowLives {
    topics: BTreeMap<Arc<str>, WindowLife>,
    types: BTreeMap<Arc<str>, BTreeSet<Arc<str>>>,
    nodes: BTreeMap<Arc<str>, WindowLife>,
    edges: BTreeMap<Publication, WindowLife>,
}

impl WindowLives {
    fn take(&mut self, at: usize, count: &Count) {
        let own = WindowLife::of(at, count);
        let topic = || Arc::clone(&count.topic);
        widen(&mut self.topics, topic(), own);
        if !count.type_name.is_empty() {
            let types = self.types.entry(topic()).or_default();
            types.insert(Arc::clone(&count.type_name));
        }
        if let Some(node) = &count.node {
            widen(&mut self.nodes, Arc::clone(node), own);
            widen(&mut self.edges, (topic(), Arc::clone(node)), own);
        }
    }
}

fn widen<K: Ord>(lives: &mut BTreeMap<K, WindowLife>, key: K, own: WindowLife) {
    lives.entry(key).or_insert(own).take(own);
}

fn window(
    at: usize,
    span: Span,
    period: Period,
    sums: &WindowSums,
    lives: &WindowLives,
) -> RawWindow {
    let known = |sum: Option<&CountSum>| {
        let is_sent = sum.is_some_and(|sum| sum.n > 0);
        let state = if is_sent {
            State::Active
        } else {
            State::Silent
        };
        KnownJson {
            state: Some(state.word().into()),
            degree: Some("measured".into()),
            evidence: vec!["connection".into()],
        }
    };
    let sent = |sum: Option<&CountSum>| sum.map_or(0, |sum| sum.n);
    let topics = lives.topics.iter().filter(|(_, life)| life.holds(at));
    let topics = topics.map(|(name, life)| {
        let sum = sums.topics.get(name);
        TopicJson {
            name: name.to_string().into(),
            types: types(lives, name),
            known: known(sum),
            numbers: Some(TopicNumbers {
                count: Some(sent(sum)),
                bytes: sum.and_then(|sum| sum.bytes),
                hz: per_second(sent(sum), span),
                max_gap_s: sum.and_then(|sum| Some(sum.gap? as f64 / 1e9)),
                ..TopicNumbers::default()
            }),
            life: life.json(),
            ..TopicJson::default()
        }
    });
    let edges = lives.edges.iter().filter(|(_, life)| life.holds(at));
    let edges = edges.map(|(key, life)| {
        let sum = sums.edges.get(key);
        PublishJson {
            node: key.1.to_string().into(),
            topic: key.0.to_string().into(),
            edge: EdgeJson {
                known: known(sum),
                numbers: Some(EdgeNumbers {
                    count: Some(sent(sum)),
                    hz: per_second(sent(sum), span),
                    ..EdgeNumbers::default()
                }),
                life: life.json(),
                ..EdgeJson::default()
            },
        }
    });
    let nodes = lives.nodes.iter().filter(|(_, life)| life.holds(at));
    let nodes = nodes.map(|(name, life)| {
        let own = sums.edges.iter().filter(|((_, node), _)| node == name);
        let sum = CountSum {
            n: own.map(|(_, sum)| sum.n).sum(),
            ..CountSum::default()
        };
        NodeJson {
            name: name.to_string().into(),
            role: Some(role::role(name).to_owned().into()),
            known: known(Some(&sum)),
            life: life.json(),
            numbers: Some(NodeNumbers {
                hz: per_second(sum.n, span),
                lifecycle: None,
            }),
            columns: None,
        }
    });
    RawWindow {
        start_ns: span.start.0,
        end_ns: span.end.0,
        partial: Some(span.nanos() < period.nanos()),
        messages: Some(sums.topics.values().map(|sum| sum.n).sum()),
        nodes: nodes.collect(),
        topics: topics.collect(),
        publishes: edges.collect(),
        subscribes: Vec::new(),
    }
}

fn types(lives: &WindowLives, topic: &str) -> Vec<Text<'static>> {
    let types = lives.types.get(topic).into_iter().flatten();
    types.map(|name| name.to_string().into()).collect()
}
