//! How the machine travels, by its odometry and its wheels.

use nalgebra::Vector3;

use super::low_pass::left;

/// Speed that noise of the odometry may show while the machine stands (m/s).
const STANDING: f64 = 0.04;
/// Speed beyond it from which uneven ground rocks the machine (m/s).
const TRAVELLING: f64 = 0.2;

/// The last known velocity of the base.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct Travel {
    /// Velocity by the odometry (m/s, base axes), and its stamp.
    odometry: Option<(i64, Vector3<f64>)>,
    /// Largest circumferential speed of a wheel (m/s), and its stamp.
    wheels: Option<(i64, f64)>,
}

impl Travel {
    pub(in super::super) fn take_odometry(&mut self, stamp_ns: i64, velocity: Vector3<f64>) {
        self.odometry = Some((stamp_ns, velocity));
    }

    /// Takes the circumferential speed of the fastest wheel (m/s).
    pub(in super::super) fn take_wheels(&mut self, stamp_ns: i64, speed: f64) {
        self.wheels = Some((stamp_ns, speed));
    }

    /// Velocity of the base (m/s, base axes): that of the odometry, or zero where there is none and the wheels stand.
    pub(super) fn velocity(&self, stamp_ns: i64, max_age_s: f64) -> Option<Vector3<f64>> {
        let is_fresh = |at: i64| age_s(at, stamp_ns) <= max_age_s;
        match (self.odometry, self.wheels) {
            (Some((at, velocity)), _) => is_fresh(at).then_some(velocity),
            (None, Some((at, speed))) if is_fresh(at) && speed < STANDING => Some(Vector3::zeros()),
            _ => None,
        }
    }

    /// How much the ground may rock the machine, 0 to 1: by its speed, and 1 where nothing tells it.
    pub(super) fn rocking(&self, stamp_ns: i64, max_age_s: f64) -> f64 {
        let by_odometry = self.odometry.map(|(at, velocity)| (at, velocity.norm()));
        let known = [by_odometry, self.wheels].into_iter().flatten();
        let fresh = known.filter(|(at, _)| age_s(*at, stamp_ns) <= max_age_s);
        let speed = fresh.map(|(_, speed)| speed).reduce(f64::max);
        speed.map_or(1.0, |speed| {
            ((speed - STANDING) / TRAVELLING).clamp(0.0, 1.0)
        })
    }
}

/// How much the ground may still rock a machine that has travelled.
#[derive(Debug, Clone)]
pub(super) struct Rocking {
    lasting_s: f64,
    value: f64,
}

impl Rocking {
    /// It dies away with this time constant.
    pub(super) fn new(lasting_s: f64) -> Self {
        Self {
            lasting_s,
            value: 0.0,
        }
    }

    /// The rocking after a step in which it was `now`; `lasts`: whether what was before it counts.
    pub(super) fn step(&mut self, dt: f64, now: f64, lasts: bool) -> f64 {
        let before = if lasts { self.value } else { 0.0 };
        self.value = now.max(before * left(dt, self.lasting_s));
        self.value
    }
}

fn age_s(at_ns: i64, now_ns: i64) -> f64 {
    now_ns.saturating_sub(at_ns) as f64 * 1e-9
}
