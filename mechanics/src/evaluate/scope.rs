//! How much an evaluation computes.

/// What an evaluation computes beside the loads, their envelope and the centre of pressure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Scope {
    /// Every other measure of stability.
    pub indicators: bool,
    /// What causes each wheel's load.
    pub causes: bool,
    /// The share of every link in each wheel's load.
    pub parts: bool,
    /// Derivatives by every signal and parameter, and the uncertainty that follows from them.
    pub sensitivities: bool,
    /// Terms and wheel travel of the analytic model, where that is the model.
    pub terms: bool,
}

impl Scope {
    /// The loads alone.
    pub const LOADS: Self = Self {
        indicators: false,
        causes: false,
        parts: false,
        sensitivities: false,
        terms: false,
    };

    /// Everything but the parts by link.
    pub const ALL: Self = Self {
        indicators: true,
        causes: true,
        parts: false,
        sensitivities: true,
        terms: false,
    };

    pub(crate) fn needs_groups(self) -> bool {
        self.indicators || self.needs_influences()
    }

    pub(crate) fn needs_influences(self) -> bool {
        self.causes || self.parts || self.sensitivities
    }
}
