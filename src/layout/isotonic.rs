//! Growing sequences: the one nearest to goals that are out of order.

/// The growing sequence nearest to the goals in weighted squares, by pooling adjacent violators.
pub(crate) fn monotone(goal: &[f64], weight: &[f64]) -> Vec<f64> {
    let mut pools: Vec<(f64, f64, usize)> = Vec::with_capacity(goal.len());
    for (&g, &w) in goal.iter().zip(weight) {
        let mut pool = (g * w, w, 1);
        while let Some(&(sum, weight, count)) = pools.last() {
            if sum / weight <= pool.0 / pool.1 {
                break;
            }
            pools.pop();
            pool = (pool.0 + sum, pool.1 + weight, pool.2 + count);
        }
        pools.push(pool);
    }
    pools
        .into_iter()
        .flat_map(|(sum, weight, count)| std::iter::repeat_n(sum / weight, count))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sequence_that_grows_stays() {
        assert_eq!(monotone(&[1.0, 2.0, 4.0], &[1.0; 3]), [1.0, 2.0, 4.0]);
    }

    #[test]
    fn violators_meet_at_their_weighted_mean() {
        assert_eq!(monotone(&[4.0, 1.0], &[1.0, 2.0]), [2.0, 2.0]);
    }
}
