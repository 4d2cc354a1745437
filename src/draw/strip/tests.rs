use std::collections::BTreeSet;
use std::sync::Arc;

use super::*;
use crate::base::notice::Notices;
use crate::base::time::{Period, Span, Stamp};
use crate::draw::scene::Piece;
use crate::evidence::Confidence;
use crate::graph::{Element, Elements, NodeId, State};
use crate::layout;
use crate::view::testing::started;
use crate::view::{Frame, Item, ItemKind, Mark, Phrase, Shown, ShownRuns};

/// Four minutes in which one node exists and another appears and vanishes.
fn two_nodes() -> (Mission, View) {
    let minute = |i: usize| Stamp(i64::try_from(i).unwrap() * 60_000_000_000);
    let period = Period::parse("1m").unwrap();
    let mission = Mission {
        bags: Vec::new(),
        span: Span::new(minute(0), minute(4)),
        messages: 0,
        period,
        step: period,
        elements: Elements::default(),
        windows: Vec::new(),
        graphs: crate::graph::Graphs::default(),
        log: crate::mission::EventLog::default(),
        sending: crate::graph::history::Sending::default(),
        undrawn: Vec::new(),
        logged: Vec::new(),
        layout: None,
        notices: Notices::new(),
    };
    let item = |(id, name): (u32, &str)| Item {
        kind: ItemKind::Node,
        name: Arc::from(name),
        label: Arc::from(name),
        others: Vec::new(),
        members: vec![Element::Node(NodeId(id))],
        counted: Vec::new(),
        is_replica: false,
        is_service: false,
        cluster: None,
    };
    let shown = |id, mark| Shown {
        mark,
        ..Shown::plain(id, State::Active, Confidence::Measured)
    };
    let frame = |(index, mark): (usize, Option<Mark>)| Frame {
        headlines: mark.map(|_| started()).into_iter().collect(),
        caption: mark
            .map(|m| Phrase {
                sign: ' ',
                lead: String::new(),
                names: vec!["/planner".to_owned()],
                events: vec![vec![crate::mission::EventId(0)]],
                tail: m.class().to_owned(),
            })
            .into_iter()
            .collect(),
        ..Frame::empty(index, Span::new(minute(index), minute(index + 1)))
    };
    let marks = [None, Some(Mark::Added), None, Some(Mark::Removed)];
    let driver = shown(0, None);
    let planner = marks.map(|mark| mark.map(|m| shown(1, Some(m))));
    let view = View {
        items: (0..).zip(["/driver", "/planner"]).map(item).collect(),
        items_shown: vec![
            ShownRuns::of(marks.iter().map(|_| Some(&driver))),
            ShownRuns::of(planner.iter().map(Option::as_ref)),
        ]
        .into(),
        frames: marks.into_iter().enumerate().map(frame).collect(),
        ..View::default()
    };
    (mission, view)
}

fn strip_of(choice: &str, width_mm: Option<f64>) -> Strip {
    let (mission, view) = two_nodes();
    let (style, fonts) = (Style::builtin("paper").unwrap(), Fonts::bundled());
    let measured = Measured::new(&view, &style, &fonts, PageOptions::default());
    let engine = layout::engine("layered").unwrap();
    let layout = layout::lay_out(measured.plan(), &measured.layout_options(), engine);
    let picture = measured.with(layout);
    let source = StripSource {
        mission: &mission,
        view: &view,
        picture: &picture,
        style: &style,
        fonts: &fonts,
        others: &[],
    };
    let width = width_mm.map_or(StripWidth::About(1280.0), StripWidth::Paper);
    strip(source, &Choice::parse(choice).unwrap(), width).unwrap()
}

fn texts(strip: &Strip) -> Vec<&Text> {
    let pieces = strip.scene.groups.iter().flat_map(|g| &g.pieces);
    let mut texts = Vec::new();
    for piece in pieces {
        if let Piece::Text(text) = piece {
            texts.push(text);
        }
    }
    texts
}

#[test]
fn panels_have_time_and_change_and_share_a_legend() {
    let strip = strip_of("changes", None);
    let words: Vec<&str> = texts(&strip).iter().map(|t| t.text.as_str()).collect();
    for expected in ["0:00–1:00", "1:00–2:00", "3:00–4:00", "/planner added"] {
        assert_eq!(
            words.iter().filter(|w| **w == expected).count(),
            1,
            "{expected}"
        );
    }
    assert!(!words.contains(&"2:00–3:00"));
    assert_eq!(words.iter().filter(|w| **w == "node").count(), 1);
}

#[test]
fn ids_stay_unique() {
    let strip = strip_of("2x2", None);
    let ids: BTreeSet<&str> = strip.scene.groups.iter().map(|g| g.id.as_str()).collect();
    assert_eq!(ids.len(), strip.scene.groups.len());
}

#[test]
fn on_paper_the_width_is_exact_and_captions_are_legible() {
    let strip = strip_of("2x2", Some(88.0));
    assert_eq!(strip.scene.width_mm, Some(88.0));
    assert!((strip.scene.size.w - 88.0 * PX_PER_MM).abs() < 1e-9);
    assert_eq!(strip.remarks, Vec::<String>::new());
    let smallest = texts(&strip)
        .iter()
        .map(|t| t.size)
        .fold(f64::MAX, f64::min);
    assert!(smallest * PT_PER_PX >= SMALLEST_PT);
}

#[test]
fn too_small_text_is_reported_with_advice() {
    let strip = strip_of("2x2", Some(20.0));
    assert!(strip.remarks[0].contains("mm`"), "{:?}", strip.remarks);
}

#[test]
fn small_graphs_are_not_enlarged_to_the_width_of_the_page() {
    let strip = strip_of("0", None);
    let names = texts(&strip)
        .into_iter()
        .filter(|t| t.text.starts_with('/'));
    let largest = names.map(|t| t.size).fold(0.0, f64::max);
    assert!(largest > 14.0 && largest < 22.0, "{largest} px");
    assert!(strip.scene.size.w < 1000.0, "{} px", strip.scene.size.w);
}

#[test]
fn everything_is_on_the_page() {
    for choice in ["2x2", "0", "changes"] {
        let strip = strip_of(choice, None);
        let page = strip.scene.size;
        for piece in strip.scene.groups.iter().flat_map(|g| &g.pieces) {
            let bounds = piece_bounds(piece).unwrap();
            assert!(
                bounds.x >= -1.0 && bounds.right() <= page.w + 1.0,
                "{choice}: {piece:?}"
            );
            assert!(
                bounds.y >= -1.0 && bounds.bottom() <= page.h + 1.0,
                "{choice}: {piece:?}"
            );
        }
    }
}

/// The upright box around a piece; for a text only its height and beginning.
fn piece_bounds(piece: &Piece) -> Option<Rect> {
    match piece {
        Piece::Shape(shape) => match &shape.form {
            Form::Rect(rect, _) | Form::Ellipse(rect) => Some(*rect),
            Form::Path(steps) => Rect::of_points(
                steps
                    .iter()
                    .filter_map(|step| step.points().last().copied()),
            ),
        },
        Piece::Text(text) => Some(Rect::new(
            text.at.x,
            text.at.y - text.size,
            0.0,
            text.size * 1.3,
        )),
    }
}

/// A view of windows 10, 11, … in which this many nodes appear.
fn view(added: &[usize]) -> View {
    let frame = |(place, nodes_added): (usize, &usize)| Frame {
        headlines: vec![started(); *nodes_added],
        counts: Counts {
            nodes_added: *nodes_added,
            ..Counts::default()
        },
        ..Frame::empty(10 + place, Span::new(Stamp(0), Stamp(1)))
    };
    View {
        frames: added.iter().enumerate().map(frame).collect(),
        ..View::default()
    }
}

fn places(choice: &str, added: &[usize]) -> Vec<usize> {
    Choice::parse(choice).unwrap().places(&view(added)).unwrap()
}

#[test]
fn choices_are_parsed_in_all_forms() {
    assert_eq!(Choice::parse("3x2").unwrap(), Choice::Grid(3, 2));
    assert_eq!(
        Choice::parse("0, 4,9").unwrap(),
        Choice::Windows(vec![0, 4, 9])
    );
    for bad in ["", "0x2", "3x", "x", "1000x1", "all", "-1", "1,,2"] {
        assert!(Choice::parse(bad).is_err_and(|e| e.is_usage()), "{bad}");
    }
}

#[test]
fn a_grid_takes_the_first_and_those_that_change_most() {
    assert_eq!(places("2x2", &[0, 1, 5, 0, 2, 3]), [0, 2, 4, 5]);
    assert_eq!(places("3x1", &[0, 0]), [0, 1]);
}

#[test]
fn changes_are_all_windows_with_a_change_up_to_a_limit() {
    assert_eq!(places("changes", &[0, 1, 0, 2]), [0, 1, 3]);
    assert_eq!(places("changes", &[1; 40]).len(), MOST);
}

#[test]
fn windows_are_selected_by_index() {
    assert_eq!(places("12,10", &[0, 0, 0]), [2, 0]);
    let missing = Choice::Windows(vec![9]).places(&view(&[0]));
    assert!(missing.is_err_and(|e| e.is_usage()));
}
