//! `[identified]`: parameters corrected by an identification, with their joint uncertainty.
//!
//! With the prior standard deviations d of the parameters, and orthogonal directions v_k in the space of the parameters
//! divided by d, their covariance after the identification is
//! ```text
//!     P = D (I - sum over k of s_k v_k v_k') D,      D = diag(d),      0 <= s_k < 1
//! ```
//! The data removed the share s_k of the variance along v_k. What no direction contains is as uncertain as before.

use serde::Deserialize;

use super::parameter::Parameter;
use super::unknown::Unknown;

/// `[identified]`: written by `tipwatch identify`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IdentifiedSpec {
    /// Sources of the identification, such as logs, for the reader.
    #[serde(default)]
    pub from: Vec<String>,
    /// Names of the parameters.
    pub parameters: Vec<String>,
    /// Value of each parameter in the URDF and the machine file, NaN where only a change is meaningful: those that the
    /// changes belong to.
    pub nominal: Vec<f64>,
    /// Change of each parameter, in its unit.
    pub change: Vec<f64>,
    /// Standard deviation of each before the identification.
    pub prior_sigma: Vec<f64>,
    /// Standard deviation of each after it; it follows from the directions.
    pub sigma: Vec<f64>,
    /// The model share of the bands, where that of `[uncertainty]` is too small for what was measured.
    pub model_share: Option<f64>,
    /// The factor by which the stated standard deviations of what was measured were widened, if they were.
    pub sigma_factor: Option<f64>,
    /// The directions that the data told.
    #[serde(default)]
    pub direction: Vec<IdentifiedDirection>,
}

/// `[[identified.direction]]`: a combination of parameters that the data told.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IdentifiedDirection {
    /// Share of the variance that the data removed, 0 to 1.
    pub share: f64,
    /// Its components by parameter, in prior standard deviations; of length one.
    pub weights: Vec<f64>,
}

/// The identified parameters of a machine.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Identified {
    /// The parameters.
    pub unknowns: Vec<Unknown>,
    /// The change of each, in its unit; part of the machine already.
    pub change: Vec<f64>,
    /// Standard deviation of each before the identification, in its unit.
    pub prior_sigma: Vec<f64>,
    /// The model share of the bands, where the stated one is too small for what was measured.
    pub model_share: Option<f64>,
    /// The factor by which the stated standard deviations of what was measured were widened, if they were.
    pub sigma_factor: Option<f64>,
    /// The directions that the data told.
    pub directions: Vec<IdentifiedDirection>,
}

impl Identified {
    /// Standard deviation of a parameter, in its unit; `None` if it was not identified.
    #[must_use]
    pub fn sigma(&self, unknown: Unknown) -> Option<f64> {
        let place = self.unknowns.iter().position(|&known| known == unknown)?;
        Some(self.covariance(place, place).max(0.0).sqrt())
    }

    /// Correlation of two parameters, by their places.
    #[must_use]
    pub fn correlation(&self, a: usize, b: usize) -> f64 {
        let variance = |place| self.covariance(place, place).max(f64::MIN_POSITIVE);
        self.covariance(a, b) / (variance(a) * variance(b)).sqrt()
    }

    fn covariance(&self, a: usize, b: usize) -> f64 {
        let removed = self.directions.iter();
        let removed: f64 = removed.map(|v| v.share * v.weights[a] * v.weights[b]).sum();
        let own = f64::from(u8::from(a == b));
        self.prior_sigma[a] * self.prior_sigma[b] * (own - removed)
    }

    /// Whether bands take a parameter's uncertainty from here: that of the accelerometer's bias changes from row to row
    /// and is its estimator's.
    #[must_use]
    pub(crate) fn is_in_bands(unknown: Unknown) -> bool {
        !matches!(unknown, Unknown::Parameter(Parameter::SpecificForce(_)))
    }

    /// The covariance of the parameters that remain without some. Their values stay as they are.
    #[must_use]
    pub(crate) fn without(&self, left_out: impl Fn(Unknown) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.unknowns.len())
            .filter(|&place| !left_out(self.unknowns[place]))
            .collect();
        let of = |values: &[f64]| kept.iter().map(|&place| values[place]).collect();
        Self {
            unknowns: kept.iter().map(|&place| self.unknowns[place]).collect(),
            change: of(&self.change),
            prior_sigma: of(&self.prior_sigma),
            model_share: self.model_share,
            sigma_factor: self.sigma_factor,
            directions: (self.directions.iter())
                .map(|direction| IdentifiedDirection {
                    share: direction.share,
                    weights: of(&direction.weights),
                })
                .collect(),
        }
    }
}

/// Constant errors of sensors, to be added to their measurements.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct SensorCorrections {
    /// Corrections of the positions, by joint (rad or m).
    pub(crate) position: Vec<f64>,
    /// Corrections of the specific force, by axis of the IMU (m/s^2).
    pub(crate) specific_force: [f64; 3],
    /// Corrections of the angular velocity, by axis of the IMU (rad/s).
    pub(crate) angular_velocity: [f64; 3],
}
