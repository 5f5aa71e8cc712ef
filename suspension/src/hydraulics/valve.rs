//! The valve law (36), with what a valve cannot do.

use tipwatch_mechanics::machine::HydraulicParameters;

/// A proportional valve: its opening u, -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Valve {
    opening: f64,
}

impl Valve {
    /// A closed valve.
    #[must_use]
    pub fn closed() -> Self {
        Self { opening: 0.0 }
    }

    /// u: positive fills the piston's side.
    #[must_use]
    pub fn opening(self) -> f64 {
        self.opening
    }

    /// H(6): moves for `seconds` towards u = k_p (x_r - x), no further than all the way open and no faster
    /// than it can. Where a coordinate (m) is unknown it closes.
    #[must_use]
    pub fn follow(
        self,
        parameters: &HydraulicParameters,
        wanted: f64,
        found: f64,
        seconds: f64,
    ) -> Self {
        let error = wanted - found;
        let target = if error.is_finite() {
            (parameters.gain * error).clamp(-1.0, 1.0)
        } else {
            0.0
        };
        let reach = parameters.valve_rate * seconds.max(0.0);
        Self {
            opening: target.clamp(self.opening - reach, self.opening + reach),
        }
    }
}
