//! A mission while it is recorded: what is known so far, and its events as they become known.
//!
//! Nothing here knows the time of day: now is the time of the newest message. What is told while the recording grows is
//! for eyes; every file is written from the closed recording, as if nobody had followed it.

mod feed;

use super::collect::Collected;
use super::read::so_far;
use super::{Reading, Render, Unwatched, show};
use crate::bag::source::Temporary;
use crate::bag::{self, Growing, Growth, Input, Report, Tier, file_name};
use crate::base::error::{Error, Result};
use crate::base::time::{Period, Span, Stamp};
use crate::evidence::collector::Collector;
use crate::export::Output;
use crate::graph::window::Length;
use crate::mission::Mission;
pub(crate) use feed::{Feed, FindingFeed};

/// A recording that grows, and what has been collected of it.
pub(crate) struct Follow {
    reading: Reading,
    growing: Box<dyn Growing>,
    collector: Collector,
    /// The first message of all.
    origin: Option<Stamp>,
    /// The time before which messages were forgotten, but for the last of each topic.
    forgotten: Option<Stamp>,
    keep: Period,
}

/// What is known of a growing recording.
pub(crate) struct SoFar {
    pub(crate) mission: Mission,
    /// The time from which on every message is in it.
    pub(crate) from: Stamp,
    /// The time of the newest message.
    pub(crate) now: Stamp,
}

impl Follow {
    /// Begins to follow the only input of `reading`; of its messages the last `keep` are kept.
    ///
    /// # Errors
    /// Where it cannot be read, or does not grow.
    pub(crate) fn new(reading: Reading, keep: Period) -> Result<Self> {
        let [input] = &reading.inputs[..] else {
            return Err(Error::usage("one recording is followed", "name one"));
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

    /// Collects what has become readable since the last time.
    ///
    /// # Errors
    /// Where the recording is gone, or a temporary file cannot be used.
    pub(crate) fn poll(&mut self) -> Result<Growth> {
        let growth = self.growing.poll(&mut self.collector.on(&mut |_, _| {}))?;
        if let Some((first, last, _)) = self.collector.extent().filter(|_| growth == Growth::More) {
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

    /// The number of connections and claims, which grows with everything that was not known before.
    pub(crate) fn known(&self) -> usize {
        self.collector.known()
    }

    /// What the last `most` messages tell, about, in windows of `length`; `None` if there is no message yet.
    ///
    /// # Errors
    /// As for reading the recording.
    pub(crate) fn so_far(&self, most: u64, length: Length) -> Result<Option<SoFar>> {
        let Some((first, last, count)) = self.collector.extent() else {
            return Ok(None);
        };
        let first = self.forgotten.unwrap_or(first);
        let share = (most as f64 / count.max(1) as f64).min(1.0);
        #[expect(clippy::cast_possible_truncation, reason = "a part of an i64")]
        let kept = (last.since(first) as f64 * share) as i64;
        let newest = (share < 1.0).then(|| last.plus(-kept));
        let from = newest.or(self.forgotten).unwrap_or(Stamp(i64::MIN));
        let recorded = self.collector.so_far(from)?;
        let Some(span) = recorded.span else {
            return Ok(None);
        };
        let mut reading = self.reading.clone();
        reading.division.length = length;
        // Events are counted from the first message, windows divide what is kept.
        let start = match length {
            Length::All => self
                .origin
                .map_or(span.start, |origin| origin.min(span.start)),
            _ => span.start.max(from),
        };
        let collected = Collected {
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

    /// The reading of the recording where it lies now.
    pub(crate) fn closed(&self) -> Reading {
        Reading {
            inputs: vec![Input::Path(self.growing.path().to_owned())],
            ..self.reading.clone()
        }
    }

    fn report(&self) -> Report {
        Report {
            name: file_name(self.growing.path()),
            format: String::new(),
            compression: Vec::new(),
            tier: Tier::Forward,
            tier_reason: None,
            complete: true,
            bytes_read: 0,
            file_bytes: 0,
            facts: Vec::new(),
        }
    }
}

/// A mission as a page that its server renews.
///
/// # Errors
/// Where it cannot be drawn, or the folder for temporary files cannot be used.
pub(crate) fn page(job: &Render, mission: Mission) -> Result<Vec<u8>> {
    let folder = Temporary::new()?;
    let path = folder.path().join("page.html");
    let mut job = Render {
        outputs: vec![Output::parse(&path.display().to_string(), None)?],
        ..job.clone()
    };
    job.sequence.is_live = true;
    show(&job, mission, &mut Unwatched)?;
    std::fs::read(&path).map_err(Error::io("read", &path))
}

#[cfg(test)]
mod tests;
