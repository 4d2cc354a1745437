//! A value over the windows of a mission: each value once, with the window from which it applies. Memory grows with the
//! number of changes, and the value of a window is found by one search.

/// Pairs of the window from which a value applies and the value, in order of the windows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Runs<T>(pub(crate) Vec<(u32, T)>);

impl<T: Copy + PartialEq> Runs<T> {
    /// Adds the value from this window on, unless it applies already; `initial` applies before the first run.
    pub(crate) fn push(&mut self, window: u32, value: T, initial: T) {
        if self.0.last().map_or(initial, |last| last.1) != value {
            self.0.push((window, value));
        }
    }

    /// The value in a window; `None` before the first run.
    pub(crate) fn at(&self, window: u32) -> Option<T> {
        let after = self.0.partition_point(|(from, _)| *from <= window);
        Some(self.0.get(after.checked_sub(1)?)?.1)
    }

    /// Every value with its first window and the first window after it; the last applies to the end of all `windows`.
    pub(crate) fn spans(&self, windows: u32) -> impl Iterator<Item = (u32, u32, T)> {
        let ends = self.0.iter().skip(1).map(|next| next.0);
        let runs = self.0.iter().zip(ends.chain([windows]));
        runs.map(|((from, value), to)| (*from, to, *value))
    }
}

impl Runs<u32> {
    /// Runs as flat numbers: windows since the previous run, value, windows since, value, …
    pub(crate) fn flat(&self) -> Vec<u32> {
        let mut before = 0;
        let mut out = Vec::with_capacity(self.0.len() * 2);
        for (from, value) in &self.0 {
            out.extend([from - before, *value]);
            before = *from;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_written_as_steps() {
        let runs = Runs(vec![(3, 1), (10, 0), (12, 5)]);
        assert_eq!(runs.flat(), [3, 1, 7, 0, 2, 5]);
        let values = [2, 3, 11, 99].map(|window| runs.at(window));
        assert_eq!(values, [None, Some(1), Some(0), Some(5)]);
    }

    #[test]
    fn equal_values_are_one_run() {
        let mut runs = Runs::default();
        for (window, value) in (0..).zip([0, 0, 0, 1, 1, 0, 5]) {
            runs.push(window, value, 0);
        }
        assert_eq!(runs.flat(), [3, 1, 2, 0, 1, 5]);
        assert_eq!(
            [2, 3, 4, 5, 99].map(|window| runs.at(window)),
            [None, Some(1), Some(1), Some(0), Some(5)]
        );
        let spans: Vec<_> = runs.spans(7).collect();
        assert_eq!(spans, [(3, 5, 1), (5, 6, 0), (6, 7, 5)]);
    }
}
