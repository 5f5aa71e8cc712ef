//! Scope of an evaluation.

/// Quantities that an evaluation computes in addition to the loads, their envelope and the centre of pressure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Scope {
    /// All other measures of stability.
    pub indicators: bool,
    /// Contributions to each wheel's load.
    pub contributions: bool,
    /// Contribution of every link to each wheel's load.
    pub parts: bool,
    /// Derivatives with respect to every signal and parameter, and the resulting uncertainty.
    pub sensitivities: bool,
    /// Terms and wheel motion of the analytic model, where that model is used.
    pub terms: bool,
    /// Columns for the effect of motion between the rows of a sparse log. An evaluation leaves them unknown.
    pub between_rows: bool,
}

impl Scope {
    /// The loads alone.
    pub const LOADS: Self = Self {
        indicators: false,
        contributions: false,
        parts: false,
        sensitivities: false,
        terms: false,
        between_rows: false,
    };

    /// The loads, their derivatives and the resulting uncertainty.
    pub const LOADS_AND_DERIVATIVES: Self = Self {
        sensitivities: true,
        ..Self::LOADS
    };

    /// Everything except the contributions by link.
    pub const ALL: Self = Self {
        indicators: true,
        contributions: true,
        sensitivities: true,
        ..Self::LOADS
    };

    pub(crate) fn needs_groups(self) -> bool {
        self.indicators || self.needs_influences()
    }

    pub(crate) fn needs_influences(self) -> bool {
        self.contributions || self.parts || self.sensitivities
    }
}
