//! Reads the header sequence numbers of single messages before and after gaps, which the first reading skipped.

use std::collections::BTreeSet;

use super::Reading;
use super::collect::Collected;
use super::inputs::{each_once, in_time};
use crate::bag::{self, Connection, ConnectionId, Message, OpenOptions, Sink, Want};
use crate::base::error::Result;
use crate::base::time::{Span, Stamp};
use crate::evidence::numbers::{self, Number};

/// The longest time between two messages that are read at once, in nanoseconds: they are in one chunk.
const AT_ONCE_NS: i64 = 100_000_000;

/// Reads the sequence numbers of these messages, given by stream and time. Skips pipes.
pub(super) fn probe(
    reading: &Reading,
    collected: &mut Collected,
    messages: &BTreeSet<(usize, Stamp)>,
) -> Result<()> {
    if messages.is_empty() {
        return Ok(());
    }
    let (inputs, _) = each_once(&reading.inputs)?;
    for (bag, input) in inputs.iter().enumerate() {
        let streams = &collected.recorded.streams;
        let of_bag = messages.iter().filter(|(at, _)| streams[*at].bag == bag);
        let wanted = of_bag.map(|(at, time)| (*time, *at, streams[*at].connection.id));
        let mut wanted: Vec<(Stamp, usize, ConnectionId)> = wanted.collect();
        if wanted.is_empty() || input.is_pipe() {
            continue;
        }
        wanted.sort_unstable();
        let reader = bag::open(input, &OpenOptions::default())?;
        let mut reader = in_time(reading, input, reader);
        for wanted in wanted.chunk_by(|a, b| b.0.since(a.0) <= AT_ONCE_NS) {
            let mut sink = Probe {
                wanted,
                found: Vec::new(),
            };
            let span = Span::new(wanted[0].0, wanted[wanted.len() - 1].0.plus(1));
            reader.read(Some(span), &mut sink)?;
            for (at, time, number) in sink.found {
                let numbers = collected.recorded.numbers.grown(at).get_or_insert_default();
                numbers.keep(time, number);
            }
        }
    }
    Ok(())
}

/// A sink for the sequence numbers of a few messages.
struct Probe<'a> {
    wanted: &'a [(Stamp, usize, ConnectionId)],
    found: Vec<(usize, Stamp, Number)>,
}

impl Sink for Probe<'_> {
    fn connection(&mut self, connection: &Connection) -> Want {
        if self.wanted.iter().any(|(.., id)| *id == connection.id) {
            Want::Head(numbers::HEAD)
        } else {
            Want::Stamps
        }
    }

    fn stamps(&mut self, _: ConnectionId, _: &[Stamp], _: Option<&[u32]>) {}

    fn message(&mut self, message: Message<'_>) {
        let is_it = |(time, _, id): &&(Stamp, usize, ConnectionId)| {
            (*time, *id) == (message.time, message.connection)
        };
        if let Some((time, at, _)) = self.wanted.iter().find(is_it) {
            let number = Number::of(message.data);
            self.found.extend(number.map(|number| (*at, *time, number)));
        }
    }
}
