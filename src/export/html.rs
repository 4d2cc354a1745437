//! The mission as one self-contained page: the graph drawn once, its history as runs, and a player.
//!
//! `player/` contains the handwritten parts of the page: its template, its style sheet, and its script in parts, which are
//! joined in order. [`data`] defines the data for the script.

mod data;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use serde::Serialize;

use super::sequence::Sequence;
use super::target::Target;
use super::{Started, one_text};
use crate::base::digest;
use crate::base::notice::NoticeKind;
use crate::base::time::Stamp;
use crate::base::words::{self, visible};
use crate::draw::paint::classes::{self, Classes, badge_shapes};
use crate::draw::paint::svg;
use crate::draw::paint::xml::Xml;
use crate::draw::picture::title::SIDES;
use crate::draw::picture::{LegendSign, Union, change_counts, rate_label, signs};
use crate::draw::style::{BUILTIN, Style};
use crate::draw::text;
use crate::draw::timeline::Timeline;
use crate::draw::timeline::marks::Sign;
use crate::draw::topic_timeline::Overview;
use crate::graph::{Element, Id as _, State};
use crate::mission::EventId;
use crate::mission::event_log::{Event, Kind, LogFormat, LogLine, LogRow, interrupted, row_lines};
use crate::mission::info::info;
use crate::view::{ArrowId, Frame, Headline, ItemId, Mark, OngoingEvent, View};
use data::ViewRuns;

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
    let chosen = whole.as_ref().map_or(style, |(_, (_, style))| style);
    let dark = Style::builtin("dark").ok().filter(|_| chosen == style);
    let timeline = overview.as_ref().map_or("", |o| &o.title);
    let title = sequence.picture.title().unwrap_or(timeline);
    let graph = |(view, (union, _)): (_, (Union, _))| PageGraph::new(view, union);
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
        let schemes = self.dark.map_or("normal", |_| "light dark");
        let view = self.whole.view;
        let is_paired = self.sequence.options.pairs.is_some();
        let kind = match self.overview {
            Some(_) => "topic-timeline",
            None if view.compares && is_paired => "compares paired",
            None if view.compares => "compares",
            None => "",
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
        let mut words: BTreeSet<&str> = self.drawn().flat_map(|d| d.runs.words()).collect();
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
            let rules = rules(dark);
            format!("@media screen and (prefers-color-scheme:dark){{{rules}}}")
        });
        rules(self.style) + &dark + &squeezed(LOOK)
    }

    /// The definitions of all badges, once for all drawings.
    fn signs(&self) -> String {
        let mut xml = Xml::default();
        xml.open("defs");
        // A comparison of two windows may need one that no window shows.
        for mark in Mark::badged() {
            badge_shapes(&mut xml, self.style, mark);
        }
        xml.close();
        xml.finish()
    }

    /// The meaning of the signs that occur, as HTML.
    fn legend(&self, lives: Option<&Timeline>) -> String {
        let mut out = String::new();
        let mut shown: Vec<String> = Vec::new();
        let change = self.sequence.unfolded.map_or(0.25, |u| u.rate_change);
        // The timeline of topics has no boxes and lines.
        let drawn = self.drawn().filter(|_| self.overview.is_none());
        for (sign, words) in drawn.flat_map(|drawn| signs(drawn.view, change)) {
            if !shown.contains(&words) {
                let (sign, text) = (picture(&sign), escaped(&words));
                let svg = format!("<svg viewBox=\"0 0 40 20\">{sign}</svg>");
                let _ = write!(out, "<span>{svg} {text}</span>");
                shown.push(words);
            }
        }
        out + &lives.map(timeline_legend).unwrap_or_default()
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

fn escaped(text: &str) -> String {
    let mut xml = Xml::default();
    xml.text(text);
    xml.finish()
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

// The legend of the signs that occur.

const BOX: &str = "<rect x=\"5\" y=\"4\" width=\"26\" height=\"12\" rx=\"2\"/>";
const CAPSULE: &str = "<rect x=\"3\" y=\"3\" width=\"30\" height=\"14\" rx=\"7\"/>";
const LINE: &str = "<path d=\"M3 10h24\"/><path d=\"M34 10l-8-4v8z\"/>";
const STOPPED: &str = "<path d=\"M3 10h24\"/><path d=\"M27 4h3v12h-3z\"/>";

/// The meaning of the marks that occur on the timeline, as HTML.
fn timeline_legend(timeline: &Timeline) -> String {
    let marks = timeline.marks();
    let has = |signs: &[Sign]| marks.iter().any(|(_, mark)| signs.contains(&mark.sign));
    let mut out = String::new();
    let mut add = |signs: &[Sign], class: &str, path: &str, words: &str| {
        if has(signs) {
            let path = format!("<path class=\"{class}\" d=\"{path}\"/>");
            let svg = format!("<svg viewBox=\"0 0 40 20\" class=\"marks\">{path}</svg>");
            let _ = write!(out, "<span>{svg} {words}</span>");
        }
    };
    let dots = [Sign::Dot, Sign::Letter];
    add(&[Sign::Start], "start", "M18 3v14", "begins");
    add(&[Sign::End], "end", "M13 5l10 10m0 -10l-10 10", "ends");
    add(&dots, "event", "M13 10l5 -5l5 5l-5 5z", "changes");
    let arrow = "M18 3V17m-3 -4l3 4l3 -4";
    add(&[Sign::Handover], "takeover", arrow, "handed over");
    out
}

fn picture(sign: &LegendSign) -> String {
    let front = BOX
        .replace("y=\"4\"", "y=\"7\"")
        .replace("\"26\"", "\"23\"");
    match sign {
        LegendSign::Node => group("node", CAPSULE),
        LegendSign::Topic => group("topic", BOX),
        LegendSign::Group => group("topic", &format!("{BOX}{front}")),
        LegendSign::Namespace => group("node", &format!("{BOX}{front}")),
        LegendSign::Change(mark) => {
            let (word, class) = (mark.badge(), mark.class());
            let badge = format!("<use href=\"#{word}\" class=\"{word}\" x=\"31\" y=\"5\"/>");
            group(&format!("topic {class} {word}"), &(BOX.to_owned() + &badge))
        }
        LegendSign::Box(State::Latched) => {
            let bar = "<rect class=\"l\" x=\"6\" y=\"5\" width=\"3\" height=\"10\"/>";
            group("topic latched", &(BOX.to_owned() + bar))
        }
        LegendSign::Box(state) => group(&format!("topic {}", state.word()), BOX),
        LegendSign::Line(confidence) => group(&format!("edge active {}", confidence.word()), LINE),
        // Pages draw every topic as a box.
        LegendSign::Row => String::new(),
        LegendSign::Service => group("topic", "<path d=\"M3 10l6 -6h18l6 6l-6 6h-18z\"/>"),
        LegendSign::Starved => group("edge active stated", STOPPED),
        LegendSign::Width => group("edge active w5", LINE),
    }
}

fn group(class: &str, inside: &str) -> String {
    format!("<g class=\"{class}\">{inside}</g>")
}

// The changes that a page lists, read from the event log: per window for the script, and as a table for readers without
// scripts, for printing, and for links into the mission.

/// The headlines of a window, the interruptions that begin in it, and the elements that are back in it: its index, the number of
/// headlines, the texts of the three badges, its lines, and the film's headline.
#[derive(Serialize)]
struct ChangedWindow(usize, usize, [String; 3], Vec<ChangeLine>, String);

/// A change: its time in seconds, its sign (0 appeared, 1 vanished, 2 changed), its element (-1 for one that is not drawn),
/// its sentence, its index in the log unless it is an interruption, and its time in words.
#[derive(Serialize)]
struct ChangeLine(f64, u8, i64, String, Option<EventId>, String);

/// The most headlines of one window that are listed; the rest is counted.
const MOST_REPORTED: usize = 200;
/// The most rows of the table; the rest is counted.
const MOST_ROWS: usize = 200;
/// The most phrases of a window's headline; the rest is counted.
const MOST_PHRASES: usize = 5;

/// The origin of times in seconds.
#[derive(Clone, Copy)]
struct PageClock(Stamp);

impl PageClock {
    /// The seconds from the origin to `at`, rounded down to milliseconds, as everywhere.
    fn secs(self, at: Stamp) -> f64 {
        at.since(self.0).div_euclid(1_000_000) as f64 / 1e3
    }
}

/// The element that represents each node, topic and edge.
fn places(drawn: &PageGraph<'_>) -> BTreeMap<Element, u32> {
    let mut places = BTreeMap::new();
    let items = drawn.view.items.iter().map(|item| &item.members);
    let arrows = drawn.order.iter().map(|id| &drawn.view.arrows[*id].members);
    for (members, place) in items.chain(arrows).zip(0..) {
        for member in members {
            places.entry(*member).or_insert(place);
        }
    }
    places
}

/// The changes that a page lists.
struct PageChanges {
    /// The windows with changes.
    windows: Vec<ChangedWindow>,
    /// The element that represents each node, topic and edge.
    places: BTreeMap<Element, u32>,
    clock: PageClock,
    /// The lifelines of the mission, if there are any.
    lives: Option<Timeline>,
}

impl PageChanges {
    fn new(page: &HtmlPage<'_>) -> Self {
        let (mission, whole) = (page.sequence.mission, &page.whole);
        let view = whole.view;
        let places = places(whole);
        let clock = PageClock(view.frames.first().map_or(Stamp(0), |f| f.span.start));
        let events = mission.log.events.with_ids();
        let events: Vec<_> = events.filter(|(_, event)| event.is_headline()).collect();
        let rows = events.iter().map(|(id, event)| LogRow::Event(*id, event));
        let rows: Vec<LogRow<'_>> = rows.collect();
        let written = row_lines(mission, &rows, LogFormat::Text);
        let said = events.iter().zip(&written);
        let said = said.map(|((id, event), line)| (*id, (*event, line)));
        let said: BTreeMap<EventId, (&Event, &LogLine)> = said.collect();
        let place = |what: &Element| places.get(what).map_or(-1, |at| i64::from(*at));
        // Two missions have no common time.
        let secs =
            |frame: &Frame, at| clock.secs(if view.compares { frame.span.start } else { at });
        let back = |frame: &Frame, last: &OngoingEvent| {
            let (end, away) = (last.ended?, last.ended?.since(last.since));
            let (node, topic) = mission.elements.names(last.what);
            let name = visible(node.or(topic).unwrap_or_default());
            let text = format!("{name} is back after {}", words::duration(away));
            let when = words::offset_tenths(mission.offset(end));
            let at = secs(frame, end);
            let (place, event) = (place(&last.what), Some(last.event));
            Some(ChangeLine(at, 2, place, text, event, when))
        };
        let line = |frame: &Frame, headline: &Headline| {
            let (event, line) = said.get(&headline.event)?;
            let sign = match event.kind {
                Kind::Started | Kind::Appeared => 0,
                Kind::Stopped | Kind::Vanished => 1,
                _ => 2,
            };
            // The list is sorted by the best estimate of each time, so that it has no ranges.
            let when = match line.lead.trim() {
                range if range.contains('–') => {
                    format!("~{}", words::offset_seconds(mission.offset(event.time)))
                }
                exact => exact.to_owned(),
            };
            let (at, place) = (secs(frame, event.time), place(&headline.what));
            let (text, id) = (line.words.clone(), Some(headline.event));
            Some(ChangeLine(at, sign, place, text, id, when))
        };
        let interruptions = |frame: &Frame| {
            let all = mission.log.interruptions.iter();
            let inside = all.filter(|one| frame.span.contains(one.time));
            let line = inside.map(|one| {
                let when = words::offset_tenths(mission.offset(one.time));
                let at = clock.secs(one.time);
                ChangeLine(at, 2, -1, interrupted(one), None, when)
            });
            line.collect::<Vec<_>>()
        };
        let frames = view.frames.iter().enumerate();
        let frames = frames.filter(|(_, frame)| frame.is_changed());
        let windows = frames.map(|(at, frame)| {
            let mut counts = change_counts(&frame.counts).map(|(text, _)| text);
            let returns = frame.ongoing.iter().filter_map(|last| back(frame, last));
            let returns: Vec<ChangeLine> = returns.collect();
            if frame.headlines.is_empty() && !returns.is_empty() {
                counts[2] = format!("{} back", returns.len());
            }
            let headlines = frame.headlines.iter().take(MOST_REPORTED);
            let headlines = headlines.filter_map(|headline| line(frame, headline));
            let lines = interruptions(frame).into_iter().chain(headlines);
            let lines = lines.chain(returns).collect();
            let words = visible(&frame.words(MOST_PHRASES)).into_owned();
            ChangedWindow(at, frame.counts.total(), counts, lines, words)
        });
        let windows: Vec<ChangedWindow> = windows.collect();
        // The list has every mark: a part of an event is marked only if the event is listed.
        let listed = windows.iter().flat_map(|w| &w.3);
        let listed: BTreeSet<EventId> = listed.filter_map(|line| line.4).collect();
        let whole = |id| mission.log.events.get(id).and_then(|event| event.part_of);
        let is_listed = |id: &EventId| view.compares || listed.contains(&whole(*id).unwrap_or(*id));
        let mut lives = page.sequence.unfolded.and_then(|u| u.lives).cloned();
        for row in lives.iter_mut().flat_map(|lives| &mut lives.rows) {
            row.marks.retain(|mark| mark.events.iter().any(is_listed));
        }
        Self {
            windows,
            places,
            clock,
            lives,
        }
    }

    /// A row per change: its time as a link, and its sentence; empty without changes.
    fn table(&self, compares: bool) -> String {
        let lines = self.windows.iter();
        let lines = lines.flat_map(|w| w.3.iter().map(|line| (w.0, line)));
        let mut lines: Vec<(usize, &ChangeLine)> = lines.collect();
        // Windows may overlap.
        lines.sort_by(|(_, a), (_, b)| a.0.total_cmp(&b.0).then(a.4.cmp(&b.4)));
        lines.dedup_by(|(_, a), (_, b)| (a.0, a.4) == (b.0, b.4));
        let mut xml = Xml::default();
        if lines.is_empty() {
            return String::new();
        }
        xml.open("details").attribute("open", "");
        let summary = if compares {
            "Differences"
        } else {
            "All changes"
        };
        xml.leaf("summary", summary);
        if lines.len() > MOST_ROWS {
            let text = format!("The first {MOST_ROWS} of {}:", lines.len());
            xml.leaf("p", &text);
        }
        xml.open("table")
            .open("tbody")
            .attribute("id", "allchanges");
        for (window, ChangeLine(at, _, _, text, event, when)) in lines.into_iter().take(MOST_ROWS) {
            let when = if compares { SIDES[window.min(1)] } else { when };
            xml.open("tr");
            if let Some(event) = event {
                xml.attribute("data-entry", event);
            }
            xml.open("th");
            xml.open("a").attribute("href", format_args!("#t={at}"));
            xml.text(when).close().close();
            xml.leaf("td", text).close().raw("\n");
        }
        xml.close().close().close();
        xml.finish()
    }
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
