//! From proofs to graphs: the elements of the mission, and for each window who is alive, how, and how busy.

pub(crate) mod assemble;
pub(crate) mod liveness;
pub(crate) mod merged;
pub(crate) mod proofs;
pub(crate) mod rates;
pub(crate) mod restarts;
pub(crate) mod settle;
pub(crate) mod tempo;
pub(crate) mod values;
pub(crate) mod windows;

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::Arc;

use self::assemble::{Sight, Traffic, assemble};
use self::liveness::{Extent, Liveness, Pulse};
use self::proofs::prove;
use self::rates::{Rates, rates};
use self::restarts::{Restarts, restarts};
use self::settle::settle;
use self::values::Values;
use self::windows::Windows;
use super::lives::Lives;
use super::{Elements, Graph};
use crate::base::error::Result;
use crate::base::notice::Notices;
use crate::base::time::{Span, Stamp};
use crate::evidence::claim::Name;
use crate::evidence::code::{Code, matching};
use crate::evidence::collector::{Collected, spool_error};
use crate::evidence::proof::{Key, Proof, Validity};
use crate::evidence::topology::Topology;
use crate::evidence::{Evidence, SOURCES};

/// How graphs are built.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Windows of silence before something that never speaks again counts as gone.
    pub grace: usize,
    /// Whether nodes whose names differ only in an anonymous suffix are one, under the name of their role.
    pub roles: bool,
    /// Nodes and edges that the user knows of.
    pub topology: Topology,
    /// What source code declares.
    pub code: Option<Arc<Code>>,
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
    /// When everything lived, and how it sent.
    pub lives: Lives,
    /// What went wrong without stopping us.
    pub notices: Notices,
    /// What source code offers and was not drawn, a line each.
    pub undrawn: Vec<String>,
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
    /// What is worth saying about what was proved, and what source code offers beyond it.
    code: matching::Outcome,
}

impl<'a> Builder<'a> {
    fn new(collected: &mut Collected, windows: &'a [Span], options: &Options) -> io::Result<Self> {
        let (proofs, values, code) = prove(collected, options)?;
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
            code,
        })
    }

    fn run(mut self, collected: &mut Collected, options: &Options) -> io::Result<Built> {
        self.count(collected)?;
        self.restarts = restarts(collected, &self.proofs)?;
        self.track(collected)?;
        merged::fall_silent(&mut self.tracks, &self.rates, collected, self.mission.1);
        settle(&mut self.tracks, &self.proofs, &self.restarts, self.mission);
        let code = std::mem::take(&mut self.code);
        let mut built = self.assemble(collected, options.grace);
        let told = options.topology.notices.iter().cloned();
        built.notices.extend(told.chain(code.notices));
        built.undrawn = code.undrawn;
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
        let sent = sent(&self.proofs);
        for proof in &self.proofs {
            let node = match proof.what {
                Key::Node(node) | Key::Publish(node, _) | Key::Subscribe(_, node) => Some(node),
                Key::Topic(_) => None,
            };
            let restarts = node.and_then(|node| self.restarts.get(&node));
            let restarts = restarts.map_or(&[][..], Vec::as_slice);
            let deaths: Vec<Stamp> = restarts.iter().map(|r| r.death).collect();
            let track = self.tracks.entry(proof.what).or_default();
            track.lasts |= lasts(&proof.when);
            track.evidence = track.evidence.and(Evidence::row(proof.source));
            track.degree = track.degree.min(proof.degree);
            match &proof.when {
                Validity::Messages(at) => {
                    let stream = &collected.streams[*at];
                    let Some((streams, rates)) = self.rates.get(&stream.topic) else {
                        continue;
                    };
                    let place = streams.iter().position(|s| s == at).unwrap_or(0);
                    let what = Followed {
                        known: node.is_none() && sent.contains(at),
                        beats: stream.connection.topic.as_str() != "/rosout",
                        restarts,
                    };
                    follow(track, rates, place, &what);
                    if !deaths.is_empty() {
                        let times = collected.messages.times(stream.times)?;
                        track.bound_all(&times, &deaths);
                    }
                }
                Validity::First(at) => {
                    let stream = &collected.streams[*at];
                    if let Some((streams, rates)) = self.rates.get(&stream.topic)
                        && let Some(place) = streams.iter().position(|s| s == at)
                        && let Some((first, _)) = rates.traces[place]
                    {
                        track.bound_all(&[first], &[]);
                    }
                }
                Validity::Signs { signs, ends } => {
                    let ends = together(ends, &deaths);
                    track.sign_all(signs, &ends);
                    if SOURCES.get(proof.source).is_some_and(|s| s.own) {
                        track.heard = track.heard.max(signs.last().copied());
                        track.speaks = true;
                    }
                }
                Validity::Begins { signs, ends } => {
                    let ends = together(ends, &deaths);
                    track.bound_all(signs, &ends);
                }
                Validity::Moments(signs) => track.bound_all(signs, &deaths),
                Validity::Unending => track.unending = true,
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

    fn assemble(self, collected: &Collected, grace: usize) -> Built {
        let sight = Sight {
            windows: &self.windows,
            grace,
            mission: self.mission,
        };
        assemble(&self.tracks, &self.rates, &self.values, &sight, collected)
    }
}

/// The streams whose messages are somebody's: they prove a publication.
fn sent(proofs: &[Proof]) -> BTreeSet<usize> {
    let sent = proofs.iter().filter_map(|proof| match proof {
        Proof {
            what: Key::Publish(..),
            when: Validity::Messages(at),
            ..
        } => Some(*at),
        _ => None,
    });
    sent.collect()
}

/// Whether a reason holds on after its last sign.
fn lasts(when: &Validity) -> bool {
    !matches!(when, Validity::Moments(_) | Validity::Like(_))
}

/// Two lists of times as one, sorted.
fn together(a: &[Stamp], b: &[Stamp]) -> Vec<Stamp> {
    let mut all = [a, b].concat();
    all.sort_unstable();
    all
}

/// A latched topic with more messages than this is published anew all the time.
const LATCHED: u64 = 20;

/// What is known of a stream that is followed.
struct Followed<'a> {
    /// Whether it is a topic's, whose senders are known: it lives as long as its publications.
    known: bool,
    /// Whether its rhythm tells that its sender is there; nobody logs for that.
    beats: bool,
    restarts: &'a [restarts::Restart],
}

/// Puts the messages of one stream on a track: of a publication, or of a topic.
fn follow(track: &mut Liveness, rates: &Rates, place: usize, what: &Followed<'_>) {
    let sender = rates.of.get(place).and_then(|of| rates.senders.get(*of));
    let spoke = rates.traces.get(place).copied().flatten();
    let (Some((first, last)), Some(sender)) = (spoke, sender) else {
        track.extent = track.extent.max(Extent::Whole);
        return;
    };
    let count: u64 = sender.stretches.iter().map(|s| s.count).sum();
    let latched = sender.latched && count <= LATCHED;
    track.senders.0 += 1;
    track.senders.1 += u32::from(latched);
    if what.known {
        track.seen.extend([first, last]);
        return;
    }
    track.signs.extend([first, last]);
    track.heard = track.heard.max(Some(last));
    let pulse = Pulse::of(&sender.stretches, what.restarts);
    track
        .pulses
        .extend(pulse.filter(|_| what.beats && !latched));
}
