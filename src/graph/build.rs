//! From proofs to graphs: the elements of the mission, and for each window who is alive, how, and how busy.

use std::collections::BTreeMap;
use std::io;

use super::assemble::{Traffic, assemble};
use super::lives::{Extent, Track};
use super::proofs::prove;
use super::rates::{Rates, rates};
use super::restarts::{Restarts, restarts};
use super::settle::{Frame, settle};
use super::values::Values;
use super::windows::Windows;
use super::{Elements, Graph, NodeId};
use crate::collect::{Collected, spool_error};
use crate::error::Result;
use crate::evidence::{Degree, Evidence};
use crate::facts::Name;
use crate::notice::Notices;
use crate::proof::{Proof, What, When};
use crate::time::{Span, Stamp};
use crate::topology::Topology;

/// How graphs are built.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Windows of silence before something that never speaks again counts as gone.
    pub grace: usize,
    /// Whether nodes whose names differ only in an anonymous suffix are one, under the name of their role.
    pub roles: bool,
    /// Nodes and edges that the user knows of.
    pub topology: Topology,
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
        let (proofs, values) = prove(collected, options)?;
        let start = collected.span.map_or(Stamp(0), |s| s.start);
        let end = collected.span.map_or(Stamp(0), |s| s.end.plus(-1));
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
        let mut built = self.assemble(collected);
        built
            .notices
            .extend(options.topology.notices.iter().cloned());
        Ok(built)
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
                        track.begin_all(&[trace.first], &[], proof.degree, &self.windows);
                    }
                }
                When::Signs { signs, ends, held } => {
                    let mut ends = ends.clone();
                    ends.extend(&deaths);
                    ends.sort_unstable();
                    track.sign_all(signs, &ends, proof.degree, &self.windows);
                    track.held |= held;
                }
                When::Begins { signs, ends } => {
                    let mut ends = ends.clone();
                    ends.extend(&deaths);
                    ends.sort_unstable();
                    track.begin_all(signs, &ends, proof.degree, &self.windows);
                }
                When::Like(_) => {}
                When::Whole => track.extent = track.extent.max(Extent::Whole),
                When::Always => track.extent = Extent::Always,
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

/// Puts the messages of one stream on a track.
fn follow(track: &mut Track, rates: &Rates, place: usize, latched: bool, end: Stamp) {
    let Some(spoke) = rates.traces.get(place).copied().flatten() else {
        track.extent = track.extent.max(Extent::Whole);
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
