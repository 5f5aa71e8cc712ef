//! How the machine travels, by its odometry and its wheels.

use nalgebra::Vector3;

/// Speed that noise of the odometry may show while the machine stands (m/s).
const STANDING: f64 = 0.04;

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

    /// Speed beyond that of a standing machine (m/s); `None` where nothing tells it.
    pub(super) fn speed(&self, stamp_ns: i64, max_age_s: f64) -> Option<f64> {
        let by_odometry = self.odometry.map(|(at, velocity)| (at, velocity.norm()));
        let known = [by_odometry, self.wheels].into_iter().flatten();
        let fresh = known.filter(|(at, _)| age_s(*at, stamp_ns) <= max_age_s);
        let speed = fresh.map(|(_, speed)| speed).reduce(f64::max)?;
        Some((speed - STANDING).max(0.0))
    }
}

fn age_s(at_ns: i64, now_ns: i64) -> f64 {
    now_ns.saturating_sub(at_ns) as f64 * 1e-9
}
