//! Log texts that repeat a recorded message (`Publishing: 'Hello 3'`, `I heard: [Hello 3]`): the logging node
//! publishes or subscribes to that topic, according to its own words and the order of text and message.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

use super::SourceContext;
use crate::base::ids::{Few, grouped};
use crate::base::name::{in_space, is_log, plain_type};
use crate::base::time::Stamp;
use crate::evidence::inference::{Conclusions, ElementKey, Validity};
use crate::evidence::message::cursor::PayloadCursor;
use crate::evidence::message::dynamic::{LogRecord, MessageSchema, MessageValue};
use crate::evidence::observation::{Confidence, LoggedText, Name, ShownValue};

/// The fewest different values that are significant: two may agree by chance, and numbers are more often equal than words. With
/// fewer, a text `state: 3` beside a counter would be an echo of it; with more, short recordings of a talker would show none.
const FEWEST: usize = 3;
const FEWEST_NUMBERS: usize = 5;
/// The longest time between a text and the message that it repeats, in nanoseconds: both are recorded within milliseconds
/// unless the recorder is busy. Counters run through the same numbers, so less is allowed between numbers.
const NEAR_NS: i64 = 1_000_000_000;
const NEAR_NUMBERS_NS: i64 = 200_000_000;
/// The share, in per cent, of the texts of one form that must repeat a message; the others' messages were not recorded. With half,
/// texts about another topic, whose values are sometimes the same, would count.
const SHARE: usize = 80;
/// The shortest word that counts, in bytes; shorter ones are in too many texts.
const SHORTEST: usize = 3;
/// The longest payload that is searched, in bytes; longer ones contain no text that nodes log.
const LONGEST: usize = 1024;
/// The most values of one message that are kept: messages that nodes log have one or two; like the limits below, it bounds the
/// work.
const MOST_VALUES: usize = 4;
/// The most forms of texts that are examined closely: each is compared with all texts of its node. Real missions have some dozen.
const MOST_FORMS: usize = 4096;
/// The most forms of texts that are kept: four times as many as are examined, since most occur once.
const MOST_KEPT: usize = 1 << 14;
/// The most messages that are compared with one text, so that the work grows with the texts alone.
const MOST_NEAR: usize = 64;

/// Keeps the text of a log record.
pub(crate) fn read(context: &mut SourceContext<'_>, record: &LogRecord<'_>) {
    if let Some(time) = context.time
        && record.text.len() <= LONGEST
        && !record.file.ends_with("recorder.cpp")
    {
        let logger = in_space(context.space, &record.logger);
        context.facts.logged.add(time, &logger, record.text);
    }
}

/// Keeps the words and numbers in a message.
pub(crate) fn keep(context: &mut SourceContext<'_>, schema: &MessageSchema, payload: &[u8]) {
    if payload.len() > LONGEST {
        return;
    }
    let value = PayloadCursor::new(&context.stream.connection.encoding, payload)
        .and_then(|mut payload| schema.read(&mut payload));
    if let (Ok(value), Some(time)) = (value, context.time) {
        let mut values = Vec::new();
        collect(&value, &mut values);
        let logged = &mut context.facts.logged;
        for (field, value) in values.iter().enumerate() {
            logged.show(time, (context.place, field), value);
        }
    }
}

/// Packages of ROS itself, whose messages nodes do not log.
const OF_ROS: &str = "rosgraph_msgs rcl_interfaces tf2_msgs tf roslib bond";

/// The schema for parsing the messages of a type, whose definition has this one; `None` for those without words or numbers of
/// their own.
pub(crate) fn schema(type_name: &str, defined: &Arc<MessageSchema>) -> Option<Arc<MessageSchema>> {
    let plain = plain_type(type_name);
    let (package, _) = plain.split_once('/').unwrap_or_default();
    if OF_ROS.split(' ').any(|own| own == package) {
        return None;
    }
    let known = match &*plain {
        "std_msgs/String" => "string data",
        "std_msgs/Int32" => "int32 data",
        "std_msgs/Int64" | "example_interfaces/Int64" => "int64 data",
        "std_msgs/UInt32" => "uint32 data",
        _ => return defined.has_words().then(|| Arc::clone(defined)),
    };
    Some(Arc::new(MessageSchema::of_text(known)))
}

/// The words and whole numbers directly in a message.
fn collect(value: &MessageValue, into: &mut Vec<String>) {
    let MessageValue::Fields(fields) = value else {
        return;
    };
    for (_, field) in fields.iter().take(16) {
        let text = match field {
            MessageValue::Text(text) if text.trim().len() >= SHORTEST => text.trim().to_owned(),
            MessageValue::Number(Some(number)) => number.to_string(),
            _ => continue,
        };
        if into.len() < MOST_VALUES {
            into.push(text);
        }
    }
}

/// The texts of one form, by one node, about one topic.
#[derive(Default)]
struct Echo {
    values: BTreeSet<Box<str>>,
    texts: BTreeSet<(Stamp, Box<str>)>,
    /// The number of texts that came before their message.
    first: usize,
}

/// A node, the text before and after the value, a topic.
type LogForm = (Name, String, String, Name);

pub(crate) fn conclude(known: &mut Conclusions<'_>) {
    let (said, shown) = known.facts.logged.sorted();
    let echoes = echoes(known, &said, &shown);
    let mut by_node: Few<Name, Vec<&str>> = Few::default();
    for text in &said {
        if let Some(node) = known.owner(&text.logger) {
            by_node.grown(node).push(&text.text);
        }
    }
    let mut strong: Vec<_> = echoes.iter().collect();
    strong.retain(|(_, echo)| echo.values.len() >= FEWEST);
    strong.truncate(MOST_FORMS);
    strong.retain(|((node, before, after, _), echo)| {
        is_strong(echo, before, after, by_node.of(*node))
    });
    for ((node, before, after, topic), echo) in &strong {
        let same = |other: &&(&LogForm, &Echo)| {
            let (n, b, a, _) = other.0;
            (n, b, a) == (node, before, after)
        };
        // A text that repeats two topics may mean either.
        if strong.iter().filter(same).count() > 1 {
            continue;
        }
        if let Some(what) = end(known, *node, *topic, before, after, echo)
            && !known.knows(what)
            && !known.denies(what)
        {
            let when = Validity::Signs {
                signs: echo.texts.iter().map(|(time, _)| *time).collect(),
                ends: Vec::new(),
            };
            let first = echo.texts.first().map(|(time, _)| *time);
            known.because(what, Confidence::Stated, when, first, |_| {
                let (texts, values) = (echo.texts.len(), echo.values.len());
                format!("{texts} log texts `{before}…{after}` repeat {values} different messages")
            });
        }
    }
}

/// Every possible echo.
fn echoes(
    known: &Conclusions<'_>,
    said: &[LoggedText],
    shown: &[ShownValue],
) -> BTreeMap<LogForm, Echo> {
    let mut echoes: BTreeMap<LogForm, Echo> = BTreeMap::new();
    for text in said {
        let Some(node) = known.owner(&text.logger) else {
            continue;
        };
        let from = shown.partition_point(|s| s.time < text.time.plus(-NEAR_NS));
        let near = shown[from..].iter().take(MOST_NEAR);
        for message in near.take_while(|s| s.time <= text.time.plus(NEAR_NS)) {
            let apart = text.time.since(message.time);
            if is_number(&message.value) && apart.abs() > NEAR_NUMBERS_NS {
                continue;
            }
            let Some(place) = place(&text.text, &message.value) else {
                continue;
            };
            let topic = known.streams[message.stream].topic;
            let form = (
                node,
                text.text[..place.start].to_owned(),
                text.text[place.end..].to_owned(),
                topic,
            );
            if echoes.len() >= MOST_KEPT && !echoes.contains_key(&form) {
                continue;
            }
            let echo = echoes.entry(form).or_default();
            echo.values.insert(message.value.clone());
            if echo.texts.insert((text.time, text.text.clone())) {
                echo.first += usize::from(apart < 0);
            }
        }
    }
    echoes
}

/// The position of a value in a text as a whole word, not inside a longer word or number.
fn place(text: &str, value: &str) -> Option<Range<usize>> {
    let start = text.find(value)?;
    let end = start + value.len();
    let is_part = |c: Option<char>| c.is_some_and(char::is_alphanumeric);
    let before = text[..start].chars().next_back();
    let after = text[end..].chars().next();
    let more = is_number(value)
        && (matches!(before, Some('.' | '-'))
            || text[end..].starts_with('.')
                && text[end + 1..].starts_with(|c: char| c.is_ascii_digit()));
    (!is_part(before) && !is_part(after) && !more).then_some(start..end)
}

fn is_number(value: &str) -> bool {
    value.bytes().all(|b| b.is_ascii_digit() || b == b'-')
}

/// Whether enough different values were repeated, by nearly all texts of this form.
fn is_strong(echo: &Echo, before: &str, after: &str, by_node: &[&str]) -> bool {
    let numbers = echo.values.iter().all(|v| is_number(v));
    let fewest = if numbers { FEWEST_NUMBERS } else { FEWEST };
    if echo.values.len() < fewest || (numbers && verb(before, after).is_none()) {
        return false;
    }
    if before.is_empty() && after.is_empty() {
        return true;
    }
    let length = before.len() + after.len();
    let is_form =
        |text: &&&str| text.len() >= length && text.starts_with(before) && text.ends_with(after);
    echo.texts.len() * 100 >= by_node.iter().filter(is_form).count() * SHARE
}

/// Whether the words of a text mean a message sent (`true`) or received (`false`); `None` if neither or both.
fn verb(before: &str, after: &str) -> Option<bool> {
    let text = format!("{before} {after}").to_lowercase();
    let has = |words: &[&str]| words.iter().any(|word| text.contains(word));
    let sent = has(&["publish"]);
    let received = has(&["heard", "receiv", "subscri", "got ", "callback"]);
    (sent != received).then_some(sent)
}

/// The edge that an echo shows: by the known publishers, else by the verb, else by the order.
fn end(
    known: &Conclusions<'_>,
    node: Name,
    topic: Name,
    before: &str,
    after: &str,
    echo: &Echo,
) -> Option<ElementKey> {
    let (all, first) = (echo.texts.len(), echo.first);
    let publish = ElementKey::Publish(node, topic);
    let subscribe = ElementKey::Subscribe(topic, node);
    if known.knows(publish) {
        return None;
    }
    let later = first * 5 <= all;
    if known.publishers(topic).next().is_some() {
        let is_unsent = verb(before, after) != Some(true);
        return (later && is_unsent).then_some(subscribe);
    }
    match verb(before, after) {
        Some(true) => Some(publish),
        Some(false) => later.then_some(subscribe),
        None => (first * 10 >= all * 9).then_some(publish),
    }
}

// Texts that come with messages. For example, `/walker` logs `speed: 0.2` 24 times, numbers aside, and each time a message of
// `/cmd_vel`, which has no others, follows within milliseconds: `/walker` publishes it.

/// The longest time between a text and its message, in nanoseconds: half the interval of 10 Hz. With more, any text would be beside
/// a message of such a topic.
const BESIDE_NS: i64 = 50_000_000;
/// The fewest texts of one form that are significant, and the shares, in per cent, of the texts and of the messages that must come
/// together: 7 topics in public recordings and missions, each of this publisher; with fewer, two timers may agree by chance.
const FEWEST_BESIDE: usize = 10;
const SHARES_BESIDE: [usize; 2] = [90, 80];

pub(crate) fn conclude_beside(known: &mut Conclusions<'_>) {
    let (said, _) = known.facts.logged.sorted();
    let of = |text: &LoggedText| Some(((known.owner(&text.logger)?, form(&text.text)), text.time));
    let mut forms = grouped(said.iter().filter_map(of));
    forms.retain(|_, texts| texts.len() >= FEWEST_BESIDE);
    let most = forms.values().map(Vec::len).max().unwrap_or(0);
    let mut topics: BTreeMap<Name, Vec<Stamp>> = BTreeMap::new();
    for (at, series) in known.facts.payloads.somes() {
        let stream = &known.streams[at];
        let count = known.facts.times.count(*series);
        if count <= 2 * most as u64 && !is_log(stream.connection.topic.as_str()) {
            let times = topics.entry(stream.topic).or_default();
            let all = &known.facts.times;
            if let Err(error) = all.merge(&[*series], |timed| times.push(timed.time)) {
                known.failed = Some(error);
            }
        }
    }
    for times in topics.values_mut() {
        times.sort_unstable();
    }
    for ((node, _), texts) in &forms {
        let beside = topics.iter();
        let mut beside =
            beside.filter_map(|(topic, times)| Some((*topic, beside_of(texts, times)?)));
        let (Some((topic, is_first)), None) = (beside.next(), beside.next()) else {
            continue;
        };
        if is_first && known.publishers(topic).next().is_none() {
            known.infer_publisher(*node, topic, |known| {
                let [node, topic] = [*node, topic].map(|name| known.text(name));
                format!(
                    "{} log texts of {node} come with messages of {topic}",
                    texts.len()
                )
            });
        }
    }
}

/// A text without its numbers.
fn form(text: &str) -> String {
    let words = text.split(|c: char| c.is_ascii_digit() || ".-".contains(c));
    let words = words.filter(|word| !word.is_empty());
    words.collect::<Vec<&str>>().join("#")
}

/// Whether most of the texts come before their messages; `None` if not nearly all texts and messages come together.
fn beside_of(texts: &[Stamp], times: &[Stamp]) -> Option<bool> {
    let are_most = |both: usize| {
        let mut shares = [texts, times].into_iter().zip(SHARES_BESIDE);
        shares.all(|(all, share)| both * 100 >= all.len() * share)
    };
    if !are_most(texts.len().min(times.len())) {
        return None;
    }
    let mut rest = times.iter().peekable();
    let (mut both, mut first) = (0, 0);
    for text in texts {
        while rest
            .next_if(|time| text.since(**time) > BESIDE_NS)
            .is_some()
        {}
        if let Some(time) = rest.next_if(|time| time.since(*text) <= BESIDE_NS) {
            both += 1;
            first += usize::from(time >= text);
        }
    }
    are_most(both).then_some(first * 10 >= both * 9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_match_only_as_whole_words() {
        assert_eq!(place("I heard: [Hello 3]", "Hello 3"), Some(10..17));
        assert_eq!(place("I heard: [Hello 31]", "Hello 3"), None);
        assert_eq!(place("rate 2.5", "5"), None);
        assert_eq!(place("got 5.", "5"), Some(4..5));
        assert_eq!(place("n=-5", "5"), None);
    }

    #[test]
    fn verbs_in_texts_determine_the_direction() {
        assert_eq!(verb("Publishing: '", "'"), Some(true));
        assert_eq!(verb("I heard: [", "]"), Some(false));
        assert_eq!(verb("state ", ""), None);
    }
}
