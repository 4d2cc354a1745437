//! From proofs to graphs: the elements of the mission, and for each window who is alive, how, and how busy.

pub(crate) mod assemble;
pub(crate) mod liveness;
pub(crate) mod proofs;
pub(crate) mod rates;
pub(crate) mod restarts;
pub(crate) mod roles;
pub(crate) mod settle;
pub(crate) mod values;
pub(crate) mod windows;

use std::collections::BTreeMap;
use std::io;

use self::assemble::{Traffic, assemble};
use self::liveness::{Extent, Liveness};
use self::proofs::prove;
use self::rates::{Rates, rates};
use self::restarts::{Restarts, restarts};
use self::settle::{Frame, settle};
use self::values::Values;
use self::windows::Windows;
use super::{Elements, Graph, NodeId};
use crate::base::error::Result;
use crate::base::notice::{Notice, Notices};
use crate::base::time::{Span, Stamp};
use crate::evidence::claim::Name;
use crate::evidence::collector::{Collected, spool_error};
use crate::evidence::proof::{Key, Proof, Validity};
use crate::evidence::topology::Topology;
use crate::evidence::{Degree, Evidence};

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
    tracks: BTreeMap<Key, Liveness>,
    /// Per topic: its streams and their messages.
    rates: Traffic,
    restarts: Restarts,
    values: Values,
    /// Names of the user's that the bag does not know.
    strange: Vec<Notice>,
}

impl<'a> Builder<'a> {
    fn new(collected: &mut Collected, windows: &'a [Span], options: &Options) -> io::Result<Self> {
        let (proofs, values, strange) = prove(collected, options)?;
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
            strange,
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
        let strange = std::mem::take(&mut self.strange);
        let mut built = self.assemble(collected);
        let told = options.topology.notices.iter().cloned();
        built.notices.extend(told.chain(strange));
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
                Key::Node(node) | Key::Publish(node, _) | Key::Subscribe(_, node) => Some(node),
                Key::Topic(_) => None,
            };
            let restarts = node.and_then(|node| self.restarts.get(&node));
            let deaths: Vec<Stamp> = restarts.into_iter().flatten().map(|r| r.death).collect();
            let track = self.tracks.entry(proof.what).or_default();
            track.evidence = track.evidence.and(Evidence::row(proof.source));
            if proof.degree != Degree::Measured {
                track.quiet = track.quiet.min(proof.degree);
            }
            match &proof.when {
                Validity::Messages(at) => {
                    let stream = &collected.streams[*at];
                    let Some((streams, rates)) = self.rates.get(&stream.topic) else {
                        continue;
                    };
                    let place = streams.iter().position(|s| s == at).unwrap_or(0);
                    follow(
                        track,
                        rates,
                        place,
                        stream.latched,
                        self.mission.1,
                        proof.degree,
                    );
                    if !deaths.is_empty() {
                        let times = collected.messages.times(stream.times)?;
                        track.bound_all(&times, &deaths);
                    }
                }
                Validity::First(at) => {
                    let stream = &collected.streams[*at];
                    if let Some((streams, rates)) = self.rates.get(&stream.topic)
                        && let Some(place) = streams.iter().position(|s| s == at)
                        && let Some(trace) = rates.traces[place]
                    {
                        track.begin_all(&[trace.first], &[], proof.degree, &self.windows);
                    }
                }
                Validity::Signs { signs, ends, held } => {
                    let mut ends = ends.clone();
                    ends.extend(&deaths);
                    ends.sort_unstable();
                    track.sign_all(signs, &ends, proof.degree, &self.windows);
                    track.held |= held;
                }
                Validity::Begins { signs, ends } => {
                    let mut ends = ends.clone();
                    ends.extend(&deaths);
                    ends.sort_unstable();
                    track.begin_all(signs, &ends, proof.degree, &self.windows);
                }
                Validity::Like(_) => {}
                Validity::Whole => track.extent = track.extent.max(Extent::Whole),
                Validity::Always => track.extent = Extent::Always,
            }
        }
        for (node, restarts) in &self.restarts {
            let track = self.tracks.entry(Key::Node(*node)).or_default();
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

/// Puts the messages of one stream on a track, which `degree` ties them to.
fn follow(
    track: &mut Liveness,
    rates: &Rates,
    place: usize,
    latched: bool,
    end: Stamp,
    degree: Degree,
) {
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
        track.mark(tally.window, degree);
    }
}
