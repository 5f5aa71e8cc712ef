//! The estimate of a filter at a given time.

use super::white_jerk::Matrix;

/// Whether a filter's estimate is valid at a given time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FilterStatus {
    Known,
    Settling,
    Unknown,
}

/// A filter's estimate at a given time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reading {
    pub(super) standing: FilterStatus,
    /// Covariance of a channel's derivatives, shared by all channels; zero where nothing is measured.
    pub(super) covariance: Matrix,
}

impl Reading {
    pub(super) const NOTHING: Self = Self {
        standing: FilterStatus::Unknown,
        covariance: [[0.0; 3]; 3],
    };
}
