//! What the bags of a mission contain about its graph, once they are read.

use std::collections::BTreeMap;
use std::io;

use super::spool_error;
use crate::bag::straight::ClockFall;
use crate::base::error::Result;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::{Span, Stamp};
use crate::evidence::clock::{Belief, believed};
use crate::evidence::inference::Stream;
use crate::evidence::numbers::Numbers;
use crate::evidence::observation::Observations;
use crate::evidence::offsets::{ClockOffset, offsets};
use crate::evidence::publishers;
use crate::evidence::source;
use crate::evidence::times::Stamps;

/// Everything that the bags of a mission contain about its graph.
#[derive(Debug, Default)]
pub struct Recorded {
    pub(crate) streams: Vec<Stream>,
    pub(crate) messages: Stamps,
    /// The numbers in the headers of streams, by index, as far as they were read.
    pub(crate) numbers: BTreeMap<usize, Numbers>,
    pub(crate) facts: Observations,
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
    /// Judges the times and the names of publishers, once everything is collected.
    pub(super) fn judge(&mut self) -> io::Result<()> {
        let belief = believed(self.messages.calendars());
        let jumps = belief.jumps.iter();
        let jumps = jumps.map(|text| Notice::new(NoticeKind::Note, text));
        self.notices.extend(jumps);
        // What is set aside may show by how much clocks differ.
        self.offsets = offsets(&self.streams, &self.facts)?;
        self.set_aside(&belief)?;
        source::rosout::interpret_lists(&mut self.facts);
        let (streams, facts) = (&mut self.streams, &mut self.facts);
        let judged = publishers::judge(streams, facts, &mut self.messages, &self.numbers)?;
        self.notices.extend(judged);
        if self.facts.dropped > 0 {
            let text = "there are implausibly many or long names: an observation was left out";
            let dropped = self.facts.dropped;
            self.notices
                .add(Notice::counted(NoticeKind::Damaged, dropped, text));
        }
        self.facts.seal();
        self.span = self.measure();
        Ok(())
    }

    /// Removes the messages at incredible times, and notes the offsets of other clocks so that their first messages are
    /// together.
    fn set_aside(&mut self, belief: &Belief) -> io::Result<()> {
        let Some(span) = belief.span else {
            return Ok(());
        };
        let before = self.firsts();
        let zeros = self.messages.calendars().values().map(|bag| bag.zeros);
        let zeros = if span.contains(Stamp(0)) {
            0
        } else {
            zeros.sum()
        };
        let aside = self.clip(span)?;
        let text = "message at time 0, before the clock was known, set aside";
        self.notices
            .add(Notice::counted(NoticeKind::Note, zeros, text));
        let text = "message at an impossible time, set aside";
        let far = aside.saturating_sub(zeros);
        self.notices
            .add(Notice::counted(NoticeKind::ImpossibleTime, far, text));
        let kept = self.firsts().into_iter().min_by_key(|(_, first)| *first);
        let offset = |bag: &usize| {
            let ((other, start), first) = kept.zip(before.get(bag))?;
            Some(ClockOffset {
                bag: *bag,
                other,
                ahead: first.since(start),
                messages: 0,
            })
        };
        self.offsets.extend(belief.others.iter().filter_map(offset));
        Ok(())
    }

    /// Removes the messages at other times than these, and everything that they state: they prove nothing. Returns their
    /// number.
    fn clip(&mut self, span: Span) -> io::Result<u64> {
        let mut removed = 0;
        for stream in &self.streams {
            removed += self.messages.clip(stream.times, span)?;
        }
        self.facts.clip(span)?;
        let has_messages = |at: &usize| self.messages.count(self.streams[*at].times) > 0;
        self.facts.headers.retain(|at, _| has_messages(at));
        self.numbers.values_mut().for_each(|own| own.clip(span));
        Ok(removed)
    }

    /// Keeps a part of the recording, from its beginning on (`is_first`) or not.
    ///
    /// # Errors
    /// If the temporary file of times cannot be read or written.
    pub(crate) fn cut(&mut self, part: Span, is_first: bool) -> Result<()> {
        self.clip(part).map_err(spool_error)?;
        self.mark_outside(is_first);
        self.span = self.measure();
        Ok(())
    }

    /// The time of the first message of each bag with messages.
    pub(crate) fn firsts(&self) -> BTreeMap<usize, Stamp> {
        let mut firsts = BTreeMap::new();
        for stream in &self.streams {
            if let Some((first, _)) = self.messages.bounds(stream.times) {
                let own = firsts.entry(stream.bag).or_insert(first);
                *own = first.min(*own);
            }
        }
        firsts
    }

    /// Marks the streams without a message in the part of the recording that was read. In a part from the
    /// beginning on, they have no latched message yet.
    fn mark_outside(&mut self, is_first: bool) {
        for stream in &mut self.streams {
            stream.is_outside = self.messages.bounds(stream.times).is_none();
            stream.latched &= !(stream.is_outside && is_first);
        }
    }

    /// The span of all messages.
    fn measure(&self) -> Option<Span> {
        let bounds = self.streams.iter();
        let bounds = bounds.filter_map(|stream| self.messages.bounds(stream.times));
        let (first, last) = bounds.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        Some(Span::new(first, last.plus(1)))
    }
}
