//! The frames of namespaces: their titles, the time of their first content, and the member lists of equal namespaces that are
//! drawn as one: a badge for each, and their number over time.

use super::page::GraphPen;
use crate::base::geometry::{Point, Rect};
use crate::draw::scene::{Anchor, Font, Form, Group, Shape, Step, Stroke, Text, line};
use crate::draw::style::Color;
use crate::draw::text::{Fonts, Weight};
use crate::view::{MemberState, View};

/// A namespace with a box around its members.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Space {
    /// Its full name.
    pub(crate) name: String,
    /// Its title: the part inside the namespace around it.
    pub(crate) title: String,
    /// The indices of the equal namespaces drawn as this one; empty for a single one.
    pub(crate) replicas: Vec<String>,
    /// Their number over time, if it changes: fractions of the time from 0 to 1, each with the share of them
    /// that exists from then on.
    pub(crate) course: Vec<(f64, f64)>,
}

/// The titles of the namespaces: the part of their names inside the namespace around them.
pub(crate) fn spaces(view: &View, fonts: &Fonts) -> Vec<Space> {
    let title = |at: usize| {
        let name = &*view.namespaces[at].name;
        let around = view.namespaces[at]
            .parent
            .and_then(|p| view.namespaces.get(p));
        around.map_or(name, |p| name.strip_prefix(&*p.name).unwrap_or(name))
    };
    let mut fleets = 0..;
    (0..view.namespaces.len())
        .map(|at| Space {
            course: Some(at)
                .filter(|&at| !view.namespaces[at].replicas.is_empty())
                .and_then(|_| fleets.next())
                .map_or_else(Vec::new, |nth| shares(view, nth)),
            name: view.namespaces[at].name.to_string(),
            title: match view.namespaces[at].replicas.len() {
                0 => fonts.shown(title(at)).into_owned(),
                n => format!("{} × {n}", fonts.shown(title(at))),
            },
            replicas: view.namespaces[at]
                .replicas
                .iter()
                .map(ToString::to_string)
                .collect(),
        })
        .collect()
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

/// The width of the line of their number over time, relative to the font size of the title: as wide as a name of usual
/// length, so that it does not widen the namespace.
const COURSE: f64 = 6.0;

/// The left edge and the width of the line of their number over time, relative to the title; `None` if it
/// does not change.
pub(crate) fn course(space: &Space, fonts: &Fonts, size: f64) -> Option<(f64, f64)> {
    if space.course.len() < 2 {
        return None;
    }
    let title = fonts.width(&space.title, size, Weight::SemiBold);
    let end = badges(space, fonts, size).pop();
    let end = end.map_or(title, |(x, width)| x + width);
    Some((end + size * 0.7, size * COURSE))
}

/// The share of the equal namespaces of one kind that exist at the end of each window, where it changes.
pub(crate) fn shares(view: &View, nth: usize) -> Vec<(f64, f64)> {
    let mut shares: Vec<(f64, f64)> = Vec::new();
    for (k, frame) in view.frames.iter().enumerate() {
        let Some(who) = frame.member_lists.get(nth).filter(|who| !who.is_empty()) else {
            continue;
        };
        let here = who.iter().filter(|who| who.is_here()).count();
        let share = here as f64 / who.len() as f64;
        if shares
            .last()
            .is_none_or(|last| (last.1 - share).abs() > 1e-9)
        {
            shares.push((view.place_in_time(k), share));
        }
    }
    shares
}

/// A line in steps, as high as the share at each time.
fn steps(course: &[(f64, f64)], area: &Rect) -> Form {
    let y = |share: f64| area.bottom() - share * area.h;
    let mut steps: Vec<Step> = Vec::new();
    let mut before = None;
    for &(at, share) in course {
        let x = area.x + at * area.w;
        match before {
            None => steps.push(Step::Move(Point::new(x, y(share)))),
            Some(before) => {
                steps.push(Step::Line(Point::new(x, y(before))));
                steps.push(Step::Line(Point::new(x, y(share))));
            }
        }
        before = Some(share);
    }
    if let Some(last) = before {
        steps.push(Step::Line(Point::new(area.right(), y(last))));
    }
    Form::Path(steps)
}

impl GraphPen<'_> {
    /// The badges of several equal namespaces: one for each, filled while it exists, in the colour of its
    /// change.
    pub(crate) fn member_list(
        &self,
        space: &Space,
        place: Rect,
        by: Point,
        id: &str,
        now: f64,
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
        if let Some(place) = course(space, self.fonts, size) {
            let area = area(place);
            let color = self.style.cluster.text;
            let pen = |width| Stroke::solid(color, width).scaled(self.fit.pen);
            group.shape(Shape::line(steps(&space.course, &area), pen(1.2)));
            let at = area.x + now * area.w;
            let head = line(Point::new(at, area.y), Point::new(at, area.bottom()));
            group.shape(Shape::line(head, pen(2.0)));
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
