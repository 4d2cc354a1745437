//! Notices about what the picture leaves out, about options that match nothing, and the error of a view that shows nothing.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

use super::choose::{Reason, is_params, is_tf};
use super::items::Viewed;
use super::{Hide, NameFilter, ViewOptions};
use crate::base::error::{Error, Result};
use crate::base::ids::grouped;
use crate::base::name::{is_within, namespace};
use crate::base::nearest::nearest;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::words;
use crate::graph::{Elements, Topic};

/// The largest number of names given as examples: a notice is one line of a terminal.
const EXAMPLES: usize = 3;

/// One notice per reason for hiding, with the number of elements hidden. Grouped and collapsed elements are seen as
/// part of their box.
pub(crate) fn notes(elements: &Elements, viewed: &Viewed<'_>, options: &ViewOptions) -> Notices {
    let selection = &viewed.selection;
    let reasons = selection.nodes.iter().chain(&selection.topics);
    let reasoned = reasons.zip(names(elements).into_iter().flatten());
    let hidden = grouped(reasoned.filter_map(|(reason, name)| Some(((*reason)?, name))));
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
fn words(reason: Reason) -> (&'static str, String) {
    let (what, hidden) = match reason {
        Reason::NsFilter => ("nodes outside `--ns-filter`", None),
        Reason::TopicFilter => ("topics outside `--topic-filter`", None),
        Reason::Orphan => ("topics without a node inside `--ns-filter`", None),
        Reason::Leaf => ("topics with a single connection", Some("leaf")),
        Reason::Dead => ("topics without a subscriber", Some("dead")),
        Reason::Tf => ("transforms", Some("tf")),
        Reason::Params => ("topics of parameters", Some("params")),
        Reason::Services => ("services", Some("services")),
        Reason::Debug => ("debugging elements", Some("debug")),
        Reason::Quiet => ("housekeeping", Some("quiet")),
        Reason::Recorder => ("recorder and player", Some("quiet")),
    };
    let how = match hidden {
        None => "widen the filter to see them".to_owned(),
        Some("quiet") => "`--hide none` shows them".to_owned(),
        Some(word) => format!("`--hide` without `{word}` shows them"),
    };
    (what, how)
}

fn examples(names: &[&str]) -> String {
    let some = names.iter().take(EXAMPLES);
    let mut list: Vec<Cow<'_, str>> = some.map(|n| words::shorten(n, 60)).collect();
    if names.len() > EXAMPLES {
        list.push("…".into());
    }
    list.join(", ")
}

/// The names of all nodes, and of all topics.
fn names(elements: &Elements) -> [Vec<&str>; 2] {
    let nodes = elements.nodes.iter().map(|n| n.name.as_str());
    let topics = elements.topics.iter().map(|t| t.name.as_str());
    [nodes.collect(), topics.collect()]
}

/// The error of a view without any of these elements.
pub(crate) fn nothing(elements: &Elements) -> Error {
    let all = words::count(elements.nodes.len() + elements.topics.len(), "name");
    let what = format!("nothing is left to draw of {all}");
    Error::usage(what, "show more with `--hide none` or wider filters")
}

/// Checks that each filter of names matches an element.
///
/// # Errors
/// [`Error::Usage`] for one that matches none.
pub(crate) fn check_filters(elements: &Elements, options: &ViewOptions) -> Result<()> {
    let [nodes, topics] = names(elements);
    let unfit = none_pass("--ns-filter", &options.ns_filter, &nodes);
    let unfit = unfit.or_else(|| none_pass("--topic-filter", &options.topic_filter, &topics));
    unfit.map_or(Ok(()), Err)
}

/// The error of a filter that none of these names passes.
pub(crate) fn none_pass(flag: &str, filter: &NameFilter, names: &[&str]) -> Option<Error> {
    let passes = |name: &&str| filter.passes(name);
    let is_unfit = !filter.passes_all() && !names.is_empty() && !names.iter().any(passes);
    is_unfit.then(|| {
        let many = words::count(names.len(), "name");
        let what = format!("`{flag}` matches none of {many}");
        Error::usage(what, meant(&filter.wanted(), names))
    })
}

/// Notices about the names and patterns in these options that match nothing.
pub(crate) fn unmatched(elements: &Elements, options: &ViewOptions) -> Vec<Notice> {
    let [nodes, topics] = names(elements);
    let both: Vec<&str> = nodes.iter().chain(&topics).copied().collect();
    let without = |spaces: &[Arc<str>]| -> Vec<String> {
        let is_in = |name: &&str, space: &str| is_within(name, space.trim_end_matches('/'));
        let is_used = |space: &&Arc<str>| both.iter().any(|name| is_in(name, space));
        let unused = spaces.iter().filter(|space| !is_used(space));
        unused.map(ToString::to_string).collect()
    };
    let unused = options.ns_filter.unused(&nodes);
    let mut notices = unmatched_by("--ns-filter", "node", &unused, &nodes);
    notices.extend(unmatched_topics(&options.topic_filter, &topics));
    let spaces = [
        ("--collapse", &options.collapse),
        ("--collapse -", &options.expand),
    ];
    for (flag, spaces) in spaces {
        notices.extend(unmatched_by(flag, "name", &without(spaces), &both));
    }
    notices.extend(not_hidden(elements, options.hide));
    notices
}

/// Notices about the parts of a topic filter that match none of these names.
pub(crate) fn unmatched_topics(filter: &NameFilter, names: &[&str]) -> Vec<Notice> {
    unmatched_by("--topic-filter", "topic", &filter.unused(names), names)
}

/// Notices about the parts of an option that match none of these names.
fn unmatched_by(flag: &str, what: &str, unused: &[String], names: &[&str]) -> Vec<Notice> {
    let notice = |text: &String| {
        let meant = meant(&[text.trim_start_matches('-')], names);
        // A filter's syntax is not accepted for namespaces.
        let meant = meant.split(": ").next().unwrap_or_default();
        let space = if flag.ends_with('-') { "" } else { " " };
        let text = format!("`{flag}{space}{text}` matches no {what}; {meant}");
        Notice::new(NoticeKind::Note, text)
    };
    unused.iter().map(notice).collect()
}

/// Notices about kinds of topics to hide of which the mission has none.
fn not_hidden(elements: &Elements, hide: Hide) -> Vec<Notice> {
    let is_default = hide == ViewOptions::rqt_defaults().hide;
    let names: BTreeSet<&str> = elements.topics.iter().map(|t| t.name.as_str()).collect();
    let params = |topic: &Topic| is_params(topic.name.as_str(), |other| names.contains(other));
    let tf = |topic: &Topic| is_tf(topic.name.as_str());
    let has = |is_one: &dyn Fn(&Topic) -> bool| elements.topics.iter().any(is_one);
    let unused = [
        ("tf", hide.tf && !has(&tf)),
        ("params", hide.params && !is_default && !has(&params)),
        ("services", hide.services && !has(&Topic::is_service)),
    ];
    let unused = unused.iter().filter(|(_, is_unused)| *is_unused);
    let text = |word| format!("`--hide {word}` leaves nothing out; the mission has no such topic");
    unused
        .map(|(word, _)| Notice::new(NoticeKind::Note, text(word)))
        .collect()
}

/// The name or namespace nearest to a requested one, else some existing ones.
fn meant(wanted: &[&str], names: &[&str]) -> String {
    let mut known: BTreeSet<&str> = names.iter().copied().collect();
    for name in names {
        let mut space = namespace(name);
        while space.len() > 1 {
            known.insert(space);
            space = namespace(space);
        }
    }
    let plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '/');
    let near = wanted.iter().find_map(|wanted| {
        let end = wanted.find(|c| !plain(c)).unwrap_or(wanted.len());
        let name = wanted.get(..end)?.trim_end_matches('/');
        nearest(name, known.iter().copied())
    });
    match near {
        Some(name) if names.contains(&name) => format!("the nearest name is `{name}`"),
        Some(space) => {
            format!("the nearest namespace is `{space}`: `{space}/.*` matches all of it")
        }
        None => {
            // Those of unknown nodes contain spaces, and cannot be meant.
            let names: Vec<&str> = names.iter().copied().filter(|n| !n.contains(' ')).collect();
            format!("there are {}", words::some_of(&names, 3))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{Hide, NameFilter, ViewOptions, outline, view};

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

    #[test]
    fn kinds_that_the_mission_lacks_are_reported() {
        let mission = mission(&["/a>/tf /a>/t"]);
        let reported = |hide: Hide| {
            let options = ViewOptions {
                hide,
                ..ViewOptions::default()
            };
            let notices = unmatched(&mission.elements, &options);
            notices
                .into_iter()
                .map(|notice| notice.text)
                .collect::<Vec<_>>()
        };
        assert_eq!(
            reported(Hide::parse("tf,services").unwrap()),
            ["`--hide services` leaves nothing out; the mission has no such topic"]
        );
        assert!(reported(ViewOptions::rqt_defaults().hide).is_empty());
        assert!(reported(Hide::default()).is_empty());
    }

    fn hint(filter: &str) -> String {
        let options = ViewOptions {
            ns_filter: NameFilter::parse(filter).unwrap(),
            ..ViewOptions::default()
        };
        let mission = mission(&["/robot1/nav/planner>/robot1/plan /robot1/amcl</robot1/plan"]);
        assert!(outline(&mission, &options).items.is_empty(), "{filter}");
        check_filters(&mission.elements, &options)
            .unwrap_err()
            .hint()
    }

    #[test]
    fn names_without_a_match_are_reported_with_the_nearest() {
        let options = ViewOptions {
            ns_filter: NameFilter::parse("/robot1/.*,-/rviz").unwrap(),
            topic_filter: NameFilter::parse("/robot1/plam").unwrap(),
            collapse: vec!["/robot1/nav".into(), "/robot2".into()],
            ..ViewOptions::default()
        };
        let mission = mission(&["/robot1/nav/planner>/robot1/plan"]);
        let reported = unmatched(&mission.elements, &options);
        let reported: Vec<&str> = reported.iter().map(|notice| notice.text.as_str()).collect();
        assert_eq!(
            reported,
            [
                "`--ns-filter -/rviz` matches no node; there are /robot1/nav/planner",
                "`--topic-filter /robot1/plam` matches no topic; the nearest name is `/robot1/plan`",
                "`--collapse /robot2` matches no name; the nearest namespace is `/robot1`",
            ]
        );
    }

    #[test]
    fn the_nearest_name_or_namespace_is_suggested() {
        assert_eq!(
            hint("/robt1/.*"),
            "the nearest namespace is `/robot1`: `/robot1/.*` matches all of it"
        );
        assert_eq!(hint("/robot1/aml"), "the nearest name is `/robot1/amcl`");
        assert_eq!(
            hint("/somewhere/else"),
            "there are /robot1/amcl and /robot1/nav/planner"
        );
    }
}
