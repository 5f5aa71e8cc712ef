//! Change that unobserved motion may have made to the loads of a row, all supports together.

/// The changes of the loads.
#[derive(Debug)]
pub(crate) struct MotionLoads {
    /// Changes by wheel (N), for one standard deviation of each signal that was not observed; these are independent. `None` if
    /// their ranges are unknown.
    by_signal: Option<Vec<Vec<f64>>>,
}

impl MotionLoads {
    pub(super) fn of(by_signal: Vec<Vec<f64>>) -> Self {
        Self {
            by_signal: Some(by_signal),
        }
    }

    /// Returns changes of unknown range, which explain every load.
    pub(super) fn unbounded() -> Self {
        Self { by_signal: None }
    }

    /// Standard deviation of a weighted sum of the loads (N). What a signal moves from one wheel to another is not in
    /// their sum.
    pub(crate) fn sigma(&self, factors: &[f64]) -> f64 {
        let Some(by_signal) = &self.by_signal else {
            return f64::INFINITY;
        };
        let along = |loads: &Vec<f64>| -> f64 {
            let pairs = loads.iter().zip(factors);
            pairs.map(|(load, factor)| load * factor).sum()
        };
        let variance: f64 = by_signal.iter().map(|loads| along(loads).powi(2)).sum();
        variance.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_signal_moves_between_wheels_is_not_in_their_sum() {
        let motion = MotionLoads::of(vec![vec![30.0, -30.0], vec![4.0, 4.0]]);
        assert_eq!(motion.sigma(&[1.0, 1.0]), 8.0);
        assert_eq!(motion.sigma(&[1.0, -1.0]), 60.0);
        assert_eq!(motion.sigma(&[1.0, 0.0]), 30.0_f64.hypot(4.0));
        assert_eq!(MotionLoads::unbounded().sigma(&[1.0, 0.0]), f64::INFINITY);
    }
}
