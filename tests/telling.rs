//! Tests that headlines, counts, captions and marks of a window agree in all outputs.

use std::collections::BTreeSet;
use std::path::Path;

use bagreel::internals::mission::event_log::Kind;
use bagreel::internals::pipeline::{Reading, Unwatched, read};
use bagreel::internals::view::{Mark, SeenWindow, Shown, View, ViewOptions, view};

/// The view of an example in windows of this length, or of the default.
fn example(name: &str, period: Option<&str>) -> View {
    let bag = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(name);
    let mut reading = Reading::of([bag]);
    if let Some(period) = period.and_then(bagreel::internals::base::time::Period::parse) {
        reading.division.length = bagreel::internals::graph::window::Length::Fixed(period);
    }
    let mission = read(&reading, &mut Unwatched).unwrap();
    view(&mission, &ViewOptions::default()).0
}

fn all(seen: &SeenWindow) -> impl Iterator<Item = &Shown> {
    seen.items.iter().chain(&seen.arrows)
}

#[test]
fn every_headline_is_counted_captioned_and_marked() {
    let all_examples = [
        ("warehouse.bag", None),
        ("warehouse.bag", Some("10")),
        ("courier.mcap", None),
        ("courier.mcap", Some("3")),
    ];
    for (name, period) in all_examples {
        let view = example(name, period);
        assert!(
            view.frames.iter().any(|f| !f.headlines.is_empty()),
            "{name}"
        );
        for (k, frame) in view.frames.iter().enumerate() {
            let seen = view.seen(k);
            let at = format!("{name}, window {}", frame.index);
            let reported: BTreeSet<_> = frame.headlines.iter().map(|h| h.event).collect();
            assert_eq!(reported.len(), frame.counts.total(), "{at}");
            let reported: BTreeSet<_> = frame.events().collect();
            let phrases = frame.caption.iter();
            let said: BTreeSet<_> = phrases.flat_map(|one| one.events.concat()).collect();
            assert_eq!(reported, said, "{at}");
            let marked = all(&seen).filter(|s| s.mark.is_some());
            let marked: BTreeSet<_> = marked.flat_map(|s| s.events.clone()).collect();
            assert_eq!(marked, reported, "{at}");
            assert!(
                all(&seen).all(|s| s.mark.is_none() || !s.events.is_empty()),
                "{at}"
            );
        }
    }
}

/// A window's picture without marks, clock and numbers.
fn settled(seen: &SeenWindow) -> Vec<String> {
    let stays = all(seen).filter(|s| s.mark != Some(Mark::Removed));
    let look = |s: &Shown| {
        format!(
            "{} {:?} {:?} {:?}",
            s.id, s.state, s.confidence, s.steady_hz
        )
    };
    stays.map(look).collect()
}

#[test]
fn a_window_without_a_headline_looks_like_the_previous_one() {
    let view = example("warehouse.bag", Some("10"));
    let quiet = (1..view.frames.len()).filter(|k| view.frames[*k].caption.is_empty());
    for k in quiet {
        let pair = [view.seen(k - 1), view.seen(k)];
        if !pair.iter().any(|seen| all(seen).any(|s| s.is_paused)) {
            assert_eq!(settled(&pair[0]), settled(&pair[1]), "window {k}");
        }
    }
}

#[test]
fn a_crash_is_drawn_before_during_and_after() {
    let view = example("warehouse.bag", Some("10"));
    let of = |k: usize| {
        let frame = &view.frames[k];
        let name = |s: &&Shown| view.items[s.item()].label.ends_with("/object_detector");
        let seen = view.seen(k);
        let mark = seen.items.iter().find(name).and_then(|s| s.mark);
        (mark, frame.words(usize::MAX), frame.note.clone())
    };
    let said = |mark, words: &str, note: &str| (mark, words.to_owned(), note.to_owned());
    let missed = "arm_controller and grasp_planner get no detections";
    assert_eq!(of(25).0, None);
    let gone = format!("4:26 · {missed}");
    let away = format!("since 4:26 · {missed}");
    assert_eq!(
        of(26),
        said(Some(Mark::Removed), "− object_detector goes away", &gone)
    );
    assert_eq!(
        of(27),
        said(Some(Mark::Away), "object_detector still away", &away)
    );
    let back = "object_detector back after 15.6 s";
    assert_eq!(of(28), said(Some(Mark::Restarted), back, "4:41"));
    // If both ends are in one window, it is a restart there.
    let minutes = example("warehouse.bag", Some("60"));
    let words = minutes.frames[4].words(usize::MAX);
    assert!(
        words.contains("object_detector restarts after 15.6 s"),
        "{words}"
    );
}

#[test]
fn two_senders_are_news_only_of_a_topic_that_changes_hands() {
    let says = |words: &str| {
        let frames = example("warehouse.bag", None).frames;
        frames.iter().filter(|f| f.note.contains(words)).count()
    };
    // `/robot1/cmd_vel` is handed over to `/robot1/dock_controller` later; several nodes send `/robot1/diagnostics`.
    assert_eq!(says("controller and emergency_stop both send"), 1);
    assert_eq!(says("both send"), 1);
}

#[test]
fn an_element_shows_the_rates_of_its_event_instead_of_their_mean() {
    let view = example("warehouse.bag", Some("10"));
    let mut events = 0;
    for (k, frame) in view.frames.iter().enumerate() {
        let seen = view.seen(k);
        for change in frame.headlines.iter().filter(|h| h.kind == Kind::Rate) {
            let own = all(&seen).filter(|s| s.events == [change.event]);
            let rates: Vec<_> = own.map(|s| s.steps.len()).collect();
            events += 1;
            assert!(!rates.is_empty() && !rates.contains(&0), "window {k}");
        }
    }
    assert!(events >= 3, "{events}");
}

#[test]
fn a_node_that_restarts_keeps_its_arrows() {
    let bag = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/warehouse.bag");
    let mut reading = Reading::of([bag]);
    // Away from 4:06 to 4:13, so it is absent at the end of the window from 4:00 to 4:10.
    reading.division.length = bagreel::internals::base::time::Period::parse("10").map_or(
        reading.division.length,
        bagreel::internals::graph::window::Length::Fixed,
    );
    let mission = read(&reading, &mut Unwatched).unwrap();
    let view = view(&mission, &ViewOptions::default()).0;
    let item = |name: &str| {
        let mut items = view.items.with_ids();
        items.find(|(_, i)| &*i.name == name).unwrap().0
    };
    let (lidar, scan) = (item("/robot2/lidar_driver"), item("/robot2/scan"));
    for k in 20..30 {
        let drawn = view.seen(k).arrows.iter().any(|shown| {
            let arrow = &view.arrows[shown.arrow()];
            (arrow.from, arrow.to) == (lidar, scan)
        });
        assert!(drawn, "window {k}");
    }
}
