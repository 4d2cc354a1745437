//! The words on the picture: badges with counts, and facts about an element.

use crate::base::words::{count, rate, rate_change, rate_of, rates};
use crate::view::{Counts, Shown};

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
        (
            counts.handed_over,
            format!("{} handed over", counts.handed_over),
        ),
        (counts.restarted, format!("{} restarted", counts.restarted)),
        (counts.silent, format!("{} fell silent", counts.silent)),
        (counts.values, count(counts.values, "state")),
        (counts.rates, count(counts.rates, "rate")),
    ];
    let reported = parts.into_iter().filter(|(n, _)| *n > 0);
    reported
        .map(|(_, words)| words)
        .collect::<Vec<_>>()
        .join(", ")
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

/// The rate that is written, with no more digits than its number of messages justifies; `None` for none.
pub(crate) fn rate_in(shown: &Shown) -> Option<String> {
    if shown.steps.len() > 1 && shown.each < 2 {
        return Some(rates(&shown.steps));
    }
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
    match shown.rates {
        Some((from, to)) => parts.push(rate_change(from, to)),
        None => parts.extend(measured(shown, shown.hz, shown.count)),
    }
    if let Some(n) = shown.count.filter(|n| *n > 0) {
        parts.push(count(n, "message"));
    }
    if let Some(state) = &shown.lifecycle {
        parts.push(format!("lifecycle {state}"));
    }
    parts.join(", ")
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
