//! DOT as `rqt_graph` saves it: ellipses are nodes, boxes are topics, and labels are the names. Without a label the
//! escaped identifier is decoded (`t___scan` is the topic `/scan`).

use std::collections::BTreeMap;
use std::path::Path;

use super::{NamedElement, Topology, TopologyEntry, place, resolved};
use crate::base::error::{Error, Result};

const HINT: &str = "save it from rqt_graph with `Save as DOT`";

/// A word of DOT with its line.
struct DotToken {
    line: usize,
    text: String,
    /// Whether it is a name or string, not a punctuation mark.
    word: bool,
}

/// The meaning of an identifier: a node or a topic; `None` for a box for several topics.
type Thing = Option<NamedElement>;

/// Attributes by name.
type Attributes = BTreeMap<String, String>;

pub(super) fn read(path: &Path, text: &str) -> Result<Topology> {
    let tokens = tokens(text)
        .map_err(|line| Error::bad_file(path, line, "a string is not terminated", HINT))?;
    if !tokens.iter().any(|t| t.text == "{") {
        return Err(Error::bad_file(path, 1, "it contains no graph", HINT));
    }
    let (things, edges) = statements(&tokens);
    let mut topology = Topology::default();
    let mut add = |element, line| {
        let entry = TopologyEntry::new(element, place(path, line));
        topology.entries.push(entry);
    };
    for (line, thing) in things.values() {
        if let Some(element) = thing {
            add(element.clone(), *line);
        }
    }
    for (line, from, to, attributes) in edges {
        let thing = |id: &String| things.get(id).and_then(|(_, thing)| thing.as_ref());
        match (thing(&from), thing(&to)) {
            (Some(NamedElement::Node(node)), Some(NamedElement::Topic(topic))) => {
                add(NamedElement::Publish(node.clone(), topic.clone()), line);
            }
            (Some(NamedElement::Topic(topic)), Some(NamedElement::Node(node))) => {
                add(NamedElement::Subscribe(node.clone(), topic.clone()), line);
            }
            (Some(NamedElement::Node(a)), Some(NamedElement::Node(b))) => {
                // Nodes only: the topic is the first line of the label.
                let label = attributes.get("label").map_or("", String::as_str);
                let label = label.split("\\n").next().unwrap_or("");
                if label.starts_with('/') {
                    add(NamedElement::Publish(a.clone(), label.to_owned()), line);
                    add(NamedElement::Subscribe(b.clone(), label.to_owned()), line);
                }
            }
            _ => {}
        }
    }
    Ok(topology)
}

/// Identifiers with their meanings, and edges.
type Statements = (
    BTreeMap<String, (usize, Thing)>,
    Vec<(usize, String, String, Attributes)>,
);

/// The statements of all graphs and subgraphs.
fn statements(tokens: &[DotToken]) -> Statements {
    let mut things = BTreeMap::new();
    let mut edges = Vec::new();
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        at += 1;
        let keyword = ["graph", "node", "edge", "digraph", "subgraph", "strict"]
            .contains(&token.text.as_str());
        let next = tokens.get(at).map_or("", |t| t.text.as_str());
        if !token.word || next == "=" {
            // Punctuation, or an attribute of the graph, which is skipped with its value.
            at += if next == "=" { 2 } else { 0 };
            continue;
        }
        if ["graph", "digraph", "subgraph"].contains(&token.text.as_str())
            && tokens.get(at).is_some_and(|t| t.word)
        {
            // The name of a graph.
            at += 1;
        }
        let mut chain = vec![token.text.clone()];
        let is_line = |token: &DotToken| token.text == "->" || token.text == "--";
        while tokens.get(at).is_some_and(is_line) {
            chain.extend(tokens.get(at + 1).map(|t| t.text.clone()));
            at += 2;
        }
        let attributes = attributes(tokens, &mut at);
        if keyword {
            continue;
        }
        if let [id] = &chain[..] {
            let thing = thing(id, &attributes);
            things.entry(id.clone()).or_insert((token.line, thing));
        }
        for pair in chain.windows(2) {
            let [from, to] = [0, 1].map(|at| pair[at].clone());
            edges.push((token.line, from, to, attributes.clone()));
        }
    }
    (things, edges)
}

/// The attributes in brackets at `at`, if there are any.
fn attributes(tokens: &[DotToken], at: &mut usize) -> Attributes {
    let mut all = Attributes::new();
    while tokens.get(*at).is_some_and(|t| t.text == "[" && !t.word) {
        *at += 1;
        while let Some(token) = tokens.get(*at) {
            *at += 1;
            if token.text == "]" && !token.word {
                break;
            }
            if tokens.get(*at).is_some_and(|t| t.text == "=" && !t.word) {
                let value = tokens.get(*at + 1).map_or("", |t| &t.text);
                all.insert(token.text.clone(), value.to_owned());
                *at += 2;
            }
        }
    }
    all
}

fn thing(id: &str, attributes: &Attributes) -> Thing {
    let shape = attributes.get("shape").map_or("", String::as_str);
    let decoded = decoded(id);
    let label = attributes.get("label");
    let label = label.filter(|label| label.starts_with('/'));
    let name = resolved(label.unwrap_or(&decoded));
    match shape {
        "box3d" => None,
        "box" | "rect" | "rectangle" => Some(NamedElement::Topic(name)),
        _ if id.starts_with("t_") && shape.is_empty() => Some(NamedElement::Topic(name)),
        _ => Some(NamedElement::Node(name)),
    }
}

/// The name in an identifier of rqt_graph: `n_` or `t_`, then slashes as `__`.
fn decoded(id: &str) -> String {
    let name = id
        .strip_prefix("n_")
        .or_else(|| id.strip_prefix("t_"))
        .unwrap_or(id);
    name.replace("__", "/")
}

/// The words and punctuation marks of a text; the line of an unterminated string as an error.
fn tokens(text: &str) -> Result<Vec<DotToken>, usize> {
    let mut tokens = Vec::new();
    let mut line = 1;
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let (length, token) = match c {
            '\n' => (1, None),
            c if c.is_whitespace() => (c.len_utf8(), None),
            '#' => (rest.find('\n').unwrap_or(rest.len()), None),
            '/' if rest.starts_with("//") => (rest.find('\n').unwrap_or(rest.len()), None),
            '/' if rest.starts_with("/*") => {
                (rest.find("*/").map_or(rest.len(), |end| end + 2), None)
            }
            '"' => {
                let (len, text) = quoted(rest).ok_or(line)?;
                (len, Some((text, true)))
            }
            '-' if rest.starts_with("->") || rest.starts_with("--") => {
                (2, Some((rest[..2].to_owned(), false)))
            }
            '{' | '}' | '[' | ']' | ';' | ',' | '=' | ':' => (1, Some((c.to_string(), false))),
            _ => {
                let is_end = |(at, c): &(usize, char)| {
                    let is_arrow = *at > 0 && rest[*at..].starts_with("->");
                    is_arrow || c.is_whitespace() || "{}[];,=:\"".contains(*c)
                };
                let end = rest.char_indices().find(is_end);
                let len = end.map_or(rest.len(), |(at, _)| at);
                (len, Some((rest[..len].to_owned(), true)))
            }
        };
        tokens.extend(token.map(|(text, word)| DotToken { line, text, word }));
        line += rest[..length].matches('\n').count();
        rest = &rest[length..];
    }
    Ok(tokens)
}

/// A string in quotes: its length in the text, and its value.
fn quoted(text: &str) -> Option<(usize, String)> {
    let mut said = String::new();
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            '"' if !escaped => return Some((at + 1, said)),
            '\\' if !escaped => {
                escaped = true;
                continue;
            }
            '"' => said.push('"'),
            '\n' if escaped => {}
            c if escaped => said.extend(['\\', c]),
            c => said.push(c),
        }
        escaped = false;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn elements(text: &str) -> Vec<NamedElement> {
        let mut topology = read(Path::new("g.dot"), text).unwrap();
        topology.entries.sort();
        topology.entries.into_iter().map(|e| e.element).collect()
    }

    #[test]
    fn nodes_and_topics_are_distinguished_by_shape() {
        let text = r#"digraph graphname { graph [bb="0,0,300,100", rankdir=LR];
            subgraph cluster___x { graph [label="/x"]; n___x__a [label="/x/a", shape=ellipse, pos="50,50"]; }
            t___b [label="/b", shape=box]; n___c [shape=ellipse, label="/c"];
            n___x__a -> t___b [pos="e,214,50 86,50", label="1 Hz"]; t___b -> n___c; }"#;
        assert_eq!(
            elements(text),
            [
                NamedElement::Node("/c".into()),
                NamedElement::Node("/x/a".into()),
                NamedElement::Topic("/b".into()),
                NamedElement::Publish("/x/a".into(), "/b".into()),
                NamedElement::Subscribe("/c".into(), "/b".into()),
            ]
        );
    }

    #[test]
    fn an_edge_between_nodes_has_its_topic() {
        let text = r#"digraph { a [label="/a"]; b [label="/b"]; a -> b [label="/t\n5 Hz"]; }"#;
        assert!(elements(text).contains(&NamedElement::Publish("/a".into(), "/t".into())));
    }

    #[test]
    fn escaped_names_are_decoded() {
        assert_eq!(decoded("n___robot1__nav"), "/robot1/nav");
        assert!(elements("digraph { t___scan }").contains(&NamedElement::Topic("/scan".into())));
    }

    #[test]
    fn an_unterminated_string_is_reported_with_its_line() {
        let error = read(Path::new("g.dot"), "digraph {\n a [label=\"x];\n}").unwrap_err();
        assert!(error.to_string().contains("line 2"), "{error}");
    }
}
