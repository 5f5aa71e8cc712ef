//! What the checks share: their limits, and how they report a fault.

use super::fault::{Amount, Component};
use crate::machine::FaultKind;

/// Settings shared by all checks.
#[derive(Debug, Clone)]
pub(super) struct Limits {
    pub(super) max_gap_s: f64,
    pub(super) frozen_samples: u32,
    pub(super) quaternion_tolerance: f64,
    pub(super) rate_tolerance_share: f64,
}

impl Limits {
    #[cfg(test)]
    pub(super) const OF_TESTS: Self = Self {
        max_gap_s: 0.25,
        frozen_samples: 100,
        quaternion_tolerance: 0.01,
        rate_tolerance_share: 0.2,
    };

    pub(super) fn elapsed_s(&self, from_ns: i64, to_ns: i64) -> f64 {
        to_ns.saturating_sub(from_ns) as f64 * 1e-9
    }
}

/// A fault as reported by a check, before it is assigned to a part.
pub(super) struct Notice {
    pub(super) kind: FaultKind,
    pub(super) component: Component,
    pub(super) since_ns: i64,
    pub(super) measure: f64,
    pub(super) limit: f64,
    pub(super) amount: Amount,
}

impl Notice {
    pub(super) fn not_finite(stamp_ns: i64, component: Component) -> Self {
        Self {
            kind: FaultKind::NotFinite,
            component,
            since_ns: stamp_ns,
            measure: 1.0,
            limit: f64::NAN,
            amount: Amount::default(),
        }
    }
}

pub(super) type Found<'f> = dyn FnMut(Notice) + 'f;
