//! The frames of namespaces: their titles, the time of their first content, and the member lists of equal namespaces that are
//! drawn as one: a badge for each; and the nodes and topics that are listed there as words.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use super::texts::{self, LINE, counting, short_name};
use super::{GraphPen, options};
use crate::base::geometry::{Point, Rect, Size};
use crate::draw::scene::{Anchor, Font, Form, Group, Shape, Stroke, Text};
use crate::draw::style::{Color, Style};
use crate::draw::text::{Fonts, Weight};
use crate::view::{AlsoHere, Item, Mark, MemberState, Namespace, Shown, View};

/// A namespace with a box around its members.
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
            let (x, y) = (place.x + (8.0 + x) * scale, place.y + 3.0 * scale);
            Rect::new(x, y, width * scale, size * 1.15 * scale)
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
        let (here, away, joined, left) = (&style.node, &style.silent, &style.added, &style.removed);
        let (fill, color, text, dash) = match who {
            MemberState::Here => (here.fill, here.stroke, here.text, &[][..]),
            MemberState::Away => (Color::NONE, away.stroke, away.text, &away.dash[..]),
            MemberState::Joined => (joined.fill, joined.color, joined.text, &[][..]),
            MemberState::Left => (left.fill, left.color, left.text, &left.dash[..]),
        };
        let stroke = Stroke::dashed(color, 1.0, dash).scaled(self.fit.pen);
        let form = Form::Rect(area, 3.0 * scale);
        group.shape(Shape::new(form, fill, stroke));
        let letters = style.cluster.size * BADGE_TEXT * scale;
        let font = Font::new(letters, Weight::SemiBold, text);
        group.text(Text::centred(Anchor::Middle, area.centre(), font, index));
    }
}

// The nodes and topics that are listed as words in their namespace: `also here: camera_tf, imu_driver, scan 4 Hz`.

/// The width at which the words are wrapped unless their namespace is wider, in text heights: two names of usual length.
const WIDTH: f64 = 22.0;
/// The space above the words, in text heights: they must not look like names of the boxes above.
const ABOVE: f64 = 0.4;
/// The distance of the words from the frame of their namespace, in pixels: that of its title.
const INSET: f64 = 8.0;
const FIRST: &str = "also here:";
/// The most names that are listed: ten lines or so. The others are counted.
pub(crate) const MOST_LISTED: usize = 60;

/// The words for the nodes of one namespace.
pub(crate) struct Footer {
    /// The namespace: an index into the view's; `None` for the words outside of all.
    pub(crate) cluster: Option<usize>,
    /// The names as drawn.
    names: Vec<String>,
    /// The space that they need unless their namespace is wider.
    pub(crate) room: Size,
}

/// The words of each namespace.
pub(crate) fn footers(view: &View, style: &Style, fonts: &Fonts) -> Vec<Footer> {
    let footer = |also: &AlsoHere| {
        let space = also.cluster.and_then(|at| view.namespaces.get(at));
        let inside = space.map_or("", |space| &*space.name);
        let short = |item: &Item| {
            let name = fonts.shown(short_name(&item.label, inside));
            counting(&name, item.counted.len())
        };
        let names: Vec<String> = also.items.iter().map(short).collect();
        let size = style.edge.size;
        let all = names.iter().zip(&also.items).zip(&also.shown);
        let long = |text: &String| text.chars().count();
        let longest = all.map(|((name, item), shown)| {
            let texts = shown.distinct().iter().map(|look| said(item, look, name));
            texts.max_by_key(long).unwrap_or_else(|| name.clone())
        });
        let longest: Vec<String> = longest.collect();
        let listed = listed(&longest, long);
        let texts = listed.iter().map(|at| longest[*at].clone());
        let words = words(texts, longest.len() - listed.len());
        let places = broken(&words, fonts, size, WIDTH * size);
        let ends = places.iter().zip(&words);
        let ends = ends.map(|(at, word)| at.x + fonts.width(word, size, Weight::SemiBold));
        let lines = places.last().map_or(0.0, |at| at.y) + 1.0;
        Footer {
            cluster: also.cluster,
            room: Size::new(ends.fold(0.0, f64::max), size * (LINE * lines + ABOVE)),
            names,
        }
    };
    view.also.iter().map(footer).collect()
}

/// A name with its annotations: the rate of a topic, and the sign of a change.
fn said(item: &Item, shown: &Shown, name: &str) -> String {
    let is_rated = item.kind.word() != "node" && shown.mark != Some(Mark::Removed);
    let rate = texts::rate_in(shown).filter(|_| is_rated);
    let name = rate.map_or_else(|| name.to_owned(), |rate| format!("{name} {rate}"));
    match shown.mark {
        Some(Mark::Added) => format!("+ {name}"),
        Some(Mark::Removed) => format!("− {name}"),
        Some(Mark::Away) => format!("{name} (away)"),
        _ => name,
    }
}

/// The indices of the listed names, in order: those of the highest ranks if there are too many.
fn listed<T, R: Ord>(all: &[T], rank: impl Fn(&T) -> R) -> Vec<usize> {
    let mut places: Vec<usize> = (0..all.len()).collect();
    if places.len() > MOST_LISTED {
        places.sort_by_cached_key(|at| Reverse(rank(&all[*at])));
        places.truncate(MOST_LISTED);
        places.sort_unstable();
    }
    places
}

/// The names, each with its comma, after the introductory words; then the number of the others.
fn words(names: impl Iterator<Item = String>, more: usize) -> Vec<String> {
    let mut words = vec![FIRST.to_owned()];
    words.extend(names.map(|name| name + ","));
    if more > 0 {
        words.push(format!("and {more} more"));
    } else {
        words.last_mut().map(String::pop);
    }
    words
}

/// The distance of each word from the left, and its line, in lines of at most this width unless a word is
/// longer.
fn broken(words: &[String], fonts: &Fonts, size: f64, most: f64) -> Vec<Point> {
    let blank = fonts.width(" ", size, Weight::Regular);
    let mut at = Point::default();
    let place = |word: &String| {
        let width = fonts.width(word, size, Weight::SemiBold);
        if at.x > 0.0 && at.x + width > most {
            at = Point::new(0.0, at.y + 1.0);
        }
        let here = at;
        at.x += width + blank;
        here
    };
    words.iter().map(place).collect()
}

impl Footer {
    /// The distance of its words from the frame of this width, and the place of each.
    fn broken(&self, words: &[String], fonts: &Fonts, size: f64, wide: f64) -> (f64, Vec<Point>) {
        let inset = if self.cluster.is_some() { INSET } else { 0.0 };
        let most = (wide - 2.0 * inset).max(self.room.w) + 0.1;
        (inset, broken(words, fonts, size, most))
    }
}

/// Whether these words name something that changed.
pub(crate) fn is_news(words: &Group) -> bool {
    words.data.iter().any(|(key, _)| *key == "entries")
}

impl GraphPen<'_> {
    /// The introductory words and the names of a footer for drawings of all windows, each with its rectangle.
    pub(crate) fn footer_words(&self, footer: &Footer, place: Rect) -> Vec<(String, Rect)> {
        let size = self.style.edge.size;
        let words = words(footer.names.iter().cloned(), 0);
        let (inset, places) = footer.broken(&words, self.fonts, size, place.w);
        let last = places.last().map_or(0.0, |at| at.y);
        let bottom = place.bottom() - inset * 0.8;
        let rect = |(word, at): (String, Point)| {
            let width = self.fonts.width(&word, size, Weight::Regular);
            let top = bottom - size * LINE * (last - at.y + 1.0);
            let rect = Rect::new(place.x + inset + at.x, top, width, size * LINE);
            (word, rect)
        };
        words.into_iter().zip(places).map(rect).collect()
    }

    /// The words in window `k` at the bottom of a rectangle: a namespace, or the area of the words outside of
    /// all.
    pub(crate) fn footer(
        &self,
        footer: &Footer,
        also: &AlsoHere,
        place: Rect,
        view: &View,
        k: usize,
    ) -> Option<Group> {
        let (style, scale) = (&self.style.edge, self.fit.scale);
        let seen = also.items.iter().zip(&also.shown).zip(&footer.names);
        let seen: Vec<_> = seen
            .filter_map(|((item, shown), name)| Some((item, view.seen_at(shown, k)?, name)))
            .collect();
        let listed = listed(&seen, |(_, shown, _)| shown.mark.is_some());
        let texts = listed.iter().map(|at| {
            let (item, shown, short) = &seen[*at];
            said(item, shown, short)
        });
        let words = words(texts, seen.len() - listed.len());
        let (inset, places) = footer.broken(&words, self.fonts, style.size, place.w);
        let place = self.fit.rect(place);
        let (size, step) = (style.size * scale, style.size * LINE * scale);
        let last = places.last()?.y;
        let names: Vec<&str> = seen.iter().map(|(item, ..)| &*item.name).collect();
        let mut data = vec![("names", names.join(" "))];
        let events = seen.iter().flat_map(|(_, shown, _)| &shown.events);
        data.extend(texts::entries(events.collect::<BTreeSet<_>>()));
        let number = footer.cluster.map_or_else(String::new, |at| at.to_string());
        let mut group = Group::new(format!("also{number}"), "also")
            .with(data)
            .titled(names.join("\n"));
        let marks = listed.iter().map(|at| seen[*at].1.mark);
        let marks = std::iter::once(None).chain(marks).chain([None]);
        for ((word, at), mark) in words.into_iter().zip(places).zip(marks) {
            let bottom = place.bottom() - inset * 0.8 * scale;
            let x = place.x + (inset + at.x) * scale;
            let at = Point::new(x, bottom - step * (last - at.y + 0.15));
            let changed = mark.map(|mark| options::change(self.style, mark).color);
            let color = changed.unwrap_or(self.style.page.quiet);
            let font = Font::new(size, Weight::of(mark.is_some()), color);
            group.text(Text::new(Anchor::Start, at, font, word));
        }
        (!names.is_empty()).then_some(group)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_beyond_the_limit_are_counted_and_changed_ones_are_listed() {
        let names: Vec<String> = (0..70).map(|n| format!("n{n}")).collect();
        let few = words(names[..3].iter().cloned(), 0);
        assert_eq!(few, ["also here:", "n0,", "n1,", "n2"]);

        assert_eq!(listed(&names[..3], String::len), [0, 1, 2]);
        let listed = listed(&names, |name| name == "n69");
        let texts = listed.iter().map(|at| names[*at].clone());
        let many = words(texts, names.len() - listed.len());
        assert_eq!(many.len(), 1 + MOST_LISTED + 1);
        assert_eq!(many[1], "n0,");
        assert_eq!(many[MOST_LISTED..], ["n69,", "and 10 more"]);
    }
}
