//! Compares weighed loads with the model.

use tipwatch_mechanics::RestingMachine;
use tipwatch_mechanics::machine::{Machine, MeasuredJoint, WeighedSpec};

use super::document::{Posture, Reading, Weighed, posture};
use crate::base::number::known;

/// Largest difference between model and scale that is consistent (standard deviations).
const WITHIN_SIGMAS: f64 = 2.0;

/// Compares weighed loads with the model in the posture of `[weighed]`, else in the displayed one.
pub(super) fn compare(
    machine: &Machine,
    weighed: &WeighedSpec,
    positions: &[f64],
    shown: &Posture,
) -> Weighed {
    let is_stated = !weighed.posture.is_empty();
    let at = |(joint, &shown): (&MeasuredJoint, &f64)| match is_stated {
        true => weighed.posture.get(&joint.name).copied().unwrap_or(0.0),
        false => shown,
    };
    let positions: Vec<f64> = machine.joints().iter().zip(positions).map(at).collect();
    let source = match is_stated {
        true => "posture of [weighed]".into(),
        false => shown.source.clone(),
    };
    let standing = RestingMachine::new(machine, &positions);
    let newtons = weighed.unit.newtons(machine.gravity());
    let single = weighed.wheels.iter().map(|(wheel, &load)| {
        let wheels = vec![wheel.clone()];
        let scale = [load * newtons, weighed.sigma * newtons];
        reading(machine, &standing, wheel.clone(), wheels, scale)
    });
    let sums = weighed.sums.iter().map(|sum| {
        let sigma = sum.sigma.unwrap_or(weighed.sigma);
        let scale = [sum.load * newtons, sigma * newtons];
        reading(machine, &standing, sum.label(), sum.wheels.clone(), scale)
    });
    Weighed {
        readings: single.chain(sums).collect(),
        posture: posture(machine, &positions, source),
    }
}

fn reading(
    machine: &Machine,
    standing: &RestingMachine,
    name: String,
    wheels: Vec<String>,
    [weighed_n, weighed_sigma_n]: [f64; 2],
) -> Reading {
    let index = |name: &String| machine.wheels().iter().position(|w| w.name == *name);
    let indices: Vec<usize> = wheels.iter().filter_map(index).collect();
    let (model, sigma) = standing.load_of(&indices);
    let difference = model - weighed_n;
    let sigmas = known(difference / sigma.hypot(weighed_sigma_n));
    Reading {
        name,
        wheels,
        weighed_n,
        weighed_sigma_n,
        model_n: known(model),
        model_sigma_n: known(sigma),
        difference_n: known(difference),
        difference_percent: known(difference / weighed_n * 100.0),
        sigmas,
        is_within: sigmas.map(|sigmas| sigmas.abs() <= WITHIN_SIGMAS),
    }
}
