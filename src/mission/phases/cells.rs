//! The cells for phase detection: short cells independent of `--period`.

use crate::base::time::{SECOND, Span, round_length};
use crate::graph::window::every;

/// The most cells: more would be finer than print, and the cost of phases grows with the square.
const MOST_CELLS: i64 = 200;

/// The cells that divide `span`: 1 s if possible, as recorders find topics once a second, so that shorter ones would be noise;
/// longer if there would be more than [`MOST_CELLS`].
pub(super) fn cells(span: Span) -> Vec<Span> {
    let step = round_length((span.nanos().max(1) / MOST_CELLS + 1).max(SECOND));
    every(span, step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::Stamp;

    /// The number of cells and the length of the first in seconds, for a span of this many seconds.
    fn counted(seconds: i64) -> (usize, i64) {
        let cells = super::cells(Span::new(Stamp(5), Stamp(5 + seconds * SECOND)));
        (cells.len(), cells[0].nanos() / SECOND)
    }

    #[test]
    fn cells_have_the_shortest_step_that_gives_at_most_two_hundred() {
        assert_eq!(counted(66), (66, 1));
        assert_eq!(counted(200), (100, 2));
        assert_eq!(counted(330), (165, 2));
        assert_eq!(counted(3600 * 24), (144, 600));
        let (many, step) = counted(86_400 * 4000);
        assert!(many <= 200 && step % 86_400 == 0, "{many} of {step}");
    }
}
