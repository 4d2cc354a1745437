//! The map: the nodes of the whole mission with arrows from publisher to subscriber, and the phases in which
//! each exists.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::groups::{NodeGroup, depths, groups, phases_of};
use super::page::{FITTING, FigureSheet, filter_that_fits, nothing};
use super::place::{PlacedPanel, place};
use super::talks::{Talk, Talks};
use super::{MOST_HEIGHT, RowKind};
use crate::base::error::{Error, Result};
use crate::base::geometry::{Rect, Size};
use crate::base::name::{last_part, namespace};
use crate::base::words;
use crate::draw::scene::{Scene, Stroke};
use crate::draw::timeline::Timeline;
use crate::draw::timeline::canvas::{HAIRLINE, PaperCanvas, Type, ink};
use crate::draw::timeline::drawer::{Density, Drawer};
use crate::draw::timeline::legend::MOST_NAMED;
use crate::draw::timeline::notes::{flow, sentence};
use crate::draw::timeline::phases;
use crate::draw::timeline::rows::{Row, of_nodes};
use crate::layout::{Cluster, Outline, Plan, Vertex};

/// The height of a map of nodes, in millimetres, above which groups are drawn instead, if they fit.
const HIGH: f64 = 130.0;
/// The height of a node in millimetres.
const CAPSULE: f64 = 3.3;
/// The most members that a group names.
const NAMED: usize = 4;
/// The most nodes that are laid out separately; more never fit.
const MOST_NODES: usize = 120;
/// The most groups that are laid out; more never fit.
const MOST_GROUPS: usize = 60;

/// One box with the text in it.
enum MapBox {
    /// A node by its label, and its phases.
    Capsule(String, String),
    /// Nodes without a known partner.
    List(Vec<(String, String)>),
    /// A group: namespace, phases, its lines, and the cells of its bar.
    Group(String, String, Vec<String>, BTreeSet<usize>),
}

/// A map laid out.
struct MapDrawing {
    looks: Vec<MapBox>,
    /// The tracks in each of them.
    members: Vec<Vec<usize>>,
    spaces: Vec<String>,
    talks: Vec<Talk>,
    labels: Vec<Vec<Vec<String>>>,
    placed: PlacedPanel,
    /// Nodes outside framed namespaces without a known partner, which a note lists.
    alone: Vec<String>,
}

/// The figure and its remarks: with nodes, else with groups, else an error.
pub(crate) fn draw(sheet: &FigureSheet<'_>) -> Result<(Scene, Vec<String>)> {
    let tracks = of_nodes(sheet.source);
    if tracks.is_empty() {
        return Err(nothing(sheet.source));
    }
    let each: Vec<Option<usize>> = (0..tracks.len()).map(Some).collect();
    let talks = Talks::new(sheet.source, &tracks);
    if talks.between(&each, sheet.source.span(), false).is_empty() {
        return Err(Error::usage(
            "no topic has both a known publisher and a known subscriber, so there is no map to draw",
            "draw `--kind lives` instead, or add connections with `--topology FILE`",
        ));
    }
    let asked = sheet.options.rows;
    let few = tracks.len() <= MOST_NODES;
    let nodes = (asked != Some(RowKind::Groups) && few)
        .then(|| page(sheet, &tracks, None))
        .flatten();
    let is_low = |s: &Scene, most: f64| s.size.h <= most * crate::draw::timeline::canvas::PX_PER_MM;
    if let Some(scene) = nodes
        .as_ref()
        .filter(|s| asked.is_some() && is_low(s, MOST_HEIGHT) || is_low(s, HIGH))
    {
        return Ok((scene.clone(), Vec::new()));
    }
    let grouped = (asked != Some(RowKind::Nodes))
        .then(|| grouped(sheet, &tracks))
        .flatten();
    if let Some(scene) = grouped {
        let remark = format!(
            "boxes are groups, since {} do not fit separately at this width",
            words::count(tracks.len(), "node")
        );
        let remarks = if asked.is_none() {
            vec![remark]
        } else {
            Vec::new()
        };
        return Ok((scene, remarks));
    }
    match nodes.filter(|s| is_low(s, MOST_HEIGHT)) {
        Some(scene) => Ok((scene, Vec::new())),
        None => Err(too_large(sheet, &tracks)),
    }
}

/// The map of the smallest groups that fit.
fn grouped(sheet: &FigureSheet<'_>, tracks: &[Row]) -> Option<Scene> {
    let mut many = usize::MAX;
    depths(tracks).find_map(|depth| {
        let groups = groups(sheet.source, tracks, depth);
        let is_new = groups.len() < many;
        many = groups.len();
        let fits = is_new && many <= MOST_GROUPS;
        let scene = fits.then(|| page(sheet, tracks, Some(&groups))).flatten();
        scene.filter(super::page::fits)
    })
}

fn too_large(sheet: &FigureSheet<'_>, tracks: &[Row]) -> Error {
    let width = sheet.options.width_mm;
    let many = words::count(tracks.len(), "node");
    let hint = if width < 181.0 && page_at(sheet, tracks, 181.0) {
        "use `--width 181mm`".to_owned()
    } else {
        filter_that_fits(tracks, FITTING, "--ns-filter", "node")
    };
    Error::usage(format!("a map of {many} does not fit in {width} mm"), hint)
}

/// Whether groups would fit at another width.
fn page_at(sheet: &FigureSheet<'_>, tracks: &[Row], width: f64) -> bool {
    let options = super::FigureOptions {
        width_mm: width,
        ..sheet.options.clone()
    };
    let wider = FigureSheet {
        options: &options,
        ..*sheet
    };
    grouped(&wider, tracks).is_some()
}

/// The map of nodes, or of groups of them.
fn page(sheet: &FigureSheet<'_>, tracks: &[Row], groups: Option<&[NodeGroup]>) -> Option<Scene> {
    let width = sheet.options.width_mm;
    let mut canvas = sheet.canvas();
    let drawn = match groups {
        Some(groups) => of_groups(sheet, &canvas, tracks, groups),
        None => of_capsules(sheet, &canvas, tracks),
    }?;
    paint(&mut canvas, sheet, tracks, &drawn);
    let end = drawn.placed.size.h + 0.2;
    let reported = (groups.is_some(), drawn.placed.left_out, drawn.labels.len());
    let y = below(&mut canvas, sheet, end, reported, &drawn.alone);
    Some(canvas.into_scene(Size::new(width, y + 0.3), sheet.title("Map")))
}

/// Draws band, names and notes below the drawing, which ends at `end`; returns the y at which they end.
fn below(
    canvas: &mut PaperCanvas<'_>,
    sheet: &FigureSheet<'_>,
    end: f64,
    (is_grouped, left_out, many): (bool, usize, usize),
    alone: &[String],
) -> f64 {
    let width = sheet.options.width_mm;
    let mut y = end + 1.2;
    if !sheet.source.phases.is_empty() {
        let timeline = Timeline::new(sheet.source, Vec::new());
        let place = Rect::new(0.0, y, width, 0.0);
        y = Drawer::new(timeline, Density::Paper, canvas, place).ground(canvas);
        canvas.begin("words");
        y = phases::names(canvas, sheet.source, width, y);
    }
    canvas.begin("notes");
    let mut text = String::new();
    if !sheet.options.is_bare {
        text.push_str(if is_grouped {
            "Box: nodes of one namespace that start and stop together; number and bar: the phases in which they exist. "
        } else {
            "Number: the phases in which a node exists; filled: all of them. Dashed frame: nodes without a known partner. "
        });
        text.push_str("Arrow: topics, thicker = more Hz, dashed = inferred. ");
    }
    if !alone.is_empty() {
        let names = words::some_of(alone, MOST_NAMED);
        let _ = write!(text, "Without a known partner: {names}. ");
    }
    if left_out > 0 {
        let _ = write!(text, "{left_out} of {many} topic names left out.");
    }
    if text.is_empty() {
        return y;
    }
    flow(
        canvas,
        width,
        y + 0.4,
        &[sentence(ink::QUIET, text.trim_end())],
    )
}

/// The map with every node as a rounded box, namespaces as frames; `None` if it does not fit.
fn of_capsules(
    sheet: &FigureSheet<'_>,
    canvas: &PaperCanvas<'_>,
    tracks: &[Row],
) -> Option<MapDrawing> {
    let source = sheet.source;
    let talks = Talks::new(source, tracks);
    let own: Vec<Option<usize>> = (0..tracks.len()).map(Some).collect();
    let whole = source.span();
    let all = talks.between(&own, whole, false);
    let linked: BTreeSet<usize> = all.iter().flat_map(|t| [t.from, t.to]).collect();
    let phases: Vec<String> = phases_of(source, tracks)
        .iter()
        .map(|p| ranges(p, source.phases.len()))
        .collect();
    let mut spaces: Vec<String> = Vec::new();
    for track in tracks {
        let space = namespace(&track.name).to_owned();
        let many = tracks
            .iter()
            .filter(|t| namespace(&t.name) == space)
            .count();
        if space != "/" && many > 1 && !spaces.contains(&space) {
            spaces.push(space);
        }
    }
    let home = |track: &Row| spaces.iter().position(|s| s == namespace(&track.name));
    let label = |track: &Row| match home(track) {
        Some(_) => last_part(&track.name).to_owned(),
        None => track.name.trim_start_matches('/').to_owned(),
    };
    let (mut looks, mut members) = (Vec::new(), Vec::new());
    let mut vertices = Vec::new();
    let mut vertex = vec![None; tracks.len()];
    for at in linked.iter().copied() {
        members.push(vec![at]);
        let look = MapBox::Capsule(label(&tracks[at]), phases[at].clone());
        vertex[at] = Some(vertices.len());
        vertices.push(sized(canvas, &look, home(&tracks[at]), source.phases.len()));
        looks.push(look);
    }
    for space in (0..spaces.len()).map(Some) {
        let alone =
            (0..tracks.len()).filter(|at| !linked.contains(at) && home(&tracks[*at]) == space);
        let alone: Vec<usize> = alone.collect();
        for part in alone.chunks(8) {
            let line = |at: &usize| (label(&tracks[*at]), phases[*at].clone());
            let look = MapBox::List(part.iter().map(line).collect());
            members.push(part.to_vec());
            vertices.push(sized(canvas, &look, space, source.phases.len()));
            looks.push(look);
        }
    }
    let talks = talks.between(&vertex, whole, false);
    let alone = (0..tracks.len()).filter(|at| !linked.contains(at) && home(&tracks[*at]).is_none());
    let alone: Vec<String> = alone
        .map(|at| {
            format!("{} {}", label(&tracks[at]), phases[at])
                .trim_end()
                .to_owned()
        })
        .collect();
    let drawn = finished(sheet, canvas, (looks, vertices, spaces, talks), 1)?;
    Some(MapDrawing {
        members,
        alone,
        ..drawn
    })
}

/// The map with every group as a box; `None` if it does not fit.
fn of_groups(
    sheet: &FigureSheet<'_>,
    canvas: &PaperCanvas<'_>,
    tracks: &[Row],
    groups: &[NodeGroup],
) -> Option<MapDrawing> {
    let source = sheet.source;
    let mut vertex = vec![None; tracks.len()];
    let mut looks = Vec::new();
    let mut vertices = Vec::new();
    for (k, group) in groups.iter().enumerate() {
        let mut lines: Vec<String> = Vec::new();
        for at in &group.members {
            vertex[*at] = Some(k);
            if lines.len() < NAMED || group.members.len() <= NAMED + 1 {
                lines.push(last_part(&tracks[*at].name).to_owned());
            }
        }
        let more = group.members.len() - lines.len();
        if more > 0 {
            lines.push(format!("+{more} more"));
        }
        let phases = ranges(&group.phases, source.phases.len());
        let look = MapBox::Group(group.space.clone(), phases, lines, group.phases.clone());
        vertices.push(sized(canvas, &look, None, source.phases.len()));
        looks.push(look);
    }
    let talks = Talks::new(source, tracks);
    let whole = source.span();
    let talks = talks.between(&vertex, whole, false);
    let drawn = finished(sheet, canvas, (looks, vertices, Vec::new(), talks), 2)?;
    Some(MapDrawing {
        members: groups.iter().map(|g| g.members.clone()).collect(),
        ..drawn
    })
}

fn finished(
    sheet: &FigureSheet<'_>,
    canvas: &PaperCanvas<'_>,
    (looks, vertices, spaces, talks): (Vec<MapBox>, Vec<Vertex>, Vec<String>, Vec<Talk>),
    most: usize,
) -> Option<MapDrawing> {
    let title = |name: &String| Cluster {
        parent: None,
        title: Size::new(canvas.width(name, Type::Head), canvas.cap(Type::Head) + 0.9),
        footer: Size::default(),
    };
    let plan = Plan {
        vertices,
        links: talks.iter().map(Talk::link).collect(),
        clusters: spaces.iter().map(title).collect(),
        ..Plan::default()
    };
    let labels: Vec<Vec<Vec<String>>> =
        talks.iter().map(|t| t.labels(sheet.source, most)).collect();
    let placed = place(canvas, &plan, &labels, sheet.options.width_mm - 0.4)?;
    let aside = (sheet.options.width_mm - placed.size.w) / 2.0;
    Some(MapDrawing {
        looks,
        members: Vec::new(),
        spaces,
        talks,
        labels,
        placed: placed.moved(aside, 0.2),
        alone: Vec::new(),
    })
}

/// The phases as text: `2–4`, `1,3–5`; empty for all of them.
pub(crate) fn ranges(phases: &BTreeSet<usize>, many: usize) -> String {
    if phases.len() >= many {
        return String::new();
    }
    let all: Vec<usize> = phases.iter().map(|p| p + 1).collect();
    let runs = all.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [one] => one.to_string(),
        [first, .., last] => format!("{first}–{last}"),
        [] => String::new(),
    });
    runs.collect::<Vec<_>>().join(",")
}

fn sized(canvas: &PaperCanvas<'_>, look: &MapBox, cluster: Option<usize>, phases: usize) -> Vertex {
    let line = canvas.sizes.pitch();
    let named = |(name, phases): &(String, String)| {
        let gap = if phases.is_empty() { 0.0 } else { 1.0 };
        canvas.width(name, Type::Name) + gap + canvas.width(phases, Type::Head)
    };
    let size = match look {
        MapBox::Capsule(name, phases) => Size::new(
            named(&(name.clone(), phases.clone())) + 2.2,
            CAPSULE.max(line + 0.5),
        ),
        MapBox::List(all) => {
            let widest = all.iter().map(named).fold(0.0, f64::max);
            Size::new(widest + 1.6, line * 0.9 * all.len() as f64 + 0.8)
        }
        MapBox::Group(space, own, lines, _) => {
            let widest = lines
                .iter()
                .map(|l| canvas.width(l, Type::Name))
                .fold(0.0, f64::max);
            let title = canvas.width(space, Type::Head) + canvas.width(own, Type::Head) + 2.0;
            let bar = if phases > 0 { 2.0 } else { 0.0 };
            Size::new(
                widest.max(title) + 1.8,
                line * (lines.len() as f64 + 1.0) + 0.8 + bar,
            )
        }
    };
    Vertex {
        size,
        outline: Outline::Box,
        cluster,
    }
}

fn paint(
    canvas: &mut PaperCanvas<'_>,
    sheet: &FigureSheet<'_>,
    tracks: &[Row],
    drawn: &MapDrawing,
) {
    let placed = &drawn.placed;
    let frame = Stroke::solid(ink::FOLDED, HAIRLINE);
    canvas.begin("namespaces");
    for (rect, name) in placed.clusters.iter().zip(&drawn.spaces) {
        canvas.frame(*rect, 1.0, ink::GROUND, &frame);
        let y = rect.y + 0.5 + canvas.cap(Type::Head) / 2.0;
        canvas.text(rect.x + 0.7, y, Type::Head, ink::QUIET, name);
    }
    canvas.begin("arrows");
    for (at, talk) in drawn.talks.iter().enumerate() {
        let dash: &[f64] = if talk.is_inferred { &[0.9, 0.6] } else { &[] };
        placed.arrow(canvas, at, ink::LINE, talk.pen(), dash);
    }
    canvas.begin("topics");
    for (at, lines) in drawn.labels.iter().enumerate() {
        placed.label(canvas, at, lines);
    }
    let boxes = drawn.looks.iter().zip(&drawn.members);
    for ((look, members), rect) in boxes.zip(&placed.boxes) {
        let names = members.iter().map(|at| &*tracks[*at].name);
        let marks = members.iter().flat_map(|at| &tracks[*at].marks);
        let events: BTreeSet<_> = marks.flat_map(|mark| mark.events.clone()).collect();
        canvas.begin_box(names, &events.into_iter().collect::<Vec<_>>());
        match look {
            MapBox::Capsule(name, phases) => capsule(canvas, *rect, name, phases),
            MapBox::List(all) => list(canvas, *rect, all),
            MapBox::Group(space, own, lines, cells) => {
                let many = sheet.source.phases.len();
                group(canvas, *rect, (space, own, lines), cells, many);
            }
        }
    }
}

fn capsule(canvas: &mut PaperCanvas<'_>, rect: Rect, name: &str, phases: &str) {
    let fill = if phases.is_empty() {
        ink::BAND[1]
    } else {
        ink::PAPER
    };
    let stroke = Stroke::solid(ink::LINE, 0.22);
    canvas.frame(rect, rect.h / 2.0, fill, &stroke);
    let y = rect.centre().y;
    canvas.text(rect.x + 1.1, y, Type::Name, ink::TEXT, name);
    canvas.text_end(rect.right() - 1.1, y, Type::Head, ink::ADDED, phases);
}

fn list(canvas: &mut PaperCanvas<'_>, rect: Rect, all: &[(String, String)]) {
    let stroke = Stroke::dashed(ink::RULE, HAIRLINE, &[0.7, 0.6]);
    canvas.frame(rect, 0.4, ink::PAPER, &stroke);
    let line = canvas.sizes.pitch() * 0.9;
    for (k, (name, phases)) in all.iter().enumerate() {
        let y = rect.y + 0.4 + line * (k as f64 + 0.5);
        canvas.text(rect.x + 0.8, y, Type::Name, ink::QUIET, name);
        canvas.text_end(rect.right() - 0.8, y, Type::Head, ink::ADDED, phases);
    }
}

fn group(
    canvas: &mut PaperCanvas<'_>,
    rect: Rect,
    (space, own, lines): (&str, &str, &[String]),
    cells: &BTreeSet<usize>,
    many: usize,
) {
    let fill = if own.is_empty() {
        ink::TINT
    } else {
        ink::PAPER
    };
    canvas.frame(rect, 0.8, fill, &Stroke::solid(ink::LINE, 0.25));
    let line = canvas.sizes.pitch();
    let y = |k: usize| rect.y + 0.4 + line * (k as f64 + 0.5);
    canvas.text(rect.x + 0.9, y(0), Type::Head, ink::QUIET, space);
    canvas.text_end(rect.right() - 0.9, y(0), Type::Head, ink::ADDED, own);
    for (k, text) in lines.iter().enumerate() {
        canvas.text(rect.x + 0.9, y(k + 1), Type::Name, ink::TEXT, text);
    }
    let wide = (rect.w - 1.8) / many.max(1) as f64;
    for k in 0..many {
        let fill = if cells.contains(&k) {
            ink::LINE
        } else {
            ink::PAPER
        };
        let cell = Rect::new(
            rect.x + 0.9 + wide * k as f64,
            rect.bottom() - 1.9,
            wide,
            1.15,
        );
        canvas.frame(cell, 0.0, fill, &Stroke::solid(ink::LINE, HAIRLINE * 0.7));
    }
}
