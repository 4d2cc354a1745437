//! Connection headers that name a wrong publisher: in bags rewritten by tools that merge connections, and in bags
//! recorded while another one was played back.

mod successors;

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use crate::base::name::{is_log, is_player};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::time::Stamp;
use crate::evidence::inference::{Reliability, Stream};
use crate::evidence::numbers::Numbers;
use crate::evidence::observation::{Name, Observation, Observations};
use crate::evidence::times::Stamps;

/// Lowers the reliability of streams with unreliable headers, and divides those that continue after their
/// publisher ended; returns a notice once per bag.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub(crate) fn judge(
    streams: &mut Vec<Stream>,
    facts: &mut Observations,
    messages: &mut Stamps,
    numbers: &BTreeMap<usize, Numbers>,
) -> io::Result<Vec<Notice>> {
    let named = NamedTopics::new(facts);
    let mut notices = Vec::new();
    let mut bags: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (at, stream) in streams.iter().enumerate() {
        bags.entry(stream.bag).or_default().push(at);
    }
    for of_bag in bags.values() {
        if rewritten(streams, of_bag, &named) {
            notices.push(Notice::new(NoticeKind::Rewritten, REWRITTEN));
            for at in of_bag {
                let stream = &streams[*at];
                if let Some(node) = stream.publisher
                    && named.by_others(stream.topic, node)
                    && !is_alone(stream, node, (&named, facts), (messages, numbers.get(at)))?
                {
                    streams[*at].trust = Reliability::First;
                }
            }
            successors::part(streams, of_bag, &named, facts, messages)?;
        }
        let mut played = false;
        for at in of_bag {
            let stream = &mut streams[*at];
            let by_player = stream
                .publisher
                .is_some_and(|node| is_player(&facts.text(node)));
            if by_player {
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
struct NamedTopics {
    topics: BTreeMap<Name, BTreeSet<Name>>,
    /// Names that log over the connection of another node.
    guests: BTreeMap<Name, BTreeSet<Name>>,
}

impl NamedTopics {
    fn new(facts: &Observations) -> Self {
        let mut all = Self {
            topics: BTreeMap::new(),
            guests: BTreeMap::new(),
        };
        for fact in &facts.list {
            match fact.observation {
                Observation::Lists(node, topic) | Observation::Publish(node, topic) => {
                    all.topics.entry(topic).or_default().insert(node);
                }
                Observation::Carries(host, guest) => {
                    all.guests.entry(host).or_default().insert(guest);
                }
                _ => {}
            }
        }
        all
    }

    /// The nodes that name a topic as their own.
    fn nodes(&self, topic: Name) -> impl Iterator<Item = Name> + '_ {
        self.topics.get(&topic).into_iter().flatten().copied()
    }

    fn by_others(&self, topic: Name, node: Name) -> bool {
        let names = self.topics.get(&topic);
        names.is_some_and(|names| names.iter().any(|name| *name != node))
    }
}

/// The longest time from the start of a node to its first message on a topic of its own, in nanoseconds.
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
        observations.filter(move |fact| successors::shown(fact.observation) == Some(of))
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
    let log = of_bag
        .iter()
        .find(|at| is_log(streams[**at].connection.topic.as_str()));
    let host = log.and_then(|at| streams[*at].publisher);
    host.is_some_and(|host| named.guests.contains_key(&host))
}
