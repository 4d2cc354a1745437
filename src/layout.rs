//! Where everything goes: one layout of the union of all windows, so that nothing moves between frames.
//!
//! An engine sees sizes and connections only, never colours, rates or changes.

use crate::error::Result;
use crate::geometry::{Point, Rect, Size};

/// The outline that a route must end at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outline {
    /// The ellipse inside the box.
    Ellipse,
    /// The box itself.
    Box,
}

/// A box to place.
#[derive(Clone, Debug, PartialEq)]
pub struct Vertex {
    /// Its size with the widest label it ever shows.
    pub size: Size,
    /// Where routes meet it.
    pub outline: Outline,
    /// The innermost cluster it stands in: a place in [`Plan::clusters`].
    pub cluster: Option<usize>,
}

/// An edge to route. Parallel edges and self loops are allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Where it begins: a place in [`Plan::vertices`].
    pub from: usize,
    /// Where it ends.
    pub to: usize,
    /// The size of the widest label it ever shows, if any.
    pub label: Option<Size>,
}

/// A namespace to draw as a box around its members.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// The cluster around it: a place in [`Plan::clusters`], smaller than its own.
    pub parent: Option<usize>,
    /// The size of its title, which stands at the top left inside.
    pub title: Size,
}

/// What to lay out. The order of vertices and links is the order of names, and part of the input: the same plan
/// gives the same layout on every machine. Links come publish edges first, then subscribe edges.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// The boxes.
    pub vertices: Vec<Vertex>,
    /// The edges.
    pub links: Vec<Link>,
    /// The namespaces; parents before children.
    pub clusters: Vec<Cluster>,
}

/// Which way the edges run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Orientation {
    /// From left to right.
    LeftRight,
    /// From top to bottom.
    TopBottom,
}

impl Orientation {
    /// Its word on the command line and in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::LeftRight => "LR",
            Self::TopBottom => "TB",
        }
    }
}

/// What the caller wants of a layout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wish {
    /// The page to fill, in pixels: its aspect steers packing and the choice of orientation.
    pub page: Size,
    /// The orientation; `None` takes the better one.
    pub orientation: Option<Orientation>,
}

/// The way of one edge: a start point, then cubic pieces `(control, control, end)`; straight pieces have their
/// controls on the line. It runs from the outline of `from` to the outline of `to`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Route {
    /// Where it begins.
    pub start: Point,
    /// The pieces.
    pub curves: Vec<[Point; 3]>,
    /// The middle of its label, if it has one and there was room.
    pub label: Option<Point>,
}

/// Everything placed; the top left corner of the whole is (0, 0).
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Which way the edges run.
    pub orientation: Orientation,
    /// The size of the whole, margins excluded.
    pub size: Size,
    /// A box per vertex; none overlap.
    pub boxes: Vec<Rect>,
    /// A route per link; none runs through a box that is neither of its ends.
    pub routes: Vec<Route>,
    /// A box per cluster: nested as their parents say, disjoint otherwise.
    pub clusters: Vec<Rect>,
    /// What the user should know, such as a cruder fallback; lower case, no period.
    pub remarks: Vec<String>,
}

/// A way of laying out.
pub trait Engine {
    /// Places every box and routes every edge.
    ///
    /// # Errors
    /// Where the engine cannot do this plan; the caller may then take another.
    fn lay_out(&self, plan: &Plan, wish: &Wish) -> Result<Layout>;
}
