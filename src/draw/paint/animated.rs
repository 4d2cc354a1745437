//! The whole mission as one animated SVG: the graph once, and per changing element the classes it goes through.
//!
//! It runs inside `<img>`. A user who asks for less motion gets a still of everything that ever was, because the rules
//! for the classes hold only without that wish; a reader without animations shows the busiest window.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::classes::{self, ClassDetail, Classes, ElementLook, bars};
use super::xml::Xml;
use crate::base::time::Stamp;
use crate::base::words::{self, visible};
use crate::draw::picture::{Union, rate_label};
use crate::draw::style::Style;
use crate::mission::ledger::Phase;
use crate::view::runs::{ElementRuns, Runs, at};
use crate::view::{Frame, View};

/// The largest number of changed windows for which the changes are written in words.
const MOST_CAPTIONS: usize = 24;
/// The largest number of phrases that are written out; the rest is counted.
const MOST_PHRASES: usize = 4;
/// The largest width of a letter of a caption, in pixels.
const LETTER: f64 = 7.0;
/// The largest number of values of a rate that is written: a text for each of more would be larger than the graph.
const MOST_VALUES: usize = 40;
/// The margin around the graph in pixels.
const MARGIN: f64 = 12.0;
/// The room above and below the graph in pixels.
const TOP: f64 = 76.0;
const BOTTOM: f64 = 62.0;

/// The windows of `view` one after the other, each for so many milliseconds, over the graph of them all.
pub(crate) fn write(
    view: &View,
    phases: &[Phase],
    (union, style): (&Union, &Style),
    title: &str,
    frame_ms: u32,
) -> String {
    let runs = Runs::of(view, rate_label);
    let play = Play {
        view,
        phases: if phases.len() > 1 { phases } else { &[] },
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
    /// The phases; none where there is only one.
    phases: &'a [Phase],
    runs: &'a Runs,
    union: &'a Union,
    style: &'a Style,
    title: &'a str,
    windows: usize,
    /// The window that is shown where nothing moves.
    still: u32,
    /// The length of one round in seconds.
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
        // How it looks where styles are refused: outlines, not blobs.
        xml.open("g")
            .attribute("transform", place)
            .attribute("fill", "none")
            .attribute("stroke", self.style.edge.stroke)
            .attribute("font-size", 11)
            .attribute("text-anchor", "middle")
            .raw("\n");
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
             .x{{font:12px {f};fill:{}}}.k,.v,.head{{visibility:hidden}}.k{{font:13px {f};fill:{}}}\
             .phase{{fill:none;stroke:{}}}\
             path.added{{fill:{}}}path.removed{{fill:{}}}path.changed{{fill:{}}}\
             @media(prefers-reduced-motion:no-preference){{{}.on,.head{{visibility:visible}}.v.on{{visibility:inherit}}}}",
            classes::base(style),
            page.text,
            page.quiet,
            page.quiet,
            page.text,
            style.timeline.axis,
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

    /// Writes an animation of the class over these values; nothing where there is only one.
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
        self.captions(xml, width);
        for (phase, next) in self.phases.iter().zip(1..) {
            let begins = |at: Stamp| self.view.frames.partition_point(|f| f.span.end <= at);
            let from = begins(phase.span.start);
            let to = self
                .phases
                .get(next)
                .map_or(self.windows, |p| begins(p.span.start));
            let name = words::shorten(&phase.name, 60);
            let text = format!("{next} {}", visible(&name));
            self.while_shown(xml, (from, to), ("end", width - 16.0, 45.0), &text);
        }
    }

    /// Writes the changes of each window, as many as fit on its line.
    fn captions(&self, xml: &mut Xml, width: f64) {
        let told = |f: &&Frame| !f.headlines.is_empty();
        if self.view.frames.iter().filter(told).count() > MOST_CAPTIONS {
            return;
        }
        let start = self.view.frames.first().map_or(Stamp(0), |f| f.span.start);
        for (window, frame) in self.view.frames.iter().enumerate() {
            let at = words::offset(frame.span.start.since(start));
            let fits = |text: &String| text.chars().count() as f64 * LETTER < width - 32.0;
            let all = (0..=MOST_PHRASES).rev();
            let mut all = all.map(|most| format!("{at}  {}", visible(&frame.words(most))));
            if let Some(text) = all.find(fits).filter(|_| told(&&*frame)) {
                self.while_shown(xml, (window, window + 1), ("start", 16.0, 66.0), &text);
            }
        }
    }

    /// Writes a text that is seen from one window up to another, without that one.
    fn while_shown(
        &self,
        xml: &mut Xml,
        (from, to): (usize, usize),
        (anchor, x, y): (&str, f64, f64),
        text: &str,
    ) {
        if from >= to.min(self.windows) {
            return;
        }
        xml.open("text")
            .attribute("class", "k")
            .attribute("visibility", "hidden")
            .attribute("text-anchor", anchor)
            .attribute("style", format_args!("text-anchor:{anchor}"))
            .attribute("x", format_args!("{x:.0}"))
            .attribute("y", format_args!("{y:.0}"));
        self.classes(xml, &self.shown(&[(from, to)], "k"));
        xml.text(text).close().raw("\n");
    }

    /// The classes, in order, of an element that is seen from some windows up to others, without those.
    fn shown(&self, times: &[(usize, usize)], class: &str) -> Vec<(u32, String)> {
        let window = |at: usize| u32::try_from(at).unwrap_or(u32::MAX);
        let mut steps = vec![(0, class.to_owned())];
        for (from, to) in times {
            if steps.last().is_some_and(|(at, _)| *at == window(*from)) {
                steps.pop();
            }
            steps.push((window(*from), format!("{class} on")));
            steps.push((window(*to), class.to_owned()));
        }
        steps.retain(|s| (s.0 as usize) < self.windows);
        steps
    }

    /// Writes the timeline: the changes at their times, and the place of the picture in the mission.
    fn timeline(&self, xml: &mut Xml, width: f64, height: f64) {
        let style = &self.style.timeline;
        let (left, wide, y) = (16.0, width - 32.0, height - 26.0);
        let top = y - 30.0;
        let place = format_args!("translate({left} {top:.0}) scale(1 .5)");
        xml.open("g").attribute("transform", place);
        bars(xml, self.view, wide);
        xml.close();
        self.band(xml, (left, wide), y);
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
        let at = |window: usize| left + wide * self.view.place_in_time(window);
        let even = |k: usize| left + wide * k as f64 / self.windows.max(1) as f64;
        xml.open("animate").attribute("attributeName", "x");
        if (0..self.windows).all(|k| (at(k) - even(k)).abs() < 1.0) {
            xml.attribute("from", left)
                .attribute("to", format_args!("{:.1}", left + wide));
        } else {
            let places: Vec<String> = (0..=self.windows)
                .map(|k| format!("{:.0}", at(k)))
                .collect();
            xml.attribute("values", places.join(";"));
        }
        xml.attribute("dur", format_args!("{}s", self.seconds))
            .attribute("repeatCount", "indefinite")
            .close_empty();
        xml.close().raw("\n");
    }

    /// Writes the phases as boxes on the axis.
    fn band(&self, xml: &mut Xml, (left, wide): (f64, f64), y: f64) {
        let (Some(first), Some(last)) = (self.view.frames.first(), self.view.frames.last()) else {
            return;
        };
        let whole = last.span.end.since(first.span.start).max(1) as f64;
        let x = |at: Stamp| {
            let part = at.since(first.span.start) as f64 / whole;
            left + wide * part.clamp(0.0, 1.0)
        };
        let mut boxes = String::new();
        for phase in self.phases {
            let (from, to) = (x(phase.span.start), x(phase.span.end));
            let _ = write!(boxes, "M{from:.1} {y:.0}v4H{to:.1}v-4");
        }
        if !boxes.is_empty() {
            xml.open("path")
                .attribute("class", "phase")
                .attribute("fill", "none")
                .attribute("stroke", self.style.timeline.axis)
                .attribute("d", boxes)
                .close_empty();
        }
    }

    /// Writes the time at every quarter of an axis that begins at `left`.
    fn ticks(&self, xml: &mut Xml, (left, wide): (f64, f64), y: f64) {
        let (Some(first), Some(last)) = (self.view.frames.first(), self.view.frames.last()) else {
            return;
        };
        let whole = last.span.end.since(first.span.start);
        let anchors = ["start", "middle", "middle", "middle", "end"];
        for (quarter, anchor) in (0_i32..).zip(anchors) {
            let nanos = match quarter {
                4 => whole / 1_000_000 * 1_000_000,
                quarter => whole / 4_000_000_000 * i64::from(quarter) * 1_000_000_000,
            };
            let x = left + wide * nanos as f64 / whole.max(1) as f64;
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
    /// The values of its live text, each with its first window and the one after its last, without empty texts.
    fn values(&self, tells_changes: bool) -> Vec<(usize, usize, u32)> {
        let list = match (tells_changes, self.life.lifecycles.is_empty()) {
            (true, _) => &self.life.turns,
            (false, true) => &self.life.rates,
            (false, false) => &self.life.lifecycles,
        };
        let ends = list.iter().skip(1).map(|run| run.from as usize);
        let ends = ends.chain([self.play.windows]);
        let all = list.iter().zip(ends).map(|(run, end)| {
            let from = run.from as usize;
            (from, if tells_changes { from + 1 } else { end }, run.value)
        });
        let is_told = |label: &String| !label.is_empty() && *label != words::rate(0.0);
        all.filter(|(.., value)| is_told(&self.play.runs.labels[*value as usize]))
            .collect()
    }

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
        String::new()
    }

    /// Writes a text for each value, seen in its windows; none where that would be too many.
    fn live(&self, xml: &mut Xml, (x, y): (i64, i64), tells_changes: bool) {
        let values = self.values(tells_changes);
        let is_one = matches!(values[..], [(_, to, _)] if to == self.play.windows);
        if values.len() > MOST_VALUES {
            return;
        }
        let mut by_label: BTreeMap<u32, Vec<(usize, usize)>> = BTreeMap::new();
        for (from, to, label) in values {
            by_label.entry(label).or_default().push((from, to));
        }
        for (label, times) in by_label {
            xml.open("text");
            if is_one {
                xml.attribute("class", "r");
            } else {
                xml.attribute("class", "r v")
                    .attribute("visibility", "hidden");
            }
            xml.attribute("x", x).attribute("y", y);
            if !is_one {
                self.play.classes(xml, &self.play.shown(&times, "r v"));
            }
            xml.text(&self.play.runs.labels[label as usize]).close();
        }
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
