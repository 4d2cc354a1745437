//! What names and parameters stand for in a source file, as far as they stand for one thing only.

use std::collections::BTreeMap;

use crate::evidence::syntax::Node;

/// The longest text that is put together, in bytes: longer than any topic.
pub(super) const LONGEST: usize = 1000;

/// Names that stand for names further than this are not followed.
pub(super) const DEEPEST: usize = 8;

/// The most expressions that are looked at for the texts of a file of this many bytes: code written by hand needs a
/// tenth, and whoever lets names stand for each other over and over gets no further than in reading the file.
pub(super) fn most_work(bytes: usize) -> usize {
    1000 + bytes
}

/// Names with the expressions that they are given; a name that is given several is not known.
#[derive(Debug, Default)]
pub(super) struct TextValues<'a> {
    names: BTreeMap<String, Option<Node<'a>>>,
    parameters: BTreeMap<String, Option<Node<'a>>>,
}

impl<'a> TextValues<'a> {
    /// Takes down that a name is given a value.
    pub(super) fn set(&mut self, name: &str, value: Node<'a>) {
        put(&mut self.names, name, value);
    }

    /// Takes down that a parameter has a default.
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
