//! A scene as SVG text: the only painter for screens.

use std::fmt::Write as _;

use crate::base::digest::base64;
use crate::draw::scene::{Anchor, Form, Group, Piece, Scene, Shape, Step, Stroke, Text};
use crate::draw::style::Color;
use crate::draw::text::{Fonts, Weight};

/// The scene as one SVG document: UTF-8, a line per group, coordinates rounded to a tenth of a pixel, names escaped.
pub fn write(scene: &Scene) -> String {
    let mut out = String::with_capacity(4096 + scene.groups.len() * 512);
    open(&mut out, scene, "");
    for group in &scene.groups {
        write_group(&mut out, group);
        out.push('\n');
    }
    out.push_str("</svg>\n");
    out
}

/// The same with the bundled font inside, so that it looks the same where Inter is not installed (125 KB more).
pub fn write_with_fonts(scene: &Scene) -> String {
    let mut css = String::from("<style>");
    for (weight, data) in [
        (400, crate::draw::text::REGULAR),
        (600, crate::draw::text::SEMIBOLD),
    ] {
        let _ = write!(
            css,
            "@font-face{{font-family:{};font-weight:{weight};src:url(data:font/ttf;base64,",
            Fonts::FAMILY
        );
        base64(&mut css, data);
        css.push_str(")}");
    }
    css.push_str("</style>\n");
    let mut out = String::with_capacity(css.len() + 4096 + scene.groups.len() * 512);
    open(&mut out, scene, &css);
    for group in &scene.groups {
        write_group(&mut out, group);
        out.push('\n');
    }
    out.push_str("</svg>\n");
    out
}

/// A document of the scene's size that holds this one group and no background, for painters that keep groups apart.
pub(crate) fn write_alone(scene: &Scene, group: &Group) -> String {
    let mut out = String::with_capacity(1024);
    open_tag(&mut out, scene);
    write_group(&mut out, group);
    out.push_str("</svg>");
    out
}

fn open(out: &mut String, scene: &Scene, style: &str) {
    open_tag(out, scene);
    if !scene.title.is_empty() {
        out.push_str("<title>");
        escape(out, &scene.title);
        out.push_str("</title>\n");
    }
    out.push_str(style);
    if scene.background != Color::NONE {
        let size = scene.size;
        out.push_str("<rect width=\"");
        number(out, size.w);
        out.push_str("\" height=\"");
        number(out, size.h);
        let _ = writeln!(out, "\" fill=\"{}\"/>", scene.background);
    }
}

fn open_tag(out: &mut String, scene: &Scene) {
    let size = scene.size;
    out.push_str("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"");
    let (scale, unit) = match scene.width_mm {
        Some(mm) if size.w > 0.0 => (mm / size.w, "mm"),
        _ => (1.0, ""),
    };
    number(out, size.w * scale);
    let _ = write!(out, "{unit}\" height=\"");
    number(out, size.h * scale);
    let _ = write!(out, "{unit}\" viewBox=\"0 0 ");
    number(out, size.w);
    out.push(' ');
    number(out, size.h);
    let _ = writeln!(
        out,
        "\" font-family=\"{}, Helvetica, Arial, sans-serif\">",
        Fonts::FAMILY
    );
}

fn write_group(out: &mut String, group: &Group) {
    out.push_str("<g class=\"");
    escape(out, &group.class);
    out.push('"');
    for (key, value) in &group.data {
        let _ = write!(out, " data-{key}=\"");
        escape(out, value);
        out.push('"');
    }
    out.push_str(" id=\"");
    escape(out, &group.id);
    out.push('"');
    if group.fade.0 < 1.0 {
        // A hundredth: fine enough for the eye, and a group that has all but vanished vanishes.
        let hundredths = libm::round(group.fade.0.max(0.0) * 100.0);
        let _ = write!(out, " opacity=\"{}\"", hundredths / 100.0);
    }
    out.push('>');
    if !group.title.is_empty() {
        out.push_str("<title>");
        escape(out, &group.title);
        out.push_str("</title>");
    }
    for piece in &group.pieces {
        match piece {
            Piece::Shape(shape) => write_shape(out, shape),
            Piece::Text(text) => write_text(out, text),
        }
    }
    out.push_str("</g>");
}

fn write_shape(out: &mut String, shape: &Shape) {
    match &shape.form {
        Form::Rect(rect, radius) => {
            out.push_str("<rect");
            attributes(
                out,
                &[
                    ("x", rect.x),
                    ("y", rect.y),
                    ("width", rect.w),
                    ("height", rect.h),
                ],
            );
            if *radius > 0.0 {
                attributes(out, &[("rx", *radius)]);
            }
        }
        Form::Ellipse(rect) => {
            let centre = rect.centre();
            out.push_str("<ellipse");
            attributes(
                out,
                &[
                    ("cx", centre.x),
                    ("cy", centre.y),
                    ("rx", rect.w / 2.0),
                    ("ry", rect.h / 2.0),
                ],
            );
        }
        Form::Path(steps) if is_polygon(steps) => {
            out.push_str("<polygon points=\"");
            for (at, step) in steps.iter().enumerate() {
                if let Step::Move(p) | Step::Line(p) = step {
                    out.push_str(if at > 0 { " " } else { "" });
                    number(out, p.x);
                    out.push(',');
                    number(out, p.y);
                }
            }
            out.push('"');
        }
        Form::Path(steps) => {
            out.push_str("<path d=\"");
            write_steps(out, steps);
            out.push('"');
        }
    }
    let _ = write!(out, " fill=\"{}\"", shape.fill);
    write_stroke(out, &shape.stroke);
    out.push_str("/>");
}

/// Whether a path is one closed run of straight lines: heads of arrows and signs, which tools should not take for routes.
fn is_polygon(steps: &[Step]) -> bool {
    matches!(steps, [Step::Move(_), lines @ .., Step::Close] if lines.iter().all(|s| matches!(s, Step::Line(_))))
}

fn write_steps(out: &mut String, steps: &[Step]) {
    for step in steps {
        let (letter, points) = match step {
            Step::Move(p) => ("M", std::slice::from_ref(p)),
            Step::Line(p) => ("L", std::slice::from_ref(p)),
            Step::Curve(points) => ("C", points.as_slice()),
            Step::Close => ("Z", [].as_slice()),
        };
        out.push_str(letter);
        for (at, p) in points.iter().enumerate() {
            if at > 0 {
                out.push(' ');
            }
            number(out, p.x);
            out.push(' ');
            number(out, p.y);
        }
    }
}

fn write_stroke(out: &mut String, stroke: &Stroke) {
    if stroke.width <= 0.0 || stroke.color == Color::NONE {
        return;
    }
    let _ = write!(out, " stroke=\"{}\" stroke-width=\"", stroke.color);
    fine(out, stroke.width);
    out.push('"');
    if stroke.dash.iter().any(|d| *d > 0.0) {
        out.push_str(" stroke-dasharray=\"");
        for (at, length) in stroke.dash.iter().enumerate() {
            if at > 0 {
                out.push(' ');
            }
            fine(out, *length);
        }
        out.push('"');
        if stroke.is_round() {
            out.push_str(" stroke-linecap=\"round\"");
        }
    }
}

fn write_text(out: &mut String, text: &Text) {
    out.push_str("<text");
    attributes(
        out,
        &[("x", text.at.x), ("y", text.at.y), ("font-size", text.size)],
    );
    if text.weight == Weight::SemiBold {
        out.push_str(" font-weight=\"600\"");
    }
    match text.anchor {
        Anchor::Start => {}
        Anchor::Middle => out.push_str(" text-anchor=\"middle\""),
        Anchor::End => out.push_str(" text-anchor=\"end\""),
    }
    let _ = write!(out, " fill=\"{}\"", text.color);
    if let Some((color, width)) = text.halo.filter(|(c, _)| *c != Color::NONE) {
        let _ = write!(out, " stroke=\"{color}\" stroke-width=\"");
        fine(out, width);
        out.push_str("\" stroke-linejoin=\"round\" paint-order=\"stroke\"");
    }
    // Without it, blanks at the ends and in a row would vanish.
    if text.text.starts_with(' ') || text.text.ends_with(' ') || text.text.contains("  ") {
        out.push_str(" xml:space=\"preserve\"");
    }
    out.push('>');
    escape(out, &text.text);
    out.push_str("</text>");
}

fn attributes(out: &mut String, pairs: &[(&str, f64)]) {
    for (key, value) in pairs {
        let _ = write!(out, " {key}=\"");
        number(out, *value);
        out.push('"');
    }
}

/// A coordinate, to a tenth of a pixel; what is no number becomes 0.
fn number(out: &mut String, value: f64) {
    write_decimal(out, value, 10);
}

/// A width or a dash, to a hundredth.
fn fine(out: &mut String, value: f64) {
    write_decimal(out, value, 100);
}

/// In whole units of 1/`parts` (1 to 100); what is no number becomes 0.
pub(crate) fn units(value: f64, parts: i64) -> i64 {
    let value = if value.is_finite() {
        value.clamp(-1e7, 1e7)
    } else {
        0.0
    };
    #[expect(
        clippy::cast_possible_truncation,
        reason = "held below 1e9 on the line above"
    )]
    let units = libm::round(value * parts as f64) as i64;
    units
}

/// `value` in units of 1/`parts` (10 or 100), without trailing zeros.
fn write_decimal(out: &mut String, value: f64, parts: i64) {
    let units = units(value, parts);
    if units < 0 {
        out.push('-');
    }
    let (whole, rest) = (units.abs() / parts, units.abs() % parts);
    let _ = write!(out, "{whole}");
    match (rest, parts) {
        (0, _) => {}
        (_, 10) => {
            let _ = write!(out, ".{rest}");
        }
        _ if rest % 10 == 0 => {
            let _ = write!(out, ".{}", rest / 10);
        }
        _ => {
            let _ = write!(out, ".{rest:02}");
        }
    }
}

/// `text` for use between tags and in attributes; what XML cannot hold is spelled out.
pub(crate) fn escape(out: &mut String, text: &str) {
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' | '\r' => {
                let _ = write!(out, "&#{};", u32::from(c));
            }
            '\0'..='\u{1f}' | '\u{7f}'..='\u{9f}' | '\u{fffe}' | '\u{ffff}' => {
                let _ = write!(out, "\\u{{{:x}}}", u32::from(c));
            }
            _ => out.push(c),
        }
    }
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

    fn decimal(value: f64, parts: i64) -> String {
        let mut out = String::new();
        write_decimal(&mut out, value, parts);
        out
    }

    #[test]
    fn coordinates_are_rounded_and_short() {
        assert_eq!(decimal(1.04, 10), "1");
        assert_eq!(decimal(-0.25, 10), "-0.3");
        assert_eq!(decimal(-0.04, 10), "0");
        assert_eq!(decimal(1.05, 100), "1.05");
        assert_eq!(decimal(0.9, 100), "0.9");
        assert_eq!(decimal(f64::NAN, 10), "0");
        assert_eq!(decimal(f64::INFINITY, 10), "0");
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
    fn the_font_can_travel_with_the_picture() {
        let scene = Scene {
            size: Size::new(1.0, 1.0),
            width_mm: None,
            background: Color::NONE,
            title: String::new(),
            groups: Vec::new(),
        };
        assert!(write_with_fonts(&scene).contains(
            "@font-face{font-family:Inter;font-weight:600;src:url(data:font/ttf;base64,AAEAAA"
        ));
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
