//! The style as rules for classes: the paint of [`crate::draw::picture`], once per class instead of once per element.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::draw::scene::Stroke;
use crate::draw::style::{Body, Change, Color, Quiet, Style};
use crate::view::{Mark, STEPS, decades};

/// The rules of the graph in every window: [`base`], then [`states`].
pub(crate) fn rules(style: &Style, words: &BTreeSet<&str>) -> String {
    base(style) + &states(style, words)
}

/// The rules for elements that are active and did not change.
fn base(style: &Style) -> String {
    let mut out = String::from(
        ":is(.node,.topic,.edge) text{text-anchor:middle;stroke:none}use,.c,.l{visibility:hidden}",
    );
    let cluster = &style.cluster;
    let _ = write!(
        out,
        ".namespace rect{{{}}}.namespace text{{text-anchor:start;font:600 {}px {FONT};fill:{};stroke:none}}",
        paint(cluster.fill, cluster.stroke, cluster.width, &cluster.dash),
        cluster.size,
        cluster.text
    );
    body(&mut out, ".node", &style.node);
    body(&mut out, ".topic", &style.topic);
    // The names of elements without a box.
    let _ = write!(
        out,
        ".also rect{{stroke:none}}.also text,.items>g>text:first-child{{text-anchor:start;font:{}px {FONT};fill:{};stroke:none}}",
        style.edge.size, style.page.quiet
    );
    edges(&mut out, style);
    badges(&mut out, style);
    // A separate shape among those of its box.
    let _ = write!(out, "g>rect.l{{fill:{};stroke:none}}", style.latched.stroke);
    out
}

/// The rules for the changes by classes: rate, confidence, state and mark; later rules take precedence. Only
/// these class words have rules.
fn states(style: &Style, words: &BTreeSet<&str>) -> String {
    // The rate of a silent element is not worth showing.
    let mut out = String::from(
        ".off,:is(.edge,.topic):is(.silent,.latched,.declared,.removed):not(.changed)>.r{visibility:hidden}",
    );
    for step in 1..=STEPS {
        let word = format!("w{step}");
        if words.contains(&*word) {
            let edge = &style.edge;
            let width = (edge.width + edge.per_decade * decades(step)).min(edge.most);
            let _ = write!(out, ".{word} path{{stroke-width:{}}}", short(width));
        }
    }
    if words.contains("inferred") {
        known(&mut out, style);
    }
    let quiets = [("declared", &style.declared), ("silent", &style.silent)];
    for (state, quiet) in quiets.iter().filter(|(word, _)| words.contains(word)) {
        self::quiet(&mut out, state, quiet);
    }
    let changes = [
        ("added", &style.added),
        ("removed", &style.removed),
        ("changed", &style.changed),
    ];
    for (kind, change) in changes.iter().filter(|(word, _)| words.contains(word)) {
        self::change(&mut out, kind, change);
    }
    if words.contains("away") {
        self::quiet(&mut out, "away", &style.away());
    }
    let badges = Mark::BADGED.map(Mark::badge).into_iter();
    let badges = badges.filter(|word| words.contains(word));
    let mut shown: Vec<String> = badges.map(|word| format!(".{word}>.{word}")).collect();
    shown.push(":is(.faster,.slower)>.c,.latched:not(.removed,.edge)>.l,.starved>.l".to_owned());
    let _ = write!(out, "{}{{visibility:inherit}}", shown.join(","));
    if words.contains("starved") {
        out.push_str(".edge.starved path+path:not(.l){visibility:hidden}");
    }
    out
}

const FONT: &str = "Inter,Helvetica,Arial,sans-serif";

fn body(out: &mut String, what: &str, body: &Body) {
    let weight = if body.bold { "600 " } else { "" };
    let _ = write!(
        out,
        "{what} :is(rect,ellipse,path){{{}}}{what} text{{font:{weight}{}px {FONT};fill:{}}}\
         {what} :is(.r,.m){{font:{}px {FONT}}}",
        paint(body.fill, body.stroke, body.width, &[]),
        body.size,
        body.text,
        body.small
    );
}

/// Writes the rules for edges. The line is the first path of an edge, its head the second.
fn edges(out: &mut String, style: &Style) {
    let edge = &style.edge;
    let _ = write!(
        out,
        ".edge path{{fill:none;stroke:{c};stroke-width:{}}}.edge path+path{{fill:{c};stroke:none}}\
         .edge text{{font:{}px {FONT};fill:{}}}\
         .edge text,.topic>.c{{paint-order:stroke;stroke:{};stroke-width:{};stroke-linejoin:round}}",
        edge.width,
        edge.size,
        edge.text,
        edge.halo,
        edge.halo_width,
        c = edge.stroke,
    );
}

fn known(out: &mut String, style: &Style) {
    let dash = dashes(&style.inferred.dash);
    let _ = write!(
        out,
        ".inferred>:is(rect,ellipse,path){{stroke-dasharray:{dash}}}"
    );
}

fn quiet(out: &mut String, state: &str, quiet: &Quiet) {
    let line = paint(quiet.fill, quiet.stroke, quiet.width, &quiet.dash);
    let (stroke, text) = (quiet.stroke, quiet.text);
    let _ = write!(
        out,
        ".{state} :is(rect,ellipse,path){{{line}}}.edge.{state} path{{fill:none}}\
         .edge.{state} path+path{{fill:{stroke};stroke:none}}.{state} text{{fill:{text}}}"
    );
}

fn change(out: &mut String, kind: &str, change: &Change) {
    let Change {
        color,
        fill,
        text,
        width,
        dash,
        ..
    } = change;
    let _ = write!(
        out,
        ".{kind} :is(rect,ellipse,path){{{}}}.{kind} text{{fill:{text}}}\
         .edge.{kind} path{{fill:none;stroke:{color};stroke-width:{};stroke-dasharray:{}}}\
         .edge.{kind} path+path{{fill:{color};stroke:none}}.edge.{kind} text{{fill:{color};font-weight:600}}",
        paint(*fill, *color, *width, dash),
        short(width * 0.8),
        dashes(dash),
    );
}

/// Writes the colours of badges, which are hidden until their element has their class.
fn badges(out: &mut String, style: &Style) {
    let _ = write!(
        out,
        ".badge{{visibility:inherit}}.b{{stroke:{};stroke-width:1.2}}.p{{fill:none;stroke:{s};stroke-width:2}}\
         .f{{fill:{s};stroke:none}}use{{fill:{}}}.edge>use{{scale:.8;transform-box:fill-box;transform-origin:center}}use.added{{fill:{}}}use.removed{{fill:{}}}",
        style.badge.halo,
        style.changed.color,
        style.added.color,
        style.removed.color,
        s = style.badge.sign,
    );
}

fn paint(fill: Color, stroke: Color, width: f64, dash: &[f64]) -> String {
    format!(
        "fill:{fill};stroke:{stroke};stroke-width:{};{}",
        short(width),
        dash_rule(width, dash)
    )
}

fn dash_rule(width: f64, dash: &[f64]) -> String {
    let cap = if Stroke::dashed(Color::NONE, width, dash).is_round() {
        ";stroke-linecap:round"
    } else {
        ""
    };
    format!("stroke-dasharray:{}{cap}", dashes(dash))
}

fn dashes(dash: &[f64]) -> String {
    if dash.is_empty() {
        return "none".to_owned();
    }
    let all: Vec<String> = dash.iter().map(|d| short(*d)).collect();
    all.join(" ")
}

/// A number to a hundredth, as text.
fn short(value: f64) -> String {
    (libm::round(value * 100.0) / 100.0).to_string()
}

/// The style's colours for the page around the graph, as custom properties of CSS.
pub(crate) fn variables(style: &Style) -> String {
    let all = [
        ("page", style.page.background),
        ("text", style.page.text),
        ("quiet", style.page.quiet),
        ("bar", style.title.fill),
        ("bar-line", style.title.line),
        ("bar-text", style.title.text),
        ("bar-quiet", style.title.quiet),
        ("panel", style.legend.fill),
        ("line", style.legend.line),
        ("edge", style.edge.stroke),
        ("past", style.timeline.past),
        ("future", style.timeline.future),
        ("now", style.timeline.now),
        ("head", style.timeline.head),
        ("axis", style.timeline.axis),
        ("added", style.added.color),
        ("removed", style.removed.color),
        ("changed", style.changed.color),
        ("added-count", style.count.added),
        ("added-on", style.count.added_text),
        ("removed-count", style.count.removed),
        ("removed-on", style.count.removed_text),
        ("changed-count", style.count.changed),
        ("changed-on", style.count.changed_text),
    ];
    let mut out = String::from(":root{");
    for (name, color) in all {
        match color.rgb() {
            Some(_) => {
                let _ = write!(out, "--{name}:{color};");
            }
            None => {
                let _ = write!(out, "--{name}:transparent;");
            }
        }
    }
    out.push('}');
    out
}
