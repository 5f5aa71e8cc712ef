//! Standard deviation of a weighted sum of loads.

use crate::evaluate::workspace::Workspace;
use crate::explain::uncertainty::SignalPlaces;
use crate::machine::Machine;
use crate::number::{Lanes, Real, Wheels};
use crate::state::State;

/// Standard deviation of a weighted sum of the OTF at the last evaluation of `workspace`, which must have
/// been of `state` with sensitivities in its scope.
#[must_use]
pub fn combination_sigma(
    machine: &Machine,
    state: &State<f64>,
    workspace: &Workspace<f64>,
    factors: &[f64],
) -> f64 {
    let sensitivity = workspace.sensitivity();
    let mut derivatives = vec![0.0; sensitivity.otf(0).len()];
    for (wheel, factor) in factors.iter().enumerate() {
        for (sum, by) in derivatives.iter_mut().zip(sensitivity.otf(wheel)) {
            *sum += factor * by;
        }
    }
    let sigmas = &workspace.sigmas;
    let wheels = machine.wheels.len() as f64;
    let mean_load = workspace.outcome().normal_force * sigmas.model_share / wheels;
    let model: f64 = factors
        .iter()
        .map(|factor| (factor * mean_load).powi(2))
        .sum();
    let each: Vec<Lanes> = derivatives.iter().map(|&by| Lanes::constant(by)).collect();
    let signals: f64 = SignalPlaces::of(machine).variance(&each, state).wheel(0);
    let split = workspace.measured_split_variance(factors);
    (sigmas.variance::<f64>(&derivatives) + signals + model + split).sqrt()
}
