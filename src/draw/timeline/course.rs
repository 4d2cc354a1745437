//! The course of a mission beside its picture: phases and groups for the strip below frames, and all
//! lifelines for the timeline of a page.

use std::collections::{BTreeMap, BTreeSet};

use super::lives::LivesFigure;
use super::marks::{Handover, RowMark, Sign};
use super::rows::FigureRow;
use super::source::FigureSource;
use super::tracks::{SendingBar, Track, TrackLife};
use crate::base::name::last_part;
use crate::base::time::{Span, Stamp};
use crate::graph::Element;
use crate::mission::EventId;
use crate::mission::event_log::{Event, Kind};

/// The course of a mission below its picture: the phases, and a row per group of nodes that start and stop
/// together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Course {
    /// The phases, none if there is only one.
    pub(crate) phases: Vec<CoursePhase>,
    pub(crate) rows: Vec<CourseRow>,
}

/// A phase with its name, if it fits, else a shorter one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CoursePhase {
    pub(crate) span: Span,
    pub(crate) names: Vec<String>,
}

/// A row of a course.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CourseRow {
    /// The names of its members; empty for events that belong to no row.
    pub(crate) names: Vec<String>,
    /// The times in which a member exists.
    pub(crate) lives: Vec<Span>,
    pub(crate) marks: Vec<CourseMark>,
}

/// Events of a row that are drawn as one sign.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CourseMark {
    pub(crate) at: Stamp,
    pub(crate) sign: Sign,
    pub(crate) events: Vec<EventId>,
}

/// The part of the mission, one in this many, within which starts, or ends, are drawn as one.
const BURST: i64 = 33;

impl Course {
    /// The course in at most `most` rows: of nodes, or of topics if publishers are unknown, if they have
    /// events. From the lifetimes of [`of_all`]. Events without a row share the last one.
    pub(crate) fn new(lives: &LivesFigure<'_>, most: usize) -> Self {
        let source = lives.source;
        let mut marks = lives.marks.clone().plain();
        let begun = source.span().start.plus(source.span().nanos() / BURST);
        // Elements that start with the recording look as if they existed from the beginning.
        let is_first = |s: &RowMark| s.sign == Sign::Start && s.at < begun;
        marks.signs.retain(|s| !is_first(s));
        let mut groups: BTreeMap<Vec<(bool, Stamp)>, Vec<usize>> = BTreeMap::new();
        let bursts = [Sign::Start, Sign::End].map(|sign| bursts(&marks.signs, sign, source.span()));
        for track in 0..lives.tracks.len() {
            let own: Vec<&RowMark> = marks.signs.iter().filter(|s| s.track == track).collect();
            let turns = own.iter().filter_map(|mark| match mark.sign {
                Sign::Start => Some((true, burst(&bursts[0], mark.at))),
                Sign::End => Some((false, burst(&bursts[1], mark.at))),
                Sign::Dot => None,
            });
            if !own.is_empty() {
                groups.entry(turns.collect()).or_default().push(track);
            }
        }
        let mut rows: Vec<CourseRow> = groups
            .values()
            .map(|tracks| row(lives, tracks, &marks.signs))
            .collect();
        let start = |row: &CourseRow| row.lives.first().map_or(Stamp::MAX, |l| l.start);
        rows.sort_by(|a, b| (start(a), &a.names).cmp(&(start(b), &b.names)));
        let mut others = CourseRow {
            marks: unplaced(source, &marks.signs),
            ..CourseRow::default()
        };
        while rows.len() + usize::from(!others.marks.is_empty()) > most.max(1) {
            let few = rows.iter().enumerate().min_by_key(|(at, row)| {
                let members = row.names.len() * row.marks.len();
                (members, std::cmp::Reverse(*at))
            });
            let Some((at, _)) = few else { break };
            others.marks.extend(rows.remove(at).marks);
        }
        if !others.marks.is_empty() {
            others.marks.sort_by_key(|m| m.at);
            rows.push(others);
        }
        Self {
            phases: phases(source),
            rows,
        }
    }
}

/// The beginnings of the bursts of signs of a kind: signs that follow within a short time belong to the first
/// of them.
fn bursts(signs: &[RowMark], sign: Sign, whole: Span) -> Vec<Stamp> {
    let mut times: Vec<Stamp> = signs
        .iter()
        .filter(|s| s.sign == sign)
        .map(|s| s.at)
        .collect();
    times.sort_unstable();
    let near = whole.nanos() / BURST;
    times.dedup_by(|later, first| later.since(*first) <= near);
    times
}

fn burst(bursts: &[Stamp], at: Stamp) -> Stamp {
    let next = bursts.partition_point(|first| *first <= at);
    next.checked_sub(1).map_or(at, |found| bursts[found])
}

/// The row of some tracks, with one sign for simultaneous events.
fn row(lives: &LivesFigure<'_>, tracks: &[usize], signs: &[RowMark]) -> CourseRow {
    let members = || tracks.iter().map(|at| &lives.tracks[*at]);
    let is_shared = |name: &str| {
        let same = lives.tracks.iter().filter(|t| last_part(&t.name) == name);
        same.count() > 1
    };
    let name = |track: &Track| match last_part(&track.name) {
        last if is_shared(last) => track.name.to_string(),
        last => last.to_owned(),
    };
    let spans = members().flat_map(|t| &t.lives).map(|l| l.span).collect();
    let near = lives.source.span().nanos() / BURST;
    let mut marks: Vec<CourseMark> = Vec::new();
    for mark in signs.iter().filter(|s| tracks.contains(&s.track)) {
        let is_same = |other: &&mut CourseMark| {
            let apart = mark.at.since(other.at);
            other.sign == mark.sign && mark.sign != Sign::Dot && apart.abs() <= near
        };
        match marks.iter_mut().rev().find(is_same) {
            Some(other) => {
                let is_later = (other.sign == Sign::End) == (mark.at > other.at);
                other.at = if is_later { mark.at } else { other.at };
                other.events.push(mark.event);
            }
            None => marks.push(CourseMark {
                at: mark.at,
                sign: mark.sign,
                events: vec![mark.event],
            }),
        }
    }
    CourseRow {
        names: members().map(name).collect(),
        lives: Span::joined(spans, 0),
        marks,
    }
}

/// The events of the log without a row.
fn unplaced(source: &FigureSource<'_>, signs: &[RowMark]) -> Vec<CourseMark> {
    let placed: BTreeSet<EventId> = signs.iter().map(|s| s.event).collect();
    let all = source.mission.log.headlines(source.span());
    let others = all.filter(|(id, _)| !placed.contains(id));
    let mark = |(id, event): (EventId, &Event)| CourseMark {
        at: event.time,
        sign: match event.kind {
            Kind::Started | Kind::Appeared => Sign::Start,
            Kind::Stopped | Kind::Vanished => Sign::End,
            _ => Sign::Dot,
        },
        events: vec![id],
    };
    others.map(mark).collect()
}

/// The phases with their names: the user's, else by the elements that start or end, else by their number. A
/// phase without a name and with the same nodes as the previous one is merged with it.
fn phases(source: &FigureSource<'_>) -> Vec<CoursePhase> {
    let mut phases: Vec<CoursePhase> = Vec::new();
    for (k, phase) in source.phases.iter().enumerate() {
        let counts = [('+', phase.nodes_added), ('−', phase.nodes_removed)];
        let counts = counts.iter().filter(|(_, many)| *many > 0 && k > 0);
        let counts: Vec<String> = counts.map(|(sign, n)| format!("{sign}{n}")).collect();
        if let Some(last) = phases.last_mut()
            && !source.is_named
            && counts.is_empty()
        {
            last.span.end = phase.span.end;
            continue;
        }
        let name = phase.name.to_string();
        let mut names = match name.split_once(": ").filter(|_| !source.is_named) {
            Some((count, those)) => {
                let sign: String = count.chars().take(1).collect();
                shorter(&sign, those, phase.nodes_added.max(phase.nodes_removed))
            }
            None => vec![name],
        };
        if !source.is_named && !counts.is_empty() {
            names.push(counts.join(" "));
        }
        names.push((k + 1).to_string());
        phases.push(CoursePhase {
            span: phase.span,
            names,
        });
    }
    phases
}

/// The elements that began or ended, in fewer and fewer words: all that the phase names, then two and one of
/// them.
fn shorter(sign: &str, those: &str, all: u32) -> Vec<String> {
    let mut names = vec![format!("{sign} {those}")];
    let each: Vec<&str> = those
        .split(", ")
        .flat_map(|part| part.split(" and "))
        .collect();
    for most in [2, 1] {
        let rest = (all as usize).saturating_sub(most);
        if each.len() > most && rest > 0 {
            names.push(format!("{sign} {}, +{rest}", each[..most].join(", ")));
        }
    }
    names
}

/// The lifetimes for both the course and the lifelines: of nodes, or of topics if publishers are unknown.
pub(crate) fn of_all<'a>(source: &'a FigureSource<'a>) -> LivesFigure<'a> {
    LivesFigure::new(source, !source.knows_publishers())
}

/// All lifelines, a row each with its name, in the order of the figure: the timeline of a page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LifeLines {
    pub(crate) rows: Vec<LifeLine>,
    /// Ticks, crosses and small circles, on rows.
    pub(crate) marks: Vec<RowMark>,
    /// Topics that other nodes take over, from row to row.
    pub(crate) handovers: Vec<Handover>,
}

/// A row of the lifelines: a node, a topic, or the title of the namespace of those that follow.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LifeLine {
    pub(crate) label: String,
    /// Whether it is below the title of its namespace.
    pub(crate) is_inside: bool,
    /// The node or topic of the row; `None` for a title.
    pub(crate) what: Option<Element>,
    pub(crate) lives: Vec<TrackLife>,
    pub(crate) bars: Vec<SendingBar>,
}

impl LifeLines {
    /// The rows of nodes, or of topics if publishers are unknown. From the lifetimes of [`of_all`].
    pub(crate) fn new(lives: LivesFigure<'_>) -> Self {
        let handovers = lives.marks.handovers.clone();
        let lives = lives.opened();
        let place = |track| lives.rows.iter().position(|row| row.holds(track));
        let signs = lives.marks.signs.iter();
        let is_hand = |m: &&RowMark| handovers.iter().any(|h| h.event == m.event);
        Self {
            marks: signs
                .filter(|m| !is_hand(m))
                .filter_map(|m| m.on(place))
                .collect(),
            handovers: handovers.iter().filter_map(|h| h.on(place)).collect(),
            rows: lives.rows.iter().filter_map(|r| line(&lives, r)).collect(),
        }
    }
}

fn line(lives: &LivesFigure<'_>, row: &FigureRow) -> Option<LifeLine> {
    match row {
        FigureRow::Space(name) => Some(LifeLine {
            label: name.clone(),
            ..LifeLine::default()
        }),
        FigureRow::Track(at, label, is_inside) => {
            let track = lives.tracks.get(*at)?;
            let node = track.nodes.last().map(|id| Element::Node(*id));
            Some(LifeLine {
                label: label.clone(),
                is_inside: *is_inside,
                what: node.or(track.topic.map(Element::Topic)),
                lives: track.lives.clone(),
                bars: track.bars.clone(),
            })
        }
        // When expanded, they collapse nothing.
        FigureRow::Folded(..) => None,
    }
}
