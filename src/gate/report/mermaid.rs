//! The graph around findings, as a Mermaid flow chart: missing, new or changed elements, and their neighbours.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use crate::export::mermaid::escaped;
use crate::gate::facts::Facts;
use crate::gate::finding::{Finding, FindingKind};
use crate::graph::Edge;

/// The most edges that are drawn.
const MOST_EDGES: usize = 60;
/// The most boxes that are drawn.
const MOST_ITEMS: usize = 80;
/// The largest size of the boxes in bytes; Mermaid draws no chart of more than 50,000 characters.
const MOST_BOXES: usize = 36 << 10;
/// The largest number of characters of a name; a longer one is cut.
const LONGEST: usize = 80;

/// A box: whether it is a topic, and its name.
type MermaidBox<'a> = (bool, &'a str);

/// What happened to a box.
#[derive(Clone, Copy, PartialEq, Eq)]
enum BoxChange {
    Gone,
    New,
    Changed,
}

/// The chart; `None` if no finding is about the graph. Ends with a newline.
pub(super) fn chart(facts: &Facts<'_>, findings: &[&Finding]) -> Option<String> {
    let mut marked: BTreeMap<MermaidBox<'_>, (BoxChange, String)> = BTreeMap::new();
    for finding in findings {
        if let Some((item, class)) = class(finding) {
            marked.entry(item).or_insert((class, label(finding)));
        }
    }
    let edges = edges(facts, &marked, findings);
    let mut items: BTreeSet<MermaidBox<'_>> = edges.iter().flat_map(|(a, b, _)| [*a, *b]).collect();
    items.extend(marked.keys().take(MOST_ITEMS));
    if items.is_empty() {
        return None;
    }
    Some(written(&items, &marked, &edges))
}

fn class(finding: &Finding) -> Option<(MermaidBox<'_>, BoxChange)> {
    let class = match finding.kind {
        FindingKind::NodeMissing | FindingKind::NodeGone | FindingKind::TopicMissing => {
            BoxChange::Gone
        }
        FindingKind::UnexpectedNode
        | FindingKind::UnexpectedTopic
        | FindingKind::NodeForbidden
        | FindingKind::TopicForbidden => BoxChange::New,
        FindingKind::OrderBroken
        | FindingKind::ReactionMissing
        | FindingKind::TooManyChanges
        | FindingKind::AllowUnused => {
            return None;
        }
        _ => BoxChange::Changed,
    };
    Some(((!finding.kind.is_about_node(), &finding.name), class))
}

/// The text after the name in its box: the expected and the observed value.
fn label(finding: &Finding) -> String {
    match finding.kind {
        FindingKind::TopicRateLow | FindingKind::TopicRateHigh | FindingKind::NodeLifecycle => {
            format!("{} → {}", finding.expected, finding.seen)
        }
        _ => String::new(),
    }
}

/// The edges of marked boxes, and those that are missing; the latter first, and dotted (true).
fn edges<'a>(
    facts: &Facts<'a>,
    marked: &BTreeMap<MermaidBox<'_>, (BoxChange, String)>,
    findings: &[&'a Finding],
) -> Vec<(MermaidBox<'a>, MermaidBox<'a>, bool)> {
    let mut all = Vec::new();
    for finding in findings {
        match finding.kind {
            FindingKind::PublisherMissing => {
                all.push((
                    (false, finding.expected.as_str()),
                    (true, finding.name.as_str()),
                    true,
                ));
            }
            FindingKind::SubscriberMissing => {
                all.push((
                    (true, finding.name.as_str()),
                    (false, finding.expected.as_str()),
                    true,
                ));
            }
            _ => {}
        }
    }
    let elements = &facts.mission.elements;
    let ends = |edge: &Edge| {
        (
            (false, facts.role(edge.node)),
            (true, facts.topic(edge.topic)),
        )
    };
    let touches = |(node, topic): &(MermaidBox<'_>, MermaidBox<'_>), edge: &Edge| {
        let own = marked.contains_key(node) || marked.contains_key(topic);
        let is_named = !edge.seen.evidence.is_guess();
        own && is_named && !facts.is_tool(&[edge.node]) && !facts.is_housekeeping(edge.topic)
    };
    for edge in &elements.publishes {
        let (node, topic) = ends(edge);
        if touches(&(node, topic), edge) {
            all.push((node, topic, false));
        }
    }
    for edge in &elements.subscribes {
        let (node, topic) = ends(edge);
        if touches(&(node, topic), edge) {
            all.push((topic, node, false));
        }
    }
    let mut seen = BTreeSet::new();
    all.retain(|(a, b, _)| seen.insert((*a, *b)));
    all.truncate(MOST_EDGES);
    all
}

fn written(
    items: &BTreeSet<MermaidBox<'_>>,
    marked: &BTreeMap<MermaidBox<'_>, (BoxChange, String)>,
    edges: &[(MermaidBox<'_>, MermaidBox<'_>, bool)],
) -> String {
    let mut place: BTreeMap<&MermaidBox<'_>, usize> = BTreeMap::new();
    let mut out = String::from("flowchart LR\n");
    // Marked boxes before their neighbours.
    let (mut order, rest): (Vec<&MermaidBox<'_>>, Vec<&MermaidBox<'_>>) =
        items.iter().partition(|i| marked.contains_key(i));
    order.extend(rest);
    for item in order {
        let at = place.len();
        let (open, close) = if item.0 { ("[", "]") } else { ("([", "])") };
        let mark = marked.get(item);
        let name = crate::base::words::shorten(item.1, LONGEST);
        let more = mark.map_or("", |(_, label)| label);
        let text = escaped(format!("{name} {more}").trim_end());
        let class = match mark {
            Some((BoxChange::Gone, _)) => ":::gone",
            Some((BoxChange::New, _)) => ":::new",
            Some((BoxChange::Changed, _)) => ":::changed",
            None => "",
        };
        let line = format!("  i{at}{open}\"{text}\"{close}{class}\n");
        if out.len() + line.len() > MOST_BOXES {
            break;
        }
        out.push_str(&line);
        place.insert(item, at);
    }
    for (from, to, is_missing) in edges {
        let line = if *is_missing { "-.->" } else { "-->" };
        if let (Some(from), Some(to)) = (place.get(from), place.get(to)) {
            // Writing into a string does not fail.
            let _ = writeln!(out, "  i{from} {line} i{to}");
        }
    }
    // Colours that work on light and dark pages.
    out.push_str("  classDef gone stroke:#d1242f,stroke-width:3px,stroke-dasharray:6 4\n");
    out.push_str("  classDef new stroke:#1a7f37,stroke-width:3px\n");
    out.push_str("  classDef changed stroke:#bf8700,stroke-width:3px\n");
    out
}
