//! The main job: read once, draw once, write every output.

use std::ops::ControlFlow;
use std::path::PathBuf;

use super::draw::{Body, Composed, places, unplaced};
use super::fit::compose;
use super::{Drawing, Reading, Stage, Watch, read, unfolded};
use crate::base::cast;
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::words;
use crate::draw::figure::Figure;
use crate::draw::paint::raster::Painter;
use crate::draw::picture::{Measured, Picture};
use crate::draw::strip::{Strip, StripSource, StripWidth, strip};
use crate::draw::timeline::Timeline;
use crate::draw::timeline::arranged::{by_namespace, together};
use crate::draw::timeline::rows;
use crate::draw::timeline::source::FigureSource;
use crate::draw::topic_timeline::TopicTimeline;
use crate::export::options::{self, Choice, FigureOptions};
use crate::export::run;
use crate::export::sequence::{Drawings, Sequence, Unfolded};
use crate::export::{self, OneDrawing, Output, Written};
use crate::graph::window::default_period;
use crate::mission::Mission;
use crate::view::{Grouping, Mode, View, filtered, nothing, unmatched, view};

/// The whole job of `bagreel render`.
#[derive(Clone)]
#[non_exhaustive]
pub struct Render {
    /// The inputs and how they are read.
    pub reading: Reading,
    /// The options of the picture.
    pub drawing: Drawing,
    /// The options of the sequence.
    pub sequence: options::SequenceOptions,
    /// Other files and folders that are read, and never overwritten.
    pub kept: Vec<PathBuf>,
    /// The outputs to write.
    pub outputs: Vec<Output>,
    /// The output that replaces all others if the picture is not an animation: a mission in one window, or a
    /// topic timeline.
    pub still: Option<Output>,
}

impl Render {
    /// A job that reads `reading` and writes `outputs`, with the command line's defaults.
    ///
    /// # Errors
    /// As [`Drawing::new`].
    pub fn new(reading: Reading, outputs: Vec<Output>) -> Result<Self> {
        Ok(Self {
            reading,
            drawing: Drawing::new()?,
            sequence: options::SequenceOptions::default(),
            outputs,
            still: None,
            kept: Vec::new(),
        })
    }
}

/// The outcome of `bagreel render`.
#[derive(Debug)]
#[non_exhaustive]
pub struct Rendered {
    /// The mission, as it was read.
    pub mission: Mission,
    /// All notices, about the mission and about its drawing.
    pub notices: Notices,
    /// The files written, per output in the given order.
    pub written: Vec<Written>,
}

/// Reads, draws and writes. Outputs are checked before anything is read, and written atomically.
///
/// # Errors
/// If an output cannot be written, no input can be read, or an option is invalid.
pub(crate) fn render(job: &Render, watch: &mut dyn Watch) -> Result<Rendered> {
    check(job)?;
    let mission = read(&job.reading, watch)?;
    show(job, mission, watch)
}

/// Checks every output before anything is read.
///
/// # Errors
/// As [`export::check()`].
pub(crate) fn check(job: &Render) -> Result<()> {
    check_figure(job)?;
    let mut kept = job.reading.files();
    kept.extend_from_slice(&job.kept);
    let outputs = job.outputs.iter().chain(&job.still);
    export::check(&outputs.cloned().collect::<Vec<_>>(), &kept)
}

/// Refuses a figure without a suitable output, and LaTeX code without a figure.
fn check_figure(job: &Render) -> Result<()> {
    let holds = |o: &Output| o.format.whole != OneDrawing::Never && o.format.word != "tex";
    if job.sequence.figure.is_some() && !job.outputs.iter().any(holds) {
        return Err(Error::usage(
            "no output can contain the figure",
            "write it with `-o fig.pdf`, `.svg`, `.png` or `.webp`",
        ));
    }
    let latex = job.outputs.iter().find(|o| o.format.word == "tex");
    match latex.filter(|_| job.sequence.figure.is_none()) {
        Some(output) => Err(export::needs_figure(&output.target)),
        None => Ok(()),
    }
}

/// Draws and writes a mission.
///
/// # Errors
/// As [`render`].
pub(crate) fn show(job: &Render, mut mission: Mission, watch: &mut dyn Watch) -> Result<Rendered> {
    let still = still(job, &mut mission);
    let job = still.as_ref().unwrap_or(job);
    let is_figure = job.sequence.figure.is_some();
    let is_whole: Vec<bool> = job.outputs.iter().map(has_all_topics).collect();
    let is_mixed = is_whole.contains(&true)
        && job
            .outputs
            .iter()
            .any(|o| o.format.is_drawn && !has_all_topics(o));
    if is_figure || !is_mixed {
        return show_alike(job, mission, watch);
    }
    // Both drawings of the mission are the same as if only one kind of output had been requested.
    let some = |is: bool| {
        let outputs = job.outputs.iter().filter(|o| has_all_topics(o) == is);
        Render {
            outputs: outputs.cloned().collect(),
            ..job.clone()
        }
    };
    let mut pictures = show_alike(&some(false), mission, watch)?;
    let graphs = show_alike(&some(true), pictures.mission, watch)?;
    let known: Vec<Notice> = pictures.notices.iter().collect();
    let more = graphs.notices.iter().filter(|n| !known.contains(n));
    pictures.notices.extend(more);
    let (mut drawn, mut written) = (pictures.written.into_iter(), graphs.written.into_iter());
    let in_order = is_whole
        .into_iter()
        .filter_map(|is| if is { written.next() } else { drawn.next() });
    Ok(Rendered {
        mission: graphs.mission,
        notices: pictures.notices,
        written: in_order.collect(),
    })
}

/// The job with a still instead of an animation if there is nothing to animate, with a note on how to get an animation.
fn still(job: &Render, mission: &mut Mission) -> Option<Render> {
    let still = job.still.as_ref()?;
    let is_timeline = job.drawing.body.is_timeline(mission);
    if mission.windows.len() > 1 && !is_timeline {
        return None;
    }
    let why = if is_timeline {
        "a topic timeline shows the whole time at once"
    } else {
        "nothing changes after the beginning, so this is one picture with rates over the whole time"
    };
    let film = job.outputs.first()?.target.path().display();
    let text = format!("{why}; `-o {film}` makes an animation");
    mission.notices.add(Notice::new(NoticeKind::Chosen, text));
    Some(Render {
        outputs: vec![still.clone()],
        ..job.clone()
    })
}

/// Whether an output has each topic as a separate element: pages with expandable boxes, and graph files. Pictures may
/// show a topic as a row of a box.
fn has_all_topics(output: &Output) -> bool {
    let format = output.format;
    format.is_unfolded || format.is_viewed && !format.is_drawn
}

/// The drawing of a mission: pictures show topics as words on lines, while pages and graph files have each as an element.
fn drawing_of(job: &Render, mission: &Mission) -> Drawing {
    let mut drawing = job.drawing.clone();
    let is_picture = !job.outputs.iter().any(has_all_topics);
    drawing.view.is_picture = is_picture;
    drawing.view.is_bundled = is_picture && drawing.view.mode == Mode::Nodes;
    drawing.page.title.get_or_insert_with(|| mission.title());
    if job.reading.phases.is_named() {
        drawing.page.phases = phases(mission);
    }
    drawing
}

/// Draws and writes a mission if all outputs show the same drawing.
fn show_alike(job: &Render, mission: Mission, watch: &mut dyn Watch) -> Result<Rendered> {
    let mut drawing = drawing_of(job, &mission);
    let figure = drawn_figure(job, &mission, watch)?;
    // Data and figures need no positions.
    let is_graph = |o: &Output| {
        o.format.is_drawn && !(figure.is_some() && o.format.whole != OneDrawing::Never)
    };
    let is_drawn = job.outputs.iter().any(is_graph);
    let is_timeline = is_drawn && drawing.body.is_timeline(&mission);
    if is_timeline {
        // Its rows show when everything was there.
        drawing.view.is_still = Some(false);
    }
    let source = FigureSource::new(
        &mission,
        &drawing.view.ns_filter,
        &drawing.view.topic_filter,
        job.reading.phases.is_named(),
    );
    let known = (is_drawn && !is_timeline).then(|| rows::of(&source, !source.knows_publishers()));
    if let Some(known) = &known {
        let most = most_rows(drawing.page.size.h);
        let known = together(&source, known.clone(), most, false);
        drawing.page.timeline = Timeline::named(&source, known);
    }
    let Composed {
        view,
        options,
        page,
        layout,
        notices,
    } = if is_drawn && !is_timeline {
        compose(&mission, &drawing, watch)
    } else if is_timeline || job.outputs.iter().any(|o| o.format.is_viewed) {
        unplaced(view(&mission, &drawing.view).0, &drawing)
    } else {
        unplaced(View::default(), &drawing)
    };
    if is_timeline {
        return show_timeline(job, mission, &drawing, &view, watch);
    }
    let elements = &mission.elements;
    if is_drawn && view.items.is_empty() && elements.nodes.len() + elements.topics.len() > 0 {
        return Err(nothing(elements, &options));
    }
    let places = is_drawn.then(|| places(&view, &layout));
    let nothing = View::default();
    let drawn = if is_drawn { &view } else { &nothing };
    let picture = Measured::new(drawn, &drawing.style, &drawing.fonts, page).with(layout);
    let opened = unfolded::opened(&mission, &drawing, Some(&view), &job.outputs)?;
    let part = opened
        .as_ref()
        .and_then(|view| unfolded::part(view, &mission, &drawing, &job.outputs));
    let opened_picture = opened
        .as_ref()
        .and_then(|view| unfolded::drawn((view, part.as_ref()), &drawing, &job.outputs));
    let known = known.filter(|_| opened.is_some());
    let lives = known.map(|known| Timeline::new(&source, by_namespace(known, mission.span, false)));
    let lives = job.sequence.pairs.clone().or(lives);
    let strip = match figure {
        Some(_) => None,
        None => side_by_side(job, &mission, &view, &picture)?,
    };
    let remarks = figure.iter().flat_map(|(figure, _)| &figure.remarks);
    let remarks = remarks.chain(strip.iter().flat_map(|s| &s.remarks));
    let remarks = remarks.map(|text| Notice::new(NoticeKind::Note, text.clone()));
    let mut all = mission.notices.clone();
    all.extend(unmatched(&mission.elements, &drawing.view));
    all.extend(notices.iter().chain(remarks));
    let data = chosen(job, &mission, &mut all);
    let sequence = Sequence {
        mission: &mission,
        data: data.as_ref().unwrap_or(&mission),
        places: places.as_ref(),
        notices: &all,
        view: &view,
        picture: &picture,
        unfolded: opened.as_ref().map(|view| Unfolded {
            view,
            picture: opened_picture.as_ref().map(|p| p as &dyn Drawings),
            lives: lives.as_ref(),
            rate_change: drawing.page.rate_change,
        }),
        painter: &Painter::new(&drawing.fonts),
        fonts: &drawing.fonts,
        strip: match &figure {
            Some((figure, _)) => Some(&figure.scene),
            None => strip.as_ref().map(|s| &s.scene),
        },
        latex: figure.as_ref().map(|(_, latex)| latex.as_str()),
        options: job.sequence.clone(),
    };
    let written = write(job, &sequence, watch)?;
    Ok(Rendered {
        mission,
        notices: all,
        written,
    })
}

/// The part of the mission that data files contain if the view's options choose elements, with a notice that says so.
fn chosen(job: &Render, mission: &Mission, notices: &mut Notices) -> Option<Mission> {
    let view = &job.drawing.view;
    let is_data = |o: &Output| !o.format.is_viewed;
    if !view.is_filter() || !job.outputs.iter().any(is_data) {
        return None;
    }
    let part = filtered(mission, view);
    let many = |all: &Mission| [all.elements.nodes.len(), all.elements.topics.len()];
    let ([nodes, topics], [all_nodes, all_topics]) = (many(&part), many(mission));
    let text = format!(
        "data contains what the filters choose: {nodes} of {all_nodes} nodes, {topics} of {all_topics} topics"
    );
    notices.add(Notice::new(NoticeKind::Note, text));
    Some(part)
}

fn write(job: &Render, sequence: &Sequence<'_>, watch: &mut dyn Watch) -> Result<Vec<Written>> {
    if let Some(warning) = long_job(job, sequence) {
        watch.note(&warning);
    }
    watch.stage(Stage::Draw);
    let mut progress = |done: usize, total: usize| {
        watch.progress(done as u64, total as u64);
        if watch.stopped() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    run::run(sequence, &job.outputs, &mut progress)
}

/// The name of the phase of every window: the last one that begins before its end.
fn phases(mission: &Mission) -> Vec<String> {
    let phases = &mission.log.phases;
    let name = |end| {
        let next = phases.partition_point(|phase| phase.span.start < end);
        let phase = next.checked_sub(1).map(|at| phases[at].name.to_string());
        phase.unwrap_or_default()
    };
    mission.windows.iter().map(|w| name(w.span.end)).collect()
}

/// The number of frames above which a note is printed before drawing.
const MANY_FRAMES: usize = 2000;
/// Milliseconds per frame and per megapixel on one core: 1.5 times the results of `tests/bench/drawing.rs`.
const FRAME_MS: (f64, f64) = (4.0, 13.0);

/// The note before a job with very many frames: their number, the estimated time, and an alternative.
fn long_job(job: &Render, sequence: &Sequence<'_>) -> Option<String> {
    let is_drawn = |o: &Output| o.format.is_drawn && o.format.whole != OneDrawing::Asked;
    let is_film = job
        .outputs
        .iter()
        .all(|o| !is_drawn(o) || o.format.is_film());
    let frames = sequence.frame_times(is_film).len();
    if frames <= MANY_FRAMES || !job.outputs.iter().any(is_drawn) {
        return None;
    }
    let size = sequence.picture.scene(0).size;
    let pixels = size.w * size.h * sequence.options.scale * sequence.options.scale / 1e6;
    let cores = run::cores() as f64;
    let ms = frames as f64 * (FRAME_MS.0 + FRAME_MS.1 * pixels) / cores;
    let about = words::duration(cast::to_i64((ms / 1000.0).ceil()) * 1_000_000_000);
    let windows = &sequence.mission.windows;
    let (first, last) = (windows.first()?, windows.last()?);
    let sensible = default_period(last.span.end.since(first.span.start));
    let advice = if sensible > sequence.mission.period {
        let period = words::period(sensible.nanos());
        format!("`--period {}`", period.replace(' ', ""))
    } else {
        "`--start` and `--end`".to_owned()
    };
    Some(format!(
        "{frames} frames will take about {about}; to show less, use {advice}"
    ))
}

/// The most rows below a frame, and the height of the page for each, in pixels: the graph needs the rest.
const ROWS: (f64, f64) = (8.0, 78.0);

/// The number of rows below a frame of this height.
fn most_rows(height: f64) -> usize {
    cast::to_usize((height / ROWS.1).clamp(1.0, ROWS.0))
}

/// Writes a mission whose picture is the topic timeline.
fn show_timeline(
    job: &Render,
    mission: Mission,
    drawing: &Drawing,
    view: &View,
    watch: &mut dyn Watch,
) -> Result<Rendered> {
    let mut all = mission.notices.clone();
    all.extend(unmatched(&mission.elements, &drawing.view));
    if drawing.body == Body::Auto {
        let text = "most publishers are unknown; drawing a topic timeline instead of a graph (draw what is known with `--mode all`)";
        all.add(Notice::new(NoticeKind::Note, text));
    }
    let (nodes, topics) = (&drawing.view.ns_filter, &drawing.view.topic_filter);
    let source = FigureSource::new(&mission, nodes, topics, false);
    let page = drawing.page.clone();
    let is_sized = drawing.is_sized || !drawing.is_fitted;
    let timeline = TopicTimeline::new(
        &source,
        view,
        &drawing.style,
        &drawing.fonts,
        page,
        is_sized,
    );
    let overview = timeline.overview();
    let data = chosen(job, &mission, &mut all);
    let lives = Timeline::new(
        &source,
        by_namespace(rows::of(&source, true), mission.span, false),
    );
    // Each topic has its own row.
    let mut each = drawing.clone();
    each.view.group = Grouping::parse("none")?;
    let opened = unfolded::opened(&mission, &each, None, &job.outputs)?;
    let sequence = Sequence {
        mission: &mission,
        data: data.as_ref().unwrap_or(&mission),
        places: None,
        notices: &all,
        view,
        picture: &timeline,
        unfolded: Some(Unfolded {
            view: opened.as_ref().unwrap_or(view),
            picture: None,
            lives: Some(&lives),
            rate_change: drawing.page.rate_change,
        }),
        painter: &Painter::new(&drawing.fonts),
        fonts: &drawing.fonts,
        strip: Some(&overview.scene),
        latex: None,
        options: job.sequence.clone(),
    };
    let written = write(job, &sequence, watch)?;
    Ok(Rendered {
        mission,
        notices: all,
        written,
    })
}

/// The requested figure with its LaTeX code, if any.
fn drawn_figure(
    job: &Render,
    mission: &Mission,
    watch: &mut dyn Watch,
) -> Result<Option<(Figure, String)>> {
    let Some(options) = &job.sequence.figure else {
        return Ok(None);
    };
    let options = FigureOptions {
        is_named: job.reading.phases.is_named(),
        ..options.clone()
    };
    super::figure::draw(mission, &job.drawing, &options, &job.outputs, watch).map(Some)
}

/// The film strip, if requested or needed by an output.
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
    let source = StripSource {
        mission,
        view,
        picture,
        style: &job.drawing.style,
        fonts: &job.drawing.fonts,
        engine: job.drawing.engine,
    };
    let choice = asked.unwrap_or(&Choice::Changes);
    let width = match page.width_mm {
        Some(mm) => StripWidth::Paper(mm),
        None if job.drawing.is_sized => StripWidth::AtLeast(page.size.w),
        None => StripWidth::About(page.size.w),
    };
    strip(source, choice, width).map(Some)
}
