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
    let split = workspace.split_variance(factors);
    (sigmas.variance::<f64>(&derivatives) + signals + model + split).sqrt()
}

/// Returns the standard deviation of a number by the noise of the signals of a state, and its error by their lag, with its sign, from
/// its derivatives by all parameters in their order ([`Parameter::all`](crate::Parameter::all)).
#[must_use]
pub fn signal_errors(machine: &Machine, state: &State<f64>, derivatives: &[f64]) -> [f64; 2] {
    let each: Vec<Lanes> = derivatives.iter().map(|&by| Lanes::constant(by)).collect();
    let places = SignalPlaces::of(machine);
    let behind: f64 = places.behind(&each, state).wheel(0);
    let variance: f64 = places.variance(&each, state).wheel(0);
    [(variance - behind * behind).max(0.0).sqrt(), behind]
}
