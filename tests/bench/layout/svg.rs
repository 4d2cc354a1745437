//! A layout as an SVG with `data-*` attributes, for viewing and external measurements.

use std::fmt::Write as _;

use bagreel::internals::layout::Layout;

use crate::graph::Graph;

/// The whole drawing.
pub(crate) fn svg(graph: &Graph, layout: &Layout) -> String {
    let mut out = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{0:.0}" height="{1:.0}" viewBox="-10 -10 {0:.0} {1:.0}"><rect x="-10" y="-10" width="100%" height="100%" fill="white"/>"#,
        layout.size.w + 20.0,
        layout.size.h + 20.0
    );
    out += r##"<defs><marker id="a" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto"><path d="M0 1L8 4L0 7z" fill="#556"/></marker></defs>"##;
    for (rect, name) in layout.clusters.iter().zip(&graph.clusters) {
        let _ = write!(
            out,
            "<rect x='{:.1}' y='{:.1}' width='{:.1}' height='{:.1}' rx='4' fill='#e8eef6' fill-opacity='.5' stroke='#c5cedc'/><text x='{:.1}' y='{:.1}' font-size='11' fill='#667' font-family='Inter,DejaVu Sans'>{name}</text>",
            rect.x,
            rect.y,
            rect.w,
            rect.h,
            rect.x + 6.0,
            rect.y + 13.0
        );
    }
    for (route, link) in layout.routes.iter().zip(&graph.plan.links) {
        let kind = if link.from < graph.nodes {
            "publish"
        } else {
            "subscribe"
        };
        let mut d = format!("M{:.1} {:.1}", route.start.x, route.start.y);
        for [a, b, c] in &route.curves {
            let _ = write!(
                d,
                "C{:.1} {:.1} {:.1} {:.1} {:.1} {:.1}",
                a.x, a.y, b.x, b.y, c.x, c.y
            );
        }
        let _ = write!(
            out,
            r##"<g class="edge {kind}" data-from="{}" data-to="{}"><path d="{d}" fill="none" stroke="#7d879b" stroke-width="1.1" marker-end="url(#a)"/>"##,
            graph.names[link.from], graph.names[link.to]
        );
        if let (Some(at), Some(size)) = (route.label, link.label) {
            let text = "8".repeat(((size.w - 2.0) / 5.5).round() as usize);
            let _ = write!(
                out,
                "<text x='{:.1}' y='{:.1}' font-size='11' text-anchor='middle' fill='#556' stroke='white' stroke-width='3' paint-order='stroke' font-family='Inter,DejaVu Sans'>{text}</text>",
                at.x,
                at.y + 4.0
            );
        }
        out += "</g>";
    }
    for (i, (rect, name)) in layout.boxes.iter().zip(&graph.names).enumerate() {
        let (x, y) = (rect.centre().x, rect.centre().y);
        let short = name.rsplit('/').next().unwrap_or("");
        let _ = if i < graph.nodes {
            write!(
                out,
                "<g class='node' data-name='{name}'><ellipse cx='{x:.1}' cy='{y:.1}' rx='{:.1}' ry='{:.1}' fill='#EAF0F8' stroke='#5B6B86'/><text x='{x:.1}' y='{:.1}' font-size='13' text-anchor='middle' font-weight='600' font-family='Inter,DejaVu Sans'>{short}</text></g>",
                rect.w / 2.0,
                rect.h / 2.0,
                y + 4.5
            )
        } else {
            write!(
                out,
                "<g class='topic' data-name='{name}'><rect x='{:.1}' y='{:.1}' width='{:.1}' height='{:.1}' fill='#FFFCF3' stroke='#A79A7C'/><text x='{x:.1}' y='{:.1}' font-size='12' text-anchor='middle' font-family='Inter,DejaVu Sans'>{short}</text></g>",
                rect.x,
                rect.y,
                rect.w,
                rect.h,
                y + 4.0
            )
        };
    }
    out + "</svg>"
}
