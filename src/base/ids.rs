//! Ids as types, lists with a value per id, and lists by key.

use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut, Index, IndexMut};

/// The values of each key, in their order.
pub(crate) fn grouped<K: Ord, V>(pairs: impl IntoIterator<Item = (K, V)>) -> BTreeMap<K, Vec<V>> {
    let mut groups = BTreeMap::<K, Vec<V>>::new();
    for (key, value) in pairs {
        groups.entry(key).or_default().push(value);
    }
    groups
}

/// How often each of these is among them.
pub(crate) fn tally<K: Ord>(keys: impl IntoIterator<Item = K>) -> BTreeMap<K, usize> {
    let mut counts = BTreeMap::new();
    for key in keys {
        *counts.entry(key).or_default() += 1;
    }
    counts
}

/// The number of a thing in the list of all things of its kind, counted from 0.
pub trait Id: Copy {
    /// The id of the thing at an index.
    fn of(at: usize) -> Self;
    /// The index of the thing with this id.
    fn at(self) -> usize;
}

impl Id for u32 {
    fn of(at: usize) -> Self {
        Self::try_from(at).unwrap_or(Self::MAX)
    }

    fn at(self) -> usize {
        self as usize
    }
}

/// The index itself, of things that have no type of ids: bags, streams.
impl Id for usize {
    fn of(at: usize) -> Self {
        at
    }

    fn at(self) -> usize {
        self
    }
}

/// Declares types of ids, public ones unless another visibility comes first: `@pub(crate), Name`.
macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {
        $crate::base::ids::ids! { @pub, $($(#[$doc])* $name),* }
    };
    (@$vis:vis, $($(#[$doc:meta])* $name:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        $vis struct $name($vis u32);

        impl $crate::base::ids::Id for $name {
            fn of(at: usize) -> Self {
                Self($crate::base::ids::Id::of(at))
            }

            fn at(self) -> usize {
                $crate::base::ids::Id::at(self.0)
            }
        }
    )*};
}
pub(crate) use ids;

/// A list with a value per id: a slice that ids index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ById<I, T> {
    list: Vec<T>,
    ids: PhantomData<I>,
}

impl<I: Id, T> ById<I, T> {
    /// The value of an id; `None` beyond the end of the list.
    pub fn get(&self, id: I) -> Option<&T> {
        self.list.get(id.at())
    }

    /// As [`ById::get`], to change the value.
    pub fn get_mut(&mut self, id: I) -> Option<&mut T> {
        self.list.get_mut(id.at())
    }

    /// The value of an id, to change it; the list is extended as far as it, so that its length never depends on how many
    /// ids were known at some time.
    pub(crate) fn grown(&mut self, id: I) -> &mut T
    where
        T: Default,
    {
        if self.list.len() <= id.at() {
            self.list.resize_with(id.at() + 1, T::default);
        }
        &mut self.list[id.at()]
    }

    /// Every id.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = I> + Clone + use<I, T> {
        (0..self.list.len()).map(I::of)
    }

    /// Every value with its id.
    pub fn with_ids(&self) -> impl ExactSizeIterator<Item = (I, &T)> + Clone {
        let values = self.list.iter().enumerate();
        values.map(|(at, value)| (I::of(at), value))
    }

    /// Adds the value of the next id, and returns that id.
    pub(crate) fn push(&mut self, value: T) -> I {
        self.list.push(value);
        I::of(self.list.len() - 1)
    }

    /// Keeps only the values whose ids stay; the others get smaller ids.
    pub(crate) fn retain(&mut self, stays: impl Fn(I) -> bool) {
        let mut ids = self.ids();
        self.list.retain(|_| ids.next().is_some_and(&stays));
    }

    /// Removes and returns the values from an index on.
    pub(crate) fn split_off(&mut self, at: usize) -> Vec<T> {
        self.list.split_off(at)
    }

    /// Reserves space for exactly this many more values.
    pub(crate) fn reserve_exact(&mut self, many: usize) {
        self.list.reserve_exact(many);
    }

    /// The same value for each id of another list.
    pub(crate) fn like<U>(other: &ById<I, U>, value: T) -> Self
    where
        T: Clone,
    {
        vec![value; other.len()].into()
    }
}

impl<I: Id, T> ById<I, Option<T>> {
    /// The value of an id, if it has one.
    pub(crate) fn some(&self, id: I) -> Option<&T> {
        self.get(id)?.as_ref()
    }

    /// Every value with its id.
    pub(crate) fn somes(&self) -> impl Iterator<Item = (I, &T)> + Clone {
        self.with_ids()
            .filter_map(|(id, value)| Some((id, value.as_ref()?)))
    }
}

impl<I: Id, T> ById<I, Vec<T>> {
    /// The list of an id; empty beyond the end.
    pub(crate) fn of(&self, id: I) -> &[T] {
        self.get(id).map_or(&[], |list| list)
    }
}

/// As [`ById`], for values that few of very many ids have: the others take no space.
#[derive(Clone, Debug, Default)]
pub(crate) struct Few<I, T>(BTreeMap<I, T>);

impl<I: Copy + Ord, T> Few<I, T> {
    pub(crate) fn get(&self, id: I) -> Option<&T> {
        self.0.get(&id)
    }

    /// The value of an id, to change it.
    pub(crate) fn grown(&mut self, id: I) -> &mut T
    where
        T: Default,
    {
        self.0.entry(id).or_default()
    }

    /// Every value with its id, in their order.
    pub(crate) fn with_ids(&self) -> impl Iterator<Item = (I, &T)> + Clone {
        self.0.iter().map(|(id, value)| (*id, value))
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.0.values_mut()
    }
}

impl<I: Copy + Ord, T> Few<I, Vec<T>> {
    /// The list of an id; empty if it has none.
    pub(crate) fn of(&self, id: I) -> &[T] {
        self.get(id).map_or(&[], |list| list)
    }
}

impl<I: Ord, T> FromIterator<(I, T)> for Few<I, T> {
    fn from_iter<L: IntoIterator<Item = (I, T)>>(list: L) -> Self {
        Self(list.into_iter().collect())
    }
}

impl<I, T> Default for ById<I, T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<I, T> From<Vec<T>> for ById<I, T> {
    fn from(list: Vec<T>) -> Self {
        let ids = PhantomData;
        Self { list, ids }
    }
}

impl<I, T> FromIterator<T> for ById<I, T> {
    fn from_iter<L: IntoIterator<Item = T>>(list: L) -> Self {
        Vec::from_iter(list).into()
    }
}

impl<I, T> IntoIterator for ById<I, T> {
    type Item = T;
    type IntoIter = std::vec::IntoIter<T>;

    fn into_iter(self) -> Self::IntoIter {
        self.list.into_iter()
    }
}

impl<'a, I, T> IntoIterator for &'a ById<I, T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.list.iter()
    }
}

impl<I, T> Deref for ById<I, T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.list
    }
}

impl<I, T> DerefMut for ById<I, T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.list
    }
}

impl<I: Id, T> Index<I> for ById<I, T> {
    type Output = T;

    fn index(&self, id: I) -> &T {
        &self.list[id.at()]
    }
}

impl<I: Id, T> IndexMut<I> for ById<I, T> {
    fn index_mut(&mut self, id: I) -> &mut T {
        &mut self.list[id.at()]
    }
}
