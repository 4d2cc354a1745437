//! The marks of a figure: events of the log on the rows of their elements. Only events of the log are marked,
//! and every headline of an element that has a row is marked there.

use std::collections::{BTreeMap, BTreeSet};

use super::source::FigureSource;
use super::tracks::Track;
use crate::base::name::{last_part, namespace};
use crate::base::time::Stamp;
use crate::base::words;
use crate::graph::{Element, NodeId, TopicId};
use crate::mission::EventId;
use crate::mission::event_log::{Detail, Event, Kind};
use crate::mission::events::predicate;

/// The most letters, and the most arrows: more crowd the rows. Other events are marked by a small circle.
const MOST: (usize, usize) = (10, 6);

/// The sign of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sign {
    /// A tick: it began.
    Start,
    /// A cross: it ended.
    End,
    /// A small circle: anything else.
    Dot,
}

/// A mark on a row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RowMark {
    /// The row: an index into the tracks.
    pub(crate) track: usize,
    pub(crate) at: Stamp,
    pub(crate) sign: Sign,
    pub(crate) event: EventId,
}

impl RowMark {
    /// The same on the row of its track; `None` if it has no row.
    pub(crate) fn on(&self, row: impl Fn(usize) -> Option<usize>) -> Option<Self> {
        let track = row(self.track)?;
        Some(Self {
            track,
            ..self.clone()
        })
    }
}

/// An event with a letter, explained below the rows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Letter {
    pub(crate) mark: RowMark,
    /// Its text, after its time: `planner: plan 1 → 0.2 Hz`.
    pub(crate) text: String,
}

/// A topic that another row publishes from a time on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Handover {
    pub(crate) at: Stamp,
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// The topic's last part.
    pub(crate) topic: String,
    pub(crate) event: EventId,
}

impl Handover {
    /// The same between the rows of its tracks; `None` if they have none, or share one.
    pub(crate) fn on(&self, row: impl Fn(usize) -> Option<usize>) -> Option<Self> {
        let (from, to) = (row(self.from)?, row(self.to)?);
        (from != to).then(|| Self {
            from,
            to,
            ..self.clone()
        })
    }
}

/// All marks of some rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Marks {
    /// Ticks, crosses and small circles, in order of the log.
    pub(crate) signs: Vec<RowMark>,
    /// Letters, in order of time.
    pub(crate) letters: Vec<Letter>,
    pub(crate) handovers: Vec<Handover>,
    /// The number of small circles that would have a letter or an arrow if there were fewer.
    pub(crate) unlettered: usize,
}

impl Marks {
    /// The marks of these rows: nodes, or topics.
    pub(crate) fn new(source: &FigureSource<'_>, tracks: &[Track]) -> Self {
        let rows = Rows::new(tracks);
        let mut marks = Self::default();
        let mut circles: Vec<RowMark> = Vec::new();
        for (id, event) in source.mission.log.events.with_ids() {
            if event.quiet {
                continue;
            }
            let mark = |track, at, sign| RowMark {
                track,
                at,
                sign,
                event: id,
            };
            if let (Some(from), Some(to)) = rows.hands(source, event)
                && marks.handovers.len() < MOST.1
                && from != to
            {
                marks.handovers.push(Handover {
                    at: event.time,
                    from,
                    to,
                    topic: last_part(source.name(event.what)).to_owned(),
                    event: id,
                });
                continue;
            }
            if let Some(track) = rows.of(source, event) {
                match event.kind {
                    Kind::Started => marks.signs.push(mark(track, event.time, Sign::Start)),
                    Kind::Stopped => marks.signs.push(mark(track, event.time, Sign::End)),
                    Kind::Appeared if rows.is_row(event.what) => {
                        marks.signs.push(mark(track, event.time, Sign::Start));
                    }
                    Kind::Vanished if rows.is_row(event.what) => {
                        marks.signs.push(mark(track, event.time, Sign::End));
                    }
                    Kind::Restarted => {
                        let back = event.until.unwrap_or(event.time);
                        marks.signs.push(mark(track, event.time, Sign::End));
                        marks.signs.push(mark(track, back, Sign::Start));
                        circles.push(mark(track, event.time, Sign::Dot));
                    }
                    _ => circles.push(mark(track, event.time, Sign::Dot)),
                }
            }
        }
        marks.letter(source, tracks, circles);
        marks
    }

    /// Gives letters to the most important events other than ticks and crosses, in order of time; a restart
    /// without a letter has its cross and tick.
    fn letter(&mut self, source: &FigureSource<'_>, tracks: &[Track], circles: Vec<RowMark>) {
        let events = &source.mission.log.events;
        let whole = source.span().nanos().max(1) as f64;
        let weight = |mark: &RowMark| events.get(mark.event).map_or(0.0, |e| weight(e, whole));
        let mut order: Vec<usize> = (0..circles.len()).collect();
        order.sort_by(|a, b| {
            weight(&circles[*b])
                .total_cmp(&weight(&circles[*a]))
                .then(a.cmp(b))
        });
        // A circle suffices for a connection: labels for all of them would fill the page.
        let has_words = |e: &Event| !matches!(e.kind, Kind::Appeared | Kind::Vanished);
        let is_lettered = |at: &usize| events.get(circles[*at].event).is_some_and(has_words);
        let lettered = order.into_iter().filter(is_lettered).take(MOST.0);
        let lettered: BTreeSet<usize> = lettered.collect();
        for (at, mark) in circles.into_iter().enumerate() {
            let Some(event) = events.get(mark.event) else {
                continue;
            };
            if lettered.contains(&at) {
                let text = text(source, event, &tracks[mark.track]);
                self.letters.push(Letter { mark, text });
            } else {
                self.unlettered += usize::from(has_words(event));
                if event.kind != Kind::Restarted {
                    self.signs.push(mark);
                }
            }
        }
        self.letters
            .sort_by_key(|l| (l.mark.at, l.mark.track, l.mark.event));
    }

    /// The same with small circles instead of letters, and without arrows: for rows without space for words.
    pub(crate) fn plain(mut self) -> Self {
        let letters = std::mem::take(&mut self.letters).into_iter();
        let is_restart = |mark: &RowMark| self.signs.iter().any(|s| s.event == mark.event);
        let dots: Vec<RowMark> = letters.map(|l| l.mark).filter(|m| !is_restart(m)).collect();
        self.signs.extend(dots);
        for hand in std::mem::take(&mut self.handovers) {
            self.signs.push(RowMark {
                track: hand.to,
                at: hand.at,
                sign: Sign::Dot,
                event: hand.event,
            });
        }
        self.unlettered = 0;
        self
    }

    /// The events marked on some rows, sorted.
    pub(crate) fn events(&self, tracks: &[usize]) -> Vec<EventId> {
        let signs = self.signs.iter().map(|s| (s.track, s.event));
        let letters = self.letters.iter().map(|l| (l.mark.track, l.mark.event));
        let hands = self.handovers.iter();
        let hands = hands.flat_map(|h| [(h.from, h.event), (h.to, h.event)]);
        let all = signs.chain(letters).chain(hands);
        let own = all.filter(|(track, _)| tracks.contains(track));
        let own: BTreeSet<EventId> = own.map(|(_, event)| event).collect();
        own.into_iter().collect()
    }

    /// The rows with any mark other than ticks, which collapsed rows can also have.
    pub(crate) fn marked(&self) -> BTreeSet<usize> {
        let letters = self.letters.iter().map(|l| l.mark.track);
        let hands = self.handovers.iter().flat_map(|h| [h.from, h.to]);
        let signs = self.signs.iter().filter(|s| s.sign != Sign::Start);
        let signs = signs.map(|s| s.track);
        letters.chain(hands).chain(signs).collect()
    }

    /// Whether a row ends for good: its last tick or cross is a cross.
    pub(crate) fn ends(&self, track: usize) -> bool {
        let own = self.signs.iter().filter(|s| s.track == track);
        let turns = own.filter(|s| s.sign != Sign::Dot);
        let last = turns.max_by_key(|s| (s.at, s.sign == Sign::Start));
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
fn text(source: &FigureSource<'_>, event: &Event, track: &Track) -> String {
    let said = predicate(source.mission, &[], event);
    let (node, topic) = source.mission.elements.ends(event.what);
    let row = words::visible(last_part(&track.name)).into_owned();
    let topic = topic.filter(|topic| track.topic != Some(*topic));
    match topic.map(|topic| relative(source.topic(topic), &track.name)) {
        Some(topic) => format!("{row}: {} {said}", words::visible(topic)),
        None if node.is_some() && track.topic.is_some() => {
            let node = node.and_then(|id| source.mission.elements.nodes.get(id));
            let node = node.map_or("", |n| last_part(n.name.as_str()));
            format!("{row}: {} {said}", words::visible(node))
        }
        None => format!("{row} {said}"),
    }
}

/// A topic's name inside the namespace of a node.
pub(crate) fn relative<'t>(topic: &'t str, node: &str) -> &'t str {
    let space = namespace(node);
    let inside = if space == "/" {
        topic.strip_prefix('/')
    } else {
        topic.strip_prefix(space).and_then(|t| t.strip_prefix('/'))
    };
    inside.unwrap_or_else(|| topic.strip_prefix('/').unwrap_or(topic))
}

/// The rows of nodes and topics.
struct Rows {
    nodes: BTreeMap<NodeId, usize>,
    topics: BTreeMap<TopicId, usize>,
}

impl Rows {
    fn new(tracks: &[Track]) -> Self {
        let tracks = || tracks.iter().enumerate();
        let nodes = tracks().flat_map(|(at, track)| track.nodes.iter().map(move |id| (*id, at)));
        let topics = tracks().filter_map(|(at, track)| Some((track.topic?, at)));
        Self {
            nodes: nodes.collect(),
            topics: topics.collect(),
        }
    }

    fn is_row(&self, what: Element) -> bool {
        match what {
            Element::Node(id) => self.nodes.contains_key(&id),
            Element::Topic(id) => self.topics.contains_key(&id),
            Element::Publish(_) | Element::Subscribe(_) => false,
        }
    }

    /// The rows from which and to which a topic is handed over.
    fn hands(&self, source: &FigureSource<'_>, event: &Event) -> (Option<usize>, Option<usize>) {
        let topic = source.mission.elements.ends(event.what).1;
        let is_shown = topic.is_some_and(|topic| source.shows(topic));
        let (Detail::Senders { from, to }, true) = (&event.detail, is_shown) else {
            return (None, None);
        };
        let row = |nodes: &[NodeId]| nodes.iter().find_map(|id| self.nodes.get(id).copied());
        (row(from), row(to))
    }

    /// The row on which an event is marked: that of its element; for an edge, that of its node or topic; for
    /// a topic among nodes, that of a sender. A part of another event is only marked if it is a row that
    /// begins or ends.
    fn of(&self, source: &FigureSource<'_>, event: &Event) -> Option<usize> {
        let elements = &source.mission.elements;
        let (node, topic) = elements.ends(event.what);
        if topic.is_some_and(|id| !source.shows(id)) {
            return None;
        }
        if event.part_of.is_some() {
            let turns = matches!(event.kind, Kind::Appeared | Kind::Vanished);
            return match event.what {
                Element::Topic(id) if turns => self.topics.get(&id).copied(),
                _ => None,
            };
        }
        let own = topic.and_then(|id| self.topics.get(&id));
        let own = own.or_else(|| node.and_then(|id| self.nodes.get(&id)));
        if own.is_some() || matches!(event.kind, Kind::Appeared | Kind::Vanished) {
            return own.copied();
        }
        let (from, to) = self.hands(source, event);
        let senders = topic.map_or(&[][..], |id| source.mission.sending.of_topic(id));
        let sender = || {
            senders
                .iter()
                .find_map(|s| self.nodes.get(&s.node?).copied())
        };
        from.or(to).or_else(sender)
    }
}
