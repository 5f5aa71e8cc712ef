//! Plausibility checks of an orientation.

use super::fault::{Amount, Component};
use super::freeze::Freeze;
use super::notice::{Found, Limits, Notice};
use crate::machine::FaultKind;

/// State of the checks of one orientation.
#[derive(Debug, Clone)]
pub(super) struct AttitudeWatch {
    was_given: bool,
    freeze: Freeze,
}

impl AttitudeWatch {
    pub(super) fn new() -> Self {
        Self {
            was_given: false,
            freeze: Freeze::new(),
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
            found(Notice {
                kind: FaultKind::NotUnit,
                component: Component::Value,
                since_ns: stamp_ns,
                measure: length,
                limit: 1.0,
                amount: Amount {
                    value: excess,
                    rate: 0.0,
                },
                explanation: None,
            });
            return false;
        }
        if let Some(notice) = self.freeze.notice(stamp_ns, xyzw, turns, limits) {
            found(notice);
        }
        true
    }
}
