//! The explanation of an element: who sends and receives it, and when; then its evidence, each piece with its time and text.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use crate::base::error::{Error, Result};
use crate::base::name::{is_named, is_quiet, last_part};
use crate::base::nearest::nearest;
use crate::base::time::Stamp;
use crate::base::words::{self, visible};
use crate::evidence::EvidenceLine;
use crate::graph::{Edge, Element};
use crate::mission::Mission;
use crate::mission::event_log::{Event, Kind, LogFormat, LogRow, row_lines};

/// The elements with all of `names` (one: a node or topic of that name; two: the edges between them), each with the answer
/// and its kinds of evidence, then the `pieces` in order of time, the recorder's last. Plain text, a line each; repeated
/// pieces are written once, with their number. Names are as recorded; `/probe` also means every anonymous node
/// `/probe_PID_MILLISECONDS`.
///
/// # Errors
/// [`Error::Usage`] if the mission has no such element, naming similar ones.
pub fn why(mission: &Mission, names: &[String], pieces: &[EvidenceLine]) -> Result<String> {
    let found = elements(mission, names);
    if found.is_empty() {
        return Err(unknown(mission, names));
    }
    let mut out = String::new();
    for (element, title) in found {
        // Writing to a string cannot fail.
        let _ = describe(&mut out, mission, (element, &title), pieces);
    }
    let at = |time| words::offset(mission.offset(time));
    let tools = mission.elements.nodes.iter().filter(|node| node.is_tool());
    let tools: Vec<&str> = tools.map(|node| node.name.as_str()).collect();
    let is_tool = |text: &str| tools.iter().any(|name| text.starts_with(*name));
    let mut all = said(pieces);
    all.sort_by_key(|said| is_tool(&said.piece.text));
    for said in all {
        let piece = said.piece;
        let first = piece.time.map_or_else(|| "always".to_owned(), at);
        let again = match said.last {
            Some(last) if said.count > 1 => format!(" ({}×, until {})", said.count, at(last)),
            _ => String::new(),
        };
        let _ = writeln!(
            out,
            "{first:>12}  {:<18} {:<9} {}{again}",
            piece.source,
            piece.confidence.word(),
            visible(&piece.text)
        );
    }
    Ok(out)
}

/// A piece of evidence with its repetitions.
struct Repeated<'a> {
    /// The first occurrence.
    piece: &'a EvidenceLine,
    count: usize,
    /// The time of the last occurrence.
    last: Option<Stamp>,
}

/// Merges pieces that only differ in time, in order of first occurrence.
fn said(pieces: &[EvidenceLine]) -> Vec<Repeated<'_>> {
    let mut all: Vec<Repeated<'_>> = Vec::new();
    let mut places = BTreeMap::new();
    for piece in pieces {
        let key = (piece.source, piece.confidence, piece.text.as_str());
        let place = *places.entry(key).or_insert(all.len());
        match all.get_mut(place) {
            Some(said) => {
                said.count += 1;
                said.last = said.last.max(piece.time);
            }
            None => all.push(Repeated {
                piece,
                count: 1,
                last: piece.time,
            }),
        }
    }
    all
}

/// The elements with these names, each with a description.
fn elements(mission: &Mission, names: &[String]) -> Vec<(Element, String)> {
    let titled = mission.elements.all().filter_map(|what| {
        let (node, topic) = mission.elements.names(what);
        let own = [node, topic];
        let is_asked = |asked: &String| own.iter().flatten().any(|name| is_named(name, asked));
        let title = match (what, node, topic) {
            (Element::Publish(_), Some(node), Some(topic)) => format!("{node} publishes {topic}"),
            (_, Some(node), Some(topic)) => format!("{node} subscribes to {topic}"),
            (_, node, topic) => format!("{} {}", what.word(), node.or(topic)?),
        };
        (what.is_edge() == (names.len() > 1) && names.iter().all(is_asked)).then_some((what, title))
    });
    titled.collect()
}

fn describe(
    out: &mut String,
    mission: &Mission,
    (element, title): (Element, &str),
    pieces: &[EvidenceLine],
) -> std::fmt::Result {
    let seen = mission.elements.seen(element);
    let at = |time: Stamp| words::offset(mission.offset(time));
    let words = words::joined(seen.evidence.words(), ", ");
    let signs = match seen.first.zip(seen.last) {
        None => "no times of its own".to_owned(),
        Some((first, last)) => format!("first sign {}, last sign {}", at(first), at(last)),
    };
    writeln!(out, "{}", visible(title))?;
    for line in answer(mission, element, pieces) {
        writeln!(out, "  {}", visible(&line))?;
    }
    writeln!(out, "  evidence: {words}; {signs}")
}

/// The most names in a line of the answer, the most times of each, and the most log records before an end.
const NAMES: usize = 12;
const TIMES: usize = 3;
const LOGS: usize = 3;
/// The time before an end of a node, and after it, in which its warnings may explain it.
const LOGGED_NS: (i64, i64) = (60_000_000_000, 5_000_000_000);

/// Who publishes and receives a topic, and when; when a node ran, and its topics; then what happened.
fn answer(mission: &Mission, element: Element, pieces: &[EvidenceLine]) -> Vec<String> {
    let all = &mission.elements;
    let peers = |publishes: bool, of: &dyn Fn(&Edge) -> bool, name: &dyn Fn(&Edge) -> String| {
        let edges = all.edges().filter(|(what, edge)| {
            let is_shown = !edge.seen.evidence.is_guess() && !all.nodes[edge.node].is_tool();
            of(edge) && is_shown && matches!(what, Element::Publish(_)) == publishes
        });
        let named = edges.map(|(what, edge)| {
            let start = all.seen(what).lives.first().map(|life| life.start);
            let text = format!("{} {}", name(edge), when(mission, what));
            (start, text.trim_end().to_owned())
        });
        let mut named: Vec<_> = named.collect();
        named.sort();
        let named = named.into_iter().map(|(_, text)| text);
        Some(words::some_of(named, NAMES)).filter(|named| !named.is_empty())
    };
    let mut lines = match element {
        Element::Topic(id) => {
            let node = |edge: &Edge| all.nodes[edge.node].name.to_string();
            let of = |edge: &Edge| edge.topic == id;
            let unnamed = all.topics[id].unknown_publishers.filter(|n| *n > 0);
            let unnamed = unnamed.map(|n| words::count(n as usize, "unnamed node"));
            let senders = [peers(true, &of, &node), unnamed].into_iter().flatten();
            let senders = words::joined(senders, ", and by ");
            let receivers = peers(false, &of, &node).unwrap_or_default();
            let [senders, receivers] = [senders, receivers].map(|known| match known {
                nobody if nobody.is_empty() => "no known node".to_owned(),
                known => known,
            });
            vec![
                format!("published by {senders}"),
                format!("received by {receivers}"),
            ]
        }
        Element::Node(id) => {
            let topic = |edge: &Edge| all.topics[edge.topic].name.to_string();
            let of =
                |edge: &Edge| edge.node == id && !is_quiet(all.topics[edge.topic].name.as_str());
            let listed =
                [("publishes", true), ("subscribes to", false)].map(|(verb, publishes)| {
                    peers(publishes, &of, &topic).map(|topics| format!("{verb} {topics}"))
                });
            let mut lines = vec![format!("ran {}", when(mission, element))];
            lines.extend(listed.into_iter().flatten());
            lines
        }
        edge => vec![when(mission, edge)],
    };
    lines.extend(happened(mission, element, pieces));
    lines
}

/// The changes of an element and of its connections as lines of the log, those of which they are a part instead of them, and the last
/// warnings of a node before each of its ends.
fn happened(mission: &Mission, element: Element, pieces: &[EvidenceLine]) -> Vec<String> {
    let (elements, events) = (&mission.elements, &mission.log.events);
    let is_own = |event: &Event| {
        let (node, topic) = elements.ends(event.what);
        let (node, topic) = (node.map(Element::Node), topic.map(Element::Topic));
        let is_end = event.part_of.is_none() && [node, topic].contains(&Some(element));
        (event.what == element || is_end) && !event.quiet
    };
    let mut shown = BTreeSet::new();
    let mut rows = Vec::new();
    let mut own = Vec::new();
    for (id, event) in events.with_ids().filter(|(_, event)| is_own(event)) {
        let head = event.part_of.unwrap_or(id);
        let whole = events.get(head).filter(|_| shown.insert(head));
        rows.extend(whole.map(|whole| LogRow::Event(head, whole)));
        own.push((event, whole.is_some()));
    }
    let mut heads = row_lines(mission, &rows, LogFormat::Text).into_iter();
    let mut lines = Vec::new();
    for (event, is_first) in own {
        let head = if is_first { heads.next() } else { None };
        lines.extend(head.map(|head| head.text(None).trim_end().to_owned()));
        if let (Element::Node(id), Kind::Stopped | Kind::Restarted) = (event.what, event.kind) {
            // One that restarted under another name logged under its old one.
            let role = &elements.nodes[id].role;
            lines.extend(logged(mission, role, event.time, pieces));
        }
    }
    lines
}

/// When an element existed: `00:38–02:56`, `04:59–` to the end, `throughout`.
fn when(mission: &Mission, what: Element) -> String {
    let at = |time: Stamp| words::offset_seconds(mission.offset(time));
    let whole = mission.span;
    let lives = mission.elements.seen(what).lives.iter().map(|life| {
        let from = Some(life.start).filter(|at| *at > whole.start).map(at);
        let to = Some(life.end).filter(|at| *at < whole.end).map(at);
        match (from, to) {
            (None, None) => "throughout".to_owned(),
            (from, to) => format!("{}–{}", from.unwrap_or_default(), to.unwrap_or_default()),
        }
    });
    words::some_of(lives, TIMES)
}

/// The last warnings and errors that a node logged before an end; if it logs, and none of them, a line that says so.
fn logged(mission: &Mission, role: &str, end: Stamp, pieces: &[EvidenceLine]) -> Vec<String> {
    let mut logs = false;
    let own = pieces.iter().filter_map(|piece| {
        let (logger, text) = piece.text.split_once(" logs ")?;
        let is_child = |part: &str| part.starts_with('/');
        let is_own = is_named(logger, role) || logger.strip_prefix(role).is_some_and(is_child);
        logs |= is_own;
        let is_near = |time: &Stamp| (-LOGGED_NS.0..=LOGGED_NS.1).contains(&time.since(end));
        let time = piece.time.filter(is_near)?;
        let mut warnings = ["WARN:", "ERROR:", "FATAL:"].iter();
        let is_warning = warnings.any(|word| text.starts_with(word));
        let at = words::offset_tenths(mission.offset(time));
        (is_own && is_warning).then(|| format!("{at:>13}    {text}"))
    });
    let mut own: Vec<String> = own.collect();
    own.dedup();
    if logs && own.is_empty() {
        return vec![format!("{:17}no warning or error in the minute before", "")];
    }
    own.split_off(own.len().saturating_sub(LOGS))
}

/// The largest number of similar names that are offered: a hint is one line.
const OFFERED: usize = 5;

fn unknown(mission: &Mission, names: &[String]) -> Error {
    let all = &mission.elements;
    let nodes = || all.nodes.iter().flat_map(|n| [n.name.as_str(), &*n.role]);
    let known = || nodes().chain(all.topics.iter().map(|t| t.name.as_str()));
    let is_unknown = |name: &&String| known().all(|known| known != *name);
    let Some(name) = names.iter().find(is_unknown) else {
        let what = format!("nothing connects `{}`", names.join("` and `"));
        return Error::usage(what, "`--why NAME` explains one of them");
    };
    let hint = match nearest(name, known()) {
        Some(near) => format!("the nearest name is `{near}`"),
        None => similar(name, known()),
    };
    Error::usage(format!("there is no node or topic `{name}`"), hint)
}

/// The hint for a name unlike any other in its spelling: names that contain its last part.
fn similar<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    let last = last_part(name).to_lowercase();
    let close = known.filter(|known| !last.is_empty() && known.to_lowercase().contains(&last));
    let close: BTreeSet<&str> = close.collect();
    match words::joined(close.into_iter().take(OFFERED), ", ") {
        none if none.is_empty() => "`bagreel info` lists every name".to_owned(),
        some => format!("similar names: {some}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::Confidence;

    #[test]
    fn repeated_evidence_is_listed_once() {
        let piece = |time, text: &str| EvidenceLine {
            time: Some(Stamp(time)),
            source: "rosout",
            confidence: Confidence::Stated,
            text: text.to_owned(),
        };
        let pieces = [piece(1, "hello"), piece(2, "more"), piece(3, "hello")];
        let said = said(&pieces);
        let reported: Vec<_> = said
            .iter()
            .map(|s| (s.piece.text.as_str(), s.count, s.last))
            .collect();
        assert_eq!(
            reported,
            [("hello", 2, Some(Stamp(3))), ("more", 1, Some(Stamp(2)))]
        );
    }
}
