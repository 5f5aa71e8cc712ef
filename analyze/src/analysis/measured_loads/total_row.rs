//! A row at which the total of the measured loads is compared with the computed one.

use super::singles::Acts;

/// A row at which the totals are compared.
#[derive(Debug, Clone)]
pub(super) struct TotalRow {
    pub(super) time_ns: i64,
    /// Index of the set of supports on the ground.
    pub(super) set: Option<usize>,
    /// Measured minus computed total (N).
    pub(super) difference: f64,
    /// Its standard deviation (N).
    pub(super) sigma: f64,
    /// Computed total over mass (m/s^2).
    pub(super) gravity: f64,
    /// Where the difference acts, if every support is measured by itself.
    pub(super) acts: Option<Acts>,
}
