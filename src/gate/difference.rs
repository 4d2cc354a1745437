//! The differences between two missions: in nodes, topics and edges, in rates, and in the events and their order.

mod elements;
mod happened;
mod pairs;
mod report;
mod sending;
mod union;

use super::facts::Facts;
use crate::mission::Mission;

pub(crate) use pairs::pairs;
pub use report::{DiffFormat, DiffSubject};
pub(crate) use union::{Side, union};

/// Which of two missions contain an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Where {
    /// Only in the first.
    First,
    /// Only in the second.
    Second,
    /// In both, but different.
    Both,
}

impl Where {
    /// The side of what only the first mission has, or only the second.
    fn only(is_first: bool) -> Self {
        if is_first { Self::First } else { Self::Second }
    }
}

/// One difference.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Difference {
    /// The kind of thing: `node`, `topic`, `publishes`, `subscribes`, `type`, `rate`, …
    pub kind: &'static str,
    /// The name of the node or topic it is about, or both names of an edge.
    pub name: String,
    /// The node or topic, or both as in `name`; the name of an event contains more.
    pub element: String,
    /// The missions that contain it.
    pub side: Where,
    /// The value in the first mission; empty for none.
    pub first: String,
    /// The value in the second mission; empty for none.
    pub second: String,
    /// Whether it is observable in both missions. An element without evidence in one is not absent from it.
    pub is_known: bool,
}

impl Difference {
    /// A difference in something that only one mission has.
    fn only(kind: &'static str, name: impl Into<String>, side: Where, what: &str) -> Self {
        let (first, second) = match side {
            Where::Second => (String::new(), what.to_owned()),
            _ => (what.to_owned(), String::new()),
        };
        Self {
            side,
            ..Self::changed(kind, name, first, second)
        }
    }

    /// A difference in something that both missions have with different values.
    fn changed(
        kind: &'static str,
        name: impl Into<String>,
        first: impl Into<String>,
        second: impl Into<String>,
    ) -> Self {
        let name = name.into();
        Self {
            kind,
            element: name.clone(),
            name,
            side: Where::Both,
            first: first.into(),
            second: second.into(),
            is_known: true,
        }
    }
}

/// All differences: elements, then events, then times of topics. A rate must differ by more than the fraction
/// `rate_change`, and significantly.
pub(crate) fn differences(first: &Mission, second: &Mission, rate_change: f64) -> Vec<Difference> {
    let (a, b) = (Facts::new(first), Facts::new(second));
    let mut all = elements::differences(&a, &b, rate_change);
    all.extend(happened::differences(&a, &b));
    if a.is_rewritten() || b.is_rewritten() {
        // Senders are unknown there, and so are ends and restarts of nodes.
        let lost = ["publishes", "end", "restarts", "event"];
        for one in all.iter_mut().filter(|d| lost.contains(&d.kind)) {
            one.is_known = false;
        }
    }
    let times = sending::times(&a, &b, &all);
    // A topic that ends earlier is also silent.
    let ends = |d: &Difference| {
        times
            .iter()
            .any(|t| t.kind == "end" && t.element == d.element)
    };
    all.retain(|d| !(d.kind == "event" && d.name.ends_with(" silent") && ends(d)));
    all.extend(times);
    all
}
