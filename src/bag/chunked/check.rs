//! The messages found in a chunk, kept until the index that follows it has been read.

use crate::bag::adapters::Gather;
use crate::bag::model::{ConnectionId, Sink};
use crate::base::time::Stamp;

/// An index record after a chunk.
pub(super) struct Behind {
    pub(super) id: ConnectionId,
    pub(super) count: u32,
    /// The times of the messages; none if there are too many.
    pub(super) stamps: Vec<Stamp>,
}

/// The messages found since the last chunk began.
#[derive(Default)]
pub(super) struct ChunkMessages {
    gather: Gather,
    /// The number of messages of the bag that have been or will be reported.
    pub(super) messages: u64,
    /// Whether the chunk is damaged, so that its index is used instead.
    doubtful: bool,
    /// Whether another record followed the chunk: it may have been a chunk, and the index records after it may be its
    /// own.
    interrupted: bool,
    /// Index records that contradict the chunk.
    behind: Vec<Behind>,
    /// Whether one has the same messages at other times.
    misdated: bool,
    /// The number of messages in the index but not in the chunk; `surplus` is the converse.
    missing: u64,
    surplus: u64,
}

impl ChunkMessages {
    /// Adds one message.
    pub(super) fn add(&mut self, id: ConnectionId, time: Stamp, size: u32, sink: &mut dyn Sink) {
        self.messages += 1;
        self.gather.add(id, time, size, sink);
    }

    /// Marks the chunk as damaged and keeps only plausible messages: times inside `times`, none twice.
    pub(super) fn doubt(&mut self, times: Option<(Stamp, Stamp)>) {
        self.doubtful = true;
        if let Some((first, last)) = times {
            self.messages -= self.gather.retain(|at| first <= at && at <= last);
        }
    }

    /// Records that another record than its index followed the chunk.
    pub(super) fn interrupt(&mut self) {
        self.interrupted = true;
    }

    /// Passes on what was found so far, unless the index may be needed instead.
    pub(super) fn spill(&mut self, sink: &mut dyn Sink) {
        if !self.doubtful {
            self.gather.spill(sink);
        }
    }

    /// Whether an index record belongs to a chunk that was not seen, not to the last one.
    pub(super) fn is_of_another(&self, id: ConnectionId, stamps: &[Stamp]) -> bool {
        self.interrupted && !self.gather.holds(id, stamps)
    }

    /// Adds an index record.
    pub(super) fn behind(&mut self, record: Behind) {
        let (found, count) = (self.gather.count(record.id), u64::from(record.count));
        self.missing += count.saturating_sub(found);
        self.surplus += found.saturating_sub(count);
        let is_whole = record.stamps.len() as u64 == count;
        let is_needed = self.interrupted || self.doubtful && found != count || found < count;
        if !is_needed && is_whole && found == count {
            self.misdated |= !self.gather.holds(record.id, &record.stamps);
        } else if is_needed && is_whole {
            self.behind.push(record);
        }
    }

    /// Whether the index states other times than the messages of the chunk have.
    pub(super) fn is_misdated(&mut self) -> bool {
        std::mem::take(&mut self.misdated)
    }

    /// Reports all messages to `sink`; returns how many were only in the index, and how many only in the chunk. If the
    /// two disagree, the index is used if the chunk is damaged or lacks more messages than it has in excess.
    pub(super) fn report_all(&mut self, sink: &mut dyn Sink) -> (u64, u64) {
        let believed = self.doubtful || self.missing > self.surplus;
        let mut witnessed = 0;
        for record in self.behind.drain(..).filter(|_| believed) {
            // Messages that were already passed on cannot be taken back.
            let Some(found) = self.gather.take(record.id) else {
                continue;
            };
            let known = record.stamps.len() as u64;
            witnessed += known.saturating_sub(found);
            self.messages = self.messages - found + known;
            if known > 0 {
                sink.stamps(record.id, &record.stamps, None);
            }
        }
        self.gather.flush(sink);
        let surplus = std::mem::take(&mut self.surplus);
        self.missing = 0;
        (self.doubtful, self.interrupted) = (false, false);
        (witnessed, surplus)
    }
}
