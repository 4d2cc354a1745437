//! The windows one after the other, each with what the ledger tells in it.

use super::caption::Speaker;
use super::items::Viewed;
use super::lives::{Alive, ItemTurns};
use super::marks::{News, Told};
use super::settle::settle;
use super::state::{LivingItems, States, present};
use super::{ArrowKind, Attendance, Counts, Frame, ItemKind, Mark, Shown, ViewOptions};
use crate::graph::Element;
use crate::mission::Mission;

/// The windows one after the other.
pub(crate) fn frames(mission: &Mission, options: &ViewOptions, viewed: &Viewed) -> Vec<Frame> {
    let speaker = Speaker::new(mission, viewed);
    let lives = ItemTurns::new(mission);
    let parts = mission.ledger.all_parts();
    let mut frames = Vec::with_capacity(mission.windows.len());
    for (window, graph) in mission.each() {
        let span = window.span;
        let alive = lives.during(span);
        let paused = lives.paused(span, &alive);
        let now = present(&graph, options, viewed, (&alive, &paused));
        let (before, after) = (lives.before(span.start), lives.before(span.end));
        let turn = WindowTurn {
            before: LivingItems::of(viewed, &before),
            after: LivingItems::of(viewed, &after),
            news: News::new(&mission.ledger, &parts, span, viewed),
        };
        let items = turn.items(viewed, now.0);
        let arrows = turn.arrows(viewed, now.1, &items);
        frames.push(Frame {
            index: window.index,
            span,
            partial: window.partial,
            messages: window.messages,
            counts: Counts::of(&turn.news.headlines),
            caption: speaker.caption(&turn.news.headlines),
            headlines: turn.news.headlines,
            rolls: rolls(viewed, &before, &after, window.index == 0),
            items,
            arrows,
        });
    }
    settle(&mut frames, viewed.items.len(), |frame| &mut frame.items);
    settle(&mut frames, viewed.arrows.len(), |frame| &mut frame.arrows);
    frames
}

/// Who of each fleet is there, given who lives before and after the window.
fn rolls(viewed: &Viewed, before: &Alive, after: &Alive, is_first: bool) -> Vec<Vec<Attendance>> {
    let lives = |alive: &Alive, element: &Element| {
        let (list, id) = match element {
            Element::Node(id) => (&alive.nodes, *id),
            Element::Topic(id) => (&alive.topics, *id),
            Element::Publish(_) | Element::Subscribe(_) => return false,
        };
        list.get(id as usize) == Some(&true)
    };
    let attendance = |elements: &Vec<Element>| {
        let is = |alive: &Alive| elements.iter().any(|e| lives(alive, e));
        match (is(before), is(after)) {
            (false, true) if is_first => Attendance::Here,
            (false, true) => Attendance::Joined,
            (true, true) => Attendance::Here,
            (true, false) => Attendance::Left,
            (false, false) => Attendance::Away,
        }
    };
    let fleets = viewed.fleets.all.iter();
    fleets
        .map(|fleet| fleet.elements.iter().map(attendance).collect())
        .collect()
}

/// What is there before and after a window, and what is told in between.
struct WindowTurn {
    before: LivingItems,
    after: LivingItems,
    news: News,
}

impl WindowTurn {
    fn items(&self, viewed: &Viewed, now: States) -> Vec<Shown> {
        let mut items = Vec::new();
        for shown in now.into_iter().flatten() {
            let at = shown.id as usize;
            let there = (self.before.items[at], self.after.items[at]);
            let told = self.news.items.get(&shown.id);
            if let Some(mut shown) = marked(shown, there, told) {
                let is_folded = viewed.items[at].kind == ItemKind::Namespace;
                shown.inside = is_folded.then(|| self.inside(&shown)).flatten();
                items.push(shown);
            }
        }
        items
    }

    /// An arrow comes and goes with its ends, if nothing is told of itself.
    fn arrows(&self, viewed: &Viewed, now: States, items: &[Shown]) -> Vec<Shown> {
        let end = |id: u32| {
            let at = items.binary_search_by_key(&id, |s| s.id).ok()?;
            items.get(at)
        };
        let mut arrows = Vec::new();
        for shown in now.into_iter().flatten() {
            let at = shown.id as usize;
            let told = self.news.arrows.get(&shown.id).cloned();
            let arrow = &viewed.arrows[at];
            let (Some(from), Some(to)) = (end(arrow.from), end(arrow.to)) else {
                continue;
            };
            // A node that restarts keeps its arrows, though it is away when the window ends.
            let is_back = [from, to]
                .iter()
                .any(|end| end.mark == Some(Mark::Restarted));
            let there = (self.before.arrows[at], self.after.arrows[at] || is_back);
            let told = told.or_else(|| with_ends(there, [from, to]));
            let shown = marked(shown, there, told.as_ref()).map(|shown| Shown {
                inside: (arrow.kind == ArrowKind::Bundle)
                    .then(|| self.inside(&shown))
                    .flatten(),
                ..shown
            });
            arrows.extend(shown);
        }
        arrows
    }

    /// What the headlines that are told on a folded namespace or a bundle count.
    fn inside(&self, shown: &Shown) -> Option<Box<Counts>> {
        let told = self.news.headlines.iter();
        let counts = Counts::of(told.filter(|h| shown.entries.binary_search(&h.entry).is_ok()));
        (counts.total() > 0).then(|| Box::new(counts))
    }
}

/// What the ends of an arrow tell of it, which was there before, is there after, or both.
fn with_ends(there: (bool, bool), ends: [&Shown; 2]) -> Option<Told> {
    let mark = match there {
        (false, true) => Mark::Added,
        (_, false) => Mark::Removed,
        (true, true) => return None,
    };
    let end = ends.into_iter().find(|end| end.mark == Some(mark))?;
    Some(Told {
        came: mark == Mark::Added,
        went: mark == Mark::Removed,
        entries: end.entries.clone(),
        ..Told::default()
    })
}

/// What is shown of something that was there before, is there after, or both; `None` for what went without a word.
fn marked(shown: Shown, there: (bool, bool), told: Option<&Told>) -> Option<Shown> {
    let Some(told) = told else {
        return there.1.then_some(shown);
    };
    let mark = match there {
        (false, true) if told.came => Some(Mark::Added),
        (_, false) if told.went => Some(Mark::Removed),
        // It ended and began within one window.
        (true, true) if told.came && told.went => told.mark.or(Some(Mark::Restarted)),
        // One of several that are drawn as one.
        (true, true) if told.came || told.went => told.mark.or(Some(Mark::Inside)),
        _ => told.mark,
    };
    let is_gone = mark == Some(Mark::Removed);
    Some(Shown {
        mark,
        hz: if is_gone { Some(0.0) } else { shown.hz },
        rates: told
            .rates
            .filter(|_| matches!(mark, Some(Mark::Faster | Mark::Slower))),
        entries: told.entries.clone(),
        ..shown
    })
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
        assert_eq!((topic.rates, topic.hz), (Some((20.0, 5.0)), Some(5.0)));
        assert_eq!(
            (view.frames[2].counts.rates, view.frames[0].counts),
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
    fn a_group_tells_the_rate_of_its_members() {
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
        assert_eq!(got[1], "/a ^/go/action_topics ^/a>/go/action_topics");
        assert_eq!(got[2], "/a ^/go/action_topics ^/a>/go/action_topics");
        let (view, _) = view(&mission(&windows), &ViewOptions::default());
        assert_eq!(view.frames[2].counts.rates, 1);
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
        // What falls silent goes without a sign: nothing in the ledger says that it ended.
        assert_eq!(seen(&windows, &options)[1], "/a /b -/c");
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
