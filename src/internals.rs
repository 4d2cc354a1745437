//! The modules that the project's tests, benchmarks, fuzz targets and Python wheel use besides the public API. They are not
//! stable.

/// See `src/base.rs`.
pub mod base {
    pub use crate::base::{error, geometry, name, notice, time, words};
}

/// See `src/evidence.rs`.
pub mod evidence {
    #[cfg(feature = "source")]
    pub use crate::evidence::code;
    pub use crate::evidence::{Confidence, Evidence, EvidenceLine, SOURCES, Source};
    pub use crate::evidence::{collector, conclude, given as topology};
}

/// See `src/graph.rs`.
pub mod graph {
    pub use crate::graph::{
        Built, Element, ElementState, Elements, Graph, Measures, PerElement, State, build, window,
    };
}

/// See `src/mission.rs`.
pub mod mission {
    pub use crate::mission::{
        EventLog, Mission, Window, event_log, info, phases, read_json, write_json,
    };
}

/// See `src/view.rs`.
#[cfg(feature = "render")]
pub mod view {
    pub use crate::view::{
        AlsoHere, Arrow, ArrowId, ArrowKind, BoxRow, Collapsible, Counts, Frame, Headline, Item,
        ItemId, ItemKind, Mark, MemberState, Members, Namespace, OngoingEvent, Phrase, SeenWindow,
        Shown, ShownRuns, TopicRow, View, ViewOptions, view,
    };
}

/// See `src/layout.rs`.
#[cfg(feature = "render")]
pub mod layout {
    pub use crate::layout::{
        Cluster, ENGINES, Layout, LayoutOptions, Link, Orientation, Outline, Plan, Route, Vertex,
        engine, extend, lay_out,
    };
}

/// See `src/draw.rs`.
#[cfg(feature = "render")]
pub mod draw {
    pub use crate::draw::figure::Latex;
    pub use crate::draw::{picture, scene, strip, style, text};

    /// See `src/draw/paint.rs`.
    pub mod paint {
        pub use crate::draw::paint::raster;
    }
}

/// See `src/export.rs`.
#[cfg(feature = "render")]
pub mod export {
    pub use crate::export::palette::{Area, Palette};
    pub use crate::export::tables::TableFormat;
    pub use crate::export::{
        DrawnFrame, Encoder, FORMATS, Needs, OneDrawing, Output, OutputFormat, Packet, Written,
        run, sequence,
    };
}

/// Tables in columns, from which the Python wheel makes Arrow arrays.
#[cfg(feature = "render")]
pub mod tables {
    pub use crate::base::table::{
        Batch, ColumnKind, ColumnValues, TableColumn, TextColumn, WordColumn,
    };
    pub use crate::export::tables::of_mission;
    pub use crate::pipeline::{Counted, count};
}

/// See `src/pipeline.rs`.
pub mod pipeline {
    #[cfg(feature = "cli")]
    pub use crate::pipeline::follow;
    pub use crate::pipeline::{Reading, Unwatched, explain, read};
}
