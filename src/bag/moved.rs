//! A bag whose recorder's clock was wrong by a known time: a reader that moves all its times.

use crate::bag::model::{ConnectionId, Message, Reader, Report, Sink};
use crate::base::error::Result;
use crate::base::time::{Span, Stamp};

/// A reader of another one's bag at other times.
pub(crate) struct Moved {
    reader: Box<dyn Reader>,
    /// The time by which its times are moved, in nanoseconds.
    by: i64,
}

impl Moved {
    pub(crate) fn new(reader: Box<dyn Reader>, by: i64) -> Self {
        Self { reader, by }
    }
}

impl Reader for Moved {
    fn is_straight(&self) -> bool {
        self.reader.is_straight()
    }

    fn span(&mut self) -> Result<Option<Span>> {
        let span = self.reader.span()?;
        Ok(span.map(|span| span.moved(self.by)))
    }

    fn read(&mut self, range: Option<Span>, sink: &mut dyn Sink) -> Result<Report> {
        let range = range.map(|range| range.moved(self.by.saturating_neg()));
        self.reader
            .read(range, &mut MovedSink { sink, by: self.by })
    }
}

/// A sink that moves all times.
struct MovedSink<'a> {
    sink: &'a mut dyn Sink,
    by: i64,
}

impl Sink for MovedSink<'_> {
    fn behind(&mut self) -> Option<&mut dyn Sink> {
        Some(&mut *self.sink)
    }

    fn stamps(&mut self, connection: ConnectionId, stamps: &[Stamp], sizes: Option<&[u32]>) {
        let stamps: Vec<Stamp> = stamps.iter().map(|time| time.plus(self.by)).collect();
        self.sink.stamps(connection, &stamps, sizes);
    }

    fn message(&mut self, message: Message<'_>) {
        let time = message.time.plus(self.by);
        self.sink.message(Message { time, ..message });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bag::{Input, OpenOptions, open};

    /// The first and the last time of a bag.
    struct Ends(Option<(Stamp, Stamp)>);

    impl Sink for Ends {
        fn stamps(&mut self, _: ConnectionId, stamps: &[Stamp], _: Option<&[u32]>) {
            for time in stamps {
                let ends = self.0.get_or_insert((*time, *time));
                *ends = (ends.0.min(*time), ends.1.max(*time));
            }
        }
    }

    fn ends(by: i64, range: Option<Span>) -> (Option<Span>, (Stamp, Stamp)) {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
        let reader = open(&Input::Path(path.into()), &OpenOptions::default()).unwrap();
        let mut reader = Moved::new(reader, by);
        let mut sink = Ends(None);
        reader.read(range, &mut sink).unwrap();
        (reader.span().unwrap(), sink.0.unwrap())
    }

    #[test]
    fn span_range_and_messages_are_moved_alike() {
        let (span, (first, last)) = ends(0, None);
        let (at, (from, to)) = ends(5, None);
        assert_eq!(at, span.map(|span| span.moved(5)));
        assert_eq!((from, to), (first.plus(5), last.plus(5)));
        let only = Span::new(first.plus(5), first.plus(6));
        assert_eq!(ends(5, Some(only)).1, (first.plus(5), first.plus(5)));
    }
}
