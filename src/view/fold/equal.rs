//! Namespaces and names that only differ in their index, such as the robots of a fleet: they are drawn once for all.
//!
//! `/robot1/drive>/robot1/odom`, `/robot2/drive>/robot2/odom` and `/robot3/drive>/robot3/odom` are `/robotN/drive` and
//! `/robotN/odom`; a fourth robot that also publishes `/robot4/image` stays beside them.

use std::cmp::Reverse;
use std::collections::hash_map::DefaultHasher;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{Hash, Hasher as _};
use std::sync::Arc;

use super::namespaces::inside;
use super::{Fold, ItemKey, Keys};
use crate::base::ids::grouped;
use crate::base::name::{is_within, namespace};
use crate::graph::{Element, Elements};
use crate::view::ViewOptions;

/// The least number of equal namespaces that are drawn as one: two side by side are as easy to read as one for both.
const FEWEST: usize = 3;

/// The most equal namespaces that are drawn as one: the presence of each is stored for each window.
const MOST: usize = 1024;

/// The most digits of an index: longer numbers are times, process numbers or serial numbers.
const MOST_DIGITS: usize = 6;

/// The largest number of searches for fleets among the remaining namespaces: each finds the largest of every stem, and more
/// than a few different kinds of robots have not been seen.
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
    /// The index of each namespace's fleet, by the name of the namespace, and by the name that the fleet is drawn under.
    place: BTreeMap<Arc<str>, usize>,
}

/// A hash for each element that a namespace contains or is linked to, without the name of the namespace.
type Inside = BTreeSet<u64>;

/// The names in each namespace with an index, with their elements.
type Spaces<'a> = BTreeMap<&'a str, Vec<(&'a str, Element)>>;

impl Fleets {
    /// The fleets among these elements, except namespaces that are kept open.
    pub(crate) fn new(elements: &Elements, options: &ViewOptions) -> Self {
        let kept = options.expand.iter().chain(&options.collapse);
        let kept: BTreeSet<&str> = kept.map(|k| k.trim_end_matches('/')).collect();
        let spaces: Spaces<'_> =
            grouped(names(elements).filter_map(|of| Some((space_of(of.0)?, of))));
        let mut alike: BTreeMap<&str, BTreeMap<Inside, Vec<&str>>> = BTreeMap::new();
        for (space, inside) in described(elements) {
            if !kept.contains(space) {
                let alike = alike.entry(stem(space)).or_default();
                alike.entry(inside).or_default().push(space);
            }
        }
        let mut found: Vec<(&str, Vec<&str>)> = Vec::new();
        for (stem, alike) in alike {
            let many: usize = alike.values().map(Vec::len).sum();
            // The largest, or of several the one whose first name comes first; members that differ stay
            // beside it.
            let largest = alike.into_values().max_by_key(|m| (m.len(), Reverse(m[0])));
            // A few single names are easily equal by chance.
            let is_single = |space: &&str| spaces[space].iter().all(|(name, _)| name == space);
            let is_rule = |m: &Vec<&str>| 2 * m.len() > many || !m.iter().all(is_single);
            let is_fleet = |m: &Vec<&str>| (FEWEST..=MOST).contains(&m.len()) && is_rule(m);
            found.extend(largest.filter(is_fleet).map(|members| (stem, members)));
        }
        keep_linked(&mut found, elements);
        let all = grouped(names(elements));
        let mut fleets = Self::default();
        for (stem, mut members) in found {
            members.sort_by_key(|m| (m.len(), *m));
            let digits = members.last().map_or(1, |m| m.len() - stem.len());
            let name = format!("{stem}{}", "N".repeat(digits));
            if all.contains_key(&*name) || inside(&all, &name).next().is_some() {
                continue;
            }
            for member in members.iter().copied().chain([&*name]) {
                fleets.place.insert(member.into(), fleets.all.len());
            }
            let nodes_or_topics = |space: &&str| {
                let inside = spaces[space].iter().map(|(_, element)| *element);
                let (nodes, topics): (Vec<_>, Vec<_>) = inside.partition(Element::is_node);
                if nodes.is_empty() { topics } else { nodes }
            };
            fleets.all.push(Fleet {
                name: name.into(),
                elements: members.iter().map(nodes_or_topics).collect(),
                members: members.into_iter().map(Arc::from).collect(),
            });
        }
        fleets
    }

    /// The elements of fleets, under the names that they are drawn under.
    pub(crate) fn folds(&self, keys: &Keys) -> Vec<Fold> {
        let fold = |(what, key): (Element, &Option<ItemKey>)| {
            let key = key.as_ref()?;
            let space = space_of(&key.name)?;
            let fleet = self.all.get(*self.place.get(space)?)?;
            let rest = key.name.get(space.len()..)?;
            let (kind, name) = (key.kind, format!("{}{rest}", fleet.name).into());
            Some((what, ItemKey { kind, name }))
        };
        keys.iter().filter_map(fold).collect()
    }

    /// Whether an element drawn under this name is part of a fleet.
    pub(crate) fn has(&self, drawn: &str) -> bool {
        let around = drawn.match_indices('/').map(|(end, _)| &drawn[..end]);
        around.chain([drawn]).any(|name| self.named(name).is_some())
    }

    /// The index of the fleet that is drawn under this name.
    pub(crate) fn named(&self, drawn: &str) -> Option<usize> {
        let at = self.place.get(drawn).copied();
        at.filter(|at| *self.all[*at].name == *drawn)
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
    let around = std::iter::successors(Some(name), |name| Some(namespace(name)));
    let around = around.take_while(|space| space.len() > 1);
    let is_numbered = |space: &&str| {
        (1..=MOST_DIGITS).contains(&index(space).len()) && !stem(space).ends_with('/')
    };
    around.filter(is_numbered).last()
}

/// A name without the number at its end.
fn stem(space: &str) -> &str {
    space.trim_end_matches(|c: char| c.is_ascii_digit())
}

/// The number at its end.
fn index(space: &str) -> &str {
    &space[stem(space).len()..]
}

/// Every namespace with a number, with a hash for each element in it and each of their edges.
fn described(elements: &Elements) -> BTreeMap<&str, Inside> {
    let mut all: BTreeMap<&str, Inside> = BTreeMap::new();
    for (name, element) in names(elements) {
        if let Some(space) = space_of(name) {
            let what = hash(&(element.is_node(), seen(name, space)));
            all.entry(space).or_default().insert(what);
        }
    }
    for (what, _) in elements.edges() {
        let (Some(node), Some(topic)) = elements.names(what) else {
            continue;
        };
        let publishes = matches!(what, Element::Publish(_));
        for space in [space_of(node), space_of(topic)].into_iter().flatten() {
            let what = hash(&(seen(node, space), publishes, seen(topic, space)));
            all.entry(space).or_default().insert(what);
        }
    }
    all
}

/// A name relative to one of several equal namespaces: the rest of it inside, or inside of another with the same index, after that
/// one's name without the index; the whole name elsewhere.
fn seen<'a>(name: &'a str, space: &str) -> (Option<&'a str>, &'a str) {
    if is_within(name, space) {
        return (Some(""), &name[space.len()..]);
    }
    let other = space_of(name).filter(|other| index(other) == index(space));
    other.map_or((None, name), |other| {
        (Some(stem(other)), &name[other.len()..])
    })
}

/// Drops fleets with a member that is linked to a namespace of the same index outside of all fleets, and
/// fleets linked to these: their members only look alike.
fn keep_linked(found: &mut Vec<(&str, Vec<&str>)>, elements: &Elements) {
    let mut place: BTreeMap<&str, usize> = BTreeMap::new();
    for (at, (_, members)) in found.iter().enumerate() {
        place.extend(members.iter().map(|member| (*member, at)));
    }
    let mut beside: Vec<Vec<usize>> = vec![Vec::new(); found.len()];
    let mut torn = Vec::new();
    for (what, _) in elements.edges().filter(|_| !found.is_empty()) {
        let (node, topic) = elements.names(what);
        let (Some(a), Some(b)) = (node.and_then(space_of), topic.and_then(space_of)) else {
            continue;
        };
        if a == b || index(a) != index(b) {
            continue;
        }
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
