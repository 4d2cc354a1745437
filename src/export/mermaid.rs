//! Graphs as Mermaid flow charts, which GitHub and GitLab draw inside Markdown.

use std::fmt::Write as _;
use std::io::Write as _;

use super::{Started, text_per_window};
use crate::base::words;
use crate::draw::picture::{options, short_name};
use crate::draw::style::{Body, Change, Color, Style};
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::view::{Contents, ItemKind, Mark, SeenWindow, View};

/// Begins the files, one per window; without `{n}` one file with the single window or the union of all.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let style = Style::builtin("light")?;
    let is_large = sequence.view.arrows.len() > MANY;
    let paired = sequence.paired.filter(|_| is_large);
    let view = paired.unwrap_or(sequence.view);
    Ok(text_per_window(view, target, move |sink, seen| {
        sink.write_all(chart(view, &style, seen).as_bytes())
    }))
}

/// The most edges of a chart with a box per topic: on a page, the text of a larger one is about 4 pixels high.
pub(crate) const MANY: usize = 20;
/// One window as a flow chart. Ids are numbers, so that no name can break the syntax.
pub(crate) fn chart(view: &View, style: &Style, seen: &SeenWindow) -> String {
    let mut out = String::from("flowchart LR\n");
    members(&mut out, (view, &view.contents(seen)), None, 1);
    let mut marked = String::new();
    for (at, shown) in seen.arrows.iter().enumerate() {
        let Some(arrow) = view.arrows.get(shown.arrow()) else {
            continue;
        };
        let line = match shown.mark {
            Some(Mark::Removed | Mark::Away) => "-.->",
            _ => "-->",
        };
        let (from, to, both) = match shown.ways() {
            [true, true] => (arrow.from, arrow.to, "<"),
            [false, true] => (arrow.to, arrow.from, ""),
            _ => (arrow.from, arrow.to, ""),
        };
        let space = view.items[from].cluster;
        let space = space.filter(|at| view.items[to].cluster == Some(*at));
        let topic = arrow.carries(shown);
        let topic = topic.map_or_else(String::new, |topic| relative(view, space, &topic));
        let rate = shown.hz.filter(|hz| *hz > 0.0).map(words::rate);
        let label = format!("{topic} {}", rate.unwrap_or_default());
        let label = match label.trim() {
            "" => String::new(),
            label => format!("|\"{label}\"|"),
        };
        let _ = writeln!(out, "  i{} {both}{line}{label} i{}", from.0, to.0);
        if let Some(mark) = shown.mark {
            let color = options::change(style, mark).color;
            let _ = writeln!(marked, "  linkStyle {at} stroke:{color}");
        }
    }
    let away = style.away();
    let body = |body: &Body| [body.fill, body.stroke, body.text];
    let change = |change: &Change| [change.fill, change.color, change.text];
    let cluster = &style.cluster;
    let classes = [
        ("node", body(&style.node), ""),
        ("topic", body(&style.topic), ""),
        ("added", change(&style.added), ",stroke-width:3px"),
        (
            "removed",
            change(&style.removed),
            ",stroke-width:3px,stroke-dasharray:6 4",
        ),
        ("changed", change(&style.changed), ",stroke-width:3px"),
        (
            "away",
            [Color::NONE, away.stroke, away.text],
            ",stroke-dasharray:2 4",
        ),
        ("space", [cluster.fill, cluster.stroke, cluster.text], ""),
    ];
    for (class, [fill, stroke, text], more) in classes {
        let colors = format!("fill:{fill},stroke:{stroke},color:{text}");
        let _ = writeln!(out, "  classDef {class} {colors}{more}");
    }
    out + &marked
}

/// Writes the namespaces and items that are directly in a namespace.
fn members(
    out: &mut String,
    (view, contents): (&View, &Contents<'_>),
    home: Option<usize>,
    depth: usize,
) {
    let indent = "  ".repeat(depth);
    for at in contents.spaces.get(&home).into_iter().flatten() {
        let name = relative(view, home, &view.namespaces[*at].name);
        let _ = writeln!(out, "{indent}subgraph s{at}[\"{name}\"]");
        members(out, (view, contents), Some(*at), depth + 1);
        let _ = writeln!(out, "{indent}end\n{indent}class s{at} space");
    }
    for (shown, item) in contents.items.get(&home).into_iter().flatten() {
        let (open, close) = match item.kind {
            ItemKind::Node => ("([", "])"),
            _ if item.is_service => ("{{", "}}"),
            ItemKind::Namespace | ItemKind::Group => ("[[", "]]"),
            ItemKind::Topic => ("[", "]"),
        };
        let (id, class) = (shown.id, item.kind.word());
        let name = relative(view, home, &item.name);
        let _ = writeln!(out, "{indent}i{id}{open}\"{name}\"{close}:::{class}");
        if let Some(mark) = shown.mark {
            let _ = writeln!(out, "{indent}class i{id} {}", mark.class());
        }
    }
}

/// A name as it is written inside the subgraph of a namespace.
fn relative(view: &View, home: Option<usize>, name: &str) -> String {
    let inside = home.map_or("", |at| &*view.namespaces[at].name);
    escaped(short_name(name, inside))
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
