//! What each window shows: states and rates gathered from the graph's elements, and what is new since the window before.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::caption::Speaker;
use super::cast::{Cast, Place};
use super::tally::tally;
use super::{Frame, Item, ItemKind, Mark, Mode, Shown, ViewOptions};
use crate::diff::Change;
use crate::evidence::Degree;
use crate::evolution::Evolution;
use crate::graph::{Element, Elements, Graph, State, TopicId};

/// Items or arrows of one window by id; ghosts are not among them.
type Present = Vec<Option<Shown>>;

/// The windows one after the other.
pub(super) fn frames(evolution: &Evolution, options: &ViewOptions, cast: &Cast) -> Vec<Frame> {
    let speaker = Speaker::new(&evolution.elements, cast);
    let mut before: Option<(Present, Present)> = None;
    let mut frames = Vec::with_capacity(evolution.windows.len());
    for window in &evolution.windows {
        let now = present(&window.graph, options, cast);
        let alone = alone(&window.graph, &evolution.elements);
        let news = News::new(&window.changes, cast, &alone);
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
            tally: tally(cast, &items, &arrows),
            items,
            arrows,
            caption: Vec::new(),
        };
        frame.caption = speaker.caption(&frame, &window.changes);
        frames.push(frame);
    }
    frames
}

/// Gathers what the elements of one window give to an item or arrow.
struct Gather(Present);

impl Gather {
    fn new(size: usize) -> Self {
        Self(vec![None; size])
    }

    /// Takes in an element: the liveliest state and the strongest degree count, rates and counts are summed.
    fn add(&mut self, id: u32, state: State, degree: Degree, hz: Option<f64>, count: Option<u64>) {
        let Some(slot) = self.0.get_mut(id as usize) else {
            return;
        };
        let shown = slot.get_or_insert(Shown {
            id,
            state,
            degree,
            mark: None,
            hz: None,
            from_hz: None,
            count: None,
            lifecycle: None,
        });
        shown.state = shown.state.min(state);
        shown.degree = shown.degree.min(degree);
        shown.hz = sum(shown.hz, hz, |a, b| a + b);
        shown.count = sum(shown.count, count, u64::saturating_add);
    }
}

fn sum<T>(a: Option<T>, b: Option<T>, add: impl Fn(T, T) -> T) -> Option<T> {
    match (a, b) {
        (Some(a), Some(b)) => Some(add(a, b)),
        (a, b) => a.or(b),
    }
}

/// What of the mission one window shows.
fn present(graph: &Graph, options: &ViewOptions, cast: &Cast) -> (Present, Present) {
    let items = present_items(graph, options, cast);
    let active: Vec<bool> = match options.mode {
        Mode::Active => active_topics(graph, cast.topic.len()),
        _ => Vec::new(),
    };
    let shown = |topic: u32| active.is_empty() || active.get(topic as usize) == Some(&true);
    let mut arrows = match options.mode {
        Mode::Nodes => present_direct(graph, cast),
        _ => present_arrows(graph, cast, options.mode, &shown),
    };
    for (slot, arrow) in arrows.iter_mut().zip(&cast.arrows) {
        let there = |id: u32| items.get(id as usize).is_some_and(Option::is_some);
        if !(there(arrow.from) && there(arrow.to)) {
            *slot = None;
        }
    }
    (items, arrows)
}

fn active_topics(graph: &Graph, size: usize) -> Vec<bool> {
    let mut active = vec![false; size.max(1)];
    for topic in graph.topics.iter().filter(|t| t.state == State::Active) {
        if let Some(active) = active.get_mut(topic.id as usize) {
            *active = true;
        }
    }
    active
}

fn present_items(graph: &Graph, options: &ViewOptions, cast: &Cast) -> Present {
    let mut items = Gather::new(cast.items.len());
    let alive = |state| matches!(state, State::Active | State::Latched);
    for node in &graph.nodes {
        let Some(Some(id)) = cast.node.get(node.id as usize) else {
            continue;
        };
        if options.hide.unreachable && !alive(node.state) {
            continue;
        }
        items.add(*id, node.state, node.degree, node.hz, None);
        if let (true, Some(shown)) = (is_single(cast, *id), &mut items.0[*id as usize]) {
            shown.lifecycle = node.lifecycle.as_ref().map(Arc::clone);
        }
    }
    for topic in &graph.topics {
        let Some(Some(id)) = cast.topic.get(topic.id as usize) else {
            continue;
        };
        if options.mode == Mode::Active && topic.state != State::Active {
            continue;
        }
        // The nodes inside a collapsed namespace count what they publish already.
        let item = cast.items.get(*id as usize);
        let hz = topic.hz.filter(|_| !item.is_some_and(has_nodes));
        items.add(*id, topic.state, topic.degree, hz, Some(topic.count));
    }
    items.0
}

fn has_nodes(item: &Item) -> bool {
    matches!(item.members.first(), Some(Element::Node(_)))
}

fn is_single(cast: &Cast, item: u32) -> bool {
    let item = cast.items.get(item as usize);
    item.is_some_and(|i| i.members.len() == 1 && i.kind != ItemKind::Namespace)
}

fn present_arrows(
    graph: &Graph,
    cast: &Cast,
    mode: Mode,
    topic_shown: &impl Fn(u32) -> bool,
) -> Present {
    let mut arrows = Gather::new(cast.arrows.len());
    for edge in &graph.publishes {
        if mode == Mode::Active && edge.state != State::Active {
            continue;
        }
        if let Some(Place::Arrow(id)) = cast.publish.get(edge.id as usize) {
            arrows.add(*id, edge.state, edge.degree, edge.hz, edge.count);
        }
    }
    for edge in &graph.subscribes {
        let topic = cast.subscribed.get(edge.id as usize);
        if let Some(Place::Arrow(id)) = cast.subscribe.get(edge.id as usize)
            && topic.is_some_and(|topic| topic_shown(*topic))
        {
            arrows.add(*id, edge.state, edge.degree, edge.hz, edge.count);
        }
    }
    arrows.0
}

/// Arrows from node to node: there in a window where both the publication and the subscription are, with the rate of
/// the publication, or of the topic where that is not known.
fn present_direct(graph: &Graph, cast: &Cast) -> Present {
    let publishes: BTreeMap<u32, _> = graph.publishes.iter().map(|e| (e.id, e)).collect();
    let subscribes: BTreeMap<u32, _> = graph.subscribes.iter().map(|e| (e.id, e)).collect();
    let topics: BTreeMap<u32, _> = graph.topics.iter().map(|t| (t.id, t)).collect();
    let mut arrows = Gather::new(cast.arrows.len());
    for (pairs, id) in cast.pairs.iter().zip(0..) {
        for (publish, subscribe) in pairs {
            let (Some(p), Some(s)) = (publishes.get(publish), subscribes.get(subscribe)) else {
                continue;
            };
            let topic = cast.subscribed.get(s.id as usize);
            let topic = topic.and_then(|topic| topics.get(topic));
            let hz = p.hz.or_else(|| topic.and_then(|t| t.hz));
            arrows.add(
                id,
                p.state.max(s.state),
                p.degree.max(s.degree),
                hz,
                p.count,
            );
        }
    }
    arrows.0
}

/// What the changes of one window mean for items and arrows that were there before and still are.
struct News {
    items: BTreeMap<u32, (Mark, Option<f64>)>,
    arrows: BTreeMap<u32, (Mark, Option<f64>)>,
}

impl News {
    /// `alone` holds the topics with one publisher, whose own rate the diff does not tell apart from the topic's.
    fn new(changes: &[Change], cast: &Cast, alone: &BTreeSet<TopicId>) -> Self {
        let mut news = Self {
            items: BTreeMap::new(),
            arrows: BTreeMap::new(),
        };
        for change in changes {
            match change {
                Change::Added { what, .. } => news.add(cast, *what, Mark::Added, None),
                Change::Removed { what, .. } => news.add(cast, *what, Mark::Removed, None),
                Change::Rate {
                    what,
                    from_hz,
                    to_hz,
                } => {
                    let faster = to_hz > from_hz;
                    let mark = if faster { Mark::Faster } else { Mark::Slower };
                    news.add(cast, *what, mark, Some(*from_hz));
                    let carried = match what {
                        Element::Topic(topic) => alone.contains(topic),
                        _ => !cast.pairs.is_empty(),
                    };
                    if carried {
                        news.add_carriers(cast, *what, mark, *from_hz);
                    }
                }
                Change::HandedOver { topic, .. } => {
                    news.add(cast, Element::Topic(*topic), Mark::HandedOver, None);
                }
                Change::Restarted { node, .. } => {
                    news.add(cast, Element::Node(*node), Mark::Restarted, None);
                }
                Change::Value { what, .. } => news.add(cast, *what, Mark::Changed, None),
            }
        }
        news
    }

    fn add(&mut self, cast: &Cast, what: Element, mark: Mark, from_hz: Option<f64>) {
        let place = |places: &[Place], id: u32| places.get(id as usize).copied();
        match what {
            Element::Node(id) => self.add_item(cast, cast.node.get(id as usize), mark, from_hz),
            Element::Topic(id) => self.add_item(cast, cast.topic.get(id as usize), mark, from_hz),
            Element::Publish(id) => self.add_edge(cast, place(&cast.publish, id), mark, from_hz),
            Element::Subscribe(id) => {
                self.add_edge(cast, place(&cast.subscribe, id), mark, from_hz);
            }
        }
    }

    fn add_item(
        &mut self,
        cast: &Cast,
        item: Option<&Option<u32>>,
        mark: Mark,
        from_hz: Option<f64>,
    ) {
        if let Some(Some(id)) = item {
            let single = is_single(cast, *id);
            keep(&mut self.items, *id, single, mark, from_hz);
        }
    }

    fn add_edge(&mut self, cast: &Cast, place: Option<Place>, mark: Mark, from_hz: Option<f64>) {
        match place {
            Some(Place::Inside(item)) => keep(&mut self.items, item, false, mark, None),
            Some(Place::Arrow(id)) => {
                let arrow = cast.arrows.get(id as usize);
                let single = arrow.is_some_and(|a| a.members.len() == 1);
                keep(&mut self.arrows, id, single, mark, from_hz);
            }
            Some(Place::Hidden) | None => {}
        }
    }

    /// A change of rate shows on the arrows from the publisher too.
    fn add_carriers(&mut self, cast: &Cast, what: Element, mark: Mark, from_hz: f64) {
        for id in cast.carriers.get(&what).into_iter().flatten() {
            let arrow = cast.arrows.get(*id as usize);
            let single = match cast.pairs.get(*id as usize) {
                Some(pairs) => pairs.len() == 1,
                None => arrow.is_some_and(|a| a.members.len() == 1),
            };
            keep(&mut self.arrows, *id, single, mark, Some(from_hz));
        }
    }
}

/// The topics that have exactly one publisher in a window.
fn alone(graph: &Graph, elements: &Elements) -> BTreeSet<TopicId> {
    let (mut once, mut more) = (BTreeSet::new(), BTreeSet::new());
    for state in &graph.publishes {
        if let Some(edge) = elements.publishes.get(state.id as usize)
            && !once.insert(edge.topic)
        {
            more.insert(edge.topic);
        }
    }
    once.retain(|topic| !more.contains(topic));
    once
}

/// Notes a change; of several on the same thing the more telling one stays. What stands for several elements is marked
/// as changed inside, and a single one that came or went is told by its presence.
fn keep(
    all: &mut BTreeMap<u32, (Mark, Option<f64>)>,
    id: u32,
    single: bool,
    mark: Mark,
    from_hz: Option<f64>,
) {
    let new = match mark {
        Mark::Added | Mark::Removed if single => return,
        _ if single => (mark, from_hz),
        _ => (Mark::Inside, None),
    };
    let old = all.entry(id).or_insert(new);
    if weight(new.0) > weight(old.0) {
        *old = new;
    }
}

fn weight(mark: Mark) -> u8 {
    match mark {
        Mark::HandedOver | Mark::Restarted => 3,
        Mark::Changed => 2,
        Mark::Faster | Mark::Slower => 1,
        Mark::Inside | Mark::Added | Mark::Removed => 0,
    }
}

/// The window's items or arrows with their marks, and the ghosts of what was there in the window before.
fn marked(
    before: &Present,
    now: &Present,
    news: &BTreeMap<u32, (Mark, Option<f64>)>,
) -> Vec<Shown> {
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
        (Some(_), Some(now)) => {
            let news = news.get(&now.id);
            Some(Shown {
                mark: news.map(|(mark, _)| *mark),
                from_hz: news.and_then(|(_, from_hz)| *from_hz),
                ..now.clone()
            })
        }
    };
    before.iter().zip(now).filter_map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::super::testing::evolution;
    use super::super::{Grouping, Hide, Mode, View, ViewOptions, view};
    use super::*;

    /// Each window as text: items and arrows with a sign for their mark, hidden or not there if not named.
    fn seen(windows: &[&str], options: &ViewOptions) -> Vec<String> {
        let (view, _) = view(&evolution(windows), options);
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
        let (view, _) = view(&evolution(&windows), &ViewOptions::default());
        let topic = &view.frames[2].items[2];
        assert_eq!((topic.from_hz, topic.hz), (Some(20.0), Some(5.0)));
        assert_eq!(
            (view.frames[2].tally.rates, view.frames[0].tally),
            (1, super::super::Tally::default())
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
    fn nodes_only_draws_an_arrow_per_topic() {
        let options = ViewOptions {
            mode: Mode::Nodes,
            ..ViewOptions::default()
        };
        let windows = [
            "/a>/t@1 /b</t /a>/u /b</u /c>/u",
            "/a>/t@3 /b</t /c>/u /b</u",
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
            "/n/a>/n/t@2 /n/b</n/t /n/b>/n/out@3 /c</n/out /n>/x /n</n/in",
            "/n/a>/n/t@4 /n/b</n/t /n/b>/n/out@3 /c</n/out /n>/x /n</n/in",
        ];
        let options = ViewOptions {
            collapse: vec!["/n/".into()],
            ..ViewOptions::default()
        };
        let got = seen(&windows, &options);
        assert_eq!(got[0], "/c /n/out /x /n /n/out>/c /n>/n/out /n>/x");
        assert_eq!(got[1], "/c /n/out /x */n /n/out>/c /n>/n/out /n>/x");
        let (view, _) = view(&evolution(&windows), &options);
        let space = view
            .items
            .iter()
            .position(|i| i.kind == ItemKind::Namespace)
            .unwrap();
        assert_eq!(view.frames[0].items[space].hz, Some(5.0));
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
