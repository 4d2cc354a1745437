use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;

use super::*;
use crate::base::geometry::Rect;
use crate::draw::paint::raster::{Canvas, Painter};
use crate::draw::scene::{Anchor, Form, Piece, Shape};
use crate::view::testing::mission;
use crate::view::{Mode, ViewOptions, view};

/// Calls `then` with the picture of a mission of this description, in this style.
fn with_picture<T>(
    windows: &[&str],
    style: &str,
    options: PageOptions,
    then: impl FnOnce(&Picture<'_>) -> T,
) -> T {
    let (view, _) = view(&mission(windows), &ViewOptions::default());
    let (style, fonts) = (Style::builtin(style).unwrap(), Fonts::bundled());
    then(&laid_out(Measured::new(&view, &style, &fonts, options)))
}

fn laid_out(measured: Measured<'_>) -> Picture<'_> {
    let engine = layout::engine("layered").unwrap();
    let layout = layout::lay_out(measured.plan(), &measured.layout_options(), engine);
    measured.with(layout)
}

fn scenes(windows: &[&str]) -> Vec<Scene> {
    with_picture(windows, "light", PageOptions::default(), |p| {
        (0..p.len()).map(|k| p.scene(k)).collect()
    })
}

const MISSION: [&str; 5] = [
    "/cam>/image@15 /image@15 /viewer</image /base/driver>/base/odom@50 /nav/planner</base/odom /nav/planner>/cmd_vel@10",
    "/cam>/image@7 /image@7 /viewer</image /base/driver>/base/odom@50 /nav/planner</base/odom /nav/planner>/cmd_vel@10",
    "/viewer</image~ /base/driver>/base/odom@50 /nav/planner</base/odom /teleop>/cmd_vel@10 =/lonely@3",
    "/base/driver>/base/odom@50 /nav/planner</base/odom /teleop>/cmd_vel@10 =/lonely@9",
    "/cam>/image@15 /base/driver>/base/odom@50 /nav/planner</base/odom /teleop>/cmd_vel@10 =/lonely@9",
];

/// The first shape of a group, which is its box; for an arrow its route without its paint.
fn body(group: &Group) -> Option<Form> {
    group.pieces.iter().find_map(|piece| match piece {
        Piece::Shape(shape) => Some(shape.form.clone()),
        Piece::Text(_) => None,
    })
}

/// Whether it is a part of the graph, and not a decoration.
fn is_element(group: &Group) -> bool {
    let known = |(key, _): &(&str, String)| matches!(*key, "name" | "from" | "of");
    group.data.first().is_some_and(known)
}

#[test]
fn positions_are_constant_across_windows() {
    let mut places: BTreeMap<String, Form> = BTreeMap::new();
    for scene in scenes(&MISSION) {
        // Rates differ in length, and so do their labels.
        let is_still = |g: &&Group| is_element(g) && !g.id.ends_with("..over");
        for group in scene.groups.iter().filter(is_still) {
            let Some(here) = body(group) else { continue };
            let first = places
                .entry(group.id.clone())
                .or_insert_with(|| here.clone());
            assert_eq!(*first, here, "{}", group.id);
        }
    }
    assert!(places.len() > 12, "{}", places.len());
}

#[test]
fn lines_do_not_cross_text() {
    for scene in scenes(&MISSION) {
        let is_line = |g: &Group| g.class.starts_with("edge") && !g.id.ends_with("..over");
        let last_line = scene.groups.iter().rposition(is_line).unwrap();
        let lines = scene.groups[..=last_line].iter();
        let words = lines
            .flat_map(|g| &g.pieces)
            .filter_map(|piece| match piece {
                Piece::Text(text) => Some(text.text.as_str()),
                Piece::Shape(_) => None,
            });
        let decorations = ["title", "legend", "axis"];
        let own = scene
            .groups
            .iter()
            .filter(|g| decorations.contains(&g.id.as_str()));
        let own = own
            .flat_map(|g| &g.pieces)
            .filter(|p| matches!(p, Piece::Text(_)));
        assert_eq!(words.count(), own.count());
    }
}

#[test]
fn ids_are_unique_xml_names() {
    for scene in scenes(&MISSION) {
        let ids: BTreeSet<&str> = scene.groups.iter().map(|g| g.id.as_str()).collect();
        assert_eq!(ids.len(), scene.groups.len());
        assert!(
            ids.iter()
                .all(|id| id.starts_with(|c: char| c.is_ascii_alphabetic()))
        );
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        assert!(ids.iter().all(|id| id.chars().all(plain)));
    }
    assert_ne!(encoded("/a-b"), encoded("/a/b"));
    assert_ne!(encoded("/a.00002db"), encoded("/a-b"));
}

#[test]
fn a_frame_marks_changes_in_names_classes_and_text() {
    let all = scenes(&MISSION);
    let svg = |k: usize| crate::draw::paint::svg::write(&all[k]);
    assert!(svg(1).contains("15 → 7 Hz"));
    assert!(svg(1).contains("<g class=\"topic changed active measured\" data-name=\"/image\""));
    assert!(svg(2).contains(
        "<g class=\"node removed silent declared\" data-name=\"/cam\" data-state=\"silent\" data-mark=\"removed\" data-entries=\"3\" id=\"n-cam\"><title>/cam&#10;node"
    ));
    assert!(svg(2).contains("<g class=\"node added active measured\" data-name=\"/teleop\""));
    assert!(svg(2).contains("data-from=\"/teleop\" data-to=\"/cmd_vel\""));
    assert!(svg(2).contains("handed-over"));
    assert!(
        svg(3).contains("3 → 9 Hz"),
        "a topic without a publisher shows its own rate"
    );
    let has_viewer = |k: usize| svg(k).contains("n-viewer\"");
    assert!(
        has_viewer(3) && !has_viewer(4),
        "a ghost stays for one window"
    );
    assert!(svg(0).contains("window 1 of 5") && svg(0).contains("no change yet"));
}

#[test]
fn names_are_only_shortened_inside_their_namespace() {
    let nested = ["/base/driver>/base/odom@5 /base/ekf</base/odom /root</base/odom"];
    let svg = crate::draw::paint::svg::write(&scenes(&nested)[0]);
    assert!(
        svg.contains(">driver</text>")
            && svg.contains(">/root</text>")
            && svg.contains(">/base</text>")
    );
    assert!(svg.contains("data-name=\"/base/driver\""));
}

#[test]
fn characters_without_a_glyph_are_spelled_out_and_noticed() {
    let mission = ["/机器>/t@1 /plain>/t@2"];
    let (view, _) = view(
        &crate::view::testing::mission(&mission),
        &ViewOptions::default(),
    );
    let notice = unshown(&view, &Fonts::bundled()).unwrap();
    assert!(
        notice.text.contains("\\u{5668} and \\u{673a};"),
        "{}",
        notice.text
    );
    let svg = crate::draw::paint::svg::write(&scenes(&mission)[0]);
    assert!(svg.contains(">/\\u{673a}\\u{5668}</text>") && svg.contains("data-name=\"/机器\""));
    assert!(svg.contains("id=\"n-.00673a.005668\""));
}

#[test]
fn colours_do_not_affect_positions() {
    let places = |style| {
        with_picture(&MISSION, style, PageOptions::default(), |p| {
            p.layout().clone()
        })
    };
    assert_eq!(places("light"), places("dark"));
    assert_eq!(places("light"), places("paper"));
}

#[test]
fn a_bare_picture_contains_only_the_graph() {
    let options = PageOptions {
        bare: true,
        ..PageOptions::default()
    };
    with_picture(&MISSION, "light", options, |p| {
        assert!(p.scene(2).groups.iter().all(is_element));
    });
}

#[test]
fn a_glow_is_below_all_lines() {
    let mut tried = 0;
    for scene in scenes(&MISSION) {
        let is = |g: &Group, class: &str| g.class.starts_with(class);
        let glow = scene.groups.iter().rposition(|g| is(g, "glow"));
        let line = scene.groups.iter().position(|g| is(g, "edge"));
        if let (Some(glow), Some(line)) = (glow, line) {
            assert!(glow < line);
            tried += 1;
        }
    }
    assert!(tried >= 3);
}

#[test]
fn incremental_frames_equal_fully_drawn_ones() {
    let painter = Painter::new(&Fonts::bundled());
    let options = PageOptions {
        size: Size::new(480.0, 300.0),
        ..PageOptions::default()
    };
    with_picture(&MISSION, "light", options, |p| {
        let mut canvas = Canvas::new(&painter, 1.0);
        for k in 0..p.len() {
            let scene = p.scene(k);
            assert!(
                *canvas.draw(scene.clone()).unwrap().pixels == painter.paint(&scene, 1.0).unwrap(),
                "{k}"
            );
        }
    });
}

#[test]
fn decorations_fit_pages_of_any_size() {
    for (w, h) in [
        (1920.0, 1080.0),
        (800.0, 450.0),
        (333.0, 200.0),
        (60.0, 40.0),
        (3.0, 2.0),
        (300.0, 2000.0),
    ] {
        let options = PageOptions {
            size: Size::new(w, h),
            title: Some("a bag with a long name.bag".to_owned()),
            ..PageOptions::default()
        };
        with_picture(&MISSION, "light", options, |p| {
            let svg = crate::draw::paint::svg::write(&p.scene(2));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{w} x {h}");
        });
    }
}

#[test]
fn an_empty_view_is_an_empty_page() {
    with_picture(&[], "light", PageOptions::default(), |p| {
        assert!(p.is_empty() && p.scene(0).size == Size::new(1280.0, 720.0));
    });
    with_picture(&[""], "light", PageOptions::default(), |p| {
        assert!(p.scene(0).groups.iter().any(|g| g.id == "title"));
    });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Any mission, with any names: no two boxes overlap, everything is on the page, all numbers are finite.
    #[test]
    fn any_mission_stays_on_its_page(
        windows in prop::collection::vec(prop::collection::vec((0usize..6, 0usize..6, any::<bool>(), 0u32..90), 0..9), 1..5)
    ) {
        let names = ["/a", "/ns/b", "/ns/deep/c", "/x_long_name_of_a_thing", "/d", "/ns/e"];
        let word = |(n, t, publishes, hz): &(usize, usize, bool, u32)| {
            let (n, t) = (names[*n], names[*t]);
            if *publishes { format!("{n}>{t}_topic@{hz}") } else { format!("{n}<{t}_topic") }
        };
        let texts: Vec<String> = windows.iter().map(|w| w.iter().map(word).collect::<Vec<_>>().join(" ")).collect();
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        let page = Rect::new(-0.1, -0.1, 1280.2, 720.2);
        for scene in scenes(&texts) {
            let mut boxes: Vec<Rect> = Vec::new();
            for group in scene.groups.iter().filter(|g| g.class.starts_with("node") || g.class.starts_with("topic")) {
                let Some(Form::Rect(rect, _) | Form::Ellipse(rect)) = body(group) else { panic!("no box") };
                prop_assert!(page.union(&rect) == page, "{rect:?}");
                prop_assert!(!boxes.iter().any(|b| b.grown(-0.2).overlaps(&rect)));
                boxes.push(rect);
            }
            let shapes = scene.groups.iter().flat_map(|g| &g.pieces);
            for piece in shapes {
                if let Piece::Shape(Shape { form: Form::Rect(r, _), .. }) = piece {
                    prop_assert!(r.x.is_finite() && r.y.is_finite() && r.w >= 0.0 && r.h >= 0.0, "{r:?}");
                }
            }
        }
    }
}

#[test]
fn a_headline_of_long_names_ends_before_the_clock() {
    let name = |letter: &str| format!("/{}", letter.repeat(60));
    let (a, b, t) = (name("a"), name("b"), name("t"));
    let all = format!("{a}>{t}@5 {b} =/rate@5");
    let after = format!("{a} {b}>{t}@5 =/rate@50");
    for wide in [320.0, 640.0, 1280.0] {
        let options = PageOptions {
            size: Size::new(wide, 400.0),
            ..PageOptions::default()
        };
        let windows = [all.as_str(), after.as_str()];
        let scene = with_picture(&windows, "light", options, |picture| picture.scene(1));
        let fonts = Fonts::bundled();
        let ends = |id: &str| -> Vec<[f64; 3]> {
            let group = scene.groups.iter().find(|group| group.id == id).unwrap();
            let texts = group.pieces.iter().filter_map(|piece| match piece {
                Piece::Text(text) => Some(text),
                Piece::Shape(_) => None,
            });
            let ends = texts.map(|text| {
                let wide = fonts.width(&text.text, text.size, text.weight);
                let left = match text.anchor {
                    Anchor::End => text.at.x - wide,
                    _ => text.at.x,
                };
                [left, left + wide, text.at.y]
            });
            ends.collect()
        };
        let clock = ends("clock");
        let headline = ends("headline");
        assert!(headline.len() > 1);
        for [_, right, y] in headline.into_iter().chain(ends("note")) {
            let beside = clock.iter().min_by(|a, b| {
                let far = |end: &[f64; 3]| (end[2] - y).abs();
                far(a).total_cmp(&far(b))
            });
            assert!(right < beside.unwrap()[0], "{right} on {wide} px");
        }
    }
}

/// The lines of each window between nodes, as their ends with the words of their labels.
fn bundles(windows: &[&str]) -> Vec<Vec<String>> {
    let options = ViewOptions {
        mode: Mode::Nodes,
        is_bundled: true,
        is_picture: true,
        ..ViewOptions::default()
    };
    let (view, _) = view(&mission(windows), &options);
    let (style, fonts) = (Style::builtin("light").unwrap(), Fonts::bundled());
    let picture = laid_out(Measured::new(&view, &style, &fonts, PageOptions::default()));
    let texts = |group: &Group| {
        let texts = group.pieces.iter().filter_map(|piece| match piece {
            Piece::Text(text) => Some(text.text.clone()),
            Piece::Shape(_) => None,
        });
        texts.collect::<Vec<_>>().join(", ")
    };
    let lines = |k: usize| {
        let groups = picture.scene(k).groups;
        let is_line = |g: &&Group| g.class.starts_with("edge") && !g.id.ends_with("..over");
        let words = |id: &str| {
            let over = groups.iter().find(|g| g.id == format!("{id}..over"));
            over.map(&texts).unwrap_or_default()
        };
        let line = |g: &Group| {
            let words = words(&g.id);
            format!("{} > {}: {words}", g.data[0].1, g.data[1].1)
                .trim_end()
                .to_owned()
        };
        let mut lines: Vec<String> = groups.iter().filter(is_line).map(line).collect();
        lines.sort();
        lines
    };
    (0..picture.len()).map(lines).collect()
}

#[test]
fn quiet_lines_to_a_box_outside_begin_at_the_frame_as_one() {
    let quiet = "/r/a>/x@3 /r/b>/y@2 /f</x /f</y /r/a>/z@4 /r/b</z";
    let changed = "/r/a>/x@3 /r/b>/y@20 /f</x /f</y /r/a>/z@4 /r/b</z";
    let [first, second] = &bundles(&[quiet, changed])[..] else {
        panic!("two windows");
    };
    assert_eq!(first, &["/r > /f: x 3 Hz, y 2 Hz", "/r/a > /r/b: z 4 Hz"]);
    let want = [
        "/r > /f: x 3 Hz",
        "/r/a > /r/b: z 4 Hz",
        "/r/b > /f: y 2 → 20 Hz",
    ];
    assert_eq!(second, &want);
}

#[test]
fn one_topic_to_several_readers_has_one_label() {
    let lines = bundles(&["/s>/scan@9 /p</scan /q</scan /p>/u@2 /q</u"]);
    assert_eq!(
        lines[0],
        ["/p > /q: u 2 Hz", "/s > /p: scan 9 Hz", "/s > /q:"]
    );
}

#[test]
fn a_line_outside_of_a_frame_keeps_its_label_only_if_that_is_beside_it() {
    // Into the frame, out of it at the bottom, where its label is, and into it again.
    let corners = [(150.0, 20.0), (150.0, 90.0), (190.0, 90.0), (190.0, 20.0)];
    let corners = corners.map(|(x, y)| Point::new(x, y));
    let frame = Rect::new(100.0, 0.0, 100.0, 50.0);
    let outside = |label: Point| {
        let route = layout::Route {
            start: Point::new(0.0, 20.0),
            curves: corners.map(|p| [p; 3]).to_vec(),
            label: Some(label),
        };
        let fit = GraphFit {
            scale: 1.0,
            pen: 1.0,
            origin: Point::default(),
        };
        let room = Some(Size::new(30.0, 10.0));
        let path = ArrowPath::new(String::new(), Default::default(), &route, room, fit);
        path.outside(frame, false).is_some()
    };
    assert!(outside(Point::new(50.0, 20.0)));
    assert!(!outside(Point::new(170.0, 84.0)));
}
