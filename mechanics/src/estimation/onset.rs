//! The first samples of a motion that is faster than everything before it.
//!
//! The noise of joints is learnt in blocks ([`super::adaptation`]). Until a block of the new motion is over, the filter expects less than
//! comes: the innovations nu of the rates are far larger than their variance S by the noise learnt so far, and nothing of it is in the
//! bands. What chance does not explain, twice on end in one direction, is jerk between the samples. As much of it as explains the
//! innovation of the joint that is followed worst is in the covariance of the estimates meanwhile:
//! ```text
//!     x = max over channels of the less of both (nu^2 - CHANCE S) / h' Q h,    P := P + x Q
//! ```
//! with Q the covariance that white jerk of density 1 adds between two samples. The gains stay, and so do the bands at rest. A rate that a
//! coarse encoder shows for one sample goes back with the next. A position that it shows does not: without rates nothing is added.

use super::misfit::weights;
use super::white_jerk::{Matrix, predicted};

/// Squared innovation over its variance that chance does not reach: five standard deviations.
const CHANCE: f64 = 25.0;

/// Unexpected jerk in the newest innovations of one filter, and the covariance that allows for it.
#[derive(Debug, Clone)]
pub(super) struct Onset {
    channels: Vec<Newest>,
    /// Less of the last two excesses of the innovations, of the channel where it is largest; `None` without rates in this sample.
    excess: Option<f64>,
    /// The covariance that the excess adds.
    added: Matrix,
}

#[derive(Debug, Clone, Copy)]
struct Newest {
    /// Weight of the channel: one if it counts, zero otherwise.
    counts: f64,
    /// Excess of the squared innovation of the last rate, with the sign of the innovation.
    excess: f64,
}

impl Onset {
    /// `counts`: which channels show the noise that the estimates of all of them depend on.
    pub(super) fn new(counts: impl Iterator<Item = bool>) -> Self {
        let newest = |counts| Newest {
            counts,
            excess: 0.0,
        };
        Self {
            channels: weights(counts).into_iter().map(newest).collect(),
            excess: None,
            added: [[0.0; 3]; 3],
        }
    }

    /// A channel counts no more.
    pub(super) fn disregard(&mut self, channel: usize) {
        self.channels[channel].counts = 0.0;
    }

    /// The filter started anew.
    pub(super) fn restart(&mut self) {
        self.channels.iter_mut().for_each(|it| it.excess = 0.0);
        (self.excess, self.added) = (None, [[0.0; 3]; 3]);
    }

    /// Takes the innovations of a sample's rates, by channel, and their expected variance.
    pub(super) fn take(&mut self, innovations: impl Iterator<Item = f64>, variance: f64) {
        let mut largest = 0.0_f64;
        for (channel, innovation) in self.channels.iter_mut().zip(innovations) {
            let excess = (innovation * innovation - CHANCE * variance).max(0.0);
            let excess = channel.counts * excess.copysign(innovation);
            let before = std::mem::replace(&mut channel.excess, excess);
            if excess * before > 0.0 {
                largest = largest.max(excess.abs().min(before.abs()));
            }
        }
        self.excess = Some(largest);
    }

    /// Ends a sample, `dt` seconds after the one before.
    pub(super) fn step(&mut self, dt: f64) {
        let by_jerk = predicted(&[[0.0; 3]; 3], dt, 1.0);
        let density = self.excess.take().map(|excess| excess / by_jerk[1][1]);
        let density = density.filter(|it| it.is_finite()).unwrap_or(0.0);
        self.added = by_jerk.map(|row| row.map(|p| p * density));
    }

    /// Returns the covariance to add to that by the noise learnt so far.
    pub(super) fn added(&self) -> &Matrix {
        &self.added
    }
}

#[cfg(test)]
mod tests {
    use super::super::adaptation::Adaptation;
    use super::super::kalman_filter::{Doubt, KalmanFilter};
    use super::super::noise_of_tests::{Noise, STATED};
    use super::super::white_jerk::seconds;

    const STEP_NS: i64 = 10_000_000;
    /// Of four joints one moves.
    const JOINTS: usize = 4;
    const MOVES: usize = 1;

    /// A joint that rests, strokes there and back, and rests: its acceleration (rad/s^2), and the time of the stroke (s).
    #[derive(Clone, Copy)]
    struct Stroke {
        acceleration: f64,
        rises_s: f64,
        seed: u64,
    }

    const FIRST_S: f64 = 3.0;
    const EVERY_S: f64 = 2.0;
    const END_S: f64 = 13.0;

    impl Stroke {
        fn acceleration_at(self, t: f64) -> f64 {
            let Some(since) = Some(t - FIRST_S).filter(|it| *it >= 0.0) else {
                return 0.0;
            };
            let number = (since / EVERY_S).floor();
            let s = since - EVERY_S * number;
            let sign = if number % 2.0 == 0.0 { 1.0 } else { -1.0 };
            let on = |from: f64| ((s - from) / self.rises_s).clamp(0.0, 1.0);
            let up = on(0.0) - on(0.25);
            let down = on(0.25 + self.rises_s) - on(0.5 + self.rises_s);
            sign * self.acceleration * (up - down)
        }

        /// Share of accelerations within two sigma in the first 0.12 s of fast ones, and their number; mean sigma at rest.
        fn run(self, weighs: bool) -> [f64; 3] {
            let all = || (0..JOINTS).map(|_| true);
            let filter = KalmanFilter::new(STATED, JOINTS, false).adapting(Adaptation::new(all()));
            let mut filter = match weighs {
                true => filter.weighing_onsets(all()),
                false => filter,
            };
            let mut noise = Noise(self.seed);
            let (mut position, mut rate, mut fast_s) = (0.0, 0.0, f64::NEG_INFINITY);
            let (mut was_fast, mut inside, mut count) = (false, 0.0, 0.0);
            let (mut sigmas, mut rests) = (0.0, 0.0);
            for k in 0..(END_S * 1e9) as i64 / STEP_NS {
                let stamp_ns = k * STEP_NS;
                let t = seconds(stamp_ns);
                let acceleration = self.acceleration_at(t);
                let mut values = [0.0; JOINTS];
                let mut rates = [0.0; JOINTS];
                (values[MOVES], rates[MOVES]) = (position, rate);
                values.iter_mut().for_each(|it| *it += 2e-4 * noise.next());
                rates.iter_mut().for_each(|it| *it += 3e-3 * noise.next());
                let doubt = Doubt::default();
                (filter.push(stamp_ns, &values, Some(&rates), doubt)).unwrap();
                let sigma = filter.covariance_at(stamp_ns)[2][2].sqrt();
                let is_fast = acceleration.abs() > 4.0;
                if is_fast && !was_fast {
                    fast_s = t;
                }
                was_fast = is_fast;
                if t - fast_s < 0.12 {
                    let error = filter.at(MOVES, stamp_ns)[2] - acceleration;
                    let lag = filter.lag_at(MOVES, stamp_ns)[2];
                    inside += f64::from(u8::from(error.abs() < 2.0 * sigma.hypot(lag)));
                    count += 1.0;
                }
                if (2.0..FIRST_S).contains(&t) {
                    sigmas += sigma;
                    rests += 1.0;
                }
                let dt = seconds(STEP_NS);
                let steps = 100;
                for step in 0..steps {
                    let h = dt / f64::from(steps);
                    let a = self.acceleration_at(t + (f64::from(step) + 0.5) * h);
                    position += h * (rate + 0.5 * h * a);
                    rate += h * a;
                }
            }
            [inside / count, count, sigmas / rests]
        }
    }

    fn mean_of(strokes: &[Stroke], weighs: bool) -> [f64; 2] {
        let runs: Vec<_> = strokes.iter().map(|it| it.run(weighs)).collect();
        let count: f64 = runs.iter().map(|it| it[1]).sum();
        let inside: f64 = runs.iter().map(|it| it[0] * it[1]).sum();
        let sigma: f64 = runs.iter().map(|it| it[2]).sum();
        [inside / count, sigma / runs.len() as f64]
    }

    fn strokes(accelerations: &[f64], rises: &[f64], seeds: std::ops::Range<u64>) -> Vec<Stroke> {
        let mut all = Vec::new();
        for &acceleration in accelerations {
            for &rises_s in rises {
                all.extend(seeds.clone().map(|seed| Stroke {
                    acceleration,
                    rises_s,
                    seed,
                }));
            }
        }
        all
    }

    /// Other strokes and seeds than those on which the constant was chosen: 5, 9 and 14 rad/s^2 within 20, 60 and 150 ms, seeds 1 to 5.
    #[test]
    fn bands_hold_from_the_onset_of_a_fast_motion_on_and_are_the_same_at_rest() {
        let strokes = strokes(&[7.0, 11.0], &[0.03, 0.1], 11..16);
        let [learnt, widened] = [false, true].map(|weighs| mean_of(&strokes, weighs));
        println!("{learnt:?} {widened:?}");
        assert!(learnt[0] < 0.9, "{learnt:?}");
        assert!(widened[0] > 0.93, "{widened:?}");
        assert!(widened[1] < 1.001 * learnt[1], "{learnt:?} {widened:?}");
    }
}
