//! Removes periodic vibration of an IMU, such as that of an engine, by the mean over its period.
//!
//! The filters of the platform's motion pass little of a tone of f Hz, but 2 w0 / w of it: of an engine's 3 m/s^2 at 25 Hz a fifth,
//! which is hundreds of newtons at a wheel. The mean over n samples that last one of its periods, or several, passes next to
//! nothing of it, and is a measurement of all that is slower at the mean of their stamps. White noise it leaves as it is for a slow filter: its
//! variance is n times less, in n samples that are alike. So n is that of the least
//!
//! ```text
//!     n M(n),    M(n) = mean over some periods of |mean of the last n deviations of the specific force|^2
//! ```
//! if it is less than half of M(1). A deviation is that from a level with a trend that follows the samples as slowly as the filters do.
//!
//! A shock has no period, and a mean over it is late. That deviations d repeat after n samples shows in
//!
//! ```text
//!     c(n) = mean of d_k . d_(k-n) / max(|d_k|^2, |d_(k-n)|^2)
//! ```
//! with the memory of 64 samples, or of 0.25 s if that is longer. Each sample counts as much as another, however strong a blow is. Of a tone, c(n)
//! is 0.4 to 1 at its period. In white noise of any size that has no preferred direction, a term is at most the cosine between
//! independent directions, so (Azuma and Hoeffding) c(n) exceeds 1/3 with a probability below exp(-3/2 127 / 9) = 6e-10. Only then the
//! mean is of n samples.
//!
//! From one n to another, the mean grows or shrinks by one sample with each sample: none is left out, and stamps go on.
//! All channels have the same n, for they have to be alike (see [`faster`](super::faster)).

use super::white_jerk::seconds;

/// Longest mean (ns): engines shake at 20 Hz and more.
const LONGEST_NS: i64 = 50_000_000;
/// Most samples of a mean.
const MOST: usize = 64;
/// Memory of M (s): some periods.
const MEMORY_S: f64 = 0.1;
/// Time constant of the level (s): 3 Hz.
const LEVEL_S: f64 = 0.053;
/// Smallest variance of the deviations of a shaken sensor, as a multiple of that of its noise.
const LEAST_SIZE: f64 = 4.0;
/// Share of M(1) that n M(n) must be below.
const BETTER: f64 = 0.5;
/// Share of n M(n) below which another n takes its place.
const OTHER: f64 = 0.5;

/// Least c(n) of a vibration with a period of n samples.
const PERIODIC: f64 = 1.0 / 3.0;
/// Memory of c(n): samples, and time (s).
const PERIODS_MEMORY: (f64, f64) = (64.0, 0.25);

/// A sample: specific force and angular velocity.
pub(super) type Motion = [f64; 6];

#[derive(Debug, Clone, Copy)]
struct Taken {
    stamp_ns: i64,
    motion: Motion,
    /// Deviation of the specific force from its level (m/s^2).
    deviation: [f64; 3],
}

/// The last samples of a sensor that something shakes.
#[derive(Debug, Clone)]
pub(super) struct Shaken {
    /// The last samples, the latest at `latest`.
    samples: Vec<Taken>,
    latest: usize,
    /// Level of each component of the specific force, and its trend per second.
    level: [[f64; 2]; 3],
    /// Variance of its noise.
    variance: f64,
    max_gap_ns: i64,
    /// M(n), from n = 1 on.
    squares: Vec<f64>,
    /// c(n), from n = 0 on.
    alike: Vec<f64>,
    /// Samples since something shakes the sensor.
    shaken: usize,
    /// n
    length: usize,
    /// Samples of the last mean, on the way to n.
    averaged: usize,
}

impl Shaken {
    /// Creates the filter before the first sample; `noise` is the standard deviation of the specific force.
    pub(super) fn new(noise: f64, max_gap_ns: i64) -> Self {
        Self {
            samples: Vec::with_capacity(MOST),
            latest: 0,
            level: [[0.0; 2]; 3],
            variance: noise * noise,
            max_gap_ns,
            squares: vec![0.0; MOST],
            alike: vec![0.0; MOST + 1],
            shaken: 0,
            length: 1,
            averaged: 1,
        }
    }

    /// Takes a sample; returns the mean over the period of the vibration, and its stamp (ns). A sample that is not later than the
    /// one before is left out.
    pub(super) fn take(&mut self, stamp_ns: i64, motion: Motion) -> (i64, Motion) {
        let step_ns = |last: i64| stamp_ns.saturating_sub(last);
        let before = (!self.samples.is_empty()).then(|| self.back(0).stamp_ns);
        if before.is_some_and(|last| stamp_ns <= last) {
            return (stamp_ns, motion);
        }
        let before = before.filter(|&last| (1..=self.max_gap_ns).contains(&step_ns(last)));
        let mut deviation = [0.0; 3];
        let step_s = match before {
            Some(last) => {
                let step_s = seconds(step_ns(last));
                let kept = (-step_s / LEVEL_S).exp();
                for (k, [level, trend]) in self.level.iter_mut().enumerate() {
                    let expected = *level + *trend * step_s;
                    deviation[k] = motion[k] - expected;
                    *level = expected + (1.0 - kept * kept) * deviation[k];
                    *trend += (1.0 - kept).powi(2) / step_s * deviation[k];
                }
                step_s
            }
            None => {
                self.samples.clear();
                self.averaged = 0;
                self.level = std::array::from_fn(|k| [motion[k], 0.0]);
                0.0
            }
        };
        let taken = Taken {
            stamp_ns,
            motion,
            deviation,
        };
        if self.samples.len() < MOST {
            // after it has forgotten them, the first is the latest
            self.latest = self.samples.len();
            self.samples.push(taken);
        } else {
            self.latest = (self.latest + 1) % MOST;
            self.samples[self.latest] = taken;
        }
        self.weigh(step_s);
        match self.samples.is_empty() {
            true => (stamp_ns, motion),
            false => self.mean(),
        }
    }

    /// Returns the sample that is `samples` before the latest.
    fn back(&self, samples: usize) -> &Taken {
        let count = self.samples.len();
        &self.samples[(self.latest + count - samples) % count]
    }

    fn weigh(&mut self, step_s: f64) {
        let weight = step_s / (step_s + MEMORY_S);
        let square = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
        let latest = *self.back(0);
        self.squares[0] += weight * (square(&latest.deviation) - self.squares[0]);
        let is_shaken = self.squares[0] > LEAST_SIZE * 3.0 * self.variance;
        if !(is_shaken && self.squares[0].is_finite()) {
            (self.shaken, self.length) = (0, 1);
            self.squares[1..].fill(0.0);
            self.alike.fill(0.0);
            if !self.squares[0].is_finite() {
                // an absurd value, or its level
                self.squares[0] = 0.0;
                self.samples.clear();
                self.averaged = 0;
            }
            return;
        }
        self.shaken += 1;
        let weight = weight.max(1.0 / self.shaken as f64);
        let (samples, time_s) = PERIODS_MEMORY;
        let renewed = (1.0 / samples).min(step_s / time_s);
        let (mut sum, mut best) = ([0.0; 3], (1, BETTER * self.squares[0]));
        let (mut longest, mut is_full) = (0, self.samples.len() == MOST);
        for n in 1..=self.samples.len() {
            let one = self.back(n - 1);
            if latest.stamp_ns.saturating_sub(one.stamp_ns) >= LONGEST_NS {
                is_full = true;
                break;
            }
            (sum.iter_mut().zip(one.deviation)).for_each(|(sum, x)| *sum += x);
            if n == 1 {
                continue;
            }
            let mean = square(&sum) / (n * n) as f64;
            let squares = &mut self.squares[n - 1];
            *squares += weight * (mean - *squares);
            let score = n as f64 * *squares;
            if n < self.samples.len() {
                let before = self.back(n).deviation;
                let (a, b) = (latest.deviation, before);
                let both: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                let larger = square(&a).max(square(&b));
                let alike = if larger > 0.0 { both / larger } else { 0.0 };
                self.alike[n] += renewed * (alike - self.alike[n]);
            }
            if score < best.1 && self.alike[n] > PERIODIC {
                best = (n, score);
            }
            longest = n;
        }
        // as soon as the longest mean has been seen at both ends of it
        let own = OTHER * self.length as f64 * self.squares[self.length - 1];
        // a mean that became too long was not weighed
        let is_other = self.length == 1
            || best.0 == 1
            || best.1 < own
            || self.length > longest
            || self.alike[self.length] <= PERIODIC;
        if is_full && self.shaken > 2 * longest && is_other {
            self.length = best.0;
        }
    }

    fn mean(&mut self) -> (i64, Motion) {
        let latest = *self.back(0);
        let length = match self.averaged < self.length {
            true => self.averaged + 1,
            false => self.length.max(self.averaged - 1),
        };
        let length = length.min(self.samples.len());
        if length == 1 {
            self.averaged = 1;
            return (latest.stamp_ns, latest.motion);
        }
        let (mut behind_ns, mut sum, mut count) = (0, [0.0; 6], 0);
        for n in 0..length {
            let one = self.back(n);
            let age_ns = latest.stamp_ns.saturating_sub(one.stamp_ns);
            if age_ns >= LONGEST_NS {
                break;
            }
            behind_ns += age_ns;
            count += 1;
            (sum.iter_mut().zip(one.motion)).for_each(|(sum, value)| *sum += value);
        }
        self.averaged = count as usize;
        let stamp_ns = latest.stamp_ns - behind_ns / count;
        (stamp_ns, sum.map(|sum| sum / count as f64))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::noise_of_tests::Noise;
    use super::*;

    const STEP_NS: i64 = 4_000_000;
    const NOISE: f64 = 0.05;

    /// True acceleration of the platform (m/s^2) at a time (s).
    fn driven(t: f64) -> f64 {
        1.5 * (TAU * 0.4 * t).sin()
    }

    /// Returns the rms errors of a shaken specific force, as measured and as a mean at its stamp, from 0.6 to 6 s, and the number
    /// of samples that did not stay as they were.
    fn off(truth: impl Fn(f64) -> f64, shake: impl Fn(f64) -> f64) -> ([f64; 2], usize) {
        let mut shaken = Shaken::new(NOISE, 250_000_000);
        let mut noise = Noise(3);
        let (mut squares, mut count, mut changed) = ([0.0; 2], 0, 0);
        for k in 0..1500 {
            let stamp_ns = k * STEP_NS;
            let t = seconds(stamp_ns);
            let mut motion = [0.0; 6].map(|_: f64| 0.5 * shake(t) + NOISE * noise.next());
            motion[2] += truth(t) + 0.5 * shake(t);
            let (at_ns, mean) = shaken.take(stamp_ns, motion);
            if t > 0.6 {
                let errors = [motion[2] - truth(t), mean[2] - truth(seconds(at_ns))];
                (squares.iter_mut().zip(errors)).for_each(|(sum, error)| *sum += error * error);
                count += 1;
                changed += usize::from((at_ns, mean) != (stamp_ns, motion));
                assert!((0..60_000_000).contains(&(stamp_ns - at_ns)));
            }
        }
        (
            squares.map(|sum: f64| (sum / f64::from(count)).sqrt()),
            changed,
        )
    }

    #[test]
    fn what_shakes_at_an_even_beat_is_taken_away_and_the_motion_stays() {
        for hertz in [18.0, 20.0, 25.0, 33.0, 45.0, 58.0] {
            let (of, changed) = off(driven, |t| 3.0 * (TAU * hertz * t).sin());
            assert!(of[1] < 0.1 * of[0], "{hertz} Hz: {of:?}");
            assert!(changed > 1300, "{hertz} Hz: {changed}");
        }
    }

    #[test]
    fn motion_stays_as_it_was_measured_and_noise_becomes_no_more() {
        let blows = |t: f64| 13.0 * (-4.0 * (t % 1.5)).exp() * (31.0 * (t % 1.5)).sin();
        let (_, still) = off(|_| 9.81, |_| 0.0);
        let (_, driving) = off(driven, |_| 0.0);
        let (_, landing) = off(blows, |_| 0.0);
        let noise = std::cell::RefCell::new(Noise(9));
        // without a beat, a mean takes noise away as well, or nothing
        let (noisy, _) = off(|_| 9.81, |_| noise.borrow_mut().next());
        assert_eq!([still, driving, landing], [0; 3]);
        assert!(noisy[1] <= noisy[0], "{noisy:?}");
    }

    /// Stones under the wheels: the ringing after a blow has a beat, and is over before it counts as one.
    #[test]
    fn blows_are_no_beat() {
        for decay_s in [0.03, 0.06] {
            let mut blows = Noise(11);
            let blows: Vec<[f64; 3]> = (0..12)
                .map(|k| {
                    let at_s = 0.5 * f64::from(k) + 0.1 * blows.next();
                    [at_s, 4.0 * blows.next(), 30.0 + 5.0 * blows.next()]
                })
                .collect();
            let ringing = |t: f64| {
                let after = blows.iter().filter(|[at_s, ..]| t > *at_s);
                let ring = |[at_s, size, hertz]: &[f64; 3]| {
                    let s = t - at_s;
                    size * (-s / decay_s).exp() * (TAU * hertz * s).sin()
                };
                after.map(ring).sum()
            };
            let (_, changed) = off(driven, ringing);
            assert_eq!(changed, 0, "{decay_s} s");
        }
    }

    /// More samples lie within the longest period than are kept.
    #[test]
    fn a_fast_sensor_is_followed() {
        for hertz in [1300, 1600, 2000, 4000] {
            let mut shaken = Shaken::new(NOISE, 250_000_000);
            let mut noise = Noise(7);
            for (place, tone) in (0..).zip([25.0, 40.0, 100.0, 200.0]) {
                for k in 2000 * place..2000 * (place + 1) {
                    let stamp_ns = k * (1_000_000_000 / hertz);
                    let shaking = 3.0 * (TAU * tone * seconds(stamp_ns)).sin();
                    let motion = [0.0; 6].map(|_: f64| shaking + NOISE * noise.next());
                    let (at_ns, mean) = shaken.take(stamp_ns, motion);
                    assert!(stamp_ns - at_ns < LONGEST_NS && mean[0].is_finite());
                }
            }
        }
    }

    /// From the first mean to the last, stamps go on, and each sample counts in as many means as another.
    #[test]
    fn no_sample_is_left_out_where_the_length_of_the_mean_changes() {
        let mut shaken = Shaken::new(NOISE, 250_000_000);
        let mut noise = Noise(7);
        let (mut last_ns, mut lengths) = (-1, Vec::new());
        for k in 0..2000 {
            let stamp_ns = k * STEP_NS;
            let t = seconds(stamp_ns);
            // none, then one beat, then another
            let tone = match k {
                0..500 => 0.0,
                500..1000 => 3.0 * (TAU * 23.0 * t).sin(),
                1000..1500 => 3.0 * (TAU * 41.0 * t).sin(),
                _ => 0.0,
            };
            let motion = [0.0; 6].map(|_: f64| tone + NOISE * noise.next());
            let (at_ns, _) = shaken.take(stamp_ns, motion);
            assert!(at_ns > last_ns, "{k}");
            // first and last sample of the mean
            lengths.push((stamp_ns - at_ns) * 2 / STEP_NS + 1);
            last_ns = at_ns;
        }
        assert!(
            lengths
                .windows(2)
                .all(|pair| (pair[1] - pair[0]).abs() <= 1)
        );
        assert!(lengths[800] > 5 && lengths[1400] > 5, "{lengths:?}");
        assert_eq!([lengths[400], lengths[1999]], [1, 1]);
    }

    #[test]
    fn nothing_is_averaged_over_a_gap() {
        let mut shaken = Shaken::new(NOISE, 250_000_000);
        let motion = |k: i64| [3.0 * (TAU * 25.0 * seconds(k * STEP_NS)).sin(); 6];
        let as_it_is = |shaken: &mut Shaken, k: i64, at_ns: i64| {
            shaken.take(at_ns, motion(k)) == (at_ns, motion(k))
        };
        let of_tone = (0..200)
            .filter(|&k| as_it_is(&mut shaken, k, k * STEP_NS))
            .count();
        assert!(of_tone < 60, "{of_tone}");
        assert!(as_it_is(&mut shaken, 201, 200 * STEP_NS + 300_000_000));
        assert!(!as_it_is(&mut shaken, 202, 201 * STEP_NS + 300_000_000));
        // a sample that is not later is none
        assert!(as_it_is(&mut shaken, 203, i64::MIN));
        assert!(!as_it_is(&mut shaken, 203, 202 * STEP_NS + 300_000_000));
    }

    #[test]
    fn a_mean_is_never_longer_than_the_longest_and_survives_absurd_values() {
        let mut shaken = Shaken::new(NOISE, 250_000_000);
        let mut noise = Noise(5);
        let mut stamp_ns = 0;
        for k in 0..3000 {
            // 500 Hz, then 100 Hz
            stamp_ns += if k < 1500 { 2_000_000 } else { 10_000_000 };
            let tone = 3.0 * (TAU * 25.0 * seconds(stamp_ns)).sin();
            let mut motion = [0.0; 6].map(|_: f64| tone + NOISE * noise.next());
            if k == 1000 {
                motion[0] = 1e200;
            }
            let (at_ns, mean) = shaken.take(stamp_ns, motion);
            assert!((0..LONGEST_NS).contains(&(stamp_ns - at_ns)), "{k}");
            if (700..1000).contains(&k) || (1300..1500).contains(&k) || k > 1700 {
                assert!(mean[1].abs() < 0.5, "{k}: {mean:?}");
            }
        }
    }
}
