//! From proofs to graphs: the elements of the mission, and for each window who is alive, how, and how busy.

use std::collections::BTreeMap;
use std::io;

use super::assemble::{Traffic, assemble};
use super::lives::Track;
use super::rates::{Rates, rates};
use super::restarts::{Restarts, restarts};
use super::roles::role;
use super::settle::{Frame, settle};
use super::values::Values;
use super::windows::Windows;
use super::{Elements, Graph, NodeId};
use crate::collect::{Collected, spool_error};
use crate::error::Result;
use crate::evidence::{Degree, Evidence, SOURCES};
use crate::facts::Name;
use crate::notice::Notices;
use crate::proof::{Known, Proof, What, When};
use crate::time::{Span, Stamp};

/// How graphs are built.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Windows of silence before something that never speaks again counts as gone.
    pub grace: usize,
    /// Whether nodes whose names differ only in an anonymous suffix are one, under the name of their role.
    pub roles: bool,
}

/// The graphs of a mission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Built {
    /// Everything that ever is in it.
    pub elements: Elements,
    /// A graph per window.
    pub graphs: Vec<Graph>,
    /// Messages per window.
    pub messages: Vec<u64>,
    /// Nodes that began anew under the same name, and when they were first seen again; sorted by time.
    pub restarts: Vec<(NodeId, Stamp)>,
    /// What went wrong without stopping us.
    pub notices: Notices,
}

/// Builds the graph of each window. Windows are sorted by start, none inside another; they may overlap.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub fn build(collected: &mut Collected, windows: &[Span], options: &Options) -> Result<Built> {
    Builder::new(collected, windows, options)
        .and_then(|builder| builder.run(collected, options))
        .map_err(spool_error)
}

/// Everything proved, by element. Names are numbered in the order of their texts, so that maps are in order too.
struct Builder<'a> {
    windows: Windows<'a>,
    mission: (Stamp, Stamp),
    proofs: Vec<Proof>,
    tracks: BTreeMap<What, Track>,
    /// Per topic: its streams and their messages.
    rates: Traffic,
    restarts: Restarts,
    values: Values,
}

impl<'a> Builder<'a> {
    fn new(collected: &mut Collected, windows: &'a [Span], options: &Options) -> io::Result<Self> {
        let mut known = Known::new(&collected.streams, &mut collected.facts);
        known.take_at_their_word();
        for (row, source) in SOURCES.iter().enumerate() {
            for conclude in source.conclude {
                conclude(row, &mut known);
            }
        }
        if let Some(error) = known.failed {
            return Err(error);
        }
        let mut proofs = known.proofs;
        let roles = if options.roles {
            fold(&mut proofs, collected)
        } else {
            BTreeMap::new()
        };
        let new = collected.facts.renumber();
        let to = |name: Name| new.get(name.0 as usize).copied().unwrap_or(name);
        for proof in &mut proofs {
            proof.rename(&to);
        }
        let roles: BTreeMap<Name, Name> = roles.into_iter().map(|(a, b)| (to(a), to(b))).collect();
        let role = |name: Name| roles.get(&name).copied().unwrap_or(name);
        for stream in &mut collected.streams {
            stream.topic = to(stream.topic);
            stream.publisher = stream.publisher.map(to);
            stream.speaker = stream.publisher.map(role);
        }
        let values = Values::new(&mut collected.facts, role)?;
        let span = collected.span;
        let start = span.map_or(Stamp(0), |s| s.start);
        let end = span.map_or(Stamp(0), |s| s.end.plus(-1));
        Ok(Self {
            windows: Windows(windows),
            mission: (start, end),
            proofs,
            tracks: BTreeMap::new(),
            rates: BTreeMap::new(),
            restarts: Restarts::new(),
            values,
        })
    }

    fn run(mut self, collected: &mut Collected, options: &Options) -> io::Result<Built> {
        self.count(collected)?;
        self.restarts = restarts(collected, &self.proofs)?;
        self.track(collected)?;
        settle(
            &mut self.tracks,
            &self.proofs,
            &Frame {
                windows: self.windows,
                mission: self.mission,
                grace: options.grace,
            },
        );
        Ok(self.assemble(collected))
    }

    /// Counts messages, topic by topic.
    fn count(&mut self, collected: &mut Collected) -> io::Result<()> {
        let mut streams: BTreeMap<Name, Vec<usize>> = BTreeMap::new();
        for (at, stream) in collected.streams.iter().enumerate() {
            streams.entry(stream.topic).or_default().push(at);
        }
        for (topic, streams) in streams {
            let rates = rates(collected, &streams, &self.windows)?;
            self.rates.insert(topic, (streams, rates));
        }
        Ok(())
    }

    /// Puts the signs of every proof on the track of its element.
    fn track(&mut self, collected: &mut Collected) -> io::Result<()> {
        for proof in &self.proofs {
            let node = match proof.what {
                What::Node(node) | What::Publish(node, _) | What::Subscribe(_, node) => Some(node),
                What::Topic(_) => None,
            };
            let restarts = node.and_then(|node| self.restarts.get(&node));
            let deaths: Vec<Stamp> = restarts.into_iter().flatten().map(|r| r.death).collect();
            let track = self.tracks.entry(proof.what).or_default();
            track.evidence = track.evidence.and(Evidence::row(proof.source));
            if proof.degree != Degree::Measured {
                track.quiet = track.quiet.min(proof.degree);
            }
            match &proof.when {
                When::Messages(at) => {
                    let stream = &collected.streams[*at];
                    let Some((streams, rates)) = self.rates.get(&stream.topic) else {
                        continue;
                    };
                    let place = streams.iter().position(|s| s == at).unwrap_or(0);
                    follow(track, rates, place, stream.latched, self.mission.1);
                    if !deaths.is_empty() {
                        let times = collected.messages.times(stream.times)?;
                        track.bound_all(&times, &deaths);
                    }
                }
                When::First(at) => {
                    let stream = &collected.streams[*at];
                    if let Some((streams, rates)) = self.rates.get(&stream.topic)
                        && let Some(place) = streams.iter().position(|s| s == at)
                        && let Some(trace) = rates.traces[place]
                    {
                        track.sign_all(&[trace.first], &[], proof.degree, &self.windows);
                    }
                }
                When::Signs { signs, ends, held } => {
                    let mut ends = ends.clone();
                    ends.extend(&deaths);
                    ends.sort_unstable();
                    track.sign_all(signs, &ends, proof.degree, &self.windows);
                    track.held |= held;
                }
                When::Like(_) => {}
                When::Whole => track.whole = true,
            }
        }
        for (node, restarts) in &self.restarts {
            let track = self.tracks.entry(What::Node(*node)).or_default();
            for restart in restarts {
                track.signs.extend([restart.death, restart.birth]);
                track.ends.push(restart.death);
            }
        }
        Ok(())
    }

    fn assemble(self, collected: &Collected) -> Built {
        let mut built = assemble(
            &self.tracks,
            &self.rates,
            &self.values,
            &self.windows,
            collected,
        );
        for (node, restarts) in &self.restarts {
            let name = collected.facts.text(*node);
            let id = built
                .elements
                .nodes
                .binary_search_by(|n| n.name.as_str().cmp(&name));
            if let Ok(id) = id.map(|id| NodeId::try_from(id).unwrap_or(NodeId::MAX)) {
                built
                    .restarts
                    .extend(restarts.iter().map(|r| (id, r.birth)));
            }
        }
        built.restarts.sort_by_key(|(node, time)| (*time, *node));
        built
    }
}

/// Puts every node under the name of its role; tells which names changed.
fn fold(proofs: &mut [Proof], collected: &mut Collected) -> BTreeMap<Name, Name> {
    let mut roles = BTreeMap::new();
    let mut to = |node: Name| {
        let text = collected.facts.text(node);
        match role(&text) {
            same if *same == *text => node,
            role => {
                let role = collected.facts.name(role);
                roles.insert(node, role);
                role
            }
        }
    };
    for proof in proofs {
        proof.what = proof.what.with_node(&mut to);
        if let When::Like(other) = &mut proof.when {
            *other = other.with_node(&mut to);
        }
    }
    roles
}

/// Puts the messages of one stream on a track.
fn follow(track: &mut Track, rates: &Rates, place: usize, latched: bool, end: Stamp) {
    let Some(spoke) = rates.traces.get(place).copied().flatten() else {
        track.whole = true;
        return;
    };
    track.signs.extend([spoke.first, spoke.last]);
    track.ceased |= spoke.ceased(end);
    if latched {
        track.held = true;
        track.latched = track
            .latched
            .map_or(Some(spoke.first), |l| Some(l.min(spoke.first)));
    }
    for tally in rates.tallies.iter().filter(|t| t.streams[place] > 0) {
        track.mark(tally.window, Degree::Measured);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bag::{Connection, ConnectionId, Encoding, Sink as _};
    use crate::collect::Collector;

    const SECOND: i64 = 1_000_000_000;

    /// One connection: topic, publisher, latching, and its messages' times in seconds.
    type Talk<'a> = (&'a str, Option<&'a str>, bool, &'a [i64]);

    fn graphs(talks: &[Talk<'_>], period: i64) -> Built {
        let mut collector = Collector::new(crate::collect::Options::default());
        let mut progress = |_, _| ();
        let mut bag = collector.bag(&mut progress);
        for (id, (topic, publisher, latching, times)) in (0..).zip(talks) {
            bag.connection(&Connection {
                id: ConnectionId(id),
                topic: (*topic).into(),
                type_name: "std_msgs/String".into(),
                definition: None,
                type_hash: None,
                publisher: publisher.map(Into::into),
                latching: *latching,
                qos: None,
                encoding: Encoding::Ros1,
            });
            let stamps: Vec<_> = times.iter().map(|t| Stamp(t * SECOND)).collect();
            bag.stamps(ConnectionId(id), &stamps, None);
        }
        let mut collected = collector.finish().unwrap();
        let span = collected.span.unwrap();
        let windows: Vec<_> = (0..1000)
            .map(|n| Span {
                start: span.start.plus(n * period * SECOND),
                end: span.start.plus((n + 1) * period * SECOND),
            })
            .take_while(|w| w.start < span.end)
            .collect();
        build(&mut collected, &windows, &Options::default()).unwrap()
    }

    /// The state of one node in each window, `-` where there is none.
    fn states(built: &Built, node: &str) -> Vec<&'static str> {
        let id = built
            .elements
            .nodes
            .iter()
            .position(|n| n.name.as_str() == node);
        let id = u32::try_from(id.unwrap()).unwrap();
        let state = |g: &Graph| {
            g.nodes
                .iter()
                .find(|n| n.id == id)
                .map_or("-", |n| n.state.word())
        };
        built.graphs.iter().map(state).collect()
    }

    #[test]
    fn a_node_lives_from_its_first_message_to_its_last() {
        let built = graphs(
            &[
                ("/a", Some("/x"), false, &[12, 35]),
                ("/b", Some("/y"), false, &[0, 49]),
            ],
            10,
        );
        assert_eq!(
            states(&built, "/x"),
            ["-", "active", "silent", "active", "-"]
        );
        assert_eq!(built.messages, [1, 1, 0, 1, 1]);
    }

    #[test]
    fn a_latched_message_holds_its_node_to_the_end() {
        let built = graphs(
            &[
                ("/map", Some("/x"), true, &[5]),
                ("/b", Some("/y"), false, &[0, 29]),
            ],
            10,
        );
        assert_eq!(states(&built, "/x"), ["active", "latched", "latched"]);
    }

    #[test]
    fn a_topic_without_a_publisher_still_counts() {
        let built = graphs(&[("/a", None, false, &[0, 1, 2, 3])], 10);
        assert!(built.elements.nodes.is_empty());
        let topic = &built.graphs[0].topics[0];
        assert_eq!((topic.count, topic.median_period_s), (4, Some(1.0)));
    }

    #[test]
    fn elements_are_in_the_order_of_their_names() {
        let built = graphs(
            &[
                ("/z", Some("/b"), false, &[1]),
                ("/a", Some("/c"), false, &[0]),
                ("/m", Some("/a"), false, &[2]),
            ],
            10,
        );
        let all = &built.elements;
        assert!(all.nodes.is_sorted_by_key(|n| n.name.clone()));
        assert!(all.topics.is_sorted_by_key(|t| t.name.clone()));
        let edges: Vec<_> = all.publishes.iter().map(|e| (e.node, e.topic)).collect();
        assert!(edges.is_sorted());
        assert_eq!(all.nodes[0].name.as_str(), "/a");
        assert_eq!(built.graphs[0].nodes[0].hz, Some(0.1));
    }
}
