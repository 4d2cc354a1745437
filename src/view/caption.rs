//! What changed in a window, in words, the most important first.

use std::collections::{BTreeMap, BTreeSet};

use super::items::Viewed;
use super::{ArrowKind, Frame, Item, ItemKind, Mark, Shown};
use crate::base::name::last_part;
use crate::base::words;
use crate::graph::diff::{Change, ValueKind};
use crate::graph::{Element, Elements, NodeId, TopicId};

/// At most so many phrases in one caption; the rest is counted.
const MOST_PHRASES: usize = 6;
/// From here on, things of one kind are counted instead of named.
const MOST_NAMED: usize = 3;
/// Longer names are cut.
const LONGEST_NAME: usize = 40;

/// Puts changes into words. Names are short where that is clear: `planner`, `scan`, but `/cmd_vel` at the root.
pub(crate) struct Speaker<'a> {
    viewed: &'a Viewed,
    elements: &'a Elements,
    /// Per item.
    names: Vec<String>,
    node_names: BTreeMap<&'a str, usize>,
}

impl<'a> Speaker<'a> {
    pub(crate) fn new(elements: &'a Elements, viewed: &'a Viewed) -> Self {
        let mut last_parts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
        for item in &viewed.items {
            *last_parts
                .entry((item.kind.word(), spoken(item)))
                .or_default() += 1;
        }
        let name = |item: &Item| {
            let short = spoken(item);
            let single = last_parts.get(&(item.kind.word(), short)) == Some(&1);
            let name = clip(if single { short } else { whole(item).0 });
            match (item.kind, whole(item).1) {
                (ItemKind::Group, Some(what)) => format!("{name} {what}"),
                _ => name,
            }
        };
        let mut node_names: BTreeMap<&str, usize> = BTreeMap::new();
        for node in &elements.nodes {
            *node_names.entry(last_part(node.name.as_str())).or_default() += 1;
        }
        Self {
            viewed,
            elements,
            names: viewed.items.iter().map(name).collect(),
            node_names,
        }
    }

    /// At most [`MOST_PHRASES`] phrases, and a last one that counts the rest.
    pub(crate) fn caption(&self, frame: &Frame, changes: &[Change]) -> Vec<String> {
        let mut phrases = Vec::new();
        for (mark, verb) in [(Mark::Added, "appeared"), (Mark::Removed, "vanished")] {
            self.comings(frame, mark, verb, &mut phrases);
        }
        self.told(frame, changes, &mut phrases);
        for (mark, verb) in [(Mark::Added, "appeared"), (Mark::Removed, "vanished")] {
            self.topics_alone(frame, mark, verb, &mut phrases);
        }
        self.rates(frame, &mut phrases);
        self.connections(frame, changes, &mut phrases);
        let inside = marked(&frame.items, Mark::Inside);
        let inside: Vec<String> = inside
            .map(|id| format!("changes inside {}", self.name(id)))
            .collect();
        named_or_counted(inside, "groups changed inside", &mut phrases);
        if phrases.len() > MOST_PHRASES {
            let rest = phrases.len() - (MOST_PHRASES - 1);
            phrases.truncate(MOST_PHRASES - 1);
            phrases.push(format!("and {rest} more"));
        }
        phrases
    }

    /// Nodes that came or went, each with the number of topics that came or went with it.
    fn comings(&self, frame: &Frame, mark: Mark, verb: &str, phrases: &mut Vec<String>) {
        let owners = self.owners(frame, mark);
        let nodes: Vec<u32> = marked(&frame.items, mark)
            .filter(|id| self.is_node(*id))
            .collect();
        let with = |count: usize| match count {
            0 => String::new(),
            1 => " with 1 topic".to_owned(),
            n => format!(" with {n} topics"),
        };
        if nodes.len() > MOST_NAMED {
            let topics = with(owners.len());
            phrases.push(format!("{} nodes {verb}{topics}", nodes.len()));
            return;
        }
        for node in nodes {
            let topics = owners.values().filter(|owner| **owner == node).count();
            phrases.push(format!("{} {verb}{}", self.name(node), with(topics)));
        }
    }

    /// Topics marked so all of whose publishers are nodes marked so, with one of those.
    fn owners(&self, frame: &Frame, mark: Mark) -> BTreeMap<u32, u32> {
        let news: BTreeSet<u32> = marked(&frame.items, mark).collect();
        let mut owners: BTreeMap<u32, Option<u32>> = BTreeMap::new();
        for shown in &frame.arrows {
            let Some(arrow) = self.viewed.arrows.get(shown.id as usize) else {
                continue;
            };
            if arrow.kind != ArrowKind::Publish || !news.contains(&arrow.to) {
                continue;
            }
            let owner = news.contains(&arrow.from).then_some(arrow.from);
            let known = owners.entry(arrow.to).or_insert(owner);
            *known = known.and(owner).and(*known);
        }
        let sure = |(topic, owner): (u32, Option<u32>)| Some((topic, owner?));
        owners.into_iter().filter_map(sure).collect()
    }

    /// Hand-overs, restarts and new values, in this order.
    fn told(&self, frame: &Frame, changes: &[Change], phrases: &mut Vec<String>) {
        let (mut handed, mut restarted, mut values) = (Vec::new(), Vec::new(), Vec::new());
        for change in changes {
            match change {
                Change::HandedOver { topic, from, to } => {
                    if let Some(name) = self.topic_name(frame, *topic) {
                        let (from, to) = (self.people(from), self.people(to));
                        handed.push(format!(
                            "{name} handed over{from}{to}",
                            from = prefixed(" from ", &from),
                            to = prefixed(" to ", &to)
                        ));
                    }
                }
                Change::Restarted { node, .. } => {
                    if let Some(name) = self.node_name(*node) {
                        restarted.push(format!("{name} restarted"));
                    }
                }
                Change::Value {
                    kind,
                    what,
                    from,
                    to,
                } => {
                    if let Some(name) = self.element_name(frame, *what) {
                        values.push(match kind {
                            ValueKind::Lifecycle if from.is_empty() => {
                                format!("{name} {}", clip(to))
                            }
                            ValueKind::Lifecycle => format!("{name} {} → {}", clip(from), clip(to)),
                            ValueKind::Type => format!("{name} changed its type"),
                            ValueKind::Qos => format!("{name} changed its quality of service"),
                        });
                    }
                }
                _ => {}
            }
        }
        named_or_counted(handed, "topics handed over", phrases);
        named_or_counted(restarted, "nodes restarted", phrases);
        named_or_counted(values, "states changed", phrases);
    }

    fn topics_alone(&self, frame: &Frame, mark: Mark, verb: &str, phrases: &mut Vec<String>) {
        let owners = self.owners(frame, mark);
        let alone =
            marked(&frame.items, mark).filter(|id| !self.is_node(*id) && !owners.contains_key(id));
        let alone: Vec<String> = alone
            .map(|id| format!("{} {verb}", self.name(id)))
            .collect();
        named_or_counted(alone, &format!("topics {verb}"), phrases);
    }

    /// Rates that changed, the largest factor first; between nodes, those of the arrows' topics.
    fn rates(&self, frame: &Frame, phrases: &mut Vec<String>) {
        let mut rates: BTreeMap<String, (f64, f64)> = BTreeMap::new();
        let told = |shown: &Shown| Some((shown.from_hz?, shown.hz?));
        for shown in frame.items.iter().filter(|s| told(s).is_some()) {
            rates.extend(told(shown).map(|rate| (self.name(shown.id).to_owned(), rate)));
        }
        for shown in &frame.arrows {
            let arrow = self.viewed.arrows.get(shown.id as usize);
            if let Some(ArrowKind::Direct(topic)) = arrow.map(|a| &a.kind) {
                rates.extend(told(shown).map(|rate| (clip(topic), rate)));
            }
        }
        let factor = |(from, to): &(f64, f64)| from.max(*to) / from.min(*to).max(1e-9);
        let mut rates: Vec<_> = rates.into_iter().collect();
        rates.sort_by(|a, b| factor(&b.1).total_cmp(&factor(&a.1)));
        let rest = rates.len().saturating_sub(MOST_NAMED);
        for (name, (from, to)) in rates.iter().take(MOST_NAMED) {
            phrases.push(format!("{name} {}", words::rate_change(*from, *to)));
        }
        match rest {
            0 => {}
            1 => phrases.push("1 other rate changed".to_owned()),
            n => phrases.push(format!("{n} other rates changed")),
        }
    }

    /// Connections that came or went between items that stayed, but for those of topics that were handed over.
    fn connections(&self, frame: &Frame, changes: &[Change], phrases: &mut Vec<String>) {
        let handed: BTreeSet<u32> = changes
            .iter()
            .filter_map(|change| match change {
                Change::HandedOver { topic, .. } => *self.viewed.topic.get(*topic as usize)?,
                _ => None,
            })
            .collect();
        let moving = |id: u32| {
            let at = frame.items.binary_search_by_key(&id, |s| s.id).ok();
            let mark = at.and_then(|at| frame.items.get(at)).and_then(|s| s.mark);
            matches!(mark, Some(Mark::Added | Mark::Removed))
        };
        for (mark, now, plural) in [
            (Mark::Added, "now", "connections appeared"),
            (Mark::Removed, "no longer", "connections vanished"),
        ] {
            let mut all = Vec::new();
            for id in marked(&frame.arrows, mark) {
                let Some(arrow) = self.viewed.arrows.get(id as usize) else {
                    continue;
                };
                if moving(arrow.from) || moving(arrow.to) || handed.contains(&arrow.to) {
                    continue;
                }
                let (from, to) = (self.name(arrow.from), self.name(arrow.to));
                all.push(match &arrow.kind {
                    ArrowKind::Publish => format!("{from} {now} publishes {to}"),
                    ArrowKind::Subscribe => format!("{to} {now} subscribes {from}"),
                    ArrowKind::Direct(topic) => {
                        format!("{from} {now} sends {} to {to}", clip(topic))
                    }
                });
            }
            named_or_counted(all, plural, phrases);
        }
    }

    fn name(&self, item: u32) -> &str {
        self.names.get(item as usize).map_or("", String::as_str)
    }

    fn is_node(&self, item: u32) -> bool {
        let item = self.viewed.items.get(item as usize);
        item.is_some_and(|item| item.kind.word() == "node")
    }

    /// The name of a node that has a box of its own.
    fn node_name(&self, node: NodeId) -> Option<&str> {
        let item = (*self.viewed.node.get(node as usize)?)?;
        let alone = self.viewed.items.get(item as usize)?.kind == ItemKind::Node;
        alone.then(|| self.name(item))
    }

    /// The name of a topic that has a box of its own in this window, or an arrow from node to node.
    fn topic_name(&self, frame: &Frame, topic: TopicId) -> Option<String> {
        let carriers = self.viewed.carriers.get(&Element::Topic(topic));
        if let Some(arrows) = carriers.filter(|_| !self.viewed.pairs.is_empty()) {
            let there = |id: &u32| frame.arrows.binary_search_by_key(id, |s| s.id).is_ok();
            let name = self.elements.topics.get(topic as usize)?.name.as_str();
            return arrows.iter().any(there).then(|| clip(name));
        }
        let id = (*self.viewed.topic.get(topic as usize)?)?;
        let item = self.viewed.items.get(id as usize)?;
        let alone =
            item.kind == ItemKind::Topic || item.kind == ItemKind::Group && item.members.len() == 1;
        let there = frame.items.binary_search_by_key(&id, |s| s.id).is_ok();
        (alone && there).then(|| self.name(id).to_owned())
    }

    fn element_name(&self, frame: &Frame, what: Element) -> Option<String> {
        match what {
            Element::Node(id) => self.node_name(id).map(str::to_owned),
            Element::Topic(id) => self.topic_name(frame, id),
            Element::Publish(_) | Element::Subscribe(_) => None,
        }
    }

    /// Nodes by name, whether or not they are shown: `planner`, `planner and teleop`, `4 nodes`.
    fn people(&self, nodes: &[NodeId]) -> String {
        let name = |id: &NodeId| {
            let name = self.elements.nodes.get(*id as usize)?.name.as_str();
            let short = last_part(name);
            let single = self.node_names.get(short) == Some(&1);
            Some(clip(if single { short } else { name }))
        };
        let names: Vec<String> = nodes.iter().filter_map(name).collect();
        match &names[..] {
            [] => String::new(),
            [one] => one.clone(),
            [one, two] => format!("{one} and {two}"),
            more => format!("{} nodes", more.len()),
        }
    }
}

/// The short name of an item: its last part, but the full name of a topic at the root.
fn spoken(item: &Item) -> &str {
    let (name, _) = whole(item);
    let is_root = name.rfind('/') == Some(0);
    match item.kind {
        ItemKind::Topic if is_root => name,
        ItemKind::Group if item.members.len() == 1 => name,
        _ => last_part(name),
    }
}

/// The name of an item, and what a group is a group of: `/nav`, `action`.
fn whole(item: &Item) -> (&str, Option<&'static str>) {
    let kinds = [
        ("/action_topics", "action"),
        ("/image_topics", "image"),
        ("/service_events", "services"),
    ];
    let is_group = item.kind == ItemKind::Group;
    let mut kinds = kinds.into_iter().filter(|_| is_group);
    kinds
        .find_map(|(suffix, what)| Some((item.name.strip_suffix(suffix)?, Some(what))))
        .unwrap_or((&item.name, None))
}

fn clip(name: &str) -> String {
    words::shorten(name, LONGEST_NAME).into_owned()
}

fn prefixed(prefix: &str, text: &str) -> String {
    match text {
        "" => String::new(),
        _ => format!("{prefix}{text}"),
    }
}

fn marked(all: &[Shown], mark: Mark) -> impl Iterator<Item = u32> + '_ {
    let is = move |shown: &&Shown| shown.mark == Some(mark);
    all.iter().filter(is).map(|shown| shown.id)
}

fn named_or_counted(all: Vec<String>, plural: &str, phrases: &mut Vec<String>) {
    if all.len() > MOST_NAMED {
        phrases.push(format!("{} {plural}", all.len()));
    } else {
        phrases.extend(all);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::testing::mission;
    use crate::view::{ViewOptions, view};

    /// The caption of the last window.
    fn caption(windows: &[&str]) -> String {
        let (view, _) = view(&mission(windows), &ViewOptions::default());
        view.frames.last().unwrap().caption.join("; ")
    }

    #[test]
    fn nodes_come_with_their_topics() {
        assert_eq!(
            caption(&["/a", "/a /cam/driver>/cam/image /cam/driver>/cam/info"]),
            "driver appeared with 2 topics"
        );
        assert_eq!(caption(&["/a /b>/t", "/a"]), "b vanished with 1 topic");
    }

    #[test]
    fn topics_rates_and_connections_have_their_own_words() {
        assert_eq!(caption(&["/a", "/a =/s/scan"]), "scan appeared");
        assert_eq!(
            caption(&["=/s/scan@15", "=/s/scan@7.4"]),
            "scan 15 → 7.4 Hz"
        );
        assert_eq!(caption(&["/a>/t /b", "/a>/t /b</t"]), "b now subscribes /t");
        assert_eq!(
            caption(&["/a>/t /b>/t", "/a>/t /b"]),
            "b no longer publishes /t"
        );
        assert_eq!(
            caption(&["=/a =/b =/c =/d", "/x"]),
            "x appeared; 4 topics vanished"
        );
        assert_eq!(caption(&["/a", "/a"]), "");
    }

    #[test]
    fn a_hand_over_is_told_once() {
        let mission = mission(&["/planner>/cmd_vel@2 /teleop", "/planner /teleop>/cmd_vel@2"]);
        let (view, _) = view(&mission, &ViewOptions::default());
        assert_eq!(
            view.frames[1].caption,
            ["/cmd_vel handed over from planner to teleop"]
        );
        let topic = view.frames[1].items.last().unwrap();
        assert_eq!(
            (topic.mark, view.frames[1].tally.others),
            (Some(Mark::HandedOver), 1)
        );
    }

    #[test]
    fn many_changes_are_bounded() {
        let name = "x".repeat(10_000);
        let now = format!("/{name} /b /c =/e =/f =/g =/h@5 =/i@5 =/j@5 =/k@5 =/l@5");
        let before = "/m /n /o =/p =/q =/r =/h@1 =/i@1 =/j@1 =/k@1 =/l@1";
        let caption = caption(&[before, &now]);
        assert_eq!(caption.split("; ").count(), MOST_PHRASES);
        assert!(
            caption.len() < 400 && caption.ends_with("and 11 more"),
            "{caption}"
        );
    }
}
