use super::*;
use crate::base::geometry::{Point, Rect, Size};
use crate::draw::scene::{Anchor, Form, Shape, Step, Stroke, Text};
use crate::draw::style::Style;
use crate::draw::text::Weight;

fn painter() -> Painter {
    Painter::new(&Fonts::bundled())
}

fn page(groups: Vec<Group>) -> Scene {
    Scene {
        size: Size::new(200.0, 120.0),
        width_mm: None,
        background: Style::builtin("light").unwrap().background(),
        title: String::new(),
        groups,
    }
}

fn ink(pixels: &Pixels) -> usize {
    pixels.rgba.chunks(4).filter(|p| p[..3] != [255; 3]).count()
}

fn words(id: &str, text: &str, weight: Weight) -> Group {
    let mut group = Group::named(id);
    group.text(Text {
        at: Point::new(100.0, 60.0),
        anchor: Anchor::Middle,
        size: 14.0,
        weight,
        color: Style::builtin("light").unwrap().page.text,
        halo: None,
        text: text.to_owned(),
    });
    group
}

/// A blob and a line whose positions depend on `at`.
fn element(id: usize, at: usize) -> Group {
    let style = Style::builtin("light").unwrap();
    let x = (at * 37 % 170) as f64 + 0.3;
    let y = (at * 53 % 100) as f64 + 0.7;
    let mut group = Group::named(&format!("e{id}"));
    let curve = [
        Point::new(x, 0.0),
        Point::new(199.0, y),
        Point::new(190.0, 110.0),
    ];
    let path = Form::Path(vec![Step::Move(Point::new(x, y)), Step::Curve(curve)]);
    group.shape(Shape::line(path, Stroke::solid(style.edge.stroke, 1.3)));
    group.shape(Shape::filled(
        Form::Ellipse(Rect::new(x, y, 30.0, 17.0)),
        style.node.fill,
    ));
    group.text(Text {
        at: Point::new(x, y + 10.0),
        anchor: Anchor::Start,
        size: 9.0,
        weight: Weight::Regular,
        color: style.page.text,
        halo: Some((style.edge.halo, 2.0)),
        text: format!("e{at}"),
    });
    group
}

#[test]
fn text_is_drawn_in_both_weights_and_as_wide_as_measured() {
    let (painter, fonts) = (painter(), Fonts::bundled());
    let regular = ink(&painter
        .paint(&page(vec![words("a", "planner", Weight::Regular)]), 1.0)
        .unwrap());
    let bold = ink(&painter
        .paint(&page(vec![words("a", "planner", Weight::SemiBold)]), 1.0)
        .unwrap());
    assert!(regular > 100 && bold > regular, "{regular} {bold}");
    let pixels = painter
        .paint(&page(vec![words("a", "mmmm", Weight::Regular)]), 4.0)
        .unwrap();
    let dark = |x: u32| {
        (0..pixels.height).any(|y| pixels.rgba[((y * pixels.width + x) * 4) as usize] < 128)
    };
    let (first, last) = (
        (0..800).find(|x| dark(*x)).unwrap(),
        (0..800).rev().find(|x| dark(*x)).unwrap(),
    );
    let measured = fonts.width("mmmm", 14.0, Weight::Regular) * 4.0;
    assert!(
        (f64::from(last - first) - measured).abs() < 14.0,
        "{first} {last} {measured}"
    );
}

/// The columns with ink in a document drawn at four times its size: the first and the last.
fn columns(svg: &str, options: &usvg::Options<'_>) -> (u32, u32) {
    let tree = Tree::from_str(svg, options).unwrap();
    let mut map = tiny_skia::Pixmap::new(800, 480).unwrap();
    let scaled = tiny_skia::Transform::from_scale(4.0, 4.0);
    resvg::render(&tree, scaled, &mut map.as_mut());
    let has_ink = |x: &u32| {
        (0..480).any(|y| {
            map.pixel(*x, y)
                .is_some_and(|p| p.alpha() > 128 && p.red() < 128)
        })
    };
    let mut inked = (0..800).filter(has_ink);
    (inked.next().unwrap(), inked.next_back().unwrap())
}

#[test]
fn text_of_a_document_is_as_wide_in_another_font() {
    let name = "mmm_/planner 7.4 Hz";
    let scene = page(vec![words("a", name, Weight::Regular)]);
    let mut other = fontdb::Database::new();
    other.load_font_data(crate::draw::text::SEMIBOLD.to_vec());
    let other = usvg::Options {
        fontdb: Arc::new(other),
        ..usvg::Options::default()
    };
    let own = &painter().options;
    let (document, alone) = (
        svg::write(&scene),
        svg::write_alone(&scene, &scene.groups[0]),
    );
    let width = |svg: &str, options| {
        let (first, last) = columns(svg, options);
        last - first
    };
    let expected = width(&alone, own);
    assert!(width(&alone, &other) > expected + 8, "the font differs");
    assert!(width(&document, &other).abs_diff(expected) <= 3);
    assert!(width(&document, own).abs_diff(expected) <= 1);
}

#[test]
fn text_with_characters_of_other_fonts_has_its_natural_width() {
    let scene = page(vec![words("a", "/机器", Weight::Regular)]);
    assert!(!svg::write(&scene).contains("textLength"));
}

/// The largest difference between the channels of the painter's picture and those of the whole document drawn
/// at once.
fn apart(scene: &Scene, scale: f32) -> Vec<u8> {
    let painter = painter();
    let pixels = painter.paint(scene, f64::from(scale)).unwrap();
    let whole = Tree::from_str(&svg::write_measured(scene, None), &painter.options).unwrap();
    let mut map = tiny_skia::Pixmap::new(pixels.width, pixels.height).unwrap();
    let scaled = tiny_skia::Transform::from_scale(scale, scale);
    resvg::render(&whole, scaled, &mut map.as_mut());
    let channels = pixels.rgba.iter().zip(map.data());
    channels.map(|(a, b)| a.abs_diff(*b)).collect()
}

#[test]
fn separately_drawn_groups_equal_the_whole_document() {
    let scene = page((0..12).map(|i| element(i, i)).collect());
    // Antialiased edges are rounded once more for each group, and a curve is subdivided differently elsewhere
    // on a page.
    let small = apart(&scene, 1.0);
    let rounded = small.iter().filter(|d| **d <= 2).count();
    assert!(
        rounded * 1000 > small.len() * 998,
        "{rounded} of {}",
        small.len()
    );
    assert!(small.iter().all(|d| *d <= 24), "{:?}", small.iter().max());
    // So large that no group's pixels are cached: the pixels are identical.
    assert!(apart(&scene, 6.0).iter().all(|d| *d == 0));
}

#[test]
fn incremental_drawing_equals_full_drawing() {
    let painter = painter();
    for scale in [1.0, 1.5] {
        let mut canvas = Canvas::new(&painter, scale);
        for step in 0..40 {
            let groups = (0..9).filter(|i| (i + step) % 7 != 0);
            let scene = page(
                groups
                    .map(|i| element(i, i * 3 + (step + i) / 6 * 11))
                    .collect(),
            );
            assert!(
                *canvas.draw(scene.clone()).unwrap().pixels
                    == painter.paint(&scene, scale).unwrap(),
                "step {step}"
            );
        }
    }
}

#[test]
fn reported_changes_are_complete() {
    let painter = painter();
    let mut canvas = Canvas::new(&painter, 1.5);
    let mut copy = vec![0; 300 * 180 * 4];
    for step in 0..20 {
        let still = (0..6).map(|i| element(i, i));
        let moving = words("moving", &"m".repeat(step % 7 + 1), Weight::Regular);
        let groups = still.chain([moving]).collect();
        let drawn = canvas.draw(page(groups)).unwrap();
        let pixels = drawn.pixels;
        let mut reported = 0;
        for bytes in drawn.changed() {
            copy[bytes.clone()].copy_from_slice(&pixels.rgba[bytes.clone()]);
            reported += bytes.len();
        }
        assert!(copy == pixels.rgba, "step {step}");
        assert!(step == 0 || reported < copy.len(), "step {step}");
    }
}

#[test]
fn elements_with_a_new_painting_order_are_redrawn() {
    let painter = painter();
    let mut canvas = Canvas::new(&painter, 1.0);
    let scene = page(vec![element(0, 3), element(1, 3)]);
    canvas.draw(scene).unwrap();
    let turned = page(vec![element(1, 3), element(0, 3)]);
    assert!(*canvas.draw(turned.clone()).unwrap().pixels == painter.paint(&turned, 1.0).unwrap());
}

#[test]
fn absurd_sizes_are_refused() {
    let mut scene = page(Vec::new());
    for (w, h) in [
        (0.0, 10.0),
        (70_000.0, 10.0),
        (60_000.0, 60_000.0),
        (f64::NAN, 1.0),
    ] {
        scene.size = Size::new(w, h);
        assert!(
            painter().paint(&scene, 1.0).is_err_and(|e| e.is_usage()),
            "{w} {h}"
        );
    }
}

#[test]
fn a_long_curve_touches_few_tiles() {
    let page = Size::new(1280.0, 720.0);
    let steps = vec![
        Step::Move(Point::new(10.0, 10.0)),
        Step::Curve([
            Point::new(600.0, 10.0),
            Point::new(600.0, 700.0),
            Point::new(1270.0, 700.0),
        ]),
    ];
    let shape = Shape::line(Form::Path(steps), Stroke::solid(Color::NONE, 1.0));
    let mut tiles = Tiles::none(page);
    tiles.add_shape(&shape);
    assert!(
        tiles.share() > 0.03 && tiles.share() < 0.25,
        "{}",
        tiles.share()
    );
    assert_eq!(tiles.iter().next(), Some((0, 0)));
}

#[test]
fn elements_outside_the_page_take_few_tiles() {
    let mut tiles = Tiles::none(Size::new(100.0, 100.0));
    tiles.add(Rect::new(-500.0, -500.0, 10.0, 10.0));
    tiles.add(Rect::new(5000.0, 20.0, 10.0, 10.0));
    tiles.add(Rect::new(f64::NAN, 0.0, 1.0, 1.0));
    assert!(tiles.iter().count() <= 4);
}
