//! Machines on any set of their supports: sensors and parameters belong to supports, not to places among the wheels.

use tipwatch_calibration::identification::{
    Channel, Instant, Measured, Reading, Situation, identify, predict,
};
use tipwatch_mechanics::machine::{Machine, Parameter, SupportId, Unknown};
use tipwatch_mechanics::{Scope, Workspace, evaluate_one, static_outcome};

use crate::support::{Noise, machine, of_log, postures, row, wrong};

/// Standard deviation of a load cell's own error (N).
const CELL: f64 = 10.0;

/// The machine with four outriggers, each higher in the alphabet than the wheels.
fn crane() -> Machine {
    let foot = |(name, x, y): (&str, f64, f64)| {
        format!(
            "[supports.{name}]\nlink = \"base_link\"\nxyz = [{x}, {y}, -0.45]\nstiffness = 8.0e5\n\
             set = {{ topic = \"/set\", field = \"{name}\" }}\n"
        )
    };
    let feet = [
        ("AFL", 1.7, 1.6),
        ("ORL", -1.7, 1.6),
        ("TFR", 1.7, -1.6),
        ("ZRR", -1.7, -1.6),
    ];
    machine(&feet.map(foot).concat())
}

/// Sets on which the machine carries load everywhere in a posture, drawn at random.
fn standing(machine: &Machine, positions: &[f64], noise: &mut Noise) -> Machine {
    loop {
        let ids = machine.supports().ids();
        let on: Vec<SupportId> = ids.filter(|_| noise.uniform() < 0.6).collect();
        let Ok(machine) = machine.standing_on(&on) else {
            continue;
        };
        let loads = static_outcome(&machine, positions).load;
        if loads.iter().all(|load| *load > 500.0) {
            return machine;
        }
    }
}

/// Some sensors of one to three supports.
fn sensors(machine: &Machine, noise: &mut Noise) -> Vec<Vec<SupportId>> {
    let draw = |noise: &mut Noise| {
        let ids: Vec<SupportId> = machine.supports().ids().collect();
        let count = 1 + (3.0 * noise.uniform()) as usize;
        let mut found: Vec<SupportId> = Vec::new();
        while found.len() < count {
            let id = ids[(noise.uniform() * ids.len() as f64) as usize % ids.len()];
            if !found.contains(&id) {
                found.push(id);
            }
        }
        found
    };
    (0..8).map(|_| draw(noise)).collect()
}

fn instant(on: &Machine, positions: &[f64], sensors: &[Vec<SupportId>], time_s: f64) -> Instant {
    let carried = |supports: &[SupportId]| supports.iter().any(|&id| on.place_of(id).is_some());
    let readings = sensors.iter().enumerate();
    Instant {
        time_s,
        supports: on.stands_on().into(),
        situation: Situation::Logged(Box::new(row(on, positions))),
        readings: readings
            .filter(|(_, supports)| carried(supports))
            .map(|(channel, supports)| Reading {
                what: Measured::Load {
                    supports: supports.clone(),
                },
                value: 0.0,
                sigma: CELL,
                channel,
            })
            .collect(),
    }
}

/// Computes the reading of a sensor (N): the sum of the loads of its supports, found by their names.
fn by_name(on: &Machine, instant: &Instant, supports: &[SupportId]) -> f64 {
    let Situation::Logged(state) = &instant.situation else {
        panic!("a row");
    };
    let mut workspace = Workspace::with_scope(on, Scope::LOADS);
    let loads = evaluate_one(on, state, &mut workspace).load.clone();
    let names: Vec<&str> = (supports.iter())
        .map(|&id| on.supports().support(id).name.as_str())
        .collect();
    let pairs = on.wheels().iter().zip(loads);
    pairs
        .filter(|(wheel, _)| names.contains(&wheel.name.as_str()))
        .map(|(_, load)| load)
        .sum()
}

#[test]
fn sensors_measure_their_supports_on_every_set() {
    let machine = crane();
    for seed in 1..=60 {
        let mut noise = Noise::new(seed);
        let positions = postures(&machine, 1, &mut noise).remove(0);
        let on = standing(&machine, &positions, &mut noise);
        let sensors = sensors(&machine, &mut noise);
        let instant = instant(&on, &positions, &sensors, 0.0);
        // the machine may be given on whichever supports
        for given in [&machine, &on] {
            let predicted = predict(given, &instant);
            for (reading, predicted) in instant.readings.iter().zip(predicted) {
                let Measured::Load { supports } = &reading.what else {
                    panic!("a load");
                };
                let expected = by_name(&on, &instant, supports);
                let off = (predicted - expected).abs();
                assert!(
                    off < 1e-9 * expected.abs().max(1.0),
                    "seed {seed}: {supports:?}: {off}"
                );
            }
        }
    }
}

#[test]
fn a_sensor_of_raised_supports_alone_says_nothing() {
    let machine = crane();
    let mut noise = Noise::new(5);
    let positions = postures(&machine, 1, &mut noise).remove(0);
    let raised = machine.supports().named("AFL");
    let mut instant = instant(&machine, &positions, std::slice::from_ref(&raised), 0.0);
    assert!(instant.readings.is_empty());
    instant.readings.push(Reading {
        what: Measured::Load { supports: raised },
        value: 0.0,
        sigma: CELL,
        channel: 0,
    });
    assert!(predict(&machine, &instant)[0].is_nan());
}

#[test]
fn parameters_of_supports_hold_on_every_set() {
    let machine = crane();
    for unknown in Unknown::all(&machine) {
        let Unknown::Parameter(parameter) = unknown else {
            continue;
        };
        let (Parameter::WheelPosition(id, _) | Parameter::WheelRadius(id)) = parameter else {
            continue;
        };
        let all: Vec<SupportId> = machine.supports().ids().collect();
        let before = parameter.nominal(&machine).unwrap();
        // changed while it was on the ground or not, and then put on every support
        let changed = machine.changed(&[(parameter, 0.01)]);
        let on_all = changed.standing_on(&all).unwrap();
        let name = unknown.name(&machine);
        let after = parameter.nominal(&on_all).unwrap();
        assert!((after - before - 0.01).abs() < 1e-12, "{name}");
        assert_eq!(unknown.name(&on_all), name);
        let place = on_all.place_of(id).unwrap();
        assert!(
            name.contains(&on_all.wheels()[place].name.to_lowercase()),
            "{name}"
        );
    }
}

#[test]
fn a_machine_is_identified_on_changing_supports() {
    let truth = crane();
    let mut noise = Noise::new(17);
    let stated = wrong(&truth, &mut noise);
    let sensors = sensors(&truth, &mut noise);
    let draw = |count: usize, noise: &mut Noise| -> Vec<Instant> {
        let mut found = Vec::new();
        for positions in postures(&truth, count, noise) {
            let on = standing(&truth, &positions, noise);
            let mut instant = instant(&on, &positions, &sensors, found.len() as f64);
            let loads = predict(&truth, &instant);
            for (reading, load) in instant.readings.iter_mut().zip(loads) {
                reading.value = load + CELL * noise.normal();
            }
            found.push(instant);
        }
        found
    };
    let (shown, held) = (draw(80, &mut noise), draw(30, &mut noise));
    let channel = |k: usize| Channel {
        name: format!("cell {k}"),
        unit: "N",
        bias_sigma: 0.0,
        is_load: true,
    };
    let data = of_log((0..sensors.len()).map(channel).collect(), shown);
    let found = identify(&stated, None, &data).unwrap();
    let identified = stated.with_identified(found.identified.clone());
    let rms = |machine: &Machine| {
        let errors = held.iter().flat_map(|instant| {
            let readings = instant.readings.iter().zip(predict(machine, instant));
            readings.map(|(reading, predicted)| (reading.value - predicted).powi(2))
        });
        let errors: Vec<f64> = errors.collect();
        (errors.iter().sum::<f64>() / errors.len() as f64).sqrt()
    };
    let (before, after) = (rms(&stated), rms(&identified));
    assert!(before > 10.0 * CELL, "{before}");
    assert!(
        after < 0.4 * before && after < 6.0 * CELL,
        "{before} {after}"
    );
    assert!((identified.mass() - truth.mass()).abs() < 15.0);
    // the true machine stays what it is
    let found = identify(&truth, None, &data).unwrap();
    let identified = truth.with_identified(found.identified);
    assert!((identified.mass() - truth.mass()).abs() < 15.0);
}
