//! What the bags of a mission contain about its graph, once they are read.

use std::collections::BTreeMap;

use crate::bag::straight::ClockFall;
use crate::base::notice::Notices;
use crate::base::time::{Span, Stamp};
use crate::evidence::inference::Stream;
use crate::evidence::numbers::Numbers;
use crate::evidence::observation::Observations;
use crate::evidence::offsets::ClockOffset;
use crate::evidence::times::Stamps;

/// Everything that the bags of a mission contain about its graph.
#[derive(Debug)]
pub struct Recorded {
    pub(crate) streams: Vec<Stream>,
    pub(crate) messages: Stamps,
    /// The numbers in the headers of streams, by index, as far as they were read.
    pub(crate) numbers: BTreeMap<usize, Numbers>,
    pub(crate) facts: Observations,
    /// The texts of the requested topic, sorted by time.
    pub texts: Vec<(Stamp, String)>,
    /// Problems that did not stop the reading.
    pub notices: Notices,
    /// The points at which a recorder's clock went back, sorted by time.
    pub(crate) falls: Vec<ClockFall>,
    /// Whether runs overlap in time, since they could not be shifted.
    pub(crate) overlaps: bool,
    /// The differences between the clocks of several recorders.
    pub(crate) offsets: Vec<ClockOffset>,
    /// The time from the first log time to the last plus 1 ns, without messages at impossible times; `None` if there is
    /// no message.
    pub span: Option<Span>,
}

impl Recorded {
    /// Marks the streams without a message in the part of the recording that was read. In a part from the
    /// beginning on, they have no latched message yet.
    pub(crate) fn mark_outside(&mut self, is_first: bool) {
        for stream in &mut self.streams {
            stream.is_outside = self.messages.bounds(stream.times).is_none();
            stream.latched &= !(stream.is_outside && is_first);
        }
    }

    /// The span of all messages.
    pub(super) fn measure(&self) -> Option<Span> {
        let bounds = self.streams.iter();
        let bounds = bounds.filter_map(|stream| self.messages.bounds(stream.times));
        let (first, last) = bounds.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        Some(Span::new(first, last.plus(1)))
    }
}
