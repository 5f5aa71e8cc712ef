//! The angular velocity about the vertical compared with odometry, with the speeds of the wheels and with the steering;
//! and the direction of travel by the wheels with that by the odometry.
//!
//! ```text
//!     a, b: turned by the gyro and by the other, over the last T seconds
//!     |a - b| > tolerance + share max(|a|, |b|)
//! ```
//! Wheels slip, and the odometry may rest on them. So the share is large: signs, stuck values and gross scales are found.
//! A machine without steered wheels skids: it turns by any part of what the speeds of its wheels say, and so does an
//! odometry that rests on them; only
//! ```text
//!     distance of a from [0, b] > tolerance + share |a|
//! ```
//! contradicts: the opposite direction, or more than the wheels say.

use nalgebra::Vector1;

use super::super::fault::YawBy;
use super::super::notice::{Found, Limits, Notice};
use super::lasting::LastingDifference;
use super::leaky::{LeakyIntegral, opposition};
use super::low_pass::left;
use super::rolling::Rolled;

/// Time of the comparison T (s).
pub(super) const COMPARED_S: f64 = 3.0;
/// Time for which the difference must last (s).
const LASTING_S: f64 = 0.5;
/// Tolerance (rad), beside a share of the rotation.
const TOLERANCE: f64 = 0.2;
const SHARE: f64 = 0.5;
/// Distance that wheels and odometry must have gone in opposite directions (m).
const OPPOSITE: f64 = 0.6;

/// State of the checks.
#[derive(Debug, Clone)]
pub(in super::super) struct YawWatch {
    /// The last angular velocity by odometry (rad/s) and motion by the wheels, with their stamps.
    odometry: Option<(i64, f64)>,
    rolled: Option<(i64, Rolled)>,
    others: [Other; 3],
    /// Whether the machine has no steered wheel.
    skids: bool,
    last_ns: Option<i64>,
    travel: Opposition,
}

/// Comparison of the gyro with one other.
#[derive(Debug, Clone)]
struct Other {
    by: YawBy,
    gyro: LeakyIntegral<1>,
    other: LeakyIntegral<1>,
    apart: LastingDifference,
}

/// Comparison of the direction of travel.
#[derive(Debug, Clone)]
struct Opposition {
    /// Velocity by the odometry, and by the wheels at its last sample (m/s).
    wheels: LeakyIntegral<1>,
    odometry: LeakyIntegral<1>,
    last_ns: Option<i64>,
    apart: LastingDifference,
}

impl YawWatch {
    /// `skids`: no wheel of the machine is steered.
    pub(in super::super) fn new(skids: bool) -> Self {
        let other = |by| Other {
            by,
            gyro: LeakyIntegral::new(),
            other: LeakyIntegral::new(),
            apart: LastingDifference::new(0.0, LASTING_S),
        };
        Self {
            odometry: None,
            rolled: None,
            others: [YawBy::Odometry, YawBy::Speeds, YawBy::Steering].map(other),
            skids,
            last_ns: None,
            travel: Opposition {
                wheels: LeakyIntegral::new(),
                odometry: LeakyIntegral::new(),
                last_ns: None,
                apart: LastingDifference::new(OPPOSITE, LASTING_S),
            },
        }
    }

    /// Takes the motion by the wheels; `None`: it is not known.
    pub(in super::super) fn take_wheels(&mut self, stamp_ns: i64, rolled: Option<Rolled>) {
        self.rolled = rolled.map(|rolled| (stamp_ns, rolled));
    }

    /// Takes the angular velocity about the vertical by the odometry (rad/s).
    pub(in super::super) fn take_odometry(&mut self, stamp_ns: i64, turning: f64) {
        self.odometry = turning.is_finite().then_some((stamp_ns, turning));
    }

    /// Reports to `found` if the angular velocity about the vertical (rad/s, base axes) differs from another.
    pub(in super::super) fn check(
        &mut self,
        stamp_ns: i64,
        turning: f64,
        limits: &Limits,
        found: &mut dyn FnMut(YawBy, Notice),
    ) {
        let step_s = (self.last_ns.replace(stamp_ns))
            .map_or(0.0, |last_ns| limits.elapsed_s(last_ns, stamp_ns));
        let is_fresh = |at: i64| limits.elapsed_s(at, stamp_ns).abs() <= limits.max_gap_s;
        let odometry = self.odometry.filter(|(at, _)| is_fresh(*at));
        let rolled = self.rolled.filter(|(at, _)| is_fresh(*at));
        let left = left(step_s, COMPARED_S);
        for it in &mut self.others {
            let other = match it.by {
                YawBy::Odometry => odometry.map(|(_, turning)| turning),
                YawBy::Speeds => rolled.and_then(|(_, rolled)| rolled.by_speeds),
                YawBy::Steering => rolled.and_then(|(_, rolled)| rolled.by_steering),
            };
            let Some(other) = other.filter(|_| step_s <= limits.max_gap_s) else {
                it.gyro.reset();
                it.other.reset();
                it.apart.reset();
                continue;
            };
            it.gyro.add(left, &Vector1::new(turning * step_s));
            it.other.add(left, &Vector1::new(other * step_s));
            let (a, b) = (it.gyro.value.x, it.other.value.x);
            let by = it.by;
            let skids = self.skids && by != YawBy::Steering;
            let (apart, scale) = match skids {
                true => ((a - a.clamp(b.min(0.0), b.max(0.0))).abs(), a.abs()),
                false => ((a - b).abs(), a.abs().max(b.abs())),
            };
            let tolerance = TOLERANCE + SHARE * scale;
            it.apart
                .check_beyond(stamp_ns, apart, tolerance, limits, &mut |notice| {
                    found(by, notice);
                });
        }
    }

    /// Reports to `found` if the odometry goes forward (m/s, base axes) while the wheels roll backward, or the reverse.
    pub(in super::super) fn check_travel(
        &mut self,
        stamp_ns: i64,
        forward: f64,
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        let it = &mut self.travel;
        let step_s = (it.last_ns.replace(stamp_ns))
            .map_or(0.0, |last_ns| limits.elapsed_s(last_ns, stamp_ns));
        let is_fresh = |at: i64| limits.elapsed_s(at, stamp_ns).abs() <= limits.max_gap_s;
        let rolled = self
            .rolled
            .filter(|(at, _)| is_fresh(*at) && step_s <= limits.max_gap_s);
        let Some((_, rolled)) = rolled else {
            it.wheels.reset();
            it.odometry.reset();
            it.apart.reset();
            return;
        };
        let left = left(step_s, COMPARED_S);
        it.wheels.add(left, &Vector1::new(rolled.speed * step_s));
        it.odometry.add(left, &Vector1::new(forward * step_s));
        let (a, b) = (it.wheels.value.x, it.odometry.value.x);
        let opposite = opposition(a, b);
        it.apart.check(stamp_ns, opposite, limits, found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits::OF_TESTS;

    /// What is reported, and when first (s), in 20 s at 100 Hz of curves to both sides.
    fn found(gyro: f64, odometry: f64, speeds: f64, steering: f64) -> Vec<(YawBy, f64)> {
        found_on(false, gyro, odometry, speeds, steering)
    }

    /// The same on a machine that skids, or that is steered.
    fn found_on(
        skids: bool,
        gyro: f64,
        odometry: f64,
        speeds: f64,
        steering: f64,
    ) -> Vec<(YawBy, f64)> {
        let (mut watch, mut all) = (YawWatch::new(skids), Vec::<(YawBy, f64)>::new());
        for step in 0..2000_i64 {
            let (stamp_ns, time_s) = (step * 10_000_000, step as f64 * 0.01);
            let turning = 0.4 * (0.7 * time_s).sin();
            let rolled = Rolled {
                speed: 1.0,
                by_speeds: Some(speeds * turning),
                by_steering: Some(steering * turning),
            };
            watch.take_wheels(stamp_ns, Some(rolled));
            watch.take_odometry(stamp_ns, odometry * turning);
            watch.check(stamp_ns, gyro * turning, &LIMITS, &mut |by, _| {
                if all.iter().all(|(known, _)| *known != by) {
                    all.push((by, time_s));
                }
            });
        }
        all
    }

    #[test]
    fn slip_is_no_contradiction() {
        let found = found(1.0, 0.9, 1.8, 0.6);
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn a_machine_that_skids_turns_by_any_part_of_what_its_wheels_say() {
        for said in [1.0, 2.0, 4.0, 8.0] {
            assert_eq!(found_on(true, 1.0, 1.0, said, 1.0), []);
            // An odometry that rests on these wheels.
            assert_eq!(found_on(true, 1.0, said, said, 1.0), []);
            assert_eq!(found_on(true, 0.05, said, said, 0.05), []);
        }
        for said in [-4.0, -1.0] {
            let found = found_on(true, 1.0, 1.0, said, 1.0);
            assert!(
                matches!(found[..], [(YawBy::Speeds, _)]),
                "{said}: {found:?}"
            );
        }
    }

    #[test]
    fn each_wrong_sign_is_found_by_itself() {
        for (signs, by) in [
            ([-1.0, 1.0, 1.0], YawBy::Odometry),
            ([1.0, -1.0, 1.0], YawBy::Speeds),
            ([1.0, 1.0, -1.0], YawBy::Steering),
        ] {
            let [odometry, speeds, steering] = signs;
            let found = found(1.0, odometry, speeds, steering);
            assert!(
                matches!(found[..], [(which, s)] if which == by && s < 3.0),
                "{found:?}"
            );
        }
        assert_eq!(found(-1.0, 1.0, 1.0, 1.0).len(), 3);
        assert_eq!(found(0.0, 1.0, 1.0, 1.0).len(), 3);
    }

    #[test]
    fn opposite_directions_are_found_and_locked_wheels_are_not() {
        let opposite_s = |wheels: fn(f64) -> f64| {
            let mut watch = YawWatch::new(false);
            (0..1000_i64).find_map(|step| {
                let (stamp_ns, time_s) = (step * 10_000_000, step as f64 * 0.01);
                let rolled = Rolled {
                    speed: wheels(time_s),
                    by_speeds: None,
                    by_steering: None,
                };
                watch.take_wheels(stamp_ns, Some(rolled));
                let mut at_s = None;
                watch.check_travel(stamp_ns, 1.0, &LIMITS, &mut |_| at_s = Some(time_s));
                at_s
            })
        };
        assert_eq!(opposite_s(|_| 1.0), None);
        assert_eq!(opposite_s(|_| 0.0), None);
        assert!(opposite_s(|_| -1.0).is_some_and(|s| s < 1.5));
    }
}
