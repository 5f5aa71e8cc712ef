//! The weighings of the machine file as data.

use tipwatch_identification::{Channel, Data, Instant, Measured, Reading, Situation, Source};
use tipwatch_mechanics::machine::{Machine, WeighedPosture, WeighedSpec};

/// Standard deviation of a scale that states none, as a share of the mean wheel load.
const DEFAULT_SCALE: f64 = 0.005;
/// Standard deviation of a mean specific force that states none (m/s^2).
const DEFAULT_SPECIFIC_FORCE: f64 = 0.01;

/// Adds the weighings to the data. Every reading has an error of its own.
pub(super) fn add(machine: &Machine, weighed: &WeighedSpec, data: &mut Data) {
    for weighing in weighed.weighings() {
        let readings = readings(machine, weighed, &weighing, data);
        data.sources.push(Source {
            name: weighing.label().into(),
            is_log: false,
            instants: vec![Instant {
                time_s: 0.0,
                situation: situation(machine, &weighing),
                readings,
            }],
        });
    }
}

/// Positions as the encoders showed them. Joints that are not listed are at zero, or where they always are.
pub(super) fn positions(machine: &Machine, weighing: &WeighedPosture) -> Vec<f64> {
    let joints = machine.joints().iter();
    joints
        .map(|joint| {
            let stated = weighing.posture.get(&joint.name).copied();
            stated.or(joint.constant).unwrap_or(0.0)
        })
        .collect()
}

fn situation(machine: &Machine, weighing: &WeighedPosture) -> Situation {
    Situation::AtRest {
        positions: positions(machine, weighing),
        slope: weighing.slope.unwrap_or([0.0; 2]),
        slope_sigma: weighing.slope_uncertainty(),
    }
}

fn readings(
    machine: &Machine,
    weighed: &WeighedSpec,
    weighing: &WeighedPosture,
    data: &mut Data,
) -> Vec<Reading> {
    let newtons = weighed.unit.newtons(machine.gravity());
    let mean_load = machine.mass() * machine.gravity() / machine.wheels().len() as f64;
    let index = |name: &String| machine.wheels().iter().position(|w| w.name == *name);
    let usual = weighing.sigma.filter(|sigma| *sigma > 0.0);
    let mut load = |name: String, wheels: &[String], load: f64, sigma: Option<f64>| {
        let sigma = sigma.filter(|sigma| *sigma > 0.0).or(usual);
        let wheels: Vec<usize> = wheels.iter().filter_map(index).collect();
        let default = DEFAULT_SCALE * mean_load * wheels.len() as f64;
        Reading {
            what: Measured::Load { wheels },
            value: load * newtons,
            sigma: sigma.map_or(default, |sigma| sigma * newtons),
            channel: channel(data, format!("scale under {name}"), "N"),
        }
    };
    let mut found = Vec::new();
    for (wheel, &value) in &weighing.wheels {
        found.push(load(
            wheel.clone(),
            std::slice::from_ref(wheel),
            value,
            None,
        ));
    }
    for sum in &weighing.sums {
        found.push(load(sum.label(), &sum.wheels, sum.load, sum.sigma));
    }
    let sigma = weighing.specific_force_sigma.filter(|sigma| *sigma > 0.0);
    for (axis, &value) in weighing.specific_force.iter().flatten().enumerate() {
        let name = format!("accelerometer {}", ["x", "y", "z"][axis]);
        found.push(Reading {
            what: Measured::SpecificForce { axis },
            value,
            sigma: sigma.unwrap_or(DEFAULT_SPECIFIC_FORCE),
            channel: channel(data, name, "m/s^2"),
        });
    }
    found
}

/// The channel of this name, without a constant error: that of an accelerometer is a parameter of the machine.
pub(super) fn channel(data: &mut Data, name: String, unit: &'static str) -> usize {
    let found = data
        .channels
        .iter()
        .position(|channel| channel.name == name);
    found.unwrap_or_else(|| {
        data.channels.push(Channel {
            is_load: unit == "N" && name.starts_with("scale"),
            name,
            unit,
            bias_sigma: 0.0,
        });
        data.channels.len() - 1
    })
}
