//! Lifelines in a frame of a sequence: the parts that a frame adds to the rows.

use super::canvas::{PaperCanvas, Type, ink};
use super::lives::{LivesFigure, RowPlace, thick};
use super::rows::FigureRow;
use super::tracks::{SendingBar, Track};
use crate::base::name::last_part;
use crate::base::time::Stamp;

impl LivesFigure<'_> {
    /// The same with a row for every element, without collapsed rows, letters and arrows.
    pub(crate) fn opened(mut self) -> Self {
        let tracks = &self.tracks;
        let open = |row: FigureRow| match row {
            FigureRow::Folded(mut all, _) => {
                all.sort_by(|a, b| tracks[*a].name.cmp(&tracks[*b].name));
                let row =
                    |at: usize| FigureRow::Track(at, last_part(&tracks[at].name).to_owned(), true);
                all.into_iter().map(row).collect()
            }
            row => vec![row],
        };
        self.rows = std::mem::take(&mut self.rows)
            .into_iter()
            .flat_map(open)
            .collect();
        self.plain()
    }

    /// The same without letters and arrows.
    pub(crate) fn plain(mut self) -> Self {
        self.marks = self.marks.plain();
        self
    }

    /// Keeps the rows of the busiest tracks, at most `most` rows; returns the number of tracks left out.
    pub(crate) fn shorten(&mut self, most: usize, messages: &dyn Fn(&Track) -> u64) -> usize {
        let mut order: Vec<usize> = (0..self.tracks.len()).collect();
        order.sort_by_key(|at| std::cmp::Reverse(messages(&self.tracks[*at])));
        let mut left = 0;
        while self.rows.len() > most {
            let Some(least) = order.pop() else { break };
            self.rows.retain(|row| !row.holds(least));
            left += 1;
            let rows = std::mem::take(&mut self.rows);
            let titles = rows.iter().zip(rows.iter().skip(1).map(Some).chain([None]));
            let is_empty = |(row, next): &(&FigureRow, Option<&FigureRow>)| {
                matches!(row, FigureRow::Space(_))
                    && !matches!(
                        next,
                        Some(FigureRow::Track(_, _, true) | FigureRow::Folded(..))
                    )
            };
            let kept = titles.filter(|pair| !is_empty(pair));
            self.rows = kept.map(|(row, _)| row.clone()).collect();
        }
        left
    }

    /// The rows of single tracks with the middles of their lines.
    pub(crate) fn lines<'l>(
        &'l self,
        canvas: &PaperCanvas<'_>,
        place: &RowPlace,
    ) -> Vec<(f64, &'l Track, &'l str, bool)> {
        let (top, pitch) = (self.top(place), canvas.sizes.pitch());
        let rows = self.rows.iter().enumerate();
        let line = |(k, row): (usize, &'l FigureRow)| match row {
            FigureRow::Track(at, label, inside) => {
                let y = top + (k as f64 + 0.5) * pitch;
                Some((y, self.tracks.get(*at)?, label.as_str(), *inside))
            }
            _ => None,
        };
        rows.filter_map(line).collect()
    }

    /// Draws the names of the rows; those for which `is_now` is true are emphasized.
    pub(crate) fn names(
        &self,
        canvas: &mut PaperCanvas<'_>,
        place: &RowPlace,
        is_now: &dyn Fn(&Track) -> bool,
    ) {
        let room = place.axis.left - place.left - 1.2;
        for (y, track, label, inside) in self.lines(canvas, place) {
            let indent = if inside { 1.2 } else { 0.0 };
            let label = canvas.cut(label, Type::Name, room - indent);
            let color = if is_now(track) { ink::TEXT } else { ink::QUIET };
            canvas.text(place.left + indent, y, Type::Name, color, &label);
        }
    }

    /// Draws the publishing bars up to a point in time.
    pub(crate) fn past(&self, canvas: &mut PaperCanvas<'_>, place: &RowPlace, until: Stamp) {
        for (y, track, ..) in self.lines(canvas, place) {
            for bar in track.bars.iter().filter(|b| b.span.start < until) {
                let mut bar: SendingBar = *bar;
                bar.span.end = bar.span.end.min(until);
                thick(canvas, place, y, &bar, ink::BAR);
            }
        }
    }
}
