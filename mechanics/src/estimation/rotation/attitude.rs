//! The up direction by the attitude, where it measures how the machine tilts.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::gyro::UpSample;
use crate::state::tilt_is_measured;

/// Fastest rotation of a machine (rad/s), and the noise of a sample (rad).
const FASTEST: f64 = 6.0;
const NOISE: f64 = 3.0 * DEGREE;
/// Samples that must agree before an attitude that jumped is taken.
const AGREEING: u32 = 3;
/// Smoothing of the rate (s).
const RATE_S: f64 = 0.15;
/// Rate of a quiet platform (rad/s).
const QUIET_RATE: f64 = 0.7 * DEGREE;
/// Standard deviation of the inclination of a standing and of a moving machine (rad): accelerations mislead attitude filters.
const STANDING: f64 = 0.6 * DEGREE;
const MOVING: f64 = 3.0 * DEGREE;
/// Time after which an attitude whose bits do not change measures nothing (ns).
const FROZEN_NS: i64 = 300_000_000;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// The up direction by the attitude.
#[derive(Debug, Clone)]
pub(super) struct UpByAttitude {
    /// Axes of the sensor in the base.
    base_from_sensor: Matrix3<f64>,
    max_gap_s: f64,
    last: Option<(i64, Vector3<f64>)>,
    /// Up direction of a sample far from the one before, and the number of samples that agree with it.
    jumped: Option<(Vector3<f64>, u32)>,
    rate: Vector3<f64>,
    bits: [u64; 4],
    changed_ns: i64,
}

impl UpByAttitude {
    pub(super) fn new(base_from_sensor: Matrix3<f64>, max_gap_s: f64) -> Self {
        Self {
            base_from_sensor,
            max_gap_s,
            last: None,
            jumped: None,
            rate: Vector3::zeros(),
            bits: [0; 4],
            changed_ns: i64::MIN,
        }
    }

    /// The last up direction, unless it is older than a gap.
    pub(super) fn up(&self, now_ns: i64) -> Option<Vector3<f64>> {
        let (last_ns, up) = self.last?;
        let age_s = now_ns.saturating_sub(last_ns) as f64 * 1e-9;
        (age_s <= self.max_gap_s).then_some(up)
    }

    /// Whether the attitude has repeated the same bits for longer than [`FROZEN_NS`].
    pub(super) fn is_frozen(&self, now_ns: i64) -> bool {
        now_ns.saturating_sub(self.changed_ns) > FROZEN_NS
    }

    /// Takes an orientation, quaternion x y z w.
    pub(super) fn step(
        &mut self,
        stamp_ns: i64,
        xyzw: &[f64],
        speed: Option<f64>,
    ) -> Option<UpSample> {
        let &[x, y, z, w] = xyzw else { return None };
        if !tilt_is_measured(xyzw) || !xyzw.iter().all(|v| v.is_finite()) {
            return None;
        }
        let attitude = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.1)?;
        let up = self.base_from_sensor * attitude.inverse_transform_vector(&Vector3::z());
        let up = up.try_normalize(0.1)?;
        let bits = [x, y, z, w].map(f64::to_bits);
        if std::mem::replace(&mut self.bits, bits) != bits {
            self.changed_ns = stamp_ns;
        }
        let Some((last_ns, before)) = self.last else {
            self.last = Some((stamp_ns, up));
            return None;
        };
        if stamp_ns <= last_ns {
            return None;
        }
        let dt = stamp_ns.saturating_sub(last_ns) as f64 * 1e-9;
        if angle(&before, &up) > FASTEST * dt + NOISE {
            let agreeing = match self.jumped {
                Some((to, agreeing)) if angle(&to, &up) < FASTEST * dt + NOISE => agreeing + 1,
                _ => 1,
            };
            self.jumped = Some((up, agreeing));
            if agreeing < AGREEING {
                return None;
            }
        }
        self.jumped = None;
        self.last = Some((stamp_ns, up));
        let share = 1.0 - (-dt / RATE_S).exp();
        self.rate += (-before.cross(&up) / dt - self.rate) * share;
        Some(UpSample {
            dt,
            up,
            sigma: if speed == Some(0.0) { STANDING } else { MOVING },
            rate: self.rate,
            is_quiet: speed == Some(0.0) && self.rate.norm() < QUIET_RATE,
        })
    }
}

fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}
