//! Plausibility checks of an orientation.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::fault::Component;
use super::freeze::Freeze;
use super::notice::{Found, Limits, Notice};
use super::outliers::Outliers;
use crate::machine::FaultKind;

/// State of the checks of one orientation.
#[derive(Debug, Clone)]
pub(super) struct AttitudeWatch {
    was_given: bool,
    freeze: Freeze,
    /// Of its up direction.
    outliers: Outliers<3>,
    last_ns: Option<i64>,
}

/// Change of the inclination between two samples that does no harm (rad).
const HARMLESS_TILT: f64 = 0.05;

impl AttitudeWatch {
    pub(super) fn new() -> Self {
        Self {
            was_given: false,
            freeze: Freeze::new(),
            outliers: Outliers::new(HARMLESS_TILT),
            last_ns: None,
        }
    }

    /// Reports faults of a quaternion to `found` and returns whether it is present and credible. If it is NaN or
    /// zero from the start, the sensor has no orientation.
    pub(super) fn check(
        &mut self,
        stamp_ns: i64,
        xyzw: &[f64],
        turns: bool,
        limits: &Limits,
        found: &mut Found<'_>,
    ) -> bool {
        if !xyzw.iter().all(|v| v.is_finite()) {
            let is_absent = !self.was_given && xyzw.iter().all(|v| v.is_nan());
            if !is_absent {
                found(Notice::not_finite(stamp_ns, Component::Value));
            }
            return false;
        }
        let length = xyzw.iter().map(|v| v * v).sum::<f64>().sqrt();
        if length == 0.0 && !self.was_given {
            return false;
        }
        self.was_given = true;
        let excess = (length - 1.0).abs();
        if excess > limits.quaternion_tolerance {
            found(
                Notice::of(FaultKind::NotUnit, stamp_ns)
                    .measured(length, 1.0)
                    .amount(excess, 0.0),
            );
            return false;
        }
        let last_ns = self.last_ns.replace(stamp_ns);
        if last_ns.is_some_and(|last_ns| limits.elapsed_s(last_ns, stamp_ns) > limits.max_gap_s) {
            self.outliers.restart();
        }
        if let Some(up) = up_direction(xyzw)
            && let Some(notice) = self.outliers.notice(stamp_ns, up.into(), Component::Value)
        {
            found(notice);
            return false;
        }
        if let Some(notice) = self.freeze.notice(stamp_ns, xyzw, turns, limits) {
            found(notice);
        }
        true
    }
}

/// Up direction in the axes of a body with this orientation; `None` where that is not finite.
pub(super) fn up_direction(xyzw: &[f64]) -> Option<Vector3<f64>> {
    let &[x, y, z, w] = xyzw else { return None };
    let attitude = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.1)?;
    let up = attitude.inverse_transform_vector(&Vector3::z());
    up.iter().all(|v| v.is_finite()).then_some(up)
}
