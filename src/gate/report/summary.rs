//! A summary in Markdown for a pull request or a job: its first line is the outcome, its table lists the findings
//! with their times, a Mermaid flow chart shows missing, new or changed elements and their neighbours.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::{Group, Subject, cell, grouped};
use crate::base::words;
use crate::export::markdown::{block, code, cut, folded, plain, row, table};
use crate::export::mermaid::escaped;
use crate::gate::facts::Facts;
use crate::gate::finding::{Finding, FindingKind, Severity};
use crate::gate::judge::{Judgement, Verdict};
use crate::graph::Edge;

/// The most bytes of each part; with a chart they stay below 256 KiB, a quarter of the limit of a job's summary.
const MOST_ROWS: usize = 96 << 10;
const MOST_LISTED: usize = 24 << 10;
/// The number of findings that are expanded; the rest is collapsed.
const SHOWN: usize = 12;
/// The largest number of causes that are reported.
const CAUSES: usize = 3;

/// The report; ends in a new line.
pub(super) fn write(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let findings = verdict.findings();
    let facts = Facts::new(subject.mission);
    let of_severity = |severities: &[Severity]| -> Vec<&Finding> {
        let own = findings.iter().filter(|f| severities.contains(&f.severity));
        own.copied().collect()
    };
    let broken = of_severity(&[Severity::Error, Severity::Warning]);
    let mut out = headline(subject, verdict) + "\n\n";
    // The most severe first, then those with the most consequences.
    let mut groups = grouped(&broken);
    let worst = |group: &Group<'_>| group.findings.first().map(|finding| finding.severity);
    groups.sort_by_key(|group| (worst(group), Reverse(group.findings.len())));
    causes(&groups, &mut out);
    findings_table(&facts, &groups, &mut out);
    if let Some(chart) = chart(&facts, &broken) {
        let chart = block("mermaid", chart.trim_end());
        out += &folded("Graph around the changes", &chart);
    }
    if broken.iter().any(|f| f.accept.is_some()) {
        let command = block("sh", &subject.accept(&BTreeSet::new()));
        out += &folded("Accept these changes", &command);
    }
    undecidable(&of_severity(&[Severity::Unknown]), &mut out);
    let (bag, file) = (mark(&subject.name()), mark(&subject.tracked));
    let _ = writeln!(out, "<!-- bagreel:{bag}:{file} -->");
    out
}

/// The first line: the outcome in short.
fn headline(subject: &Subject<'_>, verdict: &Verdict) -> String {
    let mission = subject.mission;
    let any = |severity| verdict.count(severity) > 0;
    let sign = if any(Severity::Error) {
        "❌"
    } else if any(Severity::Warning) {
        "⚠"
    } else if verdict.is_blind() {
        "❔"
    } else {
        "✅"
    };
    let kept = words::count(verdict.facts(Judgement::Kept), "rule");
    let mut parts = verdict.counts();
    parts.push(format!("{kept} passed"));
    format!(
        "### {sign} Graph check: {} · {} against {} · {} in windows of {}",
        parts.join(", "),
        code(&subject.name()),
        code(&subject.tracked),
        words::duration(mission.span.nanos()),
        words::period(mission.period.nanos())
    )
}

/// Writes the causes of several findings, those of most findings first.
fn causes(groups: &[Group<'_>], out: &mut String) {
    let several = groups.iter().filter(|group| group.findings.len() > 1);
    let several = several.filter_map(|group| Some((group.cause?, group.findings.len())));
    let several: Vec<(&str, usize)> = several.collect();
    for (cause, many) in several.iter().take(CAUSES) {
        let many = words::count(*many, "finding");
        let _ = writeln!(out, "- **{}**: {many}", plain(cause));
    }
    match several.len() {
        0 => {}
        n if n > CAUSES => {
            let _ = writeln!(out, "- and {} more such causes\n", n - CAUSES);
        }
        _ => out.push('\n'),
    }
}

/// Writes the table of findings, those of one cause one after the other.
fn findings_table(facts: &Facts<'_>, groups: &[Group<'_>], out: &mut String) {
    let rows = groups.iter().flat_map(|group| {
        let is_alone = group.findings.len() == 1;
        let rows = group.findings.iter();
        rows.map(move |f| finding_row(facts, f, is_alone))
    });
    let mut rows: Vec<String> = rows.collect();
    let left_out = cut(&mut rows, MOST_ROWS);
    let (shown, rest) = rows.split_at(rows.len().min(SHOWN));
    let heads = ["", "what", "when", "seen", "expected"];
    if !shown.is_empty() {
        let _ = writeln!(out, "{}", table(&heads, shown));
    }
    if !rest.is_empty() {
        let summary = format!("{} more", rest.len() + left_out);
        *out += &folded(&summary, &table(&heads, rest));
    }
    if left_out > 0 {
        let _ = writeln!(out, "{left_out} left out.\n");
    }
}

fn finding_row(facts: &Facts<'_>, finding: &Finding, is_alone: bool) -> String {
    let is_error = finding.severity == Severity::Error;
    let sign = if is_error { "❌" } else { "⚠" };
    let when = match finding.when {
        Some(span) => facts.stretch(span),
        None if finding.kind == FindingKind::NodeLifecycle => "at the end".to_owned(),
        None => "–".to_owned(),
    };
    let since = match &finding.cause {
        Some(cause) if is_alone && !cause.is_about(&finding.name) => {
            format!(", since {}", plain(&cause.text))
        }
        _ => String::new(),
    };
    // Pull requests are skimmed: the kind instead of the whole sentence.
    let word = finding.kind.word();
    let short = word.strip_prefix("node-").or(word.strip_prefix("topic-"));
    let what = short.unwrap_or(word).replace('-', " ");
    row(&[
        sign.to_owned(),
        format!("{} {what}", code(&finding.name)),
        when + &since,
        cell(&finding.seen, value),
        cell(&finding.expected, value),
    ])
}

/// A value: names as code, other words unchanged.
fn value(text: &str) -> String {
    let is_name = text.starts_with('/');
    if is_name { code(text) } else { plain(text) }
}

/// Writes the findings that are not observable.
fn undecidable(findings: &[&Finding], out: &mut String) {
    if findings.is_empty() {
        return;
    }
    let mut hinted = BTreeSet::new();
    let lines = findings.iter().map(|finding| {
        // Hints apply to all findings of a kind.
        let fresh = finding.help.iter().filter(|help| hinted.insert(*help));
        let help: Vec<String> = fresh.map(|help| format!(": {}", plain(help))).collect();
        format!("- {}{}\n", plain(&finding.text), help.concat())
    });
    let mut lines: Vec<String> = lines.collect();
    match cut(&mut lines, MOST_LISTED) {
        0 => {}
        n => lines.push(format!("- {n} more left out\n")),
    }
    let summary = format!("What this bag cannot tell: {}", findings.len());
    *out += &folded(&summary, &lines.concat());
}

/// A marker comment by which an action finds its earlier text, without characters that end the comment.
fn mark(name: &str) -> String {
    let harmless = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.');
    let mut mark = name.replace(|c| !harmless(c), "_");
    for ending in [".mcap", ".bag", ".db3", ".yaml", ".yml"] {
        mark.truncate(mark.trim_end_matches(ending).len());
    }
    mark.chars().take(100).collect()
}

/// The most edges that are drawn.
const MOST_EDGES: usize = 60;
/// The most boxes that are drawn.
const MOST_ITEMS: usize = 80;
/// The largest size of the boxes in bytes; Mermaid draws no chart of more than 50,000 characters.
const MOST_BOXES: usize = 36 << 10;
/// The largest number of characters of a name; a longer one is cut.
const LONGEST: usize = 80;

/// A box of the chart: whether it is a topic, and its name.
type ChartBox<'a> = (bool, &'a str);

/// An arrow from box to box in Mermaid's notation; one that is expected and missing is dotted.
type Arrow<'a> = (ChartBox<'a>, &'static str, ChartBox<'a>);

/// The chart; `None` if no finding is about the graph. Ends with a newline.
fn chart(facts: &Facts<'_>, findings: &[&Finding]) -> Option<String> {
    let mut marked: BTreeMap<ChartBox<'_>, &Finding> = BTreeMap::new();
    for finding in findings.iter().filter(|f| !f.kind.row().class.is_empty()) {
        let own = (!finding.kind.is_about_node(), finding.name.as_str());
        marked.entry(own).or_insert(finding);
    }
    let arrows = arrows(facts, &marked, findings);
    let ends = arrows.iter().flat_map(|(from, _, to)| [*from, *to]);
    let mut boxes: BTreeSet<ChartBox<'_>> = ends.collect();
    boxes.extend(marked.keys().take(MOST_ITEMS));
    (!boxes.is_empty()).then(|| written(&boxes, &marked, &arrows))
}

/// The arrows that are missing, then those of marked boxes.
fn arrows<'a>(
    facts: &Facts<'a>,
    marked: &BTreeMap<ChartBox<'_>, &Finding>,
    findings: &[&'a Finding],
) -> Vec<Arrow<'a>> {
    let missing = findings.iter().filter_map(|finding| {
        let (node, topic) = ((false, &*finding.expected), (true, &*finding.name));
        match finding.kind {
            FindingKind::PublisherMissing => Some((node, "-.->", topic)),
            FindingKind::SubscriberMissing => Some((topic, "-.->", node)),
            _ => None,
        }
    });
    let elements = &facts.mission.elements;
    let ends = |edge: &Edge| {
        let node = (false, facts.role(edge.node));
        let topic = (true, facts.topic(edge.topic));
        let is_marked = marked.contains_key(&node) || marked.contains_key(&topic);
        let is_named = !edge.seen.evidence.is_guess();
        let is_robots = !facts.is_tool(&[edge.node]) && !facts.is_housekeeping(edge.topic);
        (is_marked && is_named && is_robots).then_some((node, topic))
    };
    let sent = elements.publishes.iter().filter_map(ends);
    let sent = sent.map(|(node, topic)| (node, "-->", topic));
    let received = elements.subscribes.iter().filter_map(ends);
    let received = received.map(|(node, topic)| (topic, "-->", node));
    let mut seen = BTreeSet::new();
    let all = missing.chain(sent).chain(received);
    let all = all.filter(|(from, _, to)| seen.insert((*from, *to)));
    all.take(MOST_EDGES).collect()
}

fn written(
    boxes: &BTreeSet<ChartBox<'_>>,
    marked: &BTreeMap<ChartBox<'_>, &Finding>,
    arrows: &[Arrow<'_>],
) -> String {
    let mut place: BTreeMap<&ChartBox<'_>, usize> = BTreeMap::new();
    let mut out = String::from("flowchart LR\n");
    // Marked boxes before their neighbours.
    let is_marked = |own: &&ChartBox<'_>| marked.contains_key(own);
    let (mut order, rest): (Vec<&ChartBox<'_>>, Vec<&ChartBox<'_>>) =
        boxes.iter().partition(is_marked);
    order.extend(rest);
    for (at, own) in order.into_iter().enumerate() {
        let (open, close) = if own.0 { ("[", "]") } else { ("([", "])") };
        let mark = marked.get(own);
        let name = words::shorten(own.1, LONGEST);
        let has_values = |mark: &&&Finding| {
            use FindingKind::{NodeLifecycle, TopicRateHigh, TopicRateLow};
            matches!(mark.kind, TopicRateLow | TopicRateHigh | NodeLifecycle)
        };
        let more = mark.filter(has_values).map_or_else(String::new, |mark| {
            format!("{} → {}", mark.expected, mark.seen)
        });
        let text = escaped(format!("{name} {more}").trim_end());
        let class = mark.map_or_else(String::new, |mark| format!(":::{}", mark.kind.row().class));
        let line = format!("  i{at}{open}\"{text}\"{close}{class}\n");
        if out.len() + line.len() > MOST_BOXES {
            break;
        }
        out.push_str(&line);
        place.insert(own, at);
    }
    for (from, line, to) in arrows {
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
