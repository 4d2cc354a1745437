//! The windows one after the other, each with the headlines of the event log in it.

use super::bundles::beginning;
use super::caption::CaptionWriter;
use super::items::Viewed;
use super::lasting::LastingEvents;
use super::lives::{Alive, ItemTurns};
use super::looks::{Looks, LooksWriter};
use super::marks::WindowMarks;
use super::stable::{Lengths, stable};
use super::state::{LivingItems, Now};
use super::turn::{WindowTurn, marked, with_ends};
use super::{ArrowId, Counts, Frame, ItemId, MemberState, Shown, ViewOptions};
use crate::base::time::{Span, Stamp};
use crate::graph::{ById, Element, Id};
use crate::mission::event_log::Parts;
use crate::mission::{Mission, Window};

/// The windows, and the looks of each item and arrow in them.
#[derive(Default)]
pub(crate) struct Frames {
    pub(crate) list: Vec<Frame>,
    pub(crate) items: ById<ItemId, Looks>,
    pub(crate) arrows: ById<ArrowId, Looks>,
}

/// The windows one after the other. In windows without headlines, only elements whose numbers changed are
/// updated.
pub(crate) fn frames(mission: &Mission, options: &ViewOptions, viewed: &Viewed) -> Frames {
    let mut windows = ShownWindows::new(mission, options, viewed);
    let mut writer = CaptionWriter::new(mission, viewed);
    let mut walk = mission.graphs.walk();
    let mut list = Vec::with_capacity(mission.windows.len());
    let turns = turns(mission);
    for ((at, window), has_turn) in (0..).zip(&mission.windows).zip(turns) {
        walk.next(|what, row| windows.apply(what, row));
        let hides = windows.now.hides_the_silent() && windows.is_touched();
        if has_turn || hides || windows.now.is_other_length(window.span) {
            windows.turn(at, window);
        } else {
            windows.go_on(at);
        }
        let headlines = std::mem::take(&mut windows.turn.changed.headlines);
        let mut frame = Frame {
            partial: window.partial,
            messages: window.messages,
            counts: Counts::of(&headlines),
            headlines,
            lasting: windows.turn.changed.lasting.clone(),
            member_lists: windows.member_lists.clone(),
            ..Frame::empty(window.index, window.span)
        };
        writer.write(&mut frame);
        list.push(frame);
    }
    join_empty(&mut list);
    let lengths = Lengths::new(mission.windows.iter().map(|w| w.span));
    Frames {
        list,
        items: windows.items.finish(&lengths),
        arrows: windows.arrows.finish(&lengths),
    }
}

/// The most consecutive windows without a message that are separate frames.
const MOST_EMPTY: usize = 10;

/// Marks each long run of windows without messages and changes as one time.
fn join_empty(frames: &mut [Frame]) {
    let is_empty = |frame: &Frame| frame.messages == 0 && !frame.is_changed();
    for run in frames.chunk_by_mut(|a, b| is_empty(a) && is_empty(b)) {
        let (Some(first), Some(last)) = (run.first(), run.last()) else {
            continue;
        };
        let (start, end) = (first.span.start, last.span.end);
        if run.len() > MOST_EMPTY {
            for frame in run {
                frame.empty = Some(Span::new(start, end));
            }
        }
    }
}

/// For each window, whether it is the first, contains the first message of a topic, or an event of the log
/// begins or ends in it or in the previous one; in all others nothing changes.
fn turns(mission: &Mission) -> Vec<bool> {
    let windows = &mission.windows;
    let mut turns = vec![false; windows.len()];
    let events = mission.log.events.iter();
    let times = events.flat_map(|event| [Some(event.time), event.until]);
    let first = mission.elements.topics.iter().map(|topic| topic.seen.first);
    for time in times.chain(first).flatten() {
        let from = windows.partition_point(|w| w.span.end <= time);
        let to = windows.partition_point(|w| w.span.start <= time) + 1;
        for turn in turns.iter_mut().take(to).skip(from) {
            *turn = true;
        }
    }
    if let Some(first) = turns.first_mut() {
        *first = true;
    }
    turns
}

/// The picture so far, built window by window.
struct ShownWindows<'a> {
    mission: &'a Mission,
    viewed: &'a Viewed,
    lives: ItemTurns<'a>,
    parts: Parts,
    lasting: LastingEvents<'a>,
    /// A beginning before this time is not a change.
    beginning: Option<Stamp>,
    now: Now<'a>,
    turn: WindowTurn,
    member_lists: Vec<Vec<MemberState>>,
    items: LooksSoFar<ItemId>,
    arrows: LooksSoFar<ArrowId>,
}

/// The items, or the arrows: the looks of each so far.
#[derive(Default)]
struct LooksSoFar<I> {
    shown: ById<I, LooksWriter>,
    /// The ids of those with other numbers than in the previous window.
    touched: Vec<I>,
    is_touched: ById<I, bool>,
}

impl<I: Id> LooksSoFar<I> {
    fn new<T>(all: &ById<I, T>) -> Self {
        Self {
            shown: all.iter().map(|_| LooksWriter::default()).collect(),
            touched: Vec::new(),
            is_touched: ById::like(all, false),
        }
    }

    fn touch(&mut self, id: I) {
        if let Some(is_touched) = self.is_touched.get_mut(id)
            && !std::mem::replace(is_touched, true)
        {
            self.touched.push(id);
        }
    }

    fn take_touched(&mut self) -> Vec<I> {
        let all = std::mem::take(&mut self.touched);
        for id in &all {
            self.is_touched[*id] = false;
        }
        all
    }

    fn show(&mut self, window: u32, id: I, shown: Option<Shown>) {
        if let Some(writer) = self.shown.get_mut(id) {
            writer.show(window, shown);
        }
    }

    fn finish(self, lengths: &Lengths) -> ById<I, Looks> {
        let all = self.shown.into_iter();
        all.map(|raw| stable(&raw.finish(), lengths)).collect()
    }
}

impl<'a> ShownWindows<'a> {
    fn new(mission: &'a Mission, options: &'a ViewOptions, viewed: &'a Viewed) -> Self {
        Self {
            mission,
            viewed,
            lives: ItemTurns::new(mission),
            parts: mission.log.all_parts(),
            lasting: LastingEvents::new(&mission.log, viewed),
            beginning: beginning(mission),
            now: Now::new(mission, options, viewed),
            turn: WindowTurn::default(),
            member_lists: Vec::new(),
            items: LooksSoFar::new(&viewed.items),
            arrows: LooksSoFar::new(&viewed.arrows),
        }
    }

    fn apply(&mut self, what: Element, row: Option<crate::graph::Row>) {
        self.now.apply(what, row);
        let (item, arrows) = self.now.shown_by(what);
        if let Some(item) = item {
            self.items.touch(item);
        }
        for arrow in arrows {
            self.arrows.touch(*arrow);
        }
    }

    fn is_touched(&self) -> bool {
        !(self.items.touched.is_empty() && self.arrows.touched.is_empty())
    }

    /// Shows a window with headlines, or the first after one with headlines.
    fn turn(&mut self, at: u32, window: &Window) {
        let span = window.span;
        let alive = self.lives.during(span);
        let paused = self.lives.paused(span, &alive);
        let (before, after) = (self.lives.before(span.start), self.lives.before(span.end));
        self.now.live(span, alive, paused);
        self.turn = WindowTurn {
            before: LivingItems::of(self.viewed, &before),
            after: LivingItems::of(self.viewed, &after),
            changed: WindowMarks::new(
                &self.mission.log,
                (&self.parts, self.beginning),
                (span, self.lasting.at(span)),
                self.viewed,
            ),
        };
        self.member_lists = member_lists(self.viewed, &before, &after, window.index == 0);
        self.items.take_touched();
        self.arrows.take_touched();
        let items = self.turn.items(self.viewed, &self.now);
        for id in self.viewed.arrows.ids() {
            let shown = self.turn.arrow(self.viewed, &self.now, &items, id);
            self.arrows.show(at, id, shown);
        }
        for (id, shown) in self.viewed.items.ids().zip(items) {
            self.items.show(at, id, shown.marked);
        }
    }

    /// Shows a window without headlines after another without: all elements stay present or away as they are.
    fn go_on(&mut self, at: u32) {
        for who in self.member_lists.iter_mut().flatten() {
            *who = match who {
                MemberState::Joined | MemberState::Here => MemberState::Here,
                MemberState::Left | MemberState::Away => MemberState::Away,
            };
        }
        for id in self.items.take_touched() {
            let is_there = self.turn.after.items[id];
            let shown = is_there.then(|| self.now.item(id)).flatten();
            let reported = self.turn.changed.items.get(&id);
            let shown = shown.and_then(|shown| marked(shown, (true, true), reported));
            self.items.show(at, id, shown);
        }
        for id in self.arrows.take_touched() {
            let arrow = &self.viewed.arrows[id];
            let is_item = |id: ItemId| self.turn.after.items[id];
            let ends = is_item(arrow.from) && is_item(arrow.to);
            let is_there = ends && self.turn.after.arrows[id];
            let shown = is_there.then(|| self.now.arrow(id)).flatten();
            let shown = shown.and_then(|shown| {
                let changed = &self.turn.changed;
                let ends = [arrow.from, arrow.to].map(|id| changed.items.get(&id));
                let ends = ends
                    .map(|reported| reported.map(|reported| (reported.mark, &reported.events[..])));
                let reported = changed.arrows.get(&id).cloned();
                let reported = reported.or_else(|| with_ends((true, true), ends));
                marked(shown, (true, true), reported.as_ref())
            });
            self.arrows.show(at, id, shown);
        }
    }
}

/// The presence of each member of each fleet, given the elements that exist before and after the window.
fn member_lists(
    viewed: &Viewed,
    before: &Alive,
    after: &Alive,
    is_first: bool,
) -> Vec<Vec<MemberState>> {
    let state = |elements: &Vec<Element>| {
        let is = |alive: &Alive| elements.iter().any(|e| alive.is(*e));
        match (is(before), is(after)) {
            (false, true) if is_first => MemberState::Here,
            (false, true) => MemberState::Joined,
            (true, true) => MemberState::Here,
            (true, false) => MemberState::Left,
            (false, false) => MemberState::Away,
        }
    };
    let fleets = viewed.fleets.all.iter();
    fleets
        .map(|fleet| fleet.elements.iter().map(state).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Grouping, Hide, ItemKind, Mark, Mode, View, view};
    use super::*;
    use crate::view::testing::mission;

    /// Each window as text: items and arrows with a sign for their mark; hidden and absent ones are not
    /// listed.
    fn seen(windows: &[&str], options: &ViewOptions) -> Vec<String> {
        let (view, _) = view(&mission(windows), options);
        let seen = (0..view.frames.len()).map(|k| view.seen(k));
        seen.map(|seen| text(&view, &seen.items, &seen.arrows))
            .collect()
    }

    fn text(view: &View, items: &[Shown], arrows: &[Shown]) -> String {
        let name = |id: ItemId| view.items[id].name.to_string();
        let items = items
            .iter()
            .map(|s| format!("{}{}", sign(s), name(s.item())));
        let arrows = arrows.iter().map(|s| {
            let arrow = &view.arrows[s.arrow()];
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
        let topic = &view.seen(2).items[2];
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
    fn a_group_has_the_rate_of_its_members() {
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
    fn silent_nodes_are_unreachable_only_on_request() {
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
    fn a_collapsed_namespace_contains_its_internal_topics() {
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
        assert_eq!(view.seen(0).items[space].hz, Some(23.0));
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
    fn a_sole_publisher_carries_the_rate_of_its_topic() {
        let hz = |window: &str| {
            let (view, _) = view(&mission(&[window]), &ViewOptions::default());
            let seen = view.seen(0).arrows;
            seen.iter().map(|arrow| arrow.hz).collect::<Vec<_>>()
        };
        assert_eq!(hz("=/t@63 /a>/t"), [Some(63.0)]);
        assert_eq!(hz("=/t@63 /a>/t /b>/t"), [None, None]);
        assert_eq!(hz("=/t@63 /a>/t@60 /b>/t"), [Some(60.0), None]);
    }

    #[test]
    fn edges_of_hidden_elements_are_hidden() {
        let windows = ["/record_1</t /a>/t /a>/rosout /rosout</rosout"];
        assert_eq!(seen(&windows, &ViewOptions::default()), ["/a /t /a>/t"]);
        let all = ViewOptions {
            hide: Hide::NONE,
            ..ViewOptions::default()
        };
        assert!(seen(&windows, &all)[0].contains("/rosout>/rosout"));
        let all = ViewOptions {
            hide: Hide::NONE,
            group: Grouping::NONE,
            ..ViewOptions::default()
        };
        assert!(seen(&windows, &all)[0].contains("/t>/record_1"));
    }
}
