//! Measured loads of a row.

use crate::machine::LoadSensor;

/// Measured loads of a row.
#[derive(Clone, Copy)]
pub struct MeasuredRow<'a> {
    /// The load sensors.
    pub sensors: &'a [&'a LoadSensor],
    /// Measured load by sensor (N); NaN where there is none.
    pub loads: &'a [f64],
    /// The force of an actuated joint whose samples are too far apart for the state (N); NaN without one.
    pub held: &'a dyn Fn(usize) -> f64,
    /// Standard deviation of a weighted sum of the computed loads that motion which was not observed adds (N), by the factors.
    pub unobserved: &'a dyn Fn(&[f64]) -> f64,
}

impl std::fmt::Debug for MeasuredRow<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MeasuredRow")
            .field("loads", &self.loads)
            .finish_non_exhaustive()
    }
}

/// Index, time and supports of a row that is compared.
#[derive(Debug, Clone, Copy)]
pub struct RowPlace {
    /// Its index.
    pub row: usize,
    /// Its time (ns).
    pub time_ns: i64,
    /// Index of the set of supports on the ground; `None` on supports that never change.
    pub set: Option<usize>,
}
