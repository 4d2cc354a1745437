//! The expectation of a mission, `graph.yaml`: its keys and values with their positions, and how they are read.

use std::fmt;
use std::ops::Deref;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::{Deserializer, Error as _, IgnoredAny, SeqAccess, Visitor};

use super::finding::FindingKind;
use super::values::{During, MEASURES, Measure, Pattern, Range};
use crate::base::error::{Error, Result};
use crate::base::time::{Period, parse_nanos};
use crate::base::words::worded;
use crate::base::yaml::{self, BadYaml, Keyed, Pairs};
pub(crate) use crate::base::yaml::{At, YamlPlace};
use crate::mission::event_log::Kind;

/// The first line of every expectation.
pub(crate) const SCHEMA: &str = "bagreel.expect/1";
/// The keys of a node, and those of a topic.
const NODE: &str = "forbidden optional may_end known_by restarts lifecycle within";
const TOPIC: &str = "forbidden optional may_end type by to hz mean_hz percent max_gap within age bytes drops latched qos \
    during";
/// The keys that determine the form of a rule, each with the other allowed keys.
const FORMS: [(&str, &str); 5] = [
    ("node", NODE),
    ("nodes", NODE),
    ("topic", TOPIC),
    ("when", "expect within"),
    ("changes", "during"),
];

/// A whole `graph.yaml`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Expectation {
    /// The file as given.
    pub(crate) file: PathBuf,
    /// The length of the windows in which rates are checked.
    pub(crate) period: Option<Period>,
    pub(crate) policy: At<Policy>,
    pub(crate) nodes: Vec<Named>,
    pub(crate) topics: Vec<Named>,
    pub(crate) rules: Vec<Rule>,
}

/// The expectation of a name.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Named {
    pub(crate) name: Pattern,
    /// The position of the name.
    pub(crate) at: YamlPlace,
    pub(crate) facts: Entry,
}

/// A named expectation.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rule {
    pub(crate) id: String,
    pub(crate) at: YamlPlace,
    pub(crate) demand: Demand,
}

/// The condition that a rule checks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Demand {
    /// Facts of each of these nodes.
    Nodes(Vec<At<Pattern>>, Box<Entry>),
    /// Facts of a topic.
    Topic(At<Pattern>, Box<Entry>),
    Reaction(Reaction),
    /// The range of the number of reconfigurations.
    Changes {
        during: During,
        many: Range,
    },
}

/// An event that another must follow.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Reaction {
    pub(crate) when: ExpectedEvent,
    pub(crate) expect: ExpectedEvent,
    /// In nanoseconds.
    pub(crate) within: i64,
}

/// An event of the event log.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ExpectedEvent {
    pub(crate) kind: EventKind,
    pub(crate) name: Pattern,
    /// The sender or value before; any if `None`.
    pub(crate) from: Option<Pattern>,
    /// The sender or value after; any if `None`.
    pub(crate) to: Option<Pattern>,
}

worded! {
    /// Kinds of events, as a rule names them.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) enum EventKind {
        Added = "added",
        Removed = "removed",
        Restarted = "restarted",
        Silent = "silent",
        HandedOver = "handed_over",
        Rate = "rate",
        Lifecycle = "lifecycle",
    }
}

/// A fact that is in the file, or is not.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fact<T>(Option<At<T>>);

impl<T> Default for Fact<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> Deref for Fact<T> {
    type Target = Option<At<T>>;

    fn deref(&self) -> &Option<At<T>> {
        &self.0
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Fact<T> {
    /// Unlike for an `Option`, a key without a value is an error.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        At::deserialize(deserializer).map(|fact| Self(Some(fact)))
    }
}

/// The keys of a node, a topic or a rule.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Entry {
    /// Whether it must be absent.
    pub(crate) forbidden: bool,
    /// Whether it may be absent.
    pub(crate) optional: bool,
    /// The time range in which a node, or a topic's last message, may end; without it, it must stay.
    pub(crate) may_end: Fact<MayEnd>,
    /// The time range in which a node must appear, or a topic's first message.
    pub(crate) within: Fact<Within>,
    /// Given if only its log names a node, so it may run unnamed.
    pub(crate) known_by: Fact<KnownBy>,
    pub(crate) restarts: Fact<Range>,
    /// A node's state at the end.
    pub(crate) lifecycle: Fact<String>,
    /// The types of a topic's messages: these and no others.
    #[serde(rename = "type")]
    pub(crate) kinds: Fact<Names>,
    /// The nodes that publish a topic: these and no others.
    pub(crate) by: Fact<Names>,
    /// The nodes that subscribe to a topic: these at least.
    pub(crate) to: Fact<Names>,
    /// Messages per second in every window.
    pub(crate) hz: Fact<Range>,
    /// Messages per second from the first to the last one.
    pub(crate) mean_hz: Fact<Range>,
    /// The percentage of windows in which `hz` and measures must be in their range; all without it.
    percent: Fact<Percent>,
    /// The longest silence.
    pub(crate) max_gap: Fact<Length>,
    age: Fact<MeasureRange<0>>,
    bytes: Fact<MeasureRange<1>>,
    drops: Fact<MeasureRange<2>>,
    pub(crate) latched: Fact<bool>,
    /// Text that the quality of service must contain.
    pub(crate) qos: Fact<String>,
    /// The time range in which rates and gaps are checked, or changes counted; the whole mission without it.
    pub(crate) during: Fact<During>,
    id: Fact<String>,
    node: Fact<Pattern>,
    nodes: Fact<Names>,
    topic: Fact<Pattern>,
    when: Fact<Pairs<At<Pattern>>>,
    expect: Fact<Pairs<At<Pattern>>>,
    changes: Fact<Range>,
}

impl Entry {
    /// Whether any fact requires messages.
    pub(crate) fn wants_messages(&self) -> bool {
        let is_rated = self.hz.is_some() || self.mean_hz.is_some() || self.max_gap.is_some();
        is_rated || self.within.is_some() || self.measures().any(|(_, range)| range.is_some())
    }

    /// The ranges of measures of messages in every window.
    pub(crate) fn measures(&self) -> impl Iterator<Item = (&Measure, Option<At<Range>>)> {
        let age = self.age.as_ref().map(|age| (age.at, age.value.0));
        let bytes = self.bytes.as_ref().map(|bytes| (bytes.at, bytes.value.0));
        let drops = self.drops.as_ref().map(|drops| (drops.at, drops.value.0));
        let ranges = [age, bytes, drops];
        let ranges = ranges.map(|range| range.map(|(at, value)| At { at, value }));
        MEASURES.iter().zip(ranges)
    }

    /// Whether so many of these windows may be out of range.
    pub(crate) fn tolerates(&self, bad: usize, windows: usize) -> bool {
        let percent = self.percent.as_ref().map_or(100.0, |p| p.value.0);
        bad as f64 <= windows as f64 * (1.0 - percent / 100.0)
    }

    /// The names of nodes in its lists.
    pub(crate) fn named_nodes(&self) -> impl Iterator<Item = &Pattern> {
        let lists = self.by.iter().chain(self.to.iter());
        lists.flat_map(|list| &list.value.0).map(|name| &name.value)
    }

    /// The publishers of a topic.
    pub(crate) fn publishers(&self) -> impl Iterator<Item = &Pattern> {
        let names = self.by.iter().flat_map(|by| &by.value.0);
        names.map(|name| &name.value)
    }
}

/// The policy for elements of the bag that are not in the file, and for remarks of the event log.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Policy {
    pub(crate) unexpected_nodes: Unlisted,
    pub(crate) unexpected_topics: Unlisted,
    /// The policy for publishers of topics whose publishers are listed.
    pub(crate) unexpected_publishers: Unlisted,
    starved: Unlisted,
    duplicate_names: Unlisted,
    messages_lost: Unlisted,
}

impl Default for Policy {
    fn default() -> Self {
        Self {
            unexpected_nodes: Unlisted::Allow,
            unexpected_topics: Unlisted::Allow,
            unexpected_publishers: Unlisted::Error,
            starved: Unlisted::Warn,
            duplicate_names: Unlisted::Warn,
            messages_lost: Unlisted::Warn,
        }
    }
}

/// A kind of remark in the event log that is a finding.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Remark {
    pub(crate) title: &'static str,
    pub(crate) kind: Kind,
    pub(crate) finding: FindingKind,
    pub(crate) policy: Unlisted,
}

impl Policy {
    pub(crate) fn remarks(&self) -> [Remark; 3] {
        let remark = |title, kind, finding, policy| Remark {
            title,
            kind,
            finding,
            policy,
        };
        let (starved, lost) = (self.starved, self.messages_lost);
        let twice = FindingKind::DuplicateName;
        [
            remark("starved", Kind::Starved, FindingKind::Starved, starved),
            remark(
                "duplicate names",
                Kind::Duplicate,
                twice,
                self.duplicate_names,
            ),
            remark("messages lost", Kind::Lost, FindingKind::MessagesLost, lost),
        ]
    }
}

worded! {
    /// The severity of an element that is not in the file.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) enum Unlisted {
        Allow = "allow",
        Warn = "warn",
        Error = "error",
    }
}

/// The time range in which something must start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Within(pub(crate) During);

/// The time range in which something may end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MayEnd(pub(crate) During);

/// What alone names a node: its log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct KnownBy;

/// A length of time in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Length(pub(crate) i64);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Percent(f64);

/// A range of the measure at this index of [`MEASURES`].
#[derive(Clone, Copy, Debug, PartialEq)]
struct MeasureRange<const INDEX: usize>(Range);

#[derive(Clone, Copy, Debug)]
struct Schema;

/// Types written as one value: how, and the function that reads it.
macro_rules! written {
    ($($type:ty: $hint:expr, $parse:expr;)+) => {
        $(impl<'de> Deserialize<'de> for $type {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let text = String::deserialize(deserializer)?;
                let parse: fn(&str) -> Option<Self> = $parse;
                parse(&text).ok_or_else(|| D::Error::custom($hint))
            }
        })+
    };
}

written! {
    Schema: format!("the first line must be `schema: {SCHEMA}`"), |text| (text == SCHEMA).then_some(Self);
    Period: "write `60s`, `1m` or `500ms`", Self::parse;
    Unlisted: "write `allow`, `warn` or `error`", Self::from_word;
    Pattern: "", |text| Some(Self::new(text));
    Range: "write a range: `13.5..16.5`, `5..` or `..1`, the smaller number first", Self::parse;
    During: "write an interval: `1:30..2m`, `-30s..`, the earlier time first", Self::parse;
    Within: "write a length or an interval: `20s`, `1:30..2m`, the earlier time first", |text| {
        let until = parse_nanos(text).map(During::until);
        until.or_else(|| During::parse(text)).map(Self)
    };
    MayEnd: "write `true`, or when it may end: `1:30..`, `-20s..`, the earlier time first", |text| match text {
        "true" => Some(Self(During::WHOLE)),
        text => During::parse(text).map(Self),
    };
    KnownBy: "write `known_by: log`", |text| (text == "log").then_some(Self);
    Length: "write a duration: `20s`, `500ms`, `1m`", |text| parse_nanos(text).map(Self);
    Percent: "write 0 to 100", |text| {
        let percent = text.parse().ok();
        percent.filter(|p| (0.0..=100.0).contains(p)).map(Self)
    };
    MeasureRange<0>: MEASURES[0].hint, |text| MEASURES[0].range(text).map(Self);
    MeasureRange<1>: MEASURES[1].hint, |text| MEASURES[1].range(text).map(Self);
    MeasureRange<2>: MEASURES[2].hint, |text| MEASURES[2].range(text).map(Self);
}

/// A list of names, or one name.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(from = "At<OneOrMore>")]
pub(crate) struct Names(pub(crate) Vec<At<Pattern>>);

enum OneOrMore {
    One(Pattern),
    More(Vec<At<Pattern>>),
}

impl From<At<OneOrMore>> for Names {
    fn from(At { at, value }: At<OneOrMore>) -> Self {
        Self(match value {
            OneOrMore::One(value) => vec![At { at, value }],
            OneOrMore::More(names) => names,
        })
    }
}

impl<'de> Deserialize<'de> for OneOrMore {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NamesVisitor)
    }
}

struct NamesVisitor;

impl<'de> Visitor<'de> for NamesVisitor {
    type Value = OneOrMore;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a name or a list of names")
    }

    fn visit_str<E>(self, name: &str) -> Result<OneOrMore, E> {
        Ok(OneOrMore::One(Pattern::new(name)))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<OneOrMore, A::Error> {
        let mut names = Vec::new();
        while let Some(name) = list.next_element()? {
            names.push(name);
        }
        Ok(OneOrMore::More(names))
    }
}

#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct File {
    schema: Fact<Schema>,
    /// For the reader.
    #[serde(rename = "from")]
    _from: IgnoredAny,
    period: Fact<Period>,
    policy: Fact<Policy>,
    nodes: Pairs<Keyed<Entry>>,
    topics: Pairs<Keyed<Entry>>,
    rules: Vec<At<Keyed<Entry>>>,
}

/// Reads an expectation.
///
/// # Errors
/// [`crate::Error::BadFile`] for a text that is not YAML, expands too far, or contains an unknown key or word.
pub(crate) fn read(text: &str, path: &Path) -> Result<Expectation> {
    parse(text, path).map_err(|bad| Error::BadFile {
        path: path.to_owned(),
        line: bad.at.line,
        column: bad.at.column,
        reason: bad.reason,
        hint: match bad.hint {
            hint if hint.is_empty() => "the file must be YAML: `name: {key: value}`".to_owned(),
            hint => hint,
        },
    })
}

fn parse(text: &str, path: &Path) -> Result<Expectation, BadYaml> {
    let At { at, value: file } = yaml::read::<At<File>>(text)?;
    let Some(schema) = &*file.schema else {
        let hint = format!("the first line must be `schema: {SCHEMA}`");
        return Err(BadYaml::new(at, "`schema` is missing", hint));
    };
    let mut rules: Vec<Rule> = Vec::new();
    for part in file.rules {
        let rule = rule(part)?;
        if rules.iter().any(|other| other.id == rule.id) {
            let reason = format!("two rules have the id `{}`", rule.id);
            return Err(BadYaml::new(rule.at, reason, "give it another `id`"));
        }
        rules.push(rule);
    }
    let usual = At {
        at: schema.at,
        value: Policy::default(),
    };
    Ok(Expectation {
        file: path.to_owned(),
        period: file.period.as_ref().map(|period| period.value),
        policy: file.policy.unwrap_or(usual),
        nodes: section(file.nodes, NODE)?,
        topics: section(file.topics, TOPIC)?,
        rules,
    })
}

/// The expectations of names, which may have these keys.
fn section(pairs: Pairs<Keyed<Entry>>, known: &str) -> Result<Vec<Named>, BadYaml> {
    let known: Vec<&str> = known.split(' ').collect();
    let named = pairs.0.into_iter().map(|(name, entry)| {
        let is_known = |key: &&At<String>| known.contains(&key.value.as_str());
        if let Some(key) = entry.keys.iter().find(|key| !is_known(key)) {
            return Err(BadYaml::unknown_key(key.at, &key.value, &known));
        }
        Ok(Named {
            name: Pattern::new(&name.value),
            at: name.at,
            facts: entry.value,
        })
    });
    named.collect()
}

fn rule(At { at, value }: At<Keyed<Entry>>) -> Result<Rule, BadYaml> {
    let Keyed { keys, value: entry } = value;
    let missing = |key: &str, hint: &str| BadYaml::new(at, format!("`{key}` is missing"), hint);
    let Some(At { value: id, .. }) = entry.id.0.clone() else {
        return Err(missing("id", "every rule has an `id: a-name`"));
    };
    let has = |form: &str| keys.iter().any(|key| key.value == form);
    let Some((form, with)) = FORMS.iter().find(|(form, _)| has(form)) else {
        let hint = format!("a rule has one of {}", FORMS.map(|(key, _)| key).join(", "));
        return Err(BadYaml::new(at, "the rule has no subject", hint));
    };
    let together = with.replace(' ', ", ");
    let mut others = keys
        .iter()
        .filter(|key| key.value != "id" && key.value != *form);
    if let Some(key) = others
        .clone()
        .find(|key| !with.split(' ').any(|own| own == key.value))
    {
        let reason = format!("`{}` cannot be combined with `{form}`", key.value);
        let hint = format!("it can be combined with {together}");
        return Err(BadYaml::new(key.at, reason, hint));
    }
    let is_about_element = entry.when.is_none() && entry.changes.is_none();
    if is_about_element && others.all(|key| key.value == "during") {
        let hint = format!("`{form}` can be combined with {together}");
        return Err(BadYaml::new(
            at,
            format!("the rule `{id}` has no condition"),
            hint,
        ));
    }
    let demand = if let Some(name) = entry.node.0.clone() {
        Demand::Nodes(vec![name], Box::new(entry))
    } else if let Some(names) = entry.nodes.0.clone() {
        Demand::Nodes(names.value.0, Box::new(entry))
    } else if let Some(name) = entry.topic.0.clone() {
        Demand::Topic(name, Box::new(entry))
    } else if let Some(many) = &*entry.changes {
        Demand::Changes {
            during: entry
                .during
                .as_ref()
                .map_or(During::WHOLE, |during| during.value),
            many: many.value,
        }
    } else {
        let hint = "write `when: {removed: /a}, expect: {handed_over: /t, to: /b}, within: 2s`";
        let (Some(when), Some(expect)) = (&*entry.when, &*entry.expect) else {
            return Err(missing("expect", hint));
        };
        let Some(within) = &*entry.within else {
            return Err(missing("within", hint));
        };
        let length = within.value.0.length();
        let no_length = || BadYaml::new(within.at, "`within` is not a length of time", hint);
        Demand::Reaction(Reaction {
            when: event("when", when)?,
            expect: event("expect", expect)?,
            within: length.ok_or_else(no_length)?,
        })
    };
    Ok(Rule { id, at, demand })
}

fn event(key: &str, part: &At<Pairs<At<Pattern>>>) -> Result<ExpectedEvent, BadYaml> {
    let words = EventKind::ALL.map(EventKind::word);
    let (mut kinds, mut from, mut to) = (Vec::new(), None, None);
    for (word, name) in &part.value.0 {
        match (word.value.as_str(), EventKind::from_word(&word.value)) {
            (_, Some(kind)) => kinds.push((kind, &name.value)),
            ("from", _) => from = Some(name),
            ("to", _) => to = Some(name),
            (word_, _) => {
                let known = [&words[..], &["from", "to"]].concat();
                return Err(BadYaml::unknown_key(word.at, word_, &known));
            }
        }
    }
    let [(kind, name)] = kinds[..] else {
        let reason = format!("`{key}` does not name one event");
        let hint = format!("it has one of {}", words.join(", "));
        return Err(BadYaml::new(part.at, reason, hint));
    };
    let has_ends = matches!(kind, EventKind::HandedOver | EventKind::Lifecycle);
    if let Some(end) = from.or(to).filter(|_| !has_ends) {
        let reason = format!("`{}` has no `from` and no `to`", kind.word());
        let hint = "only `handed_over` and `lifecycle` have one";
        return Err(BadYaml::new(end.at, reason, hint));
    }
    Ok(ExpectedEvent {
        kind,
        name: name.clone(),
        from: from.map(|from| from.value.clone()),
        to: to.map(|to| to.value.clone()),
    })
}
#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Expectation> {
        read(
            &format!("schema: {SCHEMA}\n{text}"),
            Path::new("graph.yaml"),
        )
    }

    #[test]
    fn all_expectations_are_parsed() {
        let all = parsed(
            "from: nav.mcap # for the reader\nperiod: 10s\n\
             policy: {unexpected_nodes: warn, unexpected_publishers: allow}\n\
             nodes:\n  /a: {}\n  /b:\n  /debug/*: {forbidden: true}\n  /c: {lifecycle: active, restarts: ..0, within: 20s}\n\
             topics:\n  /scan: {type: sensor_msgs/LaserScan, by: [/a], to: [/b], hz: 13.5..16.5, percent: 95, max_gap: 0.5s}\n\
             \x20 /map: {latched: true, hz: 1.., during: 5s..}\n\
             rules:\n  - {id: up, nodes: [/a, /b], within: ..20s}\n  - {id: drive, topic: /scan, hz: 10.., during: -30s..}\n\
             \x20 - {id: safe, when: {removed: /a}, expect: {handed_over: /t, to: /b}, within: 2s}\n\
             \x20 - {id: flap, node: /nav/*, restarts: ..1}\n  - {id: quiet, during: -30s.., changes: ..0}\n",
        )
        .unwrap();
        assert_eq!(
            (all.nodes.len(), all.topics.len(), all.rules.len()),
            (4, 2, 5)
        );
        assert_eq!(all.policy.value.unexpected_nodes, Unlisted::Warn);
        assert_eq!(all.policy.value.starved, Unlisted::Warn);
        let scan = &all.topics[0];
        assert_eq!((scan.at.line, scan.at.column), (11, 3));
        assert_eq!(scan.facts.hz.as_ref().map(|hz| hz.at.line), Some(11));
        let by = scan.facts.by.as_ref().map(|by| by.value.0[0].at.column);
        let kind = scan
            .facts
            .kinds
            .as_ref()
            .map(|kinds| kinds.value.0[0].at.column);
        assert_eq!((by, kind), (Some(45), Some(17)));
        let within = |text: &str| {
            let all = parsed(&format!("nodes:\n  /a: {{within: {text}}}")).unwrap();
            all.nodes[0].facts.within.clone()
        };
        assert_eq!(within("20s"), within("..20"));
    }

    #[test]
    fn mistakes_have_line_column_and_nearest_name() {
        let table = [
            (
                "topics:\n  /s: {hx: 5..}",
                "line 3, column 8: unknown key `hx`; the nearest is `hz`",
            ),
            (
                "topic:\n  /s: {}",
                "line 2, column 1: unknown key `topic`; the nearest is `topics`",
            ),
            (
                "topics:\n  /s: {hz: 5}",
                "line 3, column 12: `hz: 5` is not valid",
            ),
            ("nodes: [/a]", "line 2, column 8: `nodes` is not a mapping"),
            ("nodes:\n  /a: {}\n  /a: {}", "line 4"),
            ("rules:\n  - {node: /a, restarts: ..1}", "`id` is missing"),
            ("rules:\n  - {id: x}", "the rule has no subject"),
            ("rules:\n  - {id: x, node: /a}", "has no condition"),
            (
                "rules:\n  - {id: x, node: /a, hz: 5..}",
                "`hz` cannot be combined with `node`",
            ),
            (
                "rules:\n  - {id: x, changes: ..0}\n  - {id: x, changes: ..0}",
                "two rules have the id `x`",
            ),
            (
                "rules:\n  - {id: x, when: {removed: /a, to: /b}, expect: {added: /b}, within: 1}",
                "has no `from`",
            ),
            (
                "topics:\n  /s: {by: [/a, [/b]]}",
                "line 3, column 17: this is not a string",
            ),
            (
                "topics:\n  /s: {by: {a: b}}",
                "`by` is not a name or a list of names",
            ),
            (
                "topics:\n  /s: {max_gap: }",
                "line 3, column 15: `max_gap` has no value",
            ),
            (
                "topics:\n  /s: {lifecycle: active}",
                "line 3, column 8: unknown key `lifecycle`",
            ),
            (
                "nodes:\n  /a: {optional: maybe}",
                "line 3, column 18: `optional: maybe` is not valid",
            ),
            ("rules: 5", "line 2, column 8: `rules` is not a list"),
            (
                "rules:\n  - {id: x, when: {remvoed: /a}, expect: {added: /b}, within: 1}",
                "unknown key `remvoed`; the nearest is `removed`",
            ),
            (
                "rules:\n  - {id: x, when: {removed: /a}, expect: {added: /b}, within: 1..2}",
                "line 3, column 69: `within` is not a length of time",
            ),
            (
                "policy: {unexpected_nodes: deny}",
                "`unexpected_nodes: deny` is not valid",
            ),
        ];
        for (text, says) in table {
            let error = parsed(text).unwrap_err().to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
        let none = read("nodes: {}\n", Path::new("g.yaml")).unwrap_err();
        assert!(none.to_string().contains("`schema` is missing"), "{none}");
    }
}
