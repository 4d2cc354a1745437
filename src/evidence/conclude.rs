//! Conclusions from everything recorded: the inferences of all sources and of the user's files, and stated
//! values. Made once, independent of windows.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::sync::Arc;

use super::collector::{Recorded, spool_error};
use crate::base::error::Result;
use crate::base::ids::{ById, Few};
use crate::base::name::{SERVICE, is_service, namespace};
use crate::base::nearest::nearest;
use crate::base::notice::{Notice, NoticeKind, Notices};
use crate::base::time::{Span, Stamp};
use crate::evidence::given::launch::ANONYMOUS;
use crate::evidence::given::{NamedElement, Topology, TopologyEntry};
use crate::evidence::inference::{
    Conclusions, ElementKey, Incident, IncidentKind, Inference, Stream, Validity, offers,
};
use crate::evidence::observation::{LoggedText, Measurement, Name, Observation, Observations};
use crate::evidence::{Confidence, EvidenceLine, SOURCES, source_id, source_word, unknown};

#[cfg(feature = "source")]
use crate::evidence::code::{Code, matching};

/// Additions to the contents of the bags.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ConcludeOptions {
    /// Nodes and edges given by the user.
    pub topology: Topology,
    /// Declarations in source code.
    #[cfg(feature = "source")]
    pub code: Option<Arc<Code>>,
}

/// The conclusions from everything recorded, with names numbered in the order of their texts.
#[derive(Debug)]
pub struct Findings {
    /// The mission's first and last moment.
    pub(crate) mission: (Stamp, Stamp),
    /// The connections, as in [`Recorded`] except for the numbers of names.
    pub(crate) streams: Vec<Stream>,
    /// Every inference about an element.
    pub(crate) inferences: Vec<Inference>,
    /// Statements other than about which elements exist.
    pub(crate) incidents: Vec<Incident>,
    /// Publications, as node and topic, whose messages are byte-for-byte copies of another topic's.
    pub(crate) copies: BTreeSet<(Name, Name)>,
    /// Statistics of the messages of topics and edges.
    pub(crate) measured: Vec<Measurement>,
    /// Stated values of elements: types, states, quality of service.
    pub(crate) values: StatedValues,
    /// The number of publishers that the bags count on each topic; 0 if unknown.
    pub(crate) offers: ById<Name, u32>,
    /// The texts of all names.
    names: ById<Name, Arc<str>>,
    /// Every piece of evidence for [`super::collector::CollectOptions::why`], in order of time, source and text.
    pub lines: Vec<EvidenceLine>,
    /// Notices about the user's files.
    pub notices: Notices,
    /// Edges that source code declares and that were not drawn, one per line.
    pub undrawn: Vec<String>,
    /// The texts that nodes logged, sorted by time, each with the name of its node.
    pub(crate) logged: Vec<LoggedText>,
}

impl Findings {
    /// The text of a name.
    pub(crate) fn text(&self, name: Name) -> Arc<str> {
        let text = self.names.get(name);
        text.map_or_else(|| "".into(), Arc::clone)
    }
}

/// Draws every conclusion.
///
/// # Errors
/// If the temporary file of times cannot be read.
pub fn conclude(recorded: &Recorded, options: &ConcludeOptions) -> Result<Findings> {
    findings(recorded, options).map_err(spool_error)
}

fn findings(recorded: &Recorded, options: &ConcludeOptions) -> io::Result<Findings> {
    let (known, notices, undrawn) = concluded(recorded, options);
    let logged = known.logged();
    if let Some(error) = known.failed {
        return Err(error);
    }
    let mission = known.mission;
    let Conclusions {
        mut facts,
        mut inferences,
        mut incidents,
        copies,
        gone,
        ..
    } = known;
    // Neither their headers nor conclusions from these show that they exist.
    inferences.retain(|inference| {
        let [node, _] = inference.what.ends();
        let is_sign = !matches!(inference.when, Validity::Messages(_) | Validity::Like(_));
        is_sign || node.is_none() || !gone.contains(&node)
    });
    inferences.shrink_to_fit();
    let new = facts.renumber();
    let to = |name: Name| new.get(name).copied().unwrap_or(name);
    for inference in &mut inferences {
        inference.rename(&to);
    }
    for incident in &mut incidents {
        incident.what = incident.what.renamed(&to);
        if let IncidentKind::Switch(from, before) = &mut incident.kind {
            (*from, *before) = (to(*from), to(*before));
        }
    }
    let renamed = |stream: &Stream| Stream {
        topic: to(stream.topic),
        publisher: stream.publisher.map(to),
        ..stream.clone()
    };
    let streams: Vec<Stream> = recorded.streams.iter().map(renamed).collect();
    let mut lines = std::mem::take(&mut facts.pieces);
    lines.sort_unstable();
    lines.dedup();
    let measured = std::mem::take(&mut facts.measured);
    let mut values = StatedValues::new(&facts)?;
    for entry in &options.topology.entries {
        if let NamedElement::Type(topic, kind) = &entry.element
            && let Some(topic) = facts.known(topic)
        {
            values.state_type(topic, kind);
        }
    }
    Ok(Findings {
        mission,
        copies: copies.into_iter().map(|(n, t)| (to(n), to(t))).collect(),
        values,
        offers: offers(&facts.offers, &streams),
        names: facts.into_texts(),
        streams,
        inferences,
        incidents,
        measured,
        lines,
        notices,
        undrawn,
        logged,
    })
}

/// The conclusions of all sources, of the user's files and of source code; notices about the files, and the
/// declarations in the code that were not drawn.
fn concluded<'a>(
    recorded: &'a Recorded,
    options: &ConcludeOptions,
) -> (Conclusions<'a>, Notices, Vec<String>) {
    let start = recorded.span.map_or(Stamp(0), |s| s.start);
    let end = recorded.span.map_or(Stamp(0), |s| s.end.plus(-1));
    let (streams, facts) = (&recorded.streams, recorded.facts.clone());
    let mut known = Conclusions::new(streams, &recorded.messages, facts, (start, end));
    known.take_at_their_word();
    for (row, source) in SOURCES.iter().enumerate() {
        known.source = row;
        for conclude in source.conclude {
            conclude(&mut known);
        }
    }
    let unmatched = unmatched(&known, &options.topology.entries);
    for entry in &options.topology.entries {
        stated(&mut known, entry);
    }
    let mut notices = Notices::new();
    notices.extend(options.topology.notices.iter().cloned());
    #[cfg(feature = "source")]
    let undrawn = declared(&mut known, options.code.as_deref(), &mut notices);
    #[cfg(not(feature = "source"))]
    let undrawn = Vec::new();
    unknown::conclude(&mut known);
    explain(&mut known);
    notices.extend(unmatched);
    (known, notices, undrawn)
}

/// The conclusions from source code; returns the declarations that were not used.
#[cfg(feature = "source")]
fn declared(
    known: &mut Conclusions<'_>,
    code: Option<&Code>,
    notices: &mut Notices,
) -> Vec<String> {
    let Some(code) = code else { return Vec::new() };
    let found = matching::conclude(code, known);
    notices.extend(found.notices);
    found.undrawn
}

/// Notices about names in the user's files that are not in the bags: topics, and nodes whose name is close to a known
/// one.
fn unmatched(known: &Conclusions<'_>, entries: &[TopologyEntry]) -> Vec<Notice> {
    let texts = |names: &mut dyn Iterator<Item = Name>| -> BTreeSet<Arc<str>> {
        names.map(|name| known.text(name)).collect()
    };
    let nodes = texts(&mut known.nodes().iter().copied());
    let topics = texts(&mut known.streams.iter().map(|s| s.topic));
    let services = entries.iter().filter_map(|entry| match &entry.element {
        NamedElement::Type(topic, kind) if is_service(kind) => Some(topic),
        _ => None,
    });
    let services: BTreeSet<&String> = services.collect();
    let mut stated = BTreeMap::new();
    for entry in entries.iter().filter(|e| !e.declared) {
        let (node, topic) = match &entry.element {
            NamedElement::Node(node) => (Some(node), None),
            NamedElement::Topic(topic) => (None, Some(topic)),
            NamedElement::Publish(node, topic) | NamedElement::Subscribe(node, topic) => {
                (Some(node), Some(topic))
            }
            NamedElement::Type(..) => continue,
        };
        // Recorders leave these out.
        let is_hidden = |topic: &&String| services.contains(topic) || topic.contains("/_action/");
        let topic = topic.filter(|topic| !is_hidden(topic));
        for (what, name, all) in [("node", node, &nodes), ("topic", topic, &topics)] {
            let Some(name) = name.filter(|name| !all.contains(name.as_str())) else {
                continue;
            };
            let near = nearest(name, all.iter().map(AsRef::as_ref));
            // A bag may lack nodes, which is why the user adds them; it does not lack topics.
            if near.is_some() || what == "topic" {
                stated.entry((what, name)).or_insert((&entry.place, near));
            }
        }
    }
    let notice = |((what, name), (place, near)): ((&str, &String), (&String, Option<&str>))| {
        let near = near.map(|near| format!("; the nearest name is `{near}`"));
        let near = near.unwrap_or_default();
        let text = format!("{place}: the bag has no {what} `{name}`{near}");
        Notice::new(NoticeKind::Note, text)
    };
    stated.into_iter().map(notice).collect()
}

/// Explains inferences that are not based on a single message, for elements requested by `why`.
fn explain(known: &mut Conclusions<'_>) {
    let is_asked = |inference: &&Inference| {
        known.facts.is_watched(inference.what.ends())
            && !known.worded.contains(&(inference.what, inference.source))
    };
    let asked = known.inferences.iter().filter(is_asked);
    let pieces = asked.filter_map(|inference| {
        let (time, text) = explained(known, inference)?;
        Some(EvidenceLine {
            time,
            source: source_word(inference.source),
            confidence: inference.confidence,
            text,
        })
    });
    let pieces: Vec<EvidenceLine> = pieces.collect();
    known.facts.pieces.extend(pieces);
}

/// The time and text of an inference; `None` if it comes from observations with their own text.
fn explained(known: &Conclusions<'_>, inference: &Inference) -> Option<(Option<Stamp>, String)> {
    let what = sentence(known, inference.what);
    let about = SOURCES.get(inference.source);
    let about = about.map_or("", |source| source.about);
    let first = |at: usize| known.bounds(&known.streams[at]).map(|(first, _)| first);
    match &inference.when {
        Validity::Messages(at) => {
            let times = known.streams[*at].times;
            let many = match known.messages.map_or(0, |all| all.count(times)) {
                0 => "no message".to_owned(),
                1 => "1 message, here".to_owned(),
                n => format!("{n} messages from here on"),
            };
            Some((first(*at), format!("{what}: {many}")))
        }
        Validity::First(at) => {
            let why = "the first message is from it; the header does not identify the others";
            Some((first(*at), format!("{what}: {why}")))
        }
        Validity::Like(other) => {
            let other = sentence(known, *other);
            Some((None, format!("{what}: as long as {other} ({about})")))
        }
        Validity::Always => Some((None, format!("{what} ({about})"))),
        Validity::Signs { .. }
        | Validity::Begins { .. }
        | Validity::Moments(_)
        | Validity::Unending
        | Validity::Whole => None,
    }
}

/// An element as a sentence: `/lidar publishes /scan`.
fn sentence(known: &Conclusions<'_>, what: ElementKey) -> String {
    let name = |name: Name| known.facts.text(name);
    match what {
        ElementKey::Node(node) => format!("{} is running", name(node)),
        ElementKey::Topic(topic) => format!("{} exists", name(topic)),
        ElementKey::Publish(node, topic) => format!("{} publishes {}", name(node), name(topic)),
        ElementKey::Subscribe(topic, node) => {
            format!("{} subscribes to {}", name(node), name(topic))
        }
    }
}

/// Adds an entry of the user's file.
fn stated(known: &mut Conclusions<'_>, entry: &TopologyEntry) {
    let mission = known.mission;
    let mut name = |text: &String| match text.split_once(ANONYMOUS) {
        None => known.facts.name(text),
        Some((stem, _)) => {
            let nodes = known.nodes().iter().copied();
            let runs = nodes.filter(|node| is_run_of(&known.text(*node), stem));
            runs.min().unwrap_or_else(|| known.facts.name(stem))
        }
    };
    let what = match &entry.element {
        NamedElement::Node(node) => ElementKey::Node(name(node)),
        NamedElement::Topic(topic) => ElementKey::Topic(name(topic)),
        NamedElement::Publish(node, topic) => ElementKey::Publish(name(node), name(topic)),
        NamedElement::Subscribe(node, topic) => ElementKey::Subscribe(name(topic), name(node)),
        NamedElement::Type(..) => return,
    };
    let at = |offset: Option<i64>, without| offset.map_or(without, |ns| mission.0.plus(ns));
    // The end itself is exclusive.
    let last = |to: Option<i64>| to.map_or(mission.1, |ns| mission.0.plus(ns).plus(-1));
    let when = match (entry.from_ns, entry.to_ns) {
        (None, None) => Validity::Whole,
        (from, to) => {
            let signs = vec![at(from, mission.0), last(to).max(at(from, mission.0))];
            let ends = to.map(|_| signs[1]).into_iter().collect();
            Validity::Begins { signs, ends }
        }
    };
    let (word, confidence) = if entry.declared {
        ("launch", Confidence::Declared)
    } else {
        ("topology", Confidence::Stated)
    };
    known.source = source_id(word);
    if known.facts.is_watched(what.ends()) {
        let text = entry.place.clone();
        known.facts.explain(known.source, confidence, None, text);
    }
    known.add(what, confidence, when);
    // The time of its launch is unknown: assume that it exists while others in its namespace do.
    if entry.declared
        && let Some(neighbour) = neighbour(known, what)
    {
        let when = Validity::Like(ElementKey::Node(neighbour));
        known.add(what, confidence, when);
    }
}

/// Whether a node has the anonymous name that a launch file makes of `stem`: with a host, a process and a number.
fn is_run_of(node: &str, stem: &str) -> bool {
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    let rest = node.strip_prefix(stem).unwrap_or_default();
    let suffix = rest.strip_prefix('_');
    let mut parts = suffix.unwrap_or_default().rsplit('_');
    parts.next().is_some_and(is_number) && parts.next().is_some_and(is_number)
}

/// The node that publishes for the longest time in the namespace of a node, or of an edge's node; `None` at
/// the root.
fn neighbour(known: &Conclusions<'_>, what: ElementKey) -> Option<Name> {
    let node = what.ends()[0]?;
    let text = known.text(node);
    let space = namespace(&text);
    let streams = known.streams.iter().filter_map(|stream| {
        let of = stream.publisher.filter(|of| *of != node)?;
        let (first, last) = known.bounds(stream)?;
        let is_near = !space.trim_matches('/').is_empty() && namespace(&known.text(of)) == space;
        is_near.then(|| (last.since(first), of))
    });
    streams.max().map(|(_, of)| of)
}

// Stated values of elements: lifecycle states, types and quality of service.

/// The states of a node in transition, each with the state to which it leads.
const STEPS: [(&str, &str); 5] = [
    ("configuring", "inactive"),
    ("activating", "active"),
    ("deactivating", "inactive"),
    ("cleaningup", "unconfigured"),
    ("shuttingdown", "finalized"),
];
/// Two transitions within this time may be recorded in either order: simulated time advances in steps.
const UNORDERED_NS: i64 = 50_000_000;

/// Puts each transition before its result where both were recorded at about the same time.
fn arrange(states: &mut [(Stamp, Arc<str>)]) {
    for at in 1..states.len() {
        let ((before, result), (after, step)) = (&states[at - 1], &states[at]);
        let is_result = STEPS.contains(&(&**step, &**result));
        if is_result && after.since(*before) <= UNORDERED_NS {
            let swapped = (step.clone(), result.clone());
            (states[at - 1].1, states[at].1) = swapped;
        }
    }
}

/// Stated values by node or topic.
#[derive(Debug, Default)]
pub(crate) struct StatedValues {
    /// The states of each node with the times of its transitions, sorted.
    states: Few<Name, Vec<(Stamp, Arc<str>)>>,
    types: Few<Name, BTreeSet<Arc<str>>>,
    qualities: Few<Name, BTreeSet<Arc<str>>>,
}

impl StatedValues {
    fn new(facts: &Observations) -> io::Result<Self> {
        let mut all = Self::default();
        for fact in &facts.list {
            match fact.observation {
                Observation::Lifecycle(node, state) => {
                    let state = facts.text(state);
                    let times = facts.times(fact)?.into_iter();
                    let states = all.states.grown(node);
                    states.extend(times.map(|time| (time, Arc::clone(&state))));
                }
                Observation::Type(topic, kind) => {
                    all.types.grown(topic).insert(facts.text(kind));
                }
                Observation::Quality(topic, words) => {
                    all.qualities.grown(topic).insert(facts.text(words));
                }
                _ => {}
            }
        }
        for states in all.states.iter_mut() {
            states.sort();
            arrange(states);
        }
        Ok(all)
    }

    /// Adds a type that the user states. The type of services is ignored if the actual type is known.
    pub(crate) fn state_type(&mut self, topic: Name, kind: &str) {
        let kinds = self.types.grown(topic);
        if kind != SERVICE || kinds.is_empty() {
            kinds.remove(SERVICE);
            kinds.insert(kind.into());
        }
    }

    /// The state of a node at the end of a window; `None` before its first transition.
    pub(crate) fn lifecycle(&self, node: Name, window: Span) -> Option<Arc<str>> {
        let states = self.states.of(node);
        let next = states.partition_point(|(time, _)| *time < window.end);
        let (_, state) = states.get(next.checked_sub(1)?)?;
        Some(Arc::clone(state))
    }

    /// The transitions of a node with their times, in order.
    pub(crate) fn transitions(&self, node: Name) -> impl Iterator<Item = &(Stamp, Arc<str>)> {
        self.states.of(node).iter()
    }

    /// The stated types of a topic.
    pub(crate) fn types(&self, topic: Name) -> impl Iterator<Item = Arc<str>> + '_ {
        self.types.get(topic).into_iter().flatten().cloned()
    }

    /// The quality of service of a topic.
    pub(crate) fn quality(&self, topic: Name) -> Option<Arc<str>> {
        let all: Vec<&str> = self.qualities.get(topic)?.iter().map(|q| &**q).collect();
        (!all.is_empty()).then(|| all.join(", ").into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transition_precedes_its_result() {
        let arranged = |states: &[(i64, &str)]| {
            let states = states.iter();
            let mut states: Vec<(Stamp, Arc<str>)> = states
                .map(|(ms, state)| (Stamp(ms * 1_000_000), (*state).into()))
                .collect();
            arrange(&mut states);
            let states = states
                .into_iter()
                .map(|(time, state)| format!("{} {state}", time.0 / 1_000_000));
            states.collect::<Vec<_>>().join(", ")
        };
        let mixed = [
            (0, "configuring"),
            (1, "inactive"),
            (2, "active"),
            (5, "activating"),
        ];
        assert_eq!(
            arranged(&mixed),
            "0 configuring, 1 inactive, 2 activating, 5 active"
        );
        // The messages between them are not recorded.
        assert_eq!(
            arranged(&[(0, "active"), (60, "activating")]),
            "0 active, 60 activating"
        );
    }
}
