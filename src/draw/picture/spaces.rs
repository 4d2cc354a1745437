//! The frames of namespaces: their titles, the time of their first content, and the member lists of equal namespaces that are
//! drawn as one: a badge for each.

use super::page::GraphPen;
use crate::base::geometry::{Point, Rect};
use crate::draw::scene::{Anchor, Font, Form, Group, Shape, Stroke, Text};
use crate::draw::style::Color;
use crate::draw::text::{Fonts, Weight};
use crate::view::{MemberState, Namespace, View};

/// A namespace with a box around its members.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Space {
    /// Its full name.
    pub(crate) name: String,
    /// Its title: the part inside the namespace around it.
    pub(crate) title: String,
    /// The indices of the equal namespaces drawn as this one; empty for a single one.
    pub(crate) replicas: Vec<String>,
}

/// The titles of the namespaces: the part of their names inside the namespace around them.
pub(crate) fn spaces(view: &View, fonts: &Fonts) -> Vec<Space> {
    let space = |space: &Namespace| {
        let around = space.parent.and_then(|at| view.namespaces.get(at));
        let around = around.map_or("", |around| &*around.name);
        let title = fonts.shown(space.name.strip_prefix(around).unwrap_or(&space.name));
        Space {
            name: space.name.to_string(),
            title: match space.replicas.len() {
                0 => title.into_owned(),
                n => format!("{title} × {n}"),
            },
            replicas: space.replicas.iter().map(ToString::to_string).collect(),
        }
    };
    view.namespaces.iter().map(space).collect()
}

/// The first window in which each namespace has content.
pub(crate) fn first_seen(view: &View) -> Vec<usize> {
    let mut first = vec![usize::MAX; view.namespaces.len()];
    for (item, looks) in view.items_shown.with_ids() {
        let seen = looks.runs().find(|(_, shown)| shown.is_some());
        let seen = seen.map_or(usize::MAX, |(window, _)| window as usize);
        for at in view.around(item) {
            first[at] = first[at].min(seen);
        }
    }
    first
}

/// The badges in the member list of a namespace that represents several: left edges and widths, relative to
/// the title.
pub(crate) fn badges(space: &Space, fonts: &Fonts, size: f64) -> Vec<(f64, f64)> {
    if space.replicas.len() > MOST_BADGES {
        return Vec::new();
    }
    let mut x = fonts.width(&space.title, size, Weight::SemiBold) + size;
    let badge = |index: &String| {
        let width = fonts.width(index, size * BADGE_TEXT, Weight::SemiBold) + size * 0.6;
        let at = x;
        x += width + size * 0.2;
        (at, width)
    };
    space.replicas.iter().map(badge).collect()
}

/// The largest number of equal namespaces with a badge each; more, which would be wider than most namespaces,
/// are only counted.
const MOST_BADGES: usize = 32;
/// The font size of a badge, relative to that of the title: with its frame it is as high as the title's
/// line.
const BADGE_TEXT: f64 = 0.8;

impl GraphPen<'_> {
    /// The badges of several equal namespaces: one for each, filled while it exists, in the colour of its
    /// change.
    pub(crate) fn member_list(
        &self,
        space: &Space,
        place: Rect,
        by: Point,
        id: &str,
        who: &[MemberState],
    ) -> Group {
        let size = self.style.cluster.size;
        let (place, scale) = (self.fit.rect(place).moved(by), self.fit.scale);
        let area = |(x, width): (f64, f64)| {
            Rect::new(
                place.x + (8.0 + x) * scale,
                place.y + 3.0 * scale,
                width * scale,
                size * 1.15 * scale,
            )
        };
        let here = who.iter().filter(|who| who.is_here());
        let mut group = Group::new(format!("s{id}..members"), "members")
            .with(vec![("name", space.name.clone())])
            .titled(format!("{} of {} present", here.count(), who.len()));
        let badges = badges(space, self.fonts, size);
        for ((index, who), place) in space.replicas.iter().zip(who).zip(badges) {
            self.member(&mut group, index, *who, area(place));
        }
        group
    }

    /// The badge of one namespace.
    fn member(&self, group: &mut Group, index: &str, who: MemberState, area: Rect) {
        let (style, scale) = (self.style, self.fit.scale);
        let (fill, color, text) = match who {
            MemberState::Here => (style.node.fill, style.node.stroke, style.node.text),
            MemberState::Away => (Color::NONE, style.silent.stroke, style.silent.text),
            MemberState::Joined => (style.added.fill, style.added.color, style.added.text),
            MemberState::Left => (style.removed.fill, style.removed.color, style.removed.text),
        };
        let dash = match who {
            MemberState::Here | MemberState::Joined => &[][..],
            MemberState::Away => &style.silent.dash,
            MemberState::Left => &style.removed.dash,
        };
        let stroke = Stroke::dashed(color, 1.0, dash).scaled(self.fit.pen);
        let form = Form::Rect(area, 3.0 * scale);
        group.shape(Shape::new(form, fill, stroke));
        let letters = style.cluster.size * BADGE_TEXT * scale;
        let font = Font::new(letters, Weight::SemiBold, text);
        group.text(Text::centred(Anchor::Middle, area.centre(), font, index));
    }
}
