//! Rows over time: when each node or topic existed, published and changed, with the phases of the mission.
//!
//! In comes a mission with the filters of a page ([`source`]); out come [`Timeline`]s, which know nothing of
//! missions, and their drawings. [`rows`] makes a row per node or topic, [`marks`] puts the events of the log on
//! them, [`arranged`] orders and joins them, and [`drawer`] draws the outcome at one of three densities: below a
//! frame ([`below`]), as a page of topics ([`crate::draw::topic_timeline`]), and on paper
//! ([`crate::draw::figure`]). The page in a browser draws the same rows itself. Begin with [`drawer`].

pub(crate) mod arranged;
pub(crate) mod below;
pub(crate) mod canvas;
pub(crate) mod drawer;
pub(crate) mod legend;
pub(crate) mod marks;
pub(crate) mod notes;
pub(crate) mod phases;
pub(crate) mod rows;
pub(crate) mod source;

use crate::base::time::Span;
use crate::mission::event_log::Interruption;
use marks::RowMark;
use phases::PhaseLabel;
use rows::Row;
use source::FigureSource;

/// Rows over time, in the order in which they are drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timeline {
    /// The time that its axis covers.
    pub(crate) span: Span,
    /// The phases; none if there is only one.
    pub(crate) phases: Vec<PhaseLabel>,
    /// What interrupts it.
    pub(crate) interruptions: Vec<Interruption>,
    /// The rows.
    pub(crate) rows: Vec<Row>,
}

impl Timeline {
    /// These rows with numbered phases.
    pub(crate) fn new(source: &FigureSource<'_>, rows: Vec<Row>) -> Self {
        Self {
            span: source.span(),
            phases: phases::numbered(source),
            interruptions: source.mission.log.interruptions.clone(),
            rows,
        }
    }

    /// These rows with named phases.
    pub(crate) fn named(source: &FigureSource<'_>, rows: Vec<Row>) -> Self {
        Self {
            phases: phases::named(source),
            ..Self::new(source, rows)
        }
    }

    /// All marks with the indices of their rows, in order of time.
    pub(crate) fn marks(&self) -> Vec<(usize, &RowMark)> {
        let rows = self.rows.iter().enumerate();
        let marks = rows.flat_map(|(at, row)| row.marks.iter().map(move |mark| (at, mark)));
        let mut marks: Vec<_> = marks.collect();
        marks.sort_by_key(|(at, mark)| (mark.at, *at));
        marks
    }

    /// The row from which a mark's topic is taken over.
    pub(crate) fn giver(&self, mark: &RowMark) -> Option<usize> {
        let from = mark.from?;
        self.rows.iter().position(|row| row.nodes.contains(&from))
    }
}
