//! The mission as one self-contained page: the graph drawn once, its history as runs, and a player.
//!
//! `player/` contains the handwritten parts of the page: its template, its style sheet, and its script in parts, which are
//! joined in order. [`data`] defines the data for the script.

mod changes;
mod data;
mod element_runs;
mod signs;

use std::fmt::Write as _;

use super::{Started, one_text};
use crate::base::digest;
use crate::base::notice::NoticeKind;
use crate::base::words;
use crate::base::words::visible;
use crate::draw::paint::classes::{self, Classes};
use crate::draw::paint::svg;
use crate::draw::paint::xml::Xml;
use crate::draw::picture::title::SIDES;
use crate::draw::picture::{Union, rate_label};
use crate::draw::style::{BUILTIN, Style};
use crate::draw::text;
use crate::draw::timeline::Timeline;
use crate::draw::topic_timeline::Overview;
use crate::export::sequence::{Sequence, UnionDrawings};
use crate::export::target::Target;
use crate::graph::Id as _;
use crate::mission::info::info;
use crate::view::{ArrowId, ItemId, View};
use changes::PageChanges;
use element_runs::ViewRuns;

const PAGE: &str = include_str!("html/player/page.html");
const LOOK: &str = include_str!("html/player/page.css");
/// The parts of the script, in order of dependency.
const SCRIPT: [&str; 9] = [
    include_str!("html/player/data.js"),
    include_str!("html/player/picture.js"),
    include_str!("html/player/zoom.js"),
    include_str!("html/player/lists.js"),
    include_str!("html/player/timeline.js"),
    include_str!("html/player/select.js"),
    include_str!("html/player/table.js"),
    include_str!("html/player/save.js"),
    include_str!("html/player/keys.js"),
];

/// The parts of a page.
pub(crate) struct HtmlPage<'a> {
    /// The whole sequence.
    pub sequence: &'a Sequence<'a>,
    /// The graph with all elements separately.
    pub whole: PageGraph<'a>,
    /// The graph of the picture, if it groups elements.
    pub folded: Option<PageGraph<'a>>,
    /// The style.
    pub style: &'a Style,
    /// The style for readers who prefer dark pages; `None` to use the same style always.
    pub dark: Option<&'a Style>,
    /// The title, such as the bag's name.
    pub title: &'a str,
    /// The drawing used if there is no graph.
    pub overview: Option<&'a Overview>,
}

/// A graph, drawn once, with the history of its elements.
pub(crate) struct PageGraph<'a> {
    pub view: &'a View,
    pub union: Union,
    pub runs: ViewRuns,
    /// The arrows in painting order.
    pub order: Vec<ArrowId>,
}

impl<'a> PageGraph<'a> {
    /// The graph of a view whose union is `union`; nothing is drawn if that is empty.
    pub(crate) fn new(view: &'a View, union: Union) -> Self {
        let order = if union.order.is_empty() {
            view.arrows.ids().collect()
        } else {
            union.order.clone()
        };
        Self {
            runs: ViewRuns::of(view, rate_label),
            view,
            union,
            order,
        }
    }
}

/// Begins the page.
///
/// # Errors
/// As [`one_text`].
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    let style = Style::builtin(BUILTIN[0].0)?;
    one_text(target, move || page(sequence, &style))
}

/// The page with the graph of all elements separately, and the picture's if it groups elements; none for a timeline of
/// topics.
fn page(sequence: &Sequence<'_>, style: &Style) -> String {
    let opened = sequence.unfolded;
    let opened = opened.and_then(|opened| Some((opened.view, opened.picture?.graph()?)));
    let has_picture = opened.is_none() || sequence.view.is_folded();
    let picture = has_picture.then(|| sequence.picture.graph()).flatten();
    let picture = picture.map(|drawings| (sequence.view, drawings));
    let (whole, folded) = match opened {
        Some(_) => (opened, picture),
        None => (picture, None),
    };
    let overview = sequence.picture.overview();
    // A chosen style is always used; the default one has a dark variant.
    let chosen = whole.as_ref().map_or(style, |(_, drawn)| drawn.style);
    let dark = Style::builtin("dark").ok().filter(|_| chosen == style);
    let timeline = overview.as_ref().map_or("", |o| &o.title);
    let title = sequence.picture.title().unwrap_or(timeline);
    let graph = |(view, drawn): (_, UnionDrawings<'_>)| PageGraph::new(view, drawn.union);
    // The timeline of topics has a row for each, even if a graph would group them.
    let each = sequence.unfolded.map_or(sequence.view, |u| u.view);
    let page = HtmlPage {
        sequence,
        whole: whole.map_or_else(|| PageGraph::new(each, Union::default()), graph),
        folded: folded.map(graph),
        style: chosen,
        dark: dark.as_ref(),
        title,
        overview: overview.as_ref(),
    };
    page.write()
}

impl HtmlPage<'_> {
    /// The page: UTF-8, without any requests; its policy allows its scripts and styles by digest.
    pub(crate) fn write(&self) -> String {
        let still = self.whole.view.busiest_change();
        let changes = PageChanges::new(self);
        let fonts = fonts();
        let look = self.look();
        let script = SCRIPT.map(squeezed).join("\n");
        let (data, data_type) = data::packed(&data::json(self, still, &changes));
        let policy = format!(
            "default-src 'none';script-src {};style-src {} {};font-src data:;img-src data:;base-uri 'none';form-action 'none'",
            digest::policy(&script),
            digest::policy(&fonts),
            digest::policy(&look),
        );
        let schemes = if self.dark.is_some() {
            "light dark"
        } else {
            "normal"
        };
        let view = self.whole.view;
        let is_paired = self.sequence.options.pairs.is_some();
        let kind = match self.overview {
            Some(_) => "topic-timeline",
            None if view.compares && is_paired => "compares paired",
            None if view.compares => "compares",
            None => "",
        };
        let escaped = |text: &str| {
            let mut xml = Xml::default();
            xml.text(text);
            xml.finish()
        };
        let title = escaped(&visible(self.title));
        let sentence = info(self.sequence.mission).summary;
        let begin = words::date(changes.clock.0.0).unwrap_or_default();
        fill(PAGE, |key| match key {
            "policy" => policy.clone(),
            "schemes" => schemes.to_owned(),
            "kind" => kind.to_owned(),
            "title" => title.clone(),
            "sentence" => escaped(&sentence),
            "fonts" => fonts.clone(),
            "css" => look.clone(),
            "signs" => self.signs(),
            "graph" => self.graphs(still),
            "where" => self.place(still),
            "date" => begin.clone(),
            "last" => view.frames.len().saturating_sub(1).to_string(),
            "changes" => changes.table(view.compares),
            "legend" => self.legend(changes.lives.as_ref()),
            "notes" => self.notes(),
            "data_type" => data_type.to_owned(),
            "data" => data.clone(),
            "script" => script.clone(),
            _ => String::new(),
        })
    }

    fn drawn(&self) -> impl Iterator<Item = &PageGraph<'_>> {
        std::iter::once(&self.whole).chain(&self.folded)
    }

    fn look(&self) -> String {
        let mut words: std::collections::BTreeSet<&str> =
            self.drawn().flat_map(|d| d.runs.words()).collect();
        // For comparisons and for the legend.
        words.extend([
            "added", "removed", "changed", "faster", "slower", "silent", "w2", "w5",
        ]);
        // The rules of the graph end at the graph, without taking precedence over those of the page.
        let rules = |style| {
            let (names, rules) = (classes::variables(style), classes::rules(style, &words));
            format!("{names}:where(.graph,#signs,#legend){{{rules}}}")
        };
        // Printed pages are white.
        let dark = self.dark.map_or_else(String::new, |dark| {
            format!(
                "@media screen and (prefers-color-scheme:dark){{{}}}",
                rules(dark)
            )
        });
        rules(self.style) + &dark + &squeezed(LOOK)
    }

    /// The badges, once for all drawings.
    fn signs(&self) -> String {
        let mut xml = Xml::default();
        signs::badges(&mut xml, self.style);
        xml.finish()
    }

    fn legend(&self, lives: Option<&Timeline>) -> String {
        // The timeline of topics has no boxes and lines.
        let views: Vec<&View> = match self.overview {
            Some(_) => Vec::new(),
            None => self.drawn().map(|d| d.view).collect(),
        };
        let change = self.sequence.unfolded.map_or(0.25, |u| u.rate_change);
        signs::legend(&views, change) + &lives.map(signs::timeline).unwrap_or_default()
    }

    /// The notices about hidden elements and problems, one per line.
    fn notes(&self) -> String {
        let mut xml = Xml::default();
        for notice in self.sequence.notices.iter() {
            // The page has fonts for all characters, and all collapsed elements.
            if notice.kind != NoticeKind::Glyph {
                let text = visible(&notice.text).into_owned() + &notice.times();
                xml.open("li").text(&text).close();
            }
        }
        xml.finish()
    }

    fn graphs(&self, still: usize) -> String {
        if let Some(overview) = self.overview {
            return timeline(overview);
        }
        let mut xml = Xml::with_capacity(1 << 16);
        let is_hidden = self.folded.is_some();
        self.graph(&mut xml, &self.whole, ("graph", is_hidden), still);
        if let Some(folded) = &self.folded {
            self.graph(&mut xml, folded, ("folded", false), still);
        }
        xml.finish()
    }

    /// Writes a graph in the state of window `still`, which is shown without scripts.
    fn graph(
        &self,
        xml: &mut Xml,
        drawn: &PageGraph<'_>,
        (id, is_hidden): (&str, bool),
        still: usize,
    ) {
        let graph = Classes {
            view: drawn.view,
            union: &drawn.union,
        };
        let runs = &drawn.runs;
        let window = u32::try_from(still).unwrap_or(0);
        // A margin, and space around a small graph: three boxes that fill the screen are hard to read.
        let size = drawn.union.size;
        let (w, h) = ((size.w + 24.0).max(860.0), (size.h + 24.0).max(480.0));
        let (x, y) = ((size.w - w) / 2.0, (size.h - h) / 2.0);
        xml.open("svg")
            .attribute("id", id)
            .attribute("class", "graph");
        if is_hidden {
            xml.attribute("hidden", "");
        }
        xml.attribute("viewBox", format_args!("{x:.0} {y:.0} {w:.0} {h:.0}"))
            .attribute("role", "img")
            .attribute("aria-label", "Graph; use the search to find any element");
        // Outlines remain if a host blocks styles.
        let stroke = self.style.edge.stroke.to_string();
        let layer = |xml: &mut Xml, class: &str| {
            xml.open("g")
                .attribute("class", class)
                .attribute("fill", "none")
                .attribute("stroke", &stroke);
        };
        layer(xml, "spaces");
        graph.spaces(xml);
        xml.close();
        layer(xml, "arrows");
        for &id in &drawn.order {
            let life = &runs.arrows[id.at()];
            graph.arrow(xml, id, runs.look(life, window));
        }
        xml.close();
        layer(xml, "items");
        for (item, life) in runs.items.iter().enumerate() {
            graph.item(xml, ItemId::of(item), runs.look(life, window));
        }
        xml.close().close();
    }

    fn place(&self, still: usize) -> String {
        let frames = &self.whole.view.frames;
        let (Some(first), Some(at)) = (frames.first(), frames.get(still)) else {
            return String::new();
        };
        if self.whole.view.compares {
            return SIDES[still.min(1)].to_owned();
        }
        let at = words::offset(at.span.start.since(first.span.start));
        format!("window {} of {} · {at}", still + 1, frames.len())
    }
}

/// The timeline of topics, for readers without scripts: the player draws it as its timeline.
fn timeline(overview: &Overview) -> String {
    let still = svg::write(&overview.scene);
    let inside = still.split_once(">\n").map_or("", |(_, rest)| rest);
    let inside = inside.trim_end().strip_suffix("</svg>").unwrap_or(inside);
    // The page has its own ids.
    let inside = inside.replace(" id=\"", " data-part=\"");
    let size = overview.scene.size;
    format!(
        "<svg id=\"graph\" class=\"graph\" viewBox=\"0 0 {:.0} {:.0}\" role=\"img\" aria-label=\"Topics over time\">{inside}</svg>",
        size.w, size.h,
    )
}

fn fonts() -> String {
    let mut css = String::new();
    for (weight, data) in [(400, text::REGULAR), (600, text::SEMIBOLD)] {
        let _ = write!(
            css,
            "@font-face{{font-family:Inter;font-weight:{weight};src:url(data:font/ttf;base64,"
        );
        digest::base64(&mut css, data);
        css.push_str(")}");
    }
    css
}

/// A text without indentation, empty lines and comment lines, which browsers do not need.
fn squeezed(text: &str) -> String {
    let lines = text.lines().map(str::trim);
    let lines = lines.filter(|line| !line.is_empty() && !line.starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

/// The template with every `{{key}}` replaced; keys in a replacement are not replaced.
fn fill(template: &str, value: impl Fn(&str) -> String) -> String {
    let mut out = String::with_capacity(1 << 18);
    let mut parts = template.split("{{");
    out.push_str(parts.next().unwrap_or_default());
    for part in parts {
        let (key, rest) = part.split_once("}}").unwrap_or(("", part));
        out.push_str(&value(key));
        out.push_str(rest);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replacements_are_not_expanded() {
        let page = fill("<{{a}}|{{b}}>", |key| {
            if key == "a" {
                "{{b}}".to_owned()
            } else {
                "x".to_owned()
            }
        });
        assert_eq!(page, "<{{b}}|x>");
    }

    #[test]
    fn what_is_squeezed_keeps_its_words() {
        let text = "// Why.\n\tlet a = 'b // c';\n\n\t\tb();\n";
        assert_eq!(squeezed(text), "let a = 'b // c';\nb();");
    }

    #[test]
    fn the_players_files_stay_small() {
        let kib = |text: &str| text.len() as f64 / 1024.0;
        let script = SCRIPT.map(squeezed).join("\n");
        assert!(
            kib(&script) <= 60.5,
            "the script has {:.2} KiB",
            kib(&script)
        );
        let look = squeezed(LOOK);
        assert!(kib(&look) <= 14.6, "the look has {:.2} KiB", kib(&look));
    }
}
