//! The main job: read once, draw once, write every output.

use std::ops::ControlFlow;
use std::path::PathBuf;

use super::draw::{Body, Composed, compose, places, unplaced};
use super::figure::name_phases;
use super::{Drawing, Phases, Reading, Stage, Watch, captions, read};
use crate::bag::Input;
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind};
use crate::draw::board::Board;
use crate::draw::figure::{self, Figure};
use crate::draw::paint::raster::Painter;
use crate::draw::picture::{Measured, Picture};
use crate::draw::strip::{Source, Strip, strip};
use crate::export::options::{self, Choice, FigureOptions};
use crate::export::run;
use crate::export::sequence::Sequence;
use crate::export::{self, OneDrawing, Output, Written};
use crate::mission::Mission;
use crate::view::{View, ViewOptions, filtered};

/// The whole job of `bagreel render`.
#[derive(Clone)]
#[non_exhaustive]
pub struct Render {
    /// What to read.
    pub reading: Reading,
    /// What to draw.
    pub drawing: Drawing,
    /// How the sequence runs.
    pub sequence: options::Options,
    /// Files and folders of the user's that are read beside the inputs, and never overwritten.
    pub kept: Vec<PathBuf>,
    /// What to write.
    pub outputs: Vec<Output>,
    /// Where captions come from: a file or a topic.
    pub captions: Option<String>,
    /// Where phases and their names come from.
    pub phases: Phases,
    /// Whether data files hold the viewed graph only.
    pub is_filtered: bool,
}

impl Render {
    /// Reads so and writes these, everything else as the command line has it.
    ///
    /// # Errors
    /// As [`Drawing::new`].
    pub fn new(reading: Reading, outputs: Vec<Output>) -> Result<Self> {
        Ok(Self {
            reading,
            drawing: Drawing::new()?,
            sequence: options::Options::default(),
            outputs,
            captions: None,
            phases: Phases::Found,
            kept: Vec::new(),
            is_filtered: false,
        })
    }
}

/// What came of it.
#[derive(Debug)]
#[non_exhaustive]
pub struct Rendered {
    /// The mission, with where it was drawn and everything worth saying.
    pub mission: Mission,
    /// What was written, in the order asked for.
    pub written: Vec<Written>,
}

/// Reads, draws and writes. Outputs are checked before anything is read, and appear whole or not at all.
///
/// # Errors
/// Where an output cannot be written, no input can be read, or an option makes no sense.
pub(crate) fn render(job: &Render, watch: &mut dyn Watch) -> Result<Rendered> {
    check(job)?;
    let mission = read(&job.reading, watch)?;
    show(job, mission, watch)
}

/// Checks every output before anything is read.
///
/// # Errors
/// As [`export::check`].
pub(crate) fn check(job: &Render) -> Result<()> {
    check_figure(job)?;
    let inputs = job.reading.inputs.iter().filter_map(|input| match input {
        Input::Path(path) => Some(path),
        Input::Stdin => None,
    });
    let kept: Vec<PathBuf> = inputs.chain(&job.kept).cloned().collect();
    export::check(&job.outputs, &kept)
}

/// A figure needs an output that holds it, and lines for LaTeX need a figure.
fn check_figure(job: &Render) -> Result<()> {
    let holds = |o: &Output| o.format.whole != OneDrawing::Never && o.format.word != "tex";
    if job.sequence.figure.is_some() && !job.outputs.iter().any(holds) {
        return Err(Error::usage(
            "no output holds the figure",
            "write it with `-o fig.pdf`, `.svg`, `.png` or `.webp`",
        ));
    }
    let latex = job.outputs.iter().find(|o| o.format.word == "tex");
    match latex.filter(|_| job.sequence.figure.is_none()) {
        Some(output) => Err(export::needs_figure(&output.target)),
        None => Ok(()),
    }
}

/// Draws and writes a mission that was read.
///
/// # Errors
/// As [`render`].
pub(crate) fn show(job: &Render, mut mission: Mission, watch: &mut dyn Watch) -> Result<Rendered> {
    let mut drawing = job.drawing.clone();
    if let Some(from) = &job.captions {
        drawing.page.phases = captions::phases(&mission, &job.reading.inputs, from)?;
    }
    let is_named = name_phases(&mut mission, &job.phases)?;
    drawing.page.course = Some(course(&mission, &drawing));
    let figure = drawn_figure(job, &mission, is_named)?;
    for remark in figure.iter().flat_map(|(figure, _)| &figure.remarks) {
        let notice = Notice::new(NoticeKind::Note, remark.clone());
        mission.notices.add(notice);
    }
    // What is not drawn, or drawn as a figure, needs no places.
    let is_graph = |o: &Output| {
        o.format.is_drawn && !(figure.is_some() && o.format.whole != OneDrawing::Never)
    };
    let is_drawn = job.outputs.iter().any(is_graph);
    let is_board = is_drawn && drawing.body.is_board(&mission);
    let Composed {
        view,
        options,
        page,
        layout,
        notices,
    } = if is_drawn && !is_board {
        compose(&mission, &drawing, watch)
    } else {
        unplaced(&mission, &drawing)
    };
    mission.notices.extend(notices.iter());
    mission.layout = (is_drawn && !is_board).then(|| places(&view, &layout));
    if is_board {
        return show_board(job, mission, &drawing, (&view, &options), watch);
    }
    let nothing = View::default();
    let drawn = if is_drawn { &view } else { &nothing };
    let picture = Measured::new(drawn, &drawing.style, &drawing.fonts, page).with(layout);
    let strip = match figure {
        Some(_) => None,
        None => side_by_side(job, &mission, &view, &picture)?,
    };
    for remark in strip.iter().flat_map(|s| &s.remarks) {
        let notice = Notice::new(NoticeKind::Note, remark.clone());
        mission.notices.add(notice);
    }
    let viewed = job.is_filtered.then(|| filtered(&mission, &options));
    let sequence = Sequence {
        mission: &mission,
        data: viewed.as_ref().unwrap_or(&mission),
        view: &view,
        picture: &picture,
        painter: &Painter::new(&drawing.fonts),
        fonts: &drawing.fonts,
        strip: match &figure {
            Some((figure, _)) => Some(&figure.scene),
            None => strip.as_ref().map(|s| &s.scene),
        },
        latex: figure.as_ref().map(|(_, latex)| latex.as_str()),
        options: job.sequence.clone(),
    };
    let written = write(&sequence, &job.outputs, watch)?;
    Ok(Rendered { mission, written })
}

fn write(
    sequence: &Sequence<'_>,
    outputs: &[Output],
    watch: &mut dyn Watch,
) -> Result<Vec<Written>> {
    watch.stage(Stage::Draw);
    let mut progress = |done: usize, total: usize| {
        watch.progress(done as u64, total as u64);
        if watch.stopped() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let steps = run::Steps::default();
    let written = run::run(sequence, outputs, &steps, &mut progress)?;
    watch.shares(&steps.shares());
    Ok(written)
}

/// So many life lines fit below a frame.
const MOST_LIVES: usize = 14;

/// Who lived when, for the strip below frames.
fn course(mission: &Mission, drawing: &Drawing) -> figure::Course {
    let (nodes, topics) = (&drawing.view.ns_filter, &drawing.view.topic_filter);
    let source = figure::source::Source::new(mission, nodes, topics, false);
    figure::Course::new(&source, MOST_LIVES)
}

/// Writes a mission whose picture is the topic board.
fn show_board(
    job: &Render,
    mut mission: Mission,
    drawing: &Drawing,
    (view, options): (&View, &ViewOptions),
    watch: &mut dyn Watch,
) -> Result<Rendered> {
    if drawing.body == Body::Auto {
        let text = "of most messages nobody knows the publisher, so the picture is a board of topics; `--view graph` draws what is known";
        mission.notices.add(Notice::new(NoticeKind::Chosen, text));
    }
    let (nodes, topics) = (&drawing.view.ns_filter, &drawing.view.topic_filter);
    let source = figure::source::Source::new(&mission, nodes, topics, false);
    let page = drawing.page.clone();
    let is_sized = drawing.is_sized || !drawing.is_fitted;
    let board = Board::new(
        &source,
        view,
        &drawing.style,
        &drawing.fonts,
        page,
        is_sized,
    );
    let remarks = board.remarks();
    let overview = board.overview();
    let viewed = job.is_filtered.then(|| filtered(&mission, options));
    let sequence = Sequence {
        mission: &mission,
        data: viewed.as_ref().unwrap_or(&mission),
        view,
        picture: &board,
        painter: &Painter::new(&drawing.fonts),
        fonts: &drawing.fonts,
        strip: Some(&overview.scene),
        latex: None,
        options: job.sequence.clone(),
    };
    let written = write(&sequence, &job.outputs, watch)?;
    for text in remarks {
        mission.notices.add(Notice::new(NoticeKind::Note, text));
    }
    Ok(Rendered { mission, written })
}

/// The figure with its lines for LaTeX, if one was asked for.
fn drawn_figure(
    job: &Render,
    mission: &Mission,
    is_named: bool,
) -> Result<Option<(Figure, String)>> {
    let Some(options) = &job.sequence.figure else {
        return Ok(None);
    };
    let options = FigureOptions {
        is_named,
        ..options.clone()
    };
    super::figure::draw(mission, &job.drawing, &options, &job.outputs).map(Some)
}

/// The film strip, if it was asked for or an output needs one.
fn side_by_side(
    job: &Render,
    mission: &Mission,
    view: &View,
    picture: &Picture<'_>,
) -> Result<Option<Strip>> {
    let asked = job.sequence.strip.as_ref();
    if asked.is_none() && !export::needs_strip(&job.outputs, view.frames.len()) {
        return Ok(None);
    }
    let page = &job.drawing.page;
    let source = Source {
        mission,
        view,
        picture,
        style: &job.drawing.style,
        fonts: &job.drawing.fonts,
        engine: job.drawing.engine,
    };
    let choice = asked.unwrap_or(&Choice::Changes);
    strip(source, choice, page.width_mm, page.size.w).map(Some)
}
