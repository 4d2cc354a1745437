//! Scenes one after the other as one animated SVG: each group once for each of its looks, visible while it
//! has that look.
//!
//! It runs inside `<img>`, and looks like every other animation, but for a dot per message that runs along its line.
//! Users who prefer reduced motion, and viewers without animations, get one of the scenes.

use std::collections::BTreeMap;

use super::svg;
use super::xml::{Xml, hundredth, tenth};
use crate::draw::scene::{Form, Group, Piece, Scene};
use crate::draw::style::Color;
use crate::draw::text::Fonts;

/// Scenes as an animation.
#[derive(Default)]
pub(crate) struct AnimatedScenes {
    slots: Vec<Slot>,
    /// The slots in the order in which they are painted.
    order: Vec<usize>,
    /// The slots of each group, by its id: several if it is painted both before and after another group.
    of: BTreeMap<String, Vec<usize>>,
    first: Scene,
    /// The time for which each scene is shown, in milliseconds.
    times: Vec<u32>,
}

/// The looks of a group at one position in the painting order, each with its scenes.
type Slot = Vec<(Group, Vec<usize>)>;

impl AnimatedScenes {
    /// The scenes with the times for which they are shown, in milliseconds. All have the same size; tooltips,
    /// which show numbers that differ from scene to scene, are left out.
    pub(crate) fn new(scenes: impl Iterator<Item = (Scene, u32)>) -> Self {
        let mut all = Self::default();
        for (mut scene, ms) in scenes {
            let groups = std::mem::take(&mut scene.groups);
            if all.times.is_empty() {
                all.first = scene;
            }
            all.add(groups);
            all.times.push(ms);
        }
        all
    }

    /// Adds the groups of the next scene, each to a slot behind that of the previous group.
    fn add(&mut self, groups: Vec<Group>) {
        let at = self.times.len();
        let mut place: Vec<usize> = vec![0; self.slots.len()];
        for (k, slot) in self.order.iter().enumerate() {
            place[*slot] = k;
        }
        let mut next = 0;
        for mut group in groups {
            group.title.clear();
            let own = self.of.get(&group.id).map_or(&[][..], Vec::as_slice);
            let behind = own.iter().copied().filter(|slot| place[*slot] >= next);
            let slot = if let Some(slot) = behind.min_by_key(|slot| place[*slot]) {
                slot
            } else {
                let slot = self.slots.len();
                self.slots.push(Slot::new());
                self.of.entry(group.id.clone()).or_default().push(slot);
                self.order.insert(next, slot);
                for at in place.iter_mut().filter(|at| **at >= next) {
                    *at += 1;
                }
                place.push(next);
                slot
            };
            next = place[slot] + 1;
            let looks = &mut self.slots[slot];
            match looks.iter_mut().rev().find(|(look, _)| *look == group) {
                Some((_, scenes)) => scenes.push(at),
                None => looks.push((group, vec![at])),
            }
        }
    }

    /// The animation as SVG text; `still` is the scene for users with reduced motion.
    pub(crate) fn write(&self, title: &str, still: usize) -> String {
        let mut xml = Xml::default();
        let fonts = Fonts::bundled();
        svg::open(&mut xml, &self.first);
        if !title.is_empty() {
            xml.leaf("title", title).raw("\n");
        }
        xml.open("style").raw(
            ".dots{stroke-linecap:round;animation:run linear infinite}@keyframes run{to{stroke-dashoffset:var(--to)}}\
             @media(prefers-reduced-motion:reduce){.dots{display:none}\
             .on{visibility:visible!important}.off{visibility:hidden!important}}",
        );
        xml.close().raw("\n");
        svg::ground(&mut xml, &self.first);
        for slot in self.order.iter().map(|slot| &self.slots[*slot]) {
            for (k, (group, scenes)) in slot.iter().enumerate() {
                self.look(&mut xml, (k, group), (scenes, still), &fonts);
            }
        }
        xml.close().raw("\n");
        xml.finish()
    }

    /// Writes a look of a group, with the times at which it is visible, unless always.
    fn look(
        &self,
        xml: &mut Xml,
        (k, group): (usize, &Group),
        (scenes, still): (&[usize], usize),
        fonts: &Fonts,
    ) {
        if scenes.len() == self.times.len() {
            svg::write_group(xml, group, Some(fonts));
            dots(xml, group);
            xml.raw("\n");
            return;
        }
        let word = |is| if is { "visible" } else { "hidden" };
        let is_seen = |at: usize| scenes.binary_search(&at).is_ok();
        let is_still = is_seen(still);
        xml.open("g")
            .attribute("class", if is_still { "on" } else { "off" })
            .attribute("visibility", word(is_still));
        let turns = (0..self.times.len()).filter(|at| *at == 0 || is_seen(*at) != is_seen(at - 1));
        let turns: Vec<usize> = turns.collect();
        let values: Vec<&str> = turns.iter().map(|at| word(is_seen(*at))).collect();
        let times: Vec<String> = turns.iter().map(|at| self.part(*at)).collect();
        xml.open("animate")
            .attribute("attributeName", "visibility")
            .attribute("calcMode", "discrete")
            .attribute("dur", format_args!("{}s", self.whole() / 1e3))
            .attribute("repeatCount", "indefinite")
            .attribute("keyTimes", times.join(";"))
            .attribute("values", values.join(";"))
            .close_empty();
        let mut group = group.clone();
        if k > 0 {
            group.id = format!("{}..{k}", group.id);
        }
        svg::write_group(xml, &group, Some(fonts));
        dots(xml, &group);
        xml.close().raw("\n");
    }

    /// The length of one cycle in milliseconds.
    fn whole(&self) -> f64 {
        self.sum(self.times.len())
    }

    /// The time of the first scenes, in milliseconds.
    fn sum(&self, scenes: usize) -> f64 {
        let all = self.times[..scenes].iter();
        all.map(|ms| u64::from(*ms)).sum::<u64>() as f64
    }

    /// The fraction of the cycle at which a scene begins.
    fn part(&self, at: usize) -> String {
        let text = format!("{:.6}", self.sum(at) / self.whole().max(1.0));
        let text = text.trim_end_matches('0').trim_end_matches('.');
        text.to_owned()
    }
}

/// The speed of dots, in pixels a second: that of a walk across a picture of a README in 20 s.
const SPEED: f64 = 36.0;

/// Writes a dot per message on the line of a group, at the pace of its messages.
fn dots(xml: &mut Xml, group: &Group) {
    let line = group.pieces.iter().find_map(|piece| match piece {
        Piece::Shape(shape) if shape.fill == Color::NONE => match &shape.form {
            Form::Path(steps) => Some((steps, &shape.stroke)),
            _ => None,
        },
        _ => None,
    });
    let Some((steps, stroke)) = line else { return };
    let flows = group.flow.iter().zip([-1.0, 1.0]);
    for (flow, back) in flows.filter(|(flow, _)| **flow > 0) {
        let apart = SPEED * 100.0 / f64::from(*flow);
        let (to, gap, seconds) = (tenth(back * apart), tenth(apart), hundredth(apart / SPEED));
        let pace = format!("--to:{to}px;stroke-dasharray:.01 {gap};animation-duration:{seconds}s");
        xml.open("path")
            .attribute("class", "dots")
            .attribute("d", svg::PathSteps(steps))
            .attribute("fill", "none")
            .attribute("stroke", stroke.color)
            .attribute("stroke-width", hundredth(stroke.width + 2.8))
            .attribute("style", pace)
            .close_empty();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene of groups by their ids and classes.
    fn scene(groups: &[(&str, &str)]) -> (Scene, u32) {
        let group = |(id, class): &(&str, &str)| Group {
            class: (*class).to_owned(),
            ..Group::named(id)
        };
        let scene = Scene {
            groups: groups.iter().map(group).collect(),
            ..Scene::default()
        };
        (scene, 500)
    }

    #[test]
    fn looks_are_written_once_with_their_times() {
        let scenes = [
            scene(&[("a", "x"), ("b", "x")]),
            scene(&[("a", "x"), ("b", "y"), ("c", "x")]),
            scene(&[("a", "x"), ("b", "x")]),
            scene(&[("a", "x"), ("b", "x")]),
        ];
        let svg = AnimatedScenes::new(scenes.into_iter()).write("film", 1);
        assert_eq!(svg.matches("id=\"a\"").count(), 1);
        assert!(svg.contains("dur=\"2s\""));
        let b = svg.split("<g class=\"off\"").nth(1).unwrap();
        assert!(b.contains("keyTimes=\"0;0.25;0.5\" values=\"visible;hidden;visible\""));
        let still: Vec<&str> = svg.split("<g class=\"on\"").skip(1).collect();
        assert!(
            still.len() == 2 && still[0].contains("id=\"b..1\"") && still[1].contains("id=\"c\"")
        );
    }

    #[test]
    fn dots_run_both_ways_at_the_pace_of_the_messages() {
        use crate::base::geometry::Point;
        use crate::draw::scene::{Shape, Step, Stroke};

        let (mut scene, ms) = scene(&[("a", "edge")]);
        let steps = [0.0, 90.0].map(|x| Step::Line(Point::new(x, 0.0)));
        let line = Shape::line(
            Form::Path(steps.into()),
            Stroke::solid(Color::of([0, 0, 0]), 1.0),
        );
        scene.groups[0].shape(line);
        scene.groups[0].flow = [200, 450];
        let film = AnimatedScenes::new([(scene, ms)].into_iter());
        let svg = film.write("film", 0);
        assert_eq!(svg.matches("class=\"dots\"").count(), 2);
        assert!(svg.contains("--to:-18px;stroke-dasharray:.01 18;animation-duration:0.5s"));
        assert!(svg.contains("--to:8px;stroke-dasharray:.01 8;animation-duration:0.22s"));
    }

    #[test]
    fn every_scene_has_its_own_painting_order() {
        let scenes = [
            scene(&[("a", "x"), ("b", "x"), ("c", "x")]),
            scene(&[("b", "x"), ("a", "x"), ("c", "x")]),
        ];
        let film = AnimatedScenes::new(scenes.into_iter());
        let order: Vec<&str> = film
            .order
            .iter()
            .map(|slot| film.slots[*slot][0].0.id.as_str())
            .collect();
        assert_eq!(order, ["a", "b", "a", "c"]);
    }
}
