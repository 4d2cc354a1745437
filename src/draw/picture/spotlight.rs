//! The spotlight: in a window with news, boxes and lines that have no part in them are drawn paler.

use std::collections::BTreeSet;

use super::Measured;
use crate::draw::scene::Group;
use crate::draw::style::Style;
use crate::view::{Arrow, Frame, ItemId, Mark, SeenWindow, Shown, ShownRuns};

/// The fewest boxes of a picture that is not seen at a glance.
const FEWEST: usize = 5;

/// What has a part in the news of a window.
pub(super) struct Spotlight<'a> {
    style: &'a Style,
    /// The boxes that changed, or list something that did.
    news: BTreeSet<ItemId>,
    /// These, and those at the other ends of their lines and of lines that changed.
    pub(super) lit: BTreeSet<ItemId>,
}

impl<'a> Spotlight<'a> {
    /// The spotlight of window `k`; none in a picture of few boxes, on paper, and without news.
    pub(super) fn new(
        measured: &Measured<'a>,
        (k, frame): (usize, &Frame),
        seen: &SeenWindow,
    ) -> Option<Self> {
        let (view, options) = (measured.view, &measured.options);
        let is_film = view.has_time() && !options.bare && options.width_mm.is_none();
        if !is_film || frame.caption.is_empty() || seen.items.len() < FEWEST {
            return None;
        }
        let changed = seen.items.iter().filter(|shown| is_news(shown));
        let is_new = |looks: &ShownRuns| looks.at(k).is_some_and(is_news);
        let rows = view.rows.iter().filter(|row| is_new(&row.shown));
        let news: BTreeSet<ItemId> = changed
            .map(Shown::item)
            .chain(rows.map(|r| r.owner))
            .collect();
        let mut spot = Self {
            style: measured.style,
            lit: news.clone(),
            news,
        };
        for shown in &seen.arrows {
            let arrow = &view.arrows[shown.arrow()];
            if spot.has_line(arrow, shown) {
                spot.lit.extend([arrow.from, arrow.to]);
            }
        }
        (!spot.lit.is_empty()).then_some(spot)
    }

    /// Whether a line has a part in the news.
    pub(super) fn has_line(&self, arrow: &Arrow, shown: &Shown) -> bool {
        is_news(shown)
            || [arrow.from, arrow.to]
                .iter()
                .any(|end| self.news.contains(end))
    }

    /// The group in paler colours.
    pub(super) fn pale(&self, group: &mut Group) {
        group.fade(self.style.background(), 1.0 - self.style.page.spotlight);
    }
}

/// Whether something changed in this window.
fn is_news(shown: &Shown) -> bool {
    shown.mark.is_some_and(|mark| mark != Mark::Away)
}
