//! The graphs of all windows in little memory: per element the windows in which it is unchanged, and
//! differences elsewhere. Memory grows with the changes, not with the number of windows.

mod column;
mod row;
mod walk;

pub(crate) use column::{Column, ColumnCursor, ColumnWriter};
pub(crate) use row::{Number, Row};
pub(crate) use walk::ColumnWalk;

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Element, Elements, Graph, PerElement};
use crate::base::time::Span;
use crate::evidence::Confidence;

/// A graph per window, in order.
#[derive(Clone, Debug, Default)]
pub struct Graphs {
    /// The times of the windows.
    spans: Vec<Span>,
    /// The lifecycle states that occur; rows refer to them by number, counted from 1.
    lifecycles: Vec<Arc<str>>,
    /// The rows of each element; those after the last existing one of a kind may be left out.
    columns: PerElement<Column>,
}

impl Graphs {
    /// The number of windows.
    pub fn len(&self) -> usize {
        self.spans.len()
    }

    /// Whether there are no windows.
    pub fn is_empty(&self) -> bool {
        self.spans.is_empty()
    }

    /// The times of the windows, in order.
    pub(crate) fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// The graphs in order, each built on demand.
    pub fn iter(&self) -> Iter<'_> {
        let columns = self.columns.0.each_ref();
        Iter {
            all: self,
            next: 0,
            cursors: columns.map(|list| list.iter().map(Column::cursor).collect()),
        }
    }

    /// The graph of one window, computed from all previous ones: for many, use [`Self::iter`].
    pub fn get(&self, window: usize) -> Option<Graph> {
        self.iter().nth(window)
    }

    /// A cursor over the rows of an element; `None` if it exists in no window.
    fn cursor(&self, what: Element) -> Option<ColumnCursor<'_>> {
        self.columns.of(what).map(Column::cursor)
    }

    /// The rows of an element in the windows in which it exists, in order, with the indices of the windows.
    pub(crate) fn rows(&self, what: Element) -> impl Iterator<Item = (usize, Row)> + '_ {
        let mut cursor = self.cursor(what);
        let row = move |at| {
            let row = cursor.as_mut().and_then(ColumnCursor::next);
            row.map(|row| (at, row))
        };
        (0..self.spans.len()).filter_map(row)
    }

    /// The indices of the windows from which an element exists (`true`) or no longer exists.
    pub(crate) fn turns(&self, what: Element) -> Vec<(usize, bool)> {
        let mut found = Vec::new();
        let Some(mut cursor) = self.cursor(what) else {
            return found;
        };
        let (mut at, mut exists) = (0, false);
        while at < self.spans.len() {
            let (row, stays) = cursor.next_run();
            if row.is_some() != exists {
                exists = !exists;
                found.push((at, exists));
            }
            at = at.saturating_add(usize::try_from(stays).unwrap_or(usize::MAX));
        }
        found
    }

    /// The strongest confidence to which each element is known in any window.
    pub(crate) fn confidences(&self, elements: &Elements) -> PerElement<Confidence> {
        PerElement::new(elements, |what| {
            let confidences = self.rows(what).map(|(_, row)| row.confidence);
            confidences.min().unwrap_or(Confidence::Declared)
        })
    }

    /// The lifecycle state in a row.
    pub(crate) fn lifecycle(&self, row: &Row) -> Option<&str> {
        self.lifecycle_of(row.lifecycle)
    }

    /// The lifecycle state in a row, as a shared text.
    pub(crate) fn lifecycle_word(&self, row: &Row) -> Option<Arc<str>> {
        let place = (row.lifecycle as usize).checked_sub(1)?;
        self.lifecycles.get(place).map(Arc::clone)
    }

    /// A walk through all windows that yields only differences from the previous one.
    pub(crate) fn walk(&self) -> ColumnWalk<'_> {
        ColumnWalk::new(&self.columns.0)
    }

    /// The lifecycle state of this number, counted from 1.
    pub(crate) fn lifecycle_of(&self, place: u32) -> Option<&str> {
        let place = (place as usize).checked_sub(1);
        place
            .and_then(|at| self.lifecycles.get(at))
            .map(|word| &**word)
    }
}

impl PartialEq for Graphs {
    /// Whether all graphs are equal; the numbers of lifecycle states do not matter.
    fn eq(&self, other: &Self) -> bool {
        self.spans == other.spans && self.iter().eq(other)
    }
}

/// The graphs of a mission's windows, one after the other.
#[derive(Clone, Debug)]
pub struct Iter<'a> {
    all: &'a Graphs,
    next: usize,
    cursors: [Vec<ColumnCursor<'a>>; 4],
}

impl Iterator for Iter<'_> {
    type Item = Graph;

    fn next(&mut self) -> Option<Graph> {
        let span = *self.all.spans.get(self.next)?;
        let mut states = Vec::with_capacity(self.cursors.iter().map(Vec::len).sum());
        for (of, cursors) in Element::KINDS.into_iter().zip(&mut self.cursors) {
            let rows = cursors.iter_mut().enumerate();
            states.extend(rows.filter_map(|(at, cursor)| {
                let row = cursor.next()?;
                Some(row.state(of(at), span, &self.all.lifecycles))
            }));
        }
        self.next += 1;
        Some(Graph { states })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.all.spans.len() - self.next;
        (left, Some(left))
    }

    fn nth(&mut self, many: usize) -> Option<Graph> {
        let passed = many.min(self.all.spans.len() - self.next);
        for cursor in self.cursors.iter_mut().flatten() {
            (0..passed).for_each(|_| _ = cursor.next());
        }
        self.next += passed;
        self.next()
    }
}

impl ExactSizeIterator for Iter<'_> {}

impl<'a> IntoIterator for &'a Graphs {
    type Item = Graph;
    type IntoIter = Iter<'a>;

    fn into_iter(self) -> Iter<'a> {
        self.iter()
    }
}

/// A writer of the graphs of windows, element by element.
#[derive(Debug)]
pub(crate) struct GraphsWriter(Graphs);

impl GraphsWriter {
    /// A writer for these windows, without any states.
    pub(crate) fn new(spans: Vec<Span>) -> Self {
        Self(Graphs {
            spans,
            ..Graphs::default()
        })
    }

    /// Sets all rows of an element.
    pub(crate) fn element(&mut self, what: Element, rows: ColumnWriter) {
        let (kind, id) = what.place();
        let columns = &mut self.0.columns.0[kind];
        if columns.len() <= id {
            columns.resize_with(id + 1, Column::default);
        }
        columns[id] = rows.finish();
    }

    /// A cursor over the rows of an element that has been set.
    pub(crate) fn cursor(&self, what: Element) -> Option<ColumnCursor<'_>> {
        self.0.cursor(what)
    }

    /// The number of a lifecycle state in rows, counted from 1; states are few.
    pub(crate) fn lifecycle(&mut self, word: &Arc<str>) -> u32 {
        let words = &mut self.0.lifecycles;
        let found = words.iter().position(|w| w == word).unwrap_or_else(|| {
            words.push(Arc::clone(word));
            words.len() - 1
        });
        u32::try_from(found + 1).unwrap_or(0)
    }

    /// The finished graphs.
    pub(crate) fn finish(mut self) -> Graphs {
        self.0.columns.0.iter_mut().for_each(Vec::shrink_to_fit);
        self.0
    }
}

impl FromIterator<(Span, Graph)> for Graphs {
    fn from_iter<I: IntoIterator<Item = (Span, Graph)>>(graphs: I) -> Self {
        let mut all = GraphsWriter::new(Vec::new());
        let mut columns: BTreeMap<Element, ColumnWriter> = BTreeMap::new();
        for (at, (span, graph)) in graphs.into_iter().enumerate() {
            all.0.spans.push(span);
            for state in &graph.states {
                let lifecycle = state.lifecycle.as_ref();
                let lifecycle = lifecycle.map_or(0, |word| all.lifecycle(word));
                let rows = columns.entry(state.what).or_default();
                rows.push(at, Row::of(state, span, lifecycle));
            }
        }
        for (what, rows) in columns {
            all.element(what, rows);
        }
        all.finish()
    }
}

#[cfg(test)]
pub(crate) mod tests;
