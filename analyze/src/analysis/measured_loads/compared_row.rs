//! A row at which measured and computed loads are compared.

/// A compared row.
#[derive(Debug, Clone)]
pub struct ComparedRow {
    /// Its index.
    pub row: usize,
    /// Its time (ns).
    pub time_ns: i64,
    /// Index of the set of supports on the ground.
    pub(super) set: Option<usize>,
    /// Measured load by sensor (N); NaN where there is none.
    pub measured: Vec<f64>,
    /// Computed load by sensor (N).
    pub computed: Vec<f64>,
    /// Standard deviation of the computed load by sensor (N).
    pub sigma: Vec<f64>,
    /// How far measured and computed loads are apart, all sensors together, whatever the split between diagonals:
    /// r' S^-1 r.
    pub(super) distance: f64,
    /// Number of sensors in `distance`.
    pub(super) sensors: usize,
}
