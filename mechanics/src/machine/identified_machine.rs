//! A machine with identified parameters: its values, the corrections of its sensors, and the variance that is left.

use nalgebra::Vector3;

use super::identified::{Identified, SensorCorrections};
use super::{Axis, Machine, Parameter, UncertaintySpec, Unknown};
use crate::geometry::coordinate::Motion;

impl Identified {
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
}

impl SensorCorrections {
    /// Returns the corrections of a machine with these changes.
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
    /// Returns the result of an identification; `None` without one.
    #[must_use]
    pub fn identified(&self) -> Option<&Identified> {
        self.identified.as_ref()
    }

    /// Corrects the measured joint positions (rad or m, in the order of [`Machine::joints`]) by the identified errors of the
    /// encoders' zeros.
    pub fn correct_positions(&self, positions: &mut [f64]) {
        if let Some(corrections) = &self.corrections {
            let pairs = positions.iter_mut().zip(&corrections.position);
            pairs.for_each(|(position, correction)| *position += correction);
        }
    }

    /// Corrects the positions in the motion of the joints in the same way.
    pub(crate) fn correct_joints(&self, joints: &mut [Motion<f64>]) {
        if let Some(corrections) = &self.corrections {
            let pairs = joints.iter_mut().zip(&corrections.position);
            pairs.for_each(|(joint, correction)| joint.position += correction);
        }
    }

    /// Returns the measured specific force (m/s^2, in the accelerometer's axes) with the identified bias corrected.
    #[must_use]
    pub fn correct_specific_force(&self, measured: &Vector3<f64>) -> Vector3<f64> {
        let correction = self.corrections.as_ref().map(|by| by.specific_force);
        correction.map_or(*measured, |by| measured + Vector3::from(by))
    }

    /// Returns the measured angular velocity (rad/s, in the gyro's axes) with the identified bias corrected.
    pub(crate) fn correct_angular_velocity(&self, measured: &Vector3<f64>) -> Vector3<f64> {
        let correction = self.corrections.as_ref().map(|by| by.angular_velocity);
        correction.map_or(*measured, |by| measured + Vector3::from(by))
    }

    /// Returns the machine with other stated uncertainties.
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
        let model_share = &mut changed.uncertainty.model_share;
        *model_share = identified.model_share.unwrap_or(0.0).max(*model_share);
        changed.identified = Some(identified);
        changed
    }
}
