//! A machine, a copy of it with wrong parameters, and what scales would show of the true one.

use tipwatch_calibration::identification::{
    Channel, Data, Instant, Measured, Reading, Situation, Source, predict,
};
use tipwatch_mechanics::machine::{LogFacts, Machine, MachineSpec, Parameter, Unknown};
use tipwatch_mechanics::{Axis, State};

/// Random numbers of a normal distribution with the standard deviation one, the same in every run: the sum of twelve
/// uniform ones.
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 31)
    }

    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

fn text(name: &str) -> String {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../mechanics/tests/data");
    std::fs::read_to_string(folder.join(name)).unwrap()
}

/// The machine with one rigid frame and an arm. Uncertainties of a machine from a data sheet.
pub(crate) fn machine(more: &str) -> Machine {
    let file = text("rigid.toml")
        + "\n[uncertainty]\nmass_share = 0.05\ncom = 0.03\nmodel_share = 0.001\n"
        + more;
    let spec = MachineSpec::from_toml(&file, "machine.toml").unwrap();
    spec.check(&text("rigid.urdf"), "machine.urdf", LogFacts::default())
        .unwrap()
}

/// The machine whose platform and heavy arm links are off by about 5 % of mass and 3 cm of centre of mass.
pub(crate) fn wrong(machine: &Machine, noise: &mut Noise) -> Machine {
    let mut changes = Vec::new();
    for unknown in Unknown::all(machine) {
        match unknown {
            Unknown::Parameter(parameter @ Parameter::LinkMass(_)) => {
                let nominal = parameter.nominal(machine).unwrap();
                changes.push((parameter, 0.05 * nominal * noise.normal().clamp(-1.5, 1.5)));
            }
            Unknown::Parameter(parameter @ Parameter::LinkCom(..)) => {
                changes.push((parameter, 0.03 * noise.normal().clamp(-1.5, 1.5)));
            }
            _ => {}
        }
    }
    machine.changed(&changes)
}

pub(crate) fn joint(machine: &Machine, name: &str) -> usize {
    machine
        .joints()
        .iter()
        .position(|joint| joint.name == name)
        .unwrap()
}

/// A posture of the arm: slew, lift, tilt, extension.
pub(crate) fn posture(machine: &Machine, arm: [f64; 4]) -> Vec<f64> {
    let mut positions = vec![0.0; machine.joints().len()];
    for (name, position) in ["slew", "lift", "tilt", "extension"].into_iter().zip(arm) {
        positions[joint(machine, name)] = position;
    }
    positions
}

/// Postures in which the machine stands on all wheels.
pub(crate) fn postures(machine: &Machine, count: usize, noise: &mut Noise) -> Vec<Vec<f64>> {
    let mut found = Vec::new();
    while found.len() < count {
        let arm = [
            3.0 * (noise.uniform() - 0.5),
            -1.3 + 0.5 * noise.uniform(),
            -1.4 + 0.7 * noise.uniform(),
            0.5 * noise.uniform(),
        ];
        let positions = posture(machine, arm);
        let loads = tipwatch_mechanics::static_outcome(machine, &positions).load;
        if loads.iter().all(|load| *load > 1000.0) {
            found.push(positions);
        }
    }
    found
}

pub(crate) fn channels(machine: &Machine, bias_sigma: f64) -> Vec<Channel> {
    let channel = |name: &str| Channel {
        name: name.into(),
        unit: "N",
        bias_sigma,
        is_load: true,
    };
    machine
        .wheels()
        .iter()
        .map(|wheel| channel(&wheel.name))
        .collect()
}

/// An instant at which every wheel is on a scale, with what `truth` loads them, and noise.
pub(crate) fn weighed(
    truth: &Machine,
    situation: Situation,
    time_s: f64,
    sigma: f64,
    noise: &mut Noise,
) -> Instant {
    let reading = |wheel: usize| Reading {
        what: Measured::Load {
            supports: vec![truth.stands_on()[wheel]],
        },
        value: 0.0,
        sigma,
        channel: wheel,
    };
    let mut instant = Instant {
        time_s,
        supports: truth.stands_on().into(),
        situation,
        readings: (0..truth.wheels().len()).map(reading).collect(),
    };
    let loads = predict(truth, &instant);
    for (reading, load) in instant.readings.iter_mut().zip(loads) {
        reading.value = load + sigma * noise.normal();
    }
    instant
}

/// The rows of a log in these postures, as [`weighed`], a second apart.
pub(crate) fn logged(
    truth: &Machine,
    postures: Vec<Vec<f64>>,
    sigma: f64,
    noise: &mut Noise,
) -> Vec<Instant> {
    let rows = postures.into_iter().enumerate();
    rows.map(|(k, positions)| {
        let situation = Situation::Logged(Box::new(row(truth, &positions)));
        weighed(truth, situation, k as f64, sigma, noise)
    })
    .collect()
}

/// The readings of one log.
pub(crate) fn of_log(channels: Vec<Channel>, instants: Vec<Instant>) -> Data {
    let log = Source {
        name: "log".into(),
        is_log: true,
        instants,
    };
    Data {
        channels,
        sources: vec![log],
    }
}

/// Weighings of `truth` in random postures on level ground.
pub(crate) fn weighings(truth: &Machine, count: usize, sigma: f64, noise: &mut Noise) -> Data {
    let sources = postures(truth, count, noise)
        .into_iter()
        .enumerate()
        .map(|(i, positions)| {
            let situation = Situation::AtRest {
                positions,
                slope: [0.0; 2],
                slope_sigma: 0.0,
            };
            Source {
                name: format!("weighing {}", i + 1),
                is_log: false,
                instants: vec![weighed(truth, situation, 0.0, sigma, noise)],
            }
        });
    Data {
        channels: channels(truth, 0.0),
        sources: sources.collect(),
    }
}

/// Root mean square difference of the loads of two machines in postures (N).
pub(crate) fn load_error(truth: &Machine, model: &Machine, postures: &[Vec<f64>]) -> f64 {
    let mut squares = Vec::new();
    for positions in postures {
        let [a, b] =
            [truth, model].map(|of| tipwatch_mechanics::static_outcome(of, positions).load);
        squares.extend(a.iter().zip(b).map(|(a, b)| (a - b).powi(2)));
    }
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// A row of a log: the machine stands in a posture, and its IMU is free of errors.
pub(crate) fn row(machine: &Machine, positions: &[f64]) -> State<f64> {
    let mut state = tipwatch_mechanics::resting_state(machine, positions);
    state.imu.specific_force.z = machine.gravity();
    state.payload_share.fill(1.0);
    state
}

#[allow(dead_code)]
pub(crate) const AXES: [Axis; 3] = Axis::ALL;
