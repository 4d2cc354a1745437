//! The words on the picture: rates, counts, and what an element is.

use crate::view::{Counts, Shown};

/// A rate as short as it can be read: `50 Hz`, `7.4 Hz`, `0.25 Hz`, `1.2 kHz`.
pub(crate) fn hz(rate: f64) -> String {
    let (value, unit) = split(rate);
    format!("{value} {unit}")
}

/// A rate that changed: `15 → 7.4 Hz`.
pub(crate) fn hz_change(from: f64, to: f64) -> String {
    let ((a, from_unit), (b, unit)) = (split(from), split(to));
    if from_unit == unit {
        format!("{a} → {b} {unit}")
    } else {
        format!("{a} {from_unit} → {b} {unit}")
    }
}

fn split(rate: f64) -> (String, &'static str) {
    if !rate.is_finite() || rate <= 0.0 {
        return ("0".to_owned(), "Hz");
    }
    match rate {
        r if r >= 999.5 => (decimals(r / 1000.0), "kHz"),
        r => (decimals(r), "Hz"),
    }
}

/// Whole from 10 on, a tenth from 1 on, two significant digits below.
fn decimals(value: f64) -> String {
    let text = match value {
        v if v >= 9.95 => return format!("{v:.0}"),
        v if v >= 0.995 => format!("{v:.1}"),
        v if v >= 0.0995 => format!("{v:.2}"),
        v if v >= 0.000_995 => format!("{v:.3}"),
        _ => return "<0.001".to_owned(),
    };
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// `1 node`, `3 nodes`.
pub(crate) fn count(n: usize, word: &str) -> String {
    if n == 1 {
        format!("1 {word}")
    } else {
        format!("{n} {word}s")
    }
}

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

/// A share as a whole percentage: `25` for 0.25.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.0}", share * 100.0)
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
        (Some(from), Some(to)) => parts.push(hz_change(from, to)),
        (None, Some(rate)) if rate > 0.0 => parts.push(hz(rate)),
        _ => {}
    }
    if let Some(n) = shown.count.filter(|n| *n > 0) {
        parts.push(format!("{n} messages"));
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
    fn rates_are_short() {
        let all = [
            0.0, 0.0001, 0.004, 0.05, 0.25, 1.0, 7.4, 9.96, 14.6, 100.0, 1200.0, 48_000.0,
        ]
        .map(hz);
        assert_eq!(
            all,
            [
                "0 Hz",
                "<0.001 Hz",
                "0.004 Hz",
                "0.05 Hz",
                "0.25 Hz",
                "1 Hz",
                "7.4 Hz",
                "10 Hz",
                "15 Hz",
                "100 Hz",
                "1.2 kHz",
                "48 kHz"
            ]
        );
        assert_eq!(hz(f64::NAN), "0 Hz");
        assert_eq!(hz_change(15.0, 7.4), "15 → 7.4 Hz");
        assert_eq!(hz_change(900.0, 1200.0), "900 Hz → 1.2 kHz");
    }

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
