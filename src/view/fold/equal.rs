//! Namespaces and names that only differ in their index, such as the robots of a fleet: they are drawn once for all.

use std::cell::LazyCell;
use std::cmp::Reverse;
use std::collections::hash_map::DefaultHasher;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{Hash, Hasher as _};
use std::sync::Arc;

use crate::base::name::{is_within, namespace};
use crate::graph::{Element, Elements};
use crate::view::ViewOptions;

/// The least number of equal namespaces that are drawn as one; fewer are drawn side by side.
const FEWEST: usize = 3;

/// The most equal namespaces that are drawn as one: the presence of each is stored for each window.
const MOST: usize = 1024;

/// The most digits of an index: longer numbers are times, process numbers or serial numbers.
const MOST_DIGITS: usize = 6;

/// The largest number of searches for fleets among the remaining namespaces.
const MOST_ROUNDS: usize = 16;

/// Namespaces, or single names, with the same graph, drawn as one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fleet {
    /// The name it is drawn under: `/robotNN`.
    pub(crate) name: Arc<str>,
    /// Its namespaces, sorted: `/robot01`.
    pub(crate) members: Vec<Arc<str>>,
    /// The nodes of each, or its topics if it has none.
    pub(crate) elements: Vec<Vec<Element>>,
}

impl Fleet {
    /// The distinguishing index of each member: `01`.
    pub(crate) fn indices(&self) -> Vec<Arc<str>> {
        self.members.iter().map(|m| index(m).into()).collect()
    }
}

/// All fleets of a view.
#[derive(Clone, Debug, Default)]
pub(crate) struct Fleets {
    pub(crate) all: Vec<Fleet>,
    /// The index of each namespace's fleet, by the name of the namespace.
    place: BTreeMap<Arc<str>, usize>,
    /// The index of each fleet by the name it is drawn under.
    drawn: BTreeMap<Arc<str>, usize>,
}

/// A hash for each element that a namespace contains or is linked to, without the name of the namespace, sorted.
type Inside = Vec<u64>;

impl Fleets {
    /// The fleets among these elements, except namespaces that are kept open.
    pub(crate) fn new(elements: &Elements, options: &ViewOptions) -> Self {
        let kept = options.expand.iter().chain(&options.collapse);
        let kept: BTreeSet<&str> = kept.map(|k| k.trim_end_matches('/')).collect();
        let mut described = described(elements);
        described.retain(|(space, _)| !kept.contains(space));
        described.sort_unstable_by_key(|(space, what)| (stem(space), *space, *what));
        described.dedup();
        let single = LazyCell::new(|| single_names(elements));
        let mut found: Vec<(&str, Vec<&str>)> = Vec::new();
        for spaces in described.chunk_by(|a, b| stem(a.0) == stem(b.0)) {
            let mut alike: BTreeMap<Inside, Vec<&str>> = BTreeMap::new();
            for space in spaces.chunk_by(|a, b| a.0 == b.0) {
                let inside = space.iter().map(|(_, what)| *what).collect();
                alike.entry(inside).or_default().push(space[0].0);
            }
            let many: usize = alike.values().map(Vec::len).sum();
            // The largest, or of several the one whose first name comes first; members that differ stay
            // beside it.
            let largest = alike.into_values().max_by_key(|m| (m.len(), Reverse(m[0])));
            // A few single names are easily equal by chance.
            let is_rule =
                |m: &Vec<&str>| 2 * m.len() > many || !m.iter().all(|s| single.contains(s));
            if let Some(members) =
                largest.filter(|m| (FEWEST..=MOST).contains(&m.len()) && is_rule(m))
            {
                found.push((stem(members[0]), members));
            }
        }
        if found.is_empty() {
            return Self::default();
        }
        keep_linked(&mut found, &partners(elements));
        let known = Known::new(elements);
        let mut fleets = Self::default();
        for (stem, mut members) in found {
            members.sort_by_key(|m| (m.len(), *m));
            fleets.add(stem, &members, &known);
        }
        fleets
    }

    fn add(&mut self, stem: &str, members: &[&str], known: &Known<'_>) {
        let digits = members.iter().map(|m| m.len() - stem.len()).max();
        let name = format!("{stem}{}", "N".repeat(digits.unwrap_or(1)));
        if known.holds(&name) {
            return;
        }
        let name: Arc<str> = name.into();
        self.drawn.insert(Arc::clone(&name), self.all.len());
        for member in members {
            self.place.insert(Arc::from(*member), self.all.len());
        }
        self.all.push(Fleet {
            name,
            elements: members.iter().map(|m| known.nodes_or_topics(m)).collect(),
            members: members.iter().map(|m| Arc::from(*m)).collect(),
        });
    }

    /// The name under which a member of a fleet is drawn; `None` for everything else.
    pub(crate) fn stand_in(&self, name: &str) -> Option<Arc<str>> {
        let space = space_of(name)?;
        let fleet = self.all.get(*self.place.get(space)?)?;
        let rest = name.get(space.len()..)?;
        Some(format!("{}{rest}", fleet.name).into())
    }

    /// The fleet that an element drawn under this name is part of.
    pub(crate) fn of(&self, drawn: &str) -> Option<&Fleet> {
        let around = std::iter::successors(Some(drawn), |name| Some(namespace(name)));
        let mut around = around.take_while(|name| name.len() > 1);
        let place = around.find_map(|name| self.drawn.get(name))?;
        self.all.get(*place)
    }
}

/// The names of a mission, and the contents of each namespace with an index.
struct Known<'a> {
    names: BTreeSet<&'a str>,
    inside: BTreeMap<&'a str, Vec<Element>>,
}

impl<'a> Known<'a> {
    fn new(elements: &'a Elements) -> Self {
        let mut inside: BTreeMap<&str, Vec<Element>> = BTreeMap::new();
        for (name, element) in names(elements) {
            if let Some(space) = space_of(name) {
                inside.entry(space).or_default().push(element);
            }
        }
        Self {
            names: names(elements).map(|(name, _)| name).collect(),
            inside,
        }
    }

    /// Whether an element has the name of this namespace or is in it.
    fn holds(&self, space: &str) -> bool {
        let below = format!("{space}/");
        let next = self.names.range(below.as_str()..).next();
        self.names.contains(space) || next.is_some_and(|name| name.starts_with(&below))
    }

    fn nodes_or_topics(&self, space: &str) -> Vec<Element> {
        let all = self.inside.get(space).into_iter().flatten().copied();
        let (nodes, topics): (Vec<Element>, Vec<Element>) = all.partition(Element::is_node);
        if nodes.is_empty() { topics } else { nodes }
    }
}

impl ViewOptions {
    /// The same options with every namespace expanded: none collapsed, none drawn for several.
    pub(crate) fn opened(&self, elements: &Elements) -> Self {
        let mut options = Self {
            collapse: Vec::new(),
            is_picture: false,
            ..self.clone()
        };
        // Those that differed from the largest fleet may form another one.
        for _ in 0..MOST_ROUNDS {
            let fleets = Fleets::new(elements, &options);
            if fleets.all.is_empty() {
                break;
            }
            let members = fleets.all.into_iter().flat_map(|fleet| fleet.members);
            options.expand.extend(members);
        }
        options
    }
}

fn names(elements: &Elements) -> impl Iterator<Item = (&str, Element)> {
    let nodes = elements.nodes.with_ids();
    let topics = elements.topics.with_ids();
    nodes
        .map(|(id, n)| (n.name.as_str(), Element::Node(id)))
        .chain(topics.map(|(id, t)| (t.name.as_str(), Element::Topic(id))))
}

/// The outermost namespace around a name that ends in a number, or else the name itself if it does.
fn space_of(name: &str) -> Option<&str> {
    let mut found = None;
    let mut space = name;
    while space.len() > 1 {
        let digits = space.len() - stem(space).len();
        if (1..=MOST_DIGITS).contains(&digits) && !stem(space).ends_with('/') {
            found = Some(space);
        }
        space = namespace(space);
    }
    found
}

/// A name without the number at its end.
fn stem(space: &str) -> &str {
    space.trim_end_matches(|c: char| c.is_ascii_digit())
}

/// The number at its end.
fn index(space: &str) -> &str {
    &space[stem(space).len()..]
}

/// Every namespace with a number, and a hash for each element in it and each of their edges.
fn described(elements: &Elements) -> Vec<(&str, u64)> {
    let mut all = Vec::new();
    for (name, element) in names(elements) {
        let kind = element.is_node();
        if let Some(space) = space_of(name) {
            all.push((space, hash(&(kind, seen(name, space)))));
        }
    }
    for (what, _) in elements.edges() {
        let (Some(node), Some(topic)) = elements.names(what) else {
            continue;
        };
        let sign = if matches!(what, Element::Publish(_)) {
            '>'
        } else {
            '<'
        };
        let spaces = [space_of(node), space_of(topic)];
        let second = spaces[1].filter(|space| spaces[0] != Some(space));
        for space in [spaces[0], second].into_iter().flatten() {
            all.push((space, hash(&(seen(node, space), sign, seen(topic, space)))));
        }
    }
    all
}

/// A name relative to one of several equal namespaces.
#[derive(Hash)]
enum Seen<'a> {
    /// In the namespace: the rest of the name.
    Own(&'a str),
    /// In another one with the same index: its name without the index, and the rest.
    Alike(&'a str, &'a str),
    Foreign(&'a str),
}

fn seen<'a>(name: &'a str, space: &str) -> Seen<'a> {
    match name.strip_prefix(space) {
        Some(rest) if is_within(name, space) => return Seen::Own(rest),
        _ => {}
    }
    match space_of(name) {
        Some(other) if index(other) == index(space) => {
            Seen::Alike(stem(other), &name[other.len()..])
        }
        _ => Seen::Foreign(name),
    }
}

/// The namespaces that consist of one name.
fn single_names(elements: &Elements) -> BTreeSet<&str> {
    let mut single: BTreeSet<&str> = BTreeSet::new();
    single.extend(names(elements).map(|(name, _)| name));
    for (name, _) in names(elements) {
        if let Some(space) = space_of(name).filter(|space| *space != name) {
            single.remove(space);
        }
    }
    single
}

/// The pairs of namespaces with the same index that an edge links.
fn partners(elements: &Elements) -> Vec<(&str, &str)> {
    let pair = |(what, _)| {
        let (node, topic) = elements.names(what);
        let (a, b) = (space_of(node?)?, space_of(topic?)?);
        (a != b && index(a) == index(b)).then_some((a, b))
    };
    elements.edges().filter_map(pair).collect()
}

/// Drops fleets with a member that is linked to a namespace of the same index outside of all fleets, and
/// fleets linked to these: their members only look alike.
fn keep_linked(found: &mut Vec<(&str, Vec<&str>)>, partners: &[(&str, &str)]) {
    let mut place: BTreeMap<&str, usize> = BTreeMap::new();
    for (at, (_, members)) in found.iter().enumerate() {
        place.extend(members.iter().map(|member| (*member, at)));
    }
    let mut beside: Vec<Vec<usize>> = vec![Vec::new(); found.len()];
    let mut torn = Vec::new();
    for (a, b) in partners {
        match (place.get(a), place.get(b)) {
            (Some(&a), Some(&b)) => {
                beside[a].push(b);
                beside[b].push(a);
            }
            (Some(one), None) | (None, Some(one)) => torn.push(*one),
            (None, None) => {}
        }
    }
    let mut is_torn = vec![false; found.len()];
    while let Some(at) = torn.pop() {
        if !std::mem::replace(&mut is_torn[at], true) {
            torn.extend(&beside[at]);
        }
    }
    let mut is_torn = is_torn.into_iter();
    found.retain(|_| is_torn.next() == Some(false));
}

fn hash(what: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    what.hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::MemberState::{self, Away, Here, Joined, Left};
    use crate::view::testing::mission;
    use crate::view::{Mark, outline, view};

    fn robot(n: usize, more: &str) -> String {
        format!("/r{n}/drive>/r{n}/odom@2 /r{n}/plan</r{n}/odom /r{n}/drive>/tf@1 {more}")
    }

    #[test]
    fn equal_robots_are_merged_and_a_different_one_is_not() {
        let text: Vec<String> = (1..=4).map(|n| robot(n, "")).collect();
        let text = text.join(" ") + " " + &robot(5, "/r5/cam>/r5/image");
        let mission = mission(&[&text]);
        let seen = outline(&mission, &ViewOptions::default());
        let names: Vec<&str> = seen.items.iter().map(|i| &*i.name).collect();
        assert_eq!(
            names,
            [
                "/r5/cam",
                "/r5/drive",
                "/r5/plan",
                "/rN/drive",
                "/rN/plan",
                "/r5/image",
                "/r5/odom",
                "/rN/odom",
                "/tf"
            ]
        );
        let open = ViewOptions {
            expand: vec!["/r2".into()],
            ..ViewOptions::default()
        };
        let names = outline(&mission, &open).items;
        assert!(names.iter().any(|i| &*i.name == "/r2/odom"));
        let space = seen.namespaces.iter().find(|n| &*n.name == "/rN").unwrap();
        assert_eq!(space.replicas, ["1", "2", "3", "4"].map(Arc::from));
    }

    #[test]
    fn names_with_an_index_are_merged_too() {
        let worker = |n: usize| format!("/work_{n}</jobs_{n} /chief>/jobs_{n} /work_{n}>/done");
        let text: Vec<String> = (1..=4).map(worker).collect();
        let numbers = ["1609459200", "1609459201", "1609459202"];
        let anonymous = numbers.map(|n| format!("/view_{n}</done"));
        let text = text.join(" ") + " " + &anonymous.join(" ");
        let seen = outline(&mission(&[&text]), &ViewOptions::default());
        let inside = |name: &str| {
            let item = seen.items.iter().find(|item| &*item.name == name)?;
            Some(&*seen.namespaces[item.cluster?].name)
        };
        assert_eq!(inside("/work_N"), Some("/work_N"));
        assert_eq!(inside("/jobs_N"), Some("/jobs_N"));
        assert_eq!(
            seen.namespaces[1].replicas,
            ["1", "2", "3", "4"].map(Arc::from)
        );
        // Long numbers are not an index: such nodes are separate, or one by their role.
        assert!(seen.items.iter().all(|item| !item.name.ends_with("NN")));
        assert_eq!(seen.namespaces.len(), 2);
    }

    #[test]
    fn elements_linked_to_unequal_ones_are_not_equal() {
        let seen = |text: &str| outline(&mission(&[text]), &ViewOptions::default());
        let chain = "/work_1>/out_1 /work_2>/out_2 /work_3>/out_3 /work_4>/out_4";
        assert_eq!(seen(chain).items.len(), 2);
        // Half of the topics lead to another node each: the nodes would be merged, but not their topics.
        let more = " /a</out_1 /b</out_2 /work_5>/out_5 /work_5>/x /work_6>/out_6 /work_6>/y";
        let items = seen(&(chain.to_owned() + more)).items;
        assert!(items.iter().all(|item| !item.is_replica), "{items:?}");
    }

    #[test]
    fn thousands_of_names_are_not_a_fleet() {
        let folded = |many: usize| {
            let text: Vec<String> = (0..many).map(|n| format!("/n{n}")).collect();
            outline(&mission(&[&text.join(" ")]), &ViewOptions::default())
                .items
                .len()
                == 1
        };
        assert!(folded(MOST));
        assert!(!folded(MOST + 1));
    }

    #[test]
    fn indices_are_in_the_order_of_numbers() {
        let text: Vec<String> = (1..=11).map(|n| robot(n, "")).collect();
        let seen = outline(&mission(&[&text.join(" ")]), &ViewOptions::default());
        let last = seen.namespaces[0].replicas.last();
        assert_eq!(last.map(|index| &**index), Some("11"));
    }

    #[test]
    fn two_robots_are_drawn_side_by_side() {
        let text = [robot(1, ""), robot(2, "")].join(" ");
        let seen = outline(&mission(&[&text]), &ViewOptions::default());
        assert!(seen.items.iter().any(|i| &*i.name == "/r1/odom"));
    }

    #[test]
    fn members_joining_and_leaving_are_shown_with_their_own_rates() {
        let all = |robots: &[usize]| -> String {
            let texts: Vec<String> = robots.iter().map(|n| robot(*n, "")).collect();
            texts.join(" ")
        };
        let windows = [all(&[1, 2, 3]), all(&[1, 2, 3, 4]), all(&[2, 3, 4])];
        let windows: Vec<&str> = windows.iter().map(String::as_str).collect();
        let (seen, _) = view(&mission(&windows), &ViewOptions::default());
        let member_lists: Vec<&[MemberState]> =
            seen.frames.iter().map(|f| &f.member_lists[0][..]).collect();
        assert_eq!(member_lists[0], [Here, Here, Here, Away]);
        assert_eq!(member_lists[1], [Here, Here, Here, Joined]);
        assert_eq!(member_lists[2], [Left, Here, Here, Here]);
        let mut items = seen.items.with_ids();
        let (odom, _) = items.find(|(_, i)| &*i.name == "/rN/odom").unwrap();
        let shown = seen.items_shown[odom].at(1).unwrap();
        assert_eq!((shown.each, shown.hz), (4, Some(8.0)));
        assert_eq!(shown.mark, Some(Mark::Inside));
    }
}
