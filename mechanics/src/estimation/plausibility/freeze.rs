//! Detection of frozen signals, which repeat bit for bit.

use super::notice::{Limits, Notice};
use crate::machine::FaultKind;

/// Weight of a sample in the running fraction of turning points.
const NOISE_WEIGHT: f64 = 1.0 / 64.0;
/// Two of three samples of white noise are turning points, but only few of a smooth signal.
const NOISY_SHARE: f64 = 0.4;

/// Detects a frozen part with at most four values.
///
/// A sensor at rest may repeat itself legitimately: one simulated without noise, or one of coarse resolution.
/// Repetition therefore counts only if the signal was noisy before (judged by the fraction of turning points,
/// which is independent of the noise amplitude) or while another signal detects motion.
#[derive(Debug, Clone)]
pub(super) struct Freeze {
    last: [f64; 4],
    step: [f64; 4],
    samples: u64,
    run: u32,
    run_since_ns: i64,
    /// Number of repeated samples during which motion was detected elsewhere.
    moving: u32,
    turning_share: f64,
    /// Running mean and sum of squared deviations, for the spread of the signal.
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

    /// The notice to report if the signal is frozen. `values` are finite.
    pub(super) fn notice(
        &mut self,
        stamp_ns: i64,
        values: &[f64],
        moves_elsewhere: bool,
        limits: &Limits,
    ) -> Option<Notice> {
        let since_ns = self.since(stamp_ns, values, moves_elsewhere, limits.frozen_samples)?;
        Some(
            Notice::of(FaultKind::Frozen, since_ns)
                .measured(limits.elapsed_s(since_ns, stamp_ns), f64::NAN)
                .amount(self.spread(), 0.0),
        )
    }

    /// Time since which the signal has been frozen, if it is. `values` are finite.
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

    /// Largest standard deviation of any channel so far.
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
    fn vanishing_noise_is_frozen_after_the_sample_limit() {
        assert_eq!(frozen(noise, false), Some(499));
    }

    #[test]
    fn smooth_signal_may_rest_unless_motion_is_detected() {
        let smooth = |k: usize| (k as f64 * 0.01).sin();
        assert_eq!(frozen(smooth, false), None);
        assert_eq!(frozen(smooth, true), Some(499));
    }
}
