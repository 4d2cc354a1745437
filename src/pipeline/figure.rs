//! Draws the requested figure and generates its LaTeX code. Those of the graph are the picture at paper size.

use super::compose::Composed;
use super::fit::fitted;
use super::{Drawing, Medium, Watch};
use crate::base::error::{Error, Result};
use crate::base::geometry::Size;
use crate::base::name::last_part;
use crate::base::time::Stamp;
use crate::base::words;
use crate::draw::figure::steps::{self, StepPanel, graph_width};
use crate::draw::figure::{self, FigureKind, FigureSheet, Latex, nothing};
use crate::draw::picture::PageOptions;
use crate::draw::scene::Scene;
use crate::draw::timeline::FigureSource;
use crate::draw::timeline::canvas::PX_PER_MM;
use crate::draw::timeline::drawer::clock;
use crate::draw::timeline::notes::title;
use crate::export::Output;
use crate::export::sequence::FigureOptions;
use crate::graph::Element;
use crate::layout::LayoutOptions;
use crate::mission::Mission;
use crate::mission::event_log::Detail;
use crate::view::marked::News;
use crate::view::{Mark, Mode, View, ViewOptions};

/// The most namespaces that a remark names.
const MOST_NAMED: usize = 3;
/// The number of steps shown unless some are requested.
const SHOWN: usize = 6;
/// The height of a panel beside its graph in pixels, for the area that a panel takes.
const AROUND: f64 = 30.0;
/// The additional cost of a panel as high as wide, as a share of its area.
const HIGH: f64 = 0.5;
/// The shapes of a panel's graph that are tried, height over width, the lowest first.
const SHAPES: [f64; 5] = [0.3, 0.5, 0.8, 1.3, 2.0];

/// The figure, whose size is that on paper, remarks for the user, and its LaTeX code.
///
/// # Errors
/// [`Error::Usage`] if nothing is left to draw, or if it does not fit; the hint suggests what would.
pub(super) fn draw(
    mission: &Mission,
    drawing: &Drawing,
    options: &FigureOptions,
    outputs: &[Output],
    watch: &mut dyn Watch,
) -> Result<(Scene, Vec<String>, Latex)> {
    let filters = (&drawing.view.ns_filter, &drawing.view.topic_filter);
    let source = FigureSource::new(mission, filters.0, filters.1, options.is_named);
    let sheet = FigureSheet::new(&source, &drawing.fonts, options);
    let (scene, remarks) = match options.kind {
        FigureKind::Lives => sheet.lives()?,
        FigureKind::Graph => of_graph(&sheet, drawing, watch)?,
        FigureKind::Holders => (figure::holders(&sheet)?, Vec::new()),
        FigureKind::Steps => (of_steps(&sheet, drawing)?, Vec::new()),
    };
    let is_included = |o: &&Output| ["pdf", "png", "svg"].contains(&o.format.word);
    let picture = match outputs.iter().find(is_included) {
        Some(output) => output.target.path().to_owned(),
        None => format!("{}.pdf", options.kind.word()).into(),
    };
    let is_special = |c: char| c.is_control() || "\\{}%#~^$&".contains(c);
    let name = picture.display().to_string();
    if name.contains(is_special) && outputs.iter().any(|o| o.format.word == "tex") {
        let what = format!("LaTeX cannot include a file called `{name}`");
        let hint = "give the picture a name of letters, digits, `.`, `-` and `_`";
        return Err(Error::usage(what, hint));
    }
    let latex = Latex {
        picture,
        caption: figure::caption(&source, options, &remarks),
        is_wide: options.width_mm > 120.0,
    };
    Ok((scene, remarks, latex))
}

/// The drawing of a figure: on paper, with one line per pair of nodes.
fn on_paper(sheet: &FigureSheet<'_>, drawing: &Drawing, width_mm: f64) -> Drawing {
    let paper = Drawing {
        view: ViewOptions {
            mode: Mode::Nodes,
            is_picture: true,
            is_bundled: true,
            is_still: Some(false),
            ..drawing.view.clone()
        },
        page: PageOptions {
            bare: true,
            ..drawing.page.clone()
        },
        ..drawing.clone()
    };
    paper.on(Medium::paper(width_mm, sheet.options.text_pt))
}

/// The graph of the whole mission.
fn of_graph(
    sheet: &FigureSheet<'_>,
    drawing: &Drawing,
    watch: &mut dyn Watch,
) -> Result<(Scene, Vec<String>)> {
    let mission = sheet.source.mission;
    let mut drawing = on_paper(sheet, drawing, sheet.options.width_mm);
    drawing.view.is_still = Some(true);
    let composed = fitted(mission, &drawing, watch);
    if composed.view.items.is_empty() {
        return Err(nothing(sheet.source));
    }
    if composed.view.arrows.is_empty() {
        return Err(Error::usage(
            "no topic has both a known publisher and a known subscriber, so there is no graph to draw",
            "draw `--kind lives` instead, or add connections with `--topology FILE`",
        ));
    }
    let measured = composed.measured(&drawing);
    let is_legible = measured.text_px(&composed.layout) >= drawing.readable();
    if !is_legible {
        let width = sheet.options.width_mm;
        return Err(Error::usage(
            format!("a graph of this mission does not fit legibly in {width} mm"),
            if width < 181.0 {
                "use `--width 181mm`, or draw less with `--ns-filter`"
            } else {
                "draw less with `--ns-filter`"
            },
        ));
    }
    let folded = &composed.options.collapse;
    let names = words::some_of(folded, MOST_NAMED);
    let remark = format!("not all nodes fit, so that each of these namespaces is one box: {names}");
    let remarks = (!folded.is_empty()).then_some(remark).into_iter().collect();
    let picture = composed.picture(&drawing).scene(0);
    Ok((figure::graph(sheet, picture), remarks))
}

/// The reconfigurations, one by one.
fn of_steps(sheet: &FigureSheet<'_>, drawing: &Drawing) -> Result<Scene> {
    let source = sheet.source;
    if source.roles.is_empty() {
        return Err(nothing(source));
    }
    if source.phases.is_empty() {
        return Err(Error::usage(
            "this mission has a single phase and therefore no steps",
            "draw `lives` instead, or set your own phases with `--phases FILE`",
        ));
    }
    // A step lasts from the middle of the phase before to the middle of the one after.
    let middle = |k: usize| {
        let span = source.phases[k].span;
        span.start.plus(span.nanos() / 2)
    };
    let many = source.phases.len();
    // In the only window, what begins could not be distinguished from what is there from the start.
    let base = usize::from(many == 2);
    let middles: Vec<Stamp> = (1 - base..many - 1).map(middle).collect();
    let mission = source.mission.joined(&middles);
    let drawing = on_paper(sheet, drawing, sheet.options.width_mm);
    let whole = Composed::new(&mission, drawing.view.clone(), drawing.page.clone());
    let all = (1..many).filter_map(|k| Some((k, whole.view.news(k - 1 + base)?)));
    let all: Vec<(usize, News)> = all.collect();
    let mut chosen = chosen(sheet, &all)?;
    let mm = sheet.options.width_mm;
    let picture = |(at, (_, news)): (usize, &(usize, News))| {
        let is_chosen = chosen.contains(&at);
        is_chosen.then(|| narrowest(&drawing, news, mm)).flatten()
    };
    let pictures: Vec<Option<(usize, Scene)>> = all.iter().enumerate().map(picture).collect();
    loop {
        let panels = chosen.iter().map(|at| {
            let (k, news) = &all[*at];
            Some(panel(source, *k, news, pictures[*at].clone()?))
        });
        let Some(panels) = panels.collect::<Option<Vec<_>>>() else {
            let hint = if mm < 181.0 {
                "use `--width 181mm`"
            } else {
                "omit nodes with `--ns-filter`"
            };
            return Err(Error::usage(format!("a step is wider than {mm} mm"), hint));
        };
        let scene = steps::page(sheet, panels, all.len() - chosen.len());
        if figure::fits(&scene) {
            return Ok(scene);
        }
        if chosen.len() == 1 || !sheet.options.steps.is_empty() {
            return Err(Error::usage(
                format!("these steps are higher than {} mm", figure::MOST_HEIGHT),
                "show fewer with `--steps 3`, or omit nodes with `--ns-filter`",
            ));
        }
        let least = chosen.iter().copied().min_by_key(|at| weight(&all[*at].1));
        chosen.retain(|at| Some(*at) != least);
    }
}

/// The steps to show, as indices in `all`: those that lead into the phases asked for, else the largest.
fn chosen(sheet: &FigureSheet<'_>, all: &[(usize, News)]) -> Result<Vec<usize>> {
    let (asked, many) = (&sheet.options.steps, sheet.source.phases.len());
    if let Some(wrong) = asked.iter().find(|n| **n < 2 || **n > many) {
        return Err(Error::usage(
            format!("no step leads into phase {wrong}"),
            format!("phases are counted from 1 to {many}; steps lead into 2 to {many}"),
        ));
    }
    let is_asked = |at: &usize| asked.is_empty() || asked.contains(&(all[*at].0 + 1));
    let mut chosen: Vec<usize> = (0..all.len()).filter(is_asked).collect();
    if chosen.is_empty() {
        return Err(Error::usage(
            "no node starts, stops or hands over a topic, so there is no step to draw",
            "draw `--kind lives` instead",
        ));
    }
    if asked.is_empty() {
        chosen.sort_by_key(|at| std::cmp::Reverse(weight(&all[*at].1)));
        chosen.truncate(SHOWN);
        chosen.sort_unstable();
    }
    Ok(chosen)
}

/// The weight of a step, larger for one that changes more: nodes count most.
fn weight(news: &News) -> usize {
    let counts = news.view.frames.first().map(|frame| frame.counts);
    counts.map_or(0, |counts| {
        let nodes = counts.nodes_added + counts.nodes_removed + counts.restarted;
        4 * nodes + counts.total()
    })
}

/// The drawing of a step that takes the smallest area of the page, with the number of columns that it spans: a
/// high one costs more, since lines between boxes one below another are hard to follow. `None` if it fits in no number of columns.
fn narrowest(drawing: &Drawing, news: &News, width_mm: f64) -> Option<(usize, Scene)> {
    // Only rates that change are news.
    let view = news.view.without_rates();
    let drawn = steps::spans(width_mm).filter_map(|span| {
        let width = graph_width(width_mm, span) * PX_PER_MM;
        Some((span, narrow(drawing, &view, width)?))
    });
    let cost = |(span, picture): &(usize, Scene)| {
        let Size { w, h } = picture.size;
        *span as f64 * (h + AROUND) * (1.0 + HIGH * h / w)
    };
    drawn.min_by(|a, b| cost(a).total_cmp(&cost(b)))
}

/// The lowest drawing of a step that is at most this wide in pixels, without anything around it; `None` if none is.
fn narrow(drawing: &Drawing, view: &View, width: f64) -> Option<Scene> {
    let margin = drawing.style.page.margin * drawing.page.unit.unwrap_or(1.0);
    let scale = drawing.page.largest.unwrap_or(1.0);
    let measured = |size: Size| {
        let page = PageOptions {
            size,
            ..drawing.page.clone()
        };
        drawing.measured(view, page)
    };
    let room = (width - 2.0 * margin) / scale;
    let page = LayoutOptions {
        page: Size::new(room, room),
        least: 1.0,
        ..LayoutOptions::default()
    };
    let any = measured(Size::new(width, width));
    let layouts = drawing.of_shapes(any.plan(), &page, &SHAPES).into_iter();
    let fitting = layouts.filter(|layout| layout.size.w <= room);
    let layout = fitting.min_by(|a, b| a.size.h.total_cmp(&b.size.h))?;
    let [w, h] = [layout.size.w, layout.size.h].map(|side| side * scale + 2.0 * margin);
    let size = Size::new(w, h);
    Some(measured(size).with(layout).scene(0))
}

/// The panel of the step into phase `k`, counted from 0.
fn panel(
    source: &FigureSource<'_>,
    k: usize,
    news: &News,
    (span, picture): (usize, Scene),
) -> StepPanel {
    let view = &news.view;
    let start = source.phases[k].span.start.since(source.span().start);
    let headlines = view.frames.iter().flat_map(|frame| &frame.headlines);
    let ids: Vec<_> = headlines.map(|headline| headline.event).collect();
    let log = &source.mission.log.events;
    let handover = |id: &crate::mission::EventId| {
        let event = log.get(*id)?;
        let (Detail::Senders { from, to }, Element::Topic(topic)) = (&event.detail, event.what)
        else {
            return None;
        };
        let role = |nodes: &[crate::graph::NodeId]| {
            let node = source.mission.elements.nodes.get(*nodes.first()?)?;
            Some(last_part(&node.role).to_owned())
        };
        let shown = source.shows(topic) && !source.is_hub(topic);
        let (name, from, to) = (last_part(source.topic(topic)), role(from)?, role(to)?);
        shown.then(|| format!("{name}: {from} → {to}"))
    };
    let seen = view.seen(0);
    let changes = seen.items.iter().filter_map(|shown| {
        let is_new = match shown.mark? {
            Mark::Added => true,
            Mark::Removed => false,
            _ => return None,
        };
        let is_digit = |c: char| c.is_ascii_digit() || c == '_';
        let name = last_part(&view.items[shown.item()].name);
        Some((is_new, name.trim_end_matches(is_digit).to_owned()))
    });
    let mut changes: Vec<(bool, String)> = changes.collect();
    changes.sort();
    StepPanel {
        number: format!("{k} → {}", k + 1),
        words: format!("{} {}", clock(start), title(source, k)),
        home: news.home.clone().unwrap_or_default(),
        picture,
        span,
        handovers: ids.iter().filter_map(handover).collect(),
        changes,
        events: ids,
        left_out: news.left_out,
    }
}
