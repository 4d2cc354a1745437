//! A value for each node, topic, publication and subscription of a mission.

use super::{Element, Elements};

/// A value per element, by the element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PerElement<T>(pub(super) [Vec<T>; 4]);

impl<T> Default for PerElement<T> {
    fn default() -> Self {
        Self([const { Vec::new() }; 4])
    }
}

impl PerElement<bool> {
    /// Whether it is true of an element.
    pub(crate) fn is(&self, what: Element) -> bool {
        self.of(what) == Some(&true)
    }
}

impl<T> PerElement<T> {
    /// A value for each of these elements.
    pub(crate) fn new(elements: &Elements, mut value: impl FnMut(Element) -> T) -> Self {
        let mut all = Self::default();
        for what in elements.all() {
            all.0[what.place().0].push(value(what));
        }
        all
    }

    /// The value of an element; `None` for one that has none.
    pub fn of(&self, what: Element) -> Option<&T> {
        let (kind, id) = what.place();
        self.0[kind].get(id)
    }

    /// As [`PerElement::of`], to change it.
    pub(crate) fn of_mut(&mut self, what: Element) -> Option<&mut T> {
        let (kind, id) = what.place();
        self.0[kind].get_mut(id)
    }

    /// Adds the value of the next element of this kind.
    pub(crate) fn push(&mut self, what: Element, value: T) {
        self.0[what.place().0].push(value);
    }

    /// Every value with its element: nodes, topics, publications, subscriptions.
    pub fn iter(&self) -> impl Iterator<Item = (Element, &T)> {
        let lists = self.0.iter().zip(Element::KINDS);
        lists.flat_map(|(list, kind)| (0..).map(kind).zip(list))
    }

    /// Every value, to change it.
    pub(crate) fn values_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.0.iter_mut().flatten()
    }

    /// Reserves space for exactly this many more values of each kind.
    pub(crate) fn reserve_exact(&mut self, many: [usize; 4]) {
        for (list, many) in self.0.iter_mut().zip(many) {
            list.reserve_exact(many);
        }
    }
}
