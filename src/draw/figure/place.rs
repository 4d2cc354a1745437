//! The positions of boxes and arrows within a width: our own layout tried at several densities, labels placed
//! afterwards.

use super::labels::{self, Room, Spot};
use crate::base::geometry::{Point, Rect, Size, polyline};
use crate::draw::scene::{Step, Stroke};
use crate::draw::style::Color;
use crate::draw::timeline::canvas::{PaperCanvas, Type, ink};
use crate::layout::{
    Cluster, Component, Engine, Layout, LayoutOptions, Orientation, Plan, Route, engine, lay_out,
    parts, shelves,
};

/// Pixels of the layout engine per millimetre: its gaps are fixed in pixels, so more pixels make a denser
/// drawing. The densest comes first: if it is too wide, all are.
const TIGHTNESS: [f64; 5] = [12.0, 9.0, 6.5, 4.8, 3.6];
/// The factor over the width above which a drawing is too wide at every density; below it, the engine may
/// still find a layout that fits.
const HOPELESS: f64 = 1.25;
/// The shortest arrow in millimetres that shows its direction, minus the space that the engine leaves around
/// a label.
const SHORTEST: f64 = 3.4;
/// The height of the page that the engine should fill, in widths.
const ASPECT: f64 = 0.45;
/// The space between parts in millimetres: side by side, and between shelves.
const PARTED: (f64, f64) = (3.0, 3.0 * 0.7);
/// The number of pieces in which a curve is measured.
const PIECES: u32 = 8;
/// The length of an arrowhead in millimetres, on a line without width.
const HEAD: f64 = 1.2;
/// A drawing in millimetres, its top left corner at (0, 0).
#[derive(Clone, Debug)]
pub(crate) struct PlacedPanel {
    pub(crate) size: Size,
    pub(crate) boxes: Vec<Rect>,
    pub(crate) clusters: Vec<Rect>,
    pub(crate) routes: Vec<Vec<Point>>,
    curves: Vec<Route>,
    /// The position of each label; `None` for one that does not fit.
    pub(crate) labels: Vec<Option<Spot>>,
    pub(crate) left_out: usize,
    /// The number of labels on or near an arrow that is not theirs.
    pub(crate) unclear: usize,
}

/// The lowest drawing of a plan, in millimetres, that is at most `width` wide and keeps its labels; `None` if
/// all are wider. Parts without links between them are laid out separately and put side by side. `labels`
/// contains, per link, the sizes of the texts that may be written on it, the best first.
pub(crate) fn place(
    canvas: &PaperCanvas<'_>,
    plan: &Plan,
    labels: &[Vec<Vec<String>>],
    width: f64,
) -> Option<PlacedPanel> {
    let labels: Vec<Vec<Size>> = labels.iter().map(|l| rooms(canvas, l)).collect();
    let engine = engine("layered").ok()?;
    let wanted = labels.iter().filter(|l| !l.is_empty()).count();
    let parts = parts(plan);
    let tried: Vec<Vec<PlacedPanel>> = parts
        .iter()
        .map(|part| {
            let own = part.links.iter().map(|at| labels[*at].clone());
            candidates(&part.plan(plan), &own.collect::<Vec<_>>(), width, engine)
        })
        .collect();
    let mut best: Option<Arrangement> = None;
    for chosen in choices(&tried, width)? {
        let sizes: Vec<Size> = chosen
            .iter()
            .zip(&tried)
            .map(|(at, all)| all[*at].size)
            .collect();
        let (corners, size) = shelves(&sizes, width, PARTED);
        let parts = || chosen.iter().zip(&tried).map(|(at, all)| &all[*at]);
        let lost: usize = parts().map(|p| p.left_out).sum();
        let excess = lost.saturating_sub(wanted / TENTH);
        let faults: f64 = parts().map(PlacedPanel::faults).sum();
        let cost = size.h + faults + excess as f64 * EXCESS;
        if best.as_ref().is_none_or(|b| cost < b.cost) {
            let parts = chosen.into_iter().zip(corners).collect();
            best = Some(Arrangement { cost, parts, size });
        }
    }
    let Arrangement {
        parts: chosen,
        size,
        ..
    } = best?;
    let mut whole = PlacedPanel::empty(plan, labels.len(), size);
    for ((part, all), (at, corner)) in parts.iter().zip(tried).zip(chosen) {
        if let Some(placed) = all.into_iter().nth(at) {
            whole.take(part, placed.moved(corner.x, corner.y));
        }
    }
    Some(whole)
}

/// A choice of a drawing for every part, by index among its candidates, and the corner of each.
struct Arrangement {
    cost: f64,
    parts: Vec<(usize, Point)>,
    size: Size,
}

/// Combinations of one candidate of every part: for each candidate of the largest part, the others chosen to
/// fit beside it.
fn choices(tried: &[Vec<PlacedPanel>], width: f64) -> Option<Vec<Vec<usize>>> {
    let area = |all: &Vec<PlacedPanel>| all.iter().map(|p| p.size.w * p.size.h).fold(0.0, f64::max);
    let order = |a: &usize, b: &usize| area(&tried[*a]).total_cmp(&area(&tried[*b])).then(b.cmp(a));
    let Some(largest) = (0..tried.len()).max_by(order) else {
        return Some(vec![Vec::new()]);
    };
    let mut ways = Vec::new();
    for at in 0..tried[largest].len() {
        let beside = width - tried[largest][at].size.w - PARTED.0;
        for most in [beside, width] {
            let way = tried.iter().enumerate().map(|(part, all)| {
                if part == largest {
                    Some(at)
                } else {
                    choice(all, most)
                }
            });
            ways.push(way.collect::<Option<Vec<usize>>>()?);
        }
    }
    Some(ways)
}

/// The cost of a label that is left out, and of one near another arrow, in millimetres of height.
const LOST: f64 = 3.0;
const UNCLEAR: f64 = 2.0;
/// The share of labels, one in so many, that may be left out before each more costs as much as `EXCESS`.
const TENTH: usize = 10;
const EXCESS: f64 = 3.0;

/// The cheapest drawing of a part that is at most this wide, else the narrowest.
fn choice(all: &[PlacedPanel], most: f64) -> Option<usize> {
    let cost = |p: &PlacedPanel| p.size.h + p.faults();
    let fitting = (0..all.len()).filter(|at| all[*at].size.w <= most);
    let best = fitting.min_by(|a, b| cost(&all[*a]).total_cmp(&cost(&all[*b])));
    best.or_else(|| (0..all.len()).min_by(|a, b| all[*a].size.w.total_cmp(&all[*b].size.w)))
}

/// Every drawing of a part that fits. They are searched in parallel, since searching takes most of a figure's
/// time.
fn candidates(
    plan: &Plan,
    labels: &[Vec<Size>],
    width: f64,
    engine: &Searcher,
) -> Vec<PlacedPanel> {
    if plan.links.is_empty() {
        let way = (Orientation::LeftRight, false);
        return tightened(plan, labels, width, engine, way);
    }
    let both = [Orientation::LeftRight, Orientation::TopBottom];
    let ways = both.map(|orientation| [(orientation, false), (orientation, true)]);
    std::thread::scope(|scope| {
        let searches: Vec<_> = ways
            .concat()
            .into_iter()
            .map(|way| scope.spawn(move || tightened(plan, labels, width, engine, way)))
            .collect();
        let found = searches.into_iter().map(|s| s.join().unwrap_or_default());
        found.flatten().collect()
    })
}

/// A layout engine that several threads may use.
type Searcher = dyn Engine + Sync;

/// The drawings of one orientation, from the tightest to the loosest that fits; with or without space for
/// labels between neighbours.
fn tightened(
    plan: &Plan,
    labels: &[Vec<Size>],
    width: f64,
    engine: &Searcher,
    (orientation, is_labelled): (Orientation, bool),
) -> Vec<PlacedPanel> {
    let mut all = Vec::new();
    for tightness in TIGHTNESS {
        let options = LayoutOptions {
            page: Size::new(width * tightness, width * ASPECT * tightness),
            orientation: Some(orientation),
            ..LayoutOptions::default()
        };
        let mut sized = scaled(plan, tightness);
        for (link, label) in sized.links.iter_mut().zip(labels) {
            let label = label.last().filter(|_| is_labelled);
            let (w, h) = label.map_or((SHORTEST, 0.0), |l| (l.w.max(SHORTEST), l.h));
            link.label = Some(Size::new(w * tightness, h.max(SHORTEST) * tightness));
        }
        let layout = lay_out(&sized, &options, engine);
        let wide = layout.size.w / tightness;
        if wide > width * HOPELESS {
            break;
        }
        if wide > width + 0.001 {
            continue;
        }
        all.push(PlacedPanel::new(plan, &layout, labels, tightness, width));
        if plan.links.is_empty() {
            // More space would not change anything else.
            break;
        }
    }
    all
}

/// The same plan with lengths in the engine's pixels, and without labels, which are placed afterwards.
fn scaled(plan: &Plan, by: f64) -> Plan {
    let mut plan = plan.clone();
    for vertex in &mut plan.vertices {
        vertex.size = vertex.size.scaled(by);
    }
    for cluster in &mut plan.clusters {
        cluster.title = cluster.title.scaled(by);
    }
    plan
}

impl PlacedPanel {
    /// An empty drawing for a whole plan.
    fn empty(plan: &Plan, labels: usize, size: Size) -> Self {
        Self {
            size,
            boxes: vec![Rect::default(); plan.vertices.len()],
            clusters: vec![Rect::default(); plan.clusters.len()],
            routes: vec![Vec::new(); plan.links.len()],
            curves: vec![Route::default(); plan.links.len()],
            labels: vec![None; labels],
            left_out: 0,
            unclear: 0,
        }
    }

    /// Only these boxes and these lines with their labels, at their positions.
    pub(crate) fn only(&self, boxes: &[usize], links: &[usize]) -> Self {
        Self {
            boxes: boxes.iter().map(|at| self.boxes[*at]).collect(),
            routes: links.iter().map(|at| self.routes[*at].clone()).collect(),
            curves: links.iter().map(|at| self.curves[*at].clone()).collect(),
            labels: links.iter().map(|at| self.labels[*at]).collect(),
            ..self.clone()
        }
    }

    /// Adds the positions of a part.
    fn take(&mut self, part: &Component, placed: Self) {
        for (at, rect) in part.vertices.iter().zip(placed.boxes) {
            self.boxes[*at] = rect;
        }
        for (at, rect) in part.clusters.iter().zip(placed.clusters) {
            self.clusters[*at] = rect;
        }
        let lines = placed
            .routes
            .into_iter()
            .zip(placed.curves)
            .zip(placed.labels);
        for (at, ((route, curve), label)) in part.links.iter().zip(lines) {
            self.routes[*at] = route;
            self.curves[*at] = curve;
            self.labels[*at] = label;
        }
        self.left_out += placed.left_out;
        self.unclear += placed.unclear;
    }

    /// The cost of its labels, in millimetres of height.
    fn faults(&self) -> f64 {
        self.left_out as f64 * LOST + self.unclear as f64 * UNCLEAR
    }

    fn new(plan: &Plan, layout: &Layout, labels: &[Vec<Size>], tightness: f64, width: f64) -> Self {
        let point = |p: Point| Point::new(p.x / tightness, p.y / tightness);
        let rect = |r: &Rect| {
            Rect::new(
                r.x / tightness,
                r.y / tightness,
                r.w / tightness,
                r.h / tightness,
            )
        };
        let curves: Vec<Route> = layout
            .routes
            .iter()
            .map(|route| Route {
                label: None,
                ..route.mapped(point)
            })
            .collect();
        let size = Size::new(layout.size.w / tightness, layout.size.h / tightness);
        let mut placed = Self {
            boxes: layout.boxes.iter().map(rect).collect(),
            clusters: layout.clusters.iter().map(rect).collect(),
            routes: curves
                .iter()
                .map(|route| polyline(route.start, &route.curves, PIECES))
                .collect(),
            curves,
            ..Self::empty(plan, labels.len(), size)
        };
        let titles: Vec<Rect> = placed
            .clusters
            .iter()
            .zip(&plan.clusters)
            .map(|(frame, Cluster { title, .. })| {
                Rect::new(frame.x, frame.y, title.w + 1.0, title.h + 0.6)
            })
            .collect();
        placed.set_labels(labels, titles, width);
        placed
    }

    fn set_labels(&mut self, labels: &[Vec<Size>], titles: Vec<Rect>, width: f64) {
        let mut fixed: Vec<Rect> = self.boxes.iter().map(|b| b.grown(0.25)).collect();
        fixed.extend(titles);
        fixed.extend(self.routes.iter().filter_map(|route| {
            let tip = *route.last()?;
            let start = behind(route, tip);
            let base = tip.towards(start, HEAD / start.distance(tip).max(HEAD));
            Some(Rect::of_points([tip, base])?.grown(HEAD / 3.0))
        }));
        let heights = labels.iter().flatten().map(|label| label.h);
        let room = Room {
            routes: &self.routes,
            labels,
            row: heights.fold(f64::INFINITY, f64::min),
            width,
            fixed,
        };
        self.labels = labels::set(&room);
        for (at, spot) in self.labels.iter().enumerate() {
            let Some(spot) = spot else {
                self.left_out += usize::from(!labels[at].is_empty());
                continue;
            };
            let rect = room.rect(at, *spot);
            self.size.w = self.size.w.max(rect.right());
            self.size.h = self.size.h.max(rect.bottom());
            self.unclear += usize::from(room.is_unclear(at, *spot));
        }
    }

    /// The drawing moved by `dx`, `dy`.
    pub(crate) fn moved(mut self, dx: f64, dy: f64) -> Self {
        let by = Point::new(dx, dy);
        for rect in self.boxes.iter_mut().chain(&mut self.clusters) {
            *rect = rect.moved(by);
        }
        for route in &mut self.curves {
            *route = route.moved(by);
        }
        let labels = self.labels.iter_mut().flatten().map(|(label, _)| label);
        for p in self.routes.iter_mut().flatten().chain(labels) {
            (p.x, p.y) = (p.x + dx, p.y + dy);
        }
        self
    }

    /// Draws one arrow.
    pub(crate) fn arrow(
        &self,
        canvas: &mut PaperCanvas<'_>,
        at: usize,
        color: Color,
        width: f64,
        dash: &[f64],
    ) {
        let Some(route) = self.curves.get(at).filter(|r| !r.curves.is_empty()) else {
            return;
        };
        let stroke = Stroke::dashed(color, width, dash);
        let mut steps = vec![Step::Move(route.start)];
        steps.extend(route.curves.iter().map(|c| Step::Curve(*c)));
        canvas.path(&steps, Color::NONE, &stroke);
        let points = &self.routes[at];
        if let Some(tip) = points.last() {
            canvas.head(behind(points, *tip), *tip, HEAD + width, color);
        }
    }

    /// Draws the label of one arrow: the lines of the alternative that fits, centred.
    pub(crate) fn label(
        &self,
        canvas: &mut PaperCanvas<'_>,
        at: usize,
        alternatives: &[Vec<String>],
    ) {
        let Some((centre, k)) = self.labels.get(at).copied().flatten() else {
            return;
        };
        let lines = alternatives.get(k).map_or(&[][..], Vec::as_slice);
        let line = canvas.sizes.line();
        let top = centre.y - line * lines.len() as f64 / 2.0;
        for (k, text) in lines.iter().enumerate() {
            let y = top + line * (k as f64 + 0.5);
            canvas.label(centre.x, y, Type::Small, ink::TEXT, text);
        }
    }
}

/// A point of a route from which it runs almost straight to its tip.
fn behind(route: &[Point], tip: Point) -> Point {
    let far = route.iter().rev().find(|p| p.distance(tip) > 0.8);
    far.or(route.first()).copied().unwrap_or(tip)
}

/// The size of each alternative of a label.
fn rooms(canvas: &PaperCanvas<'_>, alternatives: &[Vec<String>]) -> Vec<Size> {
    let room = |lines: &Vec<String>| {
        let widths = lines.iter().map(|l| canvas.width(l, Type::Small));
        let widest = widths.fold(0.0, f64::max);
        Size::new(widest + 0.3, canvas.sizes.line() * lines.len() as f64)
    };
    alternatives.iter().map(room).collect()
}
