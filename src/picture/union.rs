//! The union of all windows, drawn once in the layout's own pixels, for pages where classes say what each window shows.

use std::collections::BTreeSet;

use super::arrows::{Arrows, Track};
use super::boxes::{Boxes, corner};
use super::draft;
use super::page::Fit;
use super::{Picture, badge, encoded, is_badged};
use crate::evidence::Degree;
use crate::geometry::{Point, Rect, Size};
use crate::graph::State;
use crate::scene::Group;
use crate::style::Style;
use crate::view::{Mark, Shown};

/// The whole graph, every element once and as if it were active; a painter leaves out the colours.
#[derive(Clone, Debug, PartialEq)]
pub struct Union {
    /// The size of the whole.
    pub size: Size,
    /// The boxes around namespaces, outer ones first.
    pub spaces: Vec<Group>,
    /// The arrows in the order in which they are painted: places in the view.
    pub order: Vec<usize>,
    /// A part per arrow of the view. Its last text, if there is one, is its rate.
    pub arrows: Vec<Part>,
    /// A part per item of the view.
    pub items: Vec<Part>,
}

/// One element of the union.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its shapes and texts.
    pub group: Group,
    /// Whether its last text is another in other windows: a rate or a lifecycle state.
    pub is_live: bool,
    /// Where an item stands; empty for an arrow.
    pub rect: Rect,
    /// Where its badge stands.
    pub badge: Point,
    /// The marks that it carries a badge for in some window.
    pub marks: BTreeSet<Mark>,
}

/// The badge of a mark around (0, 0).
pub fn sign(style: &Style, mark: Mark) -> Group {
    let mut group = Group::default();
    badge::badge(&mut group, style, mark, Point::default(), 1.0);
    group
}

impl Picture<'_> {
    /// Everything that is ever in the picture.
    pub fn union(&self) -> Union {
        let (sketch, layout) = (&self.sketch, &self.layout);
        let fit = Fit {
            scale: 1.0,
            origin: Point::default(),
        };
        let boxes = Boxes {
            style: sketch.style,
            fit,
        };
        let spaces = sketch.draft.spaces.iter().zip(&layout.clusters);
        Union {
            size: layout.size,
            spaces: spaces
                .map(|(space, place)| boxes.space(space, *place, &encoded(&space.name)))
                .collect(),
            order: self.order.clone(),
            arrows: self.union_arrows(fit),
            items: self.union_items(&boxes),
        }
    }

    fn union_items(&self, boxes: &Boxes<'_>) -> Vec<Part> {
        let view = self.sketch.view;
        let mut marks = vec![BTreeSet::new(); view.items.len()];
        for shown in view.frames.iter().flat_map(|f| &f.items) {
            if let (Some(mark), Some(marks)) = (shown.mark, marks.get_mut(shown.id as usize)) {
                marks.insert(mark);
            }
        }
        let items = view.items.iter().zip(&self.sketch.draft.labels);
        let parts = items.zip(&self.layout.boxes).zip(marks).enumerate();
        parts
            .map(|(at, (((item, label), place), marks))| {
                let is_live = label.second && label.fixed.is_empty();
                let shown = plain(is_live.then_some(1.0));
                let id = self.item_ids[at].clone();
                Part {
                    group: boxes.item(item, label, *place, &shown, is_live, id),
                    is_live,
                    rect: *place,
                    badge: corner(item.kind, *place, 1.0),
                    marks,
                }
            })
            .collect()
    }

    fn union_arrows(&self, fit: Fit) -> Vec<Part> {
        let (view, plan) = (self.sketch.view, &self.sketch.draft.plan);
        let arrows = Arrows {
            style: self.sketch.style,
            fonts: self.sketch.fonts,
            fit,
        };
        let mut marks = vec![BTreeSet::new(); view.arrows.len()];
        for frame in &view.frames {
            for shown in &frame.arrows {
                let at = shown.id as usize;
                let (Some(mark), Some(arrow)) = (shown.mark, view.arrows.get(at)) else {
                    continue;
                };
                let ends = [arrow.from, arrow.to].map(|id| draft::find(&frame.items, id as usize));
                if is_badged(shown, ends) {
                    marks[at].insert(mark);
                }
            }
        }
        let empty = crate::layout::Route::default();
        let parts = view.arrows.iter().zip(marks).enumerate();
        parts
            .map(|(at, (arrow, marks))| {
                let room = plan.links.get(at).and_then(|link| link.label);
                let track = Track::new(self.layout.routes.get(at).unwrap_or(&empty), room, fit);
                let ends = [arrow.from, arrow.to].map(|id| &view.items[id as usize]);
                let shown = plain(room.map(|_| 1.0));
                let id = self.arrow_ids[at].clone();
                let ends = (ends[0], ends[1]);
                let group = arrows.arrow(arrow, ends, &track, &shown, None, false, id);
                Part {
                    group,
                    is_live: room.is_some(),
                    rect: Rect::default(),
                    badge: track.badge,
                    marks,
                }
            })
            .collect()
    }
}

/// An element of which nothing is to be told but, perhaps, a rate.
fn plain(hz: Option<f64>) -> Shown {
    Shown {
        id: 0,
        state: State::Active,
        degree: Degree::Measured,
        mark: None,
        hz,
        from_hz: None,
        count: None,
        lifecycle: None,
    }
}
