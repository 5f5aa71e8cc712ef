//! Health of one number, measured sample by sample.

use super::block::{self, LEAST_SAMPLES, Parabola, median};
use super::record::NumberHealth;

/// Numbers of changes from which the resolution of a value is determined: most and fewest.
const MOST_CHANGES: usize = 4096;
const LEAST_CHANGES: usize = 20;
/// Samples of one extreme value in a row from which on it is held.
const LEAST_HELD: u64 = 3;
/// Values are far from the usual ones beyond so many times their usual deviation.
const FAR: f64 = 5.0;
const SIGMA_BY_MAD: f64 = 1.4826;
/// Samples that are judged with those of the next span: two are needed on either side.
const OVERLAP: usize = 4;

/// Measures one number.
#[derive(Debug, Default)]
pub(super) struct Meter {
    name: String,
    unit: &'static str,
    /// Whether the number may rest at an end of its range: then nothing shows that it is clipped.
    may_rest: bool,
    samples: u64,
    least: Extreme,
    greatest: Extreme,
    /// The last value, since when it is there (ns), and in how many samples.
    last: Option<(f64, i64, u64)>,
    longest_constant_ns: i64,
    changes: Vec<f64>,
    least_change: f64,
    /// The values of the current span, behind some of the span before.
    span: Vec<f64>,
    before: usize,
    means: Vec<f64>,
    rms: Vec<f64>,
    greatest_rms: Option<(f64, i64)>,
    outliers: u64,
    is_judged: bool,
}

/// An extreme value, and the samples that hold it.
#[derive(Debug, Clone, Copy, Default)]
struct Extreme {
    value: f64,
    held: u64,
}

impl Meter {
    pub(super) fn new(name: String, unit: &'static str, may_rest: bool) -> Self {
        let at = |value| Extreme { value, held: 0 };
        Self {
            name,
            unit,
            may_rest,
            least: at(f64::INFINITY),
            greatest: at(f64::NEG_INFINITY),
            least_change: f64::INFINITY,
            ..Self::default()
        }
    }

    /// Takes the next value; NaN where the sample does not have it.
    pub(super) fn take(&mut self, time_ns: i64, value: f64) {
        self.span.push(value);
        if !value.is_finite() {
            self.last = None;
            return;
        }
        self.samples += 1;
        let run = match self.last {
            Some((last, since_ns, count)) if last == value => {
                let constant_ns = time_ns.saturating_sub(since_ns);
                self.longest_constant_ns = self.longest_constant_ns.max(constant_ns);
                self.last = Some((value, since_ns, count + 1));
                count + 1
            }
            last => {
                if let Some((last, ..)) = last {
                    self.change((value - last).abs());
                }
                self.last = Some((value, time_ns, 1));
                1
            }
        };
        let is_new = [value < self.least.value, value > self.greatest.value];
        for (extreme, is_new) in [&mut self.least, &mut self.greatest]
            .into_iter()
            .zip(is_new)
        {
            extreme.take(value, is_new, run);
        }
    }

    fn change(&mut self, change: f64) {
        self.least_change = self.least_change.min(change);
        if self.changes.len() < MOST_CHANGES {
            self.changes.push(change);
        }
    }

    /// Ends a span of samples without a gap.
    pub(super) fn end_span(&mut self, parabola: &Parabola, first_ns: i64) {
        if self.span.iter().all(|value| value.is_finite()) {
            let (mean, rms) = parabola.mean_and_rms(&self.span[self.before..]);
            self.means.push(mean);
            self.rms.push(rms);
            if self.greatest_rms.is_none_or(|(greatest, _)| rms > greatest) {
                self.greatest_rms = Some((rms, first_ns));
            }
            self.is_judged = true;
            self.outliers += block::outliers(&self.span, self.least_change);
        }
        let kept = self.span.len().saturating_sub(OVERLAP);
        self.span.drain(..kept);
        self.before = self.span.len();
    }

    /// Forgets the samples of a span that a gap has ended.
    pub(super) fn drop_span(&mut self) {
        self.span.clear();
        self.before = 0;
    }

    pub(super) fn finish(mut self) -> NumberHealth {
        let resolution = resolution(
            &self.changes,
            self.least.value.abs().max(self.greatest.value.abs()),
        );
        let vibration_rms = median(&mut self.rms);
        let known = |value: f64| (self.samples > 0).then_some(value);
        NumberHealth {
            least: known(self.least.value),
            greatest: known(self.greatest.value),
            resolution,
            vibration_rms,
            greatest_vibration_rms: self.greatest_rms.map(|(rms, _)| rms),
            greatest_vibration_ns: self.greatest_rms.map(|(_, first_ns)| first_ns),
            clipped_share: match (self.may_rest, vibration_rms) {
                (false, Some(rms)) => Some(self.clipped_share(rms, resolution)),
                _ => None,
            },
            longest_constant_s: self.longest_constant_ns as f64 * 1e-9,
            outliers: self.is_judged.then_some(self.outliers),
            name: self.name,
            unit: self.unit.to_owned(),
            samples: self.samples,
        }
    }

    /// Share of the samples that hold an extreme value far from the usual ones.
    fn clipped_share(&mut self, vibration_rms: f64, resolution: Option<f64>) -> f64 {
        let Some(usual) = median(&mut self.means) else {
            return 0.0;
        };
        let mut apart: Vec<f64> = self.means.iter().map(|mean| (mean - usual).abs()).collect();
        let spread = SIGMA_BY_MAD * median(&mut apart).unwrap_or(0.0);
        let far = FAR * spread.hypot(vibration_rms).max(resolution.unwrap_or(0.0));
        let extremes = [self.least, self.greatest].into_iter();
        let held = extremes.filter(|extreme| (extreme.value - usual).abs() > far);
        let held: u64 = held.map(|extreme| extreme.held).sum();
        held as f64 / self.samples.max(1) as f64
    }
}

impl Extreme {
    /// Takes a value that is the `run`th in a row.
    fn take(&mut self, value: f64, is_new: bool, run: u64) {
        if is_new {
            *self = Self { value, held: 0 };
        } else if value == self.value && run >= LEAST_HELD {
            // the ones before it in the row count, too
            self.held += if run == LEAST_HELD { LEAST_HELD } else { 1 };
        }
    }
}

/// The step of which nearly all changes are multiples; `size` is that of the largest value.
fn resolution(changes: &[f64], size: f64) -> Option<f64> {
    /// Rounding of values of this size, by 32 bits.
    const ROUNDING: f64 = 1e-7;
    /// Deviation from a multiple, as a share of the step.
    const DEVIATION: f64 = 0.05;
    const SHARE: f64 = 0.99;
    let rounding = ROUNDING * size;
    let changes = || changes.iter().copied().filter(|change| *change > rounding);
    let count = changes().count();
    let step = changes().fold(f64::INFINITY, f64::min);
    let is_multiple = |change: &f64| {
        let times = (change / step).round();
        (change - times * step).abs() <= DEVIATION * step + rounding
    };
    let multiples = changes().filter(is_multiple).count();
    let is_found = count >= LEAST_CHANGES && multiples as f64 >= SHARE * count as f64;
    // rounding that is no smaller than the deviation would fit any change
    (is_found && rounding < DEVIATION * step).then_some(step)
}

/// The time of a span (ns): vibrations below some 3 Hz are motion.
pub(super) const SPAN_NS: i64 = 500_000_000;

/// The meters of all numbers of a sensor.
#[derive(Debug)]
pub(super) struct Meters {
    meters: Vec<Meter>,
    /// The times of the current span (ns).
    times_ns: Vec<i64>,
}

impl Meters {
    pub(super) fn new(meters: Vec<Meter>) -> Self {
        Self {
            meters,
            times_ns: Vec::new(),
        }
    }

    /// Takes a sample: its time, and the values in the order of the meters.
    pub(super) fn take(&mut self, time_ns: i64, values: &[f64]) {
        let first_ns = self.times_ns.first().copied();
        let last_ns = self.times_ns.last().copied();
        let is_behind =
            last_ns.is_some_and(|last| !(1..SPAN_NS / 2).contains(&time_ns.saturating_sub(last)));
        if is_behind {
            self.times_ns.clear();
            self.meters.iter_mut().for_each(Meter::drop_span);
        } else if first_ns.is_some_and(|first| time_ns.saturating_sub(first) >= SPAN_NS) {
            self.end_span();
        }
        self.times_ns.push(time_ns);
        for (meter, value) in self.meters.iter_mut().zip(values) {
            meter.take(time_ns, *value);
        }
    }

    fn end_span(&mut self) {
        let first_ns = self.times_ns.first().copied().unwrap_or(0);
        if self.times_ns.len() < LEAST_SAMPLES {
            self.meters.iter_mut().for_each(Meter::drop_span);
        } else {
            let seconds = |time: &i64| time.saturating_sub(first_ns) as f64 * 1e-9;
            let times: Vec<f64> = self.times_ns.iter().map(seconds).collect();
            let parabola = Parabola::over(&times);
            for meter in &mut self.meters {
                meter.end_span(&parabola, first_ns);
            }
        }
        self.times_ns.clear();
    }

    pub(super) fn finish(self) -> Vec<NumberHealth> {
        self.meters.into_iter().map(Meter::finish).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn measured(value: impl Fn(i64) -> f64) -> NumberHealth {
        let mut meters = Meters::new(vec![Meter::new("x".into(), "m/s^2", false)]);
        for k in 0..2000 {
            meters.take(10 * k * MS, &[value(k)]);
        }
        meters.finish().remove(0)
    }

    /// Even between -0.5 and 0.5.
    fn noise(k: i64) -> f64 {
        let mut state = k as u64 + 1;
        state = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        state = (state ^ (state >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    #[test]
    fn steps_of_a_number_are_its_resolution() {
        let step = 0.000_349;
        let sample = |k| ((k as f64 * 0.01).sin() / step).round() * step;
        let found = measured(sample).resolution.unwrap();
        assert!((found / step - 1.0).abs() < 1e-9, "{found}");
        assert_eq!(measured(noise).resolution, None);
        assert_eq!(measured(|_| 1.0).resolution, None);
    }

    #[test]
    fn a_limit_that_is_held_is_clipped_and_rest_is_not() {
        let shaken = |k: i64| {
            9.8 + noise(k)
                + if (600..700).contains(&k) {
                    20.0 * (0.1 * k as f64).sin()
                } else {
                    0.0
                }
        };
        let found = measured(|k| shaken(k).clamp(-5.0, 19.62));
        assert_eq!((found.least, found.greatest), (Some(-5.0), Some(19.62)));
        let share = found.clipped_share.unwrap();
        assert!((0.02..0.04).contains(&share), "{share}");
        assert_eq!(measured(shaken).clipped_share, Some(0.0));
        // noise below the resolution: the greatest of two values comes often
        let coarse = measured(|k| (4.0 * noise(k) * 0.3).round() * 0.1);
        assert_eq!(coarse.clipped_share, Some(0.0), "{coarse:?}");
    }

    #[test]
    fn vibration_has_a_level_a_place_and_no_outliers() {
        let shaken = |k: i64| {
            let amplitude = if (1000..1200).contains(&k) { 4.0 } else { 0.4 };
            amplitude * (2.0 * std::f64::consts::PI * 23.0 * 0.01 * k as f64).sin()
        };
        let found = measured(shaken);
        let level = |amplitude: f64, rms: Option<f64>| {
            (rms.unwrap() * 2_f64.sqrt() / amplitude - 1.0).abs()
        };
        assert!(level(0.4, found.vibration_rms) < 0.1, "{found:?}");
        assert!(level(4.0, found.greatest_vibration_rms) < 0.1, "{found:?}");
        let at_ms = found.greatest_vibration_ns.unwrap() / MS;
        assert!((10_000..12_000).contains(&at_ms), "{at_ms}");
        assert_eq!(found.outliers, Some(0));
    }

    #[test]
    fn single_values_apart_are_counted_once_wherever_they_are() {
        let spike = |k: i64| noise(k) * 0.01 + if k % 97 == 13 { 3.0 } else { 0.0 };
        let found = measured(spike);
        let all = (0..2000).filter(|k| k % 97 == 13).count() as u64;
        // the first two samples and the span that the log does not end are not judged
        let outliers = found.outliers.unwrap();
        assert!(
            outliers + 1 >= all && outliers <= all,
            "{outliers} of {all}"
        );
    }

    #[test]
    fn what_stands_still_is_told_by_its_time() {
        let found = measured(|k| {
            if (500..800).contains(&k) {
                1.0
            } else {
                noise(k)
            }
        });
        assert!((found.longest_constant_s - 2.99).abs() < 1e-9);
        let nothing = measured(|_| f64::NAN);
        assert_eq!(
            (nothing.samples, nothing.least, nothing.outliers),
            (0, None, None)
        );
    }
}
