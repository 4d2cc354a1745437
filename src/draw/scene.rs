//! A drawing with all positions and colours determined: groups of shapes and texts, in the order they are
//! painted.
//!
//! Lengths are pixels of the page, x to the right, y down. Painters receive only this.

use crate::base::geometry::{Point, Rect, Size};
use crate::draw::style::Color;
use crate::draw::text::Weight;

/// A page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The size of the page in pixels.
    pub size: Size,
    /// The width of the page on paper in millimetres, for vector output; `None` for pixels only.
    pub width_mm: Option<f64>,
    /// The background colour.
    pub background: Color,
    /// The content of the page in words, for screen readers.
    pub title: String,
    /// The groups, from back to front. Each id occurs once.
    pub groups: Vec<Group>,
}

/// Pieces that belong together: an element of the graph, or of title, legend or timeline.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Group {
    /// Unique on the page and the same on every page of a sequence; an XML name.
    pub id: String,
    /// Class words, separated by blanks: `node added active measured`.
    pub class: String,
    /// More attributes, `data-` left out: `("name", "/planner")`.
    pub data: Vec<(&'static str, String)>,
    /// Its content in words; empty for none.
    pub title: String,
    /// The messages per second along its line and against it that dots can show, in hundredths; 0 for none.
    pub flow: [u32; 2],
    /// The shapes and texts, from back to front.
    pub pieces: Vec<Piece>,
}

/// A shape or a text.
#[derive(Clone, Debug, PartialEq)]
pub enum Piece {
    /// A shape.
    Shape(Shape),
    /// A line of text.
    Text(Text),
}

/// A shape with its paint.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Its outline.
    pub form: Form,
    /// The colour inside.
    pub fill: Color,
    /// The line around.
    pub stroke: Stroke,
}

/// The outline of a shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// A rectangle with corners of this radius.
    Rect(Rect, f64),
    /// The ellipse inside a rectangle.
    Ellipse(Rect),
    /// A path; it begins with [`Step::Move`].
    Path(Vec<Step>),
}

/// One step of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// The beginning of a new part at this point.
    Move(Point),
    /// A straight line to this point.
    Line(Point),
    /// A cubic curve: two controls and its end.
    Curve([Point; 3]),
    /// A straight line back to the beginning of this part.
    Close,
}

/// A line; a width of 0 or the colour `none` draws nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub color: Color,
    /// Its width.
    pub width: f64,
    /// The lengths of line, gap, line, gap, …; empty for a solid line. Drawn with round ends if its lines are shorter
    /// than its width.
    pub dash: Vec<f64>,
}

/// The part of a text that is placed at its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// Its beginning.
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
}

/// One line of text in the bundled font; every character of it can be shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// A point on its baseline.
    pub at: Point,
    /// The part of the text that is placed at that point.
    pub anchor: Anchor,
    /// The font size in pixels.
    pub size: f64,
    /// The weight of the font.
    pub weight: Weight,
    /// Its colour.
    pub color: Color,
    /// A line behind the letters that sets them off: colour and width.
    pub halo: Option<(Color, f64)>,
    /// The words.
    pub text: String,
}

impl Step {
    /// The same step with every point moved.
    #[must_use]
    pub fn mapped(&self, f: impl Fn(Point) -> Point) -> Self {
        match self {
            Self::Move(p) => Self::Move(f(*p)),
            Self::Line(p) => Self::Line(f(*p)),
            Self::Curve(points) => Self::Curve(points.map(f)),
            Self::Close => Self::Close,
        }
    }

    /// Its points and controls.
    pub fn points(&self) -> &[Point] {
        match self {
            Self::Move(p) | Self::Line(p) => std::slice::from_ref(p),
            Self::Curve(points) => points,
            Self::Close => &[],
        }
    }
}

impl Anchor {
    /// The length of a text of this width before its point.
    pub fn before(self, width: f64) -> f64 {
        match self {
            Self::Start => 0.0,
            Self::Middle => width / 2.0,
            Self::End => width,
        }
    }
}

/// The size in pixels, the weight and the colour of a text.
#[derive(Clone, Copy)]
pub(crate) struct Font {
    pub(crate) size: f64,
    pub(crate) weight: Weight,
    pub(crate) color: Color,
}

impl Font {
    pub(crate) fn new(size: f64, weight: Weight, color: Color) -> Self {
        Self {
            size,
            weight,
            color,
        }
    }
}

impl Text {
    /// A text at a point on its baseline.
    pub(crate) fn new(anchor: Anchor, at: Point, font: Font, text: impl Into<String>) -> Self {
        Self {
            at,
            anchor,
            size: font.size,
            weight: font.weight,
            color: font.color,
            halo: None,
            text: text.into(),
        }
    }

    /// A text that is vertically centred on a point.
    pub(crate) fn centred(anchor: Anchor, on: Point, font: Font, text: impl Into<String>) -> Self {
        let at = Point::new(on.x, on.y + font.size * 0.36);
        Self::new(anchor, at, font, text)
    }

    /// The text with a line behind its letters.
    pub(crate) fn with_halo(self, color: Color, width: f64) -> Self {
        let halo = Some((color, width));
        Self { halo, ..self }
    }
}

impl Shape {
    /// A shape with a line around.
    pub fn new(form: Form, fill: Color, stroke: Stroke) -> Self {
        Self { form, fill, stroke }
    }

    /// A shape without a line around.
    pub fn filled(form: Form, fill: Color) -> Self {
        Self::new(form, fill, Stroke::default())
    }

    /// A line without a fill.
    pub fn line(form: Form, stroke: Stroke) -> Self {
        Self::new(form, Color::NONE, stroke)
    }
}

impl Stroke {
    /// A solid line.
    pub fn solid(color: Color, width: f64) -> Self {
        Self::dashed(color, width, &[])
    }

    /// A line of these lengths of line, gap, line, gap, …
    pub fn dashed(color: Color, width: f64, dash: &[f64]) -> Self {
        Self {
            color,
            width,
            dash: dash.to_vec(),
        }
    }

    /// The same line with all lengths and widths scaled by `by`.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        Self {
            color: self.color,
            width: self.width * by,
            dash: self.dash.iter().map(|d| d * by).collect(),
        }
    }

    /// Whether its dashes are drawn with round ends: dots are lines of no length.
    pub fn is_round(&self) -> bool {
        self.dash.first().is_some_and(|first| *first < self.width)
    }
}

impl Group {
    /// The group `by` times as large, its page's corner at `to`.
    pub(crate) fn placed(&self, by: f64, to: Point) -> Self {
        let point = |p: Point| Point::new(to.x + p.x * by, to.y + p.y * by);
        let rect = |r: &Rect| r.scaled(by).moved(to);
        let form = |form: &Form| match form {
            Form::Rect(r, radius) => Form::Rect(rect(r), radius * by),
            Form::Ellipse(r) => Form::Ellipse(rect(r)),
            Form::Path(steps) => Form::Path(steps.iter().map(|step| step.mapped(point)).collect()),
        };
        let piece = |piece: &Piece| match piece {
            Piece::Shape(s) => Piece::Shape(Shape::new(form(&s.form), s.fill, s.stroke.scaled(by))),
            Piece::Text(text) => Piece::Text(Text {
                at: point(text.at),
                size: text.size * by,
                halo: text.halo.map(|(color, width)| (color, width * by)),
                ..text.clone()
            }),
        };
        Self {
            pieces: self.pieces.iter().map(piece).collect(),
            ..self.clone()
        }
    }

    /// Mixes its colours with this part (0..=1) of another.
    pub(crate) fn fade(&mut self, other: Color, part: f64) {
        let fade = |color: &mut Color| *color = color.faded(other, part);
        for piece in &mut self.pieces {
            match piece {
                Piece::Shape(shape) => {
                    fade(&mut shape.fill);
                    fade(&mut shape.stroke.color);
                }
                Piece::Text(text) => fade(&mut text.color),
            }
        }
    }

    /// A group outside of the graph, such as a title: an id, which is also its class, and no content yet.
    pub fn named(id: &str) -> Self {
        Self::new(id, id)
    }

    /// A group of this class without attributes and content yet.
    pub(crate) fn new(id: impl Into<String>, class: impl Into<String>) -> Self {
        Self {
            id: id.into(),
            class: class.into(),
            ..Self::default()
        }
    }

    /// The group with these attributes.
    pub(crate) fn with(self, data: Vec<(&'static str, String)>) -> Self {
        Self { data, ..self }
    }

    /// The group with its content in words.
    pub(crate) fn titled(self, title: impl Into<String>) -> Self {
        let title = title.into();
        Self { title, ..self }
    }

    /// Adds a shape.
    pub fn shape(&mut self, shape: Shape) {
        self.pieces.push(Piece::Shape(shape));
    }

    /// Adds a text, unless it is empty.
    pub fn text(&mut self, text: Text) {
        if !text.text.is_empty() {
            self.pieces.push(Piece::Text(text));
        }
    }
}

/// A path through these points, closed.
pub fn polygon(points: &[Point]) -> Form {
    let mut steps: Vec<Step> = points.iter().map(|p| Step::Line(*p)).collect();
    if let Some(first) = points.first() {
        steps[0] = Step::Move(*first);
        steps.push(Step::Close);
    }
    Form::Path(steps)
}

/// A straight line.
pub fn line(from: Point, to: Point) -> Form {
    Form::Path(vec![Step::Move(from), Step::Line(to)])
}
