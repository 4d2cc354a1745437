//! The windows one after the other, each with what is new in it since the one before.

use std::collections::BTreeMap;

use super::caption::Speaker;
use super::counts::tally;
use super::items::Viewed;
use super::marks::{MarkedRate, News, alone};
use super::state::{States, present};
use super::{Frame, Mark, Shown, ViewOptions};
use crate::base::words;
use crate::graph::diff::RATE_CHANGE;
use crate::mission::Mission;

/// The windows one after the other.
pub(crate) fn frames(mission: &Mission, options: &ViewOptions, viewed: &Viewed) -> Vec<Frame> {
    let speaker = Speaker::new(&mission.elements, viewed);
    let mut before: Option<(States, States)> = None;
    let mut frames = Vec::with_capacity(mission.windows.len());
    for window in &mission.windows {
        let now = present(&window.graph, options, viewed);
        let alone = alone(&window.graph, &mission.elements);
        let news = News::new(&window.changes, viewed, &alone);
        let (items, arrows) = match &before {
            None => (
                now.0.iter().flatten().cloned().collect(),
                now.1.iter().flatten().cloned().collect(),
            ),
            Some((items, arrows)) => (
                marked(items, &now.0, &news.items),
                marked(arrows, &now.1, &news.arrows),
            ),
        };
        before = Some(now);
        let mut frame = Frame {
            index: window.index,
            span: window.span,
            partial: window.partial,
            messages: window.messages,
            tally: tally(viewed, &items, &arrows),
            items,
            arrows,
            caption: Vec::new(),
        };
        frame.caption = speaker.caption(&frame, &window.changes);
        frames.push(frame);
    }
    frames
}

/// The window's items or arrows with their marks, and the ghosts of what was there in the window before.
fn marked(before: &States, now: &States, news: &BTreeMap<u32, MarkedRate>) -> Vec<Shown> {
    let one = |(before, now): (&Option<Shown>, &Option<Shown>)| match (before, now) {
        (None, None) => None,
        (None, Some(now)) => Some(Shown {
            mark: Some(Mark::Added),
            ..now.clone()
        }),
        (Some(before), None) => Some(Shown {
            mark: Some(Mark::Removed),
            hz: Some(0.0),
            count: Some(0),
            ..before.clone()
        }),
        (Some(before), Some(now)) => {
            let told = match news.get(&now.id) {
                Some((Mark::Faster | Mark::Slower, None)) => summed(before.hz, now.hz),
                news => news.copied(),
            };
            Some(Shown {
                mark: told.map(|(mark, _)| mark),
                from_hz: told.and_then(|(_, from_hz)| from_hz),
                ..now.clone()
            })
        }
    };
    before.iter().zip(now).filter_map(one).collect()
}

/// Whether the rate of several together changed, when the rate of one of them did.
fn summed(from: Option<f64>, to: Option<f64>) -> Option<MarkedRate> {
    let (from, to) = (from?, to?);
    let differs =
        (to - from).abs() > RATE_CHANGE * from && words::number(from) != words::number(to);
    let mark = if to > from {
        Mark::Faster
    } else {
        Mark::Slower
    };
    differs.then_some((mark, Some(from)))
}

#[cfg(test)]
mod tests {
    use super::super::{Grouping, Hide, ItemKind, Mode, View, view};
    use super::*;
    use crate::view::testing::mission;

    /// Each window as text: items and arrows with a sign for their mark, hidden or not there if not named.
    fn seen(windows: &[&str], options: &ViewOptions) -> Vec<String> {
        let (view, _) = view(&mission(windows), options);
        let frames = view.frames.iter();
        frames
            .map(|frame| text(&view, &frame.items, &frame.arrows))
            .collect()
    }

    fn text(view: &View, items: &[Shown], arrows: &[Shown]) -> String {
        let name = |id: u32| view.items[id as usize].name.to_string();
        let items = items.iter().map(|s| format!("{}{}", sign(s), name(s.id)));
        let arrows = arrows.iter().map(|s| {
            let arrow = &view.arrows[s.id as usize];
            format!("{}{}>{}", sign(s), name(arrow.from), name(arrow.to))
        });
        items.chain(arrows).collect::<Vec<_>>().join(" ")
    }

    fn sign(shown: &Shown) -> &'static str {
        match shown.mark {
            None => "",
            Some(Mark::Added) => "+",
            Some(Mark::Removed) => "-",
            Some(Mark::Faster) => "^",
            Some(Mark::Slower) => "v",
            Some(Mark::Inside) => "*",
            Some(_) => "!",
        }
    }

    #[test]
    fn the_first_window_is_the_base_and_ghosts_stay_for_one_window() {
        let windows = ["/a>/t /b</t", "/a>/t", "/a>/t", "/a>/t /b</t"];
        let want = [
            "/a /b /t /a>/t /t>/b",
            "/a -/b /t /a>/t -/t>/b",
            "/a /t /a>/t",
            "/a +/b /t /a>/t +/t>/b",
        ];
        assert_eq!(seen(&windows, &ViewOptions::default()), want);
    }

    #[test]
    fn rates_mark_topics_and_their_arrows() {
        let windows = ["/a>/t@10 /b</t", "/a>/t@20 /b</t", "/a>/t@5 /b</t"];
        let want = [
            "/a /b /t /a>/t /t>/b",
            "/a /b ^/t ^/a>/t /t>/b",
            "/a /b v/t v/a>/t /t>/b",
        ];
        assert_eq!(seen(&windows, &ViewOptions::default()), want);
        let (view, _) = view(&mission(&windows), &ViewOptions::default());
        let topic = &view.frames[2].items[2];
        assert_eq!((topic.from_hz, topic.hz), (Some(20.0), Some(5.0)));
        assert_eq!(
            (view.frames[2].tally.rates, view.frames[0].tally),
            (1, crate::view::Counts::default())
        );
    }

    #[test]
    fn a_group_is_added_with_its_first_member_and_then_changes_inside() {
        let windows = [
            "/a",
            "/a>/tf@1",
            "/a>/tf@1 /a>/tf_static@1",
            "/a>/tf_static@1",
            "/a",
        ];
        let want = [
            "/a",
            "/a +/tf +/a>/tf",
            "/a */tf */a>/tf",
            "/a */tf */a>/tf",
            "/a -/tf -/a>/tf",
        ];
        assert_eq!(seen(&windows, &ViewOptions::default()), want);
    }

    #[test]
    fn the_rate_of_a_group_is_that_of_its_sum() {
        let go = |feedback: u32| {
            let rest = ["goal", "cancel", "result"].map(|t| format!("/a>/go/{t}@0"));
            format!(
                "/a>/go/status@10 /a>/go/feedback@{feedback} {}",
                rest.join(" ")
            )
        };
        let windows = [go(10), go(14), go(40)];
        let windows: Vec<&str> = windows.iter().map(String::as_str).collect();
        let got = seen(&windows, &ViewOptions::default());
        assert_eq!(got[1], "/a /go/action_topics /a>/go/action_topics");
        assert_eq!(got[2], "/a ^/go/action_topics ^/a>/go/action_topics");
        let (view, _) = view(&mission(&windows), &ViewOptions::default());
        assert_eq!(view.frames[2].caption, ["go action 24 → 50 Hz"]);
    }

    #[test]
    fn nodes_only_draws_an_arrow_per_topic() {
        let options = ViewOptions {
            mode: Mode::Nodes,
            ..ViewOptions::default()
        };
        let windows = [
            "/a>/t@10 /b</t /a>/u /b</u /c>/u",
            "/a>/t@30 /b</t /c>/u /b</u",
        ];
        let want = ["/a /b /c /a>/b /a>/b /c>/b", "-/a /b"];
        let got = seen(&windows, &options);
        assert_eq!(got[0], want[0]);
        assert_eq!(got[1], "/a /b /c ^/a>/b -/a>/b /c>/b");
    }

    #[test]
    fn active_shows_only_what_carries_messages() {
        let options = ViewOptions {
            mode: Mode::Active,
            ..ViewOptions::default()
        };
        let windows = ["/a>/t~ /b</t~ /c>/t", "/a>/t~ /b</t~"];
        assert_eq!(seen(&windows, &options)[0], "/a /b /c /t /c>/t /t>/b");
        assert_eq!(seen(&windows, &options)[1], "/a /b -/c -/t -/c>/t -/t>/b");
    }

    #[test]
    fn a_silent_node_is_unreachable_only_if_asked() {
        let hide = Hide {
            unreachable: true,
            ..Hide::default()
        };
        let options = ViewOptions {
            hide,
            ..ViewOptions::default()
        };
        assert_eq!(seen(&["/a~ /b /b>/t"], &options), ["/b /t /b>/t"]);
        assert_eq!(seen(&["/a~ /b"], &ViewOptions::default()), ["/a /b"]);
    }

    #[test]
    fn a_collapsed_namespace_holds_what_does_not_leave_it() {
        let windows = [
            "/n/a>/n/t@20 /n/b</n/t /n/b>/n/out@3 /c</n/out /n>/x /n</n/in",
            "/n/a>/n/t@40 /n/b</n/t /n/b>/n/out@3 /c</n/out /n>/x /n</n/in",
        ];
        let options = ViewOptions {
            collapse: vec!["/n/".into()],
            ..ViewOptions::default()
        };
        let got = seen(&windows, &options);
        assert_eq!(got[0], "/c /n/out /x /n /n/out>/c /n>/n/out /n>/x");
        assert_eq!(got[1], "/c /n/out /x */n /n/out>/c /n>/n/out /n>/x");
        let (view, _) = view(&mission(&windows), &options);
        let space = view
            .items
            .iter()
            .position(|i| i.kind == ItemKind::Namespace)
            .unwrap();
        assert_eq!(view.frames[0].items[space].hz, Some(23.0));
        let open = ViewOptions {
            expand: vec!["/n".into()],
            ..options
        };
        assert_eq!(
            seen(&windows, &open),
            seen(&windows, &ViewOptions::default())
        );
    }

    #[test]
    fn edges_vanish_with_what_is_hidden() {
        let windows = ["/record_1</t /a>/t /a>/rosout /rosout</rosout"];
        assert_eq!(seen(&windows, &ViewOptions::default()), ["/a /t /a>/t"]);
        let all = ViewOptions {
            hide: Hide::NONE,
            ..ViewOptions::default()
        };
        assert!(seen(&windows, &all)[0].contains("/rosout>/rosout"));
        let all = ViewOptions {
            show_recorder: true,
            group: Grouping::NONE,
            ..ViewOptions::default()
        };
        assert!(seen(&windows, &all)[0].contains("/t>/record_1"));
    }
}
