//! The marks of a window: the events of the event log in it, and those of earlier windows that last, by item and arrow.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::items::{Place, Viewed};
use super::state::{LivingItems, Now};
use super::{
    Arrow, ArrowId, ArrowKind, Counts, Headline, Item, ItemId, ItemKind, Mark, Shown, ShownRuns,
    View,
};
use crate::base::ids::{grouped, tally};
use crate::base::name::{last_part, namespace};
use crate::base::time::{Span, Stamp};
use crate::graph::{ById, Element};
use crate::mission::EventLog;
use crate::mission::event_log::{Detail, Event, EventId, Kind, Parts};
use crate::mission::rates::same;

/// The changes of an item or arrow in a window.
#[derive(Clone, Debug, Default)]
pub(crate) struct Changed {
    /// Whether a part of it began, or ended.
    pub(crate) came: bool,
    pub(crate) went: bool,
    /// Its mark if it existed before and still does.
    pub(crate) mark: Option<Mark>,
    /// Messages per second before, between and after its changes of rates; none without any.
    pub(crate) rates: Vec<f64>,
    /// The headlines behind the mark, sorted.
    pub(crate) events: Vec<EventId>,
}

/// The changes of one window by the id of the item or arrow.
#[derive(Default)]
pub(crate) struct WindowMarks {
    pub(crate) headlines: Vec<Headline>,
    pub(crate) ongoing: Vec<OngoingEvent>,
    pub(crate) items: BTreeMap<ItemId, Changed>,
    pub(crate) arrows: BTreeMap<ArrowId, Changed>,
    /// The parts of the headlines.
    parts: Parts,
}

impl WindowMarks {
    /// The changes of the window `span`, with the events of earlier windows that last. `parts` are the parts
    /// of each headline; they are reported with it, whenever they happened. A start or appearance before
    /// `beginning` is not a change.
    pub(crate) fn new(
        log: &EventLog,
        (parts, beginning): (&Parts, Option<Stamp>),
        (span, ongoing): (Span, Vec<OngoingEvent>),
        viewed: &Viewed<'_>,
    ) -> Self {
        let mut changed = Self::default();
        for last in &ongoing {
            if let Some(event) = log.events.get(last.event) {
                changed.report(viewed, event, last.event, last.part());
            }
        }
        changed.ongoing = ongoing;
        for (id, event) in log.headlines(span) {
            let is_start = matches!(event.kind, Kind::Started | Kind::Appeared);
            let is_first = is_start && beginning.is_some_and(|end| event.time < end);
            if is_first || !viewed.sees(event.what) {
                continue;
            }
            let part = Part::of(event, span);
            changed.headlines.push(Headline {
                event: id,
                kind: event.kind,
                what: event.what,
                time: event.time,
                leaves: part == Part::Leaves,
            });
            changed.report(viewed, event, id, part);
            // A return has its own mark.
            let parts = parts.get(&id).filter(|_| event.kind != Kind::Restarted);
            for part in parts.into_iter().flatten() {
                if let Some(part) = log.events.get(*part) {
                    changed.report(viewed, part, id, Part::Whole);
                }
            }
            changed.parts.extend(parts.map(|parts| (id, parts.clone())));
        }
        changed
    }

    fn report(&mut self, viewed: &Viewed<'_>, event: &Event, headline: EventId, part: Part) {
        let sign = Report {
            event,
            headline,
            part,
        };
        self.add(viewed, event.what, &sign);
        match (&event.detail, event.what) {
            (Detail::Senders { from, to }, Element::Topic(topic)) => {
                for node in from.iter().chain(to) {
                    if let Some(edge) = viewed.elements.published((*node, topic)) {
                        self.add_carriers(viewed, edge, &sign);
                    }
                }
            }
            (Detail::Rates { .. }, Element::Publish(_)) => {
                self.add_carriers(viewed, event.what, &sign);
                let topic = viewed.elements.ends(event.what).1.map(Element::Topic);
                if let Some(topic) = topic.filter(|t| viewed.has_single_sender(*t)) {
                    self.add(viewed, topic, &sign);
                }
            }
            (Detail::Rates { .. }, Element::Topic(_))
                if viewed.has_single_sender(event.what) || !viewed.pairs.is_empty() =>
            {
                self.add_carriers(viewed, event.what, &sign);
            }
            _ => {}
        }
    }

    fn add(&mut self, viewed: &Viewed<'_>, what: Element, sign: &Report<'_>) {
        if !viewed.pairs.is_empty() && what.is_edge() {
            self.add_carriers(viewed, what, sign);
        }
        match viewed.place(what) {
            Place::Item(id) => sign.keep(&mut self.items, id, Reach::of_item(viewed, id)),
            Place::Inside(id) => sign.keep(&mut self.items, id, Reach::Inside),
            Place::Arrow(id) => {
                sign.keep(&mut self.arrows, id, Reach::of_arrow(viewed, id));
            }
            Place::Hidden => {}
        }
    }

    /// Marks the arrows that carry a topic or publication.
    fn add_carriers(&mut self, viewed: &Viewed<'_>, what: Element, sign: &Report<'_>) {
        for id in viewed.carriers(what) {
            sign.keep(&mut self.arrows, *id, Reach::of_arrow(viewed, *id));
        }
    }
}

/// The relation of the element of an event to its box or arrow.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Reach {
    /// It is the only one in it.
    Whole,
    /// One of several that are drawn as one, with their rates summed.
    Part,
    /// Somewhere inside a collapsed namespace.
    Inside,
}

impl Reach {
    fn of_item(viewed: &Viewed<'_>, id: ItemId) -> Self {
        match viewed.items.get(id) {
            Some(item) if item.kind == ItemKind::Namespace => Self::Inside,
            Some(item) if item.is_replica => Self::Part,
            // Runs of one node, of which one exists at a time.
            Some(item) if item.kind == ItemKind::Node => Self::Whole,
            Some(item) if item.members.len() > 1 => Self::Part,
            _ => Self::Whole,
        }
    }

    fn of_arrow(viewed: &Viewed<'_>, id: ArrowId) -> Self {
        let members = viewed.arrows.get(id).map_or(0, |a| a.members.len());
        let is_role = |id: ItemId| {
            let item = viewed.items.get(id);
            item.is_some_and(|i| i.kind == ItemKind::Node && i.members.len() > 1 && !i.is_replica)
        };
        let ends = viewed.arrows.get(id).map(|a| [a.from, a.to]);
        let topics = ends.is_some_and(|ends| ends.into_iter().any(is_role));
        let members = if topics { 1 } else { members };
        let joined = viewed.pairs.get(id).map_or(members, Vec::len);
        if joined > 1 { Self::Part } else { Self::Whole }
    }
}

/// An event, or the part of it that a window shows, on the item or arrow that it is reported on.
struct Report<'a> {
    event: &'a Event,
    headline: EventId,
    part: Part,
}

/// The mark for a part of an event on an element that existed before and still does.
fn mark(event: &Event, part: Part, reach: Reach) -> Option<Mark> {
    let is_faster = matches!(event.detail, Detail::Rates { from_hz, to_hz } if to_hz > from_hz);
    match (event.kind, reach, part) {
        (_, Reach::Whole, Part::Leaves) => Some(Mark::Removed),
        (_, Reach::Whole, Part::Away) => Some(Mark::Away),
        (_, Reach::Whole, Part::Back) => Some(Mark::Restarted),
        (Kind::Rate, Reach::Whole | Reach::Part, _) if is_faster => Some(Mark::Faster),
        (Kind::Rate, Reach::Whole | Reach::Part, _) => Some(Mark::Slower),
        (_, Reach::Part | Reach::Inside, _) => Some(Mark::Inside),
        (Kind::Restarted, ..) => Some(Mark::Restarted),
        (Kind::Silent, ..) => Some(Mark::Paused),
        (Kind::HandedOver, ..) => Some(Mark::HandedOver),
        (kind, ..) if kind.is_remark() => Some(Mark::Changed),
        (Kind::Lifecycle | Kind::Type | Kind::Qos, ..) => Some(Mark::Changed),
        _ => None,
    }
}

impl Report<'_> {
    /// Records the event for an item or arrow; of several marks on the same one, the most informative one
    /// stays.
    fn keep<I: Ord>(&self, all: &mut BTreeMap<I, Changed>, id: I, reach: Reach) {
        let reported = all.entry(id).or_default();
        reported.came |= matches!(self.event.kind, Kind::Started | Kind::Appeared);
        reported.went |= matches!(self.event.kind, Kind::Stopped | Kind::Vanished);
        if let Err(place) = reported.events.binary_search(&self.headline) {
            reported.events.insert(place, self.headline);
        }
        if reach == Reach::Whole {
            then(&mut reported.rates, self.event);
        }
        let mark = mark(self.event, self.part, reach);
        if mark.map(weight) > reported.mark.map(weight) {
            reported.mark = mark;
        }
    }
}

/// Adds the rates before and after a change of rates to those of the changes before it, unless it is one of these on another
/// edge.
fn then(rates: &mut Vec<f64>, event: &Event) {
    let Detail::Rates { from_hz, to_hz } = event.detail else {
        return;
    };
    if rates.is_empty() {
        rates.push(from_hz);
    }
    if rates.last().is_some_and(|last| !same(*last, to_hz)) {
        rates.push(to_hz);
    }
}

fn weight(mark: Mark) -> u8 {
    match mark {
        Mark::Removed => 5,
        Mark::HandedOver | Mark::Restarted => 4,
        Mark::Paused => 3,
        Mark::Changed => 2,
        Mark::Inside | Mark::Away => 1,
        Mark::Faster | Mark::Slower | Mark::Added => 0,
    }
}

/// The items and arrows that exist before and after a window, and the changes in between.
#[derive(Default)]
pub(crate) struct WindowChanges {
    pub(crate) before: LivingItems,
    pub(crate) after: LivingItems,
    pub(crate) marks: WindowMarks,
}

/// The mark of an end of an arrow, and the events behind it.
pub(crate) type EndMark<'a> = (Option<Mark>, &'a [EventId]);

impl WindowChanges {
    /// The look of an item; `there` is whether it exists before and after.
    pub(crate) fn item(&self, now: &Now<'_>, id: ItemId, there: (bool, bool)) -> Option<Shown> {
        let mut shown = marked(now.item(id)?, there, self.marks.items.get(&id))?;
        if shown.mark == Some(Mark::HandedOver) {
            shown.sender = shown.events.iter().rev().find_map(|id| {
                let Detail::Senders { to, .. } = &now.event(*id)?.detail else {
                    return None;
                };
                let node = now.viewed.elements.nodes.get(*to.last()?)?;
                Some(last_part(node.name.as_str()).into())
            });
        }
        if now.viewed.items[id].kind == ItemKind::Namespace {
            shown.inside = self.inside(&shown);
        }
        Some(shown)
    }

    /// The look of an arrow, which appears and vanishes with its ends, unless it has events of its own.
    pub(crate) fn arrow(
        &self,
        now: &Now<'_>,
        id: ArrowId,
        there: (bool, bool),
        ends: [Option<EndMark<'_>>; 2],
    ) -> Option<Shown> {
        let arrow = now.viewed.arrows.get(id)?;
        let shown = now.arrow(id)?;
        let reported = self.marks.arrows.get(&id).cloned();
        let reported = reported.or_else(|| with_ends(there, ends));
        let mut shown = marked(shown, there, reported.as_ref())?;
        if arrow.kind == ArrowKind::Bundle {
            shown.inside = self.inside(&shown);
            self.mark_topics(now, arrow, &mut shown);
        }
        Some(shown)
    }

    /// Marks the topics of a bundle, unless it appeared or vanished as a whole.
    fn mark_topics(&self, now: &Now<'_>, arrow: &Arrow, shown: &mut Shown) {
        if shown.mark.is_none_or(|mark| mark.class() != "changed") {
            return;
        }
        let id = ArrowId(shown.id);
        // The number on a line is that of the event, also of one that is a consequence.
        let parts = |id: &EventId| self.marks.parts.get(id).into_iter().flatten();
        let own = shown.events.iter();
        let own = own.flat_map(|id| std::iter::once(id).chain(parts(id)));
        let events = grouped(own.filter_map(|id| {
            let event = now.event(*id)?;
            let topic = now.viewed.elements.ends(event.what).1?;
            Some((&now.viewed.bundled[topic], event))
        }));
        let alive = [&self.before, &self.after].map(|items| items.topics(now.viewed, id));
        for row in &mut shown.topics {
            let there = alive.each_ref().map(|all| all.contains(&row.topic));
            match there {
                [false, true] => row.mark = Some(Mark::Added),
                [true, false] => row.mark = Some(Mark::Removed),
                _ => {
                    let own = events.get(&arrow.topics[row.topic as usize]);
                    for event in own.into_iter().flatten() {
                        let mark = mark(event, Part::Whole, Reach::Whole);
                        row.mark = mark.or(Some(Mark::Changed));
                        then(&mut row.steps, event);
                    }
                }
            }
        }
    }

    /// The number of headlines reported on a collapsed namespace or a bundle; `None` without any.
    fn inside(&self, shown: &Shown) -> Option<Box<Counts>> {
        let all = &self.marks.headlines;
        let reported = shown.events.iter();
        let reported = reported.filter_map(|id| all.binary_search_by_key(id, |h| h.event).ok());
        let counts = Counts::inside(reported.map(|at| &all[at]));
        (counts.total() > 0).then(|| Box::new(counts))
    }
}

/// The changes of an arrow that follow from the marks of its ends and their events; `there` is whether it
/// exists before and after.
fn with_ends(there: (bool, bool), ends: [Option<EndMark<'_>>; 2]) -> Option<Changed> {
    let marks: &[Mark] = match there {
        // A node may return with other lines.
        (false, true) => &[Mark::Added, Mark::Restarted],
        (_, false) => &[Mark::Removed, Mark::Restarted],
        // Lines stay, dotted, while one of their ends is away.
        (true, true) => &[Mark::Removed, Mark::Away],
    };
    let of = |mark: Option<Mark>| mark.filter(|mark| marks.contains(mark));
    let mut ends = ends.into_iter().flatten();
    let (mark, events) = ends.find_map(|(mark, all)| Some((of(mark)?, all)))?;
    Some(Changed {
        came: there == (false, true),
        went: !there.1 || mark == Mark::Removed,
        mark: Some(mark).filter(|_| there == (true, true)),
        events: events.to_vec(),
        ..Changed::default()
    })
}

/// The look of an item or arrow that exists before, after, or both; `None` for one that ended without an
/// event.
fn marked(shown: Shown, there: (bool, bool), reported: Option<&Changed>) -> Option<Shown> {
    let Some(reported) = reported else {
        return there.1.then_some(shown);
    };
    let mark = match there {
        (false, true) if reported.came => Some(Mark::Added),
        (_, false) if reported.went => Some(Mark::Removed),
        // It ended and began within one window.
        (true, true) if reported.came && reported.went => reported.mark.or(Some(Mark::Restarted)),
        // One of several that are drawn as one.
        (true, true) if reported.came || reported.went => reported.mark.or(Some(Mark::Inside)),
        _ => reported.mark,
    };
    Some(Shown {
        mark,
        steps: reported.rates.clone(),
        events: reported.events.clone(),
        ..shown
    })
}

/// An event of an earlier window that lasts into this one or ends in it: a node is away, or an element is
/// back.
///
/// A silence without evidence of an absence is only listed where it ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OngoingEvent {
    /// Its index in the event log.
    pub event: EventId,
    /// The element it is about.
    pub what: Element,
    /// Its beginning.
    pub since: Stamp,
    /// Its end, if it lies in this window.
    pub ended: Option<Stamp>,
}

/// The part of an event that a window shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// All of it that is drawn.
    Whole,
    /// A node leaves and returns in a later window.
    Leaves,
    /// A node is away during the whole window.
    Away,
    /// A node or topic is back.
    Back,
}

impl Part {
    /// The part of an event that lies in the window in which it begins.
    pub(crate) fn of(event: &Event, window: Span) -> Self {
        let leaves = event.kind == Kind::Restarted && event.until.is_some_and(|t| t >= window.end);
        if leaves { Self::Leaves } else { Self::Whole }
    }
}

impl OngoingEvent {
    pub(crate) fn part(&self) -> Part {
        if self.ended.is_some() {
            Part::Back
        } else {
            Part::Away
        }
    }
}

/// The events that last, from window to window.
pub(crate) struct OngoingEvents<'a> {
    /// Those with an end, in the order of their beginnings.
    all: Vec<(EventId, &'a Event)>,
    /// The first of them that begins in or after the present window.
    next: usize,
    /// The indices of those that began before it and do not end before it.
    open: Vec<usize>,
}

impl<'a> OngoingEvents<'a> {
    pub(crate) fn new(log: &'a EventLog, viewed: &Viewed<'_>) -> Self {
        let lasts = |event: &Event| {
            event.until.is_some_and(|until| until > event.time)
                && event.is_headline()
                && viewed.sees(event.what)
        };
        let all = log.events.with_ids().filter(|(_, event)| lasts(event));
        Self {
            all: all.collect(),
            next: 0,
            open: Vec::new(),
        }
    }

    /// Those that last into a window or end in it. Windows are in the order of their starts.
    pub(crate) fn at(&mut self, window: Span) -> Vec<OngoingEvent> {
        let begun = |at: usize| self.all.get(at).is_some_and(|e| e.1.time < window.start);
        while begun(self.next) {
            self.open.push(self.next);
            self.next += 1;
        }
        let all = &self.all;
        let end = |at: usize| all[at].1.until.unwrap_or(window.start);
        self.open.retain(|at| end(*at) >= window.start);
        let ongoing = self.open.iter().filter_map(|at| {
            let (id, event) = all[*at];
            let ended = Some(end(*at)).filter(|end| *end < window.end);
            let is_reported = ended.is_some() || event.kind == Kind::Restarted;
            is_reported.then_some(OngoingEvent {
                event: id,
                what: event.what,
                since: event.time,
                ended,
            })
        });
        ongoing.collect()
    }
}

// The news of a window: the elements that change in it, and their direct partners, without everything else.

/// The part of a view that changes in one of its windows.
pub(crate) struct News {
    /// The view, with that window alone.
    pub(crate) view: View,
    /// The namespace that most names are in, and relative to which they are written; none for the root.
    pub(crate) home: Option<String>,
    /// The number of items of the window that are left out.
    pub(crate) left_out: usize,
}

impl View {
    /// The items and arrows that change in window `k`, with the items at the other ends of these arrows, and of those
    /// from and to an item that changes. `None` past the last window, and if nothing with a box changes.
    pub(crate) fn news(&self, k: usize) -> Option<News> {
        let frame = self.frames.get(k)?;
        let is_new = |looks: &ShownRuns| looks.at(k).is_some_and(|shown| shown.mark.is_some());
        let changes: ById<ItemId, bool> = self.items_shown.iter().map(is_new).collect();
        let (mut kept, mut lined) = (changes.clone(), ById::like(&self.arrows, false));
        for ((id, arrow), looks) in self.arrows.with_ids().zip(&self.arrows_shown) {
            let is_part = is_new(looks) || changes[arrow.from] || changes[arrow.to];
            if is_part && looks.at(k).is_some() {
                (kept[arrow.from], kept[arrow.to], lined[id]) = (true, true, true);
            }
        }
        let items = self.items.with_ids().filter(|(id, _)| kept[*id]);
        let names: Vec<&str> = items.map(|(_, item)| &*item.name).collect();
        if names.is_empty() {
            return None;
        }
        let home = home(&names);
        let items = self.items.iter();
        let alone = |looks: &ShownRuns| ShownRuns::of([self.seen_at(looks, k).as_ref()]);
        let there = self.items_shown.iter();
        let there = there.filter(|looks| looks.at(k).is_some());
        let left_out = there.count() - names.len();
        let mut view = Self {
            items: items.map(|item| relative(item, home.as_deref())).collect(),
            arrows: self.arrows.clone(),
            items_shown: self.items_shown.iter().map(alone).collect(),
            arrows_shown: self.arrows_shown.iter().map(alone).collect(),
            frames: vec![frame.clone()],
            ..Self::default()
        };
        view.keep_arrows(&lined);
        view.keep_items(&kept);
        Some(News {
            view,
            home,
            left_out,
        })
    }

    /// The view with the rates that changed, but no others, for narrow drawings.
    pub(crate) fn without_rates(&self) -> Self {
        let unrated = |looks: &ShownRuns| {
            let each = (0..self.frames.len()).map(|k| {
                let mut shown = looks.at(k)?.clone();
                (shown.hz, shown.held, shown.count) = (None, None, None);
                for row in &mut shown.topics {
                    (row.hz, row.count) = (None, None);
                }
                Some(shown)
            });
            let each: Vec<Option<Shown>> = each.collect();
            ShownRuns::of(each.iter().map(Option::as_ref))
        };
        Self {
            items_shown: self.items_shown.iter().map(unrated).collect(),
            arrows_shown: self.arrows_shown.iter().map(unrated).collect(),
            ..self.clone()
        }
    }
}

/// The namespace of most of these names; none if it is the root, or that of one of them.
fn home(names: &[&str]) -> Option<String> {
    let mut spaces = tally(names.iter().map(|name| namespace(name)));
    spaces.retain(|space, many| *space != "/" && *many > 1);
    let most = spaces
        .into_iter()
        .max_by_key(|(space, many)| (*many, std::cmp::Reverse(*space)));
    most.map(|(space, _)| space.to_owned())
}

/// The item outside of all frames, with its name relative to `home`.
fn relative(item: &Item, home: Option<&str>) -> Item {
    let inside = home.and_then(|home| item.label.strip_prefix(home)?.strip_prefix('/'));
    Item {
        label: inside.map_or_else(|| Arc::clone(&item.label), Arc::from),
        cluster: None,
        ..item.clone()
    }
}
