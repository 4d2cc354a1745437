//! The graph of a whole mission as one compact drawing without colours: classes determine the look of
//! elements in a window, and their rules follow from the style. The player's page uses it.

mod css;

use std::fmt::Write as _;

pub(crate) use css::{rules, variables};

use crate::base::geometry::Point;
use crate::draw::paint::xml::{Xml, tenth, units};
use crate::draw::picture::{Union, UnionElement};
use crate::draw::scene::{Form, Group, Piece, Step};
use crate::draw::style::Style;
use crate::graph::Id as _;
use crate::view::{ArrowId, ItemId, Mark, View};

/// A graph in SVG.
#[derive(Debug)]
pub(crate) struct Classes<'a> {
    pub(crate) view: &'a View,
    pub(crate) union: &'a Union,
}

/// The parts of an element's group that depend on the window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ElementLook<'a> {
    /// The words of its class attribute, after `node`, `topic` or `edge`.
    pub(crate) class: &'a str,
    /// The words of its live text.
    pub(crate) text: &'a str,
}

impl Classes<'_> {
    /// Writes the boxes around namespaces.
    pub(crate) fn spaces(&self, xml: &mut Xml) {
        for space in &self.union.spaces {
            let class = space.class.split(' ').next().unwrap_or_default();
            xml.open("g").attribute("class", class);
            Self::pieces(xml, space, None);
            xml.close().raw("\n");
        }
    }

    /// Writes an arrow of the view.
    pub(crate) fn arrow(&self, xml: &mut Xml, id: ArrowId, look: ElementLook<'_>) {
        let (part, arrow) = (&self.union.arrows[id.at()], &self.view.arrows[id]);
        let what = format!("edge {}", arrow.class());
        Self::element(xml, part, &what, None, look);
    }

    /// Writes an item of the view.
    pub(crate) fn item(&self, xml: &mut Xml, id: ItemId, look: ElementLook<'_>) {
        let (part, item) = (&self.union.items[id.at()], &self.view.items[id]);
        Self::element(xml, part, item.class(), Some(&item.name), look);
    }

    fn element(
        xml: &mut Xml,
        part: &UnionElement,
        what: &str,
        name: Option<&str>,
        look: ElementLook<'_>,
    ) {
        let class = format!("{what} {}", look.class);
        xml.open("g").attribute("class", class.trim_end());
        if let Some(name) = name {
            xml.attribute("data-name", name);
        }
        Self::pieces(xml, &part.group, Some((part, look)));
        for mark in &part.marks {
            let word = mark.badge();
            let Point { x, y } = part.badge;
            xml.open("use")
                .attribute("href", format_args!("#{word}"))
                .attribute("class", word);
            xml.attribute("x", whole(x)).attribute("y", whole(y));
            xml.close_empty();
        }
        xml.close().raw("\n");
    }

    /// Writes shapes and texts; for an element, with its bar after its shapes, and its live text last.
    fn pieces(xml: &mut Xml, group: &Group, element: Option<(&UnionElement, ElementLook<'_>)>) {
        let is_text = |p: &&Piece| matches!(p, Piece::Text(_));
        let texts = group.pieces.iter().filter(is_text).count();
        let mut seen = 0;
        for piece in &group.pieces {
            if let Piece::Shape(shape) = piece {
                Self::form(xml, &shape.form, None);
            }
        }
        if let Some(bar) = element.and_then(|(part, _)| part.bar.as_ref()) {
            Self::form(xml, bar, Some("l"));
        }
        for piece in &group.pieces {
            let Piece::Text(text) = piece else { continue };
            seen += 1;
            let name = element.and_then(|(part, _)| part.name.as_ref());
            let (class, words) = match element {
                // Some are shown only in windows in which the rate changed.
                Some((part, look)) if part.is_live && seen == texts => {
                    (if part.shows_changes { "r c" } else { "r" }, look.text)
                }
                _ if seen > 1 => ("m", &*text.text),
                _ => ("", &**name.unwrap_or(&text.text)),
            };
            xml.open("text");
            if !class.is_empty() {
                xml.attribute("class", class);
            }
            xml.attribute("x", whole(text.at.x))
                .attribute("y", whole(text.at.y))
                .text(words)
                .close();
        }
    }

    fn form(xml: &mut Xml, form: &Form, class: Option<&str>) {
        xml.open(match form {
            Form::Rect(..) => "rect",
            Form::Ellipse(_) => "ellipse",
            Form::Path(_) => "path",
        });
        if let Some(class) = class {
            xml.attribute("class", class);
        }
        match form {
            Form::Rect(r, radius) => {
                // Coordinates of edges are rounded, not lengths, so that adjacent shapes stay adjacent.
                xml.attribute("x", tenth(r.x))
                    .attribute("y", tenth(r.y))
                    .attribute("width", tenth(r.right() - r.x))
                    .attribute("height", tenth(r.bottom() - r.y));
                if *radius > 0.0 {
                    xml.attribute("rx", tenth(*radius));
                }
            }
            Form::Ellipse(r) => {
                let c = r.centre();
                xml.attribute("cx", tenth(c.x))
                    .attribute("cy", tenth(c.y))
                    .attribute("rx", tenth(r.w / 2.0))
                    .attribute("ry", tenth(r.h / 2.0));
            }
            Form::Path(steps) => {
                xml.attribute("d", path(steps));
            }
        }
        xml.close_empty();
    }
}

/// Writes the badge of a mark with the mark's word as its id, without colours, and visible only with a style
/// sheet.
pub(crate) fn badge_shapes(xml: &mut Xml, style: &Style, mark: Mark) {
    xml.open("g")
        .attribute("id", mark.badge())
        .attribute("class", "badge")
        .attribute("visibility", "hidden");
    let sign = crate::draw::picture::sign(style, mark);
    for (at, piece) in sign.pieces.iter().enumerate() {
        let Piece::Shape(shape) = piece else { continue };
        let pen = if shape.stroke.width > 0.0 { "p" } else { "f" };
        Classes::form(xml, &shape.form, Some(if at == 0 { "b" } else { pen }));
    }
    xml.close();
}

/// Rounds to whole pixels; a value that is not a finite number becomes 0.
fn whole(value: f64) -> i64 {
    units(value, 1)
}

/// Short path data: steps from point to point in tenths, lines where a curve is straight.
fn path(steps: &[Step]) -> String {
    let mut out = String::new();
    let mut here = Point::new(0.0, 0.0);
    for step in steps {
        let (letter, points): (_, &[Point]) = match step {
            Step::Move(to) => ('M', std::slice::from_ref(to)),
            Step::Line(to) => ('l', std::slice::from_ref(to)),
            Step::Curve([a, b, to]) if is_straight(here, [*a, *b], *to) => {
                ('l', std::slice::from_ref(to))
            }
            Step::Curve(points) => ('c', points),
            Step::Close => ('z', &[]),
        };
        let from = if letter == 'M' {
            Point::new(0.0, 0.0)
        } else {
            here
        };
        out.push(letter);
        for (at, p) in points.iter().enumerate() {
            // Rounded places, not rounded steps, so that errors do not add up.
            here = Point::new(units(p.x, 10) as f64 / 10.0, units(p.y, 10) as f64 / 10.0);
            for (axis, step) in [here.x - from.x, here.y - from.y].into_iter().enumerate() {
                let text = tenth(step).to_string();
                let is_first = at + axis == 0;
                let gap = if is_first || text.starts_with('-') {
                    ""
                } else {
                    " "
                };
                let _ = write!(out, "{gap}{text}");
            }
        }
    }
    out
}

/// Whether both controls of a curve lie within half a pixel of the line to its end, and between its ends.
fn is_straight(from: Point, controls: [Point; 2], end: Point) -> bool {
    let (dx, dy) = (end.x - from.x, end.y - from.y);
    let length = libm::hypot(dx, dy).max(1e-9);
    controls.iter().all(|p| {
        let (x, y) = (p.x - from.x, p.y - from.y);
        let along = (x * dx + y * dy) / length;
        let aside = (x * dy - y * dx) / length;
        aside.abs() <= 0.5 && (-0.5..=length + 0.5).contains(&along)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn p(x: f64, y: f64) -> Point {
        Point::new(x, y)
    }

    #[test]
    fn paths_are_short() {
        let steps = [
            Step::Move(p(10.0, 20.0)),
            Step::Curve([p(14.0, 20.0), p(18.0, 20.2), p(30.0, 20.0)]),
            Step::Curve([p(40.0, 20.0), p(40.0, 50.0), p(60.0, 50.0)]),
            Step::Curve([p(70.0, 50.0), p(70.0, 20.0), p(90.0, 20.0)]),
        ];
        let data = "M10 20l20 0c10 0 10 30 30 30c10 0 10-30 30-30";
        assert_eq!(path(&steps), data);
    }
}
