//! The transition from one window to the next in stages, by opacity alone: ending elements, changed ones, new
//! ones.

use std::collections::BTreeMap;

use crate::draw::scene::{Fade, Group, Scene};

/// The part of the transition that each stage takes, from 0 to 1: ending elements, changed ones, new ones.
const GOING: (f64, f64) = (0.0, 0.4);
const CHANGING: (f64, f64) = (0.3, 0.7);
const COMING: (f64, f64) = (0.6, 1.0);

/// The scene at `phase` (above 0 and below 1) of the transition from `before` to `after`.
pub(crate) fn tween(before: &Scene, after: Scene, phase: f64) -> Scene {
    let mut old: BTreeMap<&str, &Group> =
        before.groups.iter().map(|g| (g.id.as_str(), g)).collect();
    let mut groups = Vec::with_capacity(after.groups.len());
    for group in &after.groups {
        match old.remove(group.id.as_str()) {
            Some(before) if before == group => groups.push(group.clone()),
            Some(_) if is_decoration(group) => groups.push(group.clone()),
            Some(before) => cross_fade(&mut groups, before, group, part(CHANGING, phase)),
            None => push(&mut groups, group, part(COMING, phase)),
        }
    }
    // Ending elements are below all remaining ones, except the boxes of namespaces and the bars of the page.
    let ground = groups
        .iter()
        .take_while(|g| !g.class.starts_with("edge"))
        .count();
    let mut gone = Vec::new();
    for group in before
        .groups
        .iter()
        .filter(|g| old.contains_key(g.id.as_str()))
    {
        push(&mut gone, group, 1.0 - ease_in(part(GOING, phase)));
    }
    groups.splice(ground..ground, gone);
    Scene { groups, ..after }
}

/// Adds the old and the new look of a group: the new one appears over the old one, and then the old one
/// vanishes, so that nothing is visible through both.
fn cross_fade(groups: &mut Vec<Group>, before: &Group, after: &Group, part: f64) {
    let mut old = before.clone();
    old.id.push_str("..before");
    push(groups, &old, 2.0 - 2.0 * part);
    push(groups, after, 2.0 * part);
}

fn push(groups: &mut Vec<Group>, group: &Group, opacity: f64) {
    if opacity > 0.005 {
        let fade = Fade(group.fade.0 * opacity.min(1.0));
        groups.push(Group {
            fade,
            ..group.clone()
        });
    }
}

/// Whether it is a title, a badge, a caption or the playhead, which immediately show the new window.
fn is_decoration(group: &Group) -> bool {
    group.data.is_empty()
}

/// The completed fraction of a stage, 0..=1.
fn part(stage: (f64, f64), phase: f64) -> f64 {
    ((phase - stage.0) / (stage.1 - stage.0)).clamp(0.0, 1.0)
}

fn ease_in(part: f64) -> f64 {
    part * part
}
