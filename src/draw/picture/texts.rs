//! The words on the picture: badges with counts, labels of boxes and arrows, rows of topics on lines, and facts about an
//! element; and the ids of groups in SVG.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::sync::Arc;

use crate::base::geometry::Size;
use crate::base::name::is_vague;
use crate::base::notice::{Notice, NoticeKind};
use crate::base::words::{self, count, counted, rate, rate_of, rates};
use crate::draw::style::{Body, Edge};
use crate::draw::text::{Fonts, Weight};
use crate::graph::{ById, State};
use crate::mission::EventId;
use crate::view::{Arrow, ArrowKind, Counts, Item, ItemId, ItemKind, Mark, Shown, TopicRow, View};

/// The texts of the badges for beginnings, ends and other changes, each with the number of headlines it
/// counts; empty for none.
pub(crate) fn change_counts(counts: &Counts) -> [(String, usize); 3] {
    let came = [counts.nodes_added, counts.topics_added, counts.edges_added];
    let went = [
        counts.nodes_removed,
        counts.topics_removed,
        counts.edges_removed,
    ];
    [
        (change_count('+', came), counts.came()),
        (change_count('−', went), counts.went()),
        (changed(counts), counts.changed()),
    ]
}

/// The text of one badge, from the numbers of nodes, topics and edges: `+1 node +2 topics`.
fn change_count(sign: char, numbers: [usize; 3]) -> String {
    let parts = numbers.into_iter().zip(["node", "topic", "edge"]);
    let parts = parts.filter(|(n, _)| *n > 0);
    let parts: Vec<String> = parts
        .map(|(n, word)| format!("{sign}{}", count(n, word)))
        .collect();
    parts.join(" ")
}

/// The words for changes other than beginnings and ends: `1 handed over, 2 restarted`.
fn changed(counts: &Counts) -> String {
    let parts = [
        (counts.handed_over, "handed over"),
        (counts.restarted, "restarted"),
        (counts.silent, "fell silent"),
        (counts.values, "state"),
        (counts.rates, "rate"),
    ];
    counted(&parts, |n, what| match what {
        "state" | "rate" => count(n, what),
        _ => format!("{n} {what}"),
    })
}

/// The words for changes inside a collapsed namespace: `+1 −4 nodes, 1 restarted`.
pub(crate) fn inside(counts: &Counts) -> String {
    let pair = |came: usize, went: usize, word: &str| match (came, went) {
        (0, 0) => String::new(),
        (n, 0) => format!("+{}", count(n, word)),
        (0, n) => format!("−{}", count(n, word)),
        (a, b) => format!("+{a} −{}", count(b, word)),
    };
    let parts = [
        pair(counts.nodes_added, counts.nodes_removed, "node"),
        pair(counts.topics_added, counts.topics_removed, "topic"),
        pair(counts.edges_added, counts.edges_removed, "edge"),
        changed(counts),
    ];
    let reported = parts.into_iter().filter(|words| !words.is_empty());
    reported.collect::<Vec<_>>().join(", ")
}

/// The rate that is written, with no more digits than its number of messages justifies, and the new sender of a topic that
/// was handed over; `None` for no rate.
pub(crate) fn rate_in(shown: &Shown) -> Option<String> {
    let rate = match &shown.steps[..] {
        [_, _, ..] if shown.each < 2 => rates(&shown.steps),
        [_, _, ..] => rates(&shown.steps) + " each",
        _ => plain_rate(shown)?,
    };
    Some(match &shown.sender {
        Some(sender) => format!("{rate} by {sender}"),
        None => rate,
    })
}

/// The same without changes in the window.
pub(crate) fn plain_rate(shown: &Shown) -> Option<String> {
    let (hz, count) = shown.written_rate();
    measured(shown, hz, count)
}

/// The rate of an element that sent this many messages.
fn measured(shown: &Shown, hz: Option<f64>, count: Option<u64>) -> Option<String> {
    if shown.each < 2 {
        return rate_in_window(hz, count);
    }
    let hz = hz.filter(|hz| *hz > 0.0)?;
    Some(rate(hz / shown.each as f64) + " each")
}

/// A rate with no more digits than this many messages justify, or the number of messages without a rate: `1 msg`. `None` for
/// none.
fn rate_in_window(hz: Option<f64>, count: Option<u64>) -> Option<String> {
    let count = count.filter(|count| *count > 0);
    match (hz.filter(|hz| *hz > 0.0), count) {
        (Some(hz), Some(count)) => Some(rate_of(count, count as f64 / hz)),
        (Some(hz), None) => Some(rate(hz)),
        (None, count) => count.map(|count| rate_of(count, 0.0)),
    }
}

/// The facts about an element in this window: `active, measured, 50 Hz`.
pub(crate) fn facts(shown: &Shown) -> String {
    let mut parts = vec![
        shown.state.word().to_owned(),
        shown.confidence.word().to_owned(),
    ];
    if let Some(mark) = shown.mark {
        parts.insert(0, mark.class().to_owned());
    }
    match &shown.steps[..] {
        [_, _, ..] => parts.push(rates(&shown.steps)),
        _ => parts.extend(measured(shown, shown.hz, shown.count)),
    }
    if let Some(n) = shown.count.filter(|n| *n > 0) {
        parts.push(count(n, "message"));
    }
    if let Some(state) = &shown.lifecycle {
        parts.push(format!("lifecycle {state}"));
    }
    parts.join(", ")
}

// The words of boxes and arrows.

/// The height of a line of text, relative to its font size: from ascender to descender of the font.
pub(crate) const LINE: f64 = 1.22;
/// The height of a rate label, and its width beyond its text, relative to the font size: its ends are half circles, which
/// letters must not touch.
pub(crate) const BADGE_HEIGHT: f64 = 1.5;
pub(crate) const BADGE_PAD: f64 = 1.2;
/// The least relative difference of a subscription's rate from its topic's for it to be written beside it: less is a
/// message more or less in a window.
const OWN_RATE: f64 = 0.15;
/// The height of the bar of the times at which a node was there, as a share of that of its name: half a stroke of a letter
/// thicker than a line, so that it is not taken for one.
pub(crate) const BAR: f64 = 0.3;
/// The height of a tick over that of the bar: less is no tick, and more touches the name.
pub(crate) const TICK: f64 = 1.7;

/// The label of a box.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Label {
    /// The name as drawn.
    pub(crate) name: String,
    /// The number of topics that are counted beside it in every window.
    pub(crate) counted: usize,
    /// The names of other nodes in the box, below it.
    pub(crate) others: Vec<String>,
    /// Whether a smaller line is drawn below it in some window.
    pub(crate) second: bool,
    /// Whether a bar of the times at which it was there is drawn below it.
    pub(crate) has_bar: bool,
    /// The original name, if the font lacks some of its characters.
    pub(crate) unshown: Option<String>,
}

impl Label {
    /// The height of all its lines in pixels before scaling, with the bar below them.
    pub(crate) fn height(&self, body: &Body) -> f64 {
        let bar = self.has_bar.then_some(body.size * BAR * TICK);
        self.lines(body) + bar.unwrap_or(0.0)
    }

    /// The first line in a window.
    pub(crate) fn first(&self, shown: &Shown) -> String {
        counting(&self.name, self.counted + shown.unlined.len())
    }

    /// The height of its lines without the bar.
    pub(crate) fn lines(&self, body: &Body) -> f64 {
        let small = if self.second { body.small * LINE } else { 0.0 };
        body.size * LINE * (1 + self.others.len()) as f64 + small
    }

    /// The smaller line of a topic in a window without a message.
    pub(crate) fn silence(&self, shown: &Shown, shown_rates: ShownRates) -> &'static str {
        match shown.state {
            _ if shown.is_ghost() || !self.second || shown_rates != ShownRates::Rates => "",
            State::Latched => "latched",
            _ => NO_MESSAGE,
        }
    }
}

/// The text instead of a rate if there was no message.
pub(crate) const NO_MESSAGE: &str = "no msg";

/// A name with the number of topics that are only counted: `imu_driver +2`.
pub(crate) fn counting(name: &str, more: usize) -> String {
    match more {
        0 => name.to_owned(),
        more => format!("{name} +{more}"),
    }
}

/// The rates that a box shows because no arrow does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ShownRates {
    /// None: it is not a topic.
    Nothing,
    /// Changed rates of the whole topic: several nodes publish it, whose arrows show the other rates.
    Changes,
    /// All: at most one is ever known to publish it.
    Rates,
}

/// The rates that each item shows: all those of a topic, unless several publishers share it; then only those that
/// changed.
pub(crate) fn shown_rates(view: &View) -> Vec<ShownRates> {
    let mut senders = ById::like(&view.items, 0_usize);
    for arrow in view.arrows.iter().filter(|a| a.kind == ArrowKind::Publish) {
        if let Some(senders) = senders.get_mut(arrow.to) {
            *senders += 1;
        }
    }
    let shown_rates = |(item, senders): (&Item, usize)| match item.kind {
        ItemKind::Node | ItemKind::Namespace => ShownRates::Nothing,
        ItemKind::Topic | ItemKind::Group if senders > 1 => ShownRates::Changes,
        ItemKind::Topic | ItemKind::Group => ShownRates::Rates,
    };
    view.items.iter().zip(senders).map(shown_rates).collect()
}

/// The text of an arrow in a window, and whether it is drawn as a rate label because it changed.
pub(crate) fn arrow_label(
    arrow: &Arrow,
    shown: &Shown,
    from: Option<&Shown>,
) -> Option<(String, bool)> {
    if shown.is_ghost() {
        return None;
    }
    let called = if arrow.is_service { "() " } else { " " };
    let topic = arrow
        .carries(shown)
        .map_or_else(String::new, |t| t + called);
    let rate = rate_in(shown);
    if shown.has_new_rate() && arrow.kind != ArrowKind::Bundle {
        return rate.map(|rate| (topic + &rate, true));
    }
    match arrow.kind {
        ArrowKind::Publish => rate.map(|rate| (rate, false)),
        ArrowKind::Subscribe => {
            let of_topic = from.and_then(|s| s.hz).unwrap_or(0.0);
            let hz = shown.hz.unwrap_or(0.0);
            let differs = (hz - of_topic).abs() > OWN_RATE * of_topic.max(hz);
            rate.filter(|_| differs).map(|rate| (rate, false))
        }
        ArrowKind::Direct(_) => {
            let rate = rate.unwrap_or_default();
            Some(((topic + &rate).trim_end().to_owned(), false))
        }
        // Each of its topics has a row.
        ArrowKind::Bundle => None,
    }
}

/// The smaller line of a box in a window.
pub(crate) fn second_line(shown: &Shown, shown_rates: ShownRates) -> Option<String> {
    if let Some(inside) = &shown.inside {
        return Some(self::inside(inside));
    }
    if shown.is_ghost() {
        return None;
    }
    if let Some((number, word)) = shown.members.number() {
        return Some(count(number, word));
    }
    if let Some(state) = &shown.lifecycle {
        return Some(state.to_string());
    }
    rate_in(shown).filter(|_| shown_rates == ShownRates::Rates)
}

/// The rate label of a box in one window: the rate that changed, if neither an arrow nor its smaller line shows it.
pub(crate) fn rate_label(shown: &Shown, shown_rates: ShownRates) -> Option<String> {
    let is_new = shown_rates == ShownRates::Changes && shown.has_new_rate();
    rate_in(shown).filter(|_| is_new)
}

/// The part of a name inside the namespace in whose box it is drawn.
pub(crate) fn short_name<'a>(name: &'a str, inside: &str) -> &'a str {
    let rest = name
        .strip_prefix(inside)
        .and_then(|rest| rest.strip_prefix('/'));
    match rest {
        Some(rest) if !inside.is_empty() && !rest.is_empty() => rest,
        _ => name,
    }
}

// The ids, classes and attributes of groups in SVG, and the names that the font cannot show.

/// The notice about names with characters that no font contains; `None` if there are none.
pub fn unshown(view: &View, fonts: &Fonts) -> Option<Notice> {
    let items = view.items.iter();
    let items = items.chain(view.rows.iter().map(|row| &row.item));
    let names = items.map(|item| &*item.name);
    let missing: BTreeSet<char> = names.flat_map(|name| fonts.missing(name)).collect();
    let spelled = missing.iter().map(|c| c.escape_unicode().to_string());
    let some = words::some_of(spelled, 3);
    let text = format!(
        "names contain characters that the font lacks, drawn as {some}; add a font with `--font FILE`"
    );
    (!missing.is_empty()).then(|| Notice::new(NoticeKind::Glyph, text))
}

pub(super) fn item_id(item: &Item) -> String {
    let prefix = if item.kind.word() == "node" { "n" } else { "t" };
    format!("{prefix}{}", encoded(&item.name))
}

pub(super) fn arrow_id(arrow: &Arrow, ends: &[String; 2]) -> String {
    let [from, to] = ends.each_ref().map(|name| encoded(name));
    match &arrow.kind {
        ArrowKind::Publish => format!("p{from}..{to}"),
        ArrowKind::Subscribe => format!("s{from}..{to}"),
        ArrowKind::Direct(topic) => format!("d{from}..{to}..{}", encoded(topic)),
        ArrowKind::Bundle => format!("b{from}..{to}"),
    }
}

/// A name as part of an XML id, different for different names: `/` becomes `-`, anything but letters, digits and `_`
/// becomes `.` with its number in six hexadecimal digits.
pub(super) fn encoded(name: &str) -> String {
    let mut out = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            '/' => out.push('-'),
            '_' | 'a'..='z' | 'A'..='Z' | '0'..='9' => out.push(c),
            _ => {
                let _ = write!(out, ".{:06x}", u32::from(c));
            }
        }
    }
    out
}

/// The attributes of a box.
pub(crate) fn data(item: &Item, shown: &Shown) -> Vec<(&'static str, String)> {
    let mut data = vec![
        ("name", item.name.to_string()),
        ("state", shown.state.word().to_owned()),
    ];
    data.extend(shown.mark.map(|mark| ("mark", mark.word().to_owned())));
    let counted = item.counted.iter();
    let counted: Vec<&str> = counted.chain(&shown.unlined).map(|name| &**name).collect();
    if !counted.is_empty() {
        data.push(("topics", counted.join(" ")));
    }
    let members = shown.members.number();
    data.extend(members.map(|(number, _)| ("members", number.to_string())));
    data.extend(entries(&shown.events));
    data
}

/// The attribute with the events of the log, if there are any.
pub(crate) fn entries<'a>(
    events: impl IntoIterator<Item = &'a EventId>,
) -> Option<(&'static str, String)> {
    let all: Vec<String> = events.into_iter().map(ToString::to_string).collect();
    (!all.is_empty()).then(|| ("entries", all.join(" ")))
}

/// The class words of an element, `node added active measured`: its kind, its mark, its state, its confidence.
pub(crate) fn class(what: &str, shown: &Shown) -> String {
    let mut words = vec![what];
    words.extend(shown.mark.map(Mark::class));
    words.extend([shown.state.word(), shown.confidence.word()]);
    if let Some(mark @ (Mark::HandedOver | Mark::Restarted)) = shown.mark {
        words.push(mark.word());
    }
    if shown.is_starved {
        words.push("starved");
    }
    words.dedup();
    words.join(" ")
}

pub(crate) fn title(item: &Item, shown: &Shown) -> String {
    let what = match item.kind {
        ItemKind::Node => "node",
        _ if item.is_service => "service",
        ItemKind::Topic => "topic",
        ItemKind::Group => "topics",
        ItemKind::Namespace => "namespace",
    };
    format!("{}\n{what}: {}", item.name, facts(shown))
}

// The words on a line between two boxes: a row per topic, its name and its rate.

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
        let mut ways = self.ways;
        if !is_forward {
            ways.reverse();
        }
        let signs = match (ways, is_upright) {
            ([true, true], true) => "↑↓ ",
            ([true, true], false) => "←→ ",
            ([true, false], true) => "↓ ",
            ([true, false], false) => "→ ",
            ([false, true], true) => "↑ ",
            ([false, true], false) => "← ",
            ([false, false], _) => "",
        };
        format!("{signs}{}", self.text)
    }
}

/// The names of the topics of an arrow as drawn: as short as possible without ambiguity, without image
/// transports.
pub(crate) fn names(view: &View, arrow: &Arrow) -> Vec<String> {
    let plain = |name: &Arc<str>| {
        let family = FAMILIES.iter().find_map(|end| name.strip_suffix(end));
        let rest = family.filter(|rest| !rest.is_empty());
        rest.unwrap_or(name).to_owned()
    };
    let plain: Vec<String> = arrow.topics.iter().map(plain).collect();
    let forms = arrow.topics.iter().zip(&plain);
    let forms = forms.map(|(whole, plain)| [last(plain), relative(view, arrow, plain), &**whole]);
    let forms: Vec<[&str; 3]> = forms.collect();
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
    let few = changed.clamp(1, MOST);
    let most = if all <= MOST { all } else { few };
    let is_whole = shown.is_ghost();
    let mut rows: Vec<Row> = Vec::new();
    for row in shown.by_rate().take(most) {
        let mut name = names.get(row.topic as usize).cloned().unwrap_or_default();
        if row.is_service {
            name = called(&name);
        }
        let rate = rate_of_topic(row).filter(|_| !is_whole && row.mark != Some(Mark::Removed));
        let lines = match rate {
            None => vec![name],
            Some(rate) if name.len() + rate.len() >= LONGEST => vec![name, rate],
            Some(rate) => vec![format!("{name} {rate}")],
        };
        let has_signs = both || row.ways == [true, true];
        rows.extend(lines.into_iter().enumerate().map(|(line, text)| Row {
            ways: row.ways.map(|way| way && has_signs && line == 0),
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
fn rate_of_topic(row: &TopicRow) -> Option<String> {
    if row.steps.len() > 1 && (row.mark.is_some() || row.ways != [true, true]) {
        return Some(words::rates(&row.steps));
    }
    if row.is_starved {
        return Some(STARVED.to_owned());
    }
    let rate = rate_in_window(row.hz, row.count).filter(|_| row.ways != [true, true]);
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

    #[test]
    fn badges_count_changes() {
        assert_eq!(change_count('+', [1, 2, 0]), "+1 node +2 topics");
        assert_eq!(change_count('−', [0, 0, 1]), "−1 edge");
        assert_eq!(change_count('+', [0, 0, 0]), "");
        let counts = Counts {
            nodes_added: 1,
            nodes_removed: 4,
            handed_over: 1,
            restarted: 2,
            ..Counts::default()
        };
        assert_eq!(
            change_counts(&counts),
            [
                ("+1 node".to_owned(), 1),
                ("−4 nodes".to_owned(), 4),
                ("1 handed over, 2 restarted".to_owned(), 3)
            ]
        );
        assert_eq!(inside(&counts), "+1 −4 nodes, 1 handed over, 2 restarted");
    }

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
