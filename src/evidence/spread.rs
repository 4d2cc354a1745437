//! The variation of the lag between messages: of two streams on one path, that of the one closer to the output varies less.

/// The lags seen so far.
#[derive(Clone, Copy, Default)]
pub(crate) struct Spread {
    count: f64,
    sum: f64,
    squares: f64,
}

/// The number of standard errors by which two variances must differ to count as different: chance does it once in a thousand
/// times.
const CLEAR: f64 = 3.0;

impl Spread {
    /// Adds a lag in seconds.
    pub(crate) fn add(&mut self, lag: f64) {
        self.count += 1.0;
        self.sum += lag;
        self.squares += lag * lag;
    }

    /// Both sets of lags as one.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            sum: self.sum + other.sum,
            squares: self.squares + other.squares,
        }
    }

    /// The mean in seconds; 0 without lags.
    pub(crate) fn mean(&self) -> f64 {
        self.sum / self.count.max(1.0)
    }

    /// The variance in seconds squared.
    fn variance(&self) -> f64 {
        (self.squares / self.count.max(1.0) - self.mean() * self.mean()).max(0.0)
    }

    /// The standard error of the variance of lags that are distributed normally.
    fn error(&self) -> f64 {
        self.variance() * libm::sqrt(2.0 / self.count.max(2.0))
    }

    /// Whether the lag varies clearly less than another.
    pub(crate) fn is_clearly_less(&self, other: &Self) -> bool {
        let errors = libm::sqrt(self.error() * self.error() + other.error() * other.error());
        other.variance() - self.variance() > CLEAR * errors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(lags: &[f64]) -> Spread {
        let mut spread = Spread::default();
        (0..10).for_each(|_| lags.iter().for_each(|lag| spread.add(*lag)));
        spread
    }

    #[test]
    fn a_steady_lag_is_clearly_less_spread_than_a_wild_one() {
        let (steady, wild) = (of(&[0.010, 0.011]), of(&[0.010, 0.050, 0.002]));
        assert!(steady.is_clearly_less(&wild) && !wild.is_clearly_less(&steady));
        assert!(!steady.is_clearly_less(&steady));
        assert!((steady.mean() - 0.0105).abs() < 1e-9);
    }
}
