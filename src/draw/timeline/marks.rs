//! The marks of rows: events of the log on the rows of their elements. Only events of the log are marked, and every
//! headline of an element that has a row is marked there.

use std::collections::{BTreeMap, BTreeSet};

use super::FigureSource;
use super::rows::{Row, relative};
use crate::base::name::last_part;
use crate::base::time::Stamp;
use crate::base::words::{self, worded};
use crate::graph::{Element, NodeId};
use crate::mission::EventId;
use crate::mission::event_log::{Detail, Event, Kind, Parts, predicate, sentence};

/// The most letters, and the most arrows: more crowd the rows. Other events are marked by a small circle.
const MOST: (usize, usize) = (10, 6);

worded! {
    /// The sign of a mark.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) enum Sign {
        /// A tick: it began.
        Start = "start",
        /// A cross: it ended.
        End = "end",
        /// A small circle: anything else.
        Dot = "event",
        /// A letter, explained below the rows. Without space for words, a small circle.
        Letter = "letter",
        /// An arrow from another row: it takes over a topic. Without space for words, a small circle.
        Handover = "handover",
    }
}

impl Sign {
    /// The sign of an event of this kind without space for words.
    pub(super) fn of(kind: Kind) -> Self {
        match kind {
            Kind::Started | Kind::Appeared => Self::Start,
            Kind::Stopped | Kind::Vanished => Self::End,
            _ => Self::Dot,
        }
    }
}

/// A mark on a row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RowMark {
    pub(crate) at: Stamp,
    pub(crate) sign: Sign,
    /// The events that it shows.
    pub(crate) events: Vec<EventId>,
    /// The log's sentence about them.
    pub(crate) title: String,
    /// The words of a letter, after its time: `planner: plan 1 → 0.2 Hz`; of an arrow, the last part of the topic.
    pub(crate) text: String,
    /// The node from which the topic of an arrow is taken over.
    pub(crate) from: Option<NodeId>,
}

impl RowMark {
    pub(super) fn is_turn(&self) -> bool {
        matches!(self.sign, Sign::Start | Sign::End)
    }

    /// The mark of an event; `parts` are those of all events.
    pub(super) fn new(
        source: &FigureSource<'_>,
        parts: &Parts,
        (id, event): (EventId, &Event),
        sign: Sign,
    ) -> Self {
        Self {
            at: event.time,
            sign,
            events: vec![id],
            title: sentence(source.mission, parts, id, event),
            text: String::new(),
            from: None,
        }
    }
}

/// The rows with the marks of their events.
pub(crate) fn marked(source: &FigureSource<'_>, mut rows: Vec<Row>) -> Vec<Row> {
    let places = Places::new(&rows);
    let parts = source.mission.log.all_parts();
    let mut arrows = 0;
    // Events that get a letter if they are important enough.
    let mut others: Vec<(usize, RowMark, &Event)> = Vec::new();
    for (id, event) in source.mission.log.events.with_ids() {
        if event.quiet {
            continue;
        }
        let mark = |sign| RowMark::new(source, &parts, (id, event), sign);
        if let [Some((from, _)), Some((_, to))] = places.hands(source, event)
            && arrows < MOST.1
            && places.nodes(from) != Some(to)
        {
            arrows += 1;
            let topic = source.mission.elements.ends(event.what).1;
            let text = topic.map_or("", |id| last_part(source.topic(id)));
            rows[to].marks.push(RowMark {
                text: text.to_owned(),
                from: Some(from),
                ..mark(Sign::Handover)
            });
            continue;
        }
        let Some(row) = places.of(source, event) else {
            continue;
        };
        let is_row = places.0.contains_key(&event.what);
        let is_edge = matches!(event.kind, Kind::Appeared | Kind::Vanished) && !is_row;
        match Sign::of(event.kind) {
            Sign::Dot if event.kind == Kind::Restarted => {
                let at = event.until.unwrap_or(event.time);
                let back = mark(Sign::Start);
                let turns = [mark(Sign::End), RowMark { at, ..back }];
                rows[row].marks.extend(turns);
                others.push((row, mark(Sign::Letter), event));
            }
            sign if sign == Sign::Dot || is_edge => others.push((row, mark(Sign::Dot), event)),
            sign => rows[row].marks.push(mark(sign)),
        }
    }
    letter(source, &mut rows, others);
    rows
}

/// Gives letters to the most important events other than ticks and crosses; a restart without a letter has its cross
/// and tick.
fn letter(source: &FigureSource<'_>, rows: &mut [Row], others: Vec<(usize, RowMark, &Event)>) {
    let whole = source.span().nanos().max(1) as f64;
    // A circle suffices for a connection: labels for all of them would fill the page.
    let has_words = |e: &Event| !matches!(e.kind, Kind::Appeared | Kind::Vanished);
    let weight = |at: &usize| weight(others[*at].2, whole);
    let lettered = (0..others.len()).filter(|at| has_words(others[*at].2));
    let mut lettered: Vec<usize> = lettered.collect();
    lettered.sort_by(|a, b| weight(b).total_cmp(&weight(a)).then(a.cmp(b)));
    lettered.truncate(MOST.0);
    for (at, (row, mut mark, event)) in others.into_iter().enumerate() {
        if lettered.contains(&at) {
            mark.sign = Sign::Letter;
            mark.text = text(source, event, &rows[row]);
        } else if mark.sign == Sign::Letter {
            continue;
        }
        rows[row].marks.push(mark);
    }
}

impl Row {
    /// The same with small circles instead of letters and arrows, for rows without space for words.
    pub(crate) fn plain(mut self) -> Self {
        let turns: BTreeSet<EventId> = self.turns().flat_map(|mark| mark.events.clone()).collect();
        let is_restart = |mark: &RowMark| mark.events.iter().any(|id| turns.contains(id));
        self.marks
            .retain(|mark| mark.sign != Sign::Letter || !is_restart(mark));
        for mark in &mut self.marks {
            if matches!(mark.sign, Sign::Letter | Sign::Handover) {
                mark.sign = Sign::Dot;
            }
        }
        self
    }

    /// The ticks and crosses.
    pub(super) fn turns(&self) -> impl Iterator<Item = &RowMark> {
        self.marks.iter().filter(|mark| mark.is_turn())
    }

    /// Whether it ends for good: its last tick or cross is a cross.
    pub(crate) fn is_ending(&self) -> bool {
        let last = self.turns().max_by_key(|s| (s.at, s.sign == Sign::Start));
        last.is_some_and(|s| s.sign == Sign::End)
    }
}

/// The weight of an event by which it gets a letter; `whole` is the length of the mission in nanoseconds.
fn weight(event: &Event, whole: f64) -> f64 {
    let lasts = event
        .until
        .map_or(0.0, |until| until.since(event.time) as f64 / whole);
    match (&event.detail, event.kind) {
        (Detail::Rates { from_hz, to_hz }, _) => libm::fabs(libm::log2(to_hz / from_hz)) / 2.0,
        (_, Kind::HandedOver) => 3.0,
        (_, Kind::Restarted) => 2.0 + lasts,
        (_, Kind::Silent) => 1.0 + lasts,
        _ => 0.5,
    }
}

/// The text of a letter, with the name as short as the row allows, and the log's words.
fn text(source: &FigureSource<'_>, event: &Event, row: &Row) -> String {
    let said = predicate(source.mission, &[], event);
    let (node, topic) = source.mission.elements.ends(event.what);
    let name = words::visible(last_part(&row.name)).into_owned();
    let topic = topic.filter(|topic| row.topic != Some(*topic));
    match topic.map(|topic| relative(source.topic(topic), &row.name)) {
        Some(topic) => format!("{name}: {} {said}", words::visible(topic)),
        None if node.is_some() && row.topic.is_some() => {
            let node = node.and_then(|id| source.mission.elements.nodes.get(id));
            let node = node.map_or("", |n| last_part(n.name.as_str()));
            format!("{name}: {} {said}", words::visible(node))
        }
        None => format!("{name} {said}"),
    }
}

/// The rows of nodes and topics.
struct Places(BTreeMap<Element, usize>);

impl Places {
    fn new(rows: &[Row]) -> Self {
        let places = rows.iter().enumerate().flat_map(|(at, row)| {
            let nodes = row.nodes.iter().map(|id| Element::Node(*id));
            let all = nodes.chain(row.topic.map(Element::Topic));
            all.map(move |what| (what, at))
        });
        Self(places.collect())
    }

    fn nodes(&self, id: NodeId) -> Option<usize> {
        self.0.get(&Element::Node(id)).copied()
    }

    /// The nodes from which and to which a topic is handed over, with their rows.
    fn hands(&self, source: &FigureSource<'_>, event: &Event) -> [Option<(NodeId, usize)>; 2] {
        let topic = source.mission.elements.ends(event.what).1;
        let is_shown = topic.is_some_and(|topic| source.shows(topic));
        let (Detail::Senders { from, to }, true) = (&event.detail, is_shown) else {
            return [None; 2];
        };
        [from, to].map(|nodes| nodes.iter().find_map(|id| Some((*id, self.nodes(*id)?))))
    }

    /// The row on which an event is marked: that of its element; for an edge, that of its node or topic; for
    /// a topic among nodes, that of a sender. A part of another event is only marked if it is a row that
    /// begins or ends.
    fn of(&self, source: &FigureSource<'_>, event: &Event) -> Option<usize> {
        let (node, topic) = source.mission.elements.ends(event.what);
        if topic.is_some_and(|id| !source.shows(id)) {
            return None;
        }
        let is_turn = matches!(event.kind, Kind::Appeared | Kind::Vanished);
        if event.part_of.is_some() {
            let is_own = matches!(event.what, Element::Topic(_)) && is_turn;
            return self.0.get(&event.what).filter(|_| is_own).copied();
        }
        let own = topic.and_then(|id| self.0.get(&Element::Topic(id)).copied());
        let own = own.or_else(|| self.nodes(node?));
        if own.is_some() || is_turn {
            return own;
        }
        let senders = topic.map_or(&[][..], |id| source.mission.sending.of_topic(id));
        let sender = || senders.iter().find_map(|s| self.nodes(s.node?));
        let [from, to] = self.hands(source, event);
        from.or(to).map(|(_, row)| row).or_else(sender)
    }
}
