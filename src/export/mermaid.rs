//! Graphs as Mermaid flow charts, which GitHub and GitLab draw inside Markdown.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::{Started, at_end, text_per_window};
use crate::base::ids::grouped;
use crate::base::words;
use crate::draw::style::Style;
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::view::{Item, ItemKind, Mark, SeenWindow, Shown, View};

/// Begins the files, one per window; without `{n}` one file with the single window or the union of all.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let (view, style) = (sequence.view, Style::builtin("light")?);
    let target = target.clone();
    Ok(at_end(move || {
        text_per_window(
            view,
            &target,
            |seen, _| chart(view, &style, seen),
            too_large,
        )
    }))
}

/// The numbers of edges and of characters above which Mermaid refuses to draw unless it is configured otherwise (its
/// `maxEdges` and `maxTextSize`).
const MOST: (usize, usize) = (500, 50_000);

fn too_large(target: &Target, seen: &SeenWindow, text: &str) -> Option<String> {
    let (edges, bytes) = (seen.arrows.len(), text.len());
    (edges > MOST.0 || bytes > MOST.1).then(|| {
        format!(
            "`{}` has {edges} edges in {bytes} characters: Mermaid draws at most {} in {}; hide or collapse some elements",
            target.path().display(),
            MOST.0,
            MOST.1
        )
    })
}

/// One window as a flow chart. Ids are numbers, so that no name can break the syntax.
pub(crate) fn chart(view: &View, style: &Style, seen: &SeenWindow) -> String {
    let mut out = String::from("flowchart LR\n");
    let spaces = view.namespaces.iter().enumerate();
    let items = seen.items.iter().filter_map(|shown| {
        let item = view.items.get(shown.item())?;
        Some((item.cluster, (shown, item)))
    });
    let contents = Contents {
        view,
        spaces: grouped(spaces.map(|(at, space)| (space.parent, at))),
        items: grouped(items),
    };
    contents.write(&mut out, None, 1);
    let mut marked = String::new();
    for (at, shown) in seen.arrows.iter().enumerate() {
        let Some(arrow) = view.arrows.get(shown.arrow()) else {
            continue;
        };
        let line = match (&arrow.kind, shown.mark) {
            (_, Some(Mark::Removed | Mark::Away)) => "-.->",
            _ => "-->",
        };
        let topic = arrow.carries(shown);
        let topic = topic.map_or_else(String::new, |topic| escaped(&topic));
        let label = match (topic, shown.hz.filter(|hz| *hz > 0.0)) {
            (topic, None) => topic,
            (topic, Some(hz)) => format!("{topic} {}", words::rate(hz))
                .trim_start()
                .to_owned(),
        };
        let label = if label.is_empty() {
            label
        } else {
            format!("|\"{label}\"|")
        };
        let _ = writeln!(out, "  i{} {line}{label} i{}", arrow.from.0, arrow.to.0);
        if let Some(class) = shown.mark.map(Mark::class) {
            let _ = writeln!(marked, "  linkStyle {at} stroke:{}", colour(style, class));
        }
    }
    for (class, body) in [("node", &style.node), ("topic", &style.topic)] {
        let _ = writeln!(
            out,
            "  classDef {class} fill:{},stroke:{},color:{}",
            body.fill, body.stroke, body.text
        );
    }
    let changes = [
        ("added", &style.added),
        ("removed", &style.removed),
        ("changed", &style.changed),
    ];
    for (class, change) in changes {
        let dash = if class == "removed" {
            ",stroke-dasharray:6 4"
        } else {
            ""
        };
        let _ = writeln!(
            out,
            "  classDef {class} fill:{},stroke:{},color:{},stroke-width:3px{dash}",
            change.fill, change.color, change.text
        );
    }
    let away = style.away();
    let _ = writeln!(
        out,
        "  classDef away fill:none,stroke:{},color:{},stroke-dasharray:2 4",
        away.stroke, away.text
    );
    let cluster = &style.cluster;
    let _ = writeln!(
        out,
        "  classDef space fill:{},stroke:{},color:{}",
        cluster.fill, cluster.stroke, cluster.text
    );
    out + &marked
}

fn colour(style: &Style, class: &str) -> String {
    match class {
        "added" => style.added.color.to_string(),
        "removed" | "away" => style.removed.color.to_string(),
        _ => style.changed.color.to_string(),
    }
}

/// The namespaces and items directly in each namespace, and outside of all.
struct Contents<'a> {
    view: &'a View,
    spaces: BTreeMap<Option<usize>, Vec<usize>>,
    items: BTreeMap<Option<usize>, Vec<(&'a Shown, &'a Item)>>,
}

impl Contents<'_> {
    /// Writes those of a namespace. Namespaces nest at most 16 deep.
    fn write(&self, out: &mut String, home: Option<usize>, depth: usize) {
        let view = self.view;
        let indent = "  ".repeat(depth);
        // Names in a subgraph are written as there.
        let around = home.map_or("", |at| &*view.namespaces[at].name);
        let relative = |name: &str| {
            let inside = name.strip_prefix(around).filter(|_| home.is_some());
            let inside = inside.and_then(|rest| rest.strip_prefix('/'));
            escaped(inside.unwrap_or(name))
        };
        for at in self.spaces.get(&home).into_iter().flatten() {
            let space = &view.namespaces[*at];
            let mut inside = String::new();
            self.write(&mut inside, Some(*at), depth + 1);
            if !inside.is_empty() {
                let name = relative(&space.name);
                let _ = write!(
                    out,
                    "{indent}subgraph s{at}[\"{name}\"]\n{inside}{indent}end\n{indent}class s{at} space\n"
                );
            }
        }
        for (shown, item) in self.items.get(&home).into_iter().flatten() {
            let (open, close) = match item.kind {
                ItemKind::Node => ("([", "])"),
                _ if item.is_service => ("{{", "}}"),
                ItemKind::Namespace | ItemKind::Group => ("[[", "]]"),
                ItemKind::Topic => ("[", "]"),
            };
            let name = relative(&item.name);
            let _ = writeln!(
                out,
                "{indent}i{}{open}\"{name}\"{close}:::{}",
                shown.id,
                item.kind.word()
            );
            if let Some(class) = mark(shown) {
                let _ = writeln!(out, "{indent}class i{} {class}", shown.id);
            }
        }
    }
}

fn mark(shown: &Shown) -> Option<&'static str> {
    shown.mark.map(Mark::class)
}

/// A name inside quotes, with Mermaid's entities for all characters that could end the text or begin markup.
pub(crate) fn escaped(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_alphanumeric() || matches!(c, '/' | '_' | '-' | '.' | ' ' | ':') {
            out.push(c);
        } else {
            let _ = write!(out, "#{};", u32::from(c));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{ViewOptions, view};

    #[test]
    fn a_window_is_a_flow_chart() {
        let (view, _) = view(
            &mission(&["/n/a>/n/t@2", "/n/a>/n/t@2 /b\"</n/t"]),
            &ViewOptions::default(),
        );
        let text = chart(&view, &Style::builtin("light").unwrap(), &view.seen(1));
        let want = [
            "flowchart LR",
            "  subgraph s0[\"/n\"]",
            "    i1([\"a\"]):::node",
            "    i2[\"t\"]:::topic",
            "  end",
            "  class s0 space",
            "  i0([\"/b#34;\"]):::node",
            "  class i0 added",
            "  i1 -->|\"2 Hz\"| i2",
            "  i2 --> i0",
        ];
        assert_eq!(text.lines().take(want.len()).collect::<Vec<_>>(), want);
    }
}
