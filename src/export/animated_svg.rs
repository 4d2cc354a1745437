//! The whole sequence as one animated SVG: the graph once, and per changing element the classes it goes through.
//!
//! It runs inside `<img>`. Whoever asks for less motion gets a still of everything that ever was, because the rules for
//! the classes hold only where motion is welcome; a reader that knows no animation shows the busiest window.

use std::fmt::Write as _;

use super::{AtOnce, Encoder};
use crate::base::error::Result;
use crate::base::geometry::Rect;
use crate::base::words;
use crate::base::words::visible;
use crate::draw::paint::classes::bars;
use crate::draw::paint::classes::{self, Classes, Detail, ElementLook};
use crate::draw::paint::svg;
use crate::draw::paint::xml::escape;
use crate::draw::picture::rate_label;
use crate::export::sequence::{Overview, Sequence, Whole};
use crate::export::target::Target;
use crate::view::View;
use crate::view::runs::{ElementRuns, Run, Runs, at};

/// Above this many elements, browsers take most of a processor core to show it.
const MANY: usize = 300;
/// With more changed windows than this, what changed is not written in words.
const MOST_CAPTIONS: usize = 24;
/// The longest caption, in characters.
/// So many phrases are written out at most; the rest is counted.
const MOST_PHRASES: usize = 4;
const LONGEST_CAPTION: usize = 110;
/// Around the graph.
const MARGIN: f64 = 12.0;
/// Above and below the graph.
const TOP: f64 = 58.0;
const BOTTOM: f64 = 62.0;

/// Begins the animation.
///
/// # Errors
/// As [`AtOnce::start`].
pub(crate) fn start<'a>(
    sequence: &'a Sequence<'a>,
    target: &Target,
) -> Result<Box<dyn Encoder + 'a>> {
    AtOnce::start(target, move || {
        let Some(whole) = sequence.picture.graph() else {
            let overview = sequence.picture.overview();
            let played = overview.map(|o| played(&o, sequence.options.frame_ms));
            return (played.unwrap_or_default(), Vec::new());
        };
        let remarks = remark(sequence.view).into_iter().collect();
        (
            animation(sequence.view, &whole, sequence.options.frame_ms),
            remarks,
        )
    })
}

/// An overview over time with a head that goes from window to window.
fn played(overview: &Overview, frame_ms: u32) -> String {
    let list = |of: &dyn Fn(&Rect) -> f64| {
        let all: Vec<String> = overview
            .heads
            .iter()
            .map(|h| format!("{:.1}", of(h)))
            .collect();
        all.join(";")
    };
    let seconds = overview.heads.len() as f64 * f64::from(frame_ms) / 1e3;
    let head = overview.heads.first().copied().unwrap_or_default();
    let turn = |name: &str, values: String| {
        format!(
            "<animate attributeName=\"{name}\" calcMode=\"discrete\" dur=\"{seconds}s\" repeatCount=\"indefinite\" values=\"{values}\"/>"
        )
    };
    let head = format!(
        "<rect id=\"playhead\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"2\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\">{}{}</rect>\n</svg>\n",
        head.x,
        head.y,
        head.w,
        head.h,
        overview.color,
        turn("x", list(&|h| h.x)),
        turn("width", list(&|h| h.w)),
    );
    let still = svg::write_with_fonts(&overview.scene);
    let open = still.trim_end().strip_suffix("</svg>").unwrap_or(&still);
    open.to_owned() + &head
}

fn remark(view: &View) -> Option<String> {
    let elements = view.items.len() + view.arrows.len();
    (elements > MANY).then(|| {
        format!("an animated SVG of {elements} elements keeps a browser busy: a GIF shows the same at a tenth of the cost")
    })
}

fn animation(view: &View, whole: &Whole<'_>, frame_ms: u32) -> String {
    let runs = Runs::of(view, rate_label);
    let play = Play {
        view,
        runs: &runs,
        whole,
        windows: view.frames.len(),
        still: u32::try_from(view.busiest()).unwrap_or(0),
        seconds: view.frames.len() as f64 * f64::from(frame_ms) / 1e3,
    };
    play.document()
}

struct Play<'a> {
    view: &'a View,
    runs: &'a Runs,
    whole: &'a Whole<'a>,
    windows: usize,
    /// The window shown where nothing moves.
    still: u32,
    /// How long one round takes.
    seconds: f64,
}

impl Play<'_> {
    fn document(&self) -> String {
        let (union, style) = (&self.whole.union, self.whole.style);
        let detail = Detail {
            is_fine: false,
            has_names: false,
        };
        let stage = Classes::new(self.view, union, style, detail);
        let graph_width = union.size.w + 2.0 * MARGIN;
        let width = graph_width.max(720.0);
        let height = union.size.h + TOP + BOTTOM + 2.0 * MARGIN;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\"><title>"
        );
        escape(&mut out, &visible(self.whole.title));
        let _ = writeln!(out, "</title>\n<style>{}</style>", self.rules());
        let _ = write!(
            out,
            "<rect width=\"100%\" height=\"100%\" fill=\"{}\"/>",
            style.background()
        );
        self.title(&mut out, width);
        let _ = writeln!(
            out,
            "{}<g transform=\"translate({:.0} {:.0})\">",
            stage.signs(),
            (width - union.size.w) / 2.0,
            TOP + MARGIN
        );
        stage.spaces(&mut out);
        for &at in &union.order {
            stage.arrow(&mut out, at, &self.element(&self.runs.arrows[at], "edge"));
        }
        for (at, life) in self.runs.items.iter().enumerate() {
            stage.item(
                &mut out,
                at,
                &self.element(life, self.view.items[at].kind.word()),
            );
        }
        out.push_str("</g>\n");
        self.timeline(&mut out, width, height);
        out.push_str("</svg>\n");
        out
    }

    fn rules(&self) -> String {
        let style = self.whole.style;
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

    /// An animation of the class over these values; `None` where there is only one.
    fn classes(&self, steps: &[(u32, String)]) -> Option<String> {
        if steps.len() < 2 {
            return None;
        }
        let values: Vec<&str> = steps.iter().map(|s| s.1.as_str()).collect();
        let times: Vec<String> = steps.iter().map(|s| self.part(s.0)).collect();
        Some(format!(
            "<animate attributeName=\"class\" calcMode=\"discrete\" dur=\"{}s\" repeatCount=\"indefinite\" \
             keyTimes=\"{}\" values=\"{}\"/>",
            self.seconds,
            times.join(";"),
            values.join(";")
        ))
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

    fn title(&self, out: &mut String, width: f64) {
        let _ = write!(out, "<text class=\"t\" x=\"16\" y=\"26\">");
        escape(out, &visible(self.whole.title));
        let (Some(first), Some(last)) = (self.view.frames.first(), self.view.frames.last()) else {
            out.push_str("</text>\n");
            return;
        };
        let whole = last.span.end.since(first.span.start) / 1_000_000_000 * 1_000_000_000;
        let _ = writeln!(
            out,
            "</text><text class=\"u\" x=\"16\" y=\"45\">{} windows of {} · {}</text>",
            self.windows,
            words::period(first.span.nanos()),
            words::offset(whole)
        );
        let told = self
            .view
            .frames
            .iter()
            .zip(0_u32..)
            .filter(|(f, _)| !f.headlines.is_empty());
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
            let words: String = visible(&frame.words(MOST_PHRASES))
                .chars()
                .take(LONGEST_CAPTION)
                .collect();
            let _ = write!(
                out,
                "<text class=\"k\" x=\"{:.0}\" y=\"45\">{}",
                width - 16.0,
                self.classes(&steps).unwrap_or_default()
            );
            escape(out, &words);
            out.push_str("</text>\n");
        }
    }

    /// What changed when, and where in the mission the picture is.
    fn timeline(&self, out: &mut String, width: f64, height: f64) {
        let style = &self.whole.style.timeline;
        let (left, wide, y) = (16.0, width - 32.0, height - 26.0);
        let scale = wide / self.windows.max(1) as f64;
        let _ = write!(
            out,
            "<g transform=\"translate({left} {:.0}) scale({scale:.4} .5)\">{}</g>\
             <path d=\"M{left} {y:.0}h{wide:.0}\" stroke=\"{}\"/>",
            y - 30.0,
            bars(self.runs),
            style.axis
        );
        if let (Some(first), Some(last)) = (self.view.frames.first(), self.view.frames.last()) {
            let whole = last.span.end.since(first.span.start);
            for quarter in 0..=4_i32 {
                let nanos = whole / 4_000_000_000 * i64::from(quarter) * 1_000_000_000;
                let x = left + wide * f64::from(quarter) / 4.0;
                let anchor =
                    ["start", "middle", "middle", "middle", "end"][quarter.unsigned_abs() as usize];
                let _ = write!(
                    out,
                    "<text class=\"x\" style=\"text-anchor:{anchor}\" x=\"{x:.0}\" y=\"{:.0}\">{}</text>",
                    y + 17.0,
                    words::offset(nanos)
                );
            }
        }
        let _ = writeln!(
            out,
            "<rect class=\"head\" x=\"{left}\" y=\"{:.0}\" width=\"2.5\" height=\"34\" fill=\"{}\">\
             <animate attributeName=\"x\" from=\"{left}\" to=\"{:.1}\" dur=\"{}s\" repeatCount=\"indefinite\"/></rect>",
            y - 32.0,
            style.head,
            left + wide,
            self.seconds
        );
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

    fn more(&self) -> String {
        let mut steps = vec![(0, self.words(at(&self.life.classes, 0)))];
        for run in &self.life.classes {
            let words = self.words(run.value);
            if steps.last().is_some_and(|last| last.1 != words) {
                steps.push((run.from, words));
            }
        }
        self.play.classes(&steps).unwrap_or_default()
    }
}
