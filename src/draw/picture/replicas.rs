//! The member list of equal namespaces that are drawn as one: a badge for each, and their number over time.

use super::boxes::Boxes;
use super::spaces::Space;
use crate::base::geometry::{Point, Rect};
use crate::draw::scene::{Anchor, Form, Group, Shape, Step, Stroke, Text, line};
use crate::draw::style::Color;
use crate::draw::text::{Fonts, Weight};
use crate::view::{MemberState, View};

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

/// The largest number of equal namespaces with a badge each; more are only counted.
const MOST_BADGES: usize = 32;
/// The font size of a badge, relative to that of the title.
const BADGE_TEXT: f64 = 0.8;

/// The width of the line of their number over time, relative to the font size of the title.
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

impl Boxes<'_> {
    /// The badges of several equal namespaces: one for each, filled while it exists, in the colour of its
    /// change.
    pub(crate) fn member_list(
        &self,
        space: &Space,
        (place, by): (Rect, Point),
        id: &str,
        (now, who): (f64, &[MemberState]),
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
        let mut group = Group {
            id: format!("s{id}..members"),
            class: "members".to_owned(),
            data: vec![("name", space.name.clone())],
            title: format!("{} of {} present", here.count(), who.len()),
            ..Group::default()
        };
        let badges = badges(space, self.fonts, size);
        for ((index, who), place) in space.replicas.iter().zip(who).zip(badges) {
            self.badge(&mut group, index, *who, area(place));
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
    fn badge(&self, group: &mut Group, index: &str, who: MemberState, area: Rect) {
        let (style, scale) = (self.style, self.fit.scale);
        let (fill, color, text) = match who {
            MemberState::Here => (style.node.fill, style.node.stroke, style.node.text),
            MemberState::Away => (Color::NONE, style.silent.stroke, style.silent.text),
            MemberState::Joined => (style.added.fill, style.added.color, style.added.text),
            MemberState::Left => (style.removed.fill, style.removed.color, style.removed.text),
        };
        let dash = match who {
            MemberState::Here | MemberState::Joined => Vec::new(),
            MemberState::Away => style.silent.dash.clone(),
            MemberState::Left => style.removed.dash.clone(),
        };
        let stroke = Stroke {
            color,
            width: 1.0,
            dash,
        };
        group.shape(Shape {
            form: Form::Rect(area, 3.0 * scale),
            fill,
            stroke: stroke.scaled(self.fit.pen),
        });
        let letters = style.cluster.size * BADGE_TEXT * scale;
        let font = (letters, Weight::SemiBold);
        group.text(Text::centred(
            Anchor::Middle,
            area.centre(),
            font,
            text,
            index,
        ));
    }
}
