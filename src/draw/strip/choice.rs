//! The choice of windows that a film strip shows.

use crate::base::error::{Error, Result};
use crate::view::{Counts, View};

/// The windows of a strip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Columns and rows: the first window and those that change most.
    Grid(usize, usize),
    /// The first window and all that show a change, at most a dozen.
    Changes,
    /// These windows, by index.
    Windows(Vec<usize>),
}

/// The most windows on a strip that are chosen for the user: of three columns, four rows.
const MOST: usize = 12;
impl Choice {
    /// Reads `3x2`, `changes` or `0,4,9`.
    ///
    /// # Errors
    /// [`Error::Usage`] for anything else.
    pub fn parse(text: &str) -> Result<Self> {
        let number = |t: &str| t.trim().parse::<usize>().ok();
        let grid = text.split_once('x').and_then(|(columns, rows)| {
            let (columns, rows) = (number(columns)?, number(rows)?);
            let sound = (1..=100).contains(&columns) && (1..=100).contains(&rows);
            sound.then_some(Self::Grid(columns, rows))
        });
        let windows: Option<Vec<usize>> = text.split(',').map(number).collect();
        match (text, grid, windows) {
            ("changes", ..) => Ok(Self::Changes),
            (_, Some(grid), _) => Ok(grid),
            (_, _, Some(windows)) => Ok(Self::Windows(windows)),
            _ => Err(Error::usage(
                format!("`{text}` is not a choice of windows"),
                "give `--strip` columns and rows (`3x2`), `changes`, or windows (`0,4,9`)",
            )),
        }
    }

    /// The chosen windows as indices in `view`, in order; at least one if there is any.
    ///
    /// # Errors
    /// [`Error::Usage`] for a window that does not exist.
    pub fn places(&self, view: &View) -> Result<Vec<usize>> {
        match self {
            Self::Grid(columns, rows) => Ok(busiest(view, columns * rows)),
            Self::Changes => {
                let mut changed: Vec<usize> = (0..view.frames.len()).collect();
                changed.retain(|k| *k == 0 || view.is_changed(*k));
                let most = changed.len().min(MOST);
                Ok(if changed.len() > most {
                    busiest(view, most)
                } else {
                    changed
                })
            }
            Self::Windows(windows) => windows.iter().map(|w| place(view, *w)).collect(),
        }
    }
}

fn place(view: &View, index: usize) -> Result<usize> {
    let last = view.frames.last().map_or(0, |f| f.index);
    view.frames
        .iter()
        .position(|f| f.index == index)
        .ok_or_else(|| {
            let what = format!("there is no window {index}");
            Error::usage(what, format!("windows are counted from 0 to {last}"))
        })
}

/// The first window and those that change most; if too few change, others evenly spread.
fn busiest(view: &View, most: usize) -> Vec<usize> {
    let changes = |t: Counts| {
        let nodes = t.nodes_added + t.nodes_removed + t.restarted;
        let others = t.total() - nodes - t.rates;
        8 * nodes + 4 * others + t.rates
    };
    let mut order: Vec<usize> = (0..view.frames.len()).collect();
    order.sort_by_key(|k| {
        (
            *k != 0,
            !view.is_changed(*k),
            std::cmp::Reverse(changes(view.frames[*k].counts)),
            *k,
        )
    });
    order.truncate(most.max(1));
    order.sort_unstable();
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::{Span, Stamp};
    use crate::view::{Frame, Headline};

    /// A view of windows 10, 11, … in which this many nodes appear.
    fn view(added: &[usize]) -> View {
        let frame = |(place, nodes_added): (usize, &usize)| Frame {
            headlines: vec![Headline::started(); *nodes_added],
            counts: Counts {
                nodes_added: *nodes_added,
                ..Counts::default()
            },
            ..Frame::empty(10 + place, Span::new(Stamp(0), Stamp(1)))
        };
        View {
            frames: added.iter().enumerate().map(frame).collect(),
            ..View::default()
        }
    }

    fn places(choice: &str, added: &[usize]) -> Vec<usize> {
        Choice::parse(choice).unwrap().places(&view(added)).unwrap()
    }

    #[test]
    fn choices_are_parsed_in_all_forms() {
        assert_eq!(Choice::parse("3x2").unwrap(), Choice::Grid(3, 2));
        assert_eq!(
            Choice::parse("0, 4,9").unwrap(),
            Choice::Windows(vec![0, 4, 9])
        );
        for bad in ["", "0x2", "3x", "x", "1000x1", "all", "-1", "1,,2"] {
            assert!(Choice::parse(bad).is_err_and(|e| e.is_usage()), "{bad}");
        }
    }

    #[test]
    fn a_grid_takes_the_first_and_those_that_change_most() {
        assert_eq!(places("2x2", &[0, 1, 5, 0, 2, 3]), [0, 2, 4, 5]);
        assert_eq!(places("3x1", &[0, 0]), [0, 1]);
    }

    #[test]
    fn changes_are_all_windows_with_a_change_up_to_a_limit() {
        assert_eq!(places("changes", &[0, 1, 0, 2]), [0, 1, 3]);
        assert_eq!(places("changes", &[1; 40]).len(), MOST);
    }

    #[test]
    fn windows_are_selected_by_index() {
        assert_eq!(places("12,10", &[0, 0, 0]), [2, 0]);
        let missing = Choice::Windows(vec![9]).places(&view(&[0]));
        assert!(missing.is_err_and(|e| e.is_usage()));
    }
}
