//! Steps that are not drawn: smaller ones, and those that repeat an earlier one elsewhere.

use super::StepSource;
use crate::draw::figure::panel::Panel;

impl StepSource<'_> {
    /// The number of steps with changes that are not among these.
    pub(super) fn left_out(&self, chosen: &[usize]) -> usize {
        let all = 1..self.sheet.source.phases.len();
        let changes = all.filter(|k| !chosen.contains(k) && self.weight(*k) > 0);
        changes.count()
    }

    /// Leaves out the panels that repeat an earlier one elsewhere, unless they were requested; returns a
    /// sentence for each: `5 → 6 as 1 → 2, in /robot2.`
    pub(super) fn fold_repeated(&self, panels: &mut Vec<Panel>) -> Vec<String> {
        let mut seen: Vec<(Vec<(bool, String)>, String)> = Vec::new();
        let mut repeated = Vec::new();
        panels.retain(|panel| {
            let changes = panel.changes();
            let number = &panel.heading.0;
            let earlier = seen.iter().find(|(other, _)| *other == changes);
            if let Some((_, first)) = earlier.filter(|_| self.sheet.options.steps.is_empty()) {
                let notes = panel.notes.iter().map(|(_, text)| format!("; {text}"));
                let notes: String = notes.collect();
                let home = if panel.home.is_empty() {
                    "elsewhere"
                } else {
                    &panel.home
                };
                repeated.push(format!("{number} as {first}, {home}{notes}."));
                return false;
            }
            seen.push((changes, number.clone()));
            true
        });
        let letters = 'a'..='z';
        for (panel, letter) in panels.iter_mut().zip(letters) {
            panel.heading.0 = format!("({letter}) {}", panel.heading.0);
        }
        repeated
    }
}
