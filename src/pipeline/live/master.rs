//! The ROS 1 master, polled for the whole graph each second (`getSystemState` and `getTopicTypes` of its XML-RPC
//! interface: <http://wiki.ros.org/ROS/Master_API>).

use std::io::{self, Read as _, Write as _};

use roxmltree::{Document, Node, ParsingOptions};

use super::graph::{LiveGraph, PUBLISHERS, SERVERS, SUBSCRIBERS};
use super::{BEAT, Watched, connection::connect};
use crate::base::name::OWN_NODE;

/// The longest answer that is read, in bytes: five times that of a thousand nodes.
const MOST_ANSWER: usize = 8 << 20;
/// The most attributes in an answer, of which only its declaration has some, and whose parsing takes the square of
/// their number: names contain no `=`.
const MOST_ATTRIBUTES: usize = 16;
/// The most elements and texts in an answer: ten times those of a thousand nodes, a hundred bytes each.
const MOST_PARTS: u32 = 1 << 20;

/// Polls the master at `place` (`host:port`).
pub(super) fn watch(place: &str, watched: &mut Watched) -> io::Result<()> {
    while !watched.is_over() {
        let state = ask(place, "getSystemState", watched)?;
        let types = ask(place, "getTopicTypes", watched)?;
        watched.graph = graph(&state, &types)?;
        watched.beat()?;
        watched.rest(BEAT);
    }
    Ok(())
}

/// The graph in the answers to `getSystemState` and `getTopicTypes`.
fn graph(state: &str, types: &str) -> io::Result<LiveGraph> {
    let mut graph = LiveGraph::default();
    let state = parse(state)?;
    let sides: Vec<_> = items(value(&state)?)?.collect();
    if sides.len() != 3 {
        return Err(no_master());
    }
    for (side, all) in [PUBLISHERS, SUBSCRIBERS, SERVERS].into_iter().zip(sides) {
        for pair in items(all)? {
            let [name, nodes] = pair_of(pair)?;
            let nodes = items(nodes)?.map(|node| text(node).to_owned());
            graph.set(side, text(name), nodes.collect());
        }
    }
    let types = parse(types)?;
    for pair in items(value(&types)?)? {
        let [name, kind] = pair_of(pair)?.map(|part| text(part).to_owned());
        graph.types.insert(name, kind);
    }
    Ok(graph)
}

fn parse(answer: &str) -> io::Result<Document<'_>> {
    let options = ParsingOptions {
        nodes_limit: MOST_PARTS,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(answer, options).map_err(io::Error::other)
}

/// The answer to a call whose only parameter is the caller's name.
fn ask(place: &str, method: &str, watched: &Watched) -> io::Result<String> {
    let mut stream = connect(place, &watched.is_over)?;
    let body = format!(
        "<?xml version=\"1.0\"?><methodCall><methodName>{method}</methodName><params><param><value><string>{OWN_NODE}</string>\
         </value></param></params></methodCall>"
    );
    let head = format!(
        "POST /RPC2 HTTP/1.0\r\nHost: {place}\r\nContent-Type: text/xml\r\nContent-Length: {}\r\n\r\n",
        body.len()
    );
    // Sent in one piece: a server that answers the first part and closes would cut off the rest.
    stream.write_all((head + &body).as_bytes())?;
    let mut answer = String::new();
    let most = MOST_ANSWER as u64 + 1;
    stream.take(most).read_to_string(&mut answer)?;
    if answer.len() > MOST_ANSWER {
        return Err(io::Error::other("its response is too large"));
    }
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or_default();
    let is_plain = body.matches('=').nth(MOST_ATTRIBUTES).is_none();
    let is_fine = is_plain && head.split_whitespace().nth(1) == Some("200");
    if is_fine {
        Ok(body.to_owned())
    } else {
        Err(no_master())
    }
}

/// The last of the three values that a master answers with: the code for success, a message, and the result.
fn value<'a>(answer: &'a Document<'a>) -> io::Result<Node<'a, 'a>> {
    let all = answer.descendants().find(|node| node.has_tag_name("value"));
    let parts: Vec<_> = items(all.ok_or_else(no_master)?)?.collect();
    match parts[..] {
        [code, _, result] if text(code) == "1" => Ok(result),
        _ => Err(no_master()),
    }
}

/// The values in a value.
///
/// # Errors
/// If it is not an array.
fn items<'a>(value: Node<'a, 'a>) -> io::Result<impl Iterator<Item = Node<'a, 'a>>> {
    let child = |node: Node<'a, 'a>, tag: &str| node.children().find(|c| c.has_tag_name(tag));
    let data = child(value, "array").and_then(|array| child(array, "data"));
    let values = data.ok_or_else(no_master)?.children();
    Ok(values.filter(|node| node.has_tag_name("value")))
}

fn pair_of<'a>(value: Node<'a, 'a>) -> io::Result<[Node<'a, 'a>; 2]> {
    let mut parts = items(value)?;
    match (parts.next(), parts.next()) {
        (Some(first), Some(second)) => Ok([first, second]),
        _ => Err(no_master()),
    }
}

/// The text of a value, with or without `<string>`.
fn text<'a>(value: Node<'a, 'a>) -> &'a str {
    let mut texts = value.descendants().filter_map(|node| node.text());
    texts
        .find(|text| !text.trim().is_empty())
        .unwrap_or_default()
        .trim()
}

fn no_master() -> io::Error {
    io::Error::other("its response is not that of a ROS master")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array(of: &[&str]) -> String {
        let values: Vec<String> = of.iter().map(|v| format!("<value>{v}</value>")).collect();
        format!("<array><data>{}</data></array>", values.concat())
    }

    fn answer(code: &str, result: &str) -> String {
        let all = array(&[&format!("<int>{code}</int>"), "<string>ok</string>", result]);
        format!(
            "<methodResponse><params><param><value>{all}</value></param></params></methodResponse>"
        )
    }

    #[test]
    fn only_a_whole_graph_is_accepted() {
        let none = array(&[]);
        let state = array(&[
            &array(&[&array(&["/chat", &array(&["/talker"])])]),
            &none,
            &none,
        ]);
        let types = answer("1", &none);
        let is_fine = |state: &str, types: &str| graph(state, types).is_ok();
        assert!(is_fine(&answer("1", &state), &types));
        assert!(is_fine(
            &answer("1", &array(&[&none, &none, &none])),
            &types
        ));
        for (code, result) in [
            ("-1", &*state),
            ("0", "<int>0</int>"),
            ("1", "<string>x</string>"),
            ("1", &*none),
            ("1", &array(&[&none, &none])),
            ("1", &array(&["x", "y", "z"])),
        ] {
            assert!(!is_fine(&answer(code, result), &types), "{code} {result}");
        }
        let state = answer("1", &state);
        for (code, result) in [("-1", &*none), ("1", "<int>0</int>")] {
            assert!(!is_fine(&state, &answer(code, result)), "{code} {result}");
        }
    }
}
