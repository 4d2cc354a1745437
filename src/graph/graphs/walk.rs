//! A walk through all elements at once, window by window, that stops only where one of them differs from the
//! previous window.

use super::{Column, ColumnCursor, Row};
use crate::graph::Element;

/// The state of a walk through all columns.
#[derive(Debug)]
pub(crate) struct ColumnWalk<'a> {
    /// The next window.
    window: u64,
    /// For each node, topic, publication and subscription, the next window in which it may differ.
    due: [Vec<u64>; 4],
    cursors: [Vec<ColumnCursor<'a>>; 4],
}

impl<'a> ColumnWalk<'a> {
    pub(super) fn new(columns: &'a [Vec<Column>; 4]) -> Self {
        let columns = columns.each_ref();
        Self {
            window: 0,
            due: columns.map(|list| vec![0; list.len()]),
            cursors: columns.map(|list| list.iter().map(Column::cursor).collect()),
        }
    }

    /// Calls `visit` for every element that may differ in the next window, with its row there, if it exists.
    pub(crate) fn next(&mut self, mut visit: impl FnMut(Element, Option<Row>)) {
        let lists = self.due.iter_mut().zip(&mut self.cursors);
        for ((due, cursors), kind) in lists.zip(Element::KINDS) {
            for (at, due) in due.iter_mut().enumerate() {
                if *due > self.window {
                    continue;
                }
                let (row, stays) = cursors[at].next_run();
                *due = self.window.saturating_add(stays);
                visit(kind(at), row);
            }
        }
        self.window += 1;
    }
}
