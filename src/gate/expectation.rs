//! The expectation of a mission, `graph.yaml`: its keys and values with their positions, and how they are read.

use std::collections::BTreeSet;
use std::fmt;
use std::ops::Deref;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::{Deserializer, Error as _, IgnoredAny, SeqAccess, Visitor};

use super::values::{During, MEASURES, Measure, Pattern, Range};
use crate::base::error::{Error, Result};
use crate::base::time::{Period, parse_nanos};
use crate::base::words::worded;
use crate::base::yaml::{self, BadYaml, Keyed, Pairs};
pub(crate) use crate::base::yaml::{At, YamlPlace};

/// The first line of every expectation.
pub(crate) const SCHEMA: &str = "bagreel.expect/1";
/// The keys of a node, and those of a topic.
const NODE: &str = "forbidden optional may_end known_by restarts lifecycle within";
const TOPIC: &str = "forbidden optional may_end type by to hz mean_hz percent max_gap within age bytes drops latched qos \
    during";
/// The keys that determine the form of a rule, each with the other allowed keys.
const FORMS: [(&str, &str); 3] = [("nodes", NODE), ("topic", TOPIC), ("changes", "during")];

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
    /// The range of the number of changes.
    Changes { during: During, many: Range },
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

/// The keys of a node, a topic or a rule. [`section`] and [`rule`] refuse those that do not belong there.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
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
    nodes: Fact<Names>,
    topic: Fact<Pattern>,
    changes: Fact<Range>,
}

impl Entry {
    /// Whether any fact requires messages.
    pub(crate) fn wants_messages(&self) -> bool {
        let is_rated = self.hz.is_some() || self.mean_hz.is_some() || self.max_gap.is_some();
        is_rated || self.within.is_some() || self.measures().any(|(_, range)| range.is_some())
    }

    /// The ranges of measures of messages in every window.
    pub(crate) fn measures(&self) -> impl Iterator<Item = (&Measure, Fact<Range>)> {
        let age = self.age.map(|own| own.map(|range| range.0));
        let bytes = self.bytes.map(|own| own.map(|range| range.0));
        let drops = self.drops.map(|own| own.map(|range| range.0));
        MEASURES.iter().zip([age, bytes, drops].map(Fact))
    }

    /// The times in which an element may end, unless it may at any time.
    pub(crate) fn limit(&self) -> Fact<MayEnd> {
        Fact(self.may_end.filter(|limit| limit.value.0 != During::WHOLE))
    }

    /// Whether later windows leave the judgement of earlier ones as it is.
    pub(crate) fn is_fixed(&self) -> bool {
        let during = self.during.as_ref();
        self.percent.is_none() && during.is_none_or(|during| during.value.is_fixed())
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
    pub(crate) starved: Unlisted,
    pub(crate) duplicate_names: Unlisted,
    pub(crate) messages_lost: Unlisted,
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
    parse(text, path).map_err(|bad| {
        let hint = match bad.hint.as_str() {
            "" => "the file must be YAML: `name: {key: value}`",
            hint => hint,
        };
        Error::bad_place(path, [bad.at.line, bad.at.column], &bad.reason, hint)
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
        check_keys(&entry.keys, &known)?;
        Ok(Named {
            name: Pattern::new(&name.value),
            at: name.at,
            facts: entry.value,
        })
    });
    named.collect()
}

/// Refuses keys that are none of these.
fn check_keys(keys: &[At<String>], known: &[&str]) -> Result<(), BadYaml> {
    match keys.iter().find(|key| !known.contains(&&*key.value)) {
        Some(key) => Err(BadYaml::unknown_key(key.at, &key.value, known)),
        None => Ok(()),
    }
}

fn rule(At { at, value }: At<Keyed<Entry>>) -> Result<Rule, BadYaml> {
    let (keys, mut entry) = (value.keys, value.value);
    let known = FORMS.map(|(form, with)| with.split(' ').chain([form]));
    let known: BTreeSet<&str> = known.into_iter().flatten().chain(["id"]).collect();
    check_keys(&keys, &known.into_iter().collect::<Vec<_>>())?;
    let Some(At { value: id, .. }) = entry.id.0.take() else {
        let hint = "every rule has an `id: a-name`";
        return Err(BadYaml::new(at, "`id` is missing", hint));
    };
    let has = |form: &str| keys.iter().any(|key| key.value == form);
    let Some((form, with)) = FORMS.iter().find(|(form, _)| has(form)) else {
        let hint = format!("a rule has one of {}", FORMS.map(|(key, _)| key).join(", "));
        return Err(BadYaml::new(at, "the rule has no subject", hint));
    };
    let hint = format!("`{form}` can be combined with {}", with.replace(' ', ", "));
    let is_fact = |key: &&At<String>| ![*form, "id"].contains(&&*key.value);
    let mut others = keys.iter().filter(is_fact);
    let is_other = |key: &&At<String>| with.split(' ').all(|own| own != key.value);
    if let Some(key) = others.clone().find(is_other) {
        let reason = format!("`{}` cannot be combined with `{form}`", key.value);
        return Err(BadYaml::new(key.at, reason, hint));
    }
    let demand = if let Some(many) = entry.changes.0 {
        let during = entry.during.as_ref();
        Demand::Changes {
            during: during.map_or(During::WHOLE, |during| during.value),
            many: many.value,
        }
    } else if others.all(|key| key.value == "during") {
        let reason = format!("the rule `{id}` has no condition");
        return Err(BadYaml::new(at, reason, hint));
    } else if let Some(name) = entry.topic.0.take() {
        Demand::Topic(name, Box::new(entry))
    } else {
        let names = entry.nodes.0.take();
        let names = names.map_or_else(Vec::new, |names| names.value.0);
        Demand::Nodes(names, Box::new(entry))
    };
    Ok(Rule { id, at, demand })
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
             \x20 - {id: flap, nodes: /nav/*, restarts: ..1}\n  - {id: quiet, during: -30s.., changes: ..0}\n",
        )
        .unwrap();
        assert_eq!(
            (all.nodes.len(), all.topics.len(), all.rules.len()),
            (4, 2, 4)
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
            ("rules:\n  - {nodes: /a, restarts: ..1}", "`id` is missing"),
            ("rules:\n  - {id: x}", "the rule has no subject"),
            (
                "rules:\n  - {id: x, node: /a}",
                "line 3, column 13: unknown key `node`; the nearest is `nodes`",
            ),
            ("rules:\n  - {id: x, nodes: /a}", "has no condition"),
            (
                "rules:\n  - {id: x, nodes: /a, hz: 5..}",
                "`hz` cannot be combined with `nodes`",
            ),
            (
                "rules:\n  - {id: x, changes: ..0}\n  - {id: x, changes: ..0}",
                "two rules have the id `x`",
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
