//! A row at which the total of the measured loads is compared with the computed one.

use super::rows::{EXCESS, shows};
use super::singles::Acts;

/// A row at which the totals are compared.
#[derive(Debug, Clone)]
pub struct TotalRow {
    /// Its time (ns).
    pub time_ns: i64,
    /// Index of the set of supports on the ground.
    pub set: Option<usize>,
    /// Measured minus computed total (N).
    pub difference: f64,
    /// Its standard deviation (N).
    pub sigma: f64,
    /// Computed total over mass (m/s^2).
    pub gravity: f64,
    /// Place of the difference, if every support is measured by itself.
    pub acts: Option<Acts>,
}

impl TotalRow {
    /// Whether measured and computed total are further apart than by chance: by force and both moments where every support is
    /// measured by itself, else by the total alone. `None` for a row without a number.
    #[must_use]
    pub fn is_off(&self) -> Option<bool> {
        let is_off = match &self.acts {
            Some(acts) => acts.distance > 3_f64.sqrt() + EXCESS,
            None => shows(self.difference, self.sigma),
        };
        self.sigma.is_finite().then_some(is_off)
    }
}
