//! The weighings of the machine file as data.

use tipwatch_calibration::identification::{
    Channel, Data, Instant, Measured, Reading, Situation, Source, calculated_sums,
};
use tipwatch_mechanics::machine::{Machine, SupportId, WeighedPosture, WeighedSpec};

/// Standard deviation of a scale that states none, as a share of the mean wheel load.
const DEFAULT_SCALE: f64 = 0.005;
/// Standard deviation of a mean specific force that states none (m/s^2).
const DEFAULT_SPECIFIC_FORCE: f64 = 0.01;

/// Adds the weighings to the data, and returns the readings that were left out because they were calculated from others.
/// Every reading has an error of its own. `evaluated` is the posture of a `[weighed]` that states none.
pub(in crate::setup) fn add(
    machine: &Machine,
    weighed: &WeighedSpec,
    evaluated: &[f64],
    data: &mut Data,
) -> Vec<String> {
    let mut left_out = Vec::new();
    for weighing in weighed.weighings() {
        let supports = weighing.stands_on(machine.supports());
        let mut readings = readings(machine, weighed, &weighing, supports.len(), data);
        for sum in calculated_sums(&readings).into_iter().rev() {
            let reading = readings.remove(sum);
            let name = &data.channels[reading.channel].name;
            left_out.push(format!(
                "{}: {name} is the sum of other readings of this weighing, so it counts as none of its own.",
                weighing.label()
            ));
        }
        data.sources.push(Source {
            name: weighing.label().into(),
            is_log: false,
            instants: vec![Instant {
                time_s: 0.0,
                supports: supports.into(),
                situation: situation(machine, &weighing, evaluated),
                readings,
            }],
        });
    }
    left_out
}

fn situation(machine: &Machine, weighing: &WeighedPosture, evaluated: &[f64]) -> Situation {
    Situation::AtRest {
        positions: weighing.positions(machine.joints(), evaluated),
        slope: weighing.slope.unwrap_or([0.0; 2]),
        slope_sigma: weighing.slope_uncertainty(),
    }
}

fn readings(
    machine: &Machine,
    weighed: &WeighedSpec,
    weighing: &WeighedPosture,
    on_ground: usize,
    data: &mut Data,
) -> Vec<Reading> {
    let newtons = weighed.unit.newtons(machine.gravity());
    let mean_load = machine.mass() * machine.gravity() / on_ground as f64;
    let usual = weighing.sigma.filter(|sigma| *sigma > 0.0);
    let mut load = |name: String, wheels: &[String], load: f64, sigma: Option<f64>| {
        let sigma = sigma.filter(|sigma| *sigma > 0.0).or(usual);
        let named = wheels.iter();
        let supports: Vec<SupportId> = named
            .flat_map(|name| machine.supports().named(name))
            .collect();
        let default = DEFAULT_SCALE * mean_load * supports.len() as f64;
        Reading {
            what: Measured::Load { supports },
            value: load * newtons,
            sigma: sigma.map_or(default, |sigma| sigma * newtons),
            channel: data.index_of(Channel {
                is_load: true,
                ..channel(format!("scale under {name}"), "N")
            }),
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
            channel: data.index_of(channel(name, "m/s^2")),
        });
    }
    found
}

/// The channel of this name, of no load, without a constant error: that of an accelerometer is a parameter of the machine.
pub(super) fn channel(name: String, unit: &'static str) -> Channel {
    Channel {
        is_load: false,
        name,
        unit,
        bias_sigma: 0.0,
    }
}
