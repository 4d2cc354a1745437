//! The notices about elements that the picture leaves out, one per reason, with the option that shows them.

use std::collections::BTreeMap;

use super::ViewOptions;
use super::items::Viewed;
use super::select::Reason;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::words;
use crate::graph::Elements;

/// The largest number of names given as examples.
const EXAMPLES: usize = 3;

/// One notice per reason for hiding, with the number of elements hidden. Grouped and collapsed elements are seen as
/// part of their box.
pub(crate) fn notes(elements: &Elements, viewed: &Viewed, options: &ViewOptions) -> Notices {
    let nodes = elements.nodes.iter().map(|n| n.name.as_str());
    let topics = elements.topics.iter().map(|t| t.name.as_str());
    let reasons = viewed
        .selection
        .nodes
        .iter()
        .chain(&viewed.selection.topics);
    let mut hidden: BTreeMap<Reason, Vec<&str>> = BTreeMap::new();
    for (name, reason) in nodes.chain(topics).zip(reasons) {
        if let Some(reason) = reason {
            hidden.entry(*reason).or_default().push(name);
        }
    }
    let mut notices = Notices::new();
    for (reason, mut names) in hidden {
        names.sort_unstable();
        names.dedup();
        let (what, how) = words(reason);
        let text = format!("{what} left out ({}): {how}", examples(&names));
        add(&mut notices, names.len(), text);
    }
    if options.hide.unreachable {
        let text = "nodes are left out of windows in which they are silent: `--hide` without `unreachable` shows them";
        add(&mut notices, 1, text.to_owned());
    }
    if viewed.dropped > 0 {
        let text =
            "arrows from node to node left out, too many to read: `--mode all` shows the topics";
        add(&mut notices, viewed.dropped, text.to_owned());
    }
    notices
}

fn add(notices: &mut Notices, count: usize, text: String) {
    notices.add(Notice::counted(NoticeKind::Hidden, count as u64, text));
}

/// The words for the elements left out for a reason, and the option that shows them.
fn words(reason: Reason) -> (&'static str, &'static str) {
    match reason {
        Reason::NsFilter => (
            "nodes outside `--ns-filter`",
            "widen the filter to see them",
        ),
        Reason::TopicFilter => (
            "topics outside `--topic-filter`",
            "widen the filter to see them",
        ),
        Reason::Orphan => (
            "topics without a node inside `--ns-filter`",
            "widen the filter to see them",
        ),
        Reason::Leaf => (
            "topics with a single connection",
            "`--hide` without `leaf` shows them",
        ),
        Reason::Dead => (
            "topics without a subscriber",
            "`--hide` without `dead` shows them",
        ),
        Reason::Tf => ("transforms", "`--hide` without `tf` shows them"),
        Reason::Params => (
            "topics of parameters",
            "`--hide` without `params` shows them",
        ),
        Reason::Services => ("services", "`--hide` without `services` shows them"),
        Reason::Debug => ("debugging elements", "`--hide` without `debug` shows them"),
        Reason::Quiet => ("housekeeping", "`--hide none` shows them"),
        Reason::Recorder => ("recorder and player", "`--hide none` shows them"),
    }
}

fn examples(names: &[&str]) -> String {
    let mut list: Vec<String> = names
        .iter()
        .take(EXAMPLES)
        .map(|n| words::shorten(n, 60).into_owned())
        .collect();
    if names.len() > EXAMPLES {
        list.push("…".to_owned());
    }
    list.join(", ")
}

#[cfg(test)]
mod tests {
    use crate::view::testing::mission;
    use crate::view::{Hide, NameFilter, ViewOptions, view};

    /// The notices, each as `count text`.
    fn reported(window: &str, options: &ViewOptions) -> Vec<String> {
        let (_, notices) = view(&mission(&[window]), options);
        notices
            .iter()
            .map(|n| format!("{} {}", n.count, n.text))
            .collect()
    }

    #[test]
    fn hidden_elements_are_reported() {
        let window = "/a>/clock /a>/rosout /record_7</t /a>/t /b/x</t";
        assert_eq!(
            reported(window, &ViewOptions::default()),
            [
                "2 housekeeping left out (/clock, /rosout): `--hide none` shows them",
                "1 recorder and player left out (/record_7): `--hide none` shows them",
            ]
        );
        let all = ViewOptions {
            hide: Hide::NONE,
            ..ViewOptions::default()
        };
        assert!(reported(window, &all).is_empty());
        let narrow = ViewOptions {
            hide: Hide::NONE,
            ns_filter: NameFilter::parse("/b/.*").unwrap(),
            ..ViewOptions::default()
        };
        assert_eq!(
            reported(window, &narrow),
            [
                "2 nodes outside `--ns-filter` left out (/a, /record_7): widen the filter to see them",
                "2 topics without a node inside `--ns-filter` left out (/clock, /rosout): widen the filter to see them",
            ]
        );
    }
}
