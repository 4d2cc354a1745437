//! A mission while it is recorded: the mission so far, and its events as they are detected.
//!
//! The current time is that of the newest message, not of the clock. Only printed lines come from the growing
//! recording; all files are written from the closed one.

mod feed;

use std::path::Path;

use super::collect::Collected;
use super::read::{read, so_far};
use super::{Reading, Unwatched};
pub use crate::bag::Growth;
use crate::bag::{self, Growing, Input, Report, Tier, file_name};
use crate::base::cast;
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, Notices};
use crate::base::time::{Period, Span, Stamp};
use crate::evidence::clock::is_sure;
use crate::evidence::collector::Collector;
use crate::graph::window::Length;
use crate::mission::Mission;
pub use feed::{Feed, FindingFeed};

/// A growing recording and what has been collected from it.
pub struct Follow {
    reading: Reading,
    growing: Box<dyn Growing>,
    collector: Collector,
    /// The time of the very first message.
    origin: Option<Stamp>,
    /// The time before which messages were dropped, except the last of each topic.
    forgotten: Option<Stamp>,
    keep: Period,
}

/// The mission of a growing recording so far.
pub struct SoFar {
    /// The mission.
    pub mission: Mission,
    /// The time from which on it contains all messages.
    pub from: Stamp,
    /// The time of the newest message.
    pub now: Stamp,
}

impl SoFar {
    /// Whether earlier messages of the recording were dropped.
    fn is_part(&self) -> bool {
        self.from > Stamp::MIN
    }
}

impl Follow {
    /// Begins to follow the only input of `reading`, keeping the messages of the last `keep`.
    ///
    /// # Errors
    /// If it cannot be read or cannot grow.
    pub fn new(reading: Reading, keep: Period) -> Result<Self> {
        let [input] = &reading.inputs[..] else {
            return Err(Error::usage(
                "one recording is followed",
                "give a single recording",
            ));
        };
        let growing = bag::follow(input)?;
        let mut options = reading.collect.clone();
        options.payload_bytes = 0;
        let mut collector = Collector::new(options);
        collector.bag(&mut |_, _| {});
        Ok(Self {
            reading,
            growing,
            collector,
            origin: None,
            forgotten: None,
            keep,
        })
    }

    /// Collects the messages that have become readable since the last call.
    ///
    /// # Errors
    /// If the recording no longer exists, or a temporary file cannot be used.
    pub fn poll(&mut self) -> Result<Growth> {
        let growth = self.growing.poll(&mut self.collector.on(&mut |_, _| {}))?;
        // A message at an impossible time makes no others old.
        let is_sure = |(first, last, _): &(Stamp, Stamp, u64)| is_sure(Span::new(*first, *last));
        let extent = self.collector.extent().filter(is_sure);
        if let Some((first, last, _)) = extent.filter(|_| growth == Growth::More) {
            self.origin.get_or_insert(first);
            let keep = self.keep.nanos();
            let begins = self.forgotten.unwrap_or(first);
            if last.since(begins) > keep.saturating_add(keep / 4) {
                let from = last.plus(-keep);
                self.collector.forget(from)?;
                self.forgotten = Some(from);
            }
        }
        Ok(growth)
    }

    /// What was lost of the recording so far and, with `is_over`, what reading the closed one reports besides.
    ///
    /// # Errors
    /// If it cannot be read, or a temporary file cannot be used.
    pub(crate) fn losses(&self, is_over: bool) -> Result<Notices> {
        let from = self.forgotten.unwrap_or(Stamp::MIN);
        let known = self.collector.so_far(from)?.notices;
        let closed = is_over.then(|| read(&self.closed(), &mut Unwatched));
        let closed = closed.transpose()?.map(|mission| mission.notices);
        let is_new = |new: &Notice| known.iter().all(|known| known.text != new.text);
        let new = closed.iter().flat_map(Notices::iter).filter(is_new);
        let mut losses = Notices::new();
        let all = known.iter().chain(new);
        losses.extend(all.filter(|notice| notice.kind.is_loss()));
        Ok(losses)
    }

    /// The path of the recording.
    pub(crate) fn path(&self) -> &Path {
        self.growing.path()
    }

    /// The number of connections and observations, which grows with every new fact.
    pub(crate) fn known(&self) -> usize {
        self.collector.known()
    }

    /// The mission of about the last `most` messages, in windows of `length`; `None` if there is no message yet.
    ///
    /// # Errors
    /// As for reading the recording.
    pub fn so_far(&self, most: u64, length: Length) -> Result<Option<SoFar>> {
        let Some((first, last, count)) = self.collector.extent() else {
            return Ok(None);
        };
        let first = self.forgotten.unwrap_or(first);
        let share = (most as f64 / count.max(1) as f64).min(1.0);
        let kept = cast::to_i64(last.since(first) as f64 * share);
        let newest = (share < 1.0).then(|| last.plus(-kept));
        let from = newest.or(self.forgotten).unwrap_or(Stamp::MIN);
        let recorded = self.collector.so_far(from)?;
        let Some(span) = recorded.span else {
            return Ok(None);
        };
        let mut reading = self.reading.clone();
        reading.division.length = length;
        // Times of events count from the first message; only the kept time is divided into windows.
        let start = match length {
            Length::All => self.origin.map_or(span.start, |at| at.min(span.start)),
            _ => span.start.max(from),
        };
        let collected = Collected {
            inputs: reading.inputs.clone(),
            reports: vec![self.report()],
            recorded,
            range: Span { start, ..span },
        };
        Ok(Some(SoFar {
            mission: so_far(&collected, &reading)?,
            from,
            now: span.end.plus(-1),
        }))
    }

    /// The reading of the recording under its current path.
    pub(crate) fn closed(&self) -> Reading {
        Reading {
            inputs: vec![Input::Path(self.growing.path().to_owned())],
            ..self.reading.clone()
        }
    }

    fn report(&self) -> Report {
        Report {
            name: file_name(self.growing.path()),
            tier: Tier::Forward,
            complete: true,
            ..Report::default()
        }
    }
}

#[cfg(test)]
mod tests;
