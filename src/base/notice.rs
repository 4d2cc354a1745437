//! Notices: problems that did not stop the command, grouped by kind and counted.

use crate::base::words::worded;
use std::collections::BTreeMap;

use super::budget::NOTICES;

worded! {
    /// The kind of a notice. Its name in JSON is [`NoticeKind::word`].
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
    #[non_exhaustive]
    pub enum NoticeKind {
        /// Recordings that are further apart than they are long, so that they are several runs. `check` refuses them.
        Apart = "apart",
        /// Part of the bag was lost: cut, unreadable or skipped. The command exits 3.
        Damaged = "damaged",
        /// The bag's end is missing. The command exits 3.
        Truncated = "truncated",
        /// The bag was not read by its index, for the reason given; nothing was lost.
        Downgraded = "downgraded",
        /// A tool rewrote the bag, so its headers name wrong publishers.
        Rewritten = "rewritten",
        /// The bag was recorded while another was played back.
        Playback = "playback",
        /// A payload without the layout that its type defines.
        Undecodable = "undecodable",
        /// Messages with an impossible time, excluded from all counts. The command exits 3.
        ImpossibleTime = "impossible_time",
        /// Something that the picture hides or collapses, and how to show it.
        Hidden = "hidden",
        /// A choice made for the user, such as the period.
        Chosen = "chosen",
        /// A character that the bundled font lacks.
        Glyph = "glyph",
        /// Any other note.
        Note = "note",
    }
}

impl NoticeKind {
    /// Whether data was skipped, so that the command exits 3.
    pub fn is_loss(self) -> bool {
        matches!(self, Self::Damaged | Self::Truncated | Self::ImpossibleTime)
    }

    /// Whether it belongs to a normal run: hidden elements and automatic choices.
    pub fn is_routine(self) -> bool {
        matches!(self, Self::Hidden | Self::Chosen | Self::Glyph)
    }
}

/// One message to the user about a bag or the output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// The kind.
    pub kind: NoticeKind,
    /// The number of occurrences, ≥ 1.
    pub count: u64,
    /// One sentence, lower case, no period; names in it are as recorded, so escape it in output.
    pub text: String,
}

impl Notice {
    /// A notice that happened once.
    pub fn new(kind: NoticeKind, text: impl Into<String>) -> Self {
        Self::counted(kind, 1, text)
    }

    /// A notice that happened so many times.
    pub fn counted(kind: NoticeKind, count: u64, text: impl Into<String>) -> Self {
        Self {
            kind,
            count,
            text: text.into(),
        }
    }

    /// How often it happened, to follow the text: ` (3 times)`; empty for once.
    pub(crate) fn times(&self) -> String {
        match self.count {
            0 | 1 => String::new(),
            n => format!(" ({n} times)"),
        }
    }
}

/// Notices sorted by kind and text, equal ones counted. Bounded, so a hostile bag cannot exhaust memory.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Notices(BTreeMap<(NoticeKind, String), u64>);

impl Notices {
    /// No notices.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a notice, unless it happened zero times, or increases the count of an equal one; one choice for several recordings is still one.
    pub fn add(&mut self, notice: Notice) {
        if notice.count == 0 {
            return;
        }
        let full = self.0.len() >= NOTICES;
        let mut key = (notice.kind, notice.text);
        if full && !self.0.contains_key(&key) {
            "more of the same kind".clone_into(&mut key.1);
        }
        let is_choice = key.0 == NoticeKind::Chosen;
        let count = self.0.entry(key).or_default();
        *count = if is_choice { 1 } else { *count + notice.count };
    }

    /// Adds all of `others`.
    pub fn extend(&mut self, others: impl IntoIterator<Item = Notice>) {
        others.into_iter().for_each(|n| self.add(n));
    }

    /// All notices, in order.
    pub fn iter(&self) -> impl Iterator<Item = Notice> + Clone + '_ {
        self.0.iter().map(|((kind, text), count)| Notice {
            kind: *kind,
            count: *count,
            text: text.clone(),
        })
    }

    /// All notices except those of one kind.
    #[must_use]
    pub fn without(&self, kind: NoticeKind) -> Self {
        let mut rest = self.clone();
        rest.0.retain(|(own, _), _| *own != kind);
        rest
    }

    /// Whether any notice reports skipped data.
    pub fn any_loss(&self) -> bool {
        self.0.keys().any(|(kind, _)| kind.is_loss())
    }

    /// Whether there are no notices.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
