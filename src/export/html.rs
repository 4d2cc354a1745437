//! The mission as one self-contained page: the graph drawn once, its history as runs, and the player that shows them.

mod data;
pub(crate) mod encoder;
mod table;

use std::fmt::Write as _;

use crate::base::digest;
use crate::base::geometry::Rect;
use crate::base::words;
use crate::base::words::visible;
use crate::draw::board::Overview;
use crate::draw::paint::classes::{self, ClassDetail, Classes, ElementLook};
use crate::draw::paint::svg;
use crate::draw::paint::xml::Xml;
use crate::draw::picture::{Union, rate_label};
use crate::draw::style::Style;
use crate::draw::text;
use crate::mission::Mission;
use crate::view::runs::{ElementRuns, Runs, at};
use crate::view::{Frame, View};

const PAGE: &str = include_str!("../../styles/player.html");
const SCRIPT: &str = include_str!("../../styles/player.js");
const LOOK: &str = include_str!("../../styles/player.css");

/// What a page is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HtmlPage<'a> {
    /// The whole sequence.
    pub mission: &'a Mission,
    /// What is shown of it.
    pub view: &'a View,
    /// The graph, drawn once.
    pub union: &'a Union,
    /// How it looks.
    pub style: &'a Style,
    /// How it looks where the reader prefers dark pages; `None` for always the same.
    pub dark: Option<&'a Style>,
    /// The title, such as the bag's name.
    pub title: &'a str,
    /// What is drawn in place of a graph, if there is none.
    pub overview: Option<&'a Overview>,
}

impl HtmlPage<'_> {
    /// The page: UTF-8, without a single request, its scripts and styles named by digest in its policy.
    pub(crate) fn write(&self) -> String {
        let runs = Runs::of(self.view, rate_label);
        let still = self.view.busiest();
        let fonts = fonts();
        let look = self.look(&runs);
        let script = squeezed(SCRIPT);
        let (data, data_type) = data::packed(&data::json(self, &runs));
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
        let mut title = Xml::default();
        title.text(&visible(self.title));
        let title = title.finish();
        let mut bars = Xml::default();
        classes::bars(&mut bars, &runs);
        let bars = bars.finish();
        fill(PAGE, |key| match key {
            "policy" => policy.clone(),
            "schemes" => schemes.to_owned(),
            "title" => title.clone(),
            "fonts" => fonts.clone(),
            "css" => look.clone(),
            "graph" => self
                .overview
                .map_or_else(|| self.graph(&runs, still), board),
            "where" => self.place(still),
            "ticks" => self.ticks(),
            "summary" => table::summary(self.view),
            "count" => self.view.frames.len().to_string(),
            "last" => self.view.frames.len().saturating_sub(1).to_string(),
            "bars" => bars.clone(),
            "rows" => table::rows(self.view),
            "data_type" => data_type.to_owned(),
            "data" => data.clone(),
            "script" => script.clone(),
            _ => String::new(),
        })
    }

    fn look(&self, runs: &Runs) -> String {
        let mut words = runs.words();
        // For the legend.
        words.extend(["added", "removed", "changed", "silent"]);
        let mut out = classes::variables(self.style) + &classes::rules(self.style, &words);
        if let Some(dark) = self.dark {
            // Paper is white.
            let dark = classes::variables(dark) + &classes::rules(dark, &words);
            let _ = write!(
                out,
                "@media screen and (prefers-color-scheme:dark){{{dark}}}"
            );
        }
        out + &squeezed(LOOK)
    }

    /// The graph as it is in the window at place `still`, which is what a reader without scripts sees.
    fn graph(&self, runs: &Runs, still: usize) -> String {
        let detail = ClassDetail {
            is_fine: true,
            has_names: true,
        };
        let graph = Classes::new(self.view, self.union, self.style, detail);
        let window = u32::try_from(still).unwrap_or(0);
        // A margin, and room around a small graph: three boxes as large as the screen are no pleasure.
        let size = self.union.size;
        let (w, h) = ((size.w + 24.0).max(860.0), (size.h + 24.0).max(480.0));
        let (x, y) = ((size.w - w) / 2.0, (size.h - h) / 2.0);
        let mut xml = Xml::with_capacity(1 << 16);
        xml.open("svg")
            .attribute("id", "graph")
            .attribute("viewBox", format_args!("{x:.0} {y:.0} {w:.0} {h:.0}"))
            .attribute("role", "img")
            .attribute("aria-label", "Graph; every element is in the search");
        graph.signs(&mut xml);
        graph.spaces(&mut xml);
        xml.open("g").attribute("id", "arrows");
        for &arrow in &self.union.order {
            let life = &runs.arrows[arrow];
            graph.arrow(&mut xml, arrow, &Still { runs, life, window });
        }
        xml.close().open("g").attribute("id", "items");
        for (item, life) in runs.items.iter().enumerate() {
            graph.item(&mut xml, item, &Still { runs, life, window });
        }
        xml.finish()
    }

    fn place(&self, still: usize) -> String {
        let count = self.view.frames.len();
        let at = self.view.frames.get(still).map_or(0, |f| self.offset(f));
        format!("window {} of {count} · {}", still + 1, words::offset(at))
    }

    /// Nanoseconds from the start of the first window to that of `frame`.
    fn offset(&self, frame: &Frame) -> i64 {
        let first = self.view.frames.first().unwrap_or(frame);
        frame.span.start.since(first.span.start)
    }

    fn ticks(&self) -> String {
        let (Some(first), Some(last)) = (self.view.frames.first(), self.view.frames.last()) else {
            return String::new();
        };
        let whole = last.span.end.since(first.span.start);
        let tick = |quarter: i64| {
            let second = whole / 4_000_000_000 * quarter;
            format!("<span>{}</span>", words::offset(second * 1_000_000_000))
        };
        (0..=4).map(tick).collect()
    }
}

/// The board of topics, with a head that the player moves.
fn board(overview: &Overview) -> String {
    let still = svg::write(&overview.scene);
    let inside = still.split_once(">\n").map_or("", |(_, rest)| rest);
    let inside = inside.trim_end().strip_suffix("</svg>").unwrap_or(inside);
    let list = |of: &dyn Fn(&Rect) -> f64| {
        let all: Vec<String> = overview
            .heads
            .iter()
            .map(|h| format!("{:.1}", of(h)))
            .collect();
        all.join(" ")
    };
    let (size, head) = (
        overview.scene.size,
        overview.heads.first().copied().unwrap_or_default(),
    );
    format!(
        "<svg id=\"graph\" viewBox=\"0 0 {:.0} {:.0}\" role=\"img\" aria-label=\"Topics over time\">{inside}<g id=\"arrows\"></g><g id=\"items\"></g>\
         <rect id=\"head\" data-x=\"{}\" data-width=\"{}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"2\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/></svg>",
        size.w,
        size.h,
        list(&|h| h.x),
        list(&|h| h.w),
        head.x,
        head.y,
        head.w,
        head.h,
        overview.color,
    )
}

/// An element as it is in one window.
struct Still<'a> {
    runs: &'a Runs,
    life: &'a ElementRuns,
    window: u32,
}

impl ElementLook for Still<'_> {
    fn class(&self) -> String {
        self.runs.classes[at(&self.life.classes, self.window) as usize].clone()
    }

    fn text(&self) -> String {
        let lists = [&self.life.lifecycles, &self.life.rates];
        let list = lists[usize::from(lists[0].is_empty())];
        self.runs.labels[at(list, self.window) as usize].clone()
    }
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

/// Without indentation, which readers of the files need and browsers do not.
fn squeezed(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join("\n")
}

/// The template with every `{{key}}` replaced; what is put in is never looked at again.
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
    fn what_is_filled_in_is_not_a_template() {
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
    fn the_players_files_stay_small() {
        let kib = |text: &str| text.len() as f64 / 1024.0;
        assert!(kib(SCRIPT) <= 9.0, "player.js has {:.2} KiB", kib(SCRIPT));
        assert!(kib(LOOK) <= 4.0, "player.css has {:.2} KiB", kib(LOOK));
    }
}
