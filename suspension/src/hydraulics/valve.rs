//! Valve law (36), with the saturation and slew rate of a real valve.

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

    /// H(6): moves for `seconds` towards u = k_p (x_r - x), within saturation and slew rate. Closes if a position
    /// (m) is unknown.
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
