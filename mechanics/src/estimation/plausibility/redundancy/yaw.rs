//! The angular velocity about the vertical compared with odometry, with the speeds of the wheels and with the steering;
//! and the direction of travel by the wheels with that by the odometry.
//!
//! ```text
//!     a, b: turned by the gyro and by the other, over the last T seconds
//!     |a - b| > tolerance + share max(|a|, |b|)
//! ```
//! Wheels slip: a machine that is steered by its wheels' speeds may turn by half of what they say, and the odometry may
//! rest on them. So the share is large: signs, stuck values and gross scales are found.

use nalgebra::Vector1;

use super::super::fault::YawBy;
use super::super::notice::{Found, Limits, Notice};
use super::lasting::LastingDifference;
use super::leaky::LeakyIntegral;
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
    pub(in super::super) fn new() -> Self {
        let other = |by| Other {
            by,
            gyro: LeakyIntegral::new(COMPARED_S),
            other: LeakyIntegral::new(COMPARED_S),
            apart: LastingDifference::new(0.0, LASTING_S),
        };
        Self {
            odometry: None,
            rolled: None,
            others: [YawBy::Odometry, YawBy::Speeds, YawBy::Steering].map(other),
            last_ns: None,
            travel: Opposition {
                wheels: LeakyIntegral::new(COMPARED_S),
                odometry: LeakyIntegral::new(COMPARED_S),
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
            it.gyro.add(step_s, &Vector1::new(turning * step_s));
            it.other.add(step_s, &Vector1::new(other * step_s));
            let (a, b) = (it.gyro.value.x, it.other.value.x);
            let tolerance = TOLERANCE + SHARE * a.abs().max(b.abs());
            let by = it.by;
            it.apart
                .check_beyond(stamp_ns, (a - b).abs(), tolerance, limits, &mut |notice| {
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
        it.wheels.add(step_s, &Vector1::new(rolled.speed * step_s));
        it.odometry.add(step_s, &Vector1::new(forward * step_s));
        let (a, b) = (it.wheels.value.x, it.odometry.value.x);
        let opposite = if a * b < 0.0 {
            a.abs().min(b.abs())
        } else {
            0.0
        };
        it.apart.check(stamp_ns, opposite, limits, found);
    }
}
