//! A window with changes: the marks of its items and arrows.

use super::items::Viewed;
use super::marks::{Changed, WindowMarks};
use super::state::{LivingItems, Now};
use super::{ArrowId, ArrowKind, Counts, ItemId, ItemKind, Mark, Shown, TopicRow};
use crate::graph::ById;
use crate::mission::event_log::{Detail, Event, EventId, Kind};

/// The items and arrows that exist before and after a window, and the changes in between.
#[derive(Default)]
pub(super) struct WindowTurn {
    pub(super) before: LivingItems,
    pub(super) after: LivingItems,
    pub(super) changed: WindowMarks,
}

/// An item in a window with headlines.
pub(super) struct Marked {
    /// Whether any part of it exists.
    is_there: bool,
    pub(super) marked: Option<Shown>,
}

impl WindowTurn {
    pub(super) fn items(&self, viewed: &Viewed, now: &Now<'_>) -> ById<ItemId, Marked> {
        let item = |(id, item): (ItemId, &super::Item)| {
            let shown = now.item(id);
            let there = (self.before.items[id], self.after.items[id]);
            Marked {
                is_there: shown.is_some(),
                marked: shown.and_then(|shown| {
                    let mut shown = marked(shown, there, self.changed.items.get(&id))?;
                    let is_folded = item.kind == ItemKind::Namespace;
                    shown.inside = is_folded.then(|| self.inside(&shown)).flatten();
                    Some(shown)
                }),
            }
        };
        viewed.items.with_ids().map(item).collect()
    }

    /// An arrow appears and vanishes with its ends, unless it has events of its own.
    pub(super) fn arrow(
        &self,
        viewed: &Viewed,
        now: &Now<'_>,
        items: &ById<ItemId, Marked>,
        id: ArrowId,
    ) -> Option<Shown> {
        let arrow = viewed.arrows.get(id)?;
        let [from, to] = [items.get(arrow.from)?, items.get(arrow.to)?];
        let ends = [from.marked.as_ref()?, to.marked.as_ref()?];
        let shown = now.arrow(id).filter(|_| from.is_there && to.is_there)?;
        // A node that restarts keeps its arrows, even if it is away when the window ends.
        let is_back = |end: &&Shown| matches!(end.mark, Some(Mark::Restarted | Mark::Away));
        let is_kept = ends.iter().any(is_back);
        let there = (self.before.arrows[id], self.after.arrows[id] || is_kept);
        let reported = self.changed.arrows.get(&id).cloned();
        let ends = ends.map(|end| Some((end.mark, &end.events[..])));
        let reported = reported.or_else(|| with_ends(there, ends));
        let shown = marked(shown, there, reported.as_ref())?;
        if arrow.kind != ArrowKind::Bundle {
            return Some(shown);
        }
        let inside = self.inside(&shown);
        Some(Shown {
            inside,
            ..self.with_topics(viewed, now, arrow, shown)
        })
    }

    /// A changed bundle with the changes of its topics, unless it appeared or vanished as a whole.
    fn with_topics(
        &self,
        viewed: &Viewed,
        now: &Now<'_>,
        arrow: &super::Arrow,
        mut shown: Shown,
    ) -> Shown {
        if shown.mark.is_none_or(|mark| mark.class() != "changed") {
            return shown;
        }
        let lives = |items: &LivingItems, row: &TopicRow| {
            let all = items.topics.get(ArrowId(shown.id));
            all.and_then(|all| all.get(row.topic as usize)) == Some(&true)
        };
        for row in &mut shown.topics {
            let there = (lives(&self.before, row), lives(&self.after, row));
            match there {
                (false, true) => row.mark = Some(Mark::Added),
                (true, false) => row.mark = Some(Mark::Removed),
                _ => {
                    let name = &arrow.topics[row.topic as usize];
                    for event in shown.events.iter().filter_map(|id| now.event(*id)) {
                        let topic = viewed.topic_of(event.what);
                        if topic.is_some_and(|topic| viewed.bundled[topic] == *name) {
                            (row.mark, row.rates) = changed(event);
                        }
                    }
                }
            }
        }
        shown
    }

    /// The number of headlines reported on a collapsed namespace or a bundle; `None` without any.
    fn inside(&self, shown: &Shown) -> Option<Box<Counts>> {
        let reported = self.changed.headlines.iter();
        let counts = Counts::of(reported.filter(|h| shown.events.binary_search(&h.event).is_ok()));
        (counts.total() > 0).then(|| Box::new(counts))
    }
}

/// The mark of a topic of a bundle for an event, with its rates before and after.
fn changed(event: &Event) -> (Option<Mark>, Option<(f64, f64)>) {
    match (event.kind, &event.detail) {
        (_, Detail::Rates { from_hz, to_hz }) => {
            let mark = if to_hz > from_hz {
                Mark::Faster
            } else {
                Mark::Slower
            };
            (Some(mark), Some((*from_hz, *to_hz)))
        }
        (Kind::HandedOver, _) => (Some(Mark::HandedOver), None),
        (Kind::Silent, _) => (Some(Mark::Paused), None),
        _ => (Some(Mark::Changed), None),
    }
}

/// The changes of an arrow that follow from the marks of its ends and their events; `there` is whether it
/// exists before and after.
pub(super) fn with_ends(
    there: (bool, bool),
    ends: [Option<(Option<Mark>, &[EventId])>; 2],
) -> Option<Changed> {
    let marks: &[Mark] = match there {
        // A node may return with other lines.
        (false, true) => &[Mark::Added, Mark::Restarted],
        (_, false) => &[Mark::Removed, Mark::Restarted],
        // Lines stay, dotted, while one of their ends is away.
        (true, true) => &[Mark::Removed, Mark::Away],
    };
    let of = |mark: Option<Mark>| mark.filter(|mark| marks.contains(mark));
    let mut ends = ends.into_iter().flatten();
    let (mark, events) = ends.find_map(|(mark, all)| Some((of(mark)?, all)))?;
    Some(Changed {
        came: there == (false, true),
        went: !there.1 || mark == Mark::Removed,
        mark: Some(mark).filter(|_| there == (true, true)),
        events: events.to_vec(),
        ..Changed::default()
    })
}

/// The look of an item or arrow that exists before, after, or both; `None` for one that ended without an
/// event.
pub(super) fn marked(
    shown: Shown,
    there: (bool, bool),
    reported: Option<&Changed>,
) -> Option<Shown> {
    let Some(reported) = reported else {
        return there.1.then_some(shown);
    };
    let mark = match there {
        (false, true) if reported.came => Some(Mark::Added),
        (_, false) if reported.went => Some(Mark::Removed),
        // It ended and began within one window.
        (true, true) if reported.came && reported.went => reported.mark.or(Some(Mark::Restarted)),
        // One of several that are drawn as one.
        (true, true) if reported.came || reported.went => reported.mark.or(Some(Mark::Inside)),
        _ => reported.mark,
    };
    Some(Shown {
        mark,
        rates: reported
            .rates
            .filter(|_| matches!(mark, Some(Mark::Faster | Mark::Slower))),
        events: reported.events.clone(),
        ..shown
    })
}
