//! The profile `plain`: without positions, with a title and colours, for `dot -Tpdf`.

use std::fmt::Write as _;

use super::names::quoted;
use super::{DotView, label, line, pen_width};
use crate::draw::style::Body;
use crate::graph::{Id as _, State};
use crate::view::{Arrow, Item, ItemKind, SeenWindow, Shown};

const FONTS: &str = "Helvetica,Arial,sans-serif";

pub(super) fn write(drawing: &DotView<'_>, seen: &SeenWindow, title: &str) -> String {
    let style = &drawing.style;
    let mut out = format!(
        "digraph graphname {{\n graph [rankdir=LR, compound=true, label={}, labelloc=t, fontsize=16, fontcolor=\"{}\", fontname=\"{FONTS}\"];\n",
        quoted(title),
        style.page.text,
    );
    let _ = writeln!(
        out,
        " node [fontsize=12, fontname=\"{FONTS}\", style=filled, height=0.4];"
    );
    let _ = writeln!(
        out,
        " edge [fontsize=10, fontname=\"{FONTS}\", color=\"{}\", fontcolor=\"{}\", arrowsize=0.7];",
        style.edge.stroke, style.edge.text,
    );
    let cluster = &style.cluster;
    let space = |at: usize, indent: &str| {
        format!(
            "\n{indent} graph [label={}, labeljust=l, style=\"rounded,filled\", fillcolor=\"{}\", color=\"{}\", fontcolor=\"{}\", fontsize=12];",
            quoted(&drawing.view.namespaces[at].name),
            cluster.fill,
            cluster.stroke,
            cluster.text,
        )
    };
    let item = |_, item: &Item, shown: &Shown| node(drawing, item, shown);
    let whole = (None, &*drawing.view.inhabited(seen), " ");
    drawing.members(&mut out, seen, whole, (&space, &item));
    for shown in &seen.arrows {
        if let Some(arrow) = drawing.view.arrows.get(shown.arrow()) {
            edge(drawing, &mut out, arrow, shown);
        }
    }
    out.push_str("}\n");
    out
}

fn node(drawing: &DotView<'_>, item: &Item, shown: &Shown) -> String {
    let (shape, body) = look(drawing, item.kind);
    let shape = if item.is_service { "hexagon" } else { shape };
    let change = drawing.colour(shown);
    let dead = matches!(shown.state, State::Silent | State::Declared);
    let line = match change {
        Some(_) if line(shown) == "dashed" => "dashed",
        _ if dead => "dotted",
        _ => "solid",
    };
    let mut out = format!(
        "label={}, shape={shape}, style=\"filled,{line}\", fillcolor=\"{}\", fontcolor=\"{}\", color=\"{}\"",
        quoted(&item.name),
        body.fill,
        body.text,
        change.clone().unwrap_or_else(|| body.stroke.to_string()),
    );
    if change.is_some() {
        out.push_str(", penwidth=3");
    }
    out
}

fn look<'a>(drawing: &'a DotView<'_>, kind: ItemKind) -> (&'static str, &'a Body) {
    match kind {
        ItemKind::Node => ("ellipse", &drawing.style.node),
        ItemKind::Namespace => ("box3d", &drawing.style.node),
        ItemKind::Topic => ("box", &drawing.style.topic),
        ItemKind::Group => ("box3d", &drawing.style.topic),
    }
}

fn edge(drawing: &DotView<'_>, out: &mut String, arrow: &Arrow, shown: &Shown) {
    let ids = &drawing.ids.items;
    let (Some(from), Some(to)) = (ids.get(arrow.from.at()), ids.get(arrow.to.at())) else {
        return;
    };
    let _ = write!(
        out,
        " {from} -> {to} [style={}, penwidth={}",
        line(shown),
        pen_width(shown)
    );
    if let Some(label) = label(arrow, shown) {
        let _ = write!(out, ", label={}", quoted(&label));
    }
    if let Some(colour) = drawing.colour(shown) {
        let _ = write!(out, ", color=\"{colour}\", fontcolor=\"{colour}\"");
    }
    out.push_str("];\n");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::style::Style;
    use crate::view::testing::mission;
    use crate::view::{ViewOptions, view};

    #[test]
    fn plain_dot_has_title_and_colours_without_positions() {
        let mission = mission(&["/ns/a>/t@3", "/ns/a>/t@3 /b</t"]);
        let (view, _) = view(&mission, &ViewOptions::default());
        let drawing = DotView::new(&mission, &view, Style::builtin("light").unwrap());
        let file = drawing.write(&view.seen(1), "a \"bag\", window 2 of 2");
        assert!(file.contains(r#"label="a \"bag\", window 2 of 2""#) && !file.contains("pos="));
        let added = format!(
            "color=\"{}\", penwidth=3",
            drawing.style.added.color.to_string().to_lowercase()
        );
        assert_eq!(file.matches(&added).count(), 1);
        assert!(file.contains(r#"n___ns__a -> t___t [style=solid, penwidth=2, label="3 Hz"];"#));
    }
}
