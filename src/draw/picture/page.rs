//! The page: its parts for title, graph, legend and timeline, and the scale of the graph in its part.

use super::PageOptions;
use crate::base::geometry::{Point, Rect, Size};
use crate::draw::style::Style;
use crate::draw::text::Fonts;
use crate::draw::timeline::below::BelowSizes;

/// The page size for which lengths of title, legend and timeline are given: the smallest common size of a screen.
const STANDARD: Size = Size::new(1280.0, 720.0);
/// The largest scale of the graph, over its natural size: beyond it, the names of a small graph are nearly as
/// large as the headline.
const LARGEST: f64 = 1.35;

/// The positions of all parts of the page, equal in every frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PageFrame {
    pub(crate) size: Size,
    /// The scale of title, legend and timeline: 1 on a page of 1280 × 720.
    pub(crate) unit: f64,
    /// The largest scale of the graph.
    largest: f64,
    /// Empty parts (`--bare`) have no height.
    pub(crate) title: Rect,
    pub(crate) graph: Rect,
    pub(crate) legend: Rect,
    pub(crate) timeline: Rect,
}

/// What is at the bottom of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Strip {
    /// Nothing: two missions are compared, or a mission has a single window and no phases.
    Nothing,
    /// The phases of a still.
    Phases,
    /// The timeline of a film.
    Timeline,
}

/// The scale and the position of the graph in its part of the page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GraphFit {
    pub(crate) scale: f64,
    /// The scale of strokes and badges: they shrink less than the elements that they surround, to stay visible.
    pub(crate) pen: f64,
    pub(crate) origin: Point,
}

/// The style, the fonts and the scale that the graph is drawn with.
pub(crate) struct GraphPen<'a> {
    pub(crate) style: &'a Style,
    pub(crate) fonts: &'a Fonts,
    pub(crate) fit: GraphFit,
}

impl PageFrame {
    /// The page of these options, with `rows` rows of legend.
    pub(crate) fn new(style: &Style, options: &PageOptions, rows: usize, bottom: Strip) -> Self {
        let size = options.size;
        let unit = unit(options);
        let strip = |y: f64, height: f64| Rect::new(0.0, y, size.w, height);
        let (mut title, mut legend, mut timeline) = (0.0, 0.0, 0.0);
        if !options.bare {
            title = style.title.height * unit;
            if options.has_legend {
                // Rows at nearly twice the text's size, so that signs of two rows do not touch.
                legend = (style.legend.size * 1.9 * rows as f64 + 8.0) * unit;
            }
            if bottom != Strip::Nothing {
                timeline = below(style, options, bottom).height(&options.timeline);
            }
        }
        // On a small page the graph keeps nine tenths of each side.
        let margin = (style.page.margin * unit)
            .min(size.w / 20.0)
            .min(size.h / 20.0);
        let top = title;
        let bottom = (size.h - legend - timeline).max(top + 1.0);
        // The title's bar separates already.
        let above = if options.bare { margin } else { margin / 4.0 };
        let graph = Rect::new(
            margin,
            top + above,
            size.w - 2.0 * margin,
            bottom - top - above - margin,
        );
        Self {
            size,
            unit,
            largest: options.largest.unwrap_or(LARGEST * unit.max(0.8)),
            title: strip(0.0, title),
            graph: Rect::new(graph.x, graph.y, graph.w.max(1.0), graph.h.max(1.0)),
            legend: strip(bottom, legend),
            timeline: strip(bottom + legend, timeline),
        }
    }

    /// The largest scale at which a layout of this size fits, and the position of its corner, so that it is
    /// centred.
    pub(crate) fn fit(&self, layout: Size) -> GraphFit {
        let (w, h) = (layout.w.max(1.0), layout.h.max(1.0));
        let scale = (self.graph.w / w).min(self.graph.h / h).min(self.largest);
        let middle = self.graph.centre();
        GraphFit {
            scale,
            pen: libm::sqrt(scale),
            origin: Point::new(middle.x - w * scale / 2.0, middle.y - h * scale / 2.0),
        }
    }
}

/// The sizes of the timeline on a page.
pub(crate) fn below<'a>(style: &'a Style, options: &PageOptions, strip: Strip) -> BelowSizes<'a> {
    BelowSizes {
        style,
        unit: unit(options),
        is_paper: options.width_mm.is_some(),
        is_still: strip == Strip::Phases,
    }
}

/// The scale of title, legend and timeline on a page, by its size unless given: on a larger page it grows
/// less than the graph.
pub(crate) fn unit(options: &PageOptions) -> f64 {
    if let Some(unit) = options.unit {
        return unit;
    }
    let size = options.size;
    // Below 0.62, the words of the legend would be smaller than 7 pixels.
    let ratio = (size.w / STANDARD.w)
        .min(size.h / STANDARD.h)
        .clamp(0.62, 4.0);
    // On a page twice as large, words are 1.6 times as large: the rest of it is for the graph.
    if ratio > 1.0 {
        libm::pow(ratio, 0.7)
    } else {
        ratio
    }
}

impl GraphFit {
    pub(crate) fn point(&self, p: Point) -> Point {
        Point::new(
            self.origin.x + p.x * self.scale,
            self.origin.y + p.y * self.scale,
        )
    }

    pub(crate) fn rect(&self, r: Rect) -> Rect {
        let corner = self.point(Point::new(r.x, r.y));
        Rect::new(corner.x, corner.y, r.w * self.scale, r.h * self.scale)
    }
}
