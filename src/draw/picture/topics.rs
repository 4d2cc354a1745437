//! The words on a line between two boxes: a row per topic, its name and its rate.

use std::sync::Arc;

use super::texts::{self, LINE};
use crate::base::geometry::Size;
use crate::base::name::is_vague;
use crate::base::words;
use crate::draw::style::Edge;
use crate::draw::text::{Fonts, Weight};
use crate::graph::State;
use crate::view::{Arrow, ItemId, Mark, Shown, TopicRow, View};

/// The most topics that have a row each; if there are more, only those that changed, or the one with the
/// highest rate. Four rows are as high as a box with its gap.
const MOST: usize = 4;
/// The number of letters above which a rate is drawn below its name, so that lines need not be long.
const LONGEST: usize = 15;
/// The largest width of a name, in text heights, about 28 letters: wider ones would push the layers apart.
const WIDEST: f64 = 15.0;
/// The last parts of the names of a group of topics, and of image transports.
const FAMILIES: [&str; 8] = [
    "/action_topics",
    "/image_topics",
    "/compressed",
    "/compressedDepth",
    "/theora",
    "/zstd",
    "/ffmpeg",
    "/service_events",
];

/// A row of words.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    /// Whether messages run along the line, and whether against it, if the line is used in both directions.
    pub(crate) ways: [bool; 2],
    /// The words after the direction signs.
    pub(crate) text: String,
    pub(crate) mark: Option<Mark>,
}

impl Row {
    /// The words with direction signs, for a line that is closer to vertical or not, and runs down or to the
    /// right or not.
    pub(crate) fn words(&self, is_upright: bool, is_forward: bool) -> String {
        let [on, back] = if is_forward {
            self.ways
        } else {
            [self.ways[1], self.ways[0]]
        };
        let signs = match (on, back, is_upright) {
            (true, true, true) => "↑↓ ",
            (true, true, false) => "←→ ",
            (true, false, true) => "↓ ",
            (true, false, false) => "→ ",
            (false, true, true) => "↑ ",
            (false, true, false) => "← ",
            (false, false, _) => "",
        };
        format!("{signs}{}", self.text)
    }
}

/// The names of the topics of an arrow as drawn: as short as possible without ambiguity, without image
/// transports.
pub(crate) fn names(view: &View, arrow: &Arrow) -> Vec<String> {
    let plain = |name: &Arc<str>| {
        let family = FAMILIES.iter().find_map(|end| name.strip_suffix(end));
        family
            .filter(|rest| !rest.is_empty())
            .unwrap_or(name)
            .to_owned()
    };
    let plain: Vec<String> = arrow.topics.iter().map(plain).collect();
    let forms: Vec<[&str; 3]> = arrow
        .topics
        .iter()
        .zip(&plain)
        .map(|(whole, plain)| [last(plain), relative(view, arrow, plain), whole])
        .collect();
    let is_alone = |at: usize, form: usize| {
        let same = forms.iter().filter(|other| other[form] == forms[at][form]);
        same.count() == 1
    };
    let shortest = |at: usize| (0..2).find(|form| is_alone(at, *form)).unwrap_or(2);
    (0..forms.len())
        .map(|at| forms[at][shortest(at)].to_owned())
        .collect()
}

/// The last part of a name, with the previous one if it is too generic.
fn last(name: &str) -> &str {
    let mut parts = name
        .rmatch_indices('/')
        .map(|(at, _)| name.get(at + 1..).unwrap_or_default());
    let last = parts.next().unwrap_or(name);
    if is_vague(last) {
        parts.next().unwrap_or(last)
    } else {
        last
    }
}

/// The name without the namespace whose frame contains one of the arrow's ends.
fn relative<'a>(view: &View, arrow: &Arrow, name: &'a str) -> &'a str {
    let inside = |item: ItemId| {
        let mut rests = view.around(item).filter_map(|at| {
            name.strip_prefix(&*view.namespaces[at].name)?
                .strip_prefix('/')
        });
        rests.next()
    };
    let shorter = [arrow.from, arrow.to].into_iter().filter_map(inside);
    shorter.min_by_key(|rest| rest.len()).unwrap_or(name)
}

/// The rows of a line in a window: up to four topics have one each, changed ones first, then by rate; of
/// more, the changed ones or the one with the highest rate, with the number of the others.
pub(crate) fn rows(shown: &Shown, names: &[String]) -> Vec<Row> {
    let both = shown.ways() == [true, true];
    let changed = shown.topics.iter().filter(|row| row.mark.is_some()).count();
    let all = shown.topics.len();
    let most = if all <= MOST {
        all
    } else {
        changed.clamp(1, MOST)
    };
    let is_whole = shown.is_ghost();
    let mut rows: Vec<Row> = Vec::new();
    for row in shown.by_rate().take(most) {
        let name = names.get(row.topic as usize).map_or("", String::as_str);
        let name = &*if row.is_service {
            called(name)
        } else {
            name.to_owned()
        };
        let rate = rate(row).filter(|_| !is_whole && row.mark != Some(Mark::Removed));
        let is_split = rate
            .as_ref()
            .is_some_and(|rate| name.len() + rate.len() >= LONGEST);
        let (text, below) = match rate {
            None => (name.to_owned(), None),
            Some(rate) if is_split => (name.to_owned(), Some(rate)),
            Some(rate) => (format!("{name} {rate}"), None),
        };
        let ways = if both || row.ways == [true, true] {
            row.ways
        } else {
            [false, false]
        };
        rows.push(Row {
            ways,
            text,
            mark: row.mark,
        });
        rows.extend(below.map(|text| Row {
            ways: [false, false],
            text,
            mark: row.mark,
        }));
    }
    if let Some(last) = rows.last_mut().filter(|_| all > most) {
        last.text = format!("{} +{}", last.text, all - most);
    }
    rows
}

/// The text instead of the rate of a topic whose subscriber receives nothing.
const STARVED: &str = "(gets nothing)";

/// The name of a service as drawn.
pub(crate) fn called(name: &str) -> String {
    format!("{name}()")
}

/// The rate of a topic in words, or the reason for none; none for an action, whose topics each have one.
fn rate(row: &TopicRow) -> Option<String> {
    if row.steps.len() > 1 && (row.mark.is_some() || row.ways != [true, true]) {
        return Some(words::rates(&row.steps));
    }
    if row.is_starved {
        return Some(STARVED.to_owned());
    }
    let rate = texts::rate_in_window(row.hz, row.count).filter(|_| row.ways != [true, true]);
    rate.or_else(|| (row.state == State::Latched).then(|| "(latched)".to_owned()))
}

/// The space that these rows need side by side.
pub(crate) fn room(rows: &[Row], fonts: &Fonts, style: &Edge) -> Option<Size> {
    let width = |row: &Row| fonts.width(&row.words(true, true), style.size, Weight::SemiBold);
    let widest = rows.iter().map(width).reduce(f64::max)?;
    let height = style.size * LINE * rows.len() as f64;
    Some(Size::new(widest + style.halo_width, height))
}

/// A name that fits a row.
pub(crate) fn fitted(name: &str, fonts: &Fonts, size: f64) -> String {
    fonts
        .fit(&fonts.shown(name), size, Weight::Regular, WIDEST * size)
        .into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{ArrowId, Mode, ViewOptions, view};

    /// The words on the only line of a window, for a line to the right.
    fn words(window: &str) -> Vec<String> {
        let options = ViewOptions {
            mode: Mode::Nodes,
            is_bundled: true,
            ..ViewOptions::default()
        };
        let (view, _) = view(&mission(&[window]), &options);
        assert_eq!(view.arrows.len(), 1, "{:?}", view.arrows);
        let names = names(&view, &view.arrows[ArrowId(0)]);
        let rows = rows(view.arrows_shown[ArrowId(0)].at(0).unwrap(), &names);
        rows.iter().map(|row| row.words(false, true)).collect()
    }

    #[test]
    fn a_line_has_a_row_per_topic_and_signs_where_it_is_used_both_ways() {
        assert_eq!(words("/a>/n/scan@9 /b</n/scan"), ["scan 9 Hz"]);
        let both = "/a>/scan@9 /a>/map@0.1 /b</scan /b</map /b>/odom@5 /a</odom";
        assert_eq!(words(both), ["→ scan 9 Hz", "← odom 5 Hz", "→ map 1 msg"]);
    }

    #[test]
    fn of_five_topics_the_fastest_is_named() {
        let four = "/a>/p@0.1 /a>/q@2 /a>/r@3 /a>/s@4 /b</p /b</q /b</r /b</s";
        assert_eq!(words(four), ["s 4 Hz", "r 3 Hz", "q 2 Hz", "p 1 msg"]);
        assert_eq!(words(&format!("{four} /a>/t@5 /b</t")), ["t 5 Hz +4"]);
    }

    #[test]
    fn an_action_is_one_row() {
        let action = "/a>/go/goal /a>/go/cancel /b</go/goal /b</go/cancel /b>/go/status@5 \
                      /b>/go/feedback /b>/go/result /a</go/status /a</go/feedback /a</go/result";
        assert_eq!(words(action), ["←→ go"]);
    }

    #[test]
    fn names_are_shortened_while_distinguishable() {
        let equal = "/a>/n/l/map@0.1 /a>/n/g/map@2 /b</n/l/map /b</n/g/map";
        assert_eq!(words(equal), ["/n/g/map 2 Hz", "/n/l/map 1 msg"]);
        let image = "/a>/n/camera/image/compressed@30 /b</n/camera/image/compressed";
        assert_eq!(words(image), ["image 30 Hz"]);
        assert_eq!(words("/a>/imu/data@9 /b</imu/data"), ["imu/data 9 Hz"]);
    }
}
