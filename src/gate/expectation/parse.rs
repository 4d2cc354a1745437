//! Reads `graph.yaml`. An unknown key or word is an error with its line, its column, and the nearest known one.

use std::path::Path;

use super::fields::{Document, Fields};
use super::{
    AllowedFinding, Demand, EventKind, Expectation, ExpectedEvent, Named, NodeFacts, Policy,
    REMARKS, Rule, SCHEMA, TopicFacts, Unlisted, While, YamlPlace,
};
use crate::base::error::Result;
use crate::base::time::{Moment, Period, Stamp};
use crate::base::yaml::{YamlPart, parse_placed};
use crate::gate::FindingKind;
use crate::gate::measure::MEASURES;
use crate::gate::pattern::Pattern;

/// The keys of the whole file, and of each part of it.
const FILE: &str = "schema from period policy nodes topics rules allow";
const POLICY: &str = "unexpected_nodes unexpected_topics unexpected_publishers starved duplicate_names messages_lost";
const NODE: &str = "forbidden optional may_end known_by restarts lifecycle present_within within";
const TOPIC: &str = "forbidden optional may_end type by to hz mean_hz percent max_gap within age bytes drops latched qos";
const EVENT: &str = "added removed restarted silent handed_over rate lifecycle from to";
const ALLOW: &str = "finding name until why";
/// The keys that determine the form of a rule, each with the other allowed keys.
const FORMS: [(&str, &str); 6] = [
    ("node", NODE),
    ("nodes", NODE),
    (
        "topic",
        "hz mean_hz percent max_gap within age bytes drops by to type latched qos may_end optional forbidden while during",
    ),
    ("appear_in_order", ""),
    ("when", "expect within"),
    ("changes", "during"),
];
const RULE: &str = "id node nodes topic appear_in_order when changes expect within while during forbidden optional may_end \
    known_by restarts lifecycle present_within type by to hz mean_hz percent max_gap age bytes drops latched qos";

/// Reads an expectation.
///
/// # Errors
/// [`crate::Error::BadFile`] for a text that is not YAML, expands too far, or contains an unknown key or word.
pub(crate) fn read(text: &str, path: &Path) -> Result<Expectation> {
    let document = Document { path };
    let whole = parse_placed(text).map_err(|bad| {
        let hint = "the file must be YAML: `name: {key: value}`";
        document.bad(bad.at, bad.reason, hint)
    })?;
    let fields = document.fields(&whole, "the file", FILE)?;
    let hint = format!("the first line must be `schema: {SCHEMA}`");
    let schema = fields.need("schema", &hint)?;
    let is_known = |text: &str| (text == SCHEMA).then_some(());
    fields.read("schema", &hint, is_known)?;
    if let Some(from) = fields.get("from") {
        document.text(from, "`from`")?;
    }
    Ok(Expectation {
        file: path.to_owned(),
        period: fields
            .read("period", "write `60s`, `1m` or `500ms`", Period::parse)?
            .map(|p| p.value),
        policy: policy(&fields, schema.at)?,
        nodes: section(&fields, "nodes", NODE, node)?,
        topics: section(&fields, "topics", TOPIC, topic)?,
        rules: rules(&fields)?,
        allow: each(&fields, "allow", allowance)?,
    })
}

fn policy(file: &Fields<'_>, top: YamlPlace) -> Result<Policy> {
    let mut policy = Policy {
        at: top,
        nodes: Unlisted::Allow,
        topics: Unlisted::Allow,
        publishers: Unlisted::Error,
        remarks: [Unlisted::Warn; REMARKS.len()],
    };
    let Some(part) = file.get("policy") else {
        return Ok(policy);
    };
    let fields = file.document.fields(part, "`policy`", POLICY)?;
    let closed = |key: &str, usual: Unlisted| {
        let parse = |text: &str| match text {
            "allow" => Some(Unlisted::Allow),
            "warn" => Some(Unlisted::Warn),
            "error" => Some(Unlisted::Error),
            _ => None,
        };
        let found = fields.read(key, "write `allow`, `warn` or `error`", parse)?;
        Ok(found.map_or(usual, |found| found.value))
    };
    policy.at = part.at;
    policy.nodes = closed("unexpected_nodes", policy.nodes)?;
    policy.topics = closed("unexpected_topics", policy.topics)?;
    policy.publishers = closed("unexpected_publishers", policy.publishers)?;
    for ((key, ..), remark) in REMARKS.iter().zip(&mut policy.remarks) {
        *remark = closed(key, *remark)?;
    }
    Ok(policy)
}

/// Reads a mapping from names to their expectations.
fn section<T>(
    file: &Fields<'_>,
    key: &'static str,
    known: &'static str,
    facts: impl Fn(&Fields<'_>) -> Result<T>,
) -> Result<Vec<Named<T>>> {
    let Some(part) = file.get(key) else {
        return Ok(Vec::new());
    };
    let mut all = Vec::new();
    for (name, at, value) in file.document.pairs(part, &format!("`{key}`"))? {
        let what = format!("`{name}`");
        all.push(Named {
            name: Pattern::new(name),
            at: *at,
            body: value.at,
            facts: facts(&file.document.fields(value, &what, known)?)?,
        });
    }
    Ok(all)
}

/// Reads the members of a list.
fn each<T>(
    file: &Fields<'_>,
    key: &str,
    one: impl Fn(Document<'_>, &YamlPart) -> Result<T>,
) -> Result<Vec<T>> {
    let Some(part) = file.get(key) else {
        return Ok(Vec::new());
    };
    let list = file.document.list(part, &format!("`{key}`"))?;
    list.iter().map(|part| one(file.document, part)).collect()
}

fn node(fields: &Fields<'_>) -> Result<NodeFacts> {
    Ok(NodeFacts {
        forbidden: fields.is_set("forbidden")?,
        optional: fields.is_set("optional")?,
        may_end: fields.may_end()?,
        is_logged: fields
            .read("known_by", "write `known_by: log`", |text| {
                (text == "log").then_some(())
            })?
            .is_some(),
        restarts: fields.range("restarts")?,
        lifecycle: fields.string("lifecycle")?,
        within: fields.within()?,
    })
}

fn topic(fields: &Fields<'_>) -> Result<TopicFacts> {
    let mut measures = [None; MEASURES.len()];
    for (own, measure) in measures.iter_mut().zip(&MEASURES) {
        *own = fields.read(measure.key, measure.hint, |text| measure.range(text))?;
    }
    let share = |text: &str| text.parse().ok().filter(|p| (0.0..=100.0).contains(p));
    Ok(TopicFacts {
        forbidden: fields.is_set("forbidden")?,
        optional: fields.is_set("optional")?,
        may_end: fields.may_end()?,
        kinds: fields.names("type")?,
        by: fields.names("by")?,
        to: fields.names("to")?,
        hz: fields.range("hz")?,
        mean_hz: fields.range("mean_hz")?,
        within: fields.within()?,
        percent: fields
            .read("percent", "write 0 to 100", share)?
            .map(|p| p.value),
        max_gap: fields.length("max_gap")?,
        measures,
        latched: fields.flag("latched")?,
        qos: fields.string("qos")?,
        during: None,
        whilst: None,
    })
}

fn rules(file: &Fields<'_>) -> Result<Vec<Rule>> {
    let rules = each(file, "rules", rule)?;
    for (at, rule) in rules.iter().enumerate() {
        if rules[..at].iter().any(|other| other.id == rule.id) {
            let reason = format!("two rules have the id `{}`", rule.id);
            return Err(file.document.bad(rule.at, reason, "give it another `id`"));
        }
    }
    Ok(rules)
}

fn rule(document: Document<'_>, part: &YamlPart) -> Result<Rule> {
    let fields = document.fields(part, "a rule", RULE)?;
    let id = fields.need("id", "every rule has an `id: a-name`")?;
    let id = document.text(id, "`id`")?.to_owned();
    let form = FORMS.iter().find(|(key, _)| fields.get(key).is_some());
    let Some((form, with)) = form else {
        let hint = format!("a rule has one of {}", FORMS.map(|(key, _)| key).join(", "));
        return Err(document.bad(part.at, "the rule has no subject", hint));
    };
    let together = with.replace(' ', ", ");
    if let Some((key, at)) = fields.other(&format!("id {form} {with}")) {
        let reason = format!("`{key}` cannot be combined with `{form}`");
        let hint = format!("it can be combined with {together}");
        return Err(document.bad(at, reason, hint));
    }
    let demand = demand(&fields, form)?;
    let is_empty = match &demand {
        Demand::Nodes(_, facts) => *facts == NodeFacts::default(),
        Demand::Topic(_, facts) => {
            let only = TopicFacts {
                during: facts.during,
                whilst: facts.whilst.clone(),
                ..TopicFacts::default()
            };
            **facts == only
        }
        Demand::Order(names) => names.len() < 2,
        Demand::Reaction { .. } | Demand::Changes { .. } => false,
    };
    if is_empty {
        let hint = format!("`{form}` can be combined with {together}");
        return Err(document.bad(part.at, format!("the rule `{id}` has no condition"), hint));
    }
    Ok(Rule {
        id,
        at: part.at,
        demand,
    })
}

fn demand(fields: &Fields<'_>, form: &str) -> Result<Demand> {
    let lost = |key: &str| {
        fields
            .document
            .bad(fields.at, format!("`{key}` is missing"), "")
    };
    Ok(match form {
        "node" => {
            let name = fields.name("node")?.ok_or_else(|| lost("node"))?;
            Demand::Nodes(vec![name], node(fields)?)
        }
        "nodes" => {
            let names = fields.names("nodes")?.ok_or_else(|| lost("nodes"))?;
            Demand::Nodes(names.value, node(fields)?)
        }
        "topic" => {
            let name = fields.name("topic")?.ok_or_else(|| lost("topic"))?;
            let mut facts = topic(fields)?;
            facts.during = fields.during()?;
            facts.whilst = whilst(fields)?;
            Demand::Topic(name, Box::new(facts))
        }
        "appear_in_order" => {
            let names = fields.names(form)?.ok_or_else(|| lost(form))?;
            Demand::Order(names.value)
        }
        "when" => Demand::Reaction {
            when: event(fields, "when")?,
            expect: event(fields, "expect")?,
            within: fields
                .length("within")?
                .ok_or_else(|| lost("within"))?
                .value,
        },
        _ => Demand::Changes {
            during: fields.during()?,
            many: fields.range("changes")?.ok_or_else(|| lost(form))?.value,
        },
    })
}

fn whilst(fields: &Fields<'_>) -> Result<Option<While>> {
    let Some(part) = fields.get("while") else {
        return Ok(None);
    };
    let document = fields.document;
    let inner = document.fields(part, "`while`", "topic hz node")?;
    let rate = (
        inner.name("topic")?,
        inner.range("hz")?,
        inner.name("node")?,
    );
    match rate {
        (Some(topic), Some(hz), None) => Ok(Some(While::Rate(topic.value, hz.value))),
        (None, None, Some(node)) => Ok(Some(While::Node(node.value))),
        _ => Err(document.bad(
            part.at,
            "`while` is neither a topic with its rate nor a node",
            "write `while: {topic: /cmd_vel, hz: 1..}` or `while: {node: /teleop}`",
        )),
    }
}

fn event(rule: &Fields<'_>, key: &str) -> Result<ExpectedEvent> {
    let hint = "write `when: {removed: /a}, expect: {handed_over: /t, to: /b}, within: 2s`";
    let part = rule.need(key, hint)?;
    let document = rule.document;
    let fields = document.fields(part, "an event", EVENT)?;
    let mut found = Vec::new();
    for kind in EventKind::ALL {
        found.extend(fields.name(kind.word())?.map(|name| (kind, name.value)));
    }
    let [(kind, name)] = &found[..] else {
        let words = EventKind::ALL.map(EventKind::word).join(", ");
        let reason = format!("`{key}` does not name one event");
        return Err(document.bad(part.at, reason, format!("it has one of {words}")));
    };
    let ends = (fields.name("from")?, fields.name("to")?);
    let has_ends = matches!(kind, EventKind::HandedOver | EventKind::Lifecycle);
    if !has_ends && let Some(end) = ends.0.as_ref().or(ends.1.as_ref()) {
        let reason = format!("`{}` has no `from` and no `to`", kind.word());
        return Err(document.bad(
            end.at,
            reason,
            "only `handed_over` and `lifecycle` have one",
        ));
    }
    Ok(ExpectedEvent {
        kind: *kind,
        name: name.clone(),
        from: ends.0.map(|from| from.value),
        to: ends.1.map(|to| to.value),
    })
}

fn allowance(document: Document<'_>, part: &YamlPart) -> Result<AllowedFinding> {
    let fields = document.fields(part, "an allowance", ALLOW)?;
    let finding = fields.need("finding", "name the finding, such as `topic-rate-low`")?;
    let word = document.text(finding, "`finding`")?;
    let kind = FindingKind::from_word(word);
    let unknown = || document.unknown(finding.at, "finding", word, FindingKind::words());
    let hint = "every allowance needs a `why`";
    fields.need("why", hint)?;
    fields.need("name", "name the node or topic")?;
    let date = "write a date: `2027-01-31`, or RFC 3339";
    Ok(AllowedFinding {
        at: part.at,
        finding: kind.ok_or_else(unknown)?,
        name: fields
            .name("name")?
            .map_or_else(|| Pattern::new(""), |name| name.value),
        until: fields.read("until", date, day)?,
        why: fields
            .string("why")?
            .map_or_else(String::new, |why| why.value),
    })
}

/// Reads the end of a day in UTC, or a point in time.
fn day(text: &str) -> Option<Stamp> {
    const DAY: i64 = 86_400_000_000_000;
    let midnight = Moment::parse(&format!("{text}T00:00:00Z"));
    match (midnight, Moment::parse(text)) {
        (Some(Moment::Absolute(at)), _) => Some(at.plus(DAY)),
        (_, Some(Moment::Absolute(at))) => Some(at),
        _ => None,
    }
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
             nodes:\n  /a: {}\n  /b:\n  /debug/*: {forbidden: true}\n  /c: {lifecycle: active, restarts: ..0, present_within: 20s}\n\
             topics:\n  /scan: {type: sensor_msgs/LaserScan, by: [/a], to: [/b], hz: 13.5..16.5, percent: 95, max_gap: 0.5s}\n  /map: {latched: true}\n\
             rules:\n  - {id: up, nodes: [/a, /b], present_within: 20s}\n  - {id: order, appear_in_order: [/a, /b]}\n\
             \x20 - {id: drive, topic: /scan, hz: 10.., while: {topic: /cmd_vel, hz: 1..}}\n\
             \x20 - {id: safe, when: {removed: /a}, expect: {handed_over: /t, to: /b}, within: 2s}\n\
             \x20 - {id: flap, node: /nav/*, restarts: ..1}\n  - {id: quiet, during: -30s.., changes: ..0}\n\
             allow:\n  - {finding: topic-rate-low, name: /scan, until: 2027-01-31, why: on loan}\n",
        )
        .unwrap();
        assert_eq!(
            (all.nodes.len(), all.topics.len(), all.rules.len()),
            (4, 2, 6)
        );
        assert_eq!(all.policy.nodes, Unlisted::Warn);
        let scan = &all.topics[0];
        assert_eq!((scan.at.line, scan.at.column), (11, 3));
        assert_eq!(scan.facts.hz.as_ref().map(|hz| hz.at.line), Some(11));
        let until = all.allow[0].until.as_ref().map(|u| u.value.to_string());
        assert_eq!(until.as_deref(), Some("2027-02-01T00:00:00Z"));
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
                "allow:\n  - {finding: topic-rate-lo, name: /s, why: x}",
                "unknown finding `topic-rate-lo`; the nearest is `topic-rate-low`",
            ),
            (
                "allow:\n  - {finding: topic-rate-low, name: /s}",
                "`why` is missing",
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
