//! Steps: one panel per phase boundary, with only the nodes that began or ended, the topics that were taken
//! over, and the nodes linked to them.

pub(crate) mod changes;
mod events;
mod repeated;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::groups::{cut, depths, groups};
use super::page::{FITTING, FigureSheet, filter_that_fits, nothing};
use super::panel::{BoxState, INSIDE, Panel, PanelBox, items, paint};
use super::place::{PlacedPanel, place};
use super::talks::{Talk, Talks};
use super::{MOST_HEIGHT, RowKind};
use crate::base::error::{Error, Result};
use crate::base::geometry::{Rect, Size};
use crate::base::name::{last_part, namespace};
use crate::base::words;
use crate::draw::scene::Scene;
use crate::draw::timeline::canvas::{PX_PER_MM, PaperCanvas, ink};
use crate::draw::timeline::drawer::clock;
use crate::draw::timeline::marks::Sign;
use crate::draw::timeline::notes::{Unbroken, flow, sentence};
use crate::draw::timeline::phases::title;
use crate::draw::timeline::rows::{Row, of_nodes};
use crate::graph::TopicId;
use crate::layout::{Outline, Plan, Vertex};
use crate::mission::EventId;
use crate::mission::phases::{Configuration, configurations};

/// The number of steps shown unless some are requested.
const SHOWN: usize = 6;
/// The largest number of changed nodes that are drawn separately; more are drawn as groups.
const ONE_BY_ONE: usize = 8;
/// The most names in a box.
const NAMED: usize = 4;
/// The space between two panels in millimetres.
const BETWEEN: f64 = 2.0;

/// The source of panels.
struct StepSource<'s> {
    sheet: &'s FigureSheet<'s>,
    tracks: Vec<Row>,
    talks: Talks<'s>,
    found: Vec<Configuration>,
    /// The events of the log on the rows.
    /// The number of panels side by side.
    columns: usize,
    /// The number of parts of namespaces that distinguish groups.
    depth: usize,
}

/// The figure and its remarks.
pub(crate) fn draw(sheet: &FigureSheet<'_>) -> Result<(Scene, Vec<String>)> {
    let mut steps = StepSource::new(sheet)?;
    let columns = steps.columns;
    let mut chosen = steps.chosen()?;
    loop {
        let panels: Option<Vec<Panel>> = chosen.iter().map(|k| steps.panel(*k)).collect();
        let Some(mut panels) = panels else {
            // Fewer panels side by side are wider; shorter namespaces make fewer groups.
            match (steps.columns, steps.depth) {
                (1, 1) => return Err(steps.too_wide()),
                (1, _) => (steps.columns, steps.depth) = (columns, steps.depth - 1),
                _ => steps.columns -= 1,
            }
            continue;
        };
        let (left, repeated) = (steps.left_out(&chosen), steps.fold_repeated(&mut panels));
        let scene = steps.page(&panels, &repeated, left);
        if scene.size.h <= MOST_HEIGHT * PX_PER_MM {
            return Ok((scene, Vec::new()));
        }
        if chosen.len() == 1 || !sheet.options.steps.is_empty() {
            return Err(Error::usage(
                format!("these steps are higher than {MOST_HEIGHT} mm"),
                "show fewer with `--steps 3`, make them smaller with `--rows groups`, or omit nodes with `--ns-filter`",
            ));
        }
        steps.drop_least(&mut chosen);
    }
}

impl<'s> StepSource<'s> {
    fn new(sheet: &'s FigureSheet<'s>) -> Result<Self> {
        let tracks = of_nodes(sheet.source);
        if tracks.is_empty() {
            return Err(nothing(sheet.source));
        }
        if sheet.source.phases.is_empty() {
            return Err(Error::usage(
                "this mission has a single phase and therefore no steps",
                "draw `lives` instead, or set your own phases with `--phases FILE`",
            ));
        }
        Ok(Self {
            columns: match sheet.options.width_mm {
                w if w >= 150.0 => 3,
                w if w >= 110.0 => 2,
                _ => 1,
            },
            depth: depths(&tracks).next().unwrap_or(1),
            talks: Talks::new(sheet.source, &tracks),
            found: configurations(sheet.source.mission, sheet.source.phases),
            tracks,
            sheet,
        })
    }

    /// The boundaries to show, by the index of the phase that begins.
    fn chosen(&self) -> Result<Vec<usize>> {
        let many = self.sheet.source.phases.len();
        let asked = &self.sheet.options.steps;
        if let Some(wrong) = asked.iter().find(|n| **n < 2 || **n > many) {
            return Err(Error::usage(
                format!("no step leads into phase {wrong}"),
                format!("phases are counted from 1 to {many}; steps lead into 2 to {many}"),
            ));
        }
        let mut all: Vec<usize> = match &asked[..] {
            [] => (1..many).collect(),
            asked => asked.iter().map(|n| n - 1).collect(),
        };
        all.retain(|k| self.weight(*k) > 0);
        if all.is_empty() {
            return Err(Error::usage(
                "no node with a known partner starts, stops or hands over a topic, so there is no step to draw",
                "draw `--kind lives` instead",
            ));
        }
        if !asked.is_empty() {
            return Ok(all);
        }
        all.sort_by_key(|k| (std::cmp::Reverse(self.weight(*k)), *k));
        all.truncate(SHOWN);
        all.sort_unstable();
        Ok(all)
    }

    fn drop_least(&self, chosen: &mut Vec<usize>) {
        let least = chosen
            .iter()
            .copied()
            .min_by_key(|k| (self.weight(*k), std::cmp::Reverse(*k)));
        chosen.retain(|k| Some(*k) != least);
    }

    fn too_wide(&self) -> Error {
        let width = self.sheet.options.width_mm;
        let hint = match self.sheet.options.rows {
            _ if width < 181.0 => "use `--width 181mm`".to_owned(),
            Some(RowKind::Nodes) => "use `--rows groups`, which is smaller".to_owned(),
            _ => filter_that_fits(&self.tracks, FITTING, "--ns-filter", "node"),
        };
        Error::usage(format!("a step is wider than {width} mm"), hint)
    }

    fn panel_width(&self) -> f64 {
        let columns = self.columns as f64;
        (self.sheet.options.width_mm - BETWEEN * (columns - 1.0)) / columns
    }

    fn track(&self, name: &str) -> Option<usize> {
        self.tracks.iter().position(|t| &*t.name == name)
    }

    /// The panel of the boundary into phase `k`; `None` if it is too wide.
    fn panel(&self, k: usize) -> Option<Panel> {
        let source = self.sheet.source;
        let canvas = self.sheet.canvas();
        let (before, after) = (&self.found[k - 1].names, &self.found[k].names);
        let place_of = |name: &Arc<str>| self.track(name);
        let turned = [Sign::Start, Sign::End].map(|sign| self.turned(k, sign));
        let [began, ended] = turned
            .each_ref()
            .map(|t| t.keys().copied().collect::<BTreeSet<_>>());
        let handed = self.handed(k);
        // An element that ended long ago is mentioned only in the note.
        let partners = handed.iter().flat_map(|(_, from, to, _)| [from, to]);
        let partners = partners.filter(|name| before.contains(*name) || after.contains(*name));
        let partners: BTreeSet<usize> = partners
            .filter_map(place_of)
            .filter(|at| !began.contains(at) && !ended.contains(at))
            .collect();
        let mut boxes = self.boxes(&[
            (BoxState::Began, &began),
            (BoxState::Ended, &ended),
            (BoxState::ChangedHands, &partners),
        ]);
        let mut vertex: Vec<Option<usize>> = vec![None; self.tracks.len()];
        for (k, (_, members)) in boxes.iter().enumerate() {
            for at in members {
                vertex[*at] = Some(k);
            }
        }
        let changed = boxes.len();
        let linked = self.neighbours(k, &mut boxes, &mut vertex, (before, after));
        let states: Vec<BoxState> = boxes.iter().map(|(state, _)| *state).collect();
        let talks = self.talks(k, &vertex, &states, &handed);
        let home = self.home(&boxes);
        let looks: Vec<PanelBox> = boxes
            .iter()
            .enumerate()
            .map(|(at, (state, members))| {
                let named = (at >= changed).then(|| linked.get(&at).copied()).flatten();
                let mut events = self.events(k, members);
                let turned = turned
                    .iter()
                    .flat_map(|t| members.iter().filter_map(|m| t.get(m)));
                events.extend(turned.flatten());
                let mut look = self.look(*state, members, named, home);
                look.events = events.into_iter().collect();
                look
            })
            .collect();
        let drawn: BTreeSet<usize> = boxes.iter().flat_map(|(_, m)| m.iter().copied()).collect();
        let there = before.union(after).filter_map(place_of);
        let undrawn = there.filter(|at| !drawn.contains(at)).count();
        let labels: Vec<Vec<Vec<String>>> =
            talks.iter().map(|(t, _)| t.labels(source, 1)).collect();
        let placed = self.placed(&canvas, &looks, &talks, &labels)?;
        let mut panel = Panel {
            home: home.map_or_else(String::new, |space| format!("in {space}")),
            undrawn,
            ..self.drawn(k, format!("{k} → {}", k + 1), looks, placed)
        };
        (panel.talks, panel.labels) = (talks, labels);
        panel.events.sort_unstable();
        panel.events.dedup();
        Some(panel)
    }

    /// The panel of phase `k` under a number, with these boxes at their positions, and without arrows.
    fn drawn(&self, k: usize, number: String, looks: Vec<PanelBox>, placed: PlacedPanel) -> Panel {
        let source = self.sheet.source;
        let handed = if k > 0 { self.handed(k) } else { Vec::new() };
        let mut events: Vec<EventId> = looks.iter().flat_map(|l| &l.events).copied().collect();
        events.extend(handed.iter().map(|h| h.3));
        let notes: Vec<_> = handed
            .iter()
            .map(|(topic, from, to, _)| {
                let [topic, from, to] = [source.topic(*topic), from, to].map(last_part);
                (ink::CHANGED, format!("{topic}: {from} → {to}"))
            })
            .collect();
        let inside = self.panel_width() - 2.0 * INSIDE;
        let foot = flow(&mut self.sheet.canvas(), inside, 0.0, &items(&notes));
        let start = source.phases[k].span.start.since(source.span().start);
        Panel {
            events,
            heading: (number, format!("{} {}", clock(start), title(source, k))),
            home: String::new(),
            looks,
            talks: Vec::new(),
            labels: Vec::new(),
            height: INSIDE * 1.6 + self.sheet.sizes.pitch() + 0.6 + placed.size.h + 0.8 + foot,
            foot,
            undrawn: 0,
            placed,
            notes,
        }
    }

    /// The changed nodes: separately if they are few, else by groups.
    fn boxes(&self, kinds: &[(BoxState, &BTreeSet<usize>)]) -> Vec<(BoxState, Vec<usize>)> {
        let many: usize = kinds.iter().map(|(_, own)| own.len()).sum();
        let grouped = match self.sheet.options.rows {
            Some(rows) => rows == RowKind::Groups,
            None => many > ONE_BY_ONE,
        };
        let mut all = Vec::new();
        for (state, own) in kinds {
            if !grouped {
                all.extend(own.iter().map(|at| (*state, vec![*at])));
                continue;
            }
            let mut spaces: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
            for at in *own {
                spaces.entry(self.space(*at)).or_default().push(*at);
            }
            all.extend(spaces.into_values().map(|members| (*state, members)));
        }
        all
    }

    /// Adds the groups that are linked to changed nodes; returns, by box, the member that is linked most.
    fn neighbours(
        &self,
        k: usize,
        boxes: &mut Vec<(BoxState, Vec<usize>)>,
        vertex: &mut [Option<usize>],
        names: (&BTreeSet<Arc<str>>, &BTreeSet<Arc<str>>),
    ) -> BTreeMap<usize, usize> {
        let source = self.sheet.source;
        let own: Vec<Option<usize>> = (0..self.tracks.len()).map(Some).collect();
        let mut links: BTreeMap<usize, usize> = BTreeMap::new();
        for (phase, names, state) in [
            (k - 1, names.0, BoxState::Ended),
            (k, names.1, BoxState::Began),
        ] {
            let range = source.phases[phase].span;
            for talk in self.talks.between(&own, range, true) {
                for (a, b) in [(talk.from, talk.to), (talk.to, talk.from)] {
                    let changes = vertex[a].is_some_and(|v| boxes[v].0 == state);
                    let stays = vertex[b].is_none() && names.contains(&self.tracks[b].name);
                    if changes && stays {
                        *links.entry(b).or_default() += 1;
                    }
                }
            }
        }
        let mut linked = BTreeMap::new();
        for group in groups(source, &self.tracks, self.depth) {
            let most = group
                .members
                .iter()
                .filter_map(|at| links.get(at).map(|n| (*n, std::cmp::Reverse(*at))))
                .max();
            let Some((_, std::cmp::Reverse(best))) = most else {
                continue;
            };
            let free: Vec<usize> = group
                .members
                .iter()
                .copied()
                .filter(|at| vertex[*at].is_none())
                .collect();
            for at in &free {
                vertex[*at] = Some(boxes.len());
            }
            linked.insert(boxes.len(), best);
            boxes.push((BoxState::Neighbour, free));
        }
        linked
    }

    /// The arrows at changed nodes: those of the previous phase for nodes that ended, of the next phase for
    /// nodes that began; and those of the topics that were taken over.
    fn talks(
        &self,
        k: usize,
        vertex: &[Option<usize>],
        states: &[BoxState],
        handed: &[(TopicId, Arc<str>, Arc<str>, EventId)],
    ) -> Vec<(Talk, BoxState)> {
        let source = self.sheet.source;
        let mut all = Vec::new();
        for (phase, state) in [(k - 1, BoxState::Ended), (k, BoxState::Began)] {
            let range = source.phases[phase].span;
            for mut talk in self.talks.between(vertex, range, true) {
                let ends = [states[talk.from], states[talk.to]];
                if ends.contains(&state) {
                    all.push((talk, state));
                    continue;
                }
                if !ends.contains(&BoxState::ChangedHands)
                    || ends.contains(&BoxState::Began)
                    || ends.contains(&BoxState::Ended)
                {
                    continue;
                }
                // For a partner, only the topics that it hands over or takes over.
                talk.topics.retain(|(topic, _)| {
                    let moved = handed.iter().find(|(t, ..)| t == topic);
                    moved.is_some_and(|(_, from, to, _)| {
                        let sender = if state == BoxState::Ended { from } else { to };
                        self.track(sender).and_then(|at| vertex[at]) == Some(talk.from)
                    })
                });
                if !talk.topics.is_empty() {
                    all.push((talk, state));
                }
            }
        }
        all
    }

    /// The namespace that most boxes are in, which the panel then names once; `None` if it is the root, or that of one
    /// box.
    fn home(&self, boxes: &[(BoxState, Vec<usize>)]) -> Option<&str> {
        let mut spaces: BTreeMap<&str, usize> = BTreeMap::new();
        for first in boxes.iter().filter_map(|(_, members)| members.first()) {
            *spaces.entry(self.space(*first)).or_default() += 1;
        }
        let often = spaces
            .into_iter()
            .filter(|(space, many)| *space != "/" && *many > 1);
        let most = often.max_by_key(|(space, many)| (*many, std::cmp::Reverse(*space)));
        most.map(|(space, _)| space)
    }

    fn space(&self, at: usize) -> &str {
        cut(namespace(&self.tracks[at].name), self.depth)
    }

    fn look(
        &self,
        state: BoxState,
        members: &[usize],
        named: Option<usize>,
        home: Option<&str>,
    ) -> PanelBox {
        let name = |at: usize| last_part(&self.tracks[at].name).to_owned();
        let lines = match (named, members) {
            (Some(first), members) if members.len() > 1 => {
                vec![format!("{} +{}", name(first), members.len() - 1)]
            }
            (_, members) => {
                let mut lines: Vec<String> =
                    members.iter().take(NAMED).map(|at| name(*at)).collect();
                if members.len() > NAMED {
                    lines.push(format!("+{} more", members.len() - NAMED));
                }
                lines
            }
        };
        let space = members.first().map_or("/", |at| self.space(*at));
        let space = if Some(space) == home { "" } else { space };
        PanelBox {
            state,
            space: space.to_owned(),
            lines,
            events: Vec::new(),
        }
    }

    fn placed(
        &self,
        canvas: &PaperCanvas<'_>,
        looks: &[PanelBox],
        talks: &[(Talk, BoxState)],
        labels: &[Vec<Vec<String>>],
    ) -> Option<PlacedPanel> {
        let vertex = |look: &PanelBox| Vertex {
            size: look.size(canvas),
            outline: Outline::Box,
            cluster: None,
        };
        let plan = Plan {
            vertices: looks.iter().map(vertex).collect(),
            links: talks.iter().map(|(talk, _)| talk.link()).collect(),
            ..Plan::default()
        };
        // Badges extend beyond their boxes.
        let width = self.panel_width() - 2.0 * INSIDE - 1.6;
        place(canvas, &plan, labels, width)
    }

    /// All panels in order of time, from left to right and each directly below another, with notes of repetitions and
    /// omissions.
    fn page(&self, panels: &[Panel], repeated: &[String], left: usize) -> Scene {
        let sheet = self.sheet;
        let mut canvas = sheet.canvas();
        let (columns, wide) = (self.columns, self.panel_width());
        let mut ends = vec![0.1; columns];
        for (at, panel) in panels.iter().enumerate() {
            let column = at % columns;
            canvas.begin_step(at + 1, &panel.events);
            let x = (wide + BETWEEN) * column as f64;
            let place = Rect::new(x + 0.1, ends[column], wide - 0.2, panel.height);
            paint(&mut canvas, panel, place);
            ends[column] += panel.height + 1.2;
        }
        let y = ends.into_iter().fold(0.0, f64::max);
        canvas.begin("notes");
        let again = repeated
            .iter()
            .map(|text| sentence(ink::TEXT, text.as_str()));
        let mut items: Vec<Unbroken> = again.collect();
        if !sheet.options.is_bare {
            let text = "+ solid: began. − dashed: ended. Double: a topic was taken over. Thin: linked nodes.";
            items.push(sentence(ink::QUIET, text));
        }
        let lost: usize = panels.iter().map(|p| p.placed.left_out).sum();
        if lost > 0 {
            let text = format!("{} left out.", words::count(lost, "topic name"));
            items.push(sentence(ink::QUIET, text));
        }
        let undrawn: Vec<String> = panels.iter().map(|p| p.undrawn.to_string()).collect();
        if panels.iter().any(|p| p.undrawn > 0) {
            let text = format!("Nodes not drawn, panel by panel: {}.", undrawn.join(", "));
            items.push(sentence(ink::QUIET, text));
        }
        if left > 0 {
            let text = format!("{} left out.", words::count(left, "smaller step"));
            items.push(sentence(ink::QUIET, text));
        }
        let y = flow(&mut canvas, sheet.options.width_mm, y - 0.5, &items);
        canvas.into_scene(
            Size::new(sheet.options.width_mm, y + 0.3),
            sheet.title("Steps"),
        )
    }
}
