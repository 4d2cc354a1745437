//! The news of a window: the elements that change in it, and their direct partners, without everything else.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Item, ItemId, Shown, ShownRuns, View};
use crate::base::name::namespace;
use crate::graph::ById;

/// The part of a view that changes in one of its windows.
pub(crate) struct News {
    /// The view, with that window alone.
    pub(crate) view: View,
    /// The namespace that most names are in, and relative to which they are written; none for the root.
    pub(crate) home: Option<String>,
    /// The number of items of the window that are left out.
    pub(crate) left_out: usize,
}

impl View {
    /// The items and arrows that change in window `k`, with the items at the other ends of these arrows, and of those
    /// from and to an item that changes. `None` past the last window, and if nothing with a box changes.
    pub(crate) fn news(&self, k: usize) -> Option<News> {
        let frame = self.frames.get(k)?;
        let is_new = |looks: &ShownRuns| looks.at(k).is_some_and(|shown| shown.mark.is_some());
        let changes: ById<ItemId, bool> = self.items_shown.iter().map(is_new).collect();
        let (mut kept, mut lined) = (changes.clone(), ById::like(&self.arrows, false));
        for ((id, arrow), looks) in self.arrows.with_ids().zip(&self.arrows_shown) {
            let is_part = is_new(looks) || changes[arrow.from] || changes[arrow.to];
            if is_part && looks.at(k).is_some() {
                (kept[arrow.from], kept[arrow.to], lined[id]) = (true, true, true);
            }
        }
        let items = self.items.with_ids().filter(|(id, _)| kept[*id]);
        let names: Vec<&str> = items.map(|(_, item)| &*item.name).collect();
        if names.is_empty() {
            return None;
        }
        let home = home(&names);
        let items = self.items.iter();
        let alone = |looks: &ShownRuns| ShownRuns::of([self.seen_at(looks, k).as_ref()]);
        let there = self.items_shown.iter();
        let there = there.filter(|looks| looks.at(k).is_some());
        let left_out = there.count() - names.len();
        let mut view = Self {
            items: items.map(|item| relative(item, home.as_deref())).collect(),
            arrows: self.arrows.clone(),
            items_shown: self.items_shown.iter().map(alone).collect(),
            arrows_shown: self.arrows_shown.iter().map(alone).collect(),
            frames: vec![frame.clone()],
            ..Self::default()
        };
        view.keep_arrows(&lined);
        view.keep_items(&kept);
        Some(News {
            view,
            home,
            left_out,
        })
    }
}

impl View {
    /// The view with the rates that changed, but no others, for narrow drawings.
    pub(crate) fn without_rates(&self) -> Self {
        let unrated = |looks: &ShownRuns| {
            let each = (0..self.frames.len()).map(|k| {
                let mut shown = looks.at(k)?.clone();
                (shown.hz, shown.held, shown.count) = (None, None, None);
                for row in &mut shown.topics {
                    (row.hz, row.count) = (None, None);
                }
                Some(shown)
            });
            let each: Vec<Option<Shown>> = each.collect();
            ShownRuns::of(each.iter().map(Option::as_ref))
        };
        Self {
            items_shown: self.items_shown.iter().map(unrated).collect(),
            arrows_shown: self.arrows_shown.iter().map(unrated).collect(),
            ..self.clone()
        }
    }
}

/// The namespace of most of these names; none if it is the root, or that of one of them.
fn home(names: &[&str]) -> Option<String> {
    let mut spaces: BTreeMap<&str, usize> = BTreeMap::new();
    for name in names {
        *spaces.entry(namespace(name)).or_default() += 1;
    }
    spaces.retain(|space, many| *space != "/" && *many > 1);
    let most = spaces
        .into_iter()
        .max_by_key(|(space, many)| (*many, std::cmp::Reverse(*space)));
    most.map(|(space, _)| space.to_owned())
}

/// The item outside of all frames, with its name relative to `home`.
fn relative(item: &Item, home: Option<&str>) -> Item {
    let inside = home.and_then(|home| item.label.strip_prefix(home)?.strip_prefix('/'));
    Item {
        label: inside.map_or_else(|| Arc::clone(&item.label), Arc::from),
        cluster: None,
        ..item.clone()
    }
}
