//! Merged lines: those from the boxes of a namespace to the same box outside begin at its frame while they
//! are unchanged, and those of one topic to several subscribers separate only after their label.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::arrows::ArrowPath;
use super::{GraphFit, texts};
use crate::base::geometry::Size;
use crate::base::ids::grouped;
use crate::draw::style::Edge;
use crate::draw::text::Fonts;
use crate::graph::{ById, Id as _};
use crate::layout::Layout;
use crate::view::{Arrow, ArrowId, ArrowKind, ItemId, Shown, ShownRuns, TopicRow, View};

/// The lines between the boxes of a namespace and one box outside of it, drawn as one while they are
/// unchanged.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Gate {
    /// The namespace: an index into [`View::namespaces`].
    space: usize,
    /// The line whose route is used for all.
    pub(crate) lead: ArrowId,
    /// Every line, and whether it begins inside.
    members: Vec<(ArrowId, bool)>,
    /// The lines as one, with the ends of the lead.
    pub(crate) arrow: Arrow,
}

/// The gates of a view. Lines to topics, which are drawn as boxes, have none.
pub(crate) fn gates(view: &View) -> Vec<Gate> {
    let crossing = |(at, arrow): (ArrowId, &Arrow)| {
        let (space, is_outward) = crossed(view, arrow)?;
        let outside = if is_outward { arrow.to } else { arrow.from };
        is_between_nodes(view, arrow).then_some(((space, outside), (at, is_outward)))
    };
    let found = grouped(view.arrows.with_ids().filter_map(crossing));
    let found = found.into_iter().filter(|(_, members)| members.len() > 1);
    let windows = u32::try_from(view.frames.len()).unwrap_or(u32::MAX);
    let gate = |((space, _), members): (_, Vec<(ArrowId, bool)>)| {
        // The number of windows in which it exists without a mark.
        let quiet = |at: ArrowId| -> u32 {
            let runs = view.arrows_shown.get(at).into_iter();
            let runs = runs.flat_map(|shown| shown.spans(windows));
            let quiet = runs.filter(|(.., look)| is_quiet(look));
            quiet.map(|(from, to, ..)| to - from).sum()
        };
        let longest = members.iter().rev().max_by_key(|(at, _)| quiet(*at));
        let lead = longest.map_or(ArrowId(0), |(at, _)| *at);
        let arrows = || members.iter().map(|(at, _)| &view.arrows[*at]);
        let topics: BTreeSet<Arc<str>> = arrows().flat_map(|a| a.topics.iter().cloned()).collect();
        let edges: BTreeSet<_> = arrows().flat_map(|a| a.members.iter().copied()).collect();
        Gate {
            space,
            lead,
            arrow: Arrow {
                members: edges.into_iter().collect(),
                topics: topics.into_iter().collect(),
                ..view.arrows[lead].clone()
            },
            members,
        }
    };
    found.map(gate).collect()
}

fn is_quiet(shown: &Shown) -> bool {
    shown.mark.is_none() && !shown.is_starved && shown.topics.iter().all(|row| row.mark.is_none())
}

fn is_between_nodes(view: &View, arrow: &Arrow) -> bool {
    let is_node = |item: ItemId| {
        let item = view.items.get(item);
        item.is_some_and(|item| item.kind.word() == "node")
    };
    arrow.kind == ArrowKind::Bundle && is_node(arrow.from) && is_node(arrow.to)
}

/// The outermost namespace whose frame a line crosses, and whether it begins inside; `None` if it crosses none, or
/// those of both ends.
fn crossed(view: &View, arrow: &Arrow) -> Option<(usize, bool)> {
    let [from, to] = [arrow.from, arrow.to].map(|item| view.around(item).collect::<Vec<usize>>());
    let outermost =
        |inside: &[usize], other: &[usize]| inside.iter().rfind(|at| !other.contains(at)).copied();
    match (outermost(&from, &to), outermost(&to, &from)) {
        (Some(space), None) => Some((space, true)),
        (None, Some(space)) => Some((space, false)),
        _ => None,
    }
}

impl Gate {
    /// The indices of its lines.
    pub(crate) fn lines(&self) -> impl Iterator<Item = ArrowId> {
        self.members.iter().map(|(at, _)| *at)
    }

    /// The look of the line for all lines that are unchanged in a window, and these lines; `None` if there
    /// are none, or if the leading line has changed.
    pub(crate) fn shown<'a>(
        &self,
        view: &View,
        look: impl Fn(ArrowId) -> Option<&'a Shown>,
    ) -> Option<(Shown, Vec<ArrowId>)> {
        if look(self.lead).is_some_and(|shown| !is_quiet(shown)) {
            return None;
        }
        let leads_out = self.members.contains(&(self.lead, true));
        let mut all: Option<Shown> = None;
        let mut quiet = Vec::new();
        let mut rows: BTreeMap<u32, TopicRow> = BTreeMap::new();
        for &(at, runs_out) in &self.members {
            let Some(shown) = look(at).filter(|shown| is_quiet(shown)) else {
                continue;
            };
            quiet.push(at);
            for row in &shown.topics {
                let name = view.arrows[at].topics.get(row.topic as usize);
                let topic = name.and_then(|name| self.arrow.topics.binary_search(name).ok());
                let Some(topic) = topic.and_then(|topic| u32::try_from(topic).ok()) else {
                    continue;
                };
                let mut ways = row.ways;
                if runs_out != leads_out {
                    ways.reverse();
                }
                let row = TopicRow {
                    topic,
                    ways,
                    ..row.clone()
                };
                let is_sent_inside = row.ways[usize::from(!leads_out)];
                rows.entry(topic)
                    .and_modify(|old| old.join(&row, is_sent_inside))
                    .or_insert(row);
            }
            match &mut all {
                Some(all) => {
                    all.state = all.state.min(shown.state);
                    all.confidence = all.confidence.min(shown.confidence);
                    all.is_paused &= shown.is_paused;
                }
                None => all = Some(shown.clone()),
            }
        }
        let topics: Vec<TopicRow> = rows.into_values().collect();
        let hz: Option<f64> = topics.iter().filter_map(|row| row.hz).reduce(|a, b| a + b);
        let shown = Shown {
            hz,
            steady_hz: hz,
            topics,
            ..all?
        };
        Some((shown, quiet))
    }

    /// The route of the merged line outside of the frame; `None` if its label is inside.
    pub(crate) fn path(
        &self,
        view: &View,
        lead: &ArrowPath,
        layout: &Layout,
        fit: GraphFit,
    ) -> Option<ArrowPath> {
        let frame = fit.rect(*layout.clusters.get(self.space)?);
        let is_outward = crossed(view, &self.arrow)?.1;
        let mut path = lead.outside(frame, is_outward)?;
        path.ends[usize::from(!is_outward)] = view.namespaces[self.space].name.to_string();
        path.id = format!("g{}", path.id);
        Some(path)
    }
}

/// Gives the labels of merged lines the same space: for a gate, on its leading line; for a fork, on all of
/// its lines.
pub(crate) fn share(
    view: &View,
    fonts: &Fonts,
    style: &Edge,
    rooms: &mut ById<ArrowId, Option<Size>>,
    gates: &[(Gate, Vec<String>)],
    forks: &ById<ArrowId, Option<usize>>,
) {
    for (gate, names) in gates {
        // Lines that are drawn separately in some window keep their own.
        let shown = |at: ArrowId| view.arrows_shown.get(at);
        let is_lively = |shown: &ShownRuns| !shown.distinct().iter().all(is_quiet);
        let is_changed = |at: ArrowId| shown(at).is_some_and(is_lively);
        let is_lead_changed = is_changed(gate.lead);
        for at in gate.lines() {
            rooms[at] = rooms[at].filter(|_| is_lead_changed || is_changed(at));
        }
        let look = |at: ArrowId, window: u32| view.arrows_shown[at].at(window as usize);
        for window in ShownRuns::turns(gate.lines().filter_map(shown)) {
            let shown = gate.shown(view, |at| look(at, window));
            let rows = shown.map(|(shown, _)| texts::rows(&shown, names));
            let room = rows.and_then(|rows| texts::room(&rows, fonts, style));
            rooms[gate.lead] = larger(rooms[gate.lead], room);
        }
    }
    let mut shared: BTreeMap<usize, Option<Size>> = BTreeMap::new();
    let forked = || {
        forks
            .with_ids()
            .filter_map(|(at, fork)| Some((at, (*fork)?)))
    };
    for (at, fork) in forked() {
        let room = shared.entry(fork).or_default();
        *room = larger(*room, rooms[at]);
    }
    for (at, fork) in forked() {
        rooms[at] = shared.get(&fork).copied().flatten();
    }
}

/// A size at least as wide and as high as both.
pub(crate) fn larger(a: Option<Size>, b: Option<Size>) -> Option<Size> {
    match (a, b) {
        (Some(a), Some(b)) => Some(Size::new(a.w.max(b.w), a.h.max(b.h))),
        (a, b) => a.or(b),
    }
}

/// The fork of each line: the number of the first line from the same box with the same single topic, if there
/// are several. Either all lines of a gate belong to one fork, or none do.
pub(crate) fn forks(view: &View, gates: &[(Gate, Vec<String>)]) -> ById<ArrowId, Option<usize>> {
    let mut forks: BTreeMap<(ItemId, &str), Vec<ArrowId>> = BTreeMap::new();
    let single = |at: ArrowId| {
        let arrow = &view.arrows[at];
        let [topic] = &arrow.topics[..] else {
            return None;
        };
        let looks = view.arrows_shown.get(at)?.distinct();
        let is_sent = |shown: &Shown| shown.topics.iter().all(|row| row.ways == [true, false]);
        let is_fork = looks.iter().all(is_sent) && is_between_nodes(view, arrow);
        is_fork.then_some((arrow.from, &**topic))
    };
    let mut gate_of: BTreeMap<ArrowId, &Gate> = BTreeMap::new();
    for (gate, _) in gates {
        gate_of.extend(gate.members.iter().map(|(at, _)| (*at, gate)));
    }
    for at in view.arrows.ids() {
        let gate = gate_of.get(&at);
        let mut others = gate.iter().flat_map(|gate| &gate.members);
        if let Some(key) = single(at)
            && others.all(|(other, _)| single(*other) == Some(key))
        {
            forks.entry(key).or_default().push(at);
        }
    }
    let mut of = ById::like(&view.arrows, None);
    for members in forks.values().filter(|members| members.len() > 1) {
        for at in members {
            of[*at] = Some(members[0].at());
        }
    }
    of
}
