//! The graph of a whole mission as one compact drawing without colours: classes determine the look of
//! elements in a window, and their rules follow from the style. The player's page uses it.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::svg::{write_ellipse, write_rect};
use super::xml::{Xml, tenth, units};
use crate::base::geometry::{Point, Rect};
use crate::draw::picture::{Union, UnionElement};
use crate::draw::scene::{Form, Group, Piece, Step, Stroke};
use crate::draw::style::{Body, Change, Color, Quiet, Style};
use crate::graph::Id as _;
use crate::view::{ArrowId, ItemId, Mark, STEPS, View, decades};

/// A graph in SVG.
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
                let place = Rect::new(r.x, r.y, r.right() - r.x, r.bottom() - r.y);
                write_rect(xml, &place, *radius);
            }
            Form::Ellipse(r) => write_ellipse(xml, r),
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
        let corner = Point::default();
        let from = if letter == 'M' { corner } else { here };
        out.push(letter);
        for (at, p) in points.iter().enumerate() {
            // Rounded places, not rounded steps, so that errors do not add up.
            here = Point::new(units(p.x, 10) as f64 / 10.0, units(p.y, 10) as f64 / 10.0);
            for (axis, step) in [here.x - from.x, here.y - from.y].into_iter().enumerate() {
                let text = tenth(step).to_string();
                let is_apart = at + axis > 0 && !text.starts_with('-');
                let gap = if is_apart { " " } else { "" };
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

// The style as rules for classes: the paint of `draw::picture`, once per class instead of once per element.

/// The rules of the graph in every window: [`base`], then [`states`].
pub(crate) fn rules(style: &Style, words: &BTreeSet<&str>) -> String {
    base(style) + &states(style, words)
}

/// The rules for elements that are active and did not change.
fn base(style: &Style) -> String {
    let mut out = String::from(
        ":is(.node,.topic,.edge) text{text-anchor:middle;stroke:none}use,.c,.l{visibility:hidden}",
    );
    let cluster = &style.cluster;
    let _ = write!(
        out,
        ".namespace rect{{{}}}.namespace text{{text-anchor:start;font:600 {}px {FONT};fill:{};stroke:none}}",
        paint(cluster.fill, cluster.stroke, cluster.width, &cluster.dash),
        cluster.size,
        cluster.text
    );
    body(&mut out, ".node", &style.node);
    body(&mut out, ".topic", &style.topic);
    // The names of elements without a box.
    let _ = write!(
        out,
        ".also rect{{stroke:none}}.also text,.items>g>text:first-child{{text-anchor:start;font:{}px {FONT};fill:{};stroke:none}}",
        style.edge.size, style.page.quiet
    );
    edges(&mut out, style);
    badges(&mut out, style);
    // A separate shape among those of its box.
    let _ = write!(out, "g>rect.l{{fill:{};stroke:none}}", style.latched.stroke);
    out
}

/// The rules for the changes by classes: rate, confidence, state and mark; later rules take precedence. Only
/// these class words have rules.
fn states(style: &Style, words: &BTreeSet<&str>) -> String {
    // The rate of a silent element is not worth showing.
    let mut out = String::from(
        ".off,:is(.edge,.topic):is(.silent,.latched,.declared,.removed):not(.changed)>.r{visibility:hidden}",
    );
    for step in 1..=STEPS {
        let word = format!("w{step}");
        if words.contains(&*word) {
            let edge = &style.edge;
            let width = (edge.width + edge.per_decade * decades(step)).min(edge.most);
            let _ = write!(out, ".{word} path{{stroke-width:{}}}", short(width));
        }
    }
    if words.contains("inferred") {
        let dash = dashes(&style.inferred.dash);
        let rule = format!("{{stroke-dasharray:{dash}}}");
        let _ = write!(out, ".inferred>:is(rect,ellipse,path){rule}");
    }
    let quiets = [("declared", &style.declared), ("silent", &style.silent)];
    for (state, quiet) in quiets.iter().filter(|(word, _)| words.contains(word)) {
        self::quiet(&mut out, state, quiet);
    }
    let changes = [
        ("added", &style.added),
        ("removed", &style.removed),
        ("changed", &style.changed),
    ];
    for (kind, change) in changes.iter().filter(|(word, _)| words.contains(word)) {
        self::change(&mut out, kind, change);
    }
    if words.contains("away") {
        self::quiet(&mut out, "away", &style.away());
    }
    let badges = Mark::badged().map(Mark::badge);
    let badges = badges.filter(|word| words.contains(word));
    let mut shown: Vec<String> = badges.map(|word| format!(".{word}>.{word}")).collect();
    shown.push(":is(.faster,.slower)>.c,.latched:not(.removed,.edge)>.l,.starved>.l".to_owned());
    let _ = write!(out, "{}{{visibility:inherit}}", shown.join(","));
    if words.contains("starved") {
        out.push_str(".edge.starved path+path:not(.l){visibility:hidden}");
    }
    out
}

const FONT: &str = "Inter,Helvetica,Arial,sans-serif";

fn body(out: &mut String, what: &str, body: &Body) {
    let weight = if body.bold { "600 " } else { "" };
    let _ = write!(
        out,
        "{what} :is(rect,ellipse,path){{{}}}{what} text{{font:{weight}{}px {FONT};fill:{}}}\
         {what} :is(.r,.m){{font:{}px {FONT}}}",
        paint(body.fill, body.stroke, body.width, &[]),
        body.size,
        body.text,
        body.small
    );
}

/// Writes the rules for edges. The line is the first path of an edge, its head the second.
fn edges(out: &mut String, style: &Style) {
    let edge = &style.edge;
    let _ = write!(
        out,
        ".edge path{{fill:none;stroke:{c};stroke-width:{}}}.edge path+path{{fill:{c};stroke:none}}\
         .edge text{{font:{}px {FONT};fill:{}}}\
         .edge text,.topic>.c{{paint-order:stroke;stroke:{};stroke-width:{};stroke-linejoin:round}}",
        edge.width,
        edge.size,
        edge.text,
        edge.halo,
        edge.halo_width,
        c = edge.stroke,
    );
}

fn quiet(out: &mut String, state: &str, quiet: &Quiet) {
    let line = paint(quiet.fill, quiet.stroke, quiet.width, &quiet.dash);
    let (stroke, text) = (quiet.stroke, quiet.text);
    let _ = write!(
        out,
        ".{state} :is(rect,ellipse,path){{{line}}}.edge.{state} path{{fill:none}}\
         .edge.{state} path+path{{fill:{stroke};stroke:none}}.{state} text{{fill:{text}}}"
    );
}

fn change(out: &mut String, kind: &str, change: &Change) {
    let (color, text, width, dash) = (change.color, change.text, change.width, &change.dash);
    let _ = write!(
        out,
        ".{kind} :is(rect,ellipse,path){{{}}}.{kind} text{{fill:{text}}}\
         .edge.{kind} path{{fill:none;stroke:{color};stroke-width:{};stroke-dasharray:{}}}\
         .edge.{kind} path+path{{fill:{color};stroke:none}}.edge.{kind} text{{fill:{color};font-weight:600}}",
        paint(change.fill, color, width, dash),
        short(width * 0.8),
        dashes(dash),
    );
}

/// Writes the colours of badges, which are hidden until their element has their class.
fn badges(out: &mut String, style: &Style) {
    let _ = write!(
        out,
        ".badge{{visibility:inherit}}.b{{stroke:{};stroke-width:1.2}}.p{{fill:none;stroke:{s};stroke-width:2}}\
         .f{{fill:{s};stroke:none}}use{{fill:{}}}.edge>use{{scale:.8;transform-box:fill-box;transform-origin:center}}use.added{{fill:{}}}use.removed{{fill:{}}}",
        style.badge.halo,
        style.changed.color,
        style.added.color,
        style.removed.color,
        s = style.badge.sign,
    );
}

fn paint(fill: Color, stroke: Color, width: f64, dash: &[f64]) -> String {
    let is_round = Stroke::dashed(stroke, width, dash).is_round();
    let cap = if is_round {
        ";stroke-linecap:round"
    } else {
        ""
    };
    let (width, dash) = (short(width), dashes(dash));
    format!("fill:{fill};stroke:{stroke};stroke-width:{width};stroke-dasharray:{dash}{cap}")
}

fn dashes(dash: &[f64]) -> String {
    if dash.is_empty() {
        return "none".to_owned();
    }
    let all: Vec<String> = dash.iter().map(|d| short(*d)).collect();
    all.join(" ")
}

/// A number to a hundredth, as text.
fn short(value: f64) -> String {
    (libm::round(value * 100.0) / 100.0).to_string()
}

/// The style's colours for the page around the graph, as custom properties of CSS.
pub(crate) fn variables(style: &Style) -> String {
    let all = [
        ("page", style.page.background),
        ("text", style.page.text),
        ("quiet", style.page.quiet),
        ("bar", style.title.fill),
        ("bar-line", style.title.line),
        ("bar-text", style.title.text),
        ("bar-quiet", style.title.quiet),
        ("panel", style.legend.fill),
        ("line", style.legend.line),
        ("edge", style.edge.stroke),
        ("past", style.timeline.past),
        ("future", style.timeline.future),
        ("now", style.timeline.now),
        ("head", style.timeline.head),
        ("axis", style.timeline.axis),
        ("added", style.added.color),
        ("removed", style.removed.color),
        ("changed", style.changed.color),
        ("added-count", style.count.added),
        ("added-on", style.count.added_text),
        ("removed-count", style.count.removed),
        ("removed-on", style.count.removed_text),
        ("changed-count", style.count.changed),
        ("changed-on", style.count.changed_text),
    ];
    let mut out = String::from(":root{");
    for (name, color) in all {
        let color = color.rgb().map(|_| color.to_string());
        let color = color.as_deref().unwrap_or("transparent");
        let _ = write!(out, "--{name}:{color};");
    }
    out.push('}');
    out
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
