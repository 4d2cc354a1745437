//! Figures for papers, exact in width and never with text below 6 pt: lifelines, graph, holders and steps.
//!
//! A figure that does not fit with nodes is tried with groups; if that fails, the error suggests a filter.
//! Text is never scaled.

pub(crate) mod graph;
pub(crate) mod holders;
pub(crate) mod page;
pub(crate) mod steps;
mod tex;

use crate::base::words::worded;
use crate::draw::scene::Scene;
use crate::draw::timeline::source::FigureSource;
pub use tex::Latex;

worded! {
    /// The kind of figure.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum FigureKind {
        /// Lifelines: when each row existed, how busy it was, and its changes.
        #[default]
        Lives = "lives",
        /// The graph of the whole mission, with the times of each node.
        Graph = "graph",
        /// Who sends each topic that changes hands or has several senders, and when nobody does.
        Holders = "holders",
        /// A panel per change of phase, with only what changes and its direct partners.
        Steps = "steps",
    }
}

worded! {
    /// The kind of element that the rows of lifelines represent.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum RowKind {
        /// Nodes, by role.
        Nodes = "nodes",
        /// Nodes that start and stop together.
        Groups = "groups",
        /// Topics.
        Topics = "topics",
    }
}

/// The options of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureOptions {
    /// The kind of figure.
    pub kind: FigureKind,
    /// Its width in millimetres, exactly.
    pub width_mm: f64,
    /// The size of names in points, 7 to 12; all other text is 1 pt smaller.
    pub text_pt: f64,
    /// The kind of element that the rows of lifelines represent; `None` for the most detailed that fits.
    pub rows: Option<RowKind>,
    /// The boundaries that [`FigureKind::Steps`] shows, by the number of the phase that begins, ≥ 2; the largest if empty.
    pub steps: Vec<usize>,
    /// Whether legend and notes are left to the caption.
    pub is_bare: bool,
    /// Whether phases are the user's, so that their names are shown.
    pub is_named: bool,
}

impl Default for FigureOptions {
    fn default() -> Self {
        Self {
            kind: FigureKind::default(),
            width_mm: 88.0,
            text_pt: 7.0,
            rows: None,
            steps: Vec::new(),
            is_bare: false,
            is_named: false,
        }
    }
}

/// A finished figure.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Figure {
    /// The drawing; its size is that on paper.
    pub scene: Scene,
    /// A caption for `LaTeX`, escaped: what is drawn, the phases with their times, bag and length, the legend in words.
    pub caption: String,
    /// Remarks for the user; lower case, no period.
    pub remarks: Vec<String>,
}

/// The largest height of a figure in millimetres: the text block of a page.
pub(crate) const MOST_HEIGHT: f64 = 225.0;

/// The figure with this drawing.
pub(crate) fn finished(
    source: &FigureSource<'_>,
    options: &FigureOptions,
    scene: Scene,
    remarks: Vec<String>,
) -> Figure {
    Figure {
        caption: tex::caption(source, options, &remarks),
        scene,
        remarks,
    }
}
