//! The main job: read once, draw once, write every output.

use std::ops::ControlFlow;
use std::path::PathBuf;

use super::draw::{Composed, compose, places, unplaced};
use super::{Drawing, Reading, Stage, Watch, captions, read};
use crate::bag::Input;
use crate::base::error::Result;
use crate::base::notice::{Notice, NoticeKind};
use crate::draw::paint::raster::Painter;
use crate::draw::picture::{Measured, Picture};
use crate::draw::strip::{Source, Strip, strip};
use crate::export::options::{self, Choice};
use crate::export::run;
use crate::export::sequence::Sequence;
use crate::export::{self, Output, Written};
use crate::mission::Mission;
use crate::view::{View, filtered};

/// The whole job of `bagreel render`.
#[derive(Clone)]
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
    /// Where mission phases come from: a file or a topic.
    pub captions: Option<String>,
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
            kept: Vec::new(),
            is_filtered: false,
        })
    }
}

/// What came of it.
#[derive(Debug)]
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
pub fn render(job: &Render, watch: &mut dyn Watch) -> Result<Rendered> {
    check(job)?;
    let mission = read(&job.reading, watch)?;
    show(job, mission, watch)
}

/// Checks every output before anything is read.
///
/// # Errors
/// As [`export::check`].
pub fn check(job: &Render) -> Result<()> {
    let inputs = job.reading.inputs.iter().filter_map(|input| match input {
        Input::Path(path) => Some(path),
        Input::Stdin => None,
    });
    let kept: Vec<PathBuf> = inputs.chain(&job.kept).cloned().collect();
    export::check(&job.outputs, &kept)
}

/// Draws and writes a mission that was read.
///
/// # Errors
/// As [`render`].
pub fn show(job: &Render, mut mission: Mission, watch: &mut dyn Watch) -> Result<Rendered> {
    let mut drawing = job.drawing.clone();
    if let Some(from) = &job.captions {
        drawing.page.phases = captions::phases(&mission, &job.reading.inputs, from)?;
    }
    // What is not drawn needs no places.
    let is_drawn = job.outputs.iter().any(|o| o.format.is_drawn);
    let Composed {
        view,
        options,
        page,
        layout,
        notices,
    } = if is_drawn {
        compose(&mission, &drawing, watch)
    } else {
        unplaced(&mission, &drawing)
    };
    mission.notices.extend(notices.iter());
    mission.layout = is_drawn.then(|| places(&view, &layout));
    let nothing = View::default();
    let drawn = if is_drawn { &view } else { &nothing };
    let picture = Measured::new(drawn, &drawing.style, &drawing.fonts, page).with(layout);
    let strip = side_by_side(job, &mission, &view, &picture)?;
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
        strip: strip.as_ref().map(|s| &s.scene),
        options: job.sequence.clone(),
    };
    watch.stage(Stage::Draw);
    let mut progress = |done: usize, total: usize| {
        watch.progress(done as u64, total as u64);
        if watch.stopped() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let written = run::run(&sequence, &job.outputs, &mut progress)?;
    Ok(Rendered { mission, written })
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
