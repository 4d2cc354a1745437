//! The marks of a window: the events of the event log in it, gathered by item and arrow of the picture.

use std::collections::BTreeMap;

use super::items::{EdgePlace, Viewed};
use super::lasting::Part;
use super::{ArrowId, Headline, ItemId, ItemKind, Lasting, Mark};
use crate::base::time::{Span, Stamp};
use crate::graph::{Element, Id};
use crate::mission::EventLog;
use crate::mission::event_log::{Detail, Event, EventId, Kind, Parts};

/// The changes of an item or arrow in a window.
#[derive(Clone, Debug, Default)]
pub(crate) struct Changed {
    /// Whether a part of it began, or ended.
    pub(crate) came: bool,
    pub(crate) went: bool,
    /// Its mark if it existed before and still does.
    pub(crate) mark: Option<Mark>,
    /// Messages per second before and after.
    pub(crate) rates: Option<(f64, f64)>,
    /// The headlines behind the mark, sorted.
    pub(crate) events: Vec<EventId>,
}

/// The changes of one window by the id of the item or arrow.
#[derive(Default)]
pub(crate) struct WindowMarks {
    pub(crate) headlines: Vec<Headline>,
    pub(crate) lasting: Vec<Lasting>,
    pub(crate) items: BTreeMap<ItemId, Changed>,
    pub(crate) arrows: BTreeMap<ArrowId, Changed>,
}

impl WindowMarks {
    /// The changes of the window `span`, with the events of earlier windows that last. `parts` are the parts
    /// of each headline; they are reported with it, whenever they happened. A start or appearance before
    /// `beginning` is not a change.
    pub(crate) fn new(
        log: &EventLog,
        (parts, beginning): (&Parts, Option<Stamp>),
        (span, lasting): (Span, Vec<Lasting>),
        viewed: &Viewed,
    ) -> Self {
        let mut changed = Self::default();
        for last in &lasting {
            if let Some(event) = log.events.get(last.event) {
                changed.report(viewed, event, last.event, last.part());
            }
        }
        changed.lasting = lasting;
        for (id, event) in log.headlines(span) {
            let is_start = matches!(event.kind, Kind::Started | Kind::Appeared);
            let is_first = is_start && beginning.is_some_and(|end| event.time < end);
            if is_first || !viewed.sees(event.what) {
                continue;
            }
            changed.headlines.push(Headline {
                event: id,
                kind: event.kind,
                what: event.what,
                time: event.time,
            });
            changed.report(viewed, event, id, Part::of(event, span));
            // A return has its own mark.
            let parts = parts.get(&id).filter(|_| event.kind != Kind::Restarted);
            for part in parts.into_iter().flatten() {
                if let Some(part) = log.events.get(*part) {
                    changed.report(viewed, part, id, Part::Whole);
                }
            }
        }
        changed
    }

    fn report(&mut self, viewed: &Viewed, event: &Event, headline: EventId, part: Part) {
        let sign = EventSign::of(event, headline, part);
        self.add(viewed, event.what, &sign);
        match (&event.detail, event.what) {
            (Detail::Senders { from, to }, Element::Topic(topic)) => {
                for node in from.iter().chain(to) {
                    if let Ok(edge) = viewed.published.binary_search(&(*node, topic)) {
                        let edge = Element::Publish(Id::of(edge));
                        self.add_carriers(viewed, edge, &sign);
                    }
                }
            }
            (Detail::Rates { .. }, Element::Publish(edge)) => {
                self.add_carriers(viewed, event.what, &sign);
                let topic = viewed.published.get(edge);
                let topic = topic.map(|(_, topic)| Element::Topic(*topic));
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

    fn add(&mut self, viewed: &Viewed, what: Element, sign: &EventSign) {
        let item = |item: Option<&Option<ItemId>>| item.copied().flatten().map(EdgePlace::Item);
        let place = match what {
            Element::Node(id) => item(viewed.node.get(id)),
            Element::Topic(id) => item(viewed.topic.get(id)),
            Element::Publish(id) => viewed.publish.get(id).copied(),
            Element::Subscribe(id) => viewed.subscribe.get(id).copied(),
        };
        if !viewed.pairs.is_empty() && what.is_edge() {
            self.add_carriers(viewed, what, sign);
        }
        match place {
            Some(EdgePlace::Item(id)) => sign.keep(&mut self.items, id, Reach::of_item(viewed, id)),
            Some(EdgePlace::Inside(id)) => sign.keep(&mut self.items, id, Reach::Inside),
            Some(EdgePlace::Arrow(id)) => {
                sign.keep(&mut self.arrows, id, Reach::of_arrow(viewed, id));
            }
            Some(EdgePlace::Hidden) | None => {}
        }
    }

    /// Marks the arrows that carry a topic or publication.
    fn add_carriers(&mut self, viewed: &Viewed, what: Element, sign: &EventSign) {
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
    fn of_item(viewed: &Viewed, id: ItemId) -> Self {
        match viewed.items.get(id) {
            Some(item) if item.kind == ItemKind::Namespace => Self::Inside,
            Some(item) if item.is_replica => Self::Part,
            // Runs of one node, of which one exists at a time.
            Some(item) if item.kind == ItemKind::Node => Self::Whole,
            Some(item) if item.members.len() > 1 => Self::Part,
            _ => Self::Whole,
        }
    }

    fn of_arrow(viewed: &Viewed, id: ArrowId) -> Self {
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

/// The effect of one event on the item or arrow that it is reported on.
struct EventSign {
    kind: Kind,
    part: Part,
    rates: Option<(f64, f64)>,
    headline: EventId,
}

impl EventSign {
    fn of(event: &Event, headline: EventId, part: Part) -> Self {
        Self {
            kind: event.kind,
            part,
            rates: match event.detail {
                Detail::Rates { from_hz, to_hz } => Some((from_hz, to_hz)),
                _ => None,
            },
            headline,
        }
    }

    /// The mark on an element that existed before and still does.
    fn mark(&self, reach: Reach) -> Option<Mark> {
        let is_faster = self.rates.is_some_and(|(from, to)| to > from);
        match (self.part, reach) {
            (_, Reach::Part | Reach::Inside) | (Part::Whole, _) => {}
            (Part::Leaves, Reach::Whole) => return Some(Mark::Removed),
            (Part::Away, Reach::Whole) => return Some(Mark::Away),
            (Part::Back, Reach::Whole) => return Some(Mark::Restarted),
        }
        match (self.kind, reach) {
            (Kind::Rate, Reach::Whole | Reach::Part) if is_faster => Some(Mark::Faster),
            (Kind::Rate, Reach::Whole | Reach::Part) => Some(Mark::Slower),
            (_, Reach::Part | Reach::Inside) => Some(Mark::Inside),
            (Kind::Restarted, _) => Some(Mark::Restarted),
            (Kind::Silent, _) => Some(Mark::Paused),
            (Kind::HandedOver, _) => Some(Mark::HandedOver),
            (kind, _) if kind.is_remark() => Some(Mark::Changed),
            (Kind::Lifecycle | Kind::Type | Kind::Qos, _) => Some(Mark::Changed),
            _ => None,
        }
    }

    /// Records the event for an item or arrow; of several marks on the same one, the most informative one
    /// stays.
    fn keep<I: Ord>(&self, all: &mut BTreeMap<I, Changed>, id: I, reach: Reach) {
        let reported = all.entry(id).or_default();
        reported.came |= matches!(self.kind, Kind::Started | Kind::Appeared);
        reported.went |= matches!(self.kind, Kind::Stopped | Kind::Vanished);
        if let Err(place) = reported.events.binary_search(&self.headline) {
            reported.events.insert(place, self.headline);
        }
        let mark = self.mark(reach);
        if mark.map(weight) > reported.mark.map(weight) {
            reported.mark = mark;
            reported.rates = self.rates.filter(|_| reach == Reach::Whole);
        }
    }
}

fn weight(mark: Mark) -> u8 {
    match mark {
        Mark::Removed => 5,
        Mark::HandedOver | Mark::Restarted => 4,
        Mark::Paused => 3,
        Mark::Changed => 2,
        Mark::Inside | Mark::Away => 1,
        Mark::Faster | Mark::Slower | Mark::Added | Mark::Gone => 0,
    }
}
