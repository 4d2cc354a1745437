//! The windows of the picture one after the other, each with its events, their numbers and the words of its headline.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::caption::{CaptionWriter, STILL_AWAY};
use super::items::Viewed;
use super::listed::beginning;
use super::marked::{OngoingEvents, WindowChanges, WindowMarks};
use super::shown::{Lengths, ShownRuns, ShownRunsWriter, stable};
use super::state::{Alive, Lifetimes, LivingItems, Now};
use super::{ArrowId, Counts, ItemId, Mark, MemberState, OngoingEvent, Shown, View, ViewOptions};
use crate::base::time::{Span, Stamp};
use crate::graph::{ById, Element, Id};
use crate::mission::event_log::{EventId, Kind, Parts};
use crate::mission::{Mission, Window};

/// A view of the windows one after the other, with the looks of each item and arrow in them, but not yet these. In
/// windows without headlines, only elements whose numbers changed are updated.
pub(crate) fn frames(mission: &Mission, options: &ViewOptions, viewed: &Viewed<'_>) -> View {
    let mut windows = ShownWindows::new(mission, options, viewed);
    let mut writer = CaptionWriter::new(mission, viewed);
    let mut walk = mission.graphs.walk();
    let mut frames = Vec::with_capacity(mission.windows.len());
    let changing = changing(mission);
    for ((at, window), is_changing) in (0..).zip(&mission.windows).zip(changing) {
        walk.next(|what, row| windows.apply(what, row));
        let is_touched = !(windows.items.touched.is_empty() && windows.arrows.touched.is_empty());
        let hides = options.hide.unreachable && is_touched;
        if is_changing || hides || window.span.nanos() != windows.now.span.nanos() {
            windows.change(at, window);
        } else {
            windows.go_on(at);
        }
        let headlines = std::mem::take(&mut windows.changes.marks.headlines);
        let mut frame = Frame {
            partial: window.partial,
            messages: window.messages,
            counts: Counts::of(&headlines),
            headlines,
            ongoing: windows.changes.marks.ongoing.clone(),
            member_lists: windows.member_lists.clone(),
            ..Frame::empty(window.index, window.span)
        };
        writer.write(&mut frame, &windows.changes.after);
        frame.many = many(&frame.caption);
        frames.push(frame);
    }
    join_empty(&mut frames);
    let lengths = Lengths::new(mission.windows.iter().map(|w| w.span));
    View {
        frames,
        items_shown: windows.items.finish(&lengths),
        arrows_shown: windows.arrows.finish(&lengths),
        compares: mission.log.compares,
        ..View::default()
    }
}

/// The most changes of a window that have a glow and a badge: of more, these would no longer say where to look.
const MOST_GLOWING: usize = 5;

/// The events of the phrases that have too many names. If four nodes stop and three start, those that start do without a
/// glow: they are still visible in the next window.
fn many(caption: &[Phrase]) -> Vec<EventId> {
    let mut glowing: Vec<&Phrase> = caption.iter().collect();
    let mut many = Vec::new();
    loop {
        let all: usize = glowing.iter().map(|phrase| phrase.names.len()).sum();
        let next = (0..glowing.len()).max_by_key(|at| {
            let (sign, names) = (glowing[*at].sign, glowing[*at].names.len());
            (sign == '+' && all - names <= MOST_GLOWING, names)
        });
        match next {
            Some(next) if all > MOST_GLOWING => {
                many.extend(glowing.remove(next).events.iter().flatten());
            }
            _ => break,
        }
    }
    many.sort_unstable();
    many
}

/// The most consecutive windows without a message that are separate frames: more would only
/// lengthen an animation in which nothing moves.
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
fn changing(mission: &Mission) -> Vec<bool> {
    let windows = &mission.windows;
    let mut changing = vec![false; windows.len()];
    let events = mission.log.events.iter();
    let times = events.flat_map(|event| [Some(event.time), event.until]);
    let first = mission.elements.topics.iter().map(|topic| topic.seen.first);
    for time in times.chain(first).flatten() {
        let from = windows.partition_point(|w| w.span.end <= time);
        let to = windows.partition_point(|w| w.span.start <= time) + 1;
        changing[from..to.min(windows.len())].fill(true);
    }
    if let Some(first) = changing.first_mut() {
        *first = true;
    }
    changing
}

/// The picture so far, built window by window.
struct ShownWindows<'a> {
    mission: &'a Mission,
    viewed: &'a Viewed<'a>,
    lives: Lifetimes<'a>,
    parts: Parts,
    ongoing: OngoingEvents<'a>,
    /// A beginning before this time is not a change.
    beginning: Option<Stamp>,
    now: Now<'a>,
    changes: WindowChanges,
    member_lists: Vec<Vec<MemberState>>,
    /// The topics that each item sends and no line shows.
    unlined: ById<ItemId, Vec<Arc<str>>>,
    items: ShownSoFar<ItemId>,
    arrows: ShownSoFar<ArrowId>,
}

/// The items, or the arrows: the looks of each so far.
struct ShownSoFar<I> {
    shown: ById<I, ShownRunsWriter>,
    /// The ids of those with other numbers than in the previous window.
    touched: BTreeSet<I>,
}

impl<I: Id> ShownSoFar<I> {
    fn new<T>(all: &ById<I, T>) -> Self {
        Self {
            shown: all.iter().map(|_| ShownRunsWriter::default()).collect(),
            touched: BTreeSet::new(),
        }
    }

    fn finish(self, lengths: &Lengths) -> ById<I, ShownRuns> {
        let all = self.shown.into_iter();
        all.map(|raw| stable(&raw.finish(), lengths)).collect()
    }
}

impl<'a> ShownWindows<'a> {
    fn new(mission: &'a Mission, options: &'a ViewOptions, viewed: &'a Viewed<'a>) -> Self {
        Self {
            mission,
            viewed,
            lives: Lifetimes::new(mission),
            parts: mission.log.all_parts(),
            ongoing: OngoingEvents::new(&mission.log, viewed),
            beginning: beginning(mission),
            now: Now::new(mission, options, viewed),
            changes: WindowChanges::default(),
            member_lists: Vec::new(),
            unlined: ById::like(&viewed.items, Vec::new()),
            items: ShownSoFar::new(&viewed.items),
            arrows: ShownSoFar::new(&viewed.arrows),
        }
    }

    fn apply(&mut self, what: Element, row: Option<crate::graph::Row>) {
        self.now.apply(what, row);
        self.items.touched.extend(self.viewed.item_of(what));
        self.arrows.touched.extend(self.viewed.carriers(what));
    }

    /// Shows a window with headlines, or the first after one with headlines.
    fn change(&mut self, at: u32, window: &Window) {
        let span = window.span;
        let alive = self.lives.during(span);
        let paused = self.lives.paused(span, &alive);
        let (before, after) = (self.lives.before(span.start), self.lives.before(span.end));
        self.now.live(span, alive, paused);
        self.member_lists = member_lists(self.viewed, &before, &after, window.index == 0);
        self.changes = WindowChanges {
            before: LivingItems::of(self.viewed, before),
            after: LivingItems::of(self.viewed, after),
            marks: WindowMarks::new(
                &self.mission.log,
                (&self.parts, self.beginning),
                (span, self.ongoing.at(span)),
                self.viewed,
            ),
        };
        self.items.touched.clear();
        self.arrows.touched.clear();
        let (changes, now) = (&self.changes, &self.now);
        let there = |id| (changes.before.items[id], changes.after.items[id]);
        let items = self.viewed.items.ids();
        let items = items.map(|id| changes.item(now, id, there(id)));
        let items: ById<ItemId, Option<Shown>> = items.collect();
        let mut lined = BTreeSet::new();
        for (id, arrow) in self.viewed.arrows.with_ids() {
            let mut shown = None;
            if let (Some(from), Some(to)) = (&items[arrow.from], &items[arrow.to]) {
                // A node that restarts keeps its arrows, even if it is away when the window ends.
                let is_back = |end: &Shown| matches!(end.mark, Some(Mark::Restarted | Mark::Away));
                let is_kept = is_back(from) || is_back(to);
                let stays = changes.after.arrows[id] || is_kept;
                let there = (changes.before.arrows[id], stays);
                let ends = [from, to].map(|end| Some((end.mark, &end.events[..])));
                if there != (false, false) || self.met(id, span) {
                    shown = changes.arrow(now, id, there, ends);
                }
            }
            for row in shown.iter().flat_map(|shown| &shown.topics) {
                let ends = [arrow.from, arrow.to].into_iter().zip(row.ways);
                let topic = &arrow.topics[row.topic as usize];
                lined.extend(ends.filter_map(|(end, is)| is.then_some((end, topic))));
            }
            self.arrows.shown[id].show(at, shown);
        }
        let mut unlined = ById::like(&items, BTreeSet::new());
        for (publish, topic) in self.viewed.bundles() {
            let sender = self.viewed.item_of_sender(publish);
            if let Some(sender) = sender.filter(|id| !lined.contains(&(*id, topic)))
                && now.one(Element::Publish(publish)).is_some()
            {
                unlined[sender].insert(Arc::clone(topic));
            }
        }
        let unlined = unlined.into_iter();
        self.unlined = unlined.map(|all| all.into_iter().collect()).collect();
        for ((id, shown), unlined) in self.viewed.items.ids().zip(items).zip(&self.unlined) {
            let shown = shown.map(|shown| Shown {
                unlined: unlined.clone(),
                ..shown
            });
            self.items.shown[id].show(at, shown);
        }
    }

    /// Whether an arrow existed in a window, although neither at its beginning nor at its end.
    fn met(&self, id: ArrowId, span: Span) -> bool {
        let elements = &self.mission.elements;
        let whole = |edge: &Element| {
            let (node, topic) = elements.ends(*edge);
            let ends = [node.map(Element::Node), topic.map(Element::Topic)];
            std::iter::once(*edge).chain(ends.into_iter().flatten())
        };
        let meet = |edges: &[Element]| {
            let all: Vec<Element> = edges.iter().flat_map(whole).collect();
            self.lives.meet(&all, span)
        };
        if let Some(pairs) = self.viewed.pairs.get(id) {
            return pairs.iter().any(|(publish, subscribe)| {
                meet(&[Element::Publish(*publish), Element::Subscribe(*subscribe)])
            });
        }
        let mut edges = self.viewed.arrows[id].members.iter();
        edges.any(|edge| meet(std::slice::from_ref(edge)))
    }

    /// Shows a window without headlines after another without: all elements stay present or away as they are.
    fn go_on(&mut self, at: u32) {
        for who in self.member_lists.iter_mut().flatten() {
            *who = match who {
                MemberState::Joined | MemberState::Here => MemberState::Here,
                MemberState::Left | MemberState::Away => MemberState::Away,
            };
        }
        let (changes, now) = (&self.changes, &self.now);
        let (after, stays) = (&changes.after, (true, true));
        for id in std::mem::take(&mut self.items.touched) {
            let shown = after.items[id].then(|| changes.item(now, id, stays));
            let unlined = self.unlined[id].clone();
            let shown = shown.flatten().map(|shown| Shown { unlined, ..shown });
            self.items.shown[id].show(at, shown);
        }
        for id in std::mem::take(&mut self.arrows.touched) {
            let ends = [self.viewed.arrows[id].from, self.viewed.arrows[id].to];
            let is_there = after.arrows[id] && ends.iter().all(|end| after.items[*end]);
            let marks = ends.map(|id| changes.marks.items.get(&id));
            let marks = marks.map(|changed| Some((changed?.mark, &changed?.events[..])));
            let shown = is_there.then(|| changes.arrow(now, id, stays, marks));
            self.arrows.shown[id].show(at, shown.flatten());
        }
    }
}

/// The presence of each member of each fleet, given the elements that exist before and after the window.
fn member_lists(
    viewed: &Viewed<'_>,
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

/// An event of the log that begins in a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Headline {
    /// Its index in the event log.
    pub event: EventId,
    /// The kind of event.
    pub kind: Kind,
    /// The element it is about.
    pub what: Element,
    /// The time of the event.
    pub time: Stamp,
    /// Whether it is the absence of a node that returns only in a later window.
    pub leaves: bool,
}

/// Elements with the same change in a window: `+ planner, costmap start`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Phrase {
    /// `+` for a beginning, `−` for an end, a space for everything else.
    pub sign: char,
    /// The words before the names: `controller subscribes to`.
    pub lead: String,
    /// The names.
    pub names: Vec<String>,
    /// The events of each name: indices in the event log; none for an interruption.
    pub events: Vec<Vec<EventId>>,
    /// The words after the names: `start`.
    pub tail: String,
}

impl Phrase {
    /// The phrase with at most `most` names, the rest counted: `+ planner, costmap, +2 start`.
    fn text(&self, most: usize) -> String {
        let mut names = self.names.iter().take(most).cloned().collect::<Vec<_>>();
        let rest = self.names.len() - names.len();
        if rest > 0 {
            names.push(format!("+{rest}"));
        }
        let sign = match self.sign {
            ' ' => String::new(),
            sign => sign.to_string(),
        };
        let parts = [&sign, &self.lead, &names.join(", "), &self.tail];
        let parts = parts.into_iter().filter(|part| !part.is_empty());
        parts.cloned().collect::<Vec<_>>().join(" ")
    }
}

/// One window of the picture; the items and arrows in it are in [`View::seen`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// The window's index, counted from 0.
    pub index: usize,
    /// Its time.
    pub span: Span,
    /// Whether it is shorter than the others.
    pub partial: bool,
    /// The number of all messages in the window, including those of hidden topics.
    pub messages: u64,
    /// For each namespace that represents several, in the order of [`View::namespaces`], the
    /// presence of each of them.
    pub member_lists: Vec<Vec<MemberState>>,
    /// The events that begin in it, in the order of the event log. Headline, marks and timeline are all made from these.
    pub headlines: Vec<Headline>,
    /// The events of earlier windows that last into it or end in it: they are marked and in the headline, but
    /// counted only where they begin.
    pub ongoing: Vec<OngoingEvent>,
    /// The number of headlines of each kind.
    pub counts: Counts,
    /// The changes in words, the most important first; empty exactly if nothing is marked.
    pub caption: Vec<Phrase>,
    /// The events with a colour, but without glow and badge, because there are too many: sorted indices in the event log.
    pub many: Vec<EventId>,
    /// The long time without messages and changes that it lies in, which is one frame of an animation.
    pub empty: Option<Span>,
    /// The line below: namespace, exact times and consequences of the changes, or the time of the last
    /// change.
    pub note: String,
}

impl Frame {
    /// A window without messages and headlines.
    pub fn empty(index: usize, span: Span) -> Self {
        Self {
            index,
            span,
            ..Self::default()
        }
    }

    /// Whether all of these events are some of [`Frame::many`].
    pub(crate) fn is_one_of_many(&self, events: &[EventId]) -> bool {
        let is_of_many = |event| self.many.binary_search(event).is_ok();
        !events.is_empty() && events.iter().all(is_of_many)
    }

    /// Whether an event or an interruption begins in it, or an event ends.
    pub fn is_changed(&self) -> bool {
        let mut events = self.caption.iter().flat_map(|p| &p.events);
        let is_interrupted = events.any(Vec::is_empty);
        let mut ongoing = self.ongoing.iter();
        is_interrupted || !self.headlines.is_empty() || ongoing.any(|l| l.ended.is_some())
    }

    /// The time that its drawing shows.
    pub fn shown(&self) -> Span {
        self.empty.unwrap_or(self.span)
    }

    /// The events that it reports: the ids of those that begin in it, and of those that last.
    pub fn events(&self) -> impl Iterator<Item = EventId> {
        let ongoing = self.ongoing.iter().map(|l| l.event);
        self.headlines.iter().map(|h| h.event).chain(ongoing)
    }

    /// The caption in at most `most` phrases of three names each, the rest counted: `− a stops; + b starts; +3`.
    pub fn words(&self, most: usize) -> String {
        joined(&self.shortened(most, 3))
    }

    /// The caption with as many names as fit, at most 40 of each kind, and as many phrases as possible; the
    /// shortest form if none fits.
    pub(crate) fn fitting(&self, fits: impl Fn(&[Words]) -> bool) -> Vec<Words> {
        let longest = self.caption.iter().map(|p| p.names.len()).max();
        let longest = longest.unwrap_or(1).min(40);
        let mut best = (0, self.shortened(1, 1));
        // No more phrases fit than their first names alone.
        let first = |phrase: &Phrase| Words {
            sign: None,
            text: phrase.names.first().cloned().unwrap_or_default(),
        };
        let least: Vec<Words> = self.caption.iter().map(first).collect();
        let most = (1..=least.len()).take_while(|phrases| fits(&least[..*phrases]));
        for phrases in (1..=most.count()).rev() {
            for names in (1..=longest).rev() {
                let reported = self.caption.iter().take(phrases);
                let reported: usize = reported.map(|p| p.names.len().min(names)).sum();
                if reported <= best.0 {
                    break;
                }
                let words = self.shortened(phrases, names);
                if fits(&words) {
                    best = (reported, words);
                    break;
                }
            }
        }
        best.1
    }

    fn shortened(&self, phrases: usize, names: usize) -> Vec<Words> {
        let reported = self.caption.iter().take(phrases).map(|phrase| Words {
            sign: match phrase.sign {
                _ if phrase.names.is_empty() => None,
                _ if phrase.tail == STILL_AWAY => Some('−'),
                sign => Some(sign),
            },
            text: phrase.text(names),
        });
        let mut reported: Vec<Words> = reported.collect();
        let rest = self.caption.iter().skip(phrases).map(|p| p.names.len());
        let rest: usize = rest.sum();
        if rest > 0 {
            let text = format!("+{rest}");
            reported.push(Words { sign: None, text });
        }
        reported
    }
}

/// A phrase of a headline as it is written, or the number of those that are not: `+3`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Words {
    /// That of its [`Phrase`], `−` for what is away; none for words that are no change.
    pub sign: Option<char>,
    /// What is written.
    pub text: String,
}

/// What separates the phrases of a headline in one line.
pub(crate) const BETWEEN_PHRASES: &str = "; ";

/// A headline in one line.
pub(crate) fn joined(words: &[Words]) -> String {
    let texts: Vec<&str> = words.iter().map(|words| &*words.text).collect();
    texts.join(BETWEEN_PHRASES)
}

impl Counts {
    /// The number of headlines of each kind.
    pub(crate) fn of<'a>(headlines: impl IntoIterator<Item = &'a Headline>) -> Self {
        Self::sum(headlines.into_iter().map(|h| (h.kind, h.what)))
    }

    /// The same for a box, in which a node that leaves is not back yet.
    pub(crate) fn inside<'a>(headlines: impl IntoIterator<Item = &'a Headline>) -> Self {
        Self::sum(headlines.into_iter().map(|h| {
            let kind = if h.leaves { Kind::Stopped } else { h.kind };
            (kind, h.what)
        }))
    }

    fn sum(all: impl Iterator<Item = (Kind, Element)>) -> Self {
        let mut counts = Self::default();
        for (kind, what) in all {
            let is_topic = what.is_topic();
            *match kind {
                Kind::Started => &mut counts.nodes_added,
                Kind::Stopped => &mut counts.nodes_removed,
                Kind::Restarted => &mut counts.restarted,
                Kind::Silent => &mut counts.silent,
                Kind::Appeared if is_topic => &mut counts.topics_added,
                Kind::Appeared => &mut counts.edges_added,
                Kind::Vanished if is_topic => &mut counts.topics_removed,
                Kind::Vanished => &mut counts.edges_removed,
                Kind::HandedOver => &mut counts.handed_over,
                Kind::Rate => &mut counts.rates,
                Kind::Lifecycle
                | Kind::Type
                | Kind::Qos
                | Kind::Starved
                | Kind::Duplicate
                | Kind::Lost => &mut counts.values,
            } += 1;
        }
        counts
    }

    /// The number of all headlines.
    pub fn total(&self) -> usize {
        self.came() + self.went() + self.changed()
    }

    /// The number of beginnings.
    pub fn came(&self) -> usize {
        self.nodes_added + self.topics_added + self.edges_added
    }

    /// The number of ends.
    pub fn went(&self) -> usize {
        self.nodes_removed + self.topics_removed + self.edges_removed
    }

    /// The number of changes other than beginnings and ends.
    pub fn changed(&self) -> usize {
        self.restarted + self.silent + self.handed_over + self.rates + self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{Grouping, Hide, ItemKind, Mark, Mode, View, view};

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
        let windows = ["/a>/t /b</t", "/a>/t", "/a>/t", "/a>/t /c</t"];
        let want = [
            "/a /b /t /a>/t /t>/b",
            "/a -/b /t /a>/t -/t>/b",
            "/a /t /a>/t",
            "/a +/c /t /a>/t +/t>/c",
        ];
        assert_eq!(seen(&windows, &ViewOptions::default()), want);
    }

    #[test]
    fn a_line_needs_both_of_its_ends_at_one_time() {
        let options = ViewOptions {
            mode: Mode::Nodes,
            is_picture: true,
            ..ViewOptions::default()
        };
        let got = seen(&["/a>/t /x>/t", "/x>/t /b</t"], &options);
        assert_eq!(got[1], "-/a +/b /x +/x>/b");
    }

    #[test]
    fn a_collapsed_namespace_lives_with_its_nodes() {
        let options = ViewOptions {
            collapse: vec!["/n".into()],
            ..ViewOptions::default()
        };
        // The topic that it publishes is already subscribed to, but nothing in it lives.
        let direct = ViewOptions {
            mode: Mode::Nodes,
            is_bundled: true,
            ..options.clone()
        };
        let windows = ["/b</t", "/b</t /n/a>/t /n/c"];
        assert_eq!(seen(&windows, &direct), ["/b", "/b +/n +/n>/b"]);
        // Something in it sends, if only an unknown publisher.
        let windows = ["/n/a /n/c =/n/t@5 /b", "=/n/t@5 /b", "=/n/t@5 /b"];
        assert_eq!(seen(&windows, &options)[1..], ["/b */n", "/b /n"]);
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
        assert_eq!((&topic.steps[..], topic.hz), (&[20.0, 5.0][..], Some(5.0)));
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
        let camera = |hz: u32| format!("/a>/image@10 /a>/image/theora@0 /a>/image/compressed@{hz}");
        let windows = [camera(10), camera(14), camera(40)];
        let windows: Vec<&str> = windows.iter().map(String::as_str).collect();
        let got = seen(&windows, &ViewOptions::default());
        assert_eq!(got[1], "/a ^/image/image_topics ^/a>/image/image_topics");
        assert_eq!(got[2], "/a ^/image/image_topics ^/a>/image/image_topics");
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
    fn more_than_five_changes_have_a_colour_without_a_glow() {
        let of = |windows: &[&str]| {
            let (view, _) = view(&mission(windows), &ViewOptions::default());
            let seen = view.seen(view.frames.len() - 1).items;
            let marks = seen.iter().filter(|shown| shown.mark.is_some());
            (
                marks.clone().count(),
                marks.filter(|shown| shown.badge().is_some()).count(),
            )
        };
        assert_eq!(of(&["/a", "/a /b /c /d /e /f"]), (5, 5));
        assert_eq!(of(&["/a", "/a /b /c /d /e /f /g"]), (6, 0));
        // Those that stop are visible in this window only, so that they keep the glow.
        assert_eq!(of(&["/a /b /c /d", "/e /f /g"]), (7, 4));
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
