//! Values that are held: a logger writes rows more often than the sensor measures, and repeats its last value meanwhile.
//!
//! Such a signal goes in stairs. Each repeat is late by up to a period, and the step at its end is a velocity that no joint has.
//! The repeats are no samples.
//!
//! A coarse resolution gives stairs, too, but goes by one step after an uneven time, or, when faster, by several steps from one
//! sample to the next. A held value has uneven steps at even intervals, of which none is shorter. With the interval `d` of the
//! samples and a tolerance `t` = 1.1 `d` + 0.1 `P`, an interval between changes is near a multiple of the period `P` by chance with
//! probability `p = 2 t / P`; of a held value it is so in all but [`MISSED`] of the cases. The logarithms of the ratio are summed.

/// Share of the updates of a held value that come at an odd time.
const MISSED: f64 = 0.02;
/// Sum of the logarithms of the ratio from which on a value is held: a thousand to one.
const EVIDENCE: f64 = 7.0;
/// Fewest intervals of one period.
const FEWEST: usize = 5;
/// A step is uneven that is so many times the least one of its value.
const UNEVEN: f64 = 2.5;
/// Least share of uneven steps.
const UNEVEN_SHARE: f64 = 0.1;
/// Fewest samples for the interval between two of them.
const FEWEST_SAMPLES: usize = 20;
/// Share of the changes that may follow each other from sample to sample, and how many may in any case.
const CLOSE: (f64, usize) = (0.04, 8);

/// The repeats of a held value.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HeldValues {
    /// Time between two measurements (ns).
    pub(super) period_ns: i64,
    /// Time between two samples (ns).
    pub(super) interval_ns: i64,
    /// The samples that repeat a value, by index in rising order.
    pub(super) repeats: Vec<usize>,
}

impl HeldValues {
    /// The repeats among samples with these stamps (ns), of which `read` passes one on; `None` if their values are not held.
    pub(super) fn among(
        stamps_ns: &[i64],
        mut read: impl FnMut(usize, &mut dyn FnMut(&[f64])),
    ) -> Option<Self> {
        let mut order: Vec<usize> = (0..stamps_ns.len()).collect();
        order.sort_by_key(|&index| stamps_ns[index]);
        let mut steps_ns: Vec<i64> = (order.windows(2))
            .map(|pair| stamps_ns[pair[1]].saturating_sub(stamps_ns[pair[0]]))
            .collect();
        if steps_ns.len() < FEWEST_SAMPLES {
            return None;
        }
        let middle = steps_ns.len() / 2;
        let interval_ns = *steps_ns.select_nth_unstable(middle).1;
        let mut changes = Changes::new(interval_ns);
        for &index in &order {
            read(index, &mut |values| {
                changes.take(stamps_ns[index], values);
            });
            if changes.are_close() {
                return None;
            }
        }
        let period_ns = changes.period_ns()?;
        let (&first_ns, earliest_ns) = (changes.at_ns.first()?, stamps_ns[*order.first()?]);
        // the first value was measured before the log began
        let periods = first_ns.saturating_sub(earliest_ns) / period_ns;
        let mut due_ns = first_ns - periods * period_ns;
        let mut next_change = changes.at_ns.iter().copied().peekable();
        let mut repeats = Vec::new();
        for index in order {
            let stamp_ns = stamps_ns[index];
            let is_change = next_change.next_if_eq(&stamp_ns).is_some();
            // a value that stays was measured again
            if is_change || stamp_ns >= due_ns - interval_ns / 2 {
                due_ns = stamp_ns.saturating_add(period_ns);
            } else {
                repeats.push(index);
            }
        }
        repeats.sort_unstable();
        Some(Self {
            period_ns,
            interval_ns,
            repeats,
        })
    }
}

/// The changes of the values of a sensor.
#[derive(Debug)]
struct Changes {
    /// Time between two samples (ns).
    interval_ns: i64,
    last: Vec<f64>,
    /// Stamps of the samples that differ from the one before (ns).
    at_ns: Vec<i64>,
    /// The least step of each value so far.
    least: Vec<f64>,
    /// The number of changes by uneven steps.
    uneven: usize,
    /// The number of changes that follow each other from sample to sample.
    close: usize,
}

impl Changes {
    fn new(interval_ns: i64) -> Self {
        Self {
            interval_ns,
            last: Vec::new(),
            at_ns: Vec::new(),
            least: Vec::new(),
            uneven: 0,
            close: 0,
        }
    }

    fn take(&mut self, stamp_ns: i64, values: &[f64]) {
        if self.last.len() != values.len() {
            self.last = values.to_vec();
            self.least = vec![f64::INFINITY; values.len()];
            return;
        }
        let (mut differs, mut is_uneven) = (false, false);
        let places = self.last.iter_mut().zip(&mut self.least).zip(values);
        for ((last, least), &value) in places {
            differs |= last.to_bits() != value.to_bits();
            let step = (value - *last).abs();
            if step > 0.0 {
                is_uneven |= step > UNEVEN * *least;
                *least = least.min(step);
            }
            *last = value;
        }
        if !differs {
            return;
        }
        self.uneven += usize::from(is_uneven);
        let before_ns = self.at_ns.last();
        let is_close = |before_ns: &i64| 2 * (stamp_ns - before_ns) < 3 * self.interval_ns;
        self.close += usize::from(before_ns.is_some_and(is_close));
        self.at_ns.push(stamp_ns);
    }

    /// Whether the values change from sample to sample.
    fn are_close(&self) -> bool {
        let (share, few) = CLOSE;
        self.close > few && self.close as f64 > share * self.at_ns.len() as f64
    }

    /// The time between two measurements (ns), if the values are held.
    fn period_ns(&self) -> Option<i64> {
        let apart = self.at_ns.windows(2).map(|pair| (pair[1] - pair[0]) as f64);
        let mut apart: Vec<f64> = apart.collect();
        if apart.len() < FEWEST || (self.uneven as f64) < UNEVEN_SHARE * self.at_ns.len() as f64 {
            return None;
        }
        apart.sort_unstable_by(f64::total_cmp);
        let short = apart[apart.len() / 10];
        let is_one = |apart: &&f64| (0.75 * short..1.5 * short).contains(*apart);
        let ones: Vec<f64> = apart.iter().filter(is_one).copied().collect();
        let period = *ones.get(ones.len() / 2)?;
        let tolerance = 1.1 * self.interval_ns as f64 + 0.1 * period;
        let by_chance = (2.0 * tolerance / period).min(1.0 - MISSED);
        let (mut evidence, mut fitting) = (0.0, 0);
        for &apart in &apart {
            let periods = (apart / period).round();
            // after many periods every time is near a multiple: the sensor's own clock drifts
            if periods > 2.0 {
                break;
            }
            let fits = periods > 0.0 && (apart - periods * period).abs() <= tolerance;
            evidence += match fits {
                true => ((1.0 - MISSED) / by_chance).ln(),
                false => (MISSED / (1.0 - by_chance)).ln(),
            };
            fitting += usize::from(fits && periods == 1.0);
        }
        (fitting >= FEWEST && evidence >= EVIDENCE).then_some(period as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    /// What is found in 20 s at 100 Hz of one value.
    fn found(value: impl Fn(f64) -> f64) -> Option<HeldValues> {
        let stamps: Vec<i64> = (0..2000).map(|k| k * 10 * MS).collect();
        HeldValues::among(&stamps, |index, take| take(&[value(index as f64 * 0.01)]))
    }

    /// A joint that swings, rests from 8 s to 12 s, and swings on (rad).
    fn swing(at_s: f64) -> f64 {
        let moving_s = at_s.min(8.0) + (at_s - 12.0).max(0.0);
        0.4 * (0.9 * moving_s).sin()
    }

    fn held(value: impl Fn(f64) -> f64, period_s: f64, phase_s: f64) -> impl Fn(f64) -> f64 {
        move |at_s| value(((at_s + 1e-9 + phase_s) / period_s).floor() * period_s - phase_s)
    }

    #[test]
    fn held_values_are_found_with_their_period() {
        for period_s in [0.05, 0.1, 0.2, 0.5, 1.0] {
            for phase_s in [0.0, 0.3 * period_s] {
                let found = found(held(swing, period_s, phase_s)).unwrap();
                assert_eq!(found.period_ns, (period_s * 1e9).round() as i64);
                let kept = 2000 - found.repeats.len();
                let expected = (20.0 / period_s) as usize;
                assert!(kept.abs_diff(expected) <= 1, "{period_s}: {kept}");
            }
        }
    }

    /// Also where the resolution is coarse, or the sensor's time uneven.
    #[test]
    fn held_values_are_found_by_a_coarse_sensor_and_with_an_uneven_time() {
        let coarse = |at_s: f64| (swing(at_s) / 0.004).round() * 0.004;
        assert_eq!(found(held(coarse, 0.2, 0.0)).unwrap().period_ns, 200 * MS);
        let updates: Vec<f64> = (0..101)
            .map(|k| 0.2 * f64::from(k) + 0.02 * f64::from(k).sin())
            .collect();
        let uneven = |at_s: f64| {
            let next = updates.partition_point(|update| *update <= at_s);
            swing(updates[next.saturating_sub(1)])
        };
        let period_ns = found(uneven).unwrap().period_ns;
        assert!((period_ns - 200 * MS).abs() <= 20 * MS, "{period_ns}");
    }

    /// What is kept lies where the value was new, whose stamps are the best that is known.
    #[test]
    fn no_new_value_is_left_out() {
        let value = held(swing, 0.25, 0.1);
        let found = found(&value).unwrap();
        for index in 1..2000_usize {
            let at = |index: usize| value(index as f64 * 0.01);
            let is_new = at(index).to_bits() != at(index - 1).to_bits();
            assert!(!(is_new && found.repeats.contains(&index)));
        }
    }

    #[test]
    fn values_that_are_measured_are_kept() {
        let noise = |at_s: f64| 1e-4 * (at_s * 7919.0).sin();
        assert_eq!(found(|at_s| swing(at_s) + noise(at_s)), None);
        assert_eq!(found(swing), None);
        assert_eq!(found(|_| 0.3), None);
        for resolution in [1e-4, 1e-3, 4e-3, 0.02, 0.1] {
            let coarse = |value: f64| (value / resolution).round() * resolution;
            assert_eq!(found(|at_s| coarse(swing(at_s))), None, "{resolution}");
            // at an even speed its steps come at even times, and all are one
            assert_eq!(found(|at_s| coarse(0.05 * at_s)), None, "{resolution}");
            let turns = |at_s: f64| (0.6 * at_s) % std::f64::consts::TAU;
            assert_eq!(found(|at_s| coarse(turns(at_s))), None, "{resolution}");
        }
    }

    #[test]
    fn a_few_samples_show_nothing() {
        let few = HeldValues::among(&[0, MS], |_, take| take(&[1.0]));
        assert_eq!(few, None);
        assert_eq!(HeldValues::among(&[], |_, _| ()), None);
    }
}
