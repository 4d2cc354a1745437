//! The whole mission as one animated SVG: the graph once, and per changing element the classes it goes through.
//!
//! It runs inside `<img>`. Whoever asks for less motion gets a still of everything that ever was, because the rules for
//! the classes hold only where motion is welcome; a reader that knows no animation shows the busiest window.

use super::classes::{self, ClassDetail, Classes, ElementLook, bars};
use super::xml::Xml;
use crate::base::words::{self, visible};
use crate::draw::picture::{Union, rate_label};
use crate::draw::style::Style;
use crate::view::View;
use crate::view::runs::{ElementRuns, Run, Runs, at};

/// With more changed windows than this, what changed is not written in words.
const MOST_CAPTIONS: usize = 24;
/// So many phrases are written out at most; the rest is counted.
const MOST_PHRASES: usize = 4;
/// The longest caption, in characters.
const LONGEST_CAPTION: usize = 110;
/// Around the graph.
const MARGIN: f64 = 12.0;
/// Above and below the graph.
const TOP: f64 = 58.0;
const BOTTOM: f64 = 62.0;

/// The windows of `view` one after the other, each for so many milliseconds, over the graph of them all.
pub(crate) fn write(
    view: &View,
    union: &Union,
    style: &Style,
    title: &str,
    frame_ms: u32,
) -> String {
    let runs = Runs::of(view, rate_label);
    let play = Play {
        view,
        runs: &runs,
        union,
        style,
        title,
        windows: view.frames.len(),
        still: u32::try_from(view.busiest()).unwrap_or(0),
        seconds: view.frames.len() as f64 * f64::from(frame_ms) / 1e3,
    };
    play.document()
}

struct Play<'a> {
    view: &'a View,
    runs: &'a Runs,
    union: &'a Union,
    style: &'a Style,
    title: &'a str,
    windows: usize,
    /// The window shown where nothing moves.
    still: u32,
    /// How long one round takes.
    seconds: f64,
}

impl Play<'_> {
    fn document(&self) -> String {
        let detail = ClassDetail {
            is_fine: false,
            has_names: false,
        };
        let graph = Classes::new(self.view, self.union, self.style, detail);
        let size = self.union.size;
        let width = (size.w + 2.0 * MARGIN).max(720.0);
        let height = size.h + TOP + BOTTOM + 2.0 * MARGIN;
        let mut xml = Xml::default();
        xml.open("svg")
            .attribute("xmlns", "http://www.w3.org/2000/svg")
            .attribute("width", format_args!("{width:.0}"))
            .attribute("height", format_args!("{height:.0}"))
            .attribute("viewBox", format_args!("0 0 {width:.0} {height:.0}"));
        xml.open("title").text(&visible(self.title)).close();
        xml.raw("\n").open("style").raw(&self.rules()).close();
        xml.raw("\n")
            .open("rect")
            .attribute("width", "100%")
            .attribute("height", "100%")
            .attribute("fill", self.style.background())
            .close_empty();
        self.title(&mut xml, width);
        graph.signs(&mut xml);
        let (left, top) = ((width - size.w) / 2.0, TOP + MARGIN);
        let place = format_args!("translate({left:.0} {top:.0})");
        xml.open("g").attribute("transform", place).raw("\n");
        graph.spaces(&mut xml);
        for &at in &self.union.order {
            graph.arrow(&mut xml, at, &self.element(&self.runs.arrows[at], "edge"));
        }
        for (at, life) in self.runs.items.iter().enumerate() {
            let what = self.view.items[at].kind.word();
            graph.item(&mut xml, at, &self.element(life, what));
        }
        xml.close().raw("\n");
        self.timeline(&mut xml, width, height);
        xml.close().raw("\n");
        xml.finish()
    }

    fn rules(&self) -> String {
        let style = self.style;
        let page = &style.page;
        format!(
            "{}.t{{text-anchor:start;font:600 17px {f};fill:{}}}.u{{text-anchor:start;font:12.5px {f};fill:{}}}\
             .x{{font:12px {f};fill:{}}}.k,.head{{visibility:hidden}}.k{{text-anchor:end;font:13px {f};fill:{}}}\
             path.added{{fill:{}}}path.removed{{fill:{}}}path.changed{{fill:{}}}\
             @media(prefers-reduced-motion:no-preference){{{}.on,.head{{visibility:visible}}}}",
            classes::base(style),
            page.text,
            page.quiet,
            page.quiet,
            page.text,
            style.added.color,
            style.removed.color,
            style.changed.color,
            classes::states(style, &self.runs.words()),
            f = "Inter,Helvetica,Arial,sans-serif",
        )
    }

    fn element<'b>(&'b self, life: &'b ElementRuns, what: &'static str) -> AnimatedElement<'b> {
        AnimatedElement {
            play: self,
            life,
            what,
        }
    }

    /// An animation of the class over these values; nothing where there is only one.
    fn classes(&self, xml: &mut Xml, steps: &[(u32, String)]) {
        if steps.len() < 2 {
            return;
        }
        let values: Vec<&str> = steps.iter().map(|s| s.1.as_str()).collect();
        let times: Vec<String> = steps.iter().map(|s| self.part(s.0)).collect();
        xml.open("animate")
            .attribute("attributeName", "class")
            .attribute("calcMode", "discrete")
            .attribute("dur", format_args!("{}s", self.seconds))
            .attribute("repeatCount", "indefinite")
            .attribute("keyTimes", times.join(";"))
            .attribute("values", values.join(";"))
            .close_empty();
    }

    /// The part of the round at which a window begins, in as many digits as tell windows apart.
    fn part(&self, window: u32) -> String {
        let digits = if self.windows < 1000 { 4 } else { 6 };
        let text = format!(
            "{:.digits$}",
            f64::from(window) / self.windows.max(1) as f64
        );
        let text = text.trim_start_matches('0').trim_end_matches('0');
        if text == "." {
            "0".to_owned()
        } else {
            text.to_owned()
        }
    }

    fn title(&self, xml: &mut Xml, width: f64) {
        let line = |xml: &mut Xml, class: &str, y: u32, text: &str| {
            xml.open("text").attribute("class", class);
            xml.attribute("x", 16).attribute("y", y).text(text).close();
        };
        line(xml, "t", 26, &visible(self.title));
        if let (Some(first), Some(last)) = (self.view.frames.first(), self.view.frames.last()) {
            let whole = last.span.end.since(first.span.start) / 1_000_000_000 * 1_000_000_000;
            let period = words::duration(first.span.nanos());
            let told = format!(
                "{} of {period} · {}",
                words::count(self.windows, "window"),
                words::offset(whole)
            );
            line(xml, "u", 45, &told);
        }
        xml.raw("\n");
        let frames = self.view.frames.iter().zip(0_u32..);
        let told = frames.filter(|(f, _)| !f.headlines.is_empty());
        if told.clone().count() > MOST_CAPTIONS {
            return;
        }
        for (frame, window) in told {
            let on = (window, "k on".to_owned());
            let mut steps = vec![(0, "k".to_owned()), on, (window + 1, "k".to_owned())];
            steps.retain(|s| (s.0 as usize) < self.windows);
            if window == 0 {
                steps.remove(0);
            }
            let all = frame.words(MOST_PHRASES);
            let words: String = visible(&all).chars().take(LONGEST_CAPTION).collect();
            xml.open("text")
                .attribute("class", "k")
                .attribute("x", format_args!("{:.0}", width - 16.0))
                .attribute("y", 45);
            self.classes(xml, &steps);
            xml.text(&words).close().raw("\n");
        }
    }

    /// What changed when, and where in the mission the picture is.
    fn timeline(&self, xml: &mut Xml, width: f64, height: f64) {
        let style = &self.style.timeline;
        let (left, wide, y) = (16.0, width - 32.0, height - 26.0);
        let scale = wide / self.windows.max(1) as f64;
        let top = y - 30.0;
        let place = format_args!("translate({left} {top:.0}) scale({scale:.4} .5)");
        xml.open("g").attribute("transform", place);
        bars(xml, self.runs);
        xml.close();
        xml.open("path")
            .attribute("d", format_args!("M{left} {y:.0}h{wide:.0}"))
            .attribute("stroke", style.axis)
            .close_empty();
        self.ticks(xml, (left, wide), y + 17.0);
        xml.open("rect")
            .attribute("class", "head")
            .attribute("x", left)
            .attribute("y", format_args!("{:.0}", y - 32.0))
            .attribute("width", 2.5)
            .attribute("height", 34)
            .attribute("fill", style.head);
        xml.open("animate")
            .attribute("attributeName", "x")
            .attribute("from", left)
            .attribute("to", format_args!("{:.1}", left + wide))
            .attribute("dur", format_args!("{}s", self.seconds))
            .attribute("repeatCount", "indefinite")
            .close_empty();
        xml.close().raw("\n");
    }

    /// The time at every quarter of an axis that begins at `left`.
    fn ticks(&self, xml: &mut Xml, (left, wide): (f64, f64), y: f64) {
        let (Some(first), Some(last)) = (self.view.frames.first(), self.view.frames.last()) else {
            return;
        };
        let whole = last.span.end.since(first.span.start);
        let anchors = ["start", "middle", "middle", "middle", "end"];
        for (quarter, anchor) in (0_i32..).zip(anchors) {
            let nanos = whole / 4_000_000_000 * i64::from(quarter) * 1_000_000_000;
            let x = left + wide * f64::from(quarter) / 4.0;
            xml.open("text")
                .attribute("class", "x")
                .attribute("style", format_args!("text-anchor:{anchor}"))
                .attribute("x", format_args!("{x:.0}"))
                .attribute("y", format_args!("{y:.0}"))
                .text(&words::offset(nanos))
                .close();
        }
    }
}

/// An element with its history.
struct AnimatedElement<'a> {
    play: &'a Play<'a>,
    life: &'a ElementRuns,
    what: &'static str,
}

impl AnimatedElement<'_> {
    /// The class attribute for a place in the table of classes: only words that a rule is about.
    fn words(&self, class: u32) -> String {
        let all = self.play.runs.classes[class as usize].split(' ');
        let mut words = vec![self.what];
        words.extend(all.filter(|w| !matches!(*w, "active" | "stated" | "measured" | "latched")));
        words.join(" ")
    }
}

impl ElementLook for AnimatedElement<'_> {
    fn class(&self) -> String {
        let words = self.words(at(&self.life.classes, self.play.still));
        words
            .split_once(' ')
            .map_or(String::new(), |(_, rest)| rest.to_owned())
    }

    fn text(&self) -> String {
        let still = at(&self.life.rates, self.play.still);
        let label = |place: u32| &self.play.runs.labels[place as usize];
        let silent = words::rate(0.0);
        let is_known = |label: &String| !label.is_empty() && *label != silent;
        let known = |run: &&Run| is_known(label(run.value));
        let first = self.life.rates.iter().find(known).map_or(0, |s| s.value);
        let shown = if is_known(label(still)) { still } else { first };
        label(shown).clone()
    }

    fn more(&self, xml: &mut Xml) {
        let mut steps = vec![(0, self.words(at(&self.life.classes, 0)))];
        for run in &self.life.classes {
            let words = self.words(run.value);
            if steps.last().is_some_and(|last| last.1 != words) {
                steps.push((run.from, words));
            }
        }
        self.play.classes(xml, &steps);
    }
}
