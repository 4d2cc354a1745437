//! The positions of all elements: one layout of the union of all windows, so that nothing moves between
//! frames.
//!
//! An engine receives sizes and connections only, not colours, rates or changes.

mod layered;
mod layers;
mod layout_rs;
mod pack;
mod pinned;
mod routes;
mod spacing;

use crate::base::error::{Error, Result};
use crate::base::geometry::{Point, Rect, Size};
use crate::base::words::worded;

/// The outline at which a route ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outline {
    /// The ellipse inside the box.
    Ellipse,
    /// The box with its shorter sides rounded to half circles.
    Capsule,
    /// The box itself.
    Box,
}

impl Outline {
    /// The distance from the middle of a box of this size to its outline in one direction, at an offset of
    /// `off` from the middle in the other; `along` and `across` are the sides of the box in these directions.
    fn reach(self, along: f64, across: f64, off: f64) -> f64 {
        let half = along / 2.0;
        match self {
            Self::Box => half,
            Self::Ellipse => {
                let off = off / (across / 2.0).max(1e-9);
                half * (1.0 - off * off).max(0.0).sqrt()
            }
            Self::Capsule => {
                let radius = half.min(across / 2.0);
                let off = (off.abs() - (across / 2.0 - radius)).max(0.0);
                half - radius + (radius * radius - off * off).max(0.0).sqrt()
            }
        }
    }

    /// Whether a point is inside the outline of a box or on it.
    fn holds(self, rect: &Rect, p: Point) -> bool {
        let middle = rect.centre();
        let (x, y) = ((p.x - middle.x).abs(), (p.y - middle.y).abs());
        y <= rect.h / 2.0 && x <= self.reach(rect.w, rect.h, y)
    }
}

/// A box to place.
#[derive(Clone, Debug, PartialEq)]
pub struct Vertex {
    /// Its size in pixels, with the widest label it ever shows.
    pub size: Size,
    /// The outline at which routes meet it.
    pub outline: Outline,
    /// The innermost cluster that contains it: an index into [`Plan::clusters`].
    pub cluster: Option<usize>,
}

/// An edge to route. Parallel edges and self loops are allowed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Link {
    /// The vertex it begins at: an index into [`Plan::vertices`].
    pub from: usize,
    /// The vertex it ends at: an index into [`Plan::vertices`].
    pub to: usize,
    /// The size of the widest label it ever shows, if any.
    pub label: Option<Size>,
    /// The number of its fork: edges with the same number begin at the same vertex and separate after their
    /// label, if labels have reserved space and no cycle is broken among them.
    pub fork: Option<usize>,
    /// Whether it leaves the clusters around its ends as soon as possible, so that its label is outside of
    /// them.
    pub is_outside: bool,
}

/// A namespace to draw as a box around its members.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// The cluster around it: an index into [`Plan::clusters`], smaller than its own.
    pub parent: Option<usize>,
    /// The size of its title, which is at the top left inside.
    pub title: Size,
    /// The size of the words at the bottom left inside.
    pub footer: Size,
}

impl Cluster {
    /// The width that its title and the words at its bottom need.
    fn words(&self) -> f64 {
        self.title.w.max(self.footer.w)
    }
}

/// The input of an engine. Vertices and links are sorted by name, and their order is part of the input: the
/// same plan gives the same layout on every machine. Publish edges precede subscribe edges.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// The boxes.
    pub vertices: Vec<Vertex>,
    /// The edges.
    pub links: Vec<Link>,
    /// The namespaces; parents before children.
    pub clusters: Vec<Cluster>,
    /// Whether every label has reserved space beside its edge, so that none is omitted and no other edge
    /// crosses it.
    pub is_labelled: bool,
}

worded! {
    /// The direction in which the edges run.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Orientation {
        /// From left to right.
        #[default]
        LeftRight = "LR",
        /// From top to bottom.
        TopBottom = "TB",
    }
}

/// The caller's preferences for a layout.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LayoutOptions {
    /// The page to fill, in pixels: its aspect ratio determines packing and the choice of orientation.
    pub page: Size,
    /// The orientation; `None` chooses the better one.
    pub orientation: Option<Orientation>,
    /// Whether a drawing that fills the page is better than one of short edges without crossings.
    pub is_tight: bool,
    /// The scale below which the drawing is of no use, so that no effort is made to improve it: 0 if it is of use at any
    /// scale, infinite for a sketch.
    pub least: f64,
}

/// The finished layout; its top left corner is (0, 0).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// The direction in which the edges run.
    pub orientation: Orientation,
    /// The total size, without margins.
    pub size: Size,
    /// A box per vertex; none overlap.
    pub boxes: Vec<Rect>,
    /// A route per link; none runs through a box other than its ends.
    pub routes: Vec<Route>,
    /// A box per cluster: inside that of its parent, otherwise disjoint.
    pub clusters: Vec<Rect>,
    /// Remarks for the user, such as the use of a fallback; lower case, no period.
    pub remarks: Vec<String>,
}

/// A layout engine.
pub trait Engine {
    /// Places every box and routes every edge.
    ///
    /// # Errors
    /// The engine does not support the plan; the caller may then use another.
    fn lay_out(&self, plan: &Plan, options: &LayoutOptions) -> Result<Layout>;
}

/// The largest depth of nested clusters; members of deeper ones are drawn in an ancestor.
const DEEPEST: usize = 16;

/// Every engine with its name on the command line. The first is the default.
pub const ENGINES: &[(&str, &(dyn Engine + Sync))] = &[
    ("layered", &layered::Layered),
    ("layout-rs", &layout_rs::LayoutRs),
];

/// The engine with this name.
///
/// # Errors
/// [`Error::Usage`] for an unknown name.
pub fn engine(word: &str) -> Result<&'static (dyn Engine + Sync)> {
    let found = ENGINES.iter().find(|(name, _)| *name == word);
    found.map(|(_, engine)| *engine).ok_or_else(|| {
        let words: Vec<&str> = ENGINES.iter().map(|(name, _)| *name).collect();
        let hint = format!("layouts: {}", words.join(", "));
        Error::usage(format!("unknown layout `{word}`"), hint)
    })
}

/// The layout of this plan by this engine; if the engine fails, by the default one with a remark.
///
/// Impossible numbers are replaced by zero; links and clusters with invalid references are left out.
pub fn lay_out(plan: &Plan, options: &LayoutOptions, engine: &dyn Engine) -> Layout {
    let (plan, options) = (plan.sane(), options.sane());
    engine.lay_out(&plan, &options).unwrap_or_else(|error| {
        let mut layout = layered::lay_out(&plan, &options);
        layout.remarks.push(error.to_string());
        layout
    })
}

/// The layout of this plan with the boxes of an earlier one at their positions: `known` has a position per
/// vertex, `None` for a new one. New boxes are placed near those that they are linked to; frames and routes
/// are recomputed.
///
/// If nothing moved and nothing is new, this is the layout of [`lay_out`].
pub fn extend(
    plan: &Plan,
    options: &LayoutOptions,
    engine: &dyn Engine,
    known: &[Option<Rect>],
) -> Layout {
    let fresh = lay_out(plan, options, engine);
    let same = |(now, then): (&Rect, &Option<Rect>)| {
        then.is_some_and(|then| (now.x - then.x).abs() < 1.0 && (now.y - then.y).abs() < 1.0)
    };
    if known.iter().all(Option::is_none)
        || fresh.boxes.len() == known.len() && fresh.boxes.iter().zip(known).all(same)
    {
        return fresh;
    }
    let plan = plan.sane();
    let mut layout = pinned::kept(&plan, known, fresh.orientation);
    let (routes, straight) = routes::around::routes(&plan, &layout.boxes);
    layout.routes = routes;
    if straight > 0 {
        let remark = format!("{straight} edges found no way around the kept boxes");
        layout.remarks.push(remark);
    }
    layered::labels::place(&plan, &mut layout);
    layout
}

impl Plan {
    /// This plan with every size finite and every reference valid; a link with invalid ends gets an empty route.
    fn sane(&self) -> Self {
        let mut plan = self.clone();
        for (at, cluster) in plan.clusters.iter_mut().enumerate() {
            cluster.title = sane_size(cluster.title);
            cluster.footer = sane_size(cluster.footer);
            cluster.parent = cluster.parent.filter(|parent| *parent < at);
        }
        plan.flatten();
        let clusters = plan.clusters.len();
        for vertex in &mut plan.vertices {
            vertex.size = sane_size(vertex.size);
            vertex.cluster = vertex.cluster.filter(|cluster| *cluster < clusters);
        }
        for link in &mut plan.links {
            link.label = link.label.map(sane_size);
        }
        plan
    }

    /// Makes the members of clusters nested deeper than [`DEEPEST`] members of the last cluster that is not.
    fn flatten(&mut self) {
        let mut depth = vec![0_usize; self.clusters.len()];
        let mut stand_in: Vec<usize> = (0..self.clusters.len()).collect();
        for at in 0..self.clusters.len() {
            if let Some(parent) = self.clusters[at].parent {
                depth[at] = depth[parent] + 1;
                if depth[at] > DEEPEST {
                    stand_in[at] = stand_in[parent];
                }
            }
        }
        for vertex in &mut self.vertices {
            let stand_in = |c| stand_in.get(c).copied().unwrap_or(c);
            vertex.cluster = vertex.cluster.map(stand_in);
        }
    }

    /// This plan without its clusters.
    fn without_clusters(&self) -> Self {
        let mut plan = self.clone();
        plan.clusters.clear();
        for vertex in &mut plan.vertices {
            vertex.cluster = None;
        }
        plan
    }

    /// The indices of the links with two existing ends.
    fn valid_links(&self) -> impl Iterator<Item = usize> {
        let n = self.vertices.len();
        (0..self.links.len()).filter(move |&i| self.links[i].from < n && self.links[i].to < n)
    }
}

impl Layout {
    /// Every label that is placed.
    fn labels(&self, plan: &Plan) -> impl Iterator<Item = Rect> {
        let both = self.routes.iter().zip(&plan.links);
        both.filter_map(|(route, link)| Some(Rect::around(route.label?, link.label?)))
    }

    /// Makes `whole` the extent of the layout: its corner becomes (0, 0), its size the total size.
    fn cropped(&mut self, whole: Rect) {
        let by = Point::new(-whole.x, -whole.y);
        for rect in self.boxes.iter_mut().chain(&mut self.clusters) {
            *rect = rect.moved(by);
        }
        self.routes = self.routes.iter().map(|route| route.moved(by)).collect();
        self.size = Size::new(whole.w, whole.h);
    }
}

/// Extends the bounds of several rectangles to one more.
fn include(around: &mut Option<Rect>, rect: Rect) {
    *around = Some(around.map_or(rect, |all| all.union(&rect)));
}

impl Cluster {
    /// Its frame around its contents, with the title at the top left.
    fn frame(&self, inside: Rect, padding: f64) -> Rect {
        let around = inside.grown(padding);
        let width = around.w.max(self.words() + 2.0 * padding);
        let height = around.h + self.title.h + self.footer.h;
        Rect::new(around.x, around.y - self.title.h, width, height)
    }
}

impl LayoutOptions {
    fn sane(&self) -> Self {
        let page = sane_size(self.page);
        Self {
            page: Size::new(page.w.max(1.0), page.h.max(1.0)),
            ..*self
        }
    }
}

/// A length that is safe in arithmetic: 0 to 100,000 pixels.
fn sane_size(size: Size) -> Size {
    let sane = |length: f64| {
        if length.is_finite() {
            length.clamp(0.0, 1e5)
        } else {
            0.0
        }
    };
    Size::new(sane(size.w), sane(size.h))
}

/// Vertices that belong together, by links or by a shared namespace. Vertices are indices into `vertices`;
/// cluster `i + 1` is `clusters[i]` of the plan, and 0 is the outside.
#[derive(Clone, Debug, Default)]
pub(crate) struct Component {
    /// The indices of its vertices in the plan, ascending.
    pub(crate) vertices: Vec<usize>,
    /// The indices of its links in the plan, ascending.
    pub(crate) links: Vec<usize>,
    /// The indices of its clusters in the plan, ascending.
    pub(crate) clusters: Vec<usize>,
    /// The ends of each link.
    ends: Vec<(usize, usize)>,
    /// The innermost cluster of each vertex.
    home: Vec<usize>,
    /// The cluster around each cluster; the outside contains itself.
    parent: Vec<usize>,
    /// The first vertex of each vertex's connected component.
    pieces: Vec<usize>,
}

/// A cluster and those around it, the innermost first, without the outside; `parent` is the cluster around each.
fn around(parent: &[usize], cluster: usize) -> impl Iterator<Item = usize> + '_ {
    std::iter::successors(Some(cluster), |&c| Some(parent[c])).take_while(|&c| c != 0)
}

/// A part of a plan that is laid out in one orientation.
#[derive(Clone, Copy)]
struct PartTask<'a> {
    plan: &'a Plan,
    options: &'a LayoutOptions,
    part: &'a Component,
    orientation: Orientation,
}

/// The kind of an item of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LayerItem {
    /// A vertex of the plan.
    Vertex,
    /// A bend of a long edge that passes through a layer.
    Bend,
    /// The first border of a cluster in a layer.
    Top,
    /// The last border of a cluster in a layer.
    Bottom,
}

/// The items of each layer, in order across.
type LayerRows = Vec<Vec<usize>>;

/// One part cut into layers, which the steps of the layered engine pass on. `along` is the direction in which
/// the edges run, `across` the direction along a layer. Items `0..vertices` are the vertices; bends and
/// borders follow.
#[derive(Clone, Debug, Default)]
struct Layers {
    /// The number of items that are vertices.
    vertices: usize,
    /// The kind of each item.
    kind: Vec<LayerItem>,
    /// The layer of each item.
    rank: Vec<usize>,
    /// The innermost cluster of each item; 0 is the outside.
    home: Vec<usize>,
    /// The neighbours of each item in the layer before.
    up: Vec<Vec<usize>>,
    /// The neighbours of each item in the layer after.
    down: Vec<Vec<usize>>,
    /// The items that each edge passes, by ascending rank; empty for a self loop.
    chains: Vec<Vec<usize>>,
    /// The cluster around each cluster; the outside contains itself.
    parent: Vec<usize>,
    /// The first and last layer of each cluster.
    span: Vec<(usize, usize)>,
    /// The top and bottom border of each cluster in its first layer; those in its next layers follow, two by two.
    borders: Vec<(usize, usize)>,
    /// The number of layers.
    ranks: usize,
}

/// The first bend that an edge passes from its start: after the first item if it runs with the ranks.
fn first_bend(chain: &[usize], is_forward: bool) -> Option<usize> {
    let bends = chain.get(1..chain.len().checked_sub(1)?)?;
    if is_forward {
        bends.first()
    } else {
        bends.last()
    }
    .copied()
}

impl Layers {
    /// The same layers without borders and clusters.
    fn without_clusters(&self) -> Self {
        let border = |kind: &LayerItem| matches!(kind, LayerItem::Top | LayerItem::Bottom);
        let n = self.kind.iter().position(border).unwrap_or(self.kind.len());
        Self {
            vertices: self.vertices,
            kind: self.kind[..n].to_vec(),
            rank: self.rank[..n].to_vec(),
            home: vec![0; n],
            up: self.up[..n].to_vec(),
            down: self.down[..n].to_vec(),
            parent: vec![0],
            ranks: self.ranks,
            ..Self::default()
        }
    }

    /// The cluster of `item` that is a child of `outer`; `None` if the item is directly in it.
    fn child(&self, outer: usize, item: usize) -> Option<usize> {
        around(&self.parent, self.home[item]).find(|&cluster| self.parent[cluster] == outer)
    }
}

/// The route of one edge: a start point, then cubic pieces `(control, control, end)`; straight pieces have
/// their controls on the line. It runs from the outline of `from` to the outline of `to`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Route {
    /// Its start point.
    pub start: Point,
    /// The cubic pieces `(control, control, end)`.
    pub curves: Vec<[Point; 3]>,
    /// The middle of its label, if it has one and it could be placed.
    pub label: Option<Point>,
}

impl Route {
    /// A route without a label.
    fn new(start: Point, curves: Vec<[Point; 3]>) -> Self {
        let label = None;
        Self {
            start,
            curves,
            label,
        }
    }

    /// All its points and controls, from its start on.
    pub(crate) fn points(&self) -> impl DoubleEndedIterator<Item = Point> {
        std::iter::once(self.start).chain(self.curves.iter().flatten().copied())
    }

    /// This route with every point moved.
    pub(crate) fn mapped(&self, f: impl Fn(Point) -> Point) -> Self {
        Self {
            start: f(self.start),
            curves: self.curves.iter().map(|curve| curve.map(&f)).collect(),
            label: self.label.map(&f),
        }
    }

    /// This route moved by `by`.
    pub(crate) fn moved(&self, by: Point) -> Self {
        self.mapped(|p| Point::new(p.x + by.x, p.y + by.y))
    }

    /// Its approximate length: that of the straight lines between the points that its pieces join.
    pub(crate) fn length(&self) -> f64 {
        let ends = self.curves.iter().map(|curve| curve[2]);
        let far = |(length, from): (f64, Point), to: Point| (length + from.distance(to), to);
        ends.fold((0.0, self.start), far).0
    }

    /// This route from its end to its start.
    pub(crate) fn backwards(&self) -> Self {
        let points: Vec<Point> = self.points().rev().collect();
        let pieces = points[1..].chunks_exact(3);
        Self {
            start: points[0],
            curves: pieces.map(|piece| [piece[0], piece[1], piece[2]]).collect(),
            label: self.label,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn vertex(cluster: Option<usize>) -> Vertex {
        Vertex {
            size: Size::new(80.0, 30.0),
            outline: Outline::Box,
            cluster,
        }
    }

    pub(super) fn link(from: usize, to: usize) -> Link {
        Link {
            from,
            to,
            ..Link::default()
        }
    }

    pub(super) fn cluster(parent: Option<usize>) -> Cluster {
        Cluster {
            parent,
            title: Size::new(40.0, 14.0),
            footer: Size::default(),
        }
    }
}
