//! Graphs from findings: the elements of the mission with their lifetimes, once; then for each window the
//! states and rates of all elements.

pub(crate) mod assemble;
pub(crate) mod history;
pub(crate) mod lifetime;
pub(crate) mod lifetimes;
pub(crate) mod liveness;
pub(crate) mod measures;
pub(crate) mod merged;
pub(crate) mod rates;
pub(crate) mod recordings;
pub(crate) mod restarts;
pub(crate) mod senders;
pub(crate) mod tempo;
pub(crate) mod tracks;
pub(crate) mod windows;

use super::history::{Life, Sending};
use super::{Elements, Graph, PerElement};
use crate::base::error::Result;
use crate::base::notice::Notices;
use crate::base::time::Span;
use crate::evidence::EvidenceLine;
use crate::evidence::collector::Recorded;
use crate::evidence::conclude::{self, conclude};

pub(crate) use assemble::{Windowed, graphs};
pub(crate) use history::{History, Record, made};
pub(crate) use rates::{TopicCount, counts};
pub(crate) use restarts::unread;
pub(crate) use senders::traffic;

/// The result of building all graphs for one division of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Built {
    /// All nodes, topics and edges of the mission.
    pub elements: Elements,
    /// A graph per window.
    pub graphs: Vec<Graph>,
    /// The number of messages of each window.
    pub messages: Vec<u64>,
    /// The lifetimes of each element.
    pub lives: PerElement<Vec<Life>>,
    /// The messages of every sender.
    pub sending: Sending,
    /// Notices about the user's files.
    pub notices: Notices,
    /// Every requested piece of evidence.
    pub lines: Vec<EvidenceLine>,
}

/// Draws the conclusions and builds the graph of each window. Windows are sorted by start, none inside another; they
/// may overlap.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub fn build(
    recorded: &Recorded,
    windows: &[Span],
    options: &conclude::ConcludeOptions,
) -> Result<Built> {
    let mut findings = conclude(recorded, options)?;
    let traffic = traffic(recorded, &findings)?;
    let history = made(recorded, &mut findings, &traffic)?;
    let windowed = graphs(recorded, &findings, &history, windows)?;
    Ok(Built {
        lives: PerElement::new(&history.elements, |what| {
            let record = history.records.of(what);
            record.map_or_else(Vec::new, |record| record.lives.clone())
        }),
        elements: history.elements,
        graphs: windowed.graphs.iter().collect(),
        messages: windowed.messages,
        sending: history.sending,
        notices: findings.notices,
        lines: findings.lines,
    })
}
