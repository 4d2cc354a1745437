//! A scene as SVG text: the only painter for screens.
//!
//! Documents do not contain fonts: editors and converters ignore embedded ones. Instead each text has its length, to
//! which viewers without the font stretch or condense it, so that it fits its box everywhere.

use std::fmt::{self, Display};

use super::xml::{Xml, hundredth, tenth};
use crate::base::geometry::Rect;
use crate::draw::scene::{Anchor, Form, Group, Piece, Scene, Shape, Step, Stroke, Text};
use crate::draw::style::Color;
use crate::draw::text::{Fonts, Weight};

/// The scene as one SVG document: UTF-8, a line per group, coordinates rounded to a tenth of a pixel, names escaped.
pub(crate) fn write(scene: &Scene) -> String {
    write_measured(scene, Some(&Fonts::bundled()))
}

/// The scene as [`write()`] writes it; its texts have lengths if there are fonts to measure them.
pub(super) fn write_measured(scene: &Scene, fonts: Option<&Fonts>) -> String {
    let mut xml = Xml::with_capacity(4096 + scene.groups.len() * 512);
    open(&mut xml, scene);
    if !scene.title.is_empty() {
        xml.leaf("title", &scene.title).raw("\n");
    }
    ground(&mut xml, scene);
    for group in &scene.groups {
        write_group(&mut xml, group, fonts);
        xml.raw("\n");
    }
    xml.close().raw("\n");
    xml.finish()
}

/// Writes the background of a scene, if it has one.
pub(super) fn ground(xml: &mut Xml, scene: &Scene) {
    if scene.background != Color::NONE {
        xml.open("rect")
            .attribute("width", tenth(scene.size.w))
            .attribute("height", tenth(scene.size.h))
            .attribute("fill", scene.background);
        xml.close_empty().raw("\n");
    }
}

/// A document of the scene's size with this group alone and no background, for painters that process groups
/// separately and have the fonts.
pub(crate) fn write_alone(scene: &Scene, group: &Group) -> String {
    let mut xml = Xml::with_capacity(1024);
    open(&mut xml, scene);
    write_group(&mut xml, group, None);
    xml.finish()
}

pub(super) fn open(xml: &mut Xml, scene: &Scene) {
    let size = scene.size;
    let (scale, unit) = match scene.width_mm {
        Some(mm) if size.w > 0.0 => (mm / size.w, "mm"),
        _ => (1.0, ""),
    };
    let [width, height] = [size.w, size.h].map(|side| format!("{}{unit}", tenth(side * scale)));
    let family = format_args!("{}, Helvetica, Arial, sans-serif", Fonts::FAMILY);
    let view = format_args!("0 0 {} {}", tenth(size.w), tenth(size.h));
    xml.open("svg")
        .attribute("xmlns", "http://www.w3.org/2000/svg")
        .attribute("width", width)
        .attribute("height", height)
        .attribute("viewBox", view)
        .attribute("font-family", family)
        .raw("\n");
}

/// Writes a group; its texts have lengths if there are fonts to measure them.
pub(super) fn write_group(xml: &mut Xml, group: &Group, fonts: Option<&Fonts>) {
    xml.open("g").attribute("class", &group.class);
    for (key, value) in &group.data {
        xml.attribute(format_args!("data-{key}"), value);
    }
    xml.attribute("id", &group.id);
    xml.leaf("title", &group.title);
    for piece in &group.pieces {
        match piece {
            Piece::Shape(shape) => write_shape(xml, shape),
            Piece::Text(text) => write_text(xml, text, fonts),
        }
    }
    xml.close();
}

fn write_shape(xml: &mut Xml, shape: &Shape) {
    match &shape.form {
        Form::Rect(rect, radius) => write_rect(xml.open("rect"), rect, *radius),
        Form::Ellipse(rect) => write_ellipse(xml.open("ellipse"), rect),
        Form::Path(steps) if is_polygon(steps) => {
            xml.open("polygon").attribute("points", Corners(steps));
        }
        Form::Path(steps) => {
            xml.open("path").attribute("d", PathSteps(steps));
        }
    }
    xml.attribute("fill", shape.fill);
    write_stroke(xml, &shape.stroke);
    xml.close_empty();
}

/// Writes the place of a rectangle, whose corners have this radius.
pub(super) fn write_rect(xml: &mut Xml, rect: &Rect, radius: f64) {
    xml.attribute("x", tenth(rect.x))
        .attribute("y", tenth(rect.y))
        .attribute("width", tenth(rect.w))
        .attribute("height", tenth(rect.h));
    if radius > 0.0 {
        xml.attribute("rx", tenth(radius));
    }
}

/// Writes the place of the ellipse inside a rectangle.
pub(super) fn write_ellipse(xml: &mut Xml, rect: &Rect) {
    let centre = rect.centre();
    xml.attribute("cx", tenth(centre.x))
        .attribute("cy", tenth(centre.y))
        .attribute("rx", tenth(rect.w / 2.0))
        .attribute("ry", tenth(rect.h / 2.0));
}

/// Whether a path is one closed run of straight lines: heads of arrows and signs, which tools should not
/// confuse with routes.
fn is_polygon(steps: &[Step]) -> bool {
    matches!(steps, [Step::Move(_), lines @ .., Step::Close] if lines.iter().all(|s| matches!(s, Step::Line(_))))
}

/// The corners of a polygon: `0,1 2,3`.
struct Corners<'a>(&'a [Step]);

impl Display for Corners<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, step) in self.0.iter().enumerate() {
            if let Step::Move(p) | Step::Line(p) = step {
                let gap = if at > 0 { " " } else { "" };
                write!(f, "{gap}{},{}", tenth(p.x), tenth(p.y))?;
            }
        }
        Ok(())
    }
}

/// The steps of a path: `M0 1C0 1 2 3 2 3Z`.
pub(super) struct PathSteps<'a>(pub(super) &'a [Step]);

impl Display for PathSteps<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for step in self.0 {
            f.write_str(match step {
                Step::Move(_) => "M",
                Step::Line(_) => "L",
                Step::Curve(_) => "C",
                Step::Close => "Z",
            })?;
            for (at, p) in step.points().iter().enumerate() {
                let gap = if at > 0 { " " } else { "" };
                write!(f, "{gap}{} {}", tenth(p.x), tenth(p.y))?;
            }
        }
        Ok(())
    }
}

fn write_stroke(xml: &mut Xml, stroke: &Stroke) {
    if stroke.width <= 0.0 || stroke.color == Color::NONE {
        return;
    }
    xml.attribute("stroke", stroke.color)
        .attribute("stroke-width", hundredth(stroke.width));
    if stroke.dash.iter().any(|d| *d > 0.0) {
        let dash = stroke.dash.iter().map(|d| hundredth(*d).to_string());
        xml.attribute("stroke-dasharray", dash.collect::<Vec<_>>().join(" "));
        if stroke.is_round() {
            xml.attribute("stroke-linecap", "round");
        }
    }
}

fn write_text(xml: &mut Xml, text: &Text, fonts: Option<&Fonts>) {
    xml.open("text")
        .attribute("x", tenth(text.at.x))
        .attribute("y", tenth(text.at.y))
        .attribute("font-size", tenth(text.size));
    if text.weight == Weight::SemiBold {
        xml.attribute("font-weight", 600);
    }
    if text.anchor != Anchor::Start {
        let is_end = text.anchor == Anchor::End;
        xml.attribute("text-anchor", if is_end { "end" } else { "middle" });
    }
    // Characters that the font lacks are drawn with any font, at its own width.
    let is_known = |fonts: &&Fonts| fonts.missing(&text.text).next().is_none();
    if let Some(fonts) = fonts.filter(is_known).filter(|_| text.text.len() > 1) {
        let width = fonts.width(&text.text, text.size, text.weight);
        xml.attribute("textLength", hundredth(width))
            .attribute("lengthAdjust", "spacingAndGlyphs");
    }
    xml.attribute("fill", text.color);
    if let Some((color, width)) = text.halo.filter(|(c, _)| *c != Color::NONE) {
        xml.attribute("stroke", color)
            .attribute("stroke-width", hundredth(width))
            .attribute("stroke-linejoin", "round")
            .attribute("paint-order", "stroke");
    }
    // Without it, blanks at the ends and consecutive blanks would vanish.
    if text.text.starts_with(' ') || text.text.ends_with(' ') || text.text.contains("  ") {
        xml.attribute("xml:space", "preserve");
    }
    xml.text(&text.text).close();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::geometry::{Point, Rect, Size};

    fn svg_of(groups: Vec<Group>) -> String {
        write(&Scene {
            size: Size::new(100.0, 50.0),
            width_mm: None,
            background: Color::NONE,
            title: String::new(),
            groups,
        })
    }

    #[test]
    fn a_group_carries_its_names() {
        let mut group = Group {
            id: "n-planner".to_owned(),
            class: "node added".to_owned(),
            data: vec![("name", "/planner".to_owned())],
            title: "/planner".to_owned(),
            ..Group::default()
        };
        group.shape(Shape::filled(
            Form::Ellipse(Rect::new(0.0, 0.0, 10.0, 4.0)),
            Color::NONE,
        ));
        let svg = svg_of(vec![group]);
        assert!(svg.contains(
            "<g class=\"node added\" data-name=\"/planner\" id=\"n-planner\"><title>/planner</title>\
             <ellipse cx=\"5\" cy=\"2\" rx=\"5\" ry=\"2\" fill=\"none\"/></g>"
        ));
    }

    #[test]
    fn hostile_names_stay_inside_their_quotes() {
        let name = "\"><script>alert(1)</script>&\u{1}\n";
        let mut group = Group::named("x");
        group.title = name.to_owned();
        group.data.push(("name", name.to_owned()));
        let svg = svg_of(vec![group]);
        assert!(!svg.contains("<script"));
        assert!(svg.contains("&quot;&gt;&lt;script&gt;alert(1)&lt;/script&gt;&amp;\\u{1}&#10;"));
    }

    #[test]
    fn paper_is_measured_in_millimetres() {
        let scene = Scene {
            size: Size::new(332.6, 200.0),
            width_mm: Some(88.0),
            background: Color::NONE,
            title: String::new(),
            groups: Vec::new(),
        };
        assert!(
            write(&scene).contains("width=\"88mm\" height=\"52.9mm\" viewBox=\"0 0 332.6 200\"")
        );
    }

    #[test]
    fn paths_are_written_step_by_step() {
        let (a, b) = (Point::new(0.0, 1.0), Point::new(2.0, 3.04));
        let mut group = Group::named("x");
        let form = Form::Path(vec![
            Step::Move(a),
            Step::Curve([a, b, b]),
            Step::Line(a),
            Step::Close,
        ]);
        group.shape(Shape::filled(form, Color::NONE));
        assert!(svg_of(vec![group]).contains("d=\"M0 1C0 1 2 3 2 3L0 1Z\""));
    }
}
