//! The words on the picture: badges with counts, labels of boxes and arrows, and facts about an element.

use crate::base::words::{count, counted, rate, rate_of, rates};
use crate::draw::style::Body;
use crate::graph::{ById, State};
use crate::view::{Arrow, ArrowKind, Counts, Item, ItemKind, Shown, View};

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
    let mut parts = Vec::new();
    for (n, word) in numbers.into_iter().zip(["node", "topic", "edge"]) {
        if n > 0 {
            parts.push(format!("{sign}{}", count(n, word)));
        }
    }
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
pub(crate) fn rate_in_window(hz: Option<f64>, count: Option<u64>) -> Option<String> {
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
        let bar = if self.has_bar {
            body.size * BAR * TICK
        } else {
            0.0
        };
        self.lines(body) + bar
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
