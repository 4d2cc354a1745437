//! A graph as `rqt_graph` saves it, with all positions, so that it can load the file.
//!
//! Its loader reads points with y up from `pos`, `bb` and `lp`, inches from `width` and `height`, and does
//! not draw elements without a position. It fails on edge labels without `lp`, widths that are not whole
//! numbers, edges with heads at both ends, clusters without a `graph` statement and colours in parts; all
//! edges must be at the top level, or they appear twice.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::names::{escape_name, quoted};
use super::{DotView, label, line, pen_width, rate};
use crate::base::geometry::{Point, Rect, Size};
use crate::draw::paint::xml::hundredth;
use crate::graph::{Element, Id as _};
use crate::layout::Route;
use crate::view::{Arrow, ArrowKind, Contents, Item, ItemId, ItemKind, Mark, SeenWindow, Shown};

/// The length of an arrow's head in points, as Graphviz draws it.
const HEAD: f64 = 10.0;
/// The distance from a cluster's corner to its title, Graphviz's margin of clusters.
const MARGIN: f64 = 8.0;
const POINTS_PER_INCH: f64 = 72.0;

impl DotView<'_> {
    /// One window, or the [`union`](crate::view::union()) of all.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn write(&self, out: &mut impl Write, seen: &SeenWindow) -> io::Result<()> {
        let size = self.layout.size;
        let bb = format!("0,0,{},{}", number(size.w), number(size.h));
        writeln!(
            out,
            "digraph graphname {{\n graph [bb=\"{bb}\", compound=true, rank=same, rankdir=LR, ranksep=0.2];"
        )?;
        self.members(out, &self.view.contents(seen), None, " ")?;
        let arrows = seen.arrows.iter();
        let mut arrows = arrows.filter_map(|shown| self.arrow(shown));
        arrows.try_for_each(|arrow| out.write_all(arrow.as_bytes()))?;
        out.write_all(b"}\n")
    }

    /// Writes the namespaces and items that are directly in a namespace, given by its index. Namespaces nest 16 deep at
    /// most.
    fn members(
        &self,
        out: &mut impl Write,
        contents: &Contents<'_>,
        home: Option<usize>,
        indent: &str,
    ) -> io::Result<()> {
        for at in contents.spaces.get(&home).into_iter().flatten() {
            let name = &self.view.namespaces[*at].name;
            let (id, text) = (&self.ids.namespaces[*at], self.cluster(*at, name));
            writeln!(out, "{indent}subgraph {id} {{ graph [{text}];")?;
            self.members(out, contents, Some(*at), &format!("{indent} "))?;
            writeln!(out, "{indent}}}")?;
        }
        for (shown, item) in contents.items.get(&home).into_iter().flatten() {
            let at = shown.id as usize;
            let (id, place) = (&self.ids.items[at], self.layout.boxes[at]);
            let text = self.item(item, place, shown);
            writeln!(out, "{indent}{id} [{text}];")?;
        }
        Ok(())
    }

    fn cluster(&self, at: usize, name: &str) -> String {
        let place = self.layout.clusters.get(at).copied().unwrap_or_default();
        let title = self.plan.clusters.get(at);
        let title = title.map_or_else(Size::default, |c| c.title);
        let (top, bottom) = (self.up(place.y), self.up(place.bottom()));
        let bb = [place.x, bottom, place.right(), top].map(number).join(",");
        let (x, y) = (
            place.x + MARGIN + title.w / 2.0,
            place.y + MARGIN / 2.0 + title.h / 2.0,
        );
        let (label, lp) = (quoted(name), self.point(Point::new(x, y)));
        format!("bb=\"{bb}\", label={label}, lp=\"{lp}\"")
    }

    fn item(&self, item: &Item, place: Rect, shown: &Shown) -> String {
        let (shape, url) = match item.kind {
            ItemKind::Node | ItemKind::Namespace => ("ellipse", item.name.to_string()),
            ItemKind::Topic => ("box", format!("topic:{}", item.name)),
            ItemKind::Group => ("box3d", format!("topic:{}", item.name)),
        };
        let mut out = format!(
            "label={}, shape={shape}, pos=\"{}\", width={}, height={}, tooltip={}, URL=\"{}\"",
            quoted(&item.name),
            self.point(place.centre()),
            inches(place.w),
            inches(place.h),
            quoted(&url),
            escape_name(&url),
        );
        if let Some(colour) = self.colour(shown) {
            let _ = write!(out, ", color=\"{colour}\"");
        }
        self.extras(&mut out, shown, &item.members);
        out
    }

    fn arrow(&self, shown: &Shown) -> Option<String> {
        let at = shown.arrow();
        let (arrow, route) = (self.view.arrows.get(at)?, self.layout.routes.get(at.at())?);
        let ids = &self.ids.items;
        let (from, to) = (ids.get(arrow.from.at())?, ids.get(arrow.to.at())?);
        let (pos, width, style) = (self.spline(arrow, route), pen_width(shown), line(shown));
        let mut out = format!(" {from} -> {to} [pos=\"{pos}\", penwidth={width}, style={style}");
        if let Some(label) = label(arrow, shown) {
            let lp = route.label.unwrap_or_else(|| middle(route));
            let _ = write!(out, ", label={}, lp=\"{}\"", quoted(&label), self.point(lp));
        }
        if let ArrowKind::Direct(topic) = &arrow.kind {
            let _ = write!(out, ", URL=\"{}\"", escape_name(&format!("topic:{topic}")));
        }
        if let Some(colour) = self.colour(shown) {
            let _ = write!(out, ", color=\"{colour}\"");
        }
        let _ = write!(out, ", edgetooltip={}", quoted(&self.tooltip(arrow, shown)));
        self.extras(&mut out, shown, &arrow.members);
        Some(out + "];\n")
    }

    /// Our own attributes, which loaders ignore.
    fn extras(&self, out: &mut String, shown: &Shown, members: &[Element]) {
        let (state, confidence) = (shown.state.word(), shown.confidence.word());
        let _ = write!(out, ", state={state}, degree={confidence}");
        let evidence = self.evidence(members);
        if !evidence.is_empty() {
            let _ = write!(out, ", evidence={}", quoted(&evidence));
        }
        if let Some(hz) = shown.hz.filter(|hz| hz.is_finite()) {
            let _ = write!(out, ", rate=\"{}\"", number(hz));
        }
        if let Some(count) = shown.count {
            let _ = write!(out, ", count={count}");
        }
        if let Some(mark) = shown.mark {
            let _ = write!(out, ", change={}", mark.class());
        }
    }

    /// The tooltip in the style of `rqt_graph`: a line per value. Qt interprets it as rich text.
    fn tooltip(&self, arrow: &Arrow, shown: &Shown) -> String {
        let name = |id: ItemId| {
            let item = self.view.items.get(id);
            rich(item.map_or("", |item| item.name.as_ref()))
        };
        let (from, to) = (name(arrow.from), name(arrow.to));
        let mut out = match &arrow.kind {
            ArrowKind::Publish => format!("Publisher\nnode_name: {from}\ntopic_name: {to}"),
            ArrowKind::Subscribe => format!("Subscription\nnode_name: {to}\ntopic_name: {from}"),
            ArrowKind::Direct(topic) => {
                let topic = rich(topic);
                format!("Publisher\nnode_name: {from}\ntopic_name: {topic}\nsubscriber: {to}")
            }
            ArrowKind::Bundle => {
                let topics = arrow.carries(shown).unwrap_or_default();
                format!("Publisher\nnode_name: {from}\n{topics}\nsubscriber: {to}")
            }
        };
        if let Some(qos) = self.qos(&arrow.members) {
            let _ = write!(out, "\nQoS settings\n- {}", rich(&qos));
        }
        if let Some(rate) = rate(shown) {
            let _ = write!(out, "\nrate: {rate}");
        }
        if let (Some(count), true) = (shown.count, shown.mark != Some(Mark::Removed)) {
            let _ = write!(out, "\nmessages: {count}");
        }
        let evidence = self.evidence(&arrow.members);
        if !evidence.is_empty() {
            let _ = write!(out, "\nevidence: {evidence}");
        }
        out
    }

    /// The quality of service of a single topic.
    fn qos(&self, members: &[Element]) -> Option<String> {
        let topic = self.elements.ends(*members.first()?).1?;
        let qos = self.elements.topics.get(topic)?.qos.as_ref()?;
        (!qos.is_empty()).then(|| qos.to_string())
    }

    /// The route of an edge: its tip, then its curve up to the arrow's head.
    fn spline(&self, arrow: &Arrow, route: &Route) -> String {
        let mut points = vec![route.start];
        points.extend(route.curves.iter().flatten());
        if points.len() < 4 {
            let centre = |id: ItemId| Some(self.layout.boxes.get(id.at())?.centre());
            let [from, to] = [arrow.from, arrow.to].map(|id| centre(id).unwrap_or_default());
            points = vec![from, from, to, to];
        }
        let last = points.len() - 1;
        let tip = points[last];
        let mut behind = points[..last].iter().rev();
        if let Some(before) = behind.find(|p| p.distance(tip) > 0.5) {
            points[last] = tip.towards(*before, (HEAD / before.distance(tip)).min(0.5));
        }
        let points: Vec<String> = points.iter().map(|p| self.point(*p)).collect();
        format!("e,{} {}", self.point(tip), points.join(" "))
    }

    fn point(&self, p: Point) -> String {
        format!("{},{}", number(p.x), number(self.up(p.y)))
    }

    fn up(&self, y: f64) -> f64 {
        self.layout.size.h - y
    }
}

/// A point near the middle of a route, for a label that the layout did not place.
fn middle(route: &Route) -> Point {
    let mid = route.curves.get(route.curves.len() / 2);
    mid.map_or(route.start, |[a, b, _]| {
        Point::new(f64::midpoint(a.x, b.x), f64::midpoint(a.y, b.y))
    })
}

/// The number with at most two decimals; 0 for one that is not finite.
fn number(value: f64) -> String {
    hundredth(value).to_string()
}

fn inches(points: f64) -> String {
    format!("{:.4}", points / POINTS_PER_INCH)
}

/// Text inside a tooltip that is interpreted as HTML.
fn rich(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::style::Style;
    use crate::draw::text::Fonts;
    use crate::view::testing::mission;
    use crate::view::{Mode, ViewOptions, view};

    /// The file of the last window.
    fn file(windows: &[&str], options: &ViewOptions) -> String {
        let mission = mission(windows);
        let (view, _) = view(&mission, options);
        let style = Style::builtin("light").unwrap();
        let drawing = DotView::new(&mission, &view, style, &Fonts::bundled());
        let mut out = Vec::new();
        (drawing.write(&mut out, &view.seen(view.frames.len() - 1))).unwrap();
        String::from_utf8(out).unwrap()
    }

    /// The line that begins with this, without indent.
    fn line<'a>(file: &'a str, begin: &str) -> &'a str {
        let mut lines = file.lines().map(str::trim_start);
        lines
            .find(|l| l.starts_with(begin))
            .unwrap_or_else(|| panic!("{begin} in {file}"))
    }

    #[test]
    fn nodes_and_topics_are_written_like_in_rqt_graph() {
        let file = file(&["/ns/a>/t@12 /b</t /a>/tf /ns/c"], &ViewOptions::default());
        assert!(line(&file, "n___b [").contains(r#"label="/b", shape=ellipse, pos=""#));
        assert!(line(&file, "n___b [").contains(r#"tooltip="/b", URL="__b""#));
        assert!(line(&file, "t___t [").contains(r#"label="/t", shape=box, pos=""#));
        assert!(line(&file, "t___t [").contains(r#"tooltip="topic:/t", URL="topic_3A__t""#));
        assert!(line(&file, "n_n__tf [").contains(r#"label="/tf", shape=box3d"#));
        assert!(line(&file, "subgraph cluster___ns {").contains(r#"graph [bb=""#));
        let edge = line(&file, "n___ns__a -> t___t [");
        assert!(
            edge.contains(r#"penwidth=3, style=solid, label="12 Hz", lp=""#),
            "{edge}"
        );
        assert!(!file.contains("colorR") && !file.contains("edge ["));
    }

    #[test]
    fn a_window_shows_its_changes_and_empty_namespaces_are_left_out() {
        let file = file(
            &["/a>/t@1 /old/b /old/c", "/a", "/a /d"],
            &ViewOptions::default(),
        );
        assert!(line(&file, "n___d [").contains("change=added") && !file.contains("cluster_"));
        assert!(!line(&file, "n___a [").contains("color="));
    }

    #[test]
    fn ghosts_are_dashed_and_carry_no_rate() {
        let file = file(&["/a>/t@1", "/a"], &ViewOptions::default());
        let edge = line(&file, "n___a -> t___t [");
        assert!(edge.contains("style=dashed") && edge.contains("change=removed"));
        assert!(!edge.contains("label="));
    }

    #[test]
    fn nodes_only_names_topics_on_edges() {
        let options = ViewOptions {
            mode: Mode::Nodes,
            ..ViewOptions::default()
        };
        let file = file(&["/a>/t@2 /b</t"], &options);
        let edge = line(&file, "n___a -> n___b [");
        assert!(
            edge.contains(r#"label="/t\n2 Hz", lp=""#) && edge.contains(r#"URL="topic_3A__t""#)
        );
    }

    #[test]
    fn numbers_have_two_decimals_at_most() {
        let all = [1.0, -0.001, 12.345, f64::NAN].map(number);
        assert_eq!(all, ["1", "0", "12.35", "0"].map(str::to_owned));
    }
}
