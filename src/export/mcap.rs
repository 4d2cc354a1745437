//! The graph over time as other tools read it: an MCAP file with `/rosgraph` (`rosgraph_msgs/msg/Graph`, a message per
//! change) and the event log on `/bagreel/events` (`foxglove_msgs/msg/Log`), both CDR with their definitions.
//!
//! Reading it gives the same elements in every window. Topics of which no publisher is known stand under the node
//! [`UNKNOWN_NODE`]; the reader takes them for topics.

mod cdr;
mod definitions;

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Cursor, Write as _};

use mcap::WriteOptions;
use mcap::records::MessageHeader;

use self::cdr::CdrWriter;
use super::{Encoder, Sequence, Written};
use crate::base::error::{Error, Result};
use crate::base::name::{OWN_NODE, UNKNOWN_NODE};
use crate::base::time::Stamp;
use crate::export::sink::OutputSink;
use crate::export::target::Target;
use crate::graph::{Edge, Element, Topic};
use crate::mission::Mission;
use crate::mission::events::sentence;

struct McapEncoder<'a> {
    mission: &'a Mission,
    target: Target,
}

/// Begins the file.
///
/// # Errors
/// [`Error::Usage`] for a name with `{n}`.
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    target.must_be_one("the graphs of all windows are one file")?;
    Ok(Box::new(McapEncoder {
        mission: sequence.data,
        target: target.clone(),
    }))
}

impl Encoder for McapEncoder<'_> {
    fn finish(self: Box<Self>) -> Result<Written> {
        let mut sink = OutputSink::create(&self.target, None)?;
        let failed = |error: mcap::McapError| Error::Io {
            path: self.target.path().to_owned(),
            doing: "write",
            source: std::io::Error::other(error),
        };
        let bytes = written(self.mission).map_err(failed)?;
        sink.write_all(&bytes).map_err(sink.error())?;
        let mut written = Written::to(&self.target);
        written.add(sink.commit()?);
        Ok(written)
    }
}

/// The whole file.
fn written(mission: &Mission) -> mcap::McapResult<Vec<u8>> {
    let mut to = WriteOptions::new()
        .profile("ros2")
        .library("bagreel")
        .compression(Some(mcap::Compression::Zstd))
        .create(Cursor::new(Vec::new()))?;
    let mut channels = [0; 2];
    for (channel, (topic, kind, definition)) in channels.iter_mut().zip(definitions::CHANNELS) {
        let schema = to.add_schema(kind, "ros2msg", definition().as_bytes())?;
        // The node tells our own reader that these topics are not the robot's.
        let metadata = BTreeMap::from([("callerid".to_owned(), OWN_NODE.to_owned())]);
        *channel = to.add_channel(schema, topic, "cdr", &metadata)?;
    }
    let mut all: Vec<(Stamp, usize, Vec<u8>)> = Vec::new();
    let ends = Ends::new(mission);
    for at in ends.turns(mission) {
        all.push((at, 0, ends.graph(mission, at)));
    }
    for (id, entry) in (0..).zip(&mission.ledger.entries) {
        if entry.is_headline() {
            let at = entry
                .time
                .max(mission.span.start)
                .min(mission.span.end.plus(-1));
            all.push((
                at,
                1,
                log(
                    entry.time,
                    &sentence(mission, id, entry),
                    entry.kind.is_remark(),
                ),
            ));
        }
    }
    let last = mission.span.end.plus(-1);
    all.push((last, 1, log(last, "the recording ends", false)));
    all.sort_by_key(|(at, channel, _)| (*at, *channel));
    for (sequence, (at, channel, payload)) in (0..).zip(&all) {
        let time = u64::try_from(at.0).unwrap_or(0);
        let header = MessageHeader {
            channel_id: channels[*channel],
            sequence,
            log_time: time,
            publish_time: time,
        };
        to.write_to_known_channel(&header, payload)?;
    }
    to.finish()?;
    Ok(to.into_inner().into_inner())
}

/// A record of the event log: information, or a warning.
fn log(time: Stamp, text: &str, warns: bool) -> Vec<u8> {
    let mut cdr = CdrWriter::new();
    cdr.time(time);
    cdr.u8(if warns { 3 } else { 2 });
    cdr.text(text);
    cdr.text("bagreel");
    cdr.text("");
    cdr.u32(0);
    cdr.done()
}

/// The ends of every node: the elements that are written.
struct Ends<'a> {
    /// By node: publications and subscriptions.
    of: BTreeMap<u32, [Vec<(Element, &'a Edge)>; 2]>,
    /// Topics without a known publisher or subscriber at some time.
    topics: Vec<(Element, &'a Topic)>,
}

impl<'a> Ends<'a> {
    /// Without what source code guesses, and stand-ins for nodes without a name.
    fn new(mission: &'a Mission) -> Self {
        let all = &mission.elements;
        let is_known = |what| !all.evidence(what).is_guess();
        let mut of: BTreeMap<u32, [Vec<(Element, &Edge)>; 2]> = BTreeMap::new();
        for (id, _) in (0..)
            .zip(&all.nodes)
            .filter(|(id, _)| is_known(Element::Node(*id)))
        {
            of.insert(id, Default::default());
        }
        for (what, edge) in all.edges().filter(|(what, _)| is_known(*what)) {
            let side = usize::from(matches!(what, Element::Subscribe(_)));
            if let Some(ends) = of.get_mut(&edge.node) {
                ends[side].push((what, edge));
            }
        }
        let topics = (0..).zip(&all.topics);
        Self {
            of,
            topics: topics
                .map(|(id, topic)| (Element::Topic(id), topic))
                .collect(),
        }
    }

    /// The times at which the graph changes, from the mission's start on.
    fn turns(&self, mission: &Mission) -> BTreeSet<Stamp> {
        let nodes = self.of.keys().map(|id| Element::Node(*id));
        let edges = self.of.values().flatten().flatten().map(|(what, _)| *what);
        let topics = self.topics.iter().map(|(what, _)| *what);
        let runs = nodes.chain(edges).chain(topics);
        let runs = runs.flat_map(|what| mission.elements.runs(what));
        let turns = runs.flat_map(|run| [run.start, run.end]);
        let inside = turns.filter(|at| mission.span.contains(*at));
        inside.chain([mission.span.start]).collect()
    }

    /// The graph at a time.
    fn graph(&self, mission: &Mission, at: Stamp) -> Vec<u8> {
        let elements = &mission.elements;
        let is_there = |what: Element| elements.runs(what).iter().any(|run| run.contains(at));
        let nodes: Vec<_> = self
            .of
            .iter()
            .filter(|(id, _)| is_there(Element::Node(**id)))
            .collect();
        let mut alone: BTreeSet<u32> = BTreeSet::new();
        for (what, _) in &self.topics {
            if let (Element::Topic(id), true) = (*what, is_there(*what)) {
                alone.insert(id);
            }
        }
        let mut there: Vec<(&str, [Vec<&Topic>; 2])> = Vec::new();
        for (id, ends) in nodes {
            let topics = [0, 1].map(|side| {
                let ends = ends[side].iter().filter(|(what, _)| is_there(*what));
                let ids = ends.map(|(_, edge)| edge.topic);
                ids.collect::<Vec<u32>>()
            });
            for id in topics.iter().flatten() {
                alone.remove(id);
            }
            let topics = topics.map(|ids| {
                let of = ids
                    .iter()
                    .filter_map(|id| elements.topics.get(*id as usize));
                of.collect()
            });
            let name = elements
                .nodes
                .get(*id as usize)
                .map_or("", |node| node.name.as_str());
            there.push((name, topics));
        }
        let alone = alone
            .iter()
            .filter_map(|id| elements.topics.get(*id as usize));
        let alone: Vec<&Topic> = alone.collect();
        if !alone.is_empty() {
            there.push((UNKNOWN_NODE, [alone, Vec::new()]));
        }
        let mut cdr = CdrWriter::new();
        cdr.count(there.len());
        for (name, topics) in &there {
            node(&mut cdr, name, topics);
        }
        cdr.done()
    }
}

/// A node, without parameters, and with its actions as their topics.
fn node(cdr: &mut CdrWriter, name: &str, topics: &[Vec<&Topic>; 2]) {
    cdr.text(name);
    cdr.count(0);
    cdr.count(0);
    for services in [false, true] {
        for (side, own) in topics.iter().enumerate() {
            let own: Vec<_> = own
                .iter()
                .filter(|topic| topic.is_service() == services)
                .collect();
            cdr.count(own.len());
            for topic in own {
                cdr.text(topic.name.as_str());
                let offered = topic.qos.as_deref().filter(|_| side == 0);
                for _ in 0..=usize::from(services) {
                    interface(cdr, topic.types.first().map_or("", |kind| kind));
                    quality(cdr, offered);
                }
            }
        }
    }
    cdr.count(0);
    cdr.count(0);
}

/// A type, without the hash of its definition.
fn interface(cdr: &mut CdrWriter, kind: &str) {
    cdr.text(kind);
    cdr.u8(1);
    cdr.bytes(&[0; 32]);
}

/// A quality of service as far as its words say; the rest is unknown.
fn quality(cdr: &mut CdrWriter, words: Option<&str>) {
    let words: Vec<&str> = words.unwrap_or_default().split([' ', ',']).collect();
    let place = |known: [&str; 2]| {
        words
            .iter()
            .find_map(|word| known.iter().position(|k| k == word))
    };
    // 1 and 2 are the two words of each policy, 3 is unknown.
    let policy = |known| {
        place(known)
            .and_then(|at| u8::try_from(at + 1).ok())
            .unwrap_or(3)
    };
    let depth = words.iter().position(|word| *word == "depth");
    let depth = depth.and_then(|at| words.get(at + 1)?.parse::<u32>().ok());
    cdr.u32(depth.unwrap_or(0));
    for _ in 0..4 {
        cdr.u32(0);
    }
    cdr.u8(if depth.is_some() {
        1
    } else {
        policy(["keep_last", "keep_all"])
    });
    cdr.u8(policy(["reliable", "best_effort"]));
    cdr.u8(policy(["transient_local", "volatile"]));
    cdr.u8(4);
    cdr.u32(0);
    cdr.u32(0);
}
