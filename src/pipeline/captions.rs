//! Mission phases to show: from a file of `seconds|text` lines, or from a string topic of the bag.

use std::path::Path;

use crate::bag::{
    self, Connection, ConnectionId, Encoding, Input, Message, OpenOptions, Sink, Want,
};
use crate::base::error::{Error, Result};
use crate::base::notice::Notice;
use crate::base::time::{Stamp, parse_nanos};
use crate::base::{budget, file};
use crate::evidence::message::cursor::Cursor;
use crate::mission::Mission;

/// The phase of every window: the last caption that begins before the window's end, empty before the first one.
/// `from` is a file if there is one of that name, else a topic of type `std_msgs/String`.
///
/// # Errors
/// [`Error::BadFile`] with the line for a line that is no caption; [`Error::Usage`] if there is neither such a file nor
/// such a topic.
pub(super) fn phases(mission: &Mission, inputs: &[Input], from: &str) -> Result<Vec<String>> {
    let path = Path::new(from);
    let captions = if path.is_file() {
        from_file(&file::read_text(path, budget::USER_TEXT)?, path)?
    } else {
        from_topic(inputs, from)?
            .into_iter()
            .map(|(at, text)| (mission.offset(at), text))
            .collect()
    };
    let phase = |end: i64| {
        captions
            .iter()
            .rev()
            .find(|(at, _)| *at < end)
            .map_or("", |(_, text)| text)
    };
    Ok(mission
        .windows
        .iter()
        .map(|w| phase(mission.offset(w.span.end)).to_owned())
        .collect())
}

/// Captions by nanoseconds after the mission's start, sorted. Empty lines and lines that begin with `#` are skipped.
fn from_file(text: &str, path: &Path) -> Result<Vec<(i64, String)>> {
    let mut captions = Vec::new();
    for (number, line) in text
        .lines()
        .enumerate()
        .filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'))
    {
        let caption = line
            .split_once('|')
            .and_then(|(at, text)| Some((parse_nanos(at)?, text.trim().to_owned())));
        captions.push(caption.ok_or_else(|| Error::BadFile {
            path: path.to_owned(),
            line: number + 1,
            reason: format!("`{line}` is no caption"),
            hint: "write `seconds|text`, such as `90|picking`".to_owned(),
        })?);
    }
    captions.sort_by_key(|(at, _)| *at);
    Ok(captions)
}

/// How many captions are taken from a topic.
const MOST: usize = 10_000;
/// How many characters of each.
const LONGEST: usize = 200;

fn from_topic(inputs: &[Input], topic: &str) -> Result<Vec<(Stamp, String)>> {
    let mut ear = Ear {
        topic,
        encodings: Vec::new(),
        captions: Vec::new(),
    };
    for input in inputs.iter().filter(|input| **input != Input::Stdin) {
        ear.encodings.clear();
        bag::open(input, &OpenOptions::default())?.read(None, &mut ear)?;
    }
    if ear.captions.is_empty() {
        return Err(Error::usage(
            format!("`{topic}` is neither a file nor a topic of `std_msgs/String`"),
            "`--captions` takes a file of `seconds|text` lines or such a topic",
        ));
    }
    ear.captions.sort();
    Ok(ear.captions)
}

/// Hears one topic.
struct Ear<'a> {
    topic: &'a str,
    /// How the payloads of each connection are written; `None` for those that are not heard.
    encodings: Vec<Option<Encoding>>,
    captions: Vec<(Stamp, String)>,
}

impl Sink for Ear<'_> {
    fn connection(&mut self, connection: &Connection) -> Want {
        let is_string = matches!(
            &*connection.type_name,
            "std_msgs/String" | "std_msgs/msg/String"
        );
        let heard = is_string && connection.topic.as_str() == self.topic;
        self.encodings
            .push(heard.then(|| connection.encoding.clone()));
        if heard { Want::Payload } else { Want::Stamps }
    }

    fn stamps(&mut self, _: ConnectionId, _: &[Stamp], _: Option<&[u32]>) {}

    fn message(&mut self, message: Message<'_>) {
        let encoding = self
            .encodings
            .get(message.connection.0 as usize)
            .and_then(Option::as_ref);
        let text = encoding.and_then(|e| string(message.data, e));
        if let (Some(text), true) = (text, self.captions.len() < MOST) {
            self.captions
                .push((message.time, text.chars().take(LONGEST).collect()));
        }
    }

    fn notice(&mut self, _: Notice) {}
}

fn string(data: &[u8], encoding: &Encoding) -> Option<String> {
    Cursor::new(encoding, data)
        .and_then(|mut cursor| cursor.string())
        .ok()
        .map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_gives_captions_in_order_of_time() {
        let captions = from_file("# phases\n90|picking\n\n0|start\n", Path::new("c.txt")).unwrap();
        assert_eq!(
            captions,
            [
                (0, "start".to_owned()),
                (90_000_000_000, "picking".to_owned())
            ]
        );
        let error = from_file("0|a\nsoon|b\n", Path::new("c.txt")).unwrap_err();
        assert_eq!(error.to_string(), "`c.txt` line 2: `soon|b` is no caption");
    }
}
