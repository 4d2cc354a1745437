//! Reads missions in JSON: our own, or a graph over time that another tool wrote with the same keys.
//!
//! Required are `schema`, the windows' times and the elements' names; other missing values are unknown, unknown keys
//! are ignored. Changes are determined by the events; a mission without any is left for [`Mission::find_changes`].

use std::path::Path;

use super::names::{Names, graph};
use super::raw::{BagJson, ElementJson, NodeJson, NoticeJson, PublishJson, Raw, TopicJson};
use super::sending::sending;
use super::write::{OLD_SCHEMAS, RUNS, SCHEMA};
use crate::bag::{Report, Tier};
use crate::base::error::{Error, Result};
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::{Period, Span, Stamp};
use crate::graph::{ColumnWriter, Element, Elements, Graphs, GraphsWriter};
use crate::mission::{Mission, Window};

/// Reads a mission in JSON; `path` is only used in errors.
///
/// # Errors
/// [`Error::BadFile`] with the line for text that is not JSON or lacks these keys, for another schema, and for windows
/// that are not in order of time.
pub fn read_json(text: &str, path: &Path) -> Result<Mission> {
    let hint = "`bagreel render BAG -o x.json` writes a mission";
    let bad = |line: usize, reason: String| Error::bad_file(path, line, reason, hint);
    let unread = |e: serde_json::Error| {
        let reason = e.to_string();
        // The error names the place itself.
        let end = reason.rfind(" at line ").unwrap_or(reason.len());
        bad(e.line(), reason[..end].to_owned())
    };
    let mut raw: Raw = serde_json::from_str(text).map_err(unread)?;
    if raw.schema != SCHEMA && !OLD_SCHEMAS.contains(&&*raw.schema) {
        return Err(bad(0, format!("schema `{}` is not `{SCHEMA}`", raw.schema)));
    }
    let spans = spans(&raw).map_err(|reason| bad(0, reason))?;
    let events = raw.events.take().or(raw.ledger.take());
    let phases = super::events::phases(std::mem::take(&mut raw.phases));
    let interruptions = super::events::interruptions(&raw.interruptions);
    let mut mission = build(raw, &spans).map_err(|reason| bad(0, reason))?;
    if let Some(rows) = events {
        let events = super::events::read(&rows, &mission.elements);
        let nothing = || {
            bad(
                0,
                "an event refers to an element that is in no window".to_owned(),
            )
        };
        mission.log.events = events.ok_or_else(nothing)?;
        mission.log.phases = phases;
        mission.log.interruptions = interruptions;
        mission.explain();
    }
    Ok(mission)
}

/// The times of the windows, checked.
fn spans(raw: &Raw) -> Result<Vec<Span>, String> {
    if raw.windows.is_empty() {
        return Err("it has no windows".to_owned());
    }
    let spans: Vec<Span> = raw
        .windows
        .iter()
        .map(|w| Span::new(Stamp(w.start_ns), Stamp(w.end_ns)))
        .collect();
    for (index, span) in spans.iter().enumerate() {
        if span.start >= span.end {
            return Err(format!("window {index} ends before it starts"));
        }
        if index > 0 && spans[index - 1].start > span.start {
            return Err(format!("window {index} starts before the previous one"));
        }
    }
    Ok(spans)
}

fn build(mut raw: Raw, spans: &[Span]) -> Result<Mission, String> {
    for element in std::mem::take(&mut raw.elements) {
        match element {
            ElementJson::Node(node) => raw.nodes.push(node),
            ElementJson::Topic(topic) => raw.topics.push(topic),
            ElementJson::Publish(edge) => raw.publishes.push(edge),
            ElementJson::Subscribe(edge) => raw.subscribes.push(edge),
        }
    }
    let mut names = Names::default();
    for w in &raw.windows {
        names.elements(&w.nodes, &w.topics, &w.publishes, &w.subscribes);
    }
    names.elements(&raw.nodes, &raw.topics, &raw.publishes, &raw.subscribes);
    let elements = names.placed();
    let start = spans.iter().map(|s| s.start).min().unwrap_or_default();
    let end = spans.iter().map(|s| s.end).max().unwrap_or_default();
    let span = Span::new(
        raw.start_ns.map_or(start, Stamp).min(start),
        raw.end_ns.map_or(end, Stamp).max(end),
    );
    let longest = spans.iter().map(Span::nanos).max().unwrap_or(1);
    let fallback = || Period::from_nanos(longest.max(1));
    let period = raw
        .period_ns
        .and_then(Period::from_nanos)
        .or_else(fallback)
        .unwrap_or(ONE);
    let windows: Vec<Window> = raw
        .windows
        .iter()
        .zip(spans)
        .enumerate()
        .map(|(index, (window, span))| {
            let counts = || {
                window
                    .topics
                    .iter()
                    .filter_map(|t| t.numbers.as_ref()?.count)
                    .fold(0, u64::saturating_add)
            };
            Window {
                index,
                span: *span,
                partial: window.partial.unwrap_or(span.nanos() < period.nanos()),
                messages: window.messages.unwrap_or_else(counts),
                changes: Vec::new(),
                events: Vec::new(),
            }
        })
        .collect();
    let graphs = if raw.form.as_deref() == Some(RUNS) {
        of_columns(&raw, &elements, spans)
    } else {
        let graphs = spans.iter().zip(&raw.windows);
        let graphs = graphs.map(|(span, window)| (*span, graph(window, &elements)));
        graphs.collect()
    };
    Ok(Mission {
        graphs,
        bags: raw.bags.into_iter().map(report).collect(),
        span,
        messages: raw.messages.unwrap_or_else(|| {
            windows
                .iter()
                .map(|w| w.messages)
                .fold(0, u64::saturating_add)
        }),
        period,
        step: raw.step_ns.and_then(Period::from_nanos).unwrap_or(period),
        sending: sending(raw.sending, &raw.topics, &raw.publishes, &elements)?,
        elements,
        windows,
        log: crate::mission::EventLog::default(),
        undrawn: Vec::new(),
        layout: raw.layout,
        notices: notices(raw.notices),
    })
}

const ONE: Period = match Period::from_nanos(1) {
    Some(one) => one,
    None => unreachable!(),
};

/// The graphs of these windows by the elements' columns.
fn of_columns(raw: &Raw, all: &Elements, spans: &[Span]) -> Graphs {
    let ends = |one: &PublishJson<'_>| all.node(&one.node).zip(all.topic(&one.topic));
    let node = |one: &NodeJson<'_>| all.node(&one.name).map(Element::Node);
    let topic = |one: &TopicJson<'_>| all.topic(&one.name).map(Element::Topic);
    let publish = |one| ends(one).and_then(|ends| all.published(ends));
    let subscribe = |one| ends(one).and_then(|ends| all.subscribed(ends));
    let nodes = raw.nodes.iter().map(|one| (node(one), &one.columns));
    let topics = raw.topics.iter().map(|one| (topic(one), &one.columns));
    let publishes = raw.publishes.iter();
    let publishes = publishes.map(|one| (publish(one), &one.edge.columns));
    let subscribes = raw.subscribes.iter();
    let subscribes = subscribes.map(|one| (subscribe(one), &one.edge.columns));
    let listed = nodes.chain(topics).chain(publishes).chain(subscribes);
    let mut found: Vec<_> = listed
        .filter_map(|(what, columns)| what.zip(columns.as_ref()))
        .collect();
    found.sort_by_key(|(what, _)| *what);
    let mut graphs = GraphsWriter::new(spans.to_vec());
    // An element may be listed twice.
    for same in found.chunk_by(|a, b| a.0 == b.0) {
        let mut rows = ColumnWriter::default();
        for (_, columns) in same {
            columns.add(&mut rows, spans.len(), &mut graphs);
        }
        graphs.element(same[0].0, rows);
    }
    graphs.finish()
}

fn report(raw: BagJson<'_>) -> Report {
    Report {
        name: raw.name.into_owned(),
        format: raw.format.into_owned(),
        compression: raw.compression.into_iter().map(Into::into).collect(),
        tier: Tier::from_word(&raw.tier).unwrap_or(Tier::Forward),
        tier_reason: raw.tier_reason.map(Into::into),
        complete: raw.complete.unwrap_or(true),
        bytes_read: 0,
        file_bytes: raw.file_bytes,
        facts: Vec::new(),
    }
}

/// The notices of an earlier run as plain notes: data lost then does not affect this exit code.
fn notices(raw: Vec<NoticeJson<'_>>) -> Notices {
    let mut notices = Notices::new();
    notices.extend(raw.into_iter().map(|n| Notice {
        kind: NoticeKind::from_word(&n.kind).unwrap_or(NoticeKind::Note),
        count: n.count.unwrap_or(1).max(1),
        text: n.text,
    }));
    notices
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::State;
    use crate::mission::write_json;

    const SMALL: &str = r#"{"schema": "bagreel.evolution/1", "future": 1, "windows": [
        {"start_ns": 0, "end_ns": 10, "nodes": [{"name": "/b"}, {"name": "/a", "state": "silent"}],
         "publishes": [{"node": "/b", "topic": "/t", "count": 4}]},
        {"start_ns": 10, "end_ns": 15, "topics": [{"name": "/t", "count": 3}]}]}"#;

    fn read(text: &str) -> Result<Mission> {
        read_json(text, Path::new("x.json"))
    }

    #[test]
    fn only_times_and_names_are_required() {
        let mission = read(SMALL).unwrap();
        let names: Vec<_> = mission
            .elements
            .nodes
            .iter()
            .map(|n| n.name.as_str())
            .collect();
        assert_eq!(names, ["/a", "/b"]);
        assert_eq!(
            mission.graphs.get(0).unwrap().states[0].state,
            State::Silent
        );
        assert_eq!(
            mission.graphs.get(0).unwrap().topics().count(),
            1,
            "an edge brings its ends"
        );
        assert_eq!(
            (mission.period.nanos(), mission.windows[1].partial),
            (10, true)
        );
        assert_eq!(mission.windows[1].messages, 3);
    }

    #[test]
    fn an_error_names_its_line_once() {
        let text = "{\"schema\": \"bagreel.mission/3\",\n\"windows\": 3}";
        let error = read(text).unwrap_err().to_string();
        assert!(
            error.starts_with("`x.json` line 2: invalid type"),
            "{error}"
        );
        assert_eq!(error.matches("line").count(), 1, "{error}");
    }

    #[test]
    fn json_round_trips() {
        let mut first = Vec::new();
        let mut mission = read(SMALL).unwrap();
        mission.find_changes(0.25, &[]);
        write_json(&mission, &mut first).unwrap();
        let mut again = read(std::str::from_utf8(&first).unwrap()).unwrap();
        again.find_changes(0.25, &[]);
        let mut second = Vec::new();
        write_json(&again, &mut second).unwrap();
        assert_eq!(
            String::from_utf8(first).unwrap(),
            String::from_utf8(second).unwrap()
        );
    }

    #[test]
    fn an_element_listed_twice_has_the_windows_of_both() {
        let listed = |window| {
            format!(
                r#"{{"what": "node", "name": "/a", "in": {{"windows": [[{window}, {window}]]}}}}"#
            )
        };
        let text = format!(
            r#"{{"schema": "bagreel.mission/3", "form": "runs", "windows": [{{"start_ns": 0, "end_ns": 10}},
            {{"start_ns": 10, "end_ns": 20}}], "elements": [{}, {}]}}"#,
            listed(0),
            listed(1)
        );
        let mission = read(&text).unwrap();
        let nodes: Vec<usize> = mission.graphs.iter().map(|g| g.nodes().count()).collect();
        assert_eq!(nodes, [1, 1]);
    }

    #[test]
    fn keys_of_schema_2_mean_the_same() {
        let columns = r#""in": {"windows": [[0, 0]], "state": [["silent", 1]]}"#;
        let event = r#"{"kind": "started", "what": "node", "name": "/a", "time_ns": 2}"#;
        let both = r#""form": "runs", "windows": [{"start_ns": 0, "end_ns": 10}]"#;
        let old = format!(
            r#"{{"schema": "bagreel.evolution/2", {both}, "ledger": [{event}],
            "nodes": [{{"name": "/a", "runs": [[2, 10]], {columns}}}],
            "topics": [{{"name": "/t", {columns}}}],
            "publishes": [{{"node": "/a", "topic": "/t", {columns}}}],
            "sending": {{"senders": [{{"topic": "/t", "node": "/a", "latched": true, "stretches": [[2, 9, 8, 1, 1]]}}],
                "pauses": [{{"topic": "/t", "spans": [[3, 5]]}}]}}}}"#
        );
        let new = format!(
            r#"{{"schema": "bagreel.mission/3", {both}, "events": [{event}], "elements": [
            {{"what": "node", "name": "/a", "lives": [[2, 10]], {columns}}},
            {{"what": "topic", "name": "/t", "pauses": [[3, 5]], {columns}}},
            {{"what": "publish", "node": "/a", "topic": "/t", "latched": true, "stretches": [[2, 9, 8, 1, 1]], {columns}}}]}}"#
        );
        let written = |text: &str| {
            let mut bytes = Vec::new();
            write_json(&read(text).unwrap(), &mut bytes).unwrap();
            String::from_utf8(bytes).unwrap()
        };
        let read_anew = written(&new);
        assert_eq!(written(&old), read_anew);
        let compact: String = read_anew.split_whitespace().collect();
        for kept in [
            r#""lives":[[2,10]]"#,
            r#""latched":true,"stretches":[[2,9,8,1,1]]"#,
            r#""pauses":[[3,5]]"#,
            r#""state":"silent""#,
        ] {
            assert!(compact.contains(kept), "{kept}: {read_anew}");
        }
    }

    #[test]
    fn invalid_json_is_refused_with_its_line() {
        let outcome = |text| read(text).unwrap_err().to_string();
        assert!(outcome("{\n\"schema\": 3}").contains("line 2"));
        assert!(outcome(r#"{"schema": "other/9", "windows": []}"#).contains("`other/9`"));
        let back =
            r#"{"schema": "bagreel.evolution/1", "windows": [{"start_ns": 5, "end_ns": 5}]}"#;
        assert!(outcome(back).contains("window 0 ends before it starts"));
    }

    #[test]
    fn impossible_sending_is_refused() {
        let outcome = |sending: &str| {
            let text = SMALL.replace("\"future\": 1", &format!("\"sending\": {sending}"));
            read(&text).map_err(|e| e.to_string())
        };
        let good = r#"{"senders": [{"topic": "/t", "node": "/b", "stretches": [[1, 3, 2, 2, 0], [4, 9, 6, 1, 3]]},
            {"topic": "/other", "node": null, "stretches": []}]}"#;
        let sending = outcome(good).unwrap().sending;
        assert_eq!(sending.senders.len(), 1);
        assert!(sending.senders[0].stretches[1].is_joined);
        let back = outcome(&good.replace("[4, 9", "[2, 9")).unwrap_err();
        assert!(back.contains("`/t` do not ascend"), "{back}");
        assert!(outcome(&good.replace("[1, 3, 2", "[1, 3, 0")).is_err());
    }
}
