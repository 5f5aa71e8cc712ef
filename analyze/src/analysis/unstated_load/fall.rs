//! A rotation about an edge, as the events know it.

/// A time in which the wheels off an edge carried nothing and the platform rotated about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fall {
    /// Index of the edge in the support polygon.
    pub(crate) edge: usize,
    /// Onset of the rotation (ns).
    pub(crate) onset_ns: i64,
    /// Whether the log contains the onset. An older rotation had gone an unknown way before its first row.
    pub(crate) onset_in_log: bool,
    /// Standard deviation of that time (s), if known.
    pub(crate) onset_sigma_s: Option<f64>,
    /// The last row of the rotation (ns).
    pub(crate) until_ns: i64,
}

/// Standard deviation of an onset that states none (s).
const USUAL_SIGMA_S: f64 = 0.1;

impl Fall {
    /// Standard deviation of the onset (s).
    pub(super) fn onset_sigma_s(&self) -> f64 {
        let known = self.onset_sigma_s.filter(|sigma| sigma.is_finite());
        known.unwrap_or(USUAL_SIGMA_S)
    }
}
