//! The map with differences: nodes that start and stop, and those connected to them, at fixed positions in
//! every phase, with changes of the phase in colour.

use std::collections::{BTreeMap, BTreeSet};

use super::StepSource;
use crate::base::error::{Error, Result};
use crate::draw::figure::MOST_HEIGHT;
use crate::draw::figure::groups::groups;
use crate::draw::figure::page::FigureSheet;
use crate::draw::figure::panel::{BoxState, Panel, PanelBox};
use crate::draw::figure::place::PlacedPanel;
use crate::draw::figure::talks::Talk;
use crate::draw::scene::Scene;
use crate::draw::timeline::canvas::PX_PER_MM;
use crate::draw::timeline::marks::Sign;

/// The figure and its remarks: with as many panels side by side as fit, of nodes, else of nodes that start
/// and stop together; if that is too high and the user chose no steps, without the first phase, then without
/// the smallest steps.
pub(crate) fn draw(sheet: &FigureSheet<'_>) -> Result<(Scene, Vec<String>)> {
    let mut steps = StepSource::new(sheet)?;
    let most = steps.columns;
    let mut chosen = steps.chosen()?;
    let is_free = sheet.options.steps.is_empty();
    while !chosen.is_empty() {
        let left = steps.left_out(&chosen);
        for (is_grouped, has_first) in [(false, true), (false, false), (true, false)] {
            let first = Some(0).filter(|_| is_free && has_first);
            let phases: Vec<usize> = first.into_iter().chain(chosen.iter().copied()).collect();
            for columns in (1..=most).rev() {
                steps.columns = columns;
                let panels = Union::new(&steps, &chosen, is_grouped).panels(&phases);
                let scene = panels.map(|panels| steps.page(&panels, &[], left));
                if let Some(scene) = scene.filter(|s| s.size.h <= MOST_HEIGHT * PX_PER_MM) {
                    return Ok((scene, Vec::new()));
                }
            }
        }
        if !is_free {
            break;
        }
        steps.drop_least(&mut chosen);
    }
    Err(Error::usage(
        format!("these phases are higher than {MOST_HEIGHT} mm with fixed positions"),
        "draw fewer with `--steps 3,5`, use `--kind steps`, or omit nodes with `--ns-filter`",
    ))
}

/// The elements that the steps change, with their neighbours, over all phases.
struct Union<'u, 's> {
    steps: &'u StepSource<'s>,
    /// The rows of each box, and whether it ever changes.
    boxes: Vec<(bool, Vec<usize>)>,
    /// The arrows of each phase: from, to, topics.
    talks: Vec<BTreeMap<(usize, usize), Talk>>,
}

impl<'u, 's> Union<'u, 's> {
    fn new(steps: &'u StepSource<'s>, chosen: &[usize], is_grouped: bool) -> Self {
        let source = steps.sheet.source;
        let changed: BTreeSet<usize> = chosen
            .iter()
            .flat_map(|k| {
                let turned = [Sign::Start, Sign::End].map(|sign| steps.turned(*k, sign));
                turned.into_iter().flat_map(BTreeMap::into_keys)
            })
            .collect();
        let all = groups(source, &steps.tracks, steps.depth);
        let mut boxes: Vec<(bool, Vec<usize>)> = Vec::new();
        for group in &all {
            let own = group.members.iter().filter(|at| changed.contains(at));
            let own: Vec<usize> = own.copied().collect();
            if is_grouped && !own.is_empty() {
                boxes.push((true, own));
            } else {
                boxes.extend(own.into_iter().map(|at| (true, vec![at])));
            }
        }
        let many = boxes.len();
        for group in &all {
            let others = group.members.iter().filter(|at| !changed.contains(at));
            let others: Vec<usize> = others.copied().collect();
            if !others.is_empty() {
                boxes.push((false, others));
            }
        }
        let mut union = Self {
            steps,
            boxes,
            talks: Vec::new(),
        };
        union.talk(many);
        // Neighbours without an arrow to a changed node are not informative.
        let linked: BTreeSet<usize> = union
            .talks
            .iter()
            .flat_map(BTreeMap::keys)
            .flat_map(|(from, to)| [*from, *to])
            .collect();
        let mut at = 0..;
        union.boxes.retain(|_| {
            at.next()
                .is_some_and(|at| at < many || linked.contains(&at))
        });
        union.talk(many);
        union
    }

    /// Finds the arrows of every phase at the first `many` boxes.
    fn talk(&mut self, many: usize) {
        let steps = self.steps;
        let mut vertex = vec![None; steps.tracks.len()];
        for (at, (_, members)) in self.boxes.iter().enumerate() {
            for member in members {
                vertex[*member] = Some(at);
            }
        }
        let of_phase = |span| {
            let all = steps.talks.between(&vertex, span, true);
            let own = all.into_iter().filter(|t| t.from < many || t.to < many);
            own.map(|talk| ((talk.from, talk.to), talk)).collect()
        };
        let phases = steps.sheet.source.phases.iter();
        self.talks = phases.map(|phase| of_phase(phase.span)).collect();
    }

    /// The panels of these phases; `None` if they are too wide.
    fn panels(&self, phases: &[usize]) -> Option<Vec<Panel>> {
        let (steps, source) = (self.steps, self.steps.sheet.source);
        let mut links: BTreeMap<(usize, usize), Talk> = BTreeMap::new();
        for (key, talk) in phases.iter().flat_map(|k| &self.talks[*k]) {
            let all = links.entry(*key).or_insert_with(|| talk.clone());
            let new = talk.topics.iter().filter(|(topic, _)| {
                let known = all.topics.iter().any(|(other, _)| other == topic);
                !known
            });
            let new: Vec<_> = new.copied().collect();
            all.topics.extend(new);
        }
        let links: Vec<(Talk, BoxState)> = links
            .into_values()
            .map(|talk| (talk, BoxState::Neighbour))
            .collect();
        let looks: Vec<PanelBox> = (0..self.boxes.len())
            .map(|at| self.look(at, BoxState::Began))
            .collect();
        let labels: Vec<Vec<Vec<String>>> =
            links.iter().map(|(t, _)| t.labels(source, 1)).collect();
        let canvas = steps.sheet.canvas();
        let placed = steps.placed(&canvas, &looks, &links, &labels)?;
        let panel = |k: &usize| self.panel(*k, &links, &labels, &placed);
        Some(phases.iter().map(panel).collect())
    }

    fn look(&self, at: usize, state: BoxState) -> PanelBox {
        let (changes, members) = &self.boxes[at];
        let named = members.first().copied().filter(|_| !changes);
        self.steps.look(state, members, named, None)
    }

    /// Phase `k`: the elements that exist in it, and those that ended as it began.
    fn panel(
        &self,
        k: usize,
        links: &[(Talk, BoxState)],
        labels: &[Vec<Vec<String>>],
        placed: &PlacedPanel,
    ) -> Panel {
        let steps = self.steps;
        let turned = |sign| match k {
            0 => BTreeMap::new(),
            _ => steps.turned(k, sign),
        };
        let (began, ended) = (turned(Sign::Start), turned(Sign::End));
        let is_there = |at: &usize| steps.found[k].names.contains(&steps.tracks[*at].name);
        let states: Vec<Option<BoxState>> = self
            .boxes
            .iter()
            .map(|(_, members)| {
                let any = |of: &dyn Fn(&usize) -> bool| members.iter().any(of);
                if any(&|at| began.contains_key(at)) {
                    Some(BoxState::Began)
                } else if any(&|at| ended.contains_key(at)) {
                    Some(BoxState::Ended)
                } else {
                    any(&is_there).then_some(BoxState::Neighbour)
                }
            })
            .collect();
        let drawn: Vec<usize> = (0..states.len())
            .filter(|at| states[*at].is_some())
            .collect();
        let change_of = |(talk, _): &(Talk, BoxState)| {
            let (key, ends) = ((talk.from, talk.to), [states[talk.from]?, states[talk.to]?]);
            let before = k.checked_sub(1).map(|before| &self.talks[before]);
            if ends.contains(&BoxState::Ended) {
                let was = before.is_some_and(|talks| talks.contains_key(&key));
                return was.then_some(BoxState::Ended);
            }
            let is_new = ends.contains(&BoxState::Began);
            let state = if is_new {
                BoxState::Began
            } else {
                BoxState::Neighbour
            };
            self.talks[k].contains_key(&key).then_some(state)
        };
        let arrows: Vec<(usize, BoxState)> = links
            .iter()
            .enumerate()
            .filter_map(|(at, link)| Some((at, change_of(link)?)))
            .collect();
        let shown: Vec<usize> = arrows.iter().map(|(at, _)| *at).collect();
        let looks = drawn.iter().filter_map(|at| {
            let mut look = self.look(*at, states[*at]?);
            let turned = self.boxes[*at].1.iter();
            let events = turned.flat_map(|m| began.get(m).into_iter().chain(ended.get(m)));
            look.events = events.flatten().copied().collect();
            Some(look)
        });
        let looks: Vec<PanelBox> = looks.collect();
        let names = steps.found[k].names.len();
        let boxed = drawn.iter().flat_map(|at| &self.boxes[*at].1);
        Panel {
            talks: arrows
                .iter()
                .map(|(at, state)| (links[*at].0.clone(), *state))
                .collect(),
            labels: shown.iter().map(|at| labels[*at].clone()).collect(),
            undrawn: names.saturating_sub(boxed.filter(|at| is_there(at)).count()),
            ..steps.drawn(k, (k + 1).to_string(), looks, placed.only(&drawn, &shown))
        }
    }
}
