//! The length of the specific force against gravity: no machine rises or falls fast for long.
//!
//! ```text
//!     m' = (|f| - m) / T      mean length, from gravity on
//! ```
//! A machine that stands, drives or tips over has the mean g but for the vertical velocity that it gains: `|m - g| = v / T`. An
//! accelerometer that has stepped to another level, or shows another unit, has not. Downwards more is possible: a fall.

use super::notice::{Found, Limits, Notice};
use crate::machine::FaultKind;

/// The time over which the length is averaged (s).
const AVERAGED_S: f64 = 2.0;
/// Vertical velocities, up and down, that no machine gains (m/s): the latter is a free fall of more than three metres.
const RISES: f64 = 4.0;
const FALLS: f64 = 8.0;

/// Mean length of the specific force of one IMU.
#[derive(Debug, Clone)]
pub(super) struct WeightWatch {
    gravity: f64,
    mean: f64,
    last_ns: Option<i64>,
    since_ns: Option<i64>,
}

impl WeightWatch {
    /// Creates the watch before the first sample, with this gravity (m/s^2).
    pub(super) fn new(gravity: f64) -> Self {
        Self {
            gravity,
            mean: gravity,
            last_ns: None,
            since_ns: None,
        }
    }

    /// Returns the difference of the mean length of the specific force from the nearest possible one (m/s^2, signed); `None`
    /// while the mean is credible.
    pub(super) fn beyond(&self) -> Option<f64> {
        let nearest = self.mean.clamp(self.least(), self.largest());
        (self.mean != nearest).then_some(self.mean - nearest)
    }

    /// Remembers from an earlier session that the mean was so far beyond what is possible (m/s^2, signed).
    pub(super) fn remember(&mut self, beyond: f64) {
        let nearest = match beyond > 0.0 {
            true => self.largest(),
            false => self.least(),
        };
        self.mean = nearest + beyond;
    }

    /// Trusts the specific force so far: its mean begins anew.
    pub(super) fn trust(&mut self) {
        (self.mean, self.since_ns) = (self.gravity, None);
    }

    fn least(&self) -> f64 {
        self.gravity - FALLS / AVERAGED_S
    }

    fn largest(&self) -> f64 {
        self.gravity + RISES / AVERAGED_S
    }

    /// Reports a specific force (m/s^2) that is too large or too small for too long; returns whether it is credible. It is
    /// trusted again when the mean is back.
    pub(super) fn check(
        &mut self,
        stamp_ns: i64,
        specific_force: &[f64],
        limits: &Limits,
        found: &mut Found<'_>,
    ) -> bool {
        let length = specific_force.iter().map(|v| v * v).sum::<f64>().sqrt();
        let last_ns = self.last_ns.replace(stamp_ns);
        let step_s = last_ns.map_or(0.0, |last| limits.elapsed_s(last, stamp_ns));
        // a hole says nothing about the time in it
        let step_s = step_s.min(limits.max_gap_s);
        self.mean += (length - self.mean) * step_s / (step_s + AVERAGED_S);
        let nearest = self.mean.clamp(self.least(), self.largest());
        if self.mean == nearest {
            self.since_ns = None;
            return true;
        }
        let since_ns = *self.since_ns.get_or_insert(stamp_ns);
        found(
            Notice::of(FaultKind::OutOfRange, since_ns)
                .measured(self.mean, nearest)
                .amount((length - self.gravity).abs(), 0.0),
        );
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times (s) at which a fault begins and ends; samples every ten milliseconds.
    fn faulty(force: impl Fn(f64) -> f64) -> (Option<f64>, Option<f64>) {
        let mut watch = WeightWatch::new(9.81);
        let (mut first, mut last) = (None, None);
        for step in 0..3000_i64 {
            let time_s = step as f64 * 0.01;
            let values = [0.0, 0.0, force(time_s)];
            let stamp_ns = step * 10_000_000;
            if !watch.check(stamp_ns, &values, &Limits::OF_TESTS, &mut |_| ()) {
                first.get_or_insert(time_s);
                last = Some(time_s);
            }
        }
        (first, last)
    }

    #[test]
    fn steps_and_other_units_are_found_within_a_second_or_two() {
        for (level, at_most_s) in [
            (20.0, 0.5),
            (38.0, 0.2),
            (1.0, 2.0),
            (0.0, 1.2),
            (98.1, 0.1),
        ] {
            let (first, _) = faulty(|t| if t < 10.0 { 9.81 } else { level });
            let after_s = first.unwrap() - 10.0;
            assert!((0.0..at_most_s).contains(&after_s), "{level}: {after_s}");
        }
    }

    #[test]
    fn it_is_trusted_again_when_it_is_back() {
        let (first, last) = faulty(|t| {
            if (10.0..15.0).contains(&t) {
                20.0
            } else {
                9.81
            }
        });
        assert!(first.is_some());
        assert!((15.0..19.0).contains(&last.unwrap()), "{last:?}");
    }

    /// A level that takes seconds to be found anew is not believed for that long after a restart, and a good one is not
    /// doubted for longer than it was off.
    #[test]
    fn what_was_off_before_is_off_from_the_first_sample_on_until_it_is_back() {
        let mut before = WeightWatch::new(9.81);
        let watched = |watch: &mut WeightWatch, force: f64, step: i64| {
            watch.check(
                step * 10_000_000,
                &[force, 0.0, 0.0],
                &Limits::OF_TESTS,
                &mut |_| (),
            )
        };
        for step in 0..500 {
            watched(&mut before, 13.0, step);
        }
        let beyond = before.beyond().unwrap();
        let mut still_off = WeightWatch::new(9.81);
        still_off.remember(beyond);
        assert!((0..1000).all(|step| !watched(&mut still_off, 13.0, step)));
        let mut mended = WeightWatch::new(9.81);
        mended.remember(beyond);
        let doubted = (0..1000).filter(|&step| !watched(&mut mended, 9.81, step));
        assert!((1..400).contains(&doubted.count()));
        assert_eq!(mended.beyond(), None);
        still_off.trust();
        assert_eq!(still_off.beyond(), None);
        assert!(watched(&mut still_off, 9.81, 1001));
    }

    #[test]
    fn what_machines_do_is_credible() {
        // vibration, hard braking, a fall of three metres with its impact
        assert_eq!(faulty(|t| 9.81 + 8.0 * (200.0 * t).sin()), (None, None));
        assert_eq!(faulty(|_| 9.81_f64.hypot(4.0)), (None, None));
        let falls = |t: f64| match t {
            t if t < 5.0 => 9.81,
            t if t < 5.75 => 0.0,
            t if t < 5.95 => 9.81 + 7.4 / 0.2,
            _ => 9.81,
        };
        assert_eq!(faulty(falls), (None, None));
    }
}
