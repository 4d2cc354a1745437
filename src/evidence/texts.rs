//! What nodes log and what small messages hold, as text side by side, so that a log text that repeats a message can be
//! found. Bounded: a mission with more keeps what came first.

use std::sync::Arc;

use crate::base::time::Stamp;

/// A text of a logger.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Said {
    pub(crate) time: Stamp,
    pub(crate) logger: Arc<str>,
    pub(crate) text: Box<str>,
}

/// A value in a message of the stream at a place.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Shown {
    pub(crate) time: Stamp,
    pub(crate) stream: usize,
    pub(crate) value: Box<str>,
}

/// Texts of both sides.
#[derive(Debug, Default)]
pub(crate) struct Texts {
    said: Vec<Said>,
    shown: Vec<Shown>,
    /// Bytes of texts on either side.
    bytes: [usize; 2],
}

/// Bytes of texts kept on either side.
const MOST: usize = 4 << 20;
/// What a short text takes besides its bytes.
const ENTRY: usize = 48;

impl Texts {
    /// Takes in a text of a logger.
    pub(crate) fn say(&mut self, time: Stamp, logger: &str, text: &str) {
        self.bytes[0] += text.len() + ENTRY;
        if self.bytes[0] <= MOST {
            self.said.push(Said {
                time,
                logger: logger.into(),
                text: text.into(),
            });
        }
    }

    /// Takes in a value in a message.
    pub(crate) fn show(&mut self, time: Stamp, stream: usize, value: &str) {
        self.bytes[1] += value.len() + ENTRY;
        if self.bytes[1] <= MOST {
            self.shown.push(Shown {
                time,
                stream,
                value: value.into(),
            });
        }
    }

    /// Both sides, sorted.
    pub(crate) fn sorted(&self) -> (Vec<Said>, Vec<Shown>) {
        let (mut said, mut shown) = (self.said.clone(), self.shown.clone());
        said.sort_unstable();
        shown.sort_unstable();
        (said, shown)
    }
}
