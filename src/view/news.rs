//! The news of a window: the elements that change in it, and their direct partners, without everything else.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Item, ItemId, Shown, ShownRuns, View};
use crate::base::name::namespace;
use crate::graph::{ById, Id as _};

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
        let seen = self.seen(k);
        let is_new = |shown: &Shown| shown.mark.is_some();
        let mut changes = ById::like(&self.items, false);
        for shown in seen.items.iter().filter(|shown| is_new(shown)) {
            changes[shown.item()] = true;
        }
        let mut kept = changes.clone();
        let mut lines: Vec<&Shown> = Vec::new();
        for shown in &seen.arrows {
            let arrow = &self.arrows[shown.arrow()];
            if is_new(shown) || changes[arrow.from] || changes[arrow.to] {
                (kept[arrow.from], kept[arrow.to]) = (true, true);
                lines.push(shown);
            }
        }
        if !kept.iter().any(|is| *is) {
            return None;
        }
        let items = seen.items.iter().filter(|shown| kept[shown.item()]);
        let items: Vec<&Shown> = items.collect();
        let names: Vec<&str> = items
            .iter()
            .map(|shown| &*self.items[shown.item()].name)
            .collect();
        let home = home(&names);
        let mut places: ById<ItemId, Option<ItemId>> = ById::like(&self.items, None);
        for (at, shown) in items.iter().enumerate() {
            places[shown.item()] = Some(ItemId::of(at));
        }
        let place = |id: ItemId| places.get(id).copied().flatten();
        let arrows = lines.iter().filter_map(|shown| {
            let arrow = self.arrows[shown.arrow()].clone();
            let (from, to) = (place(arrow.from)?, place(arrow.to)?);
            Some(super::Arrow { from, to, ..arrow })
        });
        let view = Self {
            items: items
                .iter()
                .map(|shown| relative(&self.items[shown.item()], home.as_deref()))
                .collect(),
            arrows: arrows.collect(),
            items_shown: alone(items.iter().copied()),
            arrows_shown: alone(lines.iter().copied()),
            frames: vec![frame.clone()],
            ..Self::default()
        };
        Some(News {
            left_out: seen.items.len() - view.items.len(),
            home,
            view,
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

/// Each of these looks as that of the only window, under its new id.
fn alone<'a, I: crate::graph::Id>(all: impl Iterator<Item = &'a Shown>) -> ById<I, ShownRuns> {
    let looks = all.zip(0_u32..).map(|(shown, id)| {
        let shown = Shown {
            id,
            ..shown.clone()
        };
        ShownRuns::of([Some(&shown)])
    });
    looks.collect()
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
