//! Edges from code whose nodes are not named in the bag: the only possible declaration of an edge (`--infer source`),
//! and the reasons why others are not drawn.
//!
//! If a single declaration in the workspace publishes (or subscribes to) a topic of exactly this name and type, it is
//! right in 135 of 141 cases (96 %), provided that its node mostly declares recorded topics and no launch file, log
//! record or known publisher contradicts it. If several are possible, 27 % are right.

use std::collections::{BTreeMap, BTreeSet};

use super::Code;
use super::declaration::Role;
use super::matching::{Match, RecordedTopics, matches, resolved};
use super::workspace::{FileDeclaration, Instance};
use crate::base::name::last_part;
use crate::base::words::{count, worded};
use crate::evidence::inference::{Conclusions, ElementKey, Inference, Validity};
use crate::evidence::observation::{Confidence, Name};
use crate::evidence::source_id;
use crate::evidence::topology::launch::join;

worded! {
    /// The reason why a declaration is not drawn.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub(super) enum NotDrawn {
        SeveralPlaces = "several declarations match",
        /// The topics of its node have another publisher or match another declaration too, so the node may
        /// not have run.
        Disputed = "the topics of its node may have another publisher",
        KnownPublisher = "its publishers are known",
        /// Messages of this type are published by one well-known program.
        OwnedType = "its type belongs to another program",
        OtherType = "a topic of its node has another type in the bag",
        OtherRos = "its node is for the other version of ROS",
        OtherLaunchFile = "another launch file matches better",
        /// A launch file of the same system starts the recorded nodes without this one.
        Alternative = "a matching launch file does not start its node",
        FewTopics = "most of its node's topics are not in the bag",
        WouldHaveLogged = "its node would have logged",
        /// Nothing contradicts it, but the bag does not name the node and `--infer source` is not given.
        NotNamed = "the bag does not name its node; `--infer source` draws it",
    }
}

/// A declaration that may publish or subscribe to a recorded topic.
struct Candidate<'a> {
    node: String,
    found: Match<'a>,
    /// The number of recorded topics of its node, and the number of all its topics.
    share: (usize, usize),
}

/// The declarations that are not drawn: the reason and the description.
pub(super) type Undrawn = Vec<(NotDrawn, String)>;

/// Facts of the bag.
pub(super) struct BagTopics<'a> {
    pub(super) recorded: &'a RecordedTopics,
    /// Programs whose nodes the bag names.
    pub(super) explained: &'a BTreeSet<(String, String)>,
    /// The nodes that the bag names.
    pub(super) named: &'a BTreeSet<String>,
    /// Whether log records were recorded, so that a node that logs would be named.
    pub(super) logged: bool,
    pub(super) owner: Owner<'a>,
}

/// The well-known program that alone publishes messages of a type, by the type and the topic.
pub(crate) type Owner<'a> = &'a dyn Fn(&str, &str) -> Option<String>;

/// Adds the only possible declarations if requested; returns those that were not drawn, with the reasons.
pub(super) fn conclude(
    code: &Code,
    known: &mut Conclusions<'_>,
    bag: &BagTopics<'_>,
) -> (usize, Undrawn) {
    let candidates = candidates(code, bag);
    let places = places(code, bag.recorded, &candidates);
    let launches = Launches::new(code, bag.named, &candidates);
    let mut by_edge: BTreeMap<(Role, Name), Vec<&Candidate<'_>>> = BTreeMap::new();
    for candidate in &candidates {
        by_edge
            .entry((candidate.found.role, candidate.found.topic))
            .or_default()
            .push(candidate);
    }
    let judged: Vec<_> = by_edge
        .into_iter()
        .map(|(edge, candidates)| {
            let reason = reason(&candidates, known, bag, (&places[&edge], &launches));
            (edge.0, reason, candidates)
        })
        .collect();
    let disputed: BTreeSet<&str> = judged
        .iter()
        .filter(|(role, reason, _)| {
            let is_other = [NotDrawn::SeveralPlaces, NotDrawn::KnownPublisher];
            *role == Role::Publishes && reason.is_some_and(|reason| is_other.contains(&reason))
        })
        .flat_map(|(.., candidates)| candidates.iter().map(|c| c.node.as_str()))
        .collect();
    let (mut edges, mut undrawn) = (0, Vec::new());
    for (_, reason, candidates) in &judged {
        let best = candidates
            .iter()
            .find(|c| launches.are_best_for(c.found.instance))
            .unwrap_or(&candidates[0]);
        let is_disputed = reason.is_none() && disputed.contains(best.node.as_str());
        match reason.or(is_disputed.then_some(NotDrawn::Disputed)) {
            None if code.infers => {
                draw(code, known, best);
                edges += 1;
            }
            reason => undrawn.push((reason.unwrap_or(NotDrawn::NotNamed), words(known, best))),
        }
    }
    undrawn.sort();
    (edges, undrawn)
}

/// Every recorded topic of every node that the workspace may start and the bag does not name; tests count only if there
/// is nothing else.
fn candidates<'a>(code: &'a Code, bag: &BagTopics<'_>) -> Vec<Candidate<'a>> {
    let mut all = Vec::new();
    for instance in code
        .instances
        .iter()
        .filter(|i| !bag.explained.contains(&i.program))
    {
        let node = full_name(instance);
        if bag.named.contains(&node) {
            continue;
        }
        let found = matches(instance, &node, bag.recorded);
        let topics = instance.declared.iter().filter_map(|p| {
            Some((
                p.declaration.role,
                resolved(&node, p.declaration.topic.as_ref()?),
            ))
        });
        let share = (found.len(), topics.collect::<BTreeSet<_>>().len());
        all.extend(found.into_iter().map(|found| Candidate {
            node: node.clone(),
            found,
            share,
        }));
    }
    let is_real = |c: &Candidate<'_>| !c.found.instance.is_test;
    if all.iter().any(is_real) {
        all.retain(is_real);
    }
    all
}

fn full_name(instance: &Instance) -> String {
    let space = instance.namespace.as_deref().unwrap_or_default();
    join(space, &instance.name)
}

/// The declarations of each edge, whether or not their node was found.
fn places<'a>(
    code: &'a Code,
    recorded: &RecordedTopics,
    candidates: &[Candidate<'a>],
) -> BTreeMap<(Role, Name), BTreeSet<(&'a str, usize)>> {
    let mut all: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
    for Candidate { found, .. } in candidates {
        let place = (found.placed.path.as_str(), found.placed.declaration.line);
        all.entry((found.role, found.topic))
            .or_default()
            .insert(place);
    }
    for FileDeclaration { path, declaration } in &code.places {
        let topic = declaration.topic.as_ref();
        let name = topic.map(|topic| resolved("/node", topic));
        if let Some(topic) = name.and_then(|name| recorded.topic(&name, &declaration.types)) {
            let edge = (declaration.role, topic);
            all.entry(edge)
                .or_default()
                .insert((path.as_str(), declaration.line));
        }
    }
    all
}

/// A launch file compared with the bag.
#[derive(Default)]
struct LaunchFit<'a> {
    /// The programs that it starts.
    programs: BTreeSet<&'a (String, String)>,
    /// The nodes that the bag names.
    named: BTreeSet<String>,
    /// The number of its other nodes.
    others: usize,
    /// The recorded edges that the other nodes explain.
    edges: BTreeSet<(Role, Name)>,
}

impl LaunchFit<'_> {
    /// Whether `other` is more likely to have run: this starts no more of the named nodes, and more that the bag does
    /// not name. A simulation starts the robot's nodes too.
    fn is_beaten_by(&self, other: &Self) -> bool {
        let starts_the_same = !self.named.is_empty() && self.named.is_subset(&other.named);
        starts_the_same && other.others < self.others
    }
}

/// The launch files of the workspace.
struct Launches<'a> {
    /// By path.
    fits: BTreeMap<&'a str, LaunchFit<'a>>,
    /// Those that explain most edges, except those for which another is more likely.
    best: BTreeSet<&'a str>,
}

impl<'a> Launches<'a> {
    fn new(code: &'a Code, named: &BTreeSet<String>, candidates: &[Candidate<'a>]) -> Self {
        let mut fits: BTreeMap<&str, LaunchFit<'_>> = BTreeMap::new();
        for instance in &code.instances {
            if let Some((path, _)) = &instance.launched {
                let fit = fits.entry(path).or_default();
                fit.programs.insert(&instance.program);
                let node = full_name(instance);
                if named.contains(&node) {
                    fit.named.insert(node);
                } else {
                    fit.others += 1;
                }
            }
        }
        for Candidate { found, .. } in candidates {
            let path = found.instance.launched.as_ref().map(|(path, _)| path);
            if let Some(fit) = path.and_then(|path| fits.get_mut(path.as_str())) {
                fit.edges.insert((found.role, found.topic));
            }
        }
        let is_beaten = |fit: &LaunchFit<'_>| fits.values().any(|other| fit.is_beaten_by(other));
        let open = fits.iter().filter(|(_, fit)| !is_beaten(fit));
        let most = open.clone().map(|(_, fit)| fit.edges.len()).max();
        let best = open.filter(|(_, fit)| Some(fit.edges.len()) == most);
        Self {
            best: best.map(|(path, _)| *path).collect(),
            fits,
        }
    }

    /// Whether one of the best starts this node.
    fn are_best_for(&self, instance: &Instance) -> bool {
        let path = instance.launched.as_ref().map(|(path, _)| path.as_str());
        path.is_some_and(|path| self.best.contains(path))
    }

    /// Whether a launch file is an alternative without this program: it starts parts of the same system and recorded
    /// nodes. A robot and its simulation, or two controllers, are such alternatives.
    fn do_without(&self, program: &(String, String)) -> bool {
        let starts = |fit: &&LaunchFit<'_>| fit.programs.contains(program);
        let with: BTreeSet<_> = self
            .fits
            .values()
            .filter(starts)
            .flat_map(|fit| &fit.programs)
            .collect();
        let shows = |fit: &&LaunchFit<'_>| !fit.named.is_empty() || !fit.edges.is_empty();
        let without = self.fits.values().filter(shows).filter(|fit| !starts(fit));
        without
            .flat_map(|fit| &fit.programs)
            .any(|p| with.contains(p))
    }
}

/// Whether two nodes have the same name, ignoring namespaces.
fn is_same_name(a: &str, b: &str) -> bool {
    last_part(a) == last_part(b)
}

/// The reason against an edge; `None` if there is none.
fn reason(
    candidates: &[&Candidate<'_>],
    known: &Conclusions<'_>,
    bag: &BagTopics<'_>,
    (places, launches): (&BTreeSet<(&str, usize)>, &Launches<'_>),
) -> Option<NotDrawn> {
    let found = &candidates[0].found;
    if found.role == Role::Publishes
        && (bag.recorded.stated.contains(&found.topic)
            || known.publishers(found.topic).next().is_some())
    {
        return Some(NotDrawn::KnownPublisher);
    }
    let owner = (bag.owner)(&known.kind(found.topic), &known.text(found.topic));
    let is_owner = |owner: &String| candidates.iter().any(|c| is_same_name(&c.node, owner));
    if found.role == Role::Publishes && owner.is_some_and(|owner| !is_owner(&owner)) {
        return Some(NotDrawn::OwnedType);
    }
    let is_launched = candidates
        .iter()
        .any(|c| c.found.instance.launched.is_some());
    let fitting: Vec<_> = candidates
        .iter()
        .filter(|c| !is_launched || launches.are_best_for(c.found.instance))
        .collect();
    let nodes: BTreeSet<&str> = fitting.iter().map(|c| c.node.as_str()).collect();
    if places.len() > 1 || nodes.len() > 1 {
        return Some(NotDrawn::SeveralPlaces);
    }
    let Some(only) = fitting.first() else {
        return Some(NotDrawn::OtherLaunchFile);
    };
    if launches.do_without(&only.found.instance.program) {
        return Some(NotDrawn::Alternative);
    }
    if bag.recorded.contradicts(only.found.instance, &only.node) {
        return Some(NotDrawn::OtherType);
    }
    if is_of_other_ros(only.found.instance, known) {
        return Some(NotDrawn::OtherRos);
    }
    if only.share.0 * 2 < only.share.1 {
        return Some(NotDrawn::FewTopics);
    }
    (bag.logged && only.found.instance.logs).then_some(NotDrawn::WouldHaveLogged)
}

/// Whether the calls of a program are those of ROS 1 and the bag is of ROS 2, or the reverse.
fn is_of_other_ros(instance: &Instance, known: &Conclusions<'_>) -> bool {
    const ROS1: [&str; 4] = ["advertise", "subscribe", "Publisher(", "Subscriber("];
    let texts = || {
        instance
            .declared
            .iter()
            .map(|d| d.declaration.text.as_str())
    };
    let is_ros2 = texts().any(|text| text.starts_with("create_"));
    let is_ros1 = !is_ros2 && texts().any(|text| ROS1.iter().any(|call| text.starts_with(call)));
    if known.is_ros1() { is_ros2 } else { is_ros1 }
}

/// Adds the node, with a question mark, and its edge, which exists as long as its topic.
fn draw(code: &Code, known: &mut Conclusions<'_>, candidate: &Candidate<'_>) {
    let node = known.facts.name(&format!("{} ?", candidate.node));
    let edge = candidate.found.role.edge(node, candidate.found.topic);
    let text = format!(
        "the only declaration in {} that may do so: {}; the bag does not show that it ran",
        count(code.packages, "package"),
        words(known, candidate)
    );
    let basis = Validity::Like(ElementKey::Topic(candidate.found.topic));
    for (what, when) in [(ElementKey::Node(node), Validity::Whole), (edge, basis)] {
        let inference = Inference::new(source_id("source_only"), what, Confidence::Declared, when);
        known.because(inference, None, |_| text.clone());
    }
}

/// `/talker publishes /chatter (p/talker.py:5  create_publisher(String, 'chatter', 10))`
fn words(known: &Conclusions<'_>, candidate: &Candidate<'_>) -> String {
    let does = candidate.found.role.word();
    let placed = candidate.found.placed;
    format!(
        "{} {does} {} ({}:{}  {})",
        candidate.node,
        known.text(candidate.found.topic),
        placed.path,
        placed.declaration.line,
        placed.declaration.text
    )
}
