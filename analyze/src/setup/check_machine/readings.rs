//! Compares weighed loads with the model.

use tipwatch_mechanics::RestingMachine;
use tipwatch_mechanics::machine::{Machine, WeighedPosture, WeighedSpec};
use tipwatch_mechanics::number::SURE_SIGMAS;

use super::document::{Posture, Reading, Weighed, posture};
use crate::base::number::known;

/// Step of the difference by slope (rad).
const SLOPE_STEP: f64 = 1e-3;

/// Compares every weighing with the model in its posture; a `[weighed]` that states none is compared in the posture under evaluation.
pub(super) fn compare(
    machine: &Machine,
    weighed: &WeighedSpec,
    positions: &[f64],
    shown: &Posture,
) -> Vec<Weighed> {
    let compared = |weighing: &WeighedPosture| {
        let mut source = match (weighing.in_evaluated_posture, weighing.label()) {
            (true, _) => shown.source.clone(),
            (false, "[weighed]") => "posture of [weighed]".into(),
            (false, label) => label.into(),
        };
        if let Some([forward, left]) = weighing.slope {
            source += &format!(", ground rises {forward} rad forward and {left} rad to the left");
        }
        if weighing.slope_unknown {
            source += ", slope unknown";
        }
        let mut stood = weighing.positions(machine.joints(), positions);
        // those under evaluation are corrected where they come from
        if !weighing.in_evaluated_posture {
            machine.correct_positions(&mut stood);
        }
        in_posture(machine, weighed, weighing, stood, source)
    };
    weighed.weighings().iter().map(compared).collect()
}

fn in_posture(
    machine: &Machine,
    weighed: &WeighedSpec,
    weighing: &WeighedPosture,
    positions: Vec<f64>,
    source: String,
) -> Weighed {
    let on = weighing.stands_on(machine.supports());
    // as it stood on the scales; a set on which it cannot stand was refused with the machine file
    let other = match on == machine.stands_on() {
        true => None,
        false => machine.standing_on(&on).ok(),
    };
    let machine = other.as_ref().unwrap_or(machine);
    let slope = weighing.slope.unwrap_or([0.0; 2]);
    let sigma = weighing.slope_uncertainty();
    let tilted = |axis: usize, by: f64| {
        let mut slope = slope;
        slope[axis] += by;
        RestingMachine::on_slope(machine, &positions, slope)
    };
    let standing = match weighing.slope {
        None => RestingMachine::new(machine, &positions),
        Some(slope) => RestingMachine::on_slope(machine, &positions, slope),
    };
    let tilts: Vec<[RestingMachine; 2]> = match sigma > 0.0 {
        true => [0, 1]
            .map(|axis| [-SLOPE_STEP, SLOPE_STEP].map(|by| tilted(axis, by)))
            .into(),
        false => Vec::new(),
    };
    let scene = Scene {
        machine,
        standing: &standing,
        tilts: &tilts,
        slope_sigma: sigma,
    };
    let newtons = weighed.unit.newtons(machine.gravity());
    let usual = weighing.sigma.unwrap_or(weighed.sigma);
    let single = weighing.wheels.iter().map(|(wheel, &load)| {
        let wheels = vec![wheel.clone()];
        let scale = [load * newtons, usual * newtons];
        reading(&scene, wheel.clone(), wheels, scale)
    });
    let sums = weighing.sums.iter().map(|sum| {
        let sigma = sum.sigma.unwrap_or(usual);
        let scale = [sum.load * newtons, sigma * newtons];
        reading(&scene, sum.label(), sum.wheels.clone(), scale)
    });
    Weighed {
        readings: single.chain(sums).collect(),
        posture: posture(machine, &positions, source),
    }
}

/// A machine on the scales.
struct Scene<'a> {
    machine: &'a Machine,
    standing: &'a RestingMachine,
    /// Machine at rest with less and with more slope, along both axes; empty where the slope is known.
    tilts: &'a [[RestingMachine; 2]],
    slope_sigma: f64,
}

fn reading(
    scene: &Scene<'_>,
    name: String,
    wheels: Vec<String>,
    [weighed_n, weighed_sigma_n]: [f64; 2],
) -> Reading {
    let supports = scene.machine.supports();
    let named = wheels.iter().flat_map(|name| supports.named(name));
    let indices: Vec<usize> = named.filter_map(|id| scene.machine.place_of(id)).collect();
    let (model, of_machine) = scene.standing.load_of(&indices);
    let of_slope = scene.tilts.iter().map(|tilts| {
        let [less, more] = tilts.each_ref().map(|tilted| tilted.load_of(&indices).0);
        (more - less) / (2.0 * SLOPE_STEP) * scene.slope_sigma
    });
    let sigma = of_slope.fold(of_machine, f64::hypot);
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
        is_within: sigmas.map(|sigmas| sigmas.abs() <= SURE_SIGMAS),
    }
}
