//! The noise that a log itself shows: it corrects the stated noise of a filter, in both directions, from its own
//! innovations.
//!
//! If all noise is stated right, the innovations of a filter are white and as large as it expects (R. K. Mehra, On the
//! identification of variances and adaptive Kalman filtering, 1970). Over blocks of n samples, with every innovation
//! divided by the standard deviation that the filter expects,
//!
//! ```text
//!     c = mean(nu^2),    b = mean over channels of (sum nu)^2 / n,    both 1 if the noise is right
//! ```
//! Innovations that agree from sample to sample, b > c, show a motion that the filter is too slow for: the process noise
//! grows. Where a velocity is measured besides, the innovations of both sensors have to agree with each other: what only one
//! of them shows is its own error, such as the lag of a filter in the sensor. Innovations that do not agree but have another
//! size, c != 1, show another noise of measurement. It may become smaller than stated; the process noise may not, because
//! a motion that has not come yet is no evidence that none will come.
//!
//! All of it uses past samples only, so it is the same offline and live, to the bit.

use super::misfit::weights;

/// Fewest samples of a block.
const LEAST_SAMPLES: u32 = 4;
/// Shortest duration of a block (ns): vibration averages out, the fastest motion of a joint does not.
const LEAST_NS: i64 = 40_000_000;
/// Change of the logarithm of the process noise by a block, for each unit that b exceeds c. On the manoeuvres of the
/// calibration set, twice as much is restless and half of it late.
const PROCESS_GAIN: f64 = 0.3;
/// Change of the logarithm of a measurement's variance by a block, for each unit that c exceeds 1: some seconds until it fits.
const MEASUREMENT_GAIN: f64 = 0.05;
/// Agreement that chance gives beside the stated process noise, which is the least: without it, it drifts away from there by
/// chance alone. Where it has grown, chance takes as much as it gives.
const CHANCE: f64 = 0.3;
/// Memory of the agreement of innovations: weight of the last block.
const MEMORY: f64 = 0.2;
/// While innovations agree by more than this, the size of innovations is not that of the noise.
const LAGGING: f64 = 0.5;
/// Innovations of a value and its rate that disagree by more than this show that the rate is wrong.
const DISAGREEING: f64 = 0.2;
/// Excess of the rate's innovations by such a disagreement.
const DISTRUST: f64 = 4.0;
/// Largest share of one block in a change, so that one wild sample is only one.
const MOST_AGREEMENT: f64 = 3.0;
const MOST_SIZE: f64 = 4.0;
/// Range of the logarithm of a measurement's variance over the stated one: standard deviations from a seventh, which is
/// left for resolution and whatever else does not show while the signal rests, to a hundred times.
const MEASUREMENT_RANGE: [f64; 2] = [-3.9, 9.2];
/// Range of the logarithm of the process noise over the stated one, up to a thousand times the agility.
const PROCESS_RANGE: [f64; 2] = [0.0, 13.8];

/// Corrections of the stated noise of one filter.
#[derive(Debug, Clone)]
pub(super) struct Adaptation {
    /// One for each channel that counts, zero for the others.
    counts: Vec<f64>,
    value: Innovations,
    rate: Innovations,
    since_ns: Option<i64>,
    /// Agreement of innovations with the ones before, averaged.
    lag: f64,
    /// Agreement of values with rates, averaged.
    accord: f64,
    /// Logarithms of the factors.
    logarithms: Factors,
    factors: Factors,
    blocks: u32,
    /// Over all blocks: logarithms of measurements, and factors of the process noise.
    sum: Factors,
}

/// Factors on variances and on the spectral density of the process noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Factors {
    pub(super) value: f64,
    pub(super) rate: f64,
    pub(super) density: f64,
}

impl Factors {
    pub(super) const STATED: Self = Self {
        value: 1.0,
        rate: 1.0,
        density: 1.0,
    };
    const ZERO: Self = Self {
        value: 0.0,
        rate: 0.0,
        density: 0.0,
    };
}

/// Innovations of one kind of measurement within a block, over their expected standard deviation.
#[derive(Debug, Clone)]
pub(super) struct Innovations {
    samples: u32,
    /// Sum by channel.
    sums: Vec<f64>,
    /// Sum over all channels together.
    squares: f64,
}

impl Innovations {
    fn new(channels: usize) -> Self {
        Self {
            samples: 0,
            sums: vec![0.0; channels],
            squares: 0.0,
        }
    }

    fn clear(&mut self) {
        self.samples = 0;
        self.sums.fill(0.0);
        self.squares = 0.0;
    }
}

/// c and b of a block.
#[derive(Debug, Clone, Copy)]
struct Size {
    each: f64,
    together: f64,
}

impl Adaptation {
    /// `counts`: which channels show the noise that the estimates of all of them depend on.
    pub(super) fn new(counts: impl Iterator<Item = bool>) -> Self {
        let counts = weights(counts);
        let channels = counts.len();
        Self {
            counts,
            value: Innovations::new(channels),
            rate: Innovations::new(channels),
            since_ns: None,
            lag: 0.0,
            accord: 0.0,
            logarithms: Factors::ZERO,
            factors: Factors::STATED,
            blocks: 0,
            sum: Factors::ZERO,
        }
    }

    /// Excludes a channel, and takes the noise as stated again: the share of each channel in the noise learnt so far is unknown.
    pub(super) fn disregard(&mut self, channel: usize) {
        self.counts[channel] = 0.0;
        self.restart();
        (self.lag, self.accord) = (0.0, 0.0);
        (self.logarithms, self.factors) = (Factors::ZERO, Factors::STATED);
    }

    pub(super) fn factors(&self) -> Factors {
        self.factors
    }

    /// Returns the mean factors over all samples so far; `None` before the first block.
    pub(super) fn mean(&self) -> Option<Factors> {
        let blocks = f64::from(self.blocks);
        (self.blocks > 0).then(|| Factors {
            value: (self.sum.value / blocks).exp(),
            rate: (self.sum.rate / blocks).exp(),
            density: self.sum.density / blocks,
        })
    }

    /// The filter started anew: the samples of the block do not follow one another. What was learnt stays.
    pub(super) fn restart(&mut self) {
        self.clear();
        self.since_ns = None;
    }

    /// Takes the innovations of a sample's values (`MEASURED` is 0) or rates (1), by channel, and their expected variance.
    #[inline]
    pub(super) fn take<const MEASURED: usize>(
        &mut self,
        innovations: impl Iterator<Item = f64>,
        variance: f64,
    ) {
        let scale = 1.0 / variance.sqrt();
        let block = if MEASURED == 0 {
            &mut self.value
        } else {
            &mut self.rate
        };
        block.samples += 1;
        let channels = block.sums.iter_mut().zip(&self.counts);
        for ((sum, counts), innovation) in channels.zip(innovations) {
            let normal = innovation * scale * counts;
            *sum += normal;
            block.squares += normal * normal;
        }
    }

    /// Ends the block if it is long enough: after each sample.
    #[inline]
    pub(super) fn step(&mut self, stamp_ns: i64) {
        let since_ns = *self.since_ns.get_or_insert(stamp_ns);
        if self.value.samples >= LEAST_SAMPLES && stamp_ns.saturating_sub(since_ns) >= LEAST_NS {
            self.end_block();
            self.clear();
            self.since_ns = Some(stamp_ns);
        }
    }

    fn clear(&mut self) {
        self.value.clear();
        self.rate.clear();
    }

    fn end_block(&mut self) {
        // A channel that repeats its value bit for bit shows nothing.
        let showing = self.value.sums.iter().filter(|&&sum| sum != 0.0).count();
        let samples = f64::from(self.value.samples);
        let total = samples * showing as f64;
        let size = |block: &Innovations| Size {
            each: block.squares / total,
            together: block.sums.iter().map(|sum| sum * sum).sum::<f64>() / total,
        };
        let value = size(&self.value);
        let has_rates = self.rate.samples == self.value.samples;
        let rate = size(&self.rate);
        if !(value.each.is_finite() && value.together.is_finite()) || showing == 0 {
            return;
        }
        let agreement = if has_rates && rate.each.is_finite() && rate.together.is_finite() {
            let both = self.value.sums.iter().zip(&self.rate.sums);
            let both = both.map(|(value, rate)| value * rate).sum::<f64>() / total;
            let accord = both / (value.each * rate.each).sqrt().max(1.0);
            self.accord += MEMORY * (accord.clamp(-2.0, 2.0) - self.accord);
            let own = (rate.together - rate.each) / rate.each.max(1.0);
            match accord > 0.0 {
                true => 0.5 * (accord + own),
                false => accord,
            }
        } else {
            (value.together - value.each) / value.each.max(1.0)
        };
        self.lag += MEMORY * (agreement.min(2.0) - self.lag);
        let log = &mut self.logarithms;
        let [least, most] = PROCESS_RANGE;
        let chance = CHANCE * (-log.density).exp();
        log.density += PROCESS_GAIN * (agreement - chance).min(MOST_AGREEMENT);
        log.density = log.density.clamp(least, most);
        if self.lag < LAGGING {
            let [least, most] = MEASUREMENT_RANGE;
            let fitted = |log: f64, size: f64| {
                (log + MEASUREMENT_GAIN * (size.min(MOST_SIZE) - 1.0)).clamp(least, most)
            };
            log.value = fitted(log.value, value.each);
            if has_rates && rate.each.is_finite() {
                let distrust = match self.accord < -DISAGREEING {
                    true => 1.0 - DISTRUST * self.accord,
                    false => 0.0,
                };
                log.rate = fitted(log.rate, rate.each.max(distrust));
            }
        }
        self.factors = Factors {
            value: log.value.exp(),
            rate: log.rate.exp(),
            density: log.density.exp(),
        };
        self.blocks = self.blocks.saturating_add(1);
        self.sum.value += log.value;
        self.sum.rate += log.rate;
        self.sum.density += self.factors.density;
    }
}

#[cfg(test)]
mod tests {
    use super::super::kalman_filter::{Doubt, KalmanFilter};
    use super::super::noise_of_tests::{Noise, STATED};
    use super::super::white_jerk::seconds;
    use super::{Adaptation, Factors};

    /// Noise of the simulated sensor, times a scale.
    const POSITION: f64 = 2e-4;
    const RATE: f64 = 3e-3;
    const STEP_NS: i64 = 10_000_000;
    const BEGIN_S: f64 = 4.0;
    const END_S: f64 = 20.0;

    /// A joint that swings after it has rested.
    #[derive(Clone, Copy)]
    struct Swing {
        angular: f64,
        amplitude: f64,
        /// Of the noise.
        scale: f64,
        /// Time constant of the sensor's filter of the rate (s).
        lag_s: f64,
    }

    struct Run {
        rms: f64,
        inside: f64,
        shown: Option<Factors>,
    }

    impl Swing {
        /// Position, rate and acceleration. It swings up smoothly within a second.
        fn at(self, t: f64) -> [f64; 3] {
            let (s, w) = ((t - BEGIN_S).max(0.0), self.angular);
            let (on, on1, on2) = match s < 1.0 {
                true => (
                    s * s * (3.0 - 2.0 * s),
                    6.0 * s - 6.0 * s * s,
                    6.0 - 12.0 * s,
                ),
                false => (1.0, 0.0, 0.0),
            };
            let (sin, cos) = (w * s).sin_cos();
            let moves = f64::from(u8::from(s > 0.0));
            [
                on * sin,
                on1 * sin + on * w * cos,
                on2 * sin + 2.0 * on1 * w * cos - on * w * w * sin,
            ]
            .map(|value| value * self.amplitude * moves)
        }

        /// The error of the acceleration after the first two seconds of motion, with its share within two sigma.
        fn run(self, adapts: bool) -> Run {
            let filter = KalmanFilter::new(STATED, 1, false);
            let mut filter = match adapts {
                true => filter.adapting(Adaptation::new([true].into_iter())),
                false => filter,
            };
            let mut noise = Noise(7);
            let (mut lagged, mut errors, mut inside) = (0.0, Vec::new(), 0.0);
            for k in 0..(END_S * 1e9) as i64 / STEP_NS {
                let stamp_ns = k * STEP_NS;
                let [position, rate, acceleration] = self.at(seconds(stamp_ns));
                let step_s = seconds(STEP_NS);
                lagged += step_s / (step_s + self.lag_s) * (rate - lagged);
                let value = position + self.scale * POSITION * noise.next();
                let rate = lagged + self.scale * RATE * noise.next();
                let doubt = Doubt::default();
                filter
                    .push(stamp_ns, &[value], Some(&[rate]), doubt)
                    .unwrap();
                if seconds(stamp_ns) > BEGIN_S + 2.0 {
                    let error = filter.at(0, stamp_ns)[2] - acceleration;
                    let sigma = filter.covariance_at(stamp_ns)[2][2].sqrt();
                    errors.push(error * error);
                    inside += f64::from(u8::from(error.abs() < 2.0 * sigma));
                }
            }
            let count = errors.len() as f64;
            Run {
                rms: (errors.iter().sum::<f64>() / count).sqrt(),
                inside: inside / count,
                shown: filter.shown_noise(),
            }
        }
    }

    const FAST: Swing = Swing {
        angular: 3.1,
        amplitude: 0.6,
        scale: 1.0,
        lag_s: 0.0,
    };
    const SLOW: Swing = Swing {
        angular: 0.8,
        amplitude: 0.3,
        ..FAST
    };

    #[test]
    fn a_motion_that_is_faster_than_stated_is_followed_and_its_band_holds() {
        for scale in [1.0, 3.0] {
            let swing = Swing { scale, ..FAST };
            let (stated, adapted) = (swing.run(false), swing.run(true));
            assert!(stated.inside < 0.5, "{}", stated.inside);
            assert!(
                adapted.rms < 0.6 * stated.rms,
                "{} {}",
                adapted.rms,
                stated.rms
            );
            assert!(adapted.inside > 0.92, "{}", adapted.inside);
            assert!(adapted.shown.unwrap().density > 100.0);
        }
    }

    #[test]
    fn noise_is_corrected_in_both_directions_while_the_agility_stays() {
        for scale in [0.3, 5.0] {
            let rest = Swing {
                amplitude: 0.0,
                scale,
                ..FAST
            };
            let shown = rest.run(true).shown.unwrap();
            let ratio = (shown.value * STATED.value_variance).sqrt() / (scale * POSITION);
            assert!((0.7..1.3).contains(&ratio), "{scale}: {ratio}");
            assert!(shown.density < 4.0, "{scale}: {}", shown.density);
        }
    }

    #[test]
    fn a_rate_that_lags_is_distrusted_and_does_not_count_as_fast_motion() {
        let lagging = Swing {
            lag_s: 0.03,
            ..SLOW
        };
        let (stated, adapted) = (lagging.run(false), lagging.run(true));
        assert!(
            adapted.rms < 1.2 * stated.rms,
            "{} {}",
            adapted.rms,
            stated.rms
        );
        let shown = adapted.shown.unwrap();
        assert!(shown.rate > 2.0, "{}", shown.rate);
    }

    #[test]
    fn what_is_stated_right_stays() {
        let (stated, adapted) = (SLOW.run(false), SLOW.run(true));
        assert!(
            adapted.rms < 1.5 * stated.rms,
            "{} {}",
            adapted.rms,
            stated.rms
        );
        assert!(adapted.inside > 0.9, "{}", adapted.inside);
    }
}
