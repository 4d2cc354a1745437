//! Events that last: nodes that are away, and elements that are back after an absence or a silence.

use super::items::Viewed;
use crate::base::time::{Span, Stamp};
use crate::graph::Element;
use crate::mission::event_log::{Event, EventId, EventLog, Kind};

/// An event of an earlier window that lasts into this one or ends in it: a node is away, or an element is
/// back.
///
/// A silence without evidence of an absence is only listed where it ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lasting {
    /// Its index in the event log.
    pub event: EventId,
    /// The element it is about.
    pub what: Element,
    /// Its beginning.
    pub since: Stamp,
    /// Its end, if it lies in this window.
    pub ended: Option<Stamp>,
}

/// The part of an event that a window shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// All of it that is drawn.
    Whole,
    /// A node leaves and returns in a later window.
    Leaves,
    /// A node is away during the whole window.
    Away,
    /// A node or topic is back.
    Back,
}

impl Part {
    /// The part of an event that lies in the window in which it begins.
    pub(crate) fn of(event: &Event, window: Span) -> Self {
        let leaves = event.kind == Kind::Restarted && event.until.is_some_and(|t| t >= window.end);
        if leaves { Self::Leaves } else { Self::Whole }
    }
}

impl Lasting {
    pub(crate) fn part(&self) -> Part {
        if self.ended.is_some() {
            Part::Back
        } else {
            Part::Away
        }
    }
}

/// The events that last, from window to window.
pub(crate) struct LastingEvents<'a> {
    /// Those with an end, in the order of their beginnings.
    all: Vec<(EventId, &'a Event)>,
    /// The first of them that begins in or after the present window.
    next: usize,
    /// The indices of those that began before it and do not end before it.
    open: Vec<usize>,
}

impl<'a> LastingEvents<'a> {
    pub(crate) fn new(log: &'a EventLog, viewed: &Viewed) -> Self {
        let lasts = |event: &Event| {
            event.until.is_some_and(|until| until > event.time)
                && event.is_headline()
                && viewed.sees(event.what)
        };
        let all = log.events.with_ids().filter(|(_, event)| lasts(event));
        Self {
            all: all.collect(),
            next: 0,
            open: Vec::new(),
        }
    }

    /// Those that last into a window or end in it. Windows are in the order of their starts.
    pub(crate) fn at(&mut self, window: Span) -> Vec<Lasting> {
        let begun = |at: usize| self.all.get(at).is_some_and(|e| e.1.time < window.start);
        while begun(self.next) {
            self.open.push(self.next);
            self.next += 1;
        }
        let all = &self.all;
        let end = |at: usize| all[at].1.until.unwrap_or(window.start);
        self.open.retain(|at| end(*at) >= window.start);
        let lasting = self.open.iter().filter_map(|at| {
            let (id, event) = all[*at];
            let ended = Some(end(*at)).filter(|end| *end < window.end);
            let is_reported = ended.is_some() || event.kind == Kind::Restarted;
            is_reported.then_some(Lasting {
                event: id,
                what: event.what,
                since: event.time,
                ended,
            })
        });
        lasting.collect()
    }
}
