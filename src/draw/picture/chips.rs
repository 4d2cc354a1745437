//! The words on the picture: chips, and what an element is.

use crate::base::words::{count, rate, rate_change};
use crate::view::{Counts, Shown};

/// `+1 node +2 topics`; empty if there are none. Edges are named only where they are all there is.
pub(crate) fn chip(sign: char, nodes: usize, topics: usize, edges: usize) -> String {
    let mut parts = Vec::new();
    let edges = if nodes + topics == 0 { edges } else { 0 };
    for (n, word) in [(nodes, "node"), (topics, "topic"), (edges, "edge")] {
        if n > 0 {
            parts.push(format!("{sign}{}", count(n, word)));
        }
    }
    parts.join(" ")
}

/// `1 rate · 1 other`: what changed without coming or going; empty if nothing did.
pub(crate) fn changed_chip(tally: &Counts) -> String {
    match (tally.rates, tally.others) {
        (0, 0) => String::new(),
        (n, 0) => format!("{} changed", count(n, "rate")),
        (0, n) => count(n, "other change"),
        (a, b) => format!("{}, {b} other", count(a, "rate")),
    }
}

/// What is known of an element in this window: `active, measured, 50 Hz`.
pub(crate) fn facts(shown: &Shown) -> String {
    let mut parts = vec![
        shown.state.word().to_owned(),
        shown.degree.word().to_owned(),
    ];
    if let Some(mark) = shown.mark {
        parts.insert(0, mark.class().to_owned());
    }
    match (shown.from_hz, shown.hz) {
        (Some(from), Some(to)) => parts.push(rate_change(from, to)),
        (None, Some(hz)) if hz > 0.0 => parts.push(rate(hz)),
        _ => {}
    }
    if let Some(n) = shown.count.filter(|n| *n > 0) {
        parts.push(count(usize::try_from(n).unwrap_or(usize::MAX), "message"));
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
    fn chips_count() {
        assert_eq!(chip('+', 1, 2, 5), "+1 node +2 topics");
        assert_eq!(chip('−', 0, 0, 1), "−1 edge");
        assert_eq!(chip('+', 0, 0, 0), "");
        let tally = Counts {
            rates: 1,
            others: 2,
            ..Counts::default()
        };
        assert_eq!(changed_chip(&tally), "1 rate, 2 other");
    }
}
