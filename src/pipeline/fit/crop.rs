//! A page cropped to its graph, if names of a legible size leave it empty.

use crate::base::geometry::Size;
use crate::draw::picture::PageOptions;
use crate::pipeline::Drawing;
use crate::pipeline::compose::Composed;

/// The size of names on a page cropped to its graph, in pixels.
const NAMES: f64 = 15.0;
/// The space around the graph on such a page, in pixels.
const AROUND: f64 = 20.0;
/// The minimum width of such a page for an animation, which has a timeline, and for a still; and the minimum height.
const LEAST: (f64, f64, f64) = (720.0, 320.0, 140.0);
/// The minimum width of such a page with a legend.
const LEGEND: f64 = 480.0;
/// The width of a page with decorations (title, legend, timeline) of normal size, and their smallest legible scale.
const DECORATIONS: (f64, f64) = (1100.0, 0.8);

/// The page of a medium as high as its graph: paper is no wider or narrower, but need not stay empty.
pub(super) fn lowered(composed: &Composed, drawing: &Drawing) -> PageOptions {
    let page = &composed.page;
    let measured = composed.measured(drawing);
    let graph = composed.layout.size.h * measured.scale(&composed.layout);
    let high = page.size.h - measured.layout_options().page.h + graph;
    PageOptions {
        size: Size::new(page.size.w, libm::ceil(high).min(page.size.h)),
        ..page.clone()
    }
}

/// The page cropped to its graph, if names of a legible size leave it empty.
pub(super) fn cropped(composed: &Composed, drawing: &Drawing) -> PageOptions {
    let (view, page, natural) = (&composed.view, &composed.page, composed.layout.size);
    let largest = NAMES / drawing.style.node.size;
    let scale = composed
        .measured(drawing)
        .scale(&composed.layout)
        .min(largest);
    let least = if view.has_time() { LEAST.0 } else { LEAST.1 };
    let wide = (natural.w * scale + 2.0 * AROUND)
        .max(least)
        .min(page.size.w);
    let mut cropped = PageOptions {
        size: Size::new(wide, page.size.h),
        unit: Some((wide / DECORATIONS.0).clamp(DECORATIONS.1, 1.0)),
        has_legend: page.has_legend && wide >= LEGEND,
        ..page.clone()
    };
    let decorations = page.size.h
        - drawing
            .measured(view, cropped.clone())
            .layout_options()
            .page
            .h;
    let high = decorations + natural.h * scale + 1.2 * AROUND;
    cropped.size = Size::new(libm::ceil(wide), libm::ceil(high.max(LEAST.2)));
    if cropped.size.h < page.size.h {
        cropped
    } else {
        page.clone()
    }
}
