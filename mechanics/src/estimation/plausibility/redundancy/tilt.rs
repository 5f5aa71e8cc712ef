//! The IMU's attitude compared with that of the odometry: both measure how the machine stands on the slope.
//!
//! ```text
//!     angle between R_imu' z and R_odo' z, both in base axes, averaged over a second
//! ```
//! An odometry that takes its attitude from the same IMU agrees with it, and shows nothing. Headings are not
//! compared: they count from different origins.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::super::fault::{Amount, Component};
use super::super::notice::{Found, Limits, Notice};
use super::low_pass::LowPass;
use crate::machine::FaultKind;

/// Averaging time (s).
const AVERAGED_S: f64 = 1.0;
/// Time for which the difference must last (s).
const LASTING_S: f64 = 1.0;

/// State of the check.
#[derive(Debug, Clone)]
pub(in super::super) struct TiltWatch {
    tolerance: f64,
    /// Up direction by the odometry (base axes), and its stamp.
    odometry: Option<(i64, Vector3<f64>)>,
    imu: LowPass<3>,
    smoothed_odometry: LowPass<3>,
    last_ns: Option<i64>,
    apart_since_ns: Option<i64>,
}

impl TiltWatch {
    /// Tolerance in radians.
    pub(in super::super) fn new(tolerance: f64) -> Self {
        Self {
            tolerance,
            odometry: None,
            imu: LowPass::new(AVERAGED_S),
            smoothed_odometry: LowPass::new(AVERAGED_S),
            last_ns: None,
            apart_since_ns: None,
        }
    }

    /// Takes the attitude of the odometry, unit quaternion x y z w.
    pub(in super::super) fn take_odometry(&mut self, stamp_ns: i64, xyzw: &[f64]) {
        self.odometry = up_direction(xyzw).map(|up| (stamp_ns, up));
    }

    /// Reports to `found` if the IMU's up direction (base axes) differs.
    pub(in super::super) fn check(
        &mut self,
        stamp_ns: i64,
        up: &Vector3<f64>,
        limits: &Limits,
        found: &mut Found<'_>,
    ) {
        let step_s = (self.last_ns.replace(stamp_ns))
            .map_or(0.0, |last_ns| limits.elapsed_s(last_ns, stamp_ns));
        let fresh = self
            .odometry
            .filter(|(at, _)| limits.elapsed_s(*at, stamp_ns).abs() <= limits.max_gap_s);
        let Some((_, other)) = fresh.filter(|_| step_s <= limits.max_gap_s) else {
            self.imu.reset();
            self.smoothed_odometry.reset();
            self.apart_since_ns = None;
            return;
        };
        let up = self.imu.step(step_s, up);
        let other = self.smoothed_odometry.step(step_s, &other);
        let apart = up.cross(&other).norm().atan2(up.dot(&other));
        // Written so that NaN is no difference.
        if !(apart > self.tolerance) {
            self.apart_since_ns = None;
            return;
        }
        let since_ns = *self.apart_since_ns.get_or_insert(stamp_ns);
        if limits.elapsed_s(since_ns, stamp_ns) >= LASTING_S {
            found(Notice {
                kind: FaultKind::Contradiction,
                component: Component::Value,
                since_ns,
                measure: apart,
                limit: self.tolerance,
                amount: Amount::default(),
            });
        }
    }
}

/// Up direction in the axes of a body with this orientation; `None` where that is not finite.
pub(in super::super) fn up_direction(xyzw: &[f64]) -> Option<Vector3<f64>> {
    let &[x, y, z, w] = xyzw else { return None };
    let attitude = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.1)?;
    let up = attitude.inverse_transform_vector(&Vector3::z());
    up.iter().all(|v| v.is_finite()).then_some(up)
}
