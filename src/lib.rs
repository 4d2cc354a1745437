//! See how a robot's software reconfigures during a mission, straight from its bag files.
//!
//! ```text
//! bag ──> evidence ──> graph ──> mission ──> view ──> layout ──> draw ──> export
//! ```
//!
//! `pipeline` executes that line in order; all decisions are made before the scene, everything after it only
//! draws.
//!
//! ```
//! use bagreel::{Output, Reading, Render, read, render};
//!
//! # let folder = tempfile::tempdir().map_err(bagreel::Error::io("make", std::path::Path::new("a folder")))?;
//! # let page = folder.path().join("courier.html").display().to_string();
//! let bag = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/courier.mcap");
//! let reading = Reading::of([bag]);
//! let mission = read(&reading)?;
//! for (window, graph) in mission.each() {
//!     println!("{}: {} nodes, {} changes", window.index, graph.nodes().count(), window.changes.len());
//! }
//! # assert!(mission.windows.len() >= 5 && mission.elements.nodes.len() > 5);
//! let job = Render::new(reading, vec![Output::parse(&page, None)?])?;
//! assert_eq!(render(&job)?.written[0].files, 1);
//! # Ok::<(), bagreel::Error>(())
//! ```
//!
//! The [`EventLog`] of a mission contains its events, independent of windows; `examples/story.rs` prints it.
//!
//! The stations of the line are the modules below, in this order; each uses only those before it:
//!
//! | station | input | output |
//! |---|---|---|
//! | `base` | | times, names, errors, notices, words: types that all modules share |
//! | [`bag`] | files | connections and messages, distinguished by the first bytes |
//! | `evidence` | messages | observations: the publishers and subscribers, with the kind and the strength of the evidence |
//! | `graph` | observations and windows | the computation graph of each window, and the changes |
//! | `mission` | graphs | the whole sequence, as a value and as JSON; its log and its summary |
//! | `view` | a mission | the part of it that the picture shows: filtered, grouped, collapsed, counted |
//! | `layout` | the union of a view | positions of all elements, computed once, so that nothing moves |
//! | `draw` | a view with positions | scenes, and the painters that turn a scene into SVG, PDF or pixels |
//! | `export` | scenes and missions | files |
//! | `gate` | missions and expectations | the differences, and whether they are allowed |
//! | `pipeline` | a job | the whole program in the order of execution |
//! | `cli` | the command line | a job for the pipeline |
//!
//! To extend bagreel: a bag format is a file in `bag/` and a row in [`bag::FORMATS`], a kind of evidence one
//! in `evidence/source/` and `evidence::SOURCES`, an output one in `export/` and `export::FORMATS`, a style
//! one in `styles/` and `draw::style::BUILTIN`, a layout engine one in `layout/` and `layout::ENGINES`.
//!
//! Glossary. A *bag* is a recording; a *connection* one source of messages in it. A *period* is a length of
//! time, a *window* one half-open interval `[start, end)`. An *observation* is a statement of one source
//! about the graph, with its times; an *inference* is a fact that follows from observations; a *confidence*
//! is the strength of the evidence for it. The *graph* of a window contains the *states* of nodes, topics,
//! publications and subscriptions, its *elements*. A *mission* is the sequence of all windows. A *role* is a
//! node's name without the part that differs from run to run. The *view* contains *items* (boxes) and
//! *arrows*; a *mark* is the change of one. A *scene* is a drawing with all positions and colours determined;
//! a *painter* converts it to an output form; an *encoder* writes it to a file.
//!
//! Versions. Before 1.0 a minor version (0.2) may change this library: names, fields and signatures may
//! change, and `CHANGELOG.md` lists each such change; a patch (0.1.1) changes none of them. Structs and enums
//! that will grow are `#[non_exhaustive]`. The same applies to interfaces that other programs rely on: the
//! exit codes, the JSON of missions (with a version in `schema`), columns of tables (new
//! ones may be added) and the keys of `graph.yaml`. Pictures may change in any version. The module
//! `internals` is not part of the library.
//!
//! The library is silent and deterministic: it never prints (except `cli`), reads no clock, and writes the
//! same bytes for the same bag.

#![cfg_attr(
    not(all(feature = "cli", feature = "pdf")),
    allow(
        dead_code,
        unreachable_pub,
        unused_imports,
        reason = "used by these features only"
    )
)]

// Separate lines keep the order of the stations, which sorting would lose.
mod base;

pub mod bag;

mod evidence;

mod graph;

mod mission;

#[cfg(feature = "render")]
mod view;

#[cfg(feature = "render")]
mod layout;

#[cfg(feature = "render")]
mod draw;

#[cfg(feature = "render")]
mod export;

#[cfg(feature = "render")]
mod gate;

mod pipeline;

#[cfg(feature = "cli")]
mod cli;

pub use base::error::{Error, Result};
#[cfg(feature = "render")]
pub use draw::style::Style;
#[cfg(feature = "render")]
pub use export::Output;
pub use graph::Graph;
pub use mission::{Change, EventLog, Mission, Window, write_json};
pub use pipeline::Reading;
#[cfg(feature = "render")]
pub use pipeline::{Render, Rendered};

pub mod values {
    //! The types used by those of the front page: times and names, the elements of a graph, the events of a
    //! log, and options.

    pub use crate::base::error::Fault;
    pub use crate::base::name::{NodeName, TopicName};
    pub use crate::base::notice::{Notice, NoticeKind, Notices};
    pub use crate::base::time::{Moment, Period, Span, Stamp};
    #[cfg(feature = "source")]
    pub use crate::evidence::code::SourceCode;
    pub use crate::evidence::collector::{CollectOptions, Recorded};
    pub use crate::evidence::{Confidence, Evidence, EvidenceLine, conclude, given as topology};
    pub use crate::graph::history::{Bound, Life, Sender, Sending, Stretch};
    pub use crate::graph::window::{Align, Cut, Division, Length};
    pub use crate::graph::{
        ById, Edge, EdgeId, Element, ElementState, Elements, Existence, Graphs, GraphsIter, Id,
        Measures, Node, NodeId, NodeLoad, State, Topic, TopicId,
    };
    pub use crate::mission::event_log::{
        Detail, Event, EventId, Interruption, InterruptionKind, Kind, Phase,
    };
    pub use crate::mission::info::{
        ConfidenceCounts, EvidenceInfo, FigureInfo, NodeInfo, SurveyRow, TopicInfo,
    };
    pub use crate::mission::{Place, Places};
    pub use crate::pipeline::{Phases, Stage, Unwatched, Watch};
    #[cfg(feature = "render")]
    pub use crate::{
        base::geometry::{Point, Rect, Size},
        base::yaml::YamlPlace,
        draw::figure::{FigureKind, FigureOptions, RowKind},
        draw::picture::PageOptions,
        draw::strip::Choice,
        draw::style::Color,
        draw::text::{Fonts, Weight},
        export::Written,
        export::sequence::SequenceOptions,
        export::tables::TableFormat,
        export::target::Target,
        gate::{
            Cause, CheckedFact, DiffSubject, Difference, Finding, FindingKind, Judgement,
            ReportFormat, Severity, Verdict, Where,
        },
        layout::{Engine, Orientation},
        pipeline::{Body, Drawing, Purpose},
        view::{Grouping, Hide, Mode, NameFilter, Presence, ViewOptions},
    };
}

pub mod commands {
    //! The jobs of the other commands: the summary, the log, the table of messages, the survey of a folder, the counts of
    //! many bags, the check against an expectations file and the writing of one, the comparison of two missions.

    pub use crate::mission::event_log::{LogFormat, LogOptions, log};
    pub use crate::mission::info::{Info, info};
    #[cfg(feature = "render")]
    pub use crate::pipeline::{
        Baseline, BaselineWritten, Check, Checked, Compared, Counting, Diff, Extract, Extracted,
        Report, Survey, Tabled, Tables, baseline, check, diff, extract, is_survey, survey,
        survey_file, tables,
    };
}

#[cfg(feature = "cli")]
#[doc(hidden)]
pub use cli::run as run_command;

#[doc(hidden)]
pub mod internals;

#[cfg(doctest)]
#[doc = include_str!("../docs/src/python.md")]
struct BookPage;

/// Reads bags, or a mission's JSON, into a mission.
///
/// # Errors
/// If an input cannot be read at all, if no input contains a message, and for invalid times. Damaged data is
/// left out and reported in [`Mission::notices`].
pub fn read(reading: &Reading) -> Result<Mission> {
    pipeline::read(reading, &mut pipeline::Unwatched)
}

/// Reads, draws and writes every output, each whole or not at all.
///
/// # Errors
/// As [`read`], and if an output cannot be written or an option is invalid.
#[cfg(feature = "render")]
pub fn render(job: &Render) -> Result<Rendered> {
    pipeline::render(job, &mut pipeline::Unwatched)
}
