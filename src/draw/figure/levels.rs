//! A jittering rate as a few steps: the piecewise constant course with the least error, where every step has a price.

/// Levels per octave; finer than the eye tells bars apart.
const PER_OCTAVE: f64 = 4.0;
/// The most levels (16 octaves).
const MOST: usize = 64;

/// For every value the level it is on, in the values' unit. `values` are positive; `price` is the cost of a step, in
/// octave-cells; a step holds for at least `least` cells.
pub(crate) fn levels(values: &[f64], price: f64, least: usize) -> Vec<f64> {
    let octaves: Vec<f64> = values.iter().map(|v| libm::log2(v.max(1e-9))).collect();
    let highest = octaves.iter().copied().fold(f64::MIN, f64::max);
    let lowest = octaves.iter().copied().fold(f64::MAX, f64::min);
    let mut all = Vec::new();
    let mut level = highest;
    while all.len() < MOST && (all.is_empty() || level >= lowest - 1.0 / PER_OCTAVE) {
        all.push(level);
        level -= 1.0 / PER_OCTAVE;
    }
    let course = cheapest(&octaves, &all, price);
    steady(course, least)
        .into_iter()
        .zip(values)
        .map(|(level, value)| all.get(level).map_or(*value, |o| libm::exp2(*o)))
        .collect()
}

/// The level of every cell on the cheapest course: distance to the level, and `price` for each step (Viterbi).
fn cheapest(octaves: &[f64], all: &[f64], price: f64) -> Vec<usize> {
    let mut costs = vec![0.0_f64; all.len()];
    // From where each level of each cell was reached, cell by cell.
    let mut back: Vec<usize> = Vec::with_capacity(octaves.len() * all.len());
    for octave in octaves {
        let best = (0..all.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b]));
        let best = best.unwrap_or(0);
        let jump = costs[best] + if back.is_empty() { 0.0 } else { price };
        for (k, cost) in costs.iter_mut().enumerate() {
            back.push(if *cost <= jump { k } else { best });
            *cost = cost.min(jump) + (octave - all[k]).abs();
        }
    }
    let last = (0..all.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b]));
    let mut level = last.unwrap_or(0);
    let mut course = vec![0; octaves.len()];
    for at in (0..octaves.len()).rev() {
        course[at] = level;
        level = back[at * all.len() + level];
    }
    course
}

/// The course with runs shorter than `least` given to the run before, the first one to the run after.
fn steady(mut course: Vec<usize>, least: usize) -> Vec<usize> {
    let mut start = 0;
    while start < course.len() {
        let level = course[start];
        let end = start + course[start..].iter().take_while(|l| **l == level).count();
        if end - start < least && start > 0 {
            let before = course[start - 1];
            course[start..end].fill(before);
        } else if end - start < least && end < course.len() {
            let after = course[end];
            course[start..end].fill(after);
            continue;
        }
        start = end;
    }
    course
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rounded(values: &[f64]) -> Vec<i64> {
        let levels = levels(values, 3.0, 2);
        #[expect(clippy::cast_possible_truncation, reason = "small rates of tests")]
        levels.iter().map(|v| v.round() as i64).collect()
    }

    #[test]
    fn jitter_is_flat_and_a_drop_is_a_step() {
        assert_eq!(
            rounded(&[30.0, 29.0, 30.0, 31.0, 30.0]).iter().min(),
            rounded(&[30.0, 29.0, 30.0, 31.0, 30.0]).iter().max()
        );
        let drop = rounded(&[32.0, 32.0, 32.0, 32.0, 4.0, 4.0, 4.0, 4.0]);
        assert_eq!(drop, [32, 32, 32, 32, 4, 4, 4, 4]);
    }

    #[test]
    fn a_single_odd_cell_is_no_step() {
        assert_eq!(rounded(&[8.0, 8.0, 8.0, 1.0, 8.0, 8.0]), [8; 6]);
        assert!(levels(&[], 1.0, 1).is_empty());
    }
}
