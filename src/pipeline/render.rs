//! The job of `bagreel render`: reads once, decides which picture there is, draws it once and writes every output.

use std::ops::ControlFlow;
use std::path::PathBuf;

use super::compose::Composed;
use super::fit::{LARGEST, fitted};
use super::unfolded::Opened;
use super::{Body, Drawing, Purpose, Reading, Stage, Watch, figure, read};
use crate::base::error::{Error, Result};
use crate::base::geometry::Size;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::{cast, words};
use crate::draw::paint::raster::Painter;
use crate::draw::picture::Picture;
use crate::draw::strip::{SHAPES, Strip, StripSource, StripWidth, strip};
use crate::draw::timeline::rows::{self, by_namespace, together};
use crate::draw::timeline::{FigureSource, Timeline};
use crate::draw::topic_timeline::TopicTimeline;
use crate::export::sequence::{self, Choice, Drawings, FigureOptions, Sequence, Unfolded};
use crate::export::{self, OneDrawing, Output, Written, mermaid, run};
use crate::graph::window::default_period;
use crate::layout::LayoutOptions;
use crate::mission::Mission;
use crate::mission::phases::knows_publishers;
use crate::view::{Grouping, Mode, View, check_filters, filtered, nothing, unmatched};

/// Pixels of an image per pixel of a page on paper: 300 instead of 96 to the inch.
const PAPER: f64 = 300.0 / 96.0;

/// The whole job of `bagreel render`.
#[derive(Clone)]
#[non_exhaustive]
pub struct Render {
    /// The inputs and how they are read.
    pub reading: Reading,
    /// The options of the picture.
    pub drawing: Drawing,
    /// The options of the sequence.
    pub sequence: sequence::SequenceOptions,
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
            sequence: sequence::SequenceOptions::default(),
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
/// As [`export::check()`]; [`Error::Usage`] for a figure in an output that cannot contain one, and LaTeX code without a
/// figure.
pub(crate) fn check(job: &Render) -> Result<()> {
    let is_figure = job.sequence.figure.is_some();
    let no_whole = |o: &&Output| o.format.whole == OneDrawing::Never || o.target.is_numbered();
    if let Some(output) = job.outputs.iter().find(no_whole).filter(|_| is_figure) {
        let path = output.target.path().display();
        return Err(Error::usage(
            format!("`{path}` cannot contain a figure"),
            "figures are `.pdf`, `.svg`, `.png` or `.webp`, and `.tex` to include them; `bagreel render` writes the rest",
        ));
    }
    let is_latex = |o: &&Output| o.format.word == "tex";
    if let Some(output) = job.outputs.iter().find(is_latex).filter(|_| !is_figure) {
        return Err(export::needs_figure(&output.target));
    }
    let mut kept = job.reading.files();
    kept.extend_from_slice(&job.kept);
    let outputs = job.outputs.iter().chain(&job.still);
    export::check(&outputs.cloned().collect::<Vec<_>>(), &kept)
}

/// Draws and writes a mission.
///
/// # Errors
/// As [`render`].
pub(crate) fn show(job: &Render, mut mission: Mission, watch: &mut dyn Watch) -> Result<Rendered> {
    check_filters(&mission.elements, &job.drawing.view)?;
    let still = still(job, &mut mission);
    let outputs = still.map_or(&job.outputs[..], std::slice::from_ref);
    let is_grouped = |o: &Output| o.format.is_drawn && !has_all_topics(o);
    let has_grouped = outputs.iter().any(is_grouped);
    let mut notices = Notices::new();
    let mut written = vec![Written::default(); outputs.len()];
    // Both drawings of the mission are the same as if only one kind of output had been requested.
    for is_grouped in [true, false] {
        let own = outputs.iter().enumerate();
        let own = own.filter(|(_, o)| (has_grouped && !has_all_topics(o)) == is_grouped);
        let (places, outputs): (Vec<usize>, Vec<Output>) = own.map(|(k, o)| (k, o.clone())).unzip();
        if outputs.is_empty() && (is_grouped || !written.is_empty()) {
            continue;
        }
        let mut showing = Showing::new(job, &mission, outputs);
        for (at, file) in places.into_iter().zip(showing.show(watch)?) {
            written[at] = file;
        }
        let known: Vec<Notice> = notices.iter().collect();
        let more = showing.notices.iter().filter(|n| !known.contains(n));
        notices.extend(more);
    }
    Ok(Rendered {
        mission,
        notices,
        written,
    })
}

/// The still instead of an animation if there is nothing to animate, with a note on how to get an animation.
fn still<'a>(job: &'a Render, mission: &mut Mission) -> Option<&'a Output> {
    let still = job.still.as_ref()?;
    let is_timeline =
        PictureKind::of(job, mission, std::slice::from_ref(still)) == PictureKind::TopicTimeline;
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
    Some(still)
}

/// Whether an output has each topic as a separate element: pages with expandable boxes, and graph files. Pictures may
/// show a topic as a row of a box.
fn has_all_topics(output: &Output) -> bool {
    let format = output.format;
    format.is_unfolded || format.is_viewed && !format.is_drawn
}

/// The picture that outputs show, decided once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PictureKind {
    /// None: the mission as data, or the graph as text.
    Nothing,
    /// The graph: a film, its frames, a strip of them, or a still of the whole mission.
    Graph,
    /// Topics over time: the publishers of most messages are unknown.
    TopicTimeline,
    /// A figure for a paper.
    Figure,
}

impl PictureKind {
    fn of(job: &Render, mission: &Mission, outputs: &[Output]) -> Self {
        if job.sequence.figure.is_some() {
            return Self::Figure;
        }
        if !outputs.iter().any(|o| o.format.is_drawn) {
            return Self::Nothing;
        }
        match job.drawing.body {
            Body::Graph => Self::Graph,
            Body::Auto if knows_publishers(&mission.elements, &mission.sending) => Self::Graph,
            Body::Auto | Body::TopicTimeline => Self::TopicTimeline,
        }
    }
}

/// Outputs of a mission that show the same drawing.
struct Showing<'a> {
    job: &'a Render,
    mission: &'a Mission,
    outputs: Vec<Output>,
    kind: PictureKind,
    drawing: Drawing,
    painter: Painter,
    /// All notices about the mission and this drawing of it.
    notices: Notices,
    /// The part of the mission that data files contain if the view's options choose elements.
    data: Option<Mission>,
}

impl<'a> Showing<'a> {
    /// Pictures show topics as words on lines, while pages and graph files have each as an element.
    fn new(job: &'a Render, mission: &'a Mission, outputs: Vec<Output>) -> Self {
        let mut drawing = job.drawing.clone();
        let is_picture = !outputs.iter().any(has_all_topics);
        drawing.view.is_picture = is_picture;
        drawing.view.is_bundled = is_picture && drawing.view.mode == Mode::Nodes;
        drawing.page.title.get_or_insert_with(|| mission.title());
        if job.reading.phases.is_named() {
            drawing.page.phases = phases(mission);
        }
        let mut notices = mission.notices.clone();
        notices.extend(unmatched(&mission.elements, &drawing.view));
        let mut showing = Self {
            job,
            mission,
            kind: PictureKind::of(job, mission, &outputs),
            painter: Painter::new(&drawing.fonts),
            outputs,
            drawing,
            notices,
            data: None,
        };
        showing.choose_data();
        showing
    }

    /// Lets data files contain what the view's options choose, with a notice that says so.
    fn choose_data(&mut self) {
        let view = &self.job.drawing.view;
        if !view.is_filter() || self.outputs.iter().all(|o| o.format.is_viewed) {
            return;
        }
        let part = filtered(self.mission, view);
        let many = |all: &Mission| [all.elements.nodes.len(), all.elements.topics.len()];
        let ([nodes, topics], [all_nodes, all_topics]) = (many(&part), many(self.mission));
        self.remark(format!(
            "data contains what the filters choose: {nodes} of {all_nodes} nodes, {topics} of {all_topics} topics"
        ));
        self.data = Some(part);
    }

    fn remark(&mut self, text: impl Into<String>) {
        self.notices.add(Notice::new(NoticeKind::Note, text));
    }

    /// Draws and writes.
    fn show(&mut self, watch: &mut dyn Watch) -> Result<Vec<Written>> {
        match self.kind {
            PictureKind::Nothing | PictureKind::Graph => self.graph(watch),
            PictureKind::TopicTimeline => self.topic_timeline(watch),
            PictureKind::Figure => self.figure(watch),
        }
    }

    /// The sequence without a picture.
    fn sequence<'s>(&'s self, view: &'s View) -> Sequence<'s> {
        let mut options = self.job.sequence.clone();
        if self.drawing.page.width_mm.is_some() || self.kind == PictureKind::Figure {
            options.scale *= PAPER;
        }
        Sequence {
            mission: self.mission,
            data: self.data.as_ref().unwrap_or(self.mission),
            places: None,
            notices: &self.notices,
            view,
            picture: &(),
            unfolded: None,
            paired: None,
            painter: &self.painter,
            fonts: &self.drawing.fonts,
            strip: None,
            latex: None,
            options,
        }
    }

    /// The source of rows over time.
    fn source(&self, is_named: bool) -> FigureSource<'a> {
        let view = &self.drawing.view;
        FigureSource::new(self.mission, &view.ns_filter, &view.topic_filter, is_named)
    }

    /// Writes outputs that show the graph, and those that show no picture.
    fn graph(&mut self, watch: &mut dyn Watch) -> Result<Vec<Written>> {
        let (job, mission) = (self.job, self.mission);
        let is_drawn = self.kind == PictureKind::Graph;
        let source = self.source(job.reading.phases.is_named());
        let rows = is_drawn.then(|| rows::of(&source, !source.knows_publishers()));
        if let Some(rows) = &rows {
            let most = most_rows(self.drawing.page.size.h);
            let rows = together(&source, rows.clone(), most, false);
            self.drawing.page.timeline = Timeline::named(&source, rows);
        }
        let is_chosen = self.drawing.is_sized || self.drawing.page.width_mm.is_some();
        let is_single = |strip: &&Choice| matches!(strip, Choice::Windows(k) if k.len() == 1);
        let strip = job.sequence.strip.as_ref().filter(|s| !is_single(s));
        if strip.is_some() && !is_chosen {
            // Two such panels side by side fit a screen.
            self.drawing = self.drawing.clone().seen(Purpose::Readme);
        }
        let mut composed = if is_drawn {
            fitted(mission, &self.drawing, watch)
        } else if self.outputs.iter().any(|o| o.format.is_viewed) {
            self.unplaced(&self.drawing)
        } else {
            Composed::default()
        };
        let paired = self.paired(&mut composed);
        let (view, elements) = (&composed.view, &mission.elements);
        if is_drawn && view.items.is_empty() && elements.nodes.len() + elements.topics.len() > 0 {
            return Err(nothing(elements));
        }
        let drawing = self.drawing.clone();
        let picture = is_drawn.then(|| composed.picture(&drawing));
        let opened = Opened::new(mission, &drawing, Some(view), &self.outputs)?;
        let opened_picture = opened.as_ref().and_then(|opened| opened.drawings(&drawing));
        let rows = rows.filter(|_| opened.is_some());
        let lives =
            rows.map(|rows| Timeline::new(&source, by_namespace(rows, mission.span, false)));
        let lives = job.sequence.pairs.clone().or(lives);
        let strip = match &picture {
            Some(picture) => self.side_by_side(view, picture)?,
            None => None,
        };
        let remarks = strip.iter().flat_map(|strip| &strip.remarks);
        remarks.for_each(|text| self.remark(text));
        self.notices.extend(composed.notices.iter());
        let places = is_drawn.then(|| composed.places());
        let sequence = Sequence {
            places: places.as_ref(),
            picture: picture.as_ref().map_or(&(), |p| p as &dyn Drawings),
            unfolded: opened.as_ref().map(|opened| Unfolded {
                view: &opened.whole.view,
                picture: opened_picture.as_ref().map(|p| p as &dyn Drawings),
                lives: lives.as_ref(),
                rate_change: drawing.page.rate_change,
            }),
            strip: strip.as_ref().map(|strip| &strip.scene),
            paired: paired.as_ref().map(|paired| &paired.view),
            ..self.sequence(view)
        };
        self.write(&sequence, watch)
    }

    /// The view of a drawing without positions, which has no notices: nothing is missing from a graph file.
    fn unplaced(&self, drawing: &Drawing) -> Composed {
        let (view, page) = (drawing.view.clone(), drawing.page.clone());
        Composed {
            notices: Notices::new(),
            ..Composed::new(self.mission, view, page)
        }
    }

    /// The view with one line per pair of nodes, if an output is or contains a chart in which topics were not asked for.
    /// Of a large chart alone, it replaces the view of each topic, so that only one of the two is in memory.
    fn paired(&self, composed: &mut Composed) -> Option<Composed> {
        let mut drawing = self.drawing.clone();
        let is_chart = |output: &Output| matches!(output.format.word, "mmd" | "md");
        let is_free = !drawing.view.keeps_topics && self.outputs.iter().any(is_chart);
        (drawing.view.mode, drawing.view.is_bundled) = (Mode::Nodes, true);
        drawing.view.is_picture = false;
        let is_alone = self.outputs.iter().all(|o| o.format.word == "mmd");
        if is_free && is_alone && composed.view.arrows.len() > mermaid::MANY {
            *composed = Composed::default();
            *composed = self.unplaced(&drawing);
            return None;
        }
        is_free.then(|| self.unplaced(&drawing))
    }

    /// The film strip, if requested or needed by an output.
    fn side_by_side(&self, view: &View, picture: &Picture<'_>) -> Result<Option<Strip>> {
        let asked = self.job.sequence.strip.as_ref();
        if asked.is_none() && !export::needs_strip(&self.outputs, view.frames.len()) {
            return Ok(None);
        }
        let (drawing, page) = (&self.job.drawing, &self.job.drawing.page);
        let width = match page.width_mm {
            Some(mm) => StripWidth::Paper(mm),
            None if drawing.is_sized => StripWidth::AtLeast(page.size.w),
            None => StripWidth::About(page.size.w),
        };
        // On paper, where space is scarce, panels of other shapes may be more legible.
        let shapes: &[f64] = match width {
            StripWidth::Paper(_) => &SHAPES,
            StripWidth::AtLeast(_) | StripWidth::About(_) => &[],
        };
        let page = LayoutOptions {
            page: Size::new(1000.0, 1000.0),
            ..LayoutOptions::default()
        };
        let source = StripSource {
            mission: self.mission,
            view,
            picture,
            style: &drawing.style,
            fonts: &drawing.fonts,
            others: &drawing.of_shapes(picture.plan(), &page, shapes),
        };
        strip(source, asked.unwrap_or(&Choice::Changes), width).map(Some)
    }

    /// Writes outputs that show the topic timeline.
    fn topic_timeline(&mut self, watch: &mut dyn Watch) -> Result<Vec<Written>> {
        if self.drawing.body == Body::Auto {
            self.remark("most publishers are unknown; drawing a topic timeline instead of a graph (draw what is known with `--mode all`)");
        }
        // Its rows show when everything was there.
        self.drawing.view.is_still = Some(false);
        let (drawing, mission) = (&self.drawing, self.mission);
        let composed = self.unplaced(drawing);
        let source = self.source(false);
        // A slide has one size.
        let largest = match &drawing.medium {
            Some(medium) => medium.sizes.last().filter(|_| medium.sizes.len() > 1),
            None => (!drawing.is_sized).then_some(&LARGEST),
        };
        let largest = largest.filter(|_| drawing.is_fitted).copied();
        let (style, fonts, page) = (&drawing.style, &drawing.fonts, drawing.page.clone());
        let timeline = TopicTimeline::new(&source, &composed.view, style, fonts, page, largest);
        let overview = timeline.overview();
        let rows = by_namespace(rows::of(&source, true), mission.span, false);
        let lives = Timeline::new(&source, rows);
        // Each topic has its own row.
        let mut each = drawing.clone();
        each.view.group = Grouping::parse("none")?;
        let opened = Opened::new(mission, &each, None, &self.outputs)?;
        let view = &composed.view;
        let sequence = Sequence {
            picture: &timeline,
            unfolded: Some(Unfolded {
                view: opened.as_ref().map_or(view, |opened| &opened.whole.view),
                picture: None,
                lives: Some(&lives),
                rate_change: drawing.page.rate_change,
            }),
            strip: Some(&overview.scene),
            ..self.sequence(view)
        };
        self.write(&sequence, watch)
    }

    /// Writes outputs that contain the figure.
    fn figure(&mut self, watch: &mut dyn Watch) -> Result<Vec<Written>> {
        let options = FigureOptions {
            is_named: self.job.reading.phases.is_named(),
            ..self.job.sequence.figure.clone().unwrap_or_default()
        };
        let (mission, drawing) = (self.mission, &self.job.drawing);
        let (scene, remarks, latex) =
            figure::draw(mission, drawing, &options, &self.outputs, watch)?;
        for text in &remarks {
            self.remark(text);
        }
        let view = View::default();
        let sequence = Sequence {
            strip: Some(&scene),
            latex: Some(&latex),
            ..self.sequence(&view)
        };
        self.write(&sequence, watch)
    }

    fn write(&self, sequence: &Sequence<'_>, watch: &mut dyn Watch) -> Result<Vec<Written>> {
        if let Some(warning) = self.long_job(sequence) {
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
        run::run(sequence, &self.outputs, &mut progress)
    }

    /// The note before a job with very many frames: their number, the estimated time, and an alternative.
    fn long_job(&self, sequence: &Sequence<'_>) -> Option<String> {
        let is_drawn = |o: &&Output| o.format.is_drawn && o.format.whole != OneDrawing::Asked;
        let mut drawn = self.outputs.iter().filter(is_drawn).peekable();
        drawn.peek()?;
        let are_films = drawn.all(|o| o.format.is_film());
        let frames = sequence.frame_times(are_films).len();
        if frames <= MANY_FRAMES {
            return None;
        }
        let size = sequence.picture.scene(0).size;
        let pixels = size.w * size.h * sequence.options.scale * sequence.options.scale / 1e6;
        let cores = run::cores() as f64;
        let ms = frames as f64 * (FRAME_MS.0 + FRAME_MS.1 * pixels) / cores;
        let about = words::duration(cast::to_i64((ms / 1000.0).ceil()) * 1_000_000_000);
        let windows = &self.mission.windows;
        let (first, last) = (windows.first()?, windows.last()?);
        let sensible = default_period(last.span.end.since(first.span.start));
        let advice = if sensible > self.mission.period {
            let period = words::period(sensible.nanos());
            format!("`--period {}`", period.replace(' ', ""))
        } else {
            "`--start` and `--end`".to_owned()
        };
        Some(format!(
            "{frames} frames will take about {about}; to show less, use {advice}"
        ))
    }
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

/// The most rows below a frame, and the height of the page for each, in pixels: the graph needs the rest.
const ROWS: (f64, f64) = (8.0, 78.0);

/// The number of rows below a frame of this height.
fn most_rows(height: f64) -> usize {
    cast::to_usize((height / ROWS.1).clamp(1.0, ROWS.0))
}
