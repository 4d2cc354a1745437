//! Sequence numbers in the headers of messages (ROS 1), which start over with their publisher.
//!
//! Only those on both sides of a possible restart are kept: at most a few per stream.

use std::collections::BTreeMap;

use crate::bag::{Connection, Encoding};
use crate::base::rhythm::{BEGUN_AGAIN, BEGUN_LONG, FIRST_RECORD, GAP_NS};
use crate::base::time::{Span, Stamp};
use crate::evidence::message::dynamic::MessageSchema;

/// The number of bytes from a payload's start to the end of its header's stamp.
pub(crate) const HEAD: usize = 12;
/// The most possible restarts per stream at which numbers are kept: no node restarts more often in a mission, and a stream of
/// random numbers, which seem to start over all the time, takes no more than 100 kB.
const MOST: usize = 4096;

/// The number in a header, with the stamp beside it as in the message: only copies share both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Number {
    pub(crate) number: u32,
    pub(crate) stamp: u64,
}

impl Number {
    /// The number at the start of a payload; `None` if it is too short.
    pub(crate) fn of(payload: &[u8]) -> Option<Self> {
        Some(Self {
            number: u32::from_le_bytes(payload.get(..4)?.try_into().ok()?),
            stamp: u64::from_le_bytes(payload.get(4..HEAD)?.try_into().ok()?),
        })
    }

    /// The stamp as a time.
    pub(crate) fn time(self) -> Stamp {
        let [seconds, nanos] = [self.stamp, self.stamp >> 32].map(|part| part & 0xffff_ffff);
        Stamp((seconds * 1_000_000_000 + nanos).cast_signed())
    }

    /// Whether it is so small, after `before`, that its publisher may just have started.
    pub(crate) fn begins_after(self, before: Self) -> bool {
        self.number <= BEGUN_AGAIN && self.number < before.number || self.is_first_after(before)
    }

    /// Whether both are the first of a process, and not copies of one message.
    fn is_first_after(self, before: Self) -> bool {
        [self.number, before.number] == [FIRST_RECORD; 2] && self.stamp != before.stamp
    }
}

/// The numbers of one stream.
#[derive(Clone, Debug, Default)]
pub(crate) struct Numbers {
    /// The number of messages examined.
    pub(crate) read: u64,
    last: Option<(Stamp, Number)>,
    kept: BTreeMap<Stamp, Number>,
    /// The number of messages with a larger number than the previous one, and the times of those with a
    /// smaller one.
    grew: u64,
    fell: Vec<Stamp>,
    /// The times on both sides of each point at which numbers start over after a gap.
    pub(crate) falls: Vec<(Stamp, Stamp)>,
}

impl Numbers {
    /// Examines the next message of the stream, in the order of the file.
    pub(crate) fn add(&mut self, time: Stamp, payload: &[u8]) {
        let Some(number) = Number::of(payload) else {
            return;
        };
        self.read += 1;
        match self.last.replace((time, number)) {
            None => self.keep(time, number),
            Some((since, before)) => {
                self.grew += u64::from(number.number > before.number);
                let falls = number.number < before.number || number.is_first_after(before);
                if falls && self.fell.len() < MOST {
                    self.fell.push(time);
                }
                let is_sure = time.since(since) >= GAP_NS || before.number > BEGUN_LONG;
                if number.begins_after(before) && is_sure {
                    self.keep(since, before);
                    self.keep(time, number);
                    if self.falls.len() < MOST {
                        self.falls.push((since, time));
                    }
                }
            }
        }
    }

    /// Keeps the number of the message at this time.
    pub(crate) fn keep(&mut self, time: Stamp, number: Number) {
        if self.kept.len() < MOST {
            self.kept.insert(time, number);
        }
    }

    /// Drops the numbers of messages at other times than these.
    pub(crate) fn clip(&mut self, span: Span) {
        self.last = self.last.filter(|(time, _)| span.contains(*time));
        self.kept.retain(|time, _| span.contains(*time));
        self.fell.retain(|time| span.contains(*time));
        let is_inside = |(from, to): &(Stamp, Stamp)| span.contains(*from) && span.contains(*to);
        self.falls.retain(is_inside);
    }

    /// Whether the numbers continued to grow from the last message before `from` to the first after `to`.
    pub(crate) fn count_on(&self, from: Stamp, to: Stamp) -> bool {
        let is_counter = self.grew * 2 >= self.read;
        is_counter && !self.fell.iter().any(|at| from < *at && *at <= to)
    }

    /// Whether all of `count` messages are from one sender at a time: their numbers grow, and start over only
    /// after gaps.
    pub(crate) fn is_one_counter(&self, count: u64) -> bool {
        let again = self.fell.len() as u64;
        let begun = self.falls.len() as u64;
        self.read == count && count > 1 && again == begun && self.grew + again + 1 == count
    }

    /// The number of the message at this time, if it was kept.
    pub(crate) fn at(&self, time: Stamp) -> Option<Number> {
        let last = self.last.filter(|(at, _)| *at == time);
        let kept = self.kept.get(&time).copied();
        kept.or(last.map(|(_, number)| number))
    }
}

/// Whether the messages of a connection begin with a header with a sequence number, according to its definition.
pub(crate) fn is_numbered(connection: &Connection, schema: &MessageSchema) -> bool {
    connection.encoding == Encoding::Ros1 && schema.has_header()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn payload(number: u32, stamp: u64) -> Vec<u8> {
        [&number.to_le_bytes()[..], &stamp.to_le_bytes()].concat()
    }

    #[test]
    fn a_process_continues_until_its_sequence_numbers_drop() {
        let stated = |numbers: &[u32]| {
            let mut all = Numbers::default();
            for (at, number) in (0..).zip(numbers) {
                all.add(Stamp(at), &payload(*number, 5));
            }
            [(1, 2), (2, 3)].map(|(from, to)| all.count_on(Stamp(from), Stamp(to)))
        };
        assert_eq!(stated(&[7, 8, 9, 12]), [true, true]);
        assert_eq!(stated(&[7, 8, 3, 4]), [false, true]);
        assert_eq!(stated(&[0, 0, 0, 0]), [false, false]);
    }

    #[test]
    fn the_numbers_of_two_senders_are_no_counter() {
        let is_one = |numbers: &[u32]| {
            let mut all = Numbers::default();
            for (at, number) in (0..).zip(numbers) {
                all.add(Stamp(at * 2_000_000_000), &payload(*number, 5));
            }
            all.is_one_counter(numbers.len() as u64)
        };
        assert!(is_one(&[7, 8, 10, 1, 2]));
        assert!(!is_one(&[7, 101, 8, 102]));
        assert!(!is_one(&[7, 7, 7]));
    }

    #[test]
    fn restarted_sequence_numbers_are_kept() {
        let mut all = Numbers::default();
        let seconds = |s: i64| Stamp(s * 1_000_000_000);
        for (at, number) in [(0, 7), (1, 8), (2, 9), (10, 2), (11, 3), (12, 300), (13, 6)] {
            all.add(seconds(at), &payload(number, 5));
        }
        all.add(seconds(14), &[1, 2, 3]);
        let number = |s| all.at(seconds(s)).map(|n| n.number);
        assert_eq!(all.read, 7);
        assert_eq!(
            [0, 1, 2, 10, 12, 13].map(number),
            [Some(7), None, Some(9), Some(2), None, Some(6)]
        );
    }
}
