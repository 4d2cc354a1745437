//! A folder with a document per node in the node definition language `NoDL` 2:
//! <https://github.com/ros-tooling/nodl/tree/main/nodl_schema/nodl_schema/schemas>.
//!
//! The schema requires a type for every endpoint and a quality of service for every topic: an endpoint of
//! unknown type is omitted, an unknown quality of service is `SYSTEM_DEFAULT`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;

use super::tables::folder::{Folder, file_stem};
use super::{Started, Written, at_end};
use crate::base::error::{Error, Result};
use crate::base::words;
use crate::evidence::Confidence;
use crate::evidence::source::qos::{depth, policy};
use crate::export::sequence::Sequence;
use crate::export::target::Target;
use crate::graph::{Element, NodeId, PerElement, Topic};
use crate::mission::Mission;

/// Refuses standard output, and a file per window.
///
/// # Errors
/// [`Error::Usage`] for both.
pub(crate) fn check(target: &Target) -> Result<()> {
    if *target == Target::Stdout {
        let what = "NoDL has a document per node, which does not fit on standard output";
        return Err(Error::usage(what, "give a folder: `-o nodl/`"));
    }
    target.must_be_one("a document describes a node over the whole mission")
}

/// Begins the folder.
///
/// # Errors
/// As [`check`].
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    check(target)?;
    let target = target.clone();
    Ok(at_end(move || {
        let mut written = Written::to(&target);
        let mut folder = Folder::create(target.path())?;
        let (documents, untyped) = documents(sequence.data, sequence.options.has_inferred);
        for (name, text) in documents {
            let mut file = folder.file(format!("{}.nodl.yaml", file_stem(&name)));
            let to = target.path().join(&name);
            file.write_all(text.as_bytes())
                .map_err(Error::io("write", &to))?;
            written.add(text.len() as u64);
        }
        folder.commit()?;
        if untyped > 0 {
            let ends = words::count(untyped, "end");
            let remark = format!("{ends} of unknown type omitted, since NoDL requires a type");
            written.remarks.push(remark);
        }
        Ok(written)
    }))
}

/// The lists of endpoints in a document, in its order.
const LISTS: [&str; 6] = [
    "publishers",
    "subscriptions",
    "service_servers",
    "service_clients",
    "action_servers",
    "action_clients",
];

/// Topics for which every node has an endpoint.
const FRAMEWORK: [&str; 3] = ["/rosout", "/rosout_agg", "/parameter_events"];

/// The documents by the names of their nodes, and the number of endpoints that do not fit the schema.
fn documents(mission: &Mission, has_inferred: bool) -> (BTreeMap<String, String>, usize) {
    let elements = &mission.elements;
    let confidences = mission.graphs.confidences(elements);
    let is_known = |what: Element| {
        let is_sure = confidences.of(what) != Some(&Confidence::Inferred);
        !elements.evidence(what).is_guess() && (has_inferred || is_sure)
    };
    let mut lists: BTreeMap<NodeId, [String; 6]> = BTreeMap::new();
    for (id, node) in elements.nodes.with_ids() {
        if is_known(Element::Node(id)) && !node.records() {
            lists.insert(id, Default::default());
        }
    }
    let mut untyped = 0;
    for (what, edge) in elements.edges().filter(|(what, _)| is_known(*what)) {
        let topic = &elements.topics[edge.topic];
        let Some(lists) = lists.get_mut(&edge.node) else {
            continue;
        };
        match end(what, topic, &confidences) {
            Some((list, text)) => lists[list].push_str(&text),
            None if is_part(topic) => {}
            None => untyped += 1,
        }
    }
    let documents = lists.into_iter().map(|(id, lists)| {
        let name = elements.nodes[id].name.to_string();
        let mut text = "nodl_version: 2\n".to_owned();
        for (key, list) in LISTS
            .iter()
            .zip(&lists)
            .filter(|(_, list)| !list.is_empty())
        {
            // Writing to a string cannot fail.
            let _ = write!(text, "{key}:\n{list}");
        }
        (name, text)
    });
    (documents.collect(), untyped)
}

/// Whether a topic is housekeeping of the framework, or a part of an action that its feedback represents.
fn is_part(topic: &Topic) -> bool {
    let name = topic.name.as_str();
    FRAMEWORK.contains(&name) || name.contains("/_action/") && !name.ends_with("/_action/feedback")
}

/// The list for an endpoint of a topic, and its entry; `None` if it belongs to no list or does not fit the
/// schema.
fn end(
    what: Element,
    topic: &Topic,
    confidences: &PerElement<Confidence>,
) -> Option<(usize, String)> {
    if is_part(topic) {
        return None;
    }
    let name = topic.name.as_str();
    let kind = topic.types.first()?;
    let is_sent = matches!(what, Element::Publish(_));
    let (name, kind, list) = match name.strip_suffix("/_action/feedback") {
        Some(action) => (
            action,
            kind.strip_suffix("_FeedbackMessage")?,
            4 + usize::from(!is_sent),
        ),
        None if topic.is_service() => (name, &**kind, 2 + usize::from(is_sent)),
        None => (name, &**kind, usize::from(!is_sent)),
    };
    if !is_name(name) || !is_type(kind) {
        return None;
    }
    let mut text = format!("  - name: {name}\n    type: {kind}\n");
    if list < 2 {
        let offered = topic.qos.as_deref().filter(|_| is_sent);
        let _ = writeln!(text, "    qos: {{{}}}", quality(offered));
    }
    let confidence = confidences
        .of(what)
        .map_or("", |confidence| confidence.word());
    let _ = writeln!(text, "    description: {confidence}");
    Some((list, text))
}

/// A quality of service; only one that all publishers of the topic offer is known.
fn quality(offered: Option<&str>) -> String {
    let offered = offered.filter(|words| !words.contains(','));
    let word = |known, words: [&'static str; 2]| policy(offered, known).map(|at| words[at]);
    let history = match (depth(offered), word(["keep_all"; 2], ["KEEP_ALL"; 2])) {
        (Some(depth @ 1..), _) => format!("KEEP_LAST, depth: {depth}"),
        (_, history) => history.unwrap_or("SYSTEM_DEFAULT").to_owned(),
    };
    let reliability = word(["reliable", "best_effort"], ["RELIABLE", "BEST_EFFORT"]);
    let durability = word(
        ["transient_local", "volatile"],
        ["TRANSIENT_LOCAL", "VOLATILE"],
    );
    let reliability = reliability.unwrap_or("SYSTEM_DEFAULT");
    let durability = durability.map_or_else(String::new, |word| format!(", durability: {word}"));
    format!("history: {history}, reliability: {reliability}{durability}")
}

/// Whether the schema accepts the name of a topic, a service or an action.
fn is_name(name: &str) -> bool {
    let is_inside = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '/');
    let rest = name.strip_prefix('/').unwrap_or_default();
    !rest.is_empty() && !rest.ends_with('/') && rest.chars().all(is_inside)
}

/// Whether the schema accepts the type: `package/msg/Name` or `package/Name`.
fn is_type(kind: &str) -> bool {
    let parts: Vec<&str> = kind.split('/').collect();
    let ([package, own] | [package, "msg" | "srv" | "action", own]) = parts[..] else {
        return false;
    };
    let begins = |text: &str, is: fn(&char) -> bool| text.chars().next().is_some_and(|c| is(&c));
    begins(package, char::is_ascii_alphabetic)
        && package
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '_')
        && begins(own, char::is_ascii_uppercase)
        && own.chars().all(|c| c.is_ascii_alphanumeric())
}
