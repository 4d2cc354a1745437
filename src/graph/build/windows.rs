//! Search for the windows that contain a moment or overlap an interval; windows may overlap.

use std::ops::Range;

use crate::base::time::{Span, Stamp};

/// Windows sorted by start, none of them inside another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SortedWindows<'a>(pub(crate) &'a [Span]);

impl SortedWindows<'_> {
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    pub(crate) fn start(&self, window: usize) -> Option<Stamp> {
        self.0.get(window).map(|w| w.start)
    }

    pub(crate) fn end(&self, window: usize) -> Stamp {
        self.0.get(window).map_or(Stamp::MAX, |w| w.end)
    }

    /// The windows that overlap `[from, to]`.
    pub(crate) fn over(&self, from: Stamp, to: Stamp) -> Range<usize> {
        let first = self.0.partition_point(|w| w.end <= from);
        let end = self.0.partition_point(|w| w.start <= to);
        first..end.max(first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spans(list: &[(i64, i64)]) -> Vec<Span> {
        let span = |(a, b): &(i64, i64)| Span::new(Stamp(*a), Stamp(*b));
        list.iter().map(span).collect()
    }

    #[test]
    fn windows_are_half_open_and_may_overlap() {
        let spans = spans(&[(0, 10), (5, 15), (10, 20)]);
        let windows = SortedWindows(&spans);
        assert_eq!(windows.over(Stamp(5), Stamp(5)), 0..2);
        assert_eq!(windows.over(Stamp(10), Stamp(10)), 1..3);
        assert_eq!(windows.over(Stamp(3), Stamp(4)), 0..1);
        assert!(windows.over(Stamp(20), Stamp(30)).is_empty());
    }
}
