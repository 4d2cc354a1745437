//! A set of kinds of evidence, as small as a number.

use super::SOURCES;
use super::observation::SourceId;

/// A set of kinds of evidence: bits at the indices of rows in [`SOURCES`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Evidence(u64);

impl Evidence {
    /// No evidence.
    pub const NONE: Self = Self(0);

    /// The set of the source with this word; empty for an unknown word.
    pub fn of(word: &str) -> Self {
        SOURCES
            .iter()
            .position(|s| s.word == word)
            .map_or(Self::NONE, Self::row)
    }

    /// The set of the source in this row.
    pub(crate) fn row(source: SourceId) -> Self {
        let bit = u32::try_from(source).unwrap_or(u32::MAX);
        Self(1_u64.checked_shl(bit).unwrap_or(0))
    }

    /// The union of both sets.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all of it is evidence without times: source code, launch files, and stand-ins for nodes without a name.
    pub fn is_timeless(self) -> bool {
        self.is_within(&["source", "source_only", "launch", "unknown", "owned_type"])
    }

    /// Whether all of it is evidence of stand-ins for nodes that the bag does not name.
    pub fn is_guess(self) -> bool {
        self.is_within(&["source_only", "unknown", "owned_type"])
    }

    /// Whether the set is not empty and has only these kinds.
    fn is_within(self, words: &[&str]) -> bool {
        let all = words.iter().map(|word| Self::of(word));
        let all = all.fold(Self::NONE, Self::and);
        !self.is_empty() && self.0 & !all.0 == 0
    }

    /// Whether the set is empty.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether the set has the kind with this word.
    pub fn has(self, word: &str) -> bool {
        self.0 & Self::of(word).0 != 0
    }

    /// The words of all kinds, in the order of [`SOURCES`].
    pub fn all_words() -> impl Iterator<Item = &'static str> {
        SOURCES.iter().map(|source| source.word)
    }

    /// A description of each kind in the set, in a line of plain words, in the order of [`SOURCES`].
    pub(crate) fn lines(self) -> impl Iterator<Item = String> {
        let rows = SOURCES.iter().enumerate();
        let rows = rows.filter(move |(at, _)| self.0 >> at & 1 == 1);
        rows.map(|(_, source)| format!("{}: {}", source.word, source.about.replace('`', "")))
    }

    /// The words of the set, in the order of [`SOURCES`].
    pub fn words(self) -> impl Iterator<Item = &'static str> {
        SOURCES
            .iter()
            .enumerate()
            .filter(move |(at, _)| self.0 >> at & 1 == 1)
            .map(|(_, source)| source.word)
    }
}
