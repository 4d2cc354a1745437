//! Topics as rows of boxes: one with only one connected box is a row of that box instead of a leaf beside it; a hub, a
//! topic that half the system is connected to, is a row in every connected box instead of lines from everywhere.
//!
//! `/battery`, which only `/driver` publishes and nobody reads, is the row `→ /battery` of `/driver`; `/tf` is a row of each
//! of the six nodes that use it.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::base::ids::grouped;
use crate::base::name::{is_unnamed, namespace};
use crate::graph::ById;
use crate::mission::EventId;
use crate::view::choose::is_infrastructure;
use crate::view::{Arrow, ArrowId, ArrowKind, Item, ItemId, Shown, ShownRuns, TopicRow, View};

/// A topic that is a row in a box: one without another known endpoint, or a hub.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxRow {
    /// The box that it is a row of.
    pub owner: ItemId,
    /// Whether that box publishes it, and whether it subscribes to it.
    pub ways: [bool; 2],
    /// Whether it is a hub, a topic that half the system is connected to, and a row in each of these boxes.
    pub is_infrastructure: bool,
    /// The topic, or the group of topics.
    pub item: Item,
    /// The looks of the topic, window by window.
    pub shown: ShownRuns,
}

/// The least number of boxes that a hub is connected to, and of outermost namespaces (or the outside) that
/// contain them. Five lines to one topic are easy to follow, and those inside one namespace cross no other.
const FEWEST_ENDS: usize = 6;
const FEWEST_SPACES: usize = 2;

impl View {
    /// Makes topics with one known endpoint rows of its box and, if `hides_infrastructure`, hubs rows of all
    /// connected boxes. Topics that exist without a connection in some window stay boxes. The rows are sorted
    /// by their boxes, publications before subscriptions.
    pub(crate) fn fold_leaves(&mut self, hides_infrastructure: bool) {
        let mut lines: ById<ItemId, Vec<ArrowId>> = ById::like(&self.items, Vec::new());
        for (at, arrow) in self.arrows.with_ids() {
            if let Some((topic, _)) = self.topic_end(arrow) {
                lines[topic].push(at);
            }
        }
        let mut rows = Vec::new();
        let mut items_stay = ById::like(&self.items, true);
        let mut arrows_stay = ById::like(&self.arrows, true);
        for (topic, lines) in lines.with_ids().filter(|(_, lines)| !lines.is_empty()) {
            let owner = |at: ArrowId| self.topic_end(&self.arrows[at]).map_or(topic, |end| end.1);
            let owners = grouped(lines.iter().map(|at| (owner(*at), *at)));
            let is_infrastructure = hides_infrastructure
                && is_infrastructure(&self.items[topic].name)
                || self.is_hub(owners.keys());
            if (owners.len() == 1 || is_infrastructure)
                && self.is_reported(topic, lines, is_infrastructure)
            {
                let row = |(owner, lines): (ItemId, Vec<ArrowId>)| {
                    self.row((topic, owner), &lines, is_infrastructure)
                };
                rows.extend(owners.into_iter().map(row));
                items_stay[topic] = false;
                for at in lines {
                    arrows_stay[*at] = false;
                }
            }
        }
        self.keep_arrows(&arrows_stay);
        for never in self.hide_unnamed(&rows) {
            items_stay[never] = false;
        }
        rows.retain(|row| items_stay[row.owner]);
        let places = self.keep_items(&items_stay);
        for row in &mut rows {
            row.owner = places[row.owner];
        }
        rows.sort_by_cached_key(|row| {
            let (ways, name) = (row.ways.map(|is| !is), Arc::clone(&row.item.name));
            (row.owner, ways, row.is_infrastructure, name)
        });
        self.rows = rows;
    }

    /// Whether a topic connected to these boxes is a hub: many, in several outermost namespaces.
    fn is_hub<'a>(&self, owners: impl Iterator<Item = &'a ItemId>) -> bool {
        let names = owners.map(|at| &*self.items[*at].name);
        let spaces: Vec<&str> = names
            .map(|name| namespace(name).split('/').nth(1).unwrap_or_default())
            .collect();
        let different: BTreeSet<&&str> = spaces.iter().collect();
        spaces.len() >= FEWEST_ENDS && different.len() >= FEWEST_SPACES
    }

    /// The topic of an arrow with the box at its other end.
    fn topic_end(&self, arrow: &Arrow) -> Option<(ItemId, ItemId)> {
        let is_topic = |at: ItemId| self.items.get(at).is_some_and(|i| i.kind.word() == "topic");
        match (is_topic(arrow.from), is_topic(arrow.to)) {
            (true, false) => Some((arrow.from, arrow.to)),
            (false, true) => Some((arrow.to, arrow.from)),
            _ => None,
        }
    }

    /// Whether one of these arrows of a topic exists whenever the topic does; of a hub, whenever there is an
    /// event about it.
    fn is_reported(&self, topic: ItemId, lines: &[ArrowId], is_infrastructure: bool) -> bool {
        let Some(looks) = self.items_shown.get(topic) else {
            return true;
        };
        let needs_line = |k: &usize| {
            let look = looks.at(*k);
            look.is_some_and(|look| !is_infrastructure || look.mark.is_some())
        };
        let windows = ShownRuns::turns(self.looks_of(lines).chain([looks])).into_iter();
        let mut windows = windows.map(|window| window as usize).filter(needs_line);
        windows.all(|k| self.looks_of(lines).any(|line| line.at(k).is_some()))
    }

    fn looks_of<'a>(&'a self, lines: &'a [ArrowId]) -> impl Iterator<Item = &'a ShownRuns> + Clone {
        lines.iter().filter_map(|at| self.arrows_shown.get(*at))
    }

    /// The row of a topic in a box; that of a hub has the rate of this box alone.
    fn row(
        &self,
        (topic, owner): (ItemId, ItemId),
        lines: &[ArrowId],
        is_infrastructure: bool,
    ) -> BoxRow {
        let sends = |at: &ArrowId| self.arrows[*at].to == topic;
        let receives = |at: &ArrowId| self.arrows[*at].from == topic;
        let own = self.items_shown.get(topic);
        let row = |k: usize| {
            let look = own?.at(k)?;
            let line = reported(self.looks_of(lines).filter_map(|line| line.at(k)))?;
            // A connection that appeared or vanished is also the change of the row.
            let reported = if look.mark.is_some() { look } else { line };
            Some(Shown {
                mark: reported.mark,
                steps: reported.steps.clone(),
                events: events([look, line].into_iter()),
                ..(if is_infrastructure { line } else { look }).clone()
            })
        };
        BoxRow {
            owner,
            ways: [lines.iter().any(sends), lines.iter().any(receives)],
            is_infrastructure,
            item: self.items[topic].clone(),
            shown: ShownRuns::made_of(self.looks_of(lines).chain(own), row),
        }
    }

    /// Hides a box of unnamed publishers in windows without any of its topics, apart from hubs, as it would
    /// be empty. Returns the boxes that are never shown.
    fn hide_unnamed(&mut self, rows: &[BoxRow]) -> Vec<ItemId> {
        let mut never = Vec::new();
        let linked: BTreeSet<ItemId> = self.arrows.iter().flat_map(|a| [a.from, a.to]).collect();
        let own = rows.iter().filter(|row| !row.is_infrastructure);
        let own = grouped(own.map(|row| (row.owner, &row.shown)));
        for (at, looks) in self.items.ids().zip(self.items_shown.iter_mut()) {
            if !is_unnamed(&self.items[at].name) || linked.contains(&at) {
                continue;
            }
            let own = own.get(&at).into_iter().flatten().copied();
            *looks = ShownRuns::made_of(own.clone().chain([&*looks]), |k| {
                let is_there = own.clone().any(|shown| shown.at(k).is_some());
                looks.at(k).filter(|_| is_there).cloned()
            });
            if looks.distinct().is_empty() {
                never.push(at);
            }
        }
        never
    }

    /// Combines the two arrows of a box that both publishes and subscribes to a topic into one line, with a
    /// head at each end that is used.
    pub(crate) fn join_twins(&mut self) {
        let mut stays = ById::like(&self.arrows, true);
        for there in self.arrows.ids() {
            let (from, to) = (self.arrows[there].from, self.arrows[there].to);
            let is_publish = self.arrows[there].kind == ArrowKind::Publish;
            let back = self.subscription(to, from);
            let Some(back) = back.filter(|_| is_publish) else {
                continue;
            };
            stays[back] = false;
            let members = self.arrows[back].members.clone();
            let topic = Arc::clone(&self.items[to].name);
            let arrow = &mut self.arrows[there];
            arrow.kind = ArrowKind::Bundle;
            arrow.topics = vec![topic];
            arrow.members.extend(members);
            arrow.members.sort_unstable();
            if !self.arrows_shown.is_empty() {
                self.arrows_shown[there] =
                    both_ways([there, back].map(|at| &self.arrows_shown[at]));
            }
        }
        self.keep_arrows(&stays);
    }

    /// The arrow of a subscription; arrows are sorted by their ends.
    fn subscription(&self, topic: ItemId, node: ItemId) -> Option<ArrowId> {
        let ends = |arrow: &Arrow| (arrow.from, arrow.to);
        let first = self.arrows.partition_point(|a| ends(a) < (topic, node));
        let all = self.arrows.with_ids().skip(first);
        let mut all = all.take_while(|(_, arrow)| ends(arrow) == (topic, node));
        let found = all.find(|(_, arrow)| arrow.kind == ArrowKind::Subscribe);
        found.map(|(id, _)| id)
    }

    /// Removes all other arrows and renumbers those that stay.
    pub(crate) fn keep_arrows(&mut self, stays: &ById<ArrowId, bool>) {
        self.arrows.retain(|at| stays[at]);
        self.arrows_shown.retain(|at| stays[at]);
        renumber(&mut self.arrows_shown);
    }

    /// Removes all other boxes, to which no arrow may lead, and renumbers those that stay. Returns the new ids.
    pub(crate) fn keep_items(&mut self, stays: &ById<ItemId, bool>) -> ById<ItemId, ItemId> {
        let mut next = 0;
        let place = |stays: &bool| {
            next += u32::from(*stays);
            ItemId(next - u32::from(*stays))
        };
        let places: ById<ItemId, ItemId> = stays.iter().map(place).collect();
        self.items.retain(|at| stays[at]);
        self.items_shown.retain(|at| stays[at]);
        for arrow in self.arrows.iter_mut() {
            arrow.from = places[arrow.from];
            arrow.to = places[arrow.to];
        }
        renumber(&mut self.items_shown);
        places
    }
}

/// Sets the ids of these looks to their indices.
fn renumber(all: &mut [ShownRuns]) {
    for (looks, id) in all.iter_mut().zip(0..) {
        looks.renumber(id);
    }
}

/// The looks of one line for both ways between a node and a topic.
fn both_ways(ways: [&ShownRuns; 2]) -> ShownRuns {
    ShownRuns::made_of(ways.into_iter(), |k| {
        let looks = ways.map(|way| way.at(k));
        let look = reported(looks.into_iter().flatten())?;
        Some(Shown {
            events: events(looks.into_iter().flatten()),
            topics: vec![TopicRow::of(0, looks.map(|look| look.is_some()), look)],
            ..look.clone()
        })
    })
}

/// The first of these looks; one with a mark takes precedence.
fn reported<'a>(looks: impl Iterator<Item = &'a Shown> + Clone) -> Option<&'a Shown> {
    let marked = looks.clone().find(|look| look.mark.is_some());
    marked.or_else(|| looks.into_iter().next())
}

/// The events behind these looks, sorted.
fn events<'a>(looks: impl Iterator<Item = &'a Shown>) -> Vec<EventId> {
    let events: BTreeSet<EventId> = looks.flat_map(|look| &look.events).copied().collect();
    events.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{Mark, Mode, ViewOptions, view};

    fn mode(is_bundled: bool) -> Mode {
        if is_bundled { Mode::Nodes } else { Mode::All }
    }

    /// The boxes and the rows of a picture: `/a → /t`, with the windows in which each row exists.
    fn drawn(windows: &[&str], is_bundled: bool) -> (Vec<String>, Vec<String>) {
        let options = ViewOptions {
            mode: mode(is_bundled),
            is_bundled,
            is_picture: true,
            ..ViewOptions::default()
        };
        let (view, _) = view(&mission(windows), &options);
        let name = |item: &Item| item.name.to_string();
        let row = |row: &BoxRow| {
            let sign = match row.ways {
                [true, true] => "↔",
                [true, false] => "→",
                _ => "←",
            };
            let owner = name(&view.items[row.owner]);
            let marks = (0..windows.len()).map(|k| match row.shown.at(k).map(|s| s.mark) {
                None => ' ',
                Some(None) => '.',
                Some(Some(Mark::Added)) => '+',
                Some(Some(Mark::Removed)) => '-',
                Some(Some(_)) => '!',
            });
            format!(
                "{owner} {sign} {} {}",
                row.item.name,
                marks.collect::<String>()
            )
        };
        (
            view.items.iter().map(name).collect(),
            view.rows.iter().map(row).collect(),
        )
    }

    #[test]
    fn a_topic_with_one_known_end_is_a_row_of_its_node() {
        let (boxes, rows) = drawn(&["/a>/t /a>/u /b</u /b</v /a>/w /a</w"], false);
        assert_eq!(boxes, ["/a", "/b", "/u"]);
        assert_eq!(rows, ["/a ↔ /w .", "/a → /t .", "/b ← /v ."]);
    }

    #[test]
    fn infrastructure_is_a_row_of_every_node() {
        let (boxes, rows) = drawn(&["/a>/tf /b>/tf /c</tf /a>/t /c</t"], false);
        assert_eq!(boxes, ["/a", "/b", "/c", "/t"]);
        assert_eq!(rows, ["/a → /tf .", "/b → /tf .", "/c ← /tf ."]);
    }

    #[test]
    fn a_hub_of_several_namespaces_is_a_row_of_every_node() {
        let five = "/n/a>/t /n/b</t /n/c</t /n/d</t /n/e</t";
        assert_eq!(drawn(&[&format!("{five} /n/f</t")], false).1.len(), 0);
        let (boxes, rows) = drawn(&[&format!("{five} /m/f</t")], false);
        assert_eq!((boxes.len(), rows.len()), (6, 6));
    }

    #[test]
    fn a_topic_with_two_publishers_stays_a_box() {
        let (boxes, rows) = drawn(&["/a>/t /b>/t"], false);
        assert_eq!(
            (boxes, rows.len()),
            (vec!["/a".into(), "/b".into(), "/t".into()], 0)
        );
    }

    #[test]
    fn rows_appear_and_vanish_with_their_marks() {
        let (_, rows) = drawn(&["/a", "/a>/t@9", "/a>/t@40", "/a"], false);
        assert_eq!(rows, ["/a → /t  +!-"]);
    }

    #[test]
    fn changing_topics_have_rows_instead_of_lines() {
        let windows = ["/a>/t /b</t /a>/quiet", "/a>/t /b</t /a>/quiet /a>/new"];
        let (boxes, rows) = drawn(&windows, true);
        assert_eq!(boxes, ["/a", "/b"]);
        assert_eq!(rows, ["/a → /new  +"]);
    }

    #[test]
    fn a_node_that_sends_and_receives_a_topic_has_one_line_to_it() {
        let options = ViewOptions {
            is_picture: true,
            ..ViewOptions::default()
        };
        let (view, _) = view(&mission(&["/a>/t /b</t", "/a>/t /b</t /a</t"]), &options);
        let heads = |at: u32, k: usize| {
            view.arrows_shown[ArrowId(at)]
                .at(k)
                .map(|s| s.topics[0].ways)
        };
        assert_eq!(view.arrows.len(), 2);
        assert_eq!(
            [heads(0, 0), heads(0, 1)],
            [Some([true, false]), Some([true, true])]
        );
    }

    #[test]
    fn a_topic_without_known_ends_is_text() {
        for is_bundled in [false, true] {
            let options = ViewOptions {
                mode: mode(is_bundled),
                is_bundled,
                is_picture: true,
                ..ViewOptions::default()
            };
            let later = "/a>/t /b</t =/x@5";
            let windows = ["/a>/t /b</t", later, later];
            let (view, _) = view(&mission(&windows), &options);
            let words: Vec<&str> = view
                .also
                .iter()
                .flat_map(|a| &a.items)
                .map(|i| &*i.name)
                .collect();
            assert_eq!(words, ["/x"], "bundled: {is_bundled}");
            let mark = view.also[0].shown[0].at(1).unwrap().mark;
            assert_eq!(mark, Some(Mark::Added));
        }
    }
}
