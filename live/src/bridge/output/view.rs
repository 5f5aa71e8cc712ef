//! The verdict as everything outside is to see it.

use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::verdict::{Basis, Level};

use crate::wire::names::Names;
use crate::wire::topics::WireVerdict;

/// The verdict at a moment.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// The last verdict; `None` if there is none, or if it has expired.
    pub verdict: Option<&'a WireVerdict>,
    /// Names of machine and wheels.
    pub names: &'a Names,
    /// The current time (ns), by CLOCK_MONOTONIC.
    pub now_ns: i64,
}

impl View<'_> {
    /// The level to act on: a fault without a current verdict.
    #[must_use]
    pub fn level(&self) -> Level {
        self.verdict
            .map_or(Level::Fault, |verdict| verdict.verdict().latched_level)
    }

    /// The momentary level.
    #[must_use]
    pub fn momentary(&self) -> Level {
        self.verdict
            .map_or(Level::Fault, |verdict| verdict.verdict().level)
    }

    /// Returns the evidence behind the level: doubted without a current verdict.
    #[must_use]
    pub fn basis(&self) -> Basis {
        self.verdict
            .map_or(Basis::Doubted, |verdict| verdict.verdict().basis)
    }

    /// A number of the verdict; NaN where it is unknown.
    #[must_use]
    pub fn number(&self, quantity: Quantity) -> f64 {
        let number = self.verdict.and_then(|verdict| verdict.number(quantity));
        number.unwrap_or(f64::NAN)
    }

    /// The wheel with the smallest overturning force, and that force (N).
    #[must_use]
    pub fn worst_wheel(&self) -> Option<(usize, f64)> {
        let wheels = 0..self.verdict?.wheel_count as usize;
        let forces = wheels.map(|wheel| (wheel, self.number(Quantity::Otf(wheel))));
        forces
            .filter(|(_, force)| force.is_finite())
            .min_by(|(_, a), (_, b)| a.total_cmp(b))
    }

    /// The name of a wheel.
    #[must_use]
    pub fn wheel_name(&self, wheel: usize) -> &str {
        self.names.wheels.get(wheel).map_or("", String::as_str)
    }

    /// Time to lift-off (s); NaN if none is near.
    #[must_use]
    pub fn time_to_lift_off_s(&self) -> f64 {
        self.verdict
            .map_or(f64::NAN, |verdict| verdict.time_to_lift_off_s)
    }
}
