//! The values of names and parameters in a source file, where each has only one.

use std::cell::Cell;
use std::collections::BTreeMap;

use crate::evidence::syntax::Node;

/// The longest text that is assembled, in bytes: longer than any topic.
pub(super) const LONGEST: usize = 1000;

/// The most steps from name to name that are followed.
pub(super) const DEEPEST: usize = 8;

/// Names with the expressions assigned to them; a name with several has no known value.
#[derive(Debug)]
pub(super) struct TextValues<'a> {
    /// The number of expressions that may still be evaluated for their texts.
    work: Cell<usize>,
    names: BTreeMap<String, Option<Node<'a>>>,
    parameters: BTreeMap<String, Option<Node<'a>>>,
}

impl<'a> TextValues<'a> {
    /// The values of a file of this many bytes. As many expressions may be evaluated: hand-written code needs a tenth, and
    /// names that refer to each other repeatedly cost no more than reading the file.
    pub(super) fn new(bytes: usize) -> Self {
        Self {
            work: Cell::new(1000 + bytes),
            names: BTreeMap::new(),
            parameters: BTreeMap::new(),
        }
    }

    /// Counts an expression at this depth; `None` if it is too deep or there were too many.
    pub(super) fn evaluate(&self, depth: usize) -> Option<()> {
        self.work.set(self.work.get().checked_sub(1)?);
        (depth <= DEEPEST).then_some(())
    }

    /// Records an assignment to a name.
    pub(super) fn set(&mut self, name: &str, value: Node<'a>) {
        put(&mut self.names, name, value);
    }

    /// Records a parameter's default.
    pub(super) fn set_parameter(&mut self, name: &str, value: Node<'a>) {
        put(&mut self.parameters, name, value);
    }

    pub(super) fn get(&self, name: &str) -> Option<Node<'a>> {
        *self.names.get(name)?
    }

    pub(super) fn parameter(&self, name: &str) -> Option<Node<'a>> {
        *self.parameters.get(name)?
    }
}

fn put<'a>(map: &mut BTreeMap<String, Option<Node<'a>>>, name: &str, value: Node<'a>) {
    match map.get_mut(name) {
        Some(known) => *known = None,
        None => {
            map.insert(name.to_owned(), Some(value));
        }
    }
}
