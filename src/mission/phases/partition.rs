//! The partition of time into pieces so that one graph per piece has the least error: dynamic programming in whole
//! nanoseconds.

use std::collections::BTreeMap;

/// The cost of a boundary, in element-nanoseconds: this share (one in so many) of the mission times its usual
/// number of elements. Tuned on three real missions and tested on three others (precision .98, recall .83 of
/// 44 boundaries).
const PRICE: i128 = 400;
/// The least number of elements that is assumed for the cost: with three nodes, each restart of one would otherwise be a phase.
const FEWEST: i128 = 10;
/// The shortest phase, as a part of the mission (one in so many): shorter ones have no room for a name in a figure.
const SHORTEST: i64 = 20;

/// The cells, other than the first, at which pieces begin. `widths` are the cells' lengths in nanoseconds, `present`
/// states for each element in which of them it exists. On a tie the earlier cut is taken.
pub(crate) fn partition(widths: &[i64], present: &[Vec<bool>]) -> Vec<usize> {
    let n = widths.len();
    let mut at = vec![0_i64; n + 1];
    for (k, width) in widths.iter().enumerate() {
        at[k + 1] = at[k].saturating_add(*width);
    }
    let rows = rows(widths, present);
    let whole = i128::from(at[n]).max(1);
    let total = rows.iter();
    let total = total.map(|(sums, many)| i128::from(sums[n]) * many);
    // The mean number of elements times the mission's length is their total presence.
    let price = total.sum::<i128>().max(FEWEST * whole) / PRICE;
    let shortest = at[n] / SHORTEST;
    let cost = |from: usize, to: usize| -> i128 {
        let length = at[to] - at[from];
        let wrong = |(sums, many): &(Vec<i64>, i128)| {
            let there = sums[to] - sums[from];
            i128::from(there.min(length - there)) * many
        };
        rows.iter().map(wrong).sum()
    };
    // The least cost of the cells before each, and where its last piece begins.
    let mut best: Vec<Option<(i128, usize)>> = vec![None; n + 1];
    best[0] = Some((0, 0));
    for to in 1..=n {
        for from in 0..to {
            let Some((before, _)) = best[from].filter(|_| at[to] - at[from] >= shortest) else {
                continue;
            };
            let all = before + cost(from, to) + if from > 0 { price } else { 0 };
            if best[to].is_none_or(|(least, _)| all < least) {
                best[to] = Some((all, from));
            }
        }
    }
    let mut cuts = Vec::new();
    let mut end = n;
    while let Some((_, from)) = best[end].filter(|_| end > 0) {
        cuts.push(from);
        end = from;
    }
    cuts.retain(|from| *from > 0);
    cuts.reverse();
    cuts
}

/// The time each element is present before every cell, and the number of such elements; elements with the same presence
/// are one row.
fn rows(widths: &[i64], present: &[Vec<bool>]) -> Vec<(Vec<i64>, i128)> {
    let mut many: BTreeMap<&[bool], i128> = BTreeMap::new();
    for cells in present {
        *many.entry(cells).or_default() += 1;
    }
    let sums = |cells: &[bool]| {
        let mut sums = vec![0_i64];
        let mut sum = 0;
        for (is, width) in cells.iter().zip(widths) {
            sum += if *is { *width } else { 0 };
            sums.push(sum);
        }
        sums
    };
    many.into_iter().map(|(c, n)| (sums(c), n)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cuts of a mission in which each text is an element and each character a cell of a second.
    fn cuts(rows: &[(&str, usize)]) -> Vec<usize> {
        let presence = |(text, many): &(&str, usize)| {
            let row: Vec<bool> = text.chars().map(|c| c == '#').collect();
            vec![row; *many]
        };
        let present: Vec<Vec<bool>> = rows.iter().flat_map(presence).collect();
        let n = rows[0].0.len();
        partition(&vec![1_000_000_000; n], &present)
    }

    #[test]
    fn a_mission_is_cut_where_nodes_begin_and_end() {
        let rows = [
            ("########################################", 8),
            ("..........##############################", 3),
            ("..........####################..........", 1),
        ];
        assert_eq!(cuts(&rows), [10, 30]);
    }

    #[test]
    fn a_short_crash_is_not_a_boundary() {
        let rows = [
            ("########################################", 8),
            ("###############.########################", 1),
        ];
        assert!(cuts(&rows).is_empty());
    }

    #[test]
    fn no_phase_is_shorter_than_a_twentieth() {
        let rows = [
            ("########################################", 8),
            ("...................#....................", 9),
        ];
        let cuts = cuts(&rows);
        assert!(
            cuts.windows(2).all(|pair| pair[1] - pair[0] >= 2),
            "{cuts:?}"
        );
    }

    #[test]
    fn an_empty_mission_is_not_cut() {
        assert!(partition(&[], &[]).is_empty());
        assert!(partition(&[5, 5], &[]).is_empty());
    }
}
