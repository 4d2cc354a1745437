//! Property tests of the layout: in any plan, boxes, routes, frames and labels do not overlap.

#[path = "bench/layout/measure.rs"]
mod measure;

use bagreel::internals::base::geometry::{Point, Rect, Size};
use bagreel::internals::layout::{self, Cluster, Layout, Link, Orientation, Outline, Plan, Vertex};
use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::TestRunner;

fn options(orientation: Option<Orientation>) -> layout::LayoutOptions {
    layout::LayoutOptions {
        page: Size::new(1280.0, 560.0),
        orientation,
        ..layout::LayoutOptions::default()
    }
}

fn laid_out(plan: &Plan, orientation: Option<Orientation>) -> Layout {
    layout::lay_out(
        plan,
        &options(orientation),
        layout::engine("layered").unwrap(),
    )
}

fn plans() -> impl Strategy<Value = Plan> {
    let clusters = prop::collection::vec(
        (any::<prop::sample::Index>(), any::<bool>(), 10.0..120.0),
        0..6,
    );
    (1_usize..30, clusters).prop_flat_map(|(n, clusters)| {
        let clusters: Vec<Cluster> = clusters
            .into_iter()
            .enumerate()
            .map(|(at, (parent, nested, w))| Cluster {
                parent: (nested && at > 0).then(|| parent.index(at)),
                title: Size::new(w, 14.0),
                footer: Size::new(w / 2.0, 12.0),
            })
            .collect();
        let count = clusters.len();
        let vertex = (
            20.0..160.0,
            16.0..40.0,
            any::<bool>(),
            prop::option::of(0..count.max(1)),
        );
        let vertices = prop::collection::vec(vertex, n);
        let links = prop::collection::vec((0..n, 0..n, prop::option::of(20.0..60.0)), 0..60);
        (vertices, links).prop_map(move |(vertices, links)| Plan {
            vertices: vertices
                .into_iter()
                .map(|(w, h, round, cluster)| Vertex {
                    size: Size::new(w, h),
                    outline: if round {
                        Outline::Ellipse
                    } else {
                        Outline::Box
                    },
                    cluster: cluster.filter(|&c| c < count),
                })
                .collect(),
            links: links
                .into_iter()
                .map(|(from, to, label)| Link {
                    from,
                    to,
                    label: label.map(|w| Size::new(w, 13.0)),
                    ..Link::default()
                })
                .collect(),
            clusters: clusters.clone(),
            is_labelled: clusters.len() % 2 == 1,
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn nothing_overlaps(plan in plans(), down in any::<bool>()) {
        let orientation = if down { Orientation::TopBottom } else { Orientation::LeftRight };
        let layout = laid_out(&plan, Some(orientation));
        let found = measure::measure(&plan, &layout);
        prop_assert_eq!(found.overlaps, 0, "boxes overlap");
        prop_assert_eq!(found.through, 0, "an edge runs through a foreign box");
        prop_assert_eq!(found.foreign, 0, "a cluster contains foreign boxes");
        prop_assert_eq!(found.label_overlaps, 0, "a label covers a box or a label");
        prop_assert!(!plan.is_labelled || found.crossed == 0, "a line runs through the label of another");
        prop_assert_eq!(layout.orientation, orientation);
        for (link, route) in plan.links.iter().zip(&layout.routes) {
            let end = route.curves.last().unwrap()[2];
            prop_assert!(is_at(&plan, &layout, link.from, route.start), "{route:?} begins elsewhere");
            prop_assert!(is_at(&plan, &layout, link.to, end), "{route:?} ends elsewhere");
        }
    }

    #[test]
    fn frames_are_nested_or_disjoint(plan in plans()) {
        let layout = laid_out(&plan, None);
        for (c, frame) in layout.clusters.iter().enumerate() {
            prop_assert!(frame.w == 0.0 || frame.w >= plan.clusters[c].title.w, "no room for the title");
            for d in c + 1..layout.clusters.len() {
                let (other, inside) = (&layout.clusters[d], is_inside(&plan, d, c));
                if frame.w > 0.0 && other.w > 0.0 {
                    prop_assert_eq!(frame.overlaps(other), inside, "{} and {}", c, d);
                    prop_assert!(!inside || holds(frame, other), "{} leaves {}", d, c);
                }
            }
        }
    }

    #[test]
    fn the_same_plan_gives_the_same_layout(plan in plans()) {
        prop_assert_eq!(laid_out(&plan, None), laid_out(&plan, None));
    }

    #[test]
    fn everything_is_inside_the_page(plan in plans()) {
        let layout = laid_out(&plan, None);
        let page = Rect::new(0.0, 0.0, layout.size.w, layout.size.h);
        for rect in layout.boxes.iter().chain(&layout.clusters) {
            prop_assert!(holds(&page, rect), "{rect:?} leaves {page:?}");
        }
    }

    #[test]
    fn known_boxes_keep_their_positions(plan in plans(), known in prop::collection::vec(any::<bool>(), 30)) {
        let before = laid_out(&plan, None);
        let places: Vec<Option<Rect>> =
            before.boxes.iter().zip(known).map(|(rect, known)| known.then_some(*rect)).collect();
        let after = layout::extend(&plan, &options(None), layout::engine("layered").unwrap(), &places);
        for (rect, place) in after.boxes.iter().zip(&places) {
            let moved = |place: &Rect| (place.x - rect.x).abs() + (place.y - rect.y).abs();
            prop_assert!(place.as_ref().is_none_or(|place| moved(place) < 1e-6));
        }
        prop_assert_eq!(measure::measure(&plan, &after).overlaps, 0);
    }

    #[test]
    fn the_second_engine_does_not_overlap_boxes(plan in plans()) {
        let layout = layout::lay_out(&plan, &options(None), layout::engine("layout-rs").unwrap());
        let found = measure::measure(&plan, &layout);
        prop_assert_eq!((found.overlaps, found.label_overlaps), (0, 0));
    }
}

/// What a sketch says of the drawing with all effort is nearly always true, so this counts over the same graphs in every run.
#[test]
fn only_a_drawing_of_no_use_is_made_without_effort() {
    let mut runner = TestRunner::deterministic();
    let mut wrong = 0;
    for _ in 0..60 {
        let plan = plans().new_tree(&mut runner).unwrap().current();
        let at_least = |least: f64| {
            let options = layout::LayoutOptions {
                least,
                ..options(None)
            };
            layout::lay_out(&plan, &options, layout::engine("layered").unwrap())
        };
        let (best, page) = (at_least(0.0), options(None).page);
        let scale = (page.w / best.size.w).min(page.h / best.size.h);
        wrong += usize::from(at_least(0.75 * scale) != best);
        let sketch = at_least(f64::INFINITY);
        let found = measure::measure(&plan, &sketch);
        let bad = [found.overlaps, found.through, found.foreign];
        assert_eq!((bad, found.label_overlaps), ([0; 3], 0));
        assert_eq!(sketch.boxes.len(), plan.vertices.len());
    }
    assert!(wrong <= 1, "{wrong} of 60 would have been legible");
}

/// Whether one rectangle is inside another, rounding aside.
fn holds(outer: &Rect, inner: &Rect) -> bool {
    let outer = outer.grown(0.01);
    let starts = outer.x <= inner.x && outer.y <= inner.y;
    starts && inner.right() <= outer.right() && inner.bottom() <= outer.bottom()
}

fn is_inside(plan: &Plan, inner: usize, outer: usize) -> bool {
    let mut at = Some(inner);
    while let Some(c) = at.filter(|&c| c != outer) {
        at = plan.clusters[c].parent;
    }
    at.is_some()
}

/// Whether a point is on the outline of a vertex, within a pixel.
fn is_at(plan: &Plan, layout: &Layout, v: usize, p: Point) -> bool {
    let (rect, centre) = (layout.boxes[v], layout.boxes[v].centre());
    let within = |by: f64| {
        let rect = rect.grown(by);
        let (right, down) = ((p.x - centre.x).abs(), (p.y - centre.y).abs());
        let cap = rect.h.min(rect.w) / 2.0;
        let (dx, dy) = (
            (right - rect.w / 2.0 + cap).max(0.0),
            (down - rect.h / 2.0 + cap).max(0.0),
        );
        let (x, y) = (
            (p.x - centre.x) / (rect.w / 2.0),
            (p.y - centre.y) / (rect.h / 2.0),
        );
        match plan.vertices[v].outline {
            Outline::Box => x.abs().max(y.abs()) <= 1.0,
            Outline::Ellipse => x * x + y * y <= 1.0,
            Outline::Capsule => dx * dx + dy * dy <= cap * cap,
        }
    };
    within(1.0) && !within(-1.0)
}

#[test]
fn a_graph_too_large_for_layers_is_still_laid_out() {
    // A chain with every tenth vertex linked back to its start, in namespaces nested ever deeper.
    let n = 2000;
    let vertex = |v| Vertex {
        size: Size::new(60.0, 20.0),
        outline: Outline::Box,
        cluster: Some(v / 4),
    };
    let link = |from, to| Link {
        from,
        to,
        ..Link::default()
    };
    let plan = Plan {
        vertices: (0..n).map(vertex).collect(),
        links: (1..n)
            .map(|v| link(v - 1, v))
            .chain((1..n).step_by(10).map(|v| link(0, v)))
            .collect(),
        clusters: (0..n / 4)
            .map(|c: usize| Cluster {
                parent: c.checked_sub(1),
                title: Size::new(40.0, 14.0),
                footer: Size::default(),
            })
            .collect(),
        is_labelled: false,
    };
    let layout = laid_out(&plan, None);
    assert_eq!(layout.remarks.len(), 1, "{:?}", layout.remarks);
    assert_eq!(measure::measure(&plan, &layout).overlaps, 0);
}

#[test]
fn an_empty_graph_has_no_size() {
    for (word, _) in layout::ENGINES {
        let layout = layout::lay_out(
            &Plan::default(),
            &options(None),
            layout::engine(word).unwrap(),
        );
        assert_eq!(layout.size, Size::default(), "{word}");
    }
}

#[test]
fn an_inconsistent_plan_is_still_laid_out() {
    let odd = Size::new(f64::NAN, f64::INFINITY);
    let vertex = |size, cluster| Vertex {
        size,
        outline: Outline::Ellipse,
        cluster,
    };
    let plan = Plan {
        vertices: vec![
            vertex(odd, Some(7)),
            vertex(Size::new(-3.0, 0.0), Some(1)),
            vertex(Size::default(), None),
        ],
        links: [(0, 1), (1, 9), (2, 2), (0, 0), (1, 0)]
            .map(|(from, to)| Link {
                from,
                to,
                label: Some(odd),
                ..Link::default()
            })
            .to_vec(),
        clusters: vec![
            Cluster {
                parent: Some(1),
                title: odd,
                footer: odd,
            },
            Cluster {
                parent: Some(5),
                title: odd,
                footer: odd,
            },
        ],
        is_labelled: true,
    };
    for (word, _) in layout::ENGINES {
        let page = layout::LayoutOptions {
            page: odd,
            ..layout::LayoutOptions::default()
        };
        let layout = layout::lay_out(&plan, &page, layout::engine(word).unwrap());
        let finite = |r: &Rect| [r.x, r.y, r.w, r.h].iter().all(|x| x.is_finite());
        assert!(
            layout.boxes.iter().chain(&layout.clusters).all(finite),
            "{word}"
        );
        assert_eq!(layout.routes.len(), 5);
        assert!(layout.routes[1].curves.is_empty());
    }
}

#[test]
fn an_unknown_engine_is_a_usage_error_that_lists_the_engines() {
    let error = layout::engine("circo").err().unwrap();
    assert!(
        error.hint().contains("layered, layout-rs"),
        "{}",
        error.hint()
    );
}
