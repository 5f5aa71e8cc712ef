//! `[identified]`: parameters corrected by an identification, with their joint uncertainty.
//!
//! With the prior standard deviations d of the parameters, and orthogonal directions v_k in the space of the parameters
//! divided by d, their covariance after the identification is
//! ```text
//!     P = D (I - sum over k of s_k v_k v_k') D,      D = diag(d),      0 <= s_k < 1
//! ```
//! The data removed the share s_k of the variance along v_k. What no direction contains is as uncertain as before.

use nalgebra::Vector3;
use serde::Deserialize;

use super::{Axis, Machine, Parameter, UncertaintySpec, Unknown};
use crate::geometry::coordinate::Motion;

/// `[identified]`: written by `tipwatch identify`.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IdentifiedSpec {
    /// What was identified from, for the reader.
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

    /// The parts of the variance of a number with these derivatives (in the order of `parameters`, those of
    /// [`Parameter::all`]) that come from the identified parameters, correlations included: they can be negative. `None`
    /// for the other parameters.
    #[must_use]
    pub fn variance_parts(
        &self,
        machine: &Machine,
        parameters: &[Parameter],
        derivatives: &[f64],
    ) -> Vec<Option<f64>> {
        let in_bands = |unknown: Unknown| f64::from(u8::from(Self::is_in_bands(unknown)));
        // D d
        let scaled: Vec<f64> = (self.unknowns.iter().zip(&self.prior_sigma))
            .map(|(unknown, sigma)| {
                let by = unknown.derivative(machine, parameters, derivatives);
                by * sigma * in_bands(*unknown)
            })
            .collect();
        let mut left = scaled.clone();
        for direction in &self.directions {
            let pairs = direction.weights.iter().zip(&scaled);
            let along = direction.share * pairs.map(|(weight, by)| weight * by).sum::<f64>();
            let pairs = left.iter_mut().zip(&direction.weights);
            pairs.for_each(|(left, weight)| *left -= along * weight);
        }
        let mut parts = vec![None; parameters.len()];
        let unknowns = self.unknowns.iter().enumerate();
        for (place, unknown) in unknowns.filter(|(_, unknown)| Self::is_in_bands(**unknown)) {
            for (parameter, factor) in unknown.changes(machine, self.prior_sigma[place]) {
                if let Some(index) = parameters.iter().position(|known| *known == parameter) {
                    parts[index] = Some(derivatives[index] * factor * left[place]);
                }
            }
        }
        parts
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
            directions: (self.directions.iter())
                .map(|direction| IdentifiedDirection {
                    share: direction.share,
                    weights: of(&direction.weights),
                })
                .collect(),
        }
    }
}

/// Constant errors of sensors, to be added to what they measure.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct SensorCorrections {
    /// By joint (rad or m).
    pub(crate) position: Vec<f64>,
    /// By axis of the IMU (m/s^2).
    pub(crate) specific_force: [f64; 3],
    /// By axis of the IMU (rad/s).
    pub(crate) angular_velocity: [f64; 3],
}

impl SensorCorrections {
    /// Of a machine with these changes.
    pub(crate) fn of(machine: &Machine, changes: &[(Parameter, f64)]) -> Self {
        let mut found = Self {
            position: vec![0.0; machine.joints.len()],
            ..Self::default()
        };
        for &(parameter, change) in changes {
            match parameter {
                Parameter::JointPosition(joint) => found.position[joint] += change,
                Parameter::SpecificForce(axis) => found.specific_force[axis as usize] += change,
                Parameter::AngularVelocity(axis) => found.angular_velocity[axis as usize] += change,
                _ => {}
            }
        }
        found
    }
}

impl Machine {
    /// What an identification told of it.
    #[must_use]
    pub fn identified(&self) -> Option<&Identified> {
        self.identified.as_ref()
    }

    /// What encoders show (rad or m, in the order of [`Machine::joints`]), with the identified errors of their zeros
    /// corrected.
    pub fn correct_positions(&self, positions: &mut [f64]) {
        if let Some(corrections) = &self.corrections {
            let pairs = positions.iter_mut().zip(&corrections.position);
            pairs.for_each(|(position, correction)| *position += correction);
        }
    }

    /// The same for the motion of the joints.
    pub(crate) fn correct_joints(&self, joints: &mut [Motion<f64>]) {
        if let Some(corrections) = &self.corrections {
            let pairs = joints.iter_mut().zip(&corrections.position);
            pairs.for_each(|(joint, correction)| joint.position += correction);
        }
    }

    /// What the accelerometer shows (m/s^2, in its axes), with its identified bias corrected.
    #[must_use]
    pub fn correct_specific_force(&self, measured: &Vector3<f64>) -> Vector3<f64> {
        let correction = self.corrections.as_ref().map(|by| by.specific_force);
        correction.map_or(*measured, |by| measured + Vector3::from(by))
    }

    /// What the gyro shows (rad/s, in its axes), with its identified bias corrected.
    pub(crate) fn correct_angular_velocity(&self, measured: &Vector3<f64>) -> Vector3<f64> {
        let correction = self.corrections.as_ref().map(|by| by.angular_velocity);
        correction.map_or(*measured, |by| measured + Vector3::from(by))
    }

    /// The same machine with other stated uncertainties.
    #[must_use]
    pub fn with_uncertainty(mut self, uncertainty: UncertaintySpec) -> Self {
        self.uncertainty = uncertainty;
        self
    }

    /// This machine with these parameters changed, and their joint uncertainty. It must not have been identified
    /// before, or `identified` must contain the changes of then.
    #[must_use]
    pub fn with_identified(&self, identified: Identified) -> Self {
        let changes: Vec<(Parameter, f64)> = (identified.unknowns.iter())
            .zip(&identified.change)
            .flat_map(|(unknown, &change)| unknown.changes(self, change))
            .collect();
        let mut changed = self.changed(&changes);
        changed.corrections = Some(SensorCorrections::of(self, &changes));
        let bias = |axis| Unknown::Parameter(Parameter::SpecificForce(axis));
        let worst = Axis::ALL.map(|axis| identified.sigma(bias(axis)));
        if let [Some(x), Some(y), Some(z)] = worst {
            // The estimator of the bias knows one standard deviation for all axes, and its result takes the place of
            // this one. Bands therefore give up the correlations of the bias with other parameters.
            changed.uncertainty.accelerometer_bias = x.max(y).max(z);
        }
        changed.identified = Some(identified);
        changed
    }
}
