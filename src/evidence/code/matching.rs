//! The edges of the code that are drawn: those of nodes that the bag names, where topic and type are recorded under
//! exactly these names.
//!
//! On 182 public repositories, 179 of 184 edges were right by this rule (97 %). With suffixes or patterns of
//! names fewer were right, and of all edges of the best launch file only 63 %: wrong edges nearly always come
//! from nodes that did not run.

use std::collections::{BTreeMap, BTreeSet};

use super::Code;
use super::declaration::{Role, type_key};
use super::only;
use super::workspace::{FileDeclaration, Instance};
use crate::base::name::{is_player, is_recorder, last_part, namespace};
use crate::base::notice::{Notice, NoticeKind};
use crate::base::words::{count, some_of};
use crate::evidence::inference::{Conclusions, ElementKey, Inference, Validity};
use crate::evidence::observation::{Confidence, Name};
use crate::evidence::{source_id, source_word};

/// An edge that the code declares for a node of the bag.
#[derive(Clone, Debug)]
pub(super) struct Match<'a> {
    pub(super) role: Role,
    pub(super) topic: Name,
    pub(super) instance: &'a Instance,
    pub(super) placed: &'a FileDeclaration,
}

/// The topics of the bag.
pub(super) struct RecordedTopics {
    /// By name: the topic and its types.
    topics: BTreeMap<String, (Name, BTreeSet<String>)>,
    /// Topics with known publishers in their messages.
    pub(super) stated: BTreeSet<Name>,
    /// Elements known already, by more than a declaration.
    proved: BTreeSet<ElementKey>,
}

/// The outcome of reading the code.
#[derive(Debug, Default)]
pub(crate) struct Outcome {
    /// Notices about the amount read and found.
    pub(crate) notices: Vec<Notice>,
    /// Declarations that may belong to the bag and were not drawn, and other remarks; one per line.
    pub(crate) undrawn: Vec<String>,
}

/// The code of the nodes that the bag names.
#[derive(Default)]
struct NamedCode {
    /// The number of edges drawn, and of nodes that they belong to.
    drawn: (usize, usize),
    /// Programs whose nodes the bag names.
    explained: BTreeSet<(String, String)>,
    remarks: BTreeSet<String>,
    /// Nodes without code.
    without: Vec<String>,
}

/// Adds the edges that the code declares for nodes in the bag, and, if requested, the only possible declarations.
pub(crate) fn conclude(
    code: &Code,
    known: &mut Conclusions<'_>,
    owner: only::Owner<'_>,
) -> Outcome {
    let recorded = RecordedTopics::of(known);
    let named = named(known);
    let found = draw_named(code, known, &recorded, &named);
    let known_nodes = named.keys().cloned().collect();
    let logged = named.values().any(|(_, words)| words.contains("rosout"));
    let bag = only::BagTopics {
        recorded: &recorded,
        explained: &found.explained,
        named: &known_nodes,
        logged,
        owner,
    };
    let (inferred, undrawn) = only::conclude(code, known, &bag);
    let mut notices = code.notices.clone();
    notices.push(summary(code, found.drawn, inferred, &undrawn));
    let mut lines: Vec<String> = undrawn
        .iter()
        .map(|(reason, text)| format!("{text}: {}", reason.word()))
        .collect();
    lines.extend(found.remarks);
    if !found.without.is_empty() && !code.instances.is_empty() {
        let without = some_of(&found.without, MOST_NAMES);
        lines.push(format!("no code was found for {without}"));
    }
    Outcome {
        notices,
        undrawn: lines,
    }
}

/// Adds the edges that the code declares for nodes in the bag.
fn draw_named(
    code: &Code,
    known: &mut Conclusions<'_>,
    recorded: &RecordedTopics,
    named: &NamedNodes,
) -> NamedCode {
    let mut by_name: BTreeMap<&str, Vec<&Instance>> = BTreeMap::new();
    for instance in &code.instances {
        by_name
            .entry(last_part(&instance.name))
            .or_default()
            .push(instance);
    }
    let mut all = NamedCode::default();
    for (text, (node, words)) in named {
        let candidates = by_name
            .get(last_part(text))
            .or_else(|| by_name.get(without_numbers(last_part(text))));
        let Some(candidates) = candidates else {
            all.without.push(text.clone());
            continue;
        };
        let matches = best(candidates, text, recorded);
        let mut drawn = 0;
        for found in &matches {
            drawn += usize::from(draw(known, recorded, (*node, words), found));
            all.explained.insert(found.instance.program.clone());
        }
        if let Some(found) = matches.first() {
            let remarks = remarks_on(found.instance, text, recorded);
            all.remarks.extend(remarks);
        }
        all.drawn.0 += drawn;
        all.drawn.1 += usize::from(drawn > 0);
    }
    all
}

/// The most nodes without code that are named.
const MOST_NAMES: usize = 8;

/// `412 files of 6 packages read; 22 edges for 4 named nodes; 6 declarations not drawn (4: …, 2:
/// …)`
fn summary(
    code: &Code,
    (edges, nodes): (usize, usize),
    inferred: usize,
    undrawn: &only::Undrawn,
) -> Notice {
    let mut text = format!(
        "{} of {} read; {} for {}",
        count(code.files, "file"),
        count(code.packages, "package"),
        count(edges, "edge"),
        count(nodes, "named node")
    );
    if inferred > 0 {
        text.extend(["; ", &count(inferred, "inferred edge")]);
    }
    if !undrawn.is_empty() {
        let mut reasons: BTreeMap<only::NotDrawn, usize> = BTreeMap::new();
        for (reason, _) in undrawn {
            *reasons.entry(*reason).or_default() += 1;
        }
        let reasons: Vec<String> = reasons
            .iter()
            .map(|(r, n)| format!("{n}: {}", r.word()))
            .collect();
        text.extend([
            "; ",
            &count(undrawn.len(), "place"),
            " not drawn (",
            &reasons.join(", "),
            ")",
        ]);
        text.push_str("; `bagreel info --source` lists them");
    }
    Notice::new(NoticeKind::Note, text)
}

/// Remarks about the code of a node that ran: topics that are missing in the bag or have another type there.
fn remarks_on(instance: &Instance, node: &str, recorded: &RecordedTopics) -> Vec<String> {
    let remark = |placed: &FileDeclaration| {
        let declaration = &placed.declaration;
        let name = remapped(
            &resolved(node, declaration.topic.as_ref()?),
            node,
            &instance.remaps,
        );
        let place = format!("{}:{}", placed.path, declaration.line);
        let types = declaration.types.join(" or ");
        match recorded.topics.get(&name) {
            None => {
                let does = declaration.role.word();
                Some(format!(
                    "{node} {does} {name} by its code ({place}), which is not recorded: record it too"
                ))
            }
            Some((_, kinds))
                if !types.is_empty() && !declaration.types.iter().any(|t| kinds.contains(t)) =>
            {
                let kinds: Vec<&str> = kinds.iter().map(String::as_str).collect();
                Some(format!(
                    "{name} is {} in the bag and {types} in the code of {node} ({place})",
                    kinds.join(" and ")
                ))
            }
            Some(_) => None,
        }
    };
    instance.declared.iter().filter_map(remark).collect()
}

impl RecordedTopics {
    fn of(known: &Conclusions<'_>) -> Self {
        let mut all = Self {
            topics: BTreeMap::new(),
            stated: BTreeSet::new(),
            proved: known
                .inferences
                .iter()
                .filter(|p| p.confidence != Confidence::Declared)
                .map(|p| p.what)
                .collect(),
        };
        for stream in known.streams {
            // Some programs write their own bags, with names as in the code.
            let topic = format!("/{}", known.text(stream.topic).trim_start_matches('/'));
            let (_, types) = all
                .topics
                .entry(topic)
                .or_insert_with(|| (stream.topic, BTreeSet::new()));
            types.insert(type_key(&stream.connection.type_name));
            if stream.publisher.is_some() {
                all.stated.insert(stream.topic);
            }
        }
        all
    }

    /// Whether a topic of a program, if it ran as this node, was recorded with another type.
    pub(super) fn contradicts(&self, instance: &Instance, node: &str) -> bool {
        instance.declared.iter().any(|placed| {
            let declaration = &placed.declaration;
            let written = declaration.topic.as_ref();
            let name =
                written.map(|topic| remapped(&resolved(node, topic), node, &instance.remaps));
            let recorded = name.and_then(|name| self.topics.get(&name));
            let is_known = !declaration.types.is_empty();
            is_known
                && recorded
                    .is_some_and(|(_, kinds)| !declaration.types.iter().any(|t| kinds.contains(t)))
        })
    }

    /// The recorded topic of this name, if one of the types is its own.
    pub(super) fn topic(&self, name: &str, types: &[String]) -> Option<Name> {
        let (topic, recorded) = self.topics.get(name)?;
        types.iter().any(|t| recorded.contains(t)).then_some(*topic)
    }
}

/// Nodes by their names, with the words of the sources that name them.
type NamedNodes = BTreeMap<String, (Name, BTreeSet<&'static str>)>;

/// The nodes that the bag names by more than a declaration, and those of launch files that the user gives.
fn named(known: &Conclusions<'_>) -> NamedNodes {
    let mut named = NamedNodes::new();
    let launch = source_id("launch");
    let is_named = |p: &&Inference| p.confidence != Confidence::Declared || p.source == launch;
    for inference in known.inferences.iter().filter(is_named) {
        let node = match inference.what {
            ElementKey::Node(node)
            | ElementKey::Publish(node, _)
            | ElementKey::Subscribe(_, node) => node,
            ElementKey::Topic(_) => continue,
        };
        let text = known.text(node);
        if !is_recorder(&text) && !is_player(&text) {
            let (_, words) = named
                .entry(text.to_string())
                .or_insert((node, BTreeSet::new()));
            words.extend([source_word(inference.source)]);
        }
    }
    named
}

/// A name without its anonymous numbers: `talker_4711_1600000000000` is `talker`.
fn without_numbers(name: &str) -> &str {
    let cut = |name: &'_ str| -> Option<usize> {
        let (rest, number) = name.rsplit_once('_')?;
        (!number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())).then_some(rest.len())
    };
    let first = cut(name).map_or(name, |at| &name[..at]);
    cut(first).map_or(name, |at| &name[..at])
}

/// The declarations of the best of several programs that may be this node: the one with most of its topics recorded.
/// If several are equally good, those that all of them declare.
fn best<'a>(candidates: &[&'a Instance], node: &str, recorded: &RecordedTopics) -> Vec<Match<'a>> {
    let is_real = |i: &&&Instance| !i.is_test;
    let real: Vec<&Instance> = candidates.iter().filter(is_real).copied().collect();
    let candidates = if real.is_empty() { candidates } else { &real };
    let matches = |i: &&'a Instance| matches(i, node, recorded);
    let mut all: Vec<Vec<Match<'a>>> = candidates.iter().map(matches).collect();
    let most = all.iter().map(Vec::len).max().unwrap_or(0);
    all.retain(|matches| matches.len() == most && most > 0);
    let Some((first, others)) = all.split_first() else {
        return Vec::new();
    };
    let is_in = |m: &Match<'_>, all: &[Match<'_>]| {
        all.iter().any(|o| (o.role, o.topic) == (m.role, m.topic))
    };
    let common = first
        .iter()
        .filter(|m| others.iter().all(|all| is_in(m, all)));
    common.cloned().collect()
}

/// The edges of an instance that are confirmed by the bag's topics, if it ran under this name; one per role and topic.
pub(super) fn matches<'a>(
    instance: &'a Instance,
    node: &str,
    recorded: &RecordedTopics,
) -> Vec<Match<'a>> {
    let mut found: Vec<Match<'a>> = Vec::new();
    for placed in instance.declared.iter() {
        let Some(written) = &placed.declaration.topic else {
            continue;
        };
        let name = remapped(&resolved(node, written), node, &instance.remaps);
        let role = placed.declaration.role;
        if let Some(topic) = recorded.topic(&name, &placed.declaration.types)
            && !found.iter().any(|m| (m.role, m.topic) == (role, topic))
        {
            found.push(Match {
                role,
                topic,
                instance,
                placed,
            });
        }
    }
    found
}

/// The resolved name of a topic as written in a node of this name.
pub(super) fn resolved(node: &str, topic: &str) -> String {
    let joined = match (topic.strip_prefix('/'), topic.strip_prefix('~')) {
        (Some(absolute), _) => format!("/{absolute}"),
        (_, Some(private)) => format!("{node}/{private}"),
        _ => format!("{}/{topic}", namespace(node)),
    };
    let parts: Vec<&str> = joined.split('/').filter(|part| !part.is_empty()).collect();
    format!("/{}", parts.join("/"))
}

fn remapped(topic: &str, node: &str, remaps: &[(String, String)]) -> String {
    let found = remaps
        .iter()
        .rev()
        .find(|(from, _)| resolved(node, from) == topic);
    found.map_or_else(|| topic.to_owned(), |(_, to)| resolved(node, to))
}

/// Adds an edge unless the bag already contains or contradicts it; returns whether it was added.
fn draw(
    known: &mut Conclusions<'_>,
    recorded: &RecordedTopics,
    (node, words): (Name, &BTreeSet<&str>),
    found: &Match<'_>,
) -> bool {
    let what = found.role.edge(node, found.topic);
    let has_room = found.role == Role::Subscribes || has_room(known, recorded, found.topic);
    if recorded.proved.contains(&what) || !has_room || known.denies(what) {
        return false;
    }
    let when = Validity::Like(ElementKey::Node(node));
    let inference = Inference::new(source_id("source"), what, Confidence::Declared, when);
    known.because(inference, None, |_| sentence(found, words));
    true
}

/// Whether a topic may have another unknown publisher: its messages do not name theirs, and more publishers were
/// offered than are known.
fn has_room(known: &Conclusions<'_>, recorded: &RecordedTopics, topic: Name) -> bool {
    let publishers = known.publishers(topic).count();
    let offered = known.offers(topic).map_or(1, |n| n.max(1) as usize);
    !recorded.stated.contains(&topic) && publishers < offered
}

/// `arm/servo.py:41  create_subscription(…); the node is named by rosout; launched at arm.launch.py:67`
fn sentence(found: &Match<'_>, words: &BTreeSet<&str>) -> String {
    let declaration = &found.placed.declaration;
    let words: Vec<&str> = words.iter().copied().collect();
    let mut text = format!(
        "{}:{}  {}; the node is named by {}",
        found.placed.path,
        declaration.line,
        declaration.text,
        words.join(", ")
    );
    if declaration.is_momentary {
        text.push_str("; for one message");
    }
    if let Some((path, line)) = &found.instance.launched {
        text.extend(["; launched at ", path, ":", &line.to_string()]);
    }
    text
}
