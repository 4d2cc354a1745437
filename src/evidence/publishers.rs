//! Connection headers that name a wrong publisher: in bags rewritten by tools that merge connections, and in bags
//! recorded while another one was played back.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use crate::base::ids::{ById, Few};
use crate::base::name::{is_log, is_player};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::rhythm::{BREAK_NS, FEWEST, RECENT, UNUSUAL, broken_after};
use crate::base::time::Stamp;
use crate::evidence::inference::{Reliability, Stream};
use crate::evidence::numbers::Numbers;
use crate::evidence::observation::{Confidence, Name, Observation, Observations, Statement};
use crate::evidence::source_id;
use crate::evidence::times::{SeriesId, Stamps};

/// Lowers the reliability of streams with unreliable headers, and divides those that continue after their
/// publisher ended; returns a notice once per bag.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub(crate) fn judge(
    streams: &mut Vec<Stream>,
    facts: &mut Observations,
    messages: &mut Stamps,
    numbers: &ById<usize, Option<Numbers>>,
) -> io::Result<Vec<Notice>> {
    let named = NamedTopics::new(facts);
    let mut notices = Vec::new();
    let mut bags: ById<usize, Vec<usize>> = ById::default();
    for (at, stream) in streams.iter().enumerate() {
        bags.grown(stream.bag).push(at);
    }
    for of_bag in &bags {
        if rewritten(streams, of_bag, &named) {
            notices.push(Notice::new(NoticeKind::Rewritten, REWRITTEN));
            for at in of_bag {
                let stream = &streams[*at];
                if let Some(node) = stream.publisher
                    && named.nodes(stream.topic).any(|name| name != node)
                    && !is_alone(stream, node, (&named, facts), (messages, numbers.some(*at)))?
                {
                    streams[*at].trust = Reliability::First;
                }
            }
            part(streams, of_bag, &named, facts, messages)?;
        }
        let mut played = false;
        for at in of_bag {
            let stream = &mut streams[*at];
            let publisher = stream.publisher;
            if publisher.is_some_and(|node| is_player(&facts.text(node))) {
                // A player also has a log of its own.
                played |= !is_log(stream.connection.topic.as_str());
                stream.trust = Reliability::Player;
            }
        }
        if played {
            notices.push(Notice::new(NoticeKind::Playback, PLAYBACK));
        }
    }
    Ok(notices)
}

const REWRITTEN: &str = "the bag was rewritten by a tool that merges connections, so a topic's publishers are taken from log records if these name several";
const PLAYBACK: &str =
    "the bag was recorded during a playback, so the player publishes messages of other nodes";

/// The topics that nodes name as their own in log records and similar messages.
#[derive(Default)]
struct NamedTopics {
    topics: Few<Name, BTreeSet<Name>>,
    /// Names that log over the connection of another node.
    guests: Few<Name, BTreeSet<Name>>,
}

impl NamedTopics {
    fn new(facts: &Observations) -> Self {
        let mut all = Self::default();
        for fact in &facts.list {
            match fact.observation {
                Observation::Lists(node, topic) | Observation::Publish(node, topic) => {
                    all.topics.grown(topic).insert(node);
                }
                Observation::Carries(host, guest) => {
                    all.guests.grown(host).insert(guest);
                }
                _ => {}
            }
        }
        all
    }

    /// The nodes that name a topic as their own.
    fn nodes(&self, topic: Name) -> impl Iterator<Item = Name> + '_ {
        self.topics.get(topic).into_iter().flatten().copied()
    }
}

/// The longest time from the start of a node to its first message on a topic of its own, in nanoseconds: with much
/// longer, nodes that start one after the other would be confused.
const SOON_NS: i64 = 5_000_000_000;

/// Whether the numbers in the headers of a topic show that one node sent all its messages: they are one
/// counter, and whenever it starts over, there is a sign of this node and no other node that names the topic
/// starts.
fn is_alone(
    stream: &Stream,
    node: Name,
    (named, facts): (&NamedTopics, &Observations),
    (messages, numbers): (&Stamps, Option<&Numbers>),
) -> io::Result<bool> {
    let count = messages.count(stream.times);
    let Some(numbers) = numbers.filter(|numbers| numbers.is_one_counter(count)) else {
        return Ok(false);
    };
    let shown = |of: Name| {
        let observations = facts.list.iter();
        observations.filter(move |fact| shown(fact.observation) == Some(of))
    };
    let mut signs = Vec::new();
    for fact in shown(node) {
        signs.extend(facts.times.times(fact.times)?);
    }
    let first = |of: Name| {
        let bounds = shown(of).filter_map(|fact| facts.times.bounds(fact.times));
        bounds.map(|(first, _)| first).min()
    };
    let others = named.nodes(stream.topic).filter(|other| *other != node);
    let others: Vec<Stamp> = others.filter_map(first).collect();
    Ok(numbers.falls.iter().all(|(last, next)| {
        let soon = next.plus(-SOON_NS)..next.plus(SOON_NS);
        let is_back = signs.iter().any(|sign| sign > last && soon.contains(sign));
        is_back && !others.iter().any(|first| soon.contains(first))
    }))
}

/// Whether a bag has no topic with two publishers, and one log connection used by several nodes.
fn rewritten(streams: &[Stream], of_bag: &[usize], named: &NamedTopics) -> bool {
    let mut topics = BTreeSet::new();
    if !of_bag.iter().all(|at| topics.insert(streams[*at].topic)) {
        return false;
    }
    let mut streams = of_bag.iter().map(|at| &streams[*at]);
    let log = streams.find(|stream| is_log(stream.connection.topic.as_str()));
    let host = log.and_then(|stream| stream.publisher);
    let guests = host.and_then(|host| named.guests.get(host));
    guests.is_some_and(|guests| !guests.is_empty())
}

// Nodes that ended while one of their topics continued, in rewritten bags: another node took over the topic,
// and its messages have the name of the first.
//
// A node with regular other evidence counts as ended if all of it stops for good when its topic falls silent
// for longer than ever before. Messages after that silence may not be its own: they are attributed to the
// only node that names the topic and starts with them, if there is one. For example, `/planner_a` stops at 60 s and `/path`
// with it; at 75 s `/path` continues and `/planner_b` logs for the first time: the rest of `/path` is by `/planner_b`.

/// Finds the nodes of a rewritten bag that ended before their topics did; `of_bag` contains the indices of
/// its streams. Each gets an observation of its end; the rest of a topic whose header names it becomes a
/// separate stream.
fn part(
    streams: &mut Vec<Stream>,
    of_bag: &[usize],
    named: &NamedTopics,
    facts: &mut Observations,
    messages: &mut Stamps,
) -> io::Result<()> {
    let (ends, heirs) = {
        let mut bag = RewrittenBag::new(streams, of_bag, facts, messages);
        let ends = bag.ends(named)?;
        let heirs: Vec<Option<Name>> = ends.iter().map(|end| bag.heir(named, end)).collect();
        (ends, heirs)
    };
    let mut gone: BTreeMap<Name, Stamp> = BTreeMap::new();
    for (end, heir) in ends.into_iter().zip(heirs) {
        let last = gone.entry(end.node).or_insert(end.time);
        *last = end.time.max(*last);
        let stream = &mut streams[end.stream];
        let is_known = stream.trust == Reliability::Whole || heir.is_some();
        let own = is_known && stream.publisher == Some(end.node);
        if let Some(next) = end.next.filter(|_| own) {
            let times = messages.split(stream.times, next)?;
            let mut rest = Stream {
                times,
                trust: Reliability::Gone,
                ..stream.clone()
            };
            if let Some(heir) = heir {
                // A topic that fell silent with its node was sent by it alone.
                stream.trust = Reliability::Likely;
                rest.trust = Reliability::Likely;
                rest.publisher = Some(heir);
            }
            streams.push(rest);
        }
    }
    for (node, time) in gone {
        for observation in [Observation::Node(node), Observation::NodeGone(node)] {
            let said = Statement::new(observation, Confidence::Stated);
            let words = || "there is no sign of it after a topic of its own fell silent".to_owned();
            facts.state(source_id("connection"), said, Some(time), words);
        }
    }
    facts.finish()
}

/// The end of a node, before the end of a topic.
struct NodeEnd {
    node: Name,
    stream: usize,
    /// The last sign of the node.
    time: Stamp,
    /// The topic's first message after the silence, if there is one.
    next: Option<Stamp>,
}

/// The evidence of one rewritten bag for the ends of nodes.
struct RewrittenBag<'a> {
    streams: &'a [Stream],
    of_bag: &'a [usize],
    facts: &'a Observations,
    messages: &'a Stamps,
    /// The observations about each node.
    stated: Few<Name, Vec<SeriesId>>,
    /// The streams that each node published, as far as known.
    own: Few<Name, Vec<usize>>,
    /// The last message.
    end: Stamp,
    /// The times without any message, computed on demand.
    pauses: Option<Vec<(Stamp, Stamp)>>,
}

impl<'a> RewrittenBag<'a> {
    fn new(
        streams: &'a [Stream],
        of_bag: &'a [usize],
        facts: &'a Observations,
        messages: &'a Stamps,
    ) -> Self {
        let mut stated: Few<Name, Vec<SeriesId>> = Few::default();
        for fact in &facts.list {
            if let Some(node) = shown(fact.observation) {
                stated.grown(node).push(fact.times);
            }
        }
        let mut own: Few<Name, Vec<usize>> = Few::default();
        for at in of_bag {
            if let (Some(node), true) = (streams[*at].publisher, is_own(streams, *at)) {
                own.grown(node).push(*at);
            }
        }
        let times = of_bag.iter().map(|at| streams[*at].times);
        let bounds = times.filter_map(|times| messages.bounds(times));
        Self {
            streams,
            of_bag,
            facts,
            messages,
            stated,
            own,
            end: bounds.map(|(_, last)| last).max().unwrap_or(Stamp(0)),
            pauses: None,
        }
    }

    fn ends(&mut self, named: &NamedTopics) -> io::Result<Vec<NodeEnd>> {
        let mut ends = Vec::new();
        for at in self.of_bag {
            let stream = &self.streams[*at];
            let nodes: BTreeSet<Name> = named.nodes(stream.topic).chain(stream.publisher).collect();
            if stream.latched || is_log(stream.connection.topic.as_str()) {
                continue;
            }
            let mut times = None;
            for node in nodes {
                if !self.may_have_ended(node, *at) {
                    continue;
                }
                let times = match &times {
                    Some(times) => times,
                    None => times.insert(self.messages.times(stream.times)?),
                };
                ends.extend(self.ended(node, *at, times)?);
            }
        }
        Ok(ends)
    }

    /// Whether the last sign of a node, other than the messages of this stream, is long before the end of the
    /// bag.
    fn may_have_ended(&self, node: Name, except: usize) -> bool {
        let stated = self.stated.of(node).iter();
        let stated = stated.filter_map(|id| self.facts.times.bounds(*id));
        let own = self.own.of(node).iter();
        let own = own.filter(|at| **at != except);
        let own = own.filter_map(|at| self.messages.bounds(self.streams[*at].times));
        let last = stated.chain(own).map(|(_, last)| last).max();
        last.is_some_and(|last| self.end.since(last) > BREAK_NS.saturating_mul(UNUSUAL))
    }

    /// The end of a node, if all its signs stop with a silence of this topic.
    fn ended(&mut self, node: Name, at: usize, times: &[Stamp]) -> io::Result<Option<NodeEnd>> {
        let Some(habit) = Habit::of(&self.signs(node, at)?) else {
            return Ok(None);
        };
        let longest = habit.pause.max(BREAK_NS);
        if self.end.since(habit.last) <= longest.saturating_mul(UNUSUAL) {
            return Ok(None);
        }
        let Some((last, next)) = silence(times, habit, self.end) else {
            return Ok(None);
        };
        let is_all_quiet = self.is_all_quiet(last, next.unwrap_or(self.end))?;
        Ok((!is_all_quiet).then_some(NodeEnd {
            node,
            stream: at,
            time: habit.last.max(last),
            next,
        }))
    }

    /// The only node that names the topic of an end and was first seen when its messages resumed.
    fn heir(&self, named: &NamedTopics, end: &NodeEnd) -> Option<Name> {
        let next = end.next?;
        let begins = |node: &Name| {
            let signs = self.stated.of(*node).iter();
            let bounds = signs.filter_map(|id| self.facts.times.bounds(*id));
            let first = bounds.map(|(first, _)| first).min();
            first.is_some_and(|first| first.since(next).abs() <= SOON_NS)
        };
        let nodes = named.nodes(self.streams[end.stream].topic);
        let mut new = nodes.filter(|node| *node != end.node && begins(node));
        new.next().filter(|_| new.next().is_none())
    }

    /// The times of all signs of a node, without the messages of one stream, sorted.
    fn signs(&self, node: Name, except: usize) -> io::Result<Vec<Stamp>> {
        let mut signs = Vec::new();
        for id in self.stated.of(node) {
            signs.extend(self.facts.times.times(*id)?);
        }
        let own = self.own.of(node).iter();
        for at in own.filter(|at| **at != except) {
            signs.extend(self.messages.times(self.streams[*at].times)?);
        }
        signs.sort_unstable();
        Ok(signs)
    }

    /// Whether the bag has no message at all in half of this time or more: then the recorder was silent, not the node.
    fn is_all_quiet(&mut self, from: Stamp, to: Stamp) -> io::Result<bool> {
        if self.pauses.is_none() {
            self.pauses = Some(self.long_pauses()?);
        }
        let inside = |(a, b): &(Stamp, Stamp)| (*b).min(to).since((*a).max(from)).max(0);
        let quiet: i64 = self.pauses.iter().flatten().map(inside).sum();
        Ok(quiet >= to.since(from) / 2)
    }

    /// The times of a second or more without any message.
    fn long_pauses(&self) -> io::Result<Vec<(Stamp, Stamp)>> {
        let of = |at: &usize| self.streams[*at].times;
        let ids: Vec<SeriesId> = self.of_bag.iter().map(of).collect();
        let mut last: Option<Stamp> = None;
        let mut pauses = Vec::new();
        self.messages.merge(&ids, |timed| {
            let before = last.replace(timed.time).unwrap_or(timed.time);
            if timed.time.since(before) >= BREAK_NS / 2 {
                pauses.push((before, timed.time));
            }
        })?;
        Ok(pauses)
    }
}

/// The node whose existence an observation shows.
fn shown(observation: Observation) -> Option<Name> {
    match observation {
        Observation::Node(node)
        | Observation::Publish(node, _)
        | Observation::Subscribe(node, _)
        | Observation::Joins(node, _)
        | Observation::Refused(node, _)
        | Observation::Lists(node, _)
        | Observation::Reports(node, _)
        | Observation::Lifecycle(node, _) => Some(node),
        _ => None,
    }
}

/// Whether all messages of a stream are by the node that its header names, and are evidence of its lifetime.
fn is_own(streams: &[Stream], at: usize) -> bool {
    streams[at].trust == Reliability::Whole && !is_log(streams[at].connection.topic.as_str())
}

/// The usual interval between the signs of a node.
#[derive(Clone, Copy)]
struct Habit {
    last: Stamp,
    /// The longest time between two signs, in nanoseconds.
    pause: i64,
}

impl Habit {
    /// The usual interval of sorted signs; `None` if there are too few.
    fn of(signs: &[Stamp]) -> Option<Self> {
        let pauses = signs.windows(2).map(|pair| pair[1].since(pair[0]));
        (signs.len() as u64 >= FEWEST).then_some(Self {
            last: *signs.last()?,
            pause: pauses.max()?,
        })
    }
}

/// The longest silence of a topic that begins when a node was last seen, give or take one of its pauses: the last
/// message and the next one. `None` unless it is long for the topic.
fn silence(times: &[Stamp], habit: Habit, end: Stamp) -> Option<(Stamp, Option<Stamp>)> {
    let from = times.partition_point(|t| *t < habit.last.plus(-habit.pause));
    let to = times.partition_point(|t| *t <= habit.last.plus(habit.pause));
    let next = |at: usize| times.get(at + 1).copied();
    let length = |at: &usize| next(*at).unwrap_or(end).since(times[*at]);
    let last = (from..to).max_by_key(|at| (length(at), std::cmp::Reverse(*at)))?;
    let recent = &times[last.saturating_sub(RECENT)..=last];
    let usual = recent.windows(2).map(|pair| pair[1].since(pair[0])).max()?;
    (recent.len() as u64 >= FEWEST && length(&last) > broken_after(usual))
        .then_some((times[last], next(last)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(list: impl IntoIterator<Item = i64>) -> Vec<Stamp> {
        list.into_iter().map(|s| Stamp(s * 1_000_000_000)).collect()
    }

    #[test]
    fn silence_of_a_topic_requires_silence_of_its_node() {
        let times = seconds((0..20).chain(60..90));
        let habit = |last: i64, pause: i64| Habit {
            last: Stamp(last * 1_000_000_000),
            pause: pause * 1_000_000_000,
        };
        let end = Stamp(90_000_000_000);
        let found = silence(&times, habit(21, 4), end);
        assert_eq!(found, Some((times[19], Some(times[20]))));
        // Long before the silence, and within even messages.
        assert_eq!(silence(&times, habit(8, 4), end), None);
        assert_eq!(silence(&times, habit(70, 4), end), None);
        let rare = seconds([0, 20, 40, 60, 80, 160, 180, 200]);
        assert_eq!(silence(&rare, habit(80, 4), Stamp(200_000_000_000)), None);
    }

    #[test]
    fn a_few_signs_are_not_a_rhythm() {
        assert!(Habit::of(&seconds([1, 2, 3, 4])).is_none());
        let habit = Habit::of(&seconds([1, 2, 3, 9, 10])).unwrap();
        assert_eq!((habit.last.0, habit.pause), (10_000_000_000, 6_000_000_000));
    }
}
