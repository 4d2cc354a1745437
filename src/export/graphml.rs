//! The union of all windows as one graph in `GraphML` (<http://graphml.graphdrawing.org>).

use super::spells::{SpellOf, parts};
use super::{Sequence, Started, one_text};
use crate::draw::paint::xml::Xml;
use crate::export::target::Target;
use crate::mission::Mission;

/// Begins the graph.
///
/// # Errors
/// A name with `{n}`.
pub(crate) fn start<'a>(sequence: &'a Sequence<'a>, target: &Target) -> Started<'a> {
    one_text(target, || text(sequence.data))
}

/// The attributes of nodes and edges: name and type. Times are seconds from the mission's start.
const KEYS: [(&str, &str); 7] = [
    ("label", "string"),
    ("kind", "string"),
    ("degree", "string"),
    ("evidence", "string"),
    ("messages", "long"),
    ("first_s", "double"),
    ("last_s", "double"),
];

fn text(mission: &Mission) -> String {
    let (nodes, edges) = parts(mission);
    let mut xml = Xml::with_capacity(1 << 16);
    xml.raw("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    xml.open("graphml")
        .attribute("xmlns", "http://graphml.graphdrawing.org/xmlns");
    for (name, kind) in KEYS {
        xml.open("key")
            .attribute("id", name)
            .attribute("for", "all")
            .attribute("attr.name", name)
            .attribute("attr.type", kind)
            .close();
    }
    xml.open("graph").attribute("edgedefault", "directed");
    for node in &nodes {
        xml.open("node").attribute("id", &node.id);
        inside(&mut xml, mission, node);
    }
    for edge in &edges {
        let (source, target) = &edge.ends;
        xml.open("edge")
            .attribute("id", &edge.id)
            .attribute("source", source)
            .attribute("target", target);
        inside(&mut xml, mission, edge);
    }
    xml.close().close().raw("\n");
    xml.finish()
}

/// Writes the attributes of a node or edge, and its closing tag.
fn inside(xml: &mut Xml, mission: &Mission, part: &SpellOf) {
    let second = |at| (mission.offset(at) as f64 / 1e9).to_string();
    let values = [
        Some(part.label.clone()),
        Some(part.kind.to_owned()),
        Some(part.confidence.word().to_owned()),
        Some(part.evidence.clone()),
        part.messages.map(|n| n.to_string()),
        part.spells.first().map(|span| second(span.start)),
        part.spells.last().map(|span| second(span.end)),
    ];
    for ((key, _), value) in KEYS.iter().zip(values) {
        if let Some(value) = value {
            xml.open("data").attribute("key", key).text(&value).close();
        }
    }
    xml.close().raw("\n");
}
