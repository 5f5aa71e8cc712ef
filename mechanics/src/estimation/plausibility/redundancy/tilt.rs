//! The IMU's attitude compared with that of the odometry: both measure how the machine stands on the slope.
//!
//! ```text
//!     angle between R_imu' z and R_odo' z, both in base axes, averaged over a second
//! ```
//! An odometry that takes its attitude from the same IMU agrees with it, and shows nothing. Headings are not
//! compared: they count from different origins.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::super::notice::{Found, Limits};
use super::lasting::LastingDifference;
use super::low_pass::{LowPass, share};

/// Averaging time (s).
const AVERAGED_S: f64 = 1.0;
/// Time for which the difference must last (s).
const LASTING_S: f64 = 1.0;

/// State of the check.
#[derive(Debug, Clone)]
pub(in super::super) struct TiltWatch {
    /// Up direction by the odometry (base axes), and its stamp.
    odometry: Option<(i64, Vector3<f64>)>,
    imu: LowPass<3>,
    smoothed_odometry: LowPass<3>,
    last_ns: Option<i64>,
    apart: LastingDifference,
}

impl TiltWatch {
    /// Tolerance in radians.
    pub(in super::super) fn new(tolerance: f64) -> Self {
        Self {
            odometry: None,
            imu: LowPass::new(AVERAGED_S),
            smoothed_odometry: LowPass::new(AVERAGED_S),
            last_ns: None,
            apart: LastingDifference::new(tolerance, LASTING_S),
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
            self.apart.reset();
            return;
        };
        let share = share(step_s, AVERAGED_S);
        let up = self.imu.step_by(share, up);
        let other = self.smoothed_odometry.step_by(share, &other);
        let apart = up.cross(&other).norm().atan2(up.dot(&other));
        self.apart.check(stamp_ns, apart, limits, found);
    }
}

/// Up direction in the axes of a body with this orientation; `None` where that is not finite.
pub(in super::super) fn up_direction(xyzw: &[f64]) -> Option<Vector3<f64>> {
    let &[x, y, z, w] = xyzw else { return None };
    let attitude = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.1)?;
    let up = attitude.inverse_transform_vector(&Vector3::z());
    up.iter().all(|v| v.is_finite()).then_some(up)
}
