//! One window of the picture with its events, and the words of its headline.

use super::{Counts, Crowd, Lasting, MemberState};
use crate::base::time::{Span, Stamp};
use crate::graph::Element;
use crate::mission::event_log::{EventId, Kind};

/// An event of the log that begins in a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Headline {
    /// Its index in the event log.
    pub event: EventId,
    /// The kind of event.
    pub kind: Kind,
    /// The element it is about.
    pub what: Element,
    /// The time of the event.
    pub time: Stamp,
}

impl Headline {
    /// The start of a node.
    #[cfg(test)]
    pub(crate) fn started() -> Self {
        Self {
            event: EventId(0),
            kind: Kind::Started,
            what: Element::Node(crate::graph::NodeId(0)),
            time: Stamp(0),
        }
    }
}

/// Elements with the same change in a window: `+ planner, costmap start`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Phrase {
    /// `+` for a beginning, `−` for an end, a space for everything else.
    pub sign: char,
    /// The words before the names: `controller subscribes to`.
    pub lead: String,
    /// The names.
    pub names: Vec<String>,
    /// The events of each name: indices in the event log.
    pub events: Vec<Vec<EventId>>,
    /// The words after the names: `start`.
    pub tail: String,
}

impl Phrase {
    /// The phrase with at most `most` names, the rest counted: `+ planner, costmap, +2 start`.
    fn text(&self, most: usize) -> String {
        let mut names = self.names.iter().take(most).cloned().collect::<Vec<_>>();
        let rest = self.names.len() - names.len();
        if rest > 0 {
            names.push(format!("+{rest}"));
        }
        let sign = match self.sign {
            ' ' => String::new(),
            sign => sign.to_string(),
        };
        let parts = [&sign, &self.lead, &names.join(", "), &self.tail];
        let parts = parts.into_iter().filter(|part| !part.is_empty());
        parts.cloned().collect::<Vec<_>>().join(" ")
    }
}

/// One window of the picture; the items and arrows in it are in [`View::seen`](super::View::seen).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// The window's index, counted from 0.
    pub index: usize,
    /// Its time.
    pub span: Span,
    /// Whether it is shorter than the others.
    pub partial: bool,
    /// The number of all messages in the window, including those of hidden topics.
    pub messages: u64,
    /// For each namespace that represents several, in the order of [`View::namespaces`](super::View::namespaces), the
    /// presence of each of them.
    pub member_lists: Vec<Vec<MemberState>>,
    /// The events that begin in it, in the order of the event log. Headline, marks and timeline are all made from these.
    pub headlines: Vec<Headline>,
    /// The events of earlier windows that last into it or end in it: they are marked and in the headline, but
    /// counted only where they begin.
    pub lasting: Vec<Lasting>,
    /// The number of headlines of each kind.
    pub counts: Counts,
    /// The changes in words, the most important first; empty exactly if nothing is marked.
    pub caption: Vec<Phrase>,
    /// The changes that are combined into one coloured frame, because there are too many.
    pub crowds: Vec<Crowd>,
    /// The long time without messages and changes that it lies in, which is one frame of an animation.
    pub empty: Option<Span>,
    /// The line below: namespace, exact times and consequences of the changes, or the time of the last
    /// change.
    pub note: String,
}

impl Frame {
    /// A window without messages and headlines.
    pub fn empty(index: usize, span: Span) -> Self {
        Self {
            index,
            span,
            ..Self::default()
        }
    }

    /// Whether an event begins or ends in it.
    pub fn is_changed(&self) -> bool {
        !self.headlines.is_empty() || self.lasting.iter().any(|l| l.ended.is_some())
    }

    /// The time that its drawing shows.
    pub fn shown(&self) -> Span {
        self.empty.unwrap_or(self.span)
    }

    /// The events that it reports: the ids of those that begin in it, and of those that last.
    pub fn events(&self) -> impl Iterator<Item = EventId> {
        let lasting = self.lasting.iter().map(|l| l.event);
        self.headlines.iter().map(|h| h.event).chain(lasting)
    }

    /// The caption in at most `most` phrases of three names each, the rest counted: `− a stops; + b starts; +3`.
    pub fn words(&self, most: usize) -> String {
        self.shortened(most, 3)
    }

    /// The caption with as many names as fit, at most 40 of each kind, and as many phrases as possible; the
    /// shortest form if none fits.
    pub fn fitting(&self, fits: impl Fn(&str) -> bool) -> String {
        let longest = self.caption.iter().map(|p| p.names.len()).max();
        let longest = longest.unwrap_or(1).min(40);
        let mut best = (0, self.shortened(1, 1));
        for phrases in (1..=self.caption.len()).rev() {
            for names in (1..=longest).rev() {
                let reported = self.caption.iter().take(phrases);
                let reported: usize = reported.map(|p| p.names.len().min(names)).sum();
                if reported <= best.0 {
                    break;
                }
                let text = self.shortened(phrases, names);
                if fits(&text) {
                    best = (reported, text);
                    break;
                }
            }
        }
        best.1
    }

    fn shortened(&self, phrases: usize, names: usize) -> String {
        let reported = self.caption.iter().take(phrases).map(|p| p.text(names));
        let mut reported: Vec<String> = reported.collect();
        let rest = self.caption.iter().skip(phrases).map(|p| p.names.len());
        let rest: usize = rest.sum();
        if rest > 0 {
            reported.push(format!("+{rest}"));
        }
        reported.join("; ")
    }
}
