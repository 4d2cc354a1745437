//! The main job: read once, draw once, write every output.

use std::ops::ControlFlow;
use std::path::PathBuf;

use super::draw::{Composed, compose, places};
use super::{Drawing, Reading, Stage, Watch, captions, read};
use crate::bag::Input;
use crate::encode::{Output, Written};
use crate::error::Result;
use crate::evolution::Evolution;
use crate::film::{self, Film};
use crate::output;
use crate::picture::Sketch;
use crate::pixels::Painter;
use crate::reel;
use crate::view::filtered;

/// The whole job of `bagreel render`.
#[derive(Clone)]
pub struct Render {
    /// What to read.
    pub reading: Reading,
    /// What to draw.
    pub drawing: Drawing,
    /// How the sequence runs.
    pub sequence: film::Options,
    /// What to write.
    pub outputs: Vec<Output>,
    /// Where mission phases come from: a file or a topic.
    pub captions: Option<String>,
    /// Whether data files hold the viewed graph only.
    pub is_filtered: bool,
}

/// What came of it.
#[derive(Debug)]
pub struct Rendered {
    /// The mission, with where it was drawn and everything worth saying.
    pub evolution: Evolution,
    /// What was written, in the order asked for.
    pub written: Vec<Written>,
}

/// Reads, draws and writes. Outputs are checked before anything is read, and appear whole or not at all.
///
/// # Errors
/// Where an output cannot be written, no input can be read, or an option makes no sense.
pub fn render(job: &Render, watch: &mut dyn Watch) -> Result<Rendered> {
    check(job)?;
    let evolution = read(&job.reading, watch)?;
    show(job, evolution, watch)
}

/// Checks every output before anything is read.
///
/// # Errors
/// As [`output::check`].
pub fn check(job: &Render) -> Result<()> {
    let targets: Vec<_> = job.outputs.iter().map(|o| o.target.clone()).collect();
    let inputs = job.reading.inputs.iter().filter_map(|input| match input {
        Input::Path(path) => Some(path.clone()),
        Input::Stdin => None,
    });
    output::check(&targets, &inputs.collect::<Vec<PathBuf>>())
}

/// Draws and writes a mission that was read.
///
/// # Errors
/// As [`render`].
pub fn show(job: &Render, mut evolution: Evolution, watch: &mut dyn Watch) -> Result<Rendered> {
    let mut drawing = job.drawing.clone();
    if let Some(from) = &job.captions {
        drawing.wish.phases = captions::phases(&evolution, &job.reading.inputs, from)?;
    }
    let Composed {
        view,
        options,
        wish,
        layout,
        notices,
    } = compose(&evolution, &drawing, watch);
    evolution.notices.extend(notices.iter());
    evolution.layout = Some(places(&view, &layout));
    let data = if job.is_filtered {
        filtered(&evolution, &options)
    } else {
        evolution.clone()
    };
    let picture = Sketch::new(&view, &drawing.style, &drawing.fonts, wish).with(layout);
    let film = Film {
        evolution: &data,
        view: &view,
        picture: &picture,
        painter: &Painter::new(&drawing.fonts),
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
    let written = reel::run(&film, &job.outputs, &mut progress)?;
    Ok(Rendered { evolution, written })
}
