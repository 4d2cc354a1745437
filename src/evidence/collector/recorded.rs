//! What the bags of a mission contain about its graph, once they are read.

use std::collections::BTreeMap;
use std::io;

use crate::bag::straight::ClockFall;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::{Span, Stamp};
use crate::evidence::inference::Stream;
use crate::evidence::numbers::Numbers;
use crate::evidence::observation::Observations;
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
    /// The credible times; `None` if all of them are.
    pub(crate) believed: Option<Span>,
    /// The time from the first log time to the last plus 1 ns, without messages at impossible times; `None` if there is
    /// no message.
    pub span: Option<Span>,
}

impl Recorded {
    /// Whether a time is credible.
    pub(crate) fn believes(&self, time: Stamp) -> bool {
        self.believed.is_none_or(|span| span.contains(time))
    }

    /// Marks the streams without a message in the part of the recording that was read. In a part from the
    /// beginning on, they have no latched message yet.
    pub(crate) fn mark_outside(&mut self, is_first: bool) {
        for stream in &mut self.streams {
            stream.is_outside = self.messages.bounds(stream.times).is_none();
            stream.latched &= !(stream.is_outside && is_first);
        }
    }

    /// Finds the span of all messages at credible times, and counts the others.
    pub(super) fn measure(&mut self) -> io::Result<Option<Span>> {
        let mut span: Option<Span> = None;
        let mut aside = 0;
        for at in 0..self.streams.len() {
            let id = self.streams[at].times;
            let Some(bounds) = self.messages.bounds(id) else {
                continue;
            };
            if self.believes(bounds.0) && self.believes(bounds.1) {
                widen(&mut span, bounds);
                continue;
            }
            let believed = self.believed;
            self.messages.merge(&[id], |t| {
                if believed.is_none_or(|span| span.contains(t.time)) {
                    widen(&mut span, (t.time, t.time));
                } else {
                    aside += 1;
                }
            })?;
        }
        if aside > 0 {
            let text = "message at an impossible time, set aside";
            self.notices
                .add(Notice::counted(NoticeKind::ImpossibleTime, aside, text));
        }
        Ok(span)
    }
}

fn widen(span: &mut Option<Span>, (first, last): (Stamp, Stamp)) {
    let all = span.get_or_insert(Span::new(first, last.plus(1)));
    all.start = all.start.min(first);
    all.end = all.end.max(last.plus(1));
}
