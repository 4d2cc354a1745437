//! Drawing times: the time of each step, summed over all cores.

use crate::base::words::worded;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

worded! {
    /// A step from a window to written bytes.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) enum RunStep {
        /// The drawing of a window is composed.
        Compose = "composing",
        /// It is rasterized.
        Paint = "painting",
        /// Pixels are mapped to palette indices.
        Colours = "colours",
        /// They are compressed.
        Compress = "compressing",
        /// Bytes are written.
        Write = "writing",
    }
}

/// The nanoseconds that each step took.
#[derive(Debug, Default)]
pub struct Steps([AtomicU64; RunStep::ALL.len()]);

impl Steps {
    /// Runs the work and adds its time.
    pub(crate) fn time<T>(&self, step: RunStep, work: impl FnOnce() -> T) -> T {
        let begun = Instant::now();
        let done = work();
        let spent = u64::try_from(begun.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.0[step as usize].fetch_add(spent, Ordering::Relaxed);
        done
    }

    /// The name of each step and its share of the total, 0..=1, largest first; empty if no time was spent.
    pub fn shares(&self) -> Vec<(&'static str, f64)> {
        let spent = |step: &RunStep| self.0[*step as usize].load(Ordering::Relaxed);
        let all: u64 = RunStep::ALL.iter().map(spent).sum();
        let share = |step: &RunStep| (step.word(), spent(step) as f64 / all as f64);
        let mut shares: Vec<_> = RunStep::ALL.iter().map(share).collect();
        shares.retain(|(_, share)| *share > 0.0);
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        shares
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread::sleep;
    use std::time::Duration;

    #[test]
    fn shares_are_sorted_and_add_up_to_one() {
        let steps = Steps::default();
        assert!(steps.shares().is_empty());
        steps.time(RunStep::Paint, || sleep(Duration::from_millis(1)));
        steps.time(RunStep::Write, || sleep(Duration::from_millis(30)));
        let shares = steps.shares();
        assert_eq!(shares[0].0, "writing");
        let sum: f64 = shares.iter().map(|s| s.1).sum();
        assert!(shares.len() == 2 && (sum - 1.0).abs() < 1e-9);
    }
}
