//! Who talks to whom, and how we know: what proves a node, a topic or an edge, and how strongly.

/// How well something is known. Ordered: the stronger is the smaller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Degree {
    /// Messages of this very connection, or the middleware's own statistics.
    Measured,
    /// Somebody says so: a log record's topic list, a graph snapshot, the user's own file.
    Stated,
    /// A convention says so: an action, a bond, every node publishes `/rosout`.
    Inferred,
    /// Known from a header or metadata only.
    Declared,
}

impl Degree {
    /// All of them, strongest first.
    pub const ALL: [Self; 4] = [Self::Measured, Self::Stated, Self::Inferred, Self::Declared];

    /// Its word in JSON and in class names.
    pub fn word(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Stated => "stated",
            Self::Inferred => "inferred",
            Self::Declared => "declared",
        }
    }
}

/// A set of kinds of evidence: the places of rows in [`SOURCES`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Evidence(u64);

/// The words of all kinds of evidence, as JSON holds them. A set holds at most 64.
pub const SOURCES: &[&str] = &["connection", "rosout", "parameter_events"];

impl Evidence {
    /// No evidence.
    pub const NONE: Self = Self(0);

    /// The set of this one word; empty for a word that is no source of ours.
    pub fn of(word: &str) -> Self {
        SOURCES
            .iter()
            .position(|s| *s == word)
            .map_or(Self::NONE, |at| Self(1 << at))
    }

    /// Both together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether nothing is in it.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The words in it, in the order of [`SOURCES`].
    pub fn words(self) -> impl Iterator<Item = &'static str> {
        SOURCES
            .iter()
            .enumerate()
            .filter(move |(at, _)| self.0 >> at & 1 == 1)
            .map(|(_, word)| *word)
    }
}
