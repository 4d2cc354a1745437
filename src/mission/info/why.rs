//! The explanation of an element: its evidence, its lifetime, and each piece of evidence with its time and text.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::base::error::{Error, Result};
use crate::base::nearest::nearest;
use crate::base::time::Stamp;
use crate::base::words::{self, visible};
use crate::evidence::EvidenceLine;
use crate::graph::{Edge, Element};
use crate::mission::Mission;

/// The elements with all of `names` (one: a node or topic of that name; two: the edges between them), each
/// with its evidence and lifetime, then the `pieces` in order of time. Plain text, a line each; repeated
/// pieces are written once, with their number. Names are as recorded.
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
        let _ = describe(&mut out, mission, element, &title);
    }
    let at = |time| words::offset(mission.offset(time));
    for said in said(pieces) {
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
    let all = &mission.elements;
    let node = |edge: &Edge| all.nodes[edge.node].name.as_str();
    let topic = |edge: &Edge| all.topics[edge.topic].name.as_str();
    let mut found = Vec::new();
    if let [name] = names {
        let nodes = all
            .nodes
            .with_ids()
            .filter(|(_, n)| n.name.as_str() == name);
        found.extend(nodes.map(|(id, n)| (Element::Node(id), format!("node {}", n.name))));
        let topics = all
            .topics
            .with_ids()
            .filter(|(_, t)| t.name.as_str() == name);
        found.extend(topics.map(|(id, t)| (Element::Topic(id), format!("topic {}", t.name))));
        return found;
    }
    let is_asked = |edge: &&Edge| names.iter().all(|n| n == node(edge) || n == topic(edge));
    let edges = all.edges().filter(|(_, e)| is_asked(e));
    found.extend(edges.map(|(what, e)| {
        let verb = match what {
            Element::Publish(_) => "publishes",
            _ => "subscribes to",
        };
        (what, format!("{} {verb} {}", node(e), topic(e)))
    }));
    found
}

fn describe(
    out: &mut String,
    mission: &Mission,
    element: Element,
    title: &str,
) -> std::fmt::Result {
    let all = &mission.elements;
    let seen = all.seen(element);
    let at = |time: Option<Stamp>| {
        time.map_or_else(
            || "?".to_owned(),
            |time| words::offset(mission.offset(time)),
        )
    };
    let words: Vec<&str> = seen.evidence.words().collect();
    let signs = match (seen.first, seen.last) {
        (None, None) => "no times of its own".to_owned(),
        (first, last) => format!("first sign {}, last sign {}", at(first), at(last)),
    };
    writeln!(
        out,
        "{}\n  evidence: {}; {signs}",
        visible(title),
        words.join(", ")
    )?;
    let windows = mission.graphs.rows(element).count();
    writeln!(
        out,
        "  present in {windows} of {} parts of the mission",
        mission.windows.len()
    )
}

/// The largest number of similar names that are offered: a hint is one line.
const OFFERED: usize = 5;

fn unknown(mission: &Mission, names: &[String]) -> Error {
    let all = &mission.elements;
    let nodes = || all.nodes.iter().map(|n| n.name.as_str());
    let known = || nodes().chain(all.topics.iter().map(|t| t.name.as_str()));
    let Some(name) = names
        .iter()
        .find(|name| known().all(|known| known != *name))
    else {
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
    let last = |name: &str| name.rsplit('/').next().unwrap_or_default().to_lowercase();
    let last = last(name);
    let close = known.filter(|known| !last.is_empty() && known.to_lowercase().contains(&last));
    let close: Vec<&str> = close.take(OFFERED).collect();
    if close.is_empty() {
        "`bagreel info` lists every name".to_owned()
    } else {
        format!("similar names: {}", close.join(", "))
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
