//! A signal that repeats itself bit for bit.

use super::fault::{Amount, Component};
use super::notice::{Limits, Notice};
use crate::machine::FaultKind;

/// Weight of a sample in the running share of turning points.
const NOISE_WEIGHT: f64 = 1.0 / 64.0;
/// Of white noise two samples in three are turning points, of a smooth signal few are.
const NOISY_SHARE: f64 = 0.4;

/// Watches the values of one part, at most four.
///
/// A sensor at rest may repeat itself truly: a simulated one without noise, one of coarse
/// resolution. So repetition counts only where the signal was noisy before (the share of turning
/// points, which needs to know nothing of the noise's size) or while something else sees motion.
#[derive(Debug, Clone)]
pub(super) struct Freeze {
    last: [f64; 4],
    step: [f64; 4],
    samples: u64,
    run: u32,
    run_since_ns: i64,
    /// Samples of the run during which motion was seen elsewhere.
    moving: u32,
    turning_share: f64,
    /// Running mean and sum of squared deviations: the spread of the signal.
    mean: [f64; 4],
    squares: [f64; 4],
}

impl Freeze {
    pub(super) fn new() -> Self {
        Self {
            last: [f64::NAN; 4],
            step: [0.0; 4],
            samples: 0,
            run: 0,
            run_since_ns: 0,
            moving: 0,
            turning_share: 0.0,
            mean: [0.0; 4],
            squares: [0.0; 4],
        }
    }

    /// What is to be said if the signal is frozen. `values` are finite.
    pub(super) fn notice(
        &mut self,
        stamp_ns: i64,
        values: &[f64],
        moves_elsewhere: bool,
        limits: &Limits,
    ) -> Option<Notice> {
        let since_ns = self.since(stamp_ns, values, moves_elsewhere, limits.frozen_samples)?;
        Some(Notice {
            kind: FaultKind::Frozen,
            component: Component::Value,
            since_ns,
            measure: limits.elapsed_s(since_ns, stamp_ns),
            limit: f64::NAN,
            amount: Amount {
                value: self.spread(),
                rate: 0.0,
            },
        })
    }

    /// Since when the signal has been frozen, if it is. `values` are finite.
    fn since(
        &mut self,
        stamp_ns: i64,
        values: &[f64],
        moves_elsewhere: bool,
        limit: u32,
    ) -> Option<i64> {
        let is_same = values
            .iter()
            .zip(&self.last)
            .all(|(a, b)| a.to_bits() == b.to_bits());
        if is_same {
            self.run = self.run.saturating_add(1);
            self.moving += u32::from(moves_elsewhere);
        } else {
            self.see(values);
            (self.run, self.run_since_ns, self.moving) = (1, stamp_ns, 0);
        }
        let was_noisy = self.turning_share >= NOISY_SHARE && self.samples >= u64::from(limit);
        let moves = self.moving >= self.run / 2;
        (self.run >= limit && (was_noisy || moves)).then_some(self.run_since_ns)
    }

    /// Largest standard deviation that a channel has had.
    fn spread(&self) -> f64 {
        let count = self.samples.max(1) as f64;
        self.squares.iter().copied().fold(0.0, f64::max).sqrt() / count.sqrt()
    }

    fn see(&mut self, values: &[f64]) {
        self.samples += 1;
        let count = self.samples as f64;
        let mut turns = 0.0;
        for (i, &value) in values.iter().enumerate() {
            let step = value - self.last[i];
            turns += f64::from(u8::from(step * self.step[i] < 0.0));
            self.step[i] = step;
            self.last[i] = value;
            let apart = value - self.mean[i];
            self.mean[i] += apart / count;
            self.squares[i] += apart * (value - self.mean[i]);
        }
        let share = turns / values.len() as f64;
        self.turning_share += NOISE_WEIGHT * (share - self.turning_share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frozen(before: impl Fn(usize) -> f64, moves: bool) -> Option<usize> {
        let mut freeze = Freeze::new();
        (0..800_usize).find(|&k| {
            let value = before(k.min(400));
            freeze
                .since(
                    k as i64,
                    &[value, -value, 0.5 * value],
                    moves && k > 400,
                    100,
                )
                .is_some()
        })
    }

    fn noise(k: usize) -> f64 {
        ((k as f64 * 12.9898).sin() * 43_758.545_3).fract()
    }

    #[test]
    fn noise_that_stops_is_frozen_after_so_many_samples() {
        assert_eq!(frozen(noise, false), Some(499));
    }

    #[test]
    fn a_smooth_signal_may_come_to_rest_unless_something_moves() {
        let smooth = |k: usize| (k as f64 * 0.01).sin();
        assert_eq!(frozen(smooth, false), None);
        assert_eq!(frozen(smooth, true), Some(499));
    }
}
