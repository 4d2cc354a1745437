//! The ROS 1 master, polled for the whole graph each second (`getSystemState` and `getTopicTypes` of its XML-RPC
//! interface: <http://wiki.ros.org/ROS/Master_API>).

use std::io::{self, Read as _, Write as _};

use roxmltree::{Document, Node};

use super::{BEAT, LiveGraph, PUBLISHERS, SERVERS, SUBSCRIBERS, Watched, connect};
use crate::base::name::OWN_NODE;

/// The longest answer that is read, in bytes: five times that of a thousand nodes. Parsing needs at most thirty times as
/// much memory.
const MOST_ANSWER: u64 = 8 << 20;
/// The most attributes in an answer, whose parsing takes the square of their number: names contain no `=`.
const MOST_ATTRIBUTES: usize = 1000;

/// Polls the master at `place` (`host:port`).
pub(super) fn watch(place: &str, watched: &mut Watched) -> io::Result<()> {
    while !watched.is_over() {
        let mut graph = LiveGraph::default();
        let answer = ask(place, "getSystemState")?;
        let state = Document::parse(&answer).map_err(io::Error::other)?;
        for (side, all) in [PUBLISHERS, SUBSCRIBERS, SERVERS]
            .into_iter()
            .zip(items(value(&state)?))
        {
            for pair in items(all) {
                let [name, nodes] = pair_of(pair)?;
                let nodes = items(nodes).map(|node| text(node).to_owned());
                graph.set(side, text(name), nodes.collect());
            }
        }
        let answer = ask(place, "getTopicTypes")?;
        let types = Document::parse(&answer).map_err(io::Error::other)?;
        for pair in items(value(&types)?) {
            let [name, kind] = pair_of(pair)?.map(|part| text(part).to_owned());
            graph.types.insert(name, kind);
        }
        graph.check()?;
        watched.graph = graph;
        watched.beat()?;
        std::thread::sleep(BEAT);
    }
    Ok(())
}

/// The answer to a call whose only parameter is the caller's name.
fn ask(place: &str, method: &str) -> io::Result<String> {
    let mut stream = connect(place)?;
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
    stream.take(MOST_ANSWER).read_to_string(&mut answer)?;
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or_default();
    let is_plain = body.matches('=').nth(MOST_ATTRIBUTES).is_none();
    let is_fine = is_plain && head.split_whitespace().nth(1) == Some("200");
    if is_fine {
        Ok(body.to_owned())
    } else {
        Err(no_master())
    }
}

/// The last of the three values that a master answers with: a code, a message, and the result.
fn value<'a>(answer: &'a Document<'a>) -> io::Result<Node<'a, 'a>> {
    let all = answer.descendants().find(|node| node.has_tag_name("value"));
    let third = all.and_then(|answer| items(answer).nth(2));
    third.ok_or_else(no_master)
}

/// The values in a value that is an array.
fn items<'a>(value: Node<'a, 'a>) -> impl Iterator<Item = Node<'a, 'a>> {
    let child = |node: Node<'a, 'a>, tag: &str| node.children().find(|c| c.has_tag_name(tag));
    let data = child(value, "array").and_then(|array| child(array, "data"));
    let values = data.into_iter().flat_map(|data| data.children());
    values.filter(|node| node.has_tag_name("value"))
}

fn pair_of<'a>(value: Node<'a, 'a>) -> io::Result<[Node<'a, 'a>; 2]> {
    let parts = [0, 1].map(|at| items(value).nth(at));
    match parts {
        [Some(first), Some(second)] => Ok([first, second]),
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
