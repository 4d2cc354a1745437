//! The course of a mission beside its picture: life lines without names for the strip below frames, and with names for
//! the timeline of a page.

use super::groups;
use super::lives::LivesFigure;
use super::marks::{Handover, RowMark};
use super::rows::FigureRow;
use super::source::FigureSource;
use super::tracks::{SendingBar, TrackLife};
use crate::base::time::Span;
use crate::graph::Element;

/// The life lines of a mission, in rows from top to bottom, and its phases.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Course {
    /// The phases, none if there is only one.
    pub(crate) phases: Vec<Span>,
    pub(crate) rows: Vec<CourseRow>,
    /// Ticks, crosses and small circles, on rows.
    pub(crate) marks: Vec<RowMark>,
    /// Topics that others send from a moment on, from row to row.
    pub(crate) handovers: Vec<Handover>,
}

/// A row of a course: a node, a topic, some of them that come and go together, or all that live throughout.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CourseRow {
    pub(crate) lives: Vec<TrackLife>,
    pub(crate) bars: Vec<SendingBar>,
}

impl Course {
    /// The course in at most `most` rows: of nodes, else of groups, of which those that change least are left out; of
    /// topics where publishers are unknown. From the lives of [`of_all`].
    pub(crate) fn new(lives: &LivesFigure<'_>, most: usize) -> Self {
        let source = lives.source;
        let is_grouped = rows(lives).len() > most && source.knows_publishers();
        let grouped = is_grouped.then(|| {
            let tracks = groups::tracks(source, &lives.tracks, usize::MAX);
            LivesFigure::of(source, tracks)
        });
        let lives = grouped.as_ref().unwrap_or(lives);
        let mut chosen = rows(lives);
        if chosen.len() > most {
            let signs = &lives.marks.signs;
            let changes = |tracks: &[usize]| {
                let own = signs.iter().filter(|s| tracks.contains(&s.track));
                own.count()
            };
            let mut order: Vec<usize> = (0..chosen.len()).collect();
            order.sort_by_cached_key(|at| (std::cmp::Reverse(changes(&chosen[*at].0)), *at));
            let kept = &order[..most];
            let mut at = 0..;
            chosen.retain(|_| at.next().is_some_and(|at| kept.contains(&at)));
        }
        let place = |track| chosen.iter().position(|(all, _)| all.contains(&track));
        Self {
            phases: source.phases.iter().map(|p| p.span).collect(),
            marks: lives
                .marks
                .signs
                .iter()
                .filter_map(|m| m.on(place))
                .collect(),
            handovers: lives
                .marks
                .handovers
                .iter()
                .filter_map(|h| h.on(place))
                .collect(),
            rows: chosen.into_iter().map(|(_, row)| row).collect(),
        }
    }
}

/// The lives behind both the course and the life lines: of nodes; of topics where publishers are unknown.
pub(crate) fn of_all<'a>(source: &'a FigureSource<'a>) -> LivesFigure<'a> {
    LivesFigure::new(source, !source.knows_publishers())
}

/// The rows of some lives, with the tracks they stand for.
fn rows(lives: &LivesFigure<'_>) -> Vec<(Vec<usize>, CourseRow)> {
    let row = |row: &FigureRow| match row {
        FigureRow::Space(_) => None,
        FigureRow::Track(at, ..) => {
            let track = lives.tracks.get(*at)?;
            let (lives, bars) = (track.lives.clone(), track.bars.clone());
            Some((vec![*at], CourseRow { lives, bars }))
        }
        FigureRow::Folded(all, _) => {
            let span = lives.source.span();
            let bars = vec![SendingBar { span, share: 1.0 }];
            let lives = Vec::new();
            Some((all.clone(), CourseRow { lives, bars }))
        }
    };
    lives.rows.iter().filter_map(row).collect()
}

/// The lives of all, a row each with its name, in the order of the figure: the timeline of a page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LifeLines {
    pub(crate) rows: Vec<LifeLine>,
    /// Ticks, crosses and small circles, on rows.
    pub(crate) marks: Vec<RowMark>,
    /// Topics that others send from a moment on, from row to row.
    pub(crate) handovers: Vec<Handover>,
}

/// A row of the life lines: a node, a topic, or the title of the namespace of those that follow.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LifeLine {
    pub(crate) label: String,
    /// Whether it stands below the title of its namespace.
    pub(crate) is_inside: bool,
    /// The node or topic of the row; `None` for a title.
    pub(crate) what: Option<Element>,
    pub(crate) lives: Vec<TrackLife>,
    pub(crate) bars: Vec<SendingBar>,
}

impl LifeLines {
    /// The rows of nodes; of topics where publishers are unknown. From the lives of [`of_all`].
    pub(crate) fn new(lives: LivesFigure<'_>) -> Self {
        let handovers = lives.marks.handovers.clone();
        let lives = lives.opened();
        let place = |track| lives.rows.iter().position(|row| row.holds(track));
        let signs = lives.marks.signs.iter();
        let is_hand = |m: &&RowMark| handovers.iter().any(|h| h.entry == m.entry);
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
            is_inside: false,
            what: None,
            lives: Vec::new(),
            bars: Vec::new(),
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
        // Opened, they fold nothing.
        FigureRow::Folded(..) => None,
    }
}
