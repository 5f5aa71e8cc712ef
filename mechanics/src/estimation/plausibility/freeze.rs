//! Detection of frozen signals, which repeat bit for bit.

use super::notice::{Limits, Notice};
use crate::machine::FaultKind;

/// Weight of a sample in the running fraction of turning points.
const NOISE_WEIGHT: f64 = 1.0 / 64.0;
/// Two of three samples of white noise are turning points, but only few of a smooth signal.
const NOISY_SHARE: f64 = 0.4;
/// Weight of a change in the mean change, and of a sample in the share of repeats.
const STEP_WEIGHT: f64 = 1.0 / 32.0;
/// The sensor resolves its noise where the mean change is so many times the least one. Of three values that go to and fro between
/// neighbouring steps, the mean change is up to 1.4 least ones; of noise as wide as a step it is 2.4.
const RESOLVED: f64 = 1.75;
/// Changes from which on that is known for good, and the share of repeats between changes by steps: a smooth signal changes as
/// evenly, but at every sample.
const FEWEST_CHANGES: u64 = 64;
const LEAST_REPEATS: f64 = 0.03;
/// A step is at least this share of the signal's spread. At rest, a number without noise flickers by its last bit.
const LEAST_STEP: f64 = 1e-3;

/// Detects a frozen part with at most four values.
///
/// A sensor at rest may repeat itself legitimately: one simulated without noise, or one of coarse resolution.
/// Repetition therefore counts only if the signal was noisy before (judged by the fraction of turning points,
/// which is independent of the noise amplitude) or while another signal detects motion. That of a sensor whose step is wider
/// than its noise never counts: a motion elsewhere may move it by less than a step.
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
    /// Least change and running mean of the changes, as lengths, and running share of repeats.
    resolution: f64,
    change: f64,
    repeats: f64,
    /// Whether the sensor went from step to step by the last changes, and by enough of them at some time.
    steps: bool,
    is_coarse: bool,
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
            resolution: f64::INFINITY,
            change: 0.0,
            repeats: 0.0,
            steps: false,
            is_coarse: false,
        }
    }

    /// Whether it has shown two values.
    pub(super) fn has_changed(&self) -> bool {
        self.samples > 1
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
            self.repeats += STEP_WEIGHT * (1.0 - self.repeats);
        } else {
            self.see(values);
            (self.run, self.run_since_ns, self.moving) = (1, stamp_ns, 0);
        }
        let was_noisy = self.turning_share >= NOISY_SHARE && self.samples >= u64::from(limit);
        let moves = self.moving >= self.run / 2;
        let counts = (was_noisy || moves) && !self.is_coarse();
        (self.run >= limit && counts).then_some(self.run_since_ns)
    }

    /// Whether the sensor does not resolve its own noise, as far as is known.
    fn is_coarse(&self) -> bool {
        let steps = self.is_coarse || (self.steps && self.samples < FEWEST_CHANGES);
        steps && self.resolution >= LEAST_STEP * self.spread()
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
        let pairs = values.iter().zip(&self.last);
        let change = pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
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
        // NaN: the first one
        if change > 0.0 {
            self.follow_steps(change);
        }
    }

    fn follow_steps(&mut self, change: f64) {
        // the first sample is no change
        let weight = STEP_WEIGHT.max(1.0 / (self.samples - 1) as f64);
        self.change += weight * (change - self.change);
        self.resolution = self.resolution.min(change);
        self.steps = self.change < RESOLVED * self.resolution && self.repeats >= LEAST_REPEATS;
        self.repeats -= STEP_WEIGHT * self.repeats;
        self.is_coarse |= self.steps && self.samples >= FEWEST_CHANGES;
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

    /// What a sensor shows that knows whole steps only.
    fn in_steps(value: f64) -> f64 {
        value.round()
    }

    #[test]
    fn a_coarse_sensor_may_rest_while_something_moves() {
        // to and fro between two steps in one posture, still in the next
        let rests = |k: usize| {
            let posture = if k < 400 { 7.5 } else { 7.0 };
            in_steps(posture + 0.6 * (noise(k) - 0.5))
        };
        assert_eq!(frozen(rests, true), None);
        // from step to step by itself, and few steps at that
        let leans = |k: usize| in_steps(0.02 * k as f64);
        assert_eq!(frozen(leans, true), None);
        // shaken on its way, and still after it
        let stops = |k: usize| match k {
            0..300 => rests(k),
            300..400 => in_steps(20.0 * noise(k)),
            _ => 7.0,
        };
        assert_eq!(frozen(stops, false), None);
        assert_eq!(frozen(stops, true), None);
    }

    #[test]
    fn noise_wider_than_a_step_that_vanishes_is_frozen() {
        let resolved = |k: usize| in_steps(5.0 * noise(k));
        assert!(frozen(resolved, false).is_some());
        // each value twice, as of a sensor that is read too often
        let held = |k: usize| noise(k / 2);
        assert!(frozen(held, false).is_some());
    }

    #[test]
    fn smooth_signal_may_rest_unless_motion_is_detected() {
        let smooth = |k: usize| (k as f64 * 0.01).sin();
        assert_eq!(frozen(smooth, false), None);
        assert_eq!(frozen(smooth, true), Some(499));
    }
}
