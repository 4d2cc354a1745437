//! Isotonic regression: the non-decreasing sequence nearest to given goals.

/// Finds non-decreasing sequences by pooling adjacent violators; it keeps its memory from one to the next.
#[derive(Default)]
pub(crate) struct Monotone {
    pools: Vec<Pool>,
}

/// Neighbours at the same position.
struct Pool {
    sum: f64,
    weight: f64,
    mean: f64,
    count: usize,
}

impl Pool {
    fn new(sum: f64, weight: f64, count: usize) -> Self {
        let mean = sum / weight;
        Self {
            sum,
            weight,
            mean,
            count,
        }
    }
}

impl Monotone {
    /// Sets new goals, each with its weight.
    pub(crate) fn pool(&mut self, goals: impl Iterator<Item = (f64, f64)>) -> &Self {
        self.pools.clear();
        for (goal, weight) in goals {
            let mut pool = Pool::new(goal * weight, weight, 1);
            while let Some(last) = self.pools.pop_if(|last| last.mean > pool.mean) {
                pool = Pool::new(
                    pool.sum + last.sum,
                    pool.weight + last.weight,
                    pool.count + last.count,
                );
            }
            self.pools.push(pool);
        }
        self
    }

    /// The non-decreasing sequence nearest to the goals in weighted squares.
    pub(crate) fn nearest(&self) -> impl Iterator<Item = f64> {
        self.pools
            .iter()
            .flat_map(|pool| std::iter::repeat_n(pool.mean, pool.count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nearest(goals: &[(f64, f64)]) -> Vec<f64> {
        Monotone::default()
            .pool(goals.iter().copied())
            .nearest()
            .collect()
    }

    #[test]
    fn an_increasing_sequence_is_unchanged() {
        assert_eq!(
            nearest(&[(1.0, 1.0), (2.0, 1.0), (4.0, 1.0)]),
            [1.0, 2.0, 4.0]
        );
    }

    #[test]
    fn violating_blocks_are_merged_at_their_weighted_mean() {
        assert_eq!(nearest(&[(4.0, 1.0), (1.0, 2.0)]), [2.0, 2.0]);
    }
}
