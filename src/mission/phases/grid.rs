//! The grid in which phases are searched: short cells that do not depend on `--period`.

use crate::base::time::Span;
use crate::graph::window::every;

/// The most cells: more would be finer than print, and the cost of phases grows with the square.
const MOST_CELLS: i64 = 200;

const SECOND: i64 = 1_000_000_000;
/// The possible lengths of a cell up to a day; longer ones are whole days.
const STEPS: [i64; 16] = [
    SECOND,
    2 * SECOND,
    5 * SECOND,
    10 * SECOND,
    20 * SECOND,
    30 * SECOND,
    60 * SECOND,
    120 * SECOND,
    300 * SECOND,
    600 * SECOND,
    1200 * SECOND,
    1800 * SECOND,
    3600 * SECOND,
    7200 * SECOND,
    21_600 * SECOND,
    86_400 * SECOND,
];

/// The cells that divide `span`: of 1 s if possible, of longer steps where there would be more than [`MOST_CELLS`].
pub(super) fn grid(span: Span) -> Vec<Span> {
    let nanos = span.nanos().max(1);
    let fits = |step: &i64| nanos / step < MOST_CELLS;
    let day = STEPS[STEPS.len() - 1];
    let step = STEPS.into_iter().find(fits);
    let step = step.unwrap_or_else(|| (nanos / MOST_CELLS / day + 1).saturating_mul(day));
    every(span, step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::Stamp;

    /// The number of cells and the length of the first in seconds, for a span of this many seconds.
    fn cells(seconds: i64) -> (usize, i64) {
        let cells = grid(Span {
            start: Stamp(5),
            end: Stamp(5 + seconds * SECOND),
        });
        (cells.len(), cells[0].nanos() / SECOND)
    }

    #[test]
    fn the_grid_has_the_shortest_step_that_gives_at_most_two_hundred() {
        assert_eq!(cells(66), (66, 1));
        assert_eq!(cells(200), (100, 2));
        assert_eq!(cells(330), (165, 2));
        assert_eq!(cells(3600 * 24), (144, 600));
        let (many, step) = cells(86_400 * 4000);
        assert!(many <= 200 && step % 86_400 == 0, "{many} of {step}");
    }
}
