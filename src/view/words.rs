//! The part of a view that a page draws: infrastructure topics, and nodes that only these connect, are listed as words.

use std::collections::BTreeSet;

use super::bundles::{also_here, drawn_in_pages};
use super::cards::Drawn;
use super::{ArrowId, Item, ItemId, ItemKind, View, ViewOptions, cluster};
use crate::graph::{ById, Element};
use crate::mission::Mission;

/// The drawn part of a view. Its windows are left out.
#[derive(Debug)]
pub(crate) struct DrawnPart {
    /// The boxes and arrows that are drawn, and the other items as words.
    pub(crate) view: View,
    /// Whether each item, and each arrow, of the view is drawn.
    pub(crate) items: ById<ItemId, bool>,
    pub(crate) arrows: ById<ArrowId, bool>,
}

/// The part of a mission's view that is drawn; `None` for all of it, which includes views most of whose nodes would be
/// words.
pub(crate) fn drawn_part(
    view: &View,
    mission: &Mission,
    options: &ViewOptions,
) -> Option<DrawnPart> {
    let topics = drawn_in_pages(mission, options);
    let is_hidden = |what: &Element| match what {
        Element::Topic(id) => !topics[*id],
        _ => false,
    };
    let is_hidden = |item: &Item| item.members.iter().all(is_hidden);
    let hidden: ById<ItemId, bool> = view.items.iter().map(is_hidden).collect();
    let arrows = view.arrows.iter();
    let ends = arrows.map(|arrow| [arrow.from, arrow.to]);
    let arrows: ById<ArrowId, bool> = ends
        .clone()
        .map(|ends| !ends.iter().any(|at| hidden[*at]))
        .collect();
    let lined = ends.zip(&arrows).filter(|(_, drawn)| **drawn);
    let lined: BTreeSet<ItemId> = lined.flat_map(|(ends, _)| ends).collect();
    let is_node = |at: ItemId| view.items[at].kind == ItemKind::Node;
    let items: ById<ItemId, bool> = (hidden.ids())
        .map(|at| !hidden[at] && (!is_node(at) || lined.contains(&at)))
        .collect();
    let nodes = |is_drawn: bool| {
        (items.ids())
            .filter(|at| is_node(*at) && items[*at] == is_drawn)
            .count()
    };
    if items.iter().all(|drawn| *drawn) || nodes(false) > nodes(true) {
        return None;
    }
    let mut part = Drawn {
        items: view.items.clone(),
        arrows: view.arrows.clone(),
        items_shown: view.items_shown.clone(),
        arrows_shown: view.arrows_shown.clone(),
    };
    let is_word: Vec<bool> = items.iter().map(|drawn| !drawn).collect();
    let words = filtered(&view.items, &is_word);
    let shown = filtered(&view.items_shown, &is_word);
    part.keep_arrows(&arrows);
    part.keep_items(&items);
    let namespaces = cluster::clusters(&mut part.items, options.group.namespaces, &BTreeSet::new());
    Some(DrawnPart {
        view: View {
            also: also_here(words, shown, &namespaces),
            items: part.items,
            arrows: part.arrows,
            namespaces,
            items_shown: part.items_shown,
            arrows_shown: part.arrows_shown,
            compares: view.compares,
            ..View::default()
        },
        items,
        arrows,
    })
}

fn filtered<T: Clone>(all: &[T], kept: &[bool]) -> Vec<T> {
    let kept = all.iter().zip(kept).filter(|(_, kept)| **kept);
    kept.map(|(one, _)| one.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::view;

    /// The names in words; `None` if all is drawn.
    fn words(windows: &[&str]) -> Option<Vec<String>> {
        let (mission, options) = (mission(windows), ViewOptions::default());
        let whole = view(&mission, &options).0;
        let part = drawn_part(&whole, &mission, &options)?;
        let drawn = whole
            .items
            .iter()
            .zip(&part.items)
            .filter(|(_, drawn)| **drawn);
        let drawn: Vec<&str> = drawn.map(|(item, _)| &*item.name).collect();
        let kept: Vec<&str> = part.view.items.iter().map(|item| &*item.name).collect();
        assert_eq!(drawn, kept);
        for arrow in &part.view.arrows {
            assert!(
                [arrow.from, arrow.to]
                    .iter()
                    .all(|end| part.view.items.get(*end).is_some())
            );
        }
        let also = part.view.also.iter().flat_map(|also| &also.items);
        Some(also.map(|item| item.name.to_string()).collect())
    }

    #[test]
    fn infrastructure_and_the_nodes_that_only_it_connects_are_words() {
        let found =
            words(&["/b/driver>/b/odom@5 /b/ekf</b/odom /b/camera_tf>/tf@5 /b/driver>/tf@9"]);
        assert_eq!(found.unwrap(), ["/tf", "/b/camera_tf"]);
    }

    #[test]
    fn topics_without_a_subscriber_are_drawn() {
        let found = words(&["/driver>/odom@5 /driver>/tf@9"]);
        assert_eq!(found.unwrap(), ["/tf"]);
    }

    #[test]
    fn a_view_of_infrastructure_is_drawn_as_a_whole() {
        assert_eq!(words(&["/a>/tf@5 /b</tf"]), None);
        assert_eq!(words(&["/a>/x@1 /b</x /c>/tf@1 /d>/tf@1 /e>/tf@1"]), None);
    }
}
