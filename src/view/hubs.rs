//! Topics that half the system is connected to, such as `/tf`: drawn once in each namespace that uses them, so that no
//! long lines lead there from everywhere.

use std::collections::{BTreeMap, BTreeSet};

use super::showing::{Showing, ShowingWriter};
use super::{Arrow, ArrowKind, Item, Mark, Shown, View};

/// The least number of boxes that a hub is connected to, and of outermost namespaces (or the outside) that they stand
/// in. Fewer lines can be followed.
const FEWEST_ENDS: usize = 6;
const FEWEST_HOMES: usize = 2;

/// The outermost namespace of a box; `None` for the outside.
type Home = Option<usize>;

impl View {
    /// This view with every hub drawn as several boxes: one in each outermost namespace, and one outside of all, where
    /// boxes are connected to it.
    pub(crate) fn with_hubs_split(mut self) -> Self {
        for hub in self.hubs() {
            self.split(hub);
        }
        self
    }

    /// Whether a hub is in this view.
    pub(crate) fn has_hubs(&self) -> bool {
        !self.hubs().is_empty()
    }

    fn hubs(&self) -> Vec<u32> {
        let mut ends: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
        for arrow in &self.arrows {
            if let Some((topic, node)) = ends_of(arrow) {
                ends.entry(topic).or_default().insert(node);
            }
        }
        let is_hub = |(_, nodes): &(&u32, &BTreeSet<u32>)| {
            let homes: BTreeSet<Home> = nodes.iter().map(|&node| self.home(node)).collect();
            nodes.len() >= FEWEST_ENDS && homes.len() >= FEWEST_HOMES
        };
        let hubs = ends.iter().filter(is_hub).map(|(topic, _)| *topic);
        hubs.collect()
    }

    /// The outermost namespace that a box stands in.
    fn home(&self, item: u32) -> Home {
        let mut home = self.items.get(item as usize)?.cluster?;
        while let Some(parent) = self.namespaces.get(home).and_then(|n| n.parent) {
            home = parent;
        }
        Some(home)
    }

    fn split(&mut self, hub: u32) {
        let mut uses: BTreeMap<Home, Vec<usize>> = BTreeMap::new();
        for (at, arrow) in self.arrows.iter().enumerate() {
            if let Some((_, node)) = ends_of(arrow).filter(|(topic, _)| *topic == hub) {
                uses.entry(self.home(node)).or_default().push(at);
            }
        }
        let own = self.home(hub);
        let most = uses.iter().rev().max_by_key(|(_, arrows)| arrows.len());
        let stays = if uses.contains_key(&own) {
            own
        } else {
            most.and_then(|(home, _)| *home)
        };
        // The hub's own box shows less than the hub from its turn on.
        let whole = self.items_shown.get(hub as usize).cloned();
        for (home, arrows) in uses {
            let at = if home == stays {
                hub
            } else {
                self.repeat(hub, home)
            };
            for &arrow in &arrows {
                let arrow = &mut self.arrows[arrow];
                match arrow.kind {
                    ArrowKind::Publish => arrow.to = at,
                    _ => arrow.from = at,
                }
            }
            if let Some(whole) = &whole {
                self.show(whole, at, &arrows);
            }
        }
        let hub_item = &mut self.items[hub as usize];
        hub_item.hub = Some(hub);
        if stays != own {
            hub_item.cluster = stays;
        }
    }

    /// Adds the box of a hub in a namespace.
    fn repeat(&mut self, hub: u32, home: Home) -> u32 {
        let at = u32::try_from(self.items.len()).unwrap_or(u32::MAX);
        let item = &self.items[hub as usize];
        let space = home.and_then(|home| self.namespaces.get(home));
        let space = space.map_or("", |space| &*space.name);
        let plain = item.name.trim_start_matches('/').replace('/', ".");
        self.items.push(Item {
            // No topic is called so: `@` is not allowed in names.
            name: format!("{space}/@{plain}").into(),
            cluster: home,
            hub: Some(hub),
            ..item.clone()
        });
        at
    }

    /// Shows the box of a hub in the windows in which one of its arrows is there. It came or went with its arrows if all
    /// of them did.
    fn show(&mut self, whole: &Showing, at: u32, arrows: &[usize]) {
        let arrows: Vec<&Showing> = arrows
            .iter()
            .filter_map(|&arrow| self.arrows_shown.get(arrow))
            .collect();
        let runs = arrows.iter().flat_map(|showing| showing.runs());
        let turns: BTreeSet<u32> = runs.chain(whole.runs()).map(|run| run.0).collect();
        let mut writer = ShowingWriter::default();
        for window in turns {
            let there: Vec<&Shown> = arrows
                .iter()
                .filter_map(|a| a.at(window as usize))
                .collect();
            let look = whole.at(window as usize).filter(|_| !there.is_empty());
            writer.show(window, look.map(|look| beside(look, at, &there)));
        }
        let showing = writer.finish();
        match self.items_shown.get_mut(at as usize) {
            Some(shown) => *shown = showing,
            None => self.items_shown.push(showing),
        }
    }
}

/// The look of a hub's box with these arrows.
fn beside(look: &Shown, at: u32, arrows: &[&Shown]) -> Shown {
    let shared = |mark: Mark| arrows.iter().all(|arrow| arrow.mark == Some(mark));
    let moved = [Mark::Added, Mark::Removed]
        .into_iter()
        .find(|m| shared(*m));
    let own = look
        .mark
        .filter(|m| !matches!(m, Mark::Added | Mark::Removed));
    let mut shown = Shown {
        id: at,
        mark: moved.or(own),
        ..look.clone()
    };
    if let Some(mark) = moved {
        let told = arrows.iter().flat_map(|arrow| &arrow.entries).copied();
        let told: BTreeSet<_> = told.collect();
        (shown.entries, shown.rates) = (told.into_iter().collect(), None);
        if mark == Mark::Removed {
            shown.hz = Some(0.0);
        }
    }
    shown
}

/// The topic and the other end of an arrow.
fn ends_of(arrow: &Arrow) -> Option<(u32, u32)> {
    match arrow.kind {
        ArrowKind::Publish => Some((arrow.to, arrow.from)),
        ArrowKind::Subscribe => Some((arrow.from, arrow.to)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{ViewOptions, view};

    /// The boxes of `/tf` with the namespaces they stand in, and the windows in which they are there.
    fn boxes(windows: &[&str]) -> Vec<(String, Vec<Option<Mark>>)> {
        let view = view(&mission(windows), &ViewOptions::default())
            .0
            .with_hubs_split();
        let hubs = view.items.iter().zip(&view.items_shown);
        hubs.filter(|(item, _)| &*item.label == "/tf")
            .map(|(item, shown)| {
                let windows = (0..windows.len()).filter_map(|w| shown.at(w));
                (item.name.to_string(), windows.map(|s| s.mark).collect())
            })
            .collect()
    }

    const FIRST: &str = "/a/x>/tf /a/y>/tf /a/z>/tf /m</tf";

    #[test]
    fn a_hub_is_drawn_in_each_namespace_while_something_there_uses_it() {
        let more = format!("{FIRST} /b/x>/tf /b/y>/tf");
        let hubs = boxes(&[FIRST, &more, FIRST]);
        let want = [
            ("/tf", vec![None, None, None]),
            ("/a/@tf", vec![None, None, None]),
            ("/b/@tf", vec![Some(Mark::Added), Some(Mark::Removed)]),
        ];
        assert_eq!(hubs, want.map(|(name, marks)| (name.to_owned(), marks)));
    }

    #[test]
    fn a_box_stays_where_another_box_of_its_hub_goes() {
        let hubs = boxes(&[
            "/a/x>/tf /a/y>/tf /a/z>/tf /m</tf /n</tf /o</tf",
            "/a/x>/tf /a/y>/tf /a/z>/tf",
        ]);
        let there: Vec<usize> = hubs.iter().map(|(_, marks)| marks.len()).collect();
        assert_eq!(hubs[1].0, "/a/@tf");
        assert_eq!(hubs[1].1, [None, None], "{there:?}");
    }

    #[test]
    fn few_lines_lead_to_one_box() {
        assert_eq!(boxes(&[FIRST]).len(), 1);
    }
}
