//! The mission as one dynamic graph in GEXF 1.2 (<https://gexf.net>), with the times at which each element exists.
//!
//! Nodes of the mission and its topics are nodes, publications and subscriptions edges; each has a spell per
//! lifetime, in seconds from the mission's start, and its rate over time.

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

/// Attributes of nodes and edges: number, name, type.
const ATTRIBUTES: [(&str, &str, &str); 4] = [
    ("0", "kind", "string"),
    ("1", "degree", "string"),
    ("2", "evidence", "string"),
    ("3", "messages", "long"),
];

fn text(mission: &Mission) -> String {
    let (nodes, edges) = parts(mission);
    let mut xml = Xml::with_capacity(1 << 16);
    xml.raw("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    xml.open("gexf")
        .attribute("xmlns", "http://www.gexf.net/1.2draft")
        .attribute("version", "1.2");
    xml.open("meta").open("creator").text("bagreel").close();
    let from = format!("seconds from {}", mission.span.start);
    xml.open("description").text(&from).close().close();
    xml.open("graph")
        .attribute("mode", "dynamic")
        .attribute("defaultedgetype", "directed")
        .attribute("timeformat", "double");
    attributes(&mut xml, "node");
    attributes(&mut xml, "edge");
    xml.open("nodes");
    for node in &nodes {
        xml.open("node")
            .attribute("id", &node.id)
            .attribute("label", &node.label);
        inside(&mut xml, mission, node);
    }
    xml.close().open("edges");
    for edge in &edges {
        let (source, target) = &edge.ends;
        xml.open("edge")
            .attribute("id", &edge.id)
            .attribute("source", source)
            .attribute("target", target)
            .attribute("label", &edge.label);
        inside(&mut xml, mission, edge);
    }
    xml.close().close().close().raw("\n");
    xml.finish()
}

fn attributes(xml: &mut Xml, class: &str) {
    let mode = |xml: &mut Xml, mode: &str| {
        xml.open("attributes")
            .attribute("class", class)
            .attribute("mode", mode);
    };
    let one = |xml: &mut Xml, (id, title, kind): (&str, &str, &str)| {
        xml.open("attribute")
            .attribute("id", id)
            .attribute("title", title)
            .attribute("type", kind)
            .close();
    };
    mode(xml, "static");
    for attribute in ATTRIBUTES {
        one(xml, attribute);
    }
    xml.close();
    mode(xml, "dynamic");
    one(xml, ("4", "hz", "double"));
    xml.close();
}

/// Values and spells of a node or edge, and its end.
fn inside(xml: &mut Xml, mission: &Mission, part: &SpellOf) {
    let second = |at| mission.offset(at) as f64 / 1e9;
    let messages = part.messages.map(|n| n.to_string());
    let values = [
        Some(part.kind),
        Some(part.confidence.word()),
        Some(part.evidence.as_str()),
        messages.as_deref(),
    ];
    xml.open("attvalues");
    for ((id, ..), value) in ATTRIBUTES.iter().zip(values) {
        if let Some(value) = value {
            xml.open("attvalue")
                .attribute("for", id)
                .attribute("value", value)
                .close();
        }
    }
    for (span, hz) in &part.rates {
        xml.open("attvalue")
            .attribute("for", "4")
            .attribute("value", hz)
            .attribute("start", second(span.start))
            .attribute("end", second(span.end))
            .close();
    }
    xml.close().open("spells");
    for span in &part.spells {
        xml.open("spell")
            .attribute("start", second(span.start))
            .attribute("end", second(span.end))
            .close();
    }
    xml.close().close().raw("\n");
}
