//! The activity of a mission, on a grid of its own that does not depend on `--period`: in it phases are found and
//! figures drawn.

use std::cmp::Reverse;

use crate::base::name::{is_player, is_quiet, is_recorder};
use crate::base::time::{Span, Stamp};
use crate::graph::sending::Sending;
use crate::graph::window::every;
use crate::graph::{Element, Graphs, Node, Row};
use crate::mission::Mission;

/// The most cells of the grid: more would be finer than print, and the cost of phases grows with the square.
pub(crate) const MOST_CELLS: i64 = 200;

const SECOND: i64 = 1_000_000_000;
/// The possible lengths of a cell up to a day, in seconds; longer ones are whole days.
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

/// The mission as a sequence of short cells; ids are those of the mission's elements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Activity {
    /// The graph of each cell, in order, 1 to `MOST_CELLS` without gaps; empty where nothing was read.
    pub graphs: Graphs,
    /// The times of messages, to the nanosecond; empty lists where only windows are known.
    pub sending: Sending,
}

/// The cells that divide `span`: of 1 s if possible, of longer steps where there would be more than [`MOST_CELLS`].
pub(crate) fn grid(span: Span) -> Vec<Span> {
    let nanos = span.nanos().max(1);
    let fits = |step: &i64| nanos / step < MOST_CELLS;
    let day = STEPS[STEPS.len() - 1];
    let step = STEPS.into_iter().find(fits);
    let step = step.unwrap_or_else(|| (nanos / MOST_CELLS / day + 1).saturating_mul(day));
    every(span, step)
}

impl Activity {
    /// The activity in these cells, without the values that only windows have: sizes, the spacing of messages, the
    /// states of lifecycles.
    pub(crate) fn new(graphs: Graphs, sending: Sending) -> Self {
        Self {
            graphs: graphs.plain(),
            sending,
        }
    }

    /// The activity of a mission of which only the windows are known: neighbours are joined until few enough are left,
    /// each with the graph of the window with most messages. Cells of windows that overlap end where the next begins.
    pub fn of_windows(mission: &Mission) -> Self {
        let many = usize::try_from(MOST_CELLS).unwrap_or(1);
        let stride = mission.windows.len().div_ceil(many).max(1);
        let chunks: Vec<_> = mission.windows.chunks(stride).collect();
        let mut graphs = mission.graphs.iter();
        let start = |k: usize| chunks.get(k).and_then(|c| c.first()).map(|w| w.span.start);
        let cell = |(k, chunk): (usize, &&[crate::mission::Window])| {
            let last = chunk.last().map_or(mission.span.end, |w| w.span.end);
            let busy = chunk.iter().zip(graphs.by_ref());
            let (_, graph) = busy.max_by_key(|(w, _)| (w.messages, Reverse(w.index)))?;
            let span = Span {
                start: start(k)?,
                end: start(k + 1).unwrap_or(last),
            };
            Some((span, graph))
        };
        let cells = chunks.iter().enumerate().filter_map(cell);
        Self::new(cells.collect(), Sending::default())
    }

    /// The cells, which follow one another without gaps.
    pub fn cells(&self) -> &[Span] {
        self.graphs.spans()
    }

    /// The time from the first cell's start to the last one's end.
    pub fn span(&self) -> Span {
        let start = self.cells().first().map_or(Stamp(0), |cell| cell.start);
        let end = self.cells().last().map_or(start, |cell| cell.end);
        Span { start, end }
    }

    /// The length of the longest cell in nanoseconds, 0 without cells.
    pub fn step(&self) -> i64 {
        self.cells().iter().map(Span::nanos).max().unwrap_or(0)
    }

    /// Per cell, whether an element exists in it in a state for which `is` holds.
    pub(crate) fn presence(&self, what: Element, is: impl Fn(&Row) -> bool) -> Vec<bool> {
        let mut cells = vec![false; self.cells().len()];
        for (at, _) in self.graphs.rows(what).filter(|(_, row)| is(row)) {
            cells[at] = true;
        }
        cells
    }
}

/// Whether a node is a recorder or player, by its name or its log records.
pub(crate) fn records(node: &Node) -> bool {
    let name = node.name.as_str();
    is_recorder(name) || is_player(name) || node.evidence.words().any(|word| word == "recorder")
}

/// Whether phases and figures leave out a node: housekeeping, recorders, players.
pub(crate) fn is_hidden_node(node: &Node) -> bool {
    records(node) || is_quiet(node.name.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

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
