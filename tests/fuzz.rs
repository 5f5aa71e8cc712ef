//! No machine file, URDF or sensor value makes the program panic: bad input is refused with an error.
//!
//! Each target runs here for a short time. A coverage-guided fuzzer runs it for longer:
//! `cargo bolero test -p tipwatch-tests fuzz::any_machine_file_is_read_or_refused`.

use std::time::Duration;

use tipwatch_mechanics::estimation::{CausalEstimator, RowClock, smooth};
use tipwatch_mechanics::machine::{LogFacts, Machine};
use tipwatch_mechanics::state::{MatchedSensors, OtherSensors, Sample};
use tipwatch_mechanics::{
    MachineSpec, Scope, State, Workspace, actuator_force, evaluate, static_outcome,
};
use tipwatch_tests::OwnedSamples;

/// Time for each target.
const TIME: Duration = Duration::from_secs(1);

const MACHINES: [[&str; 2]; 3] = [
    [
        include_str!("data/tiny.toml"),
        include_str!("data/tiny.urdf"),
    ],
    [
        include_str!("data/forwarder6.toml"),
        include_str!("data/forwarder6.urdf"),
    ],
    [
        include_str!("data/second_paper.toml"),
        include_str!("data/second_paper.urdf"),
    ],
];

/// Values that are wrong in interesting ways, and tables that the machine files lack.
const WORDS: [&str; 20] = [
    "0",
    "-0.0",
    "-1",
    "1e-320",
    "1e154",
    "-1e308",
    "1e400",
    "nan",
    "inf",
    "9223372036854775807",
    "99999999999999999999",
    "\"estimate\"",
    "[]",
    "{}",
    "true",
    "é",
    "&#x0;",
    "\n[plausibility]\npolicy = \"widen\"\nfrozen_samples = 2\nspecific_force_max = 1e-300\n",
    "\n[[payload]]\nlink = \"base_link\"\nmass = \"estimate\"\nfrom = 3\nto = 1\n",
    "\n[estimator]\nmax_gap = 1e-300\njoint_agility = 1e300\nsettle = 1e300\n",
];

/// Kind of change, line, and word or place.
type Edit = (u8, u16, u16);

/// Replaces words and removes, copies or adds lines. At most three changes, so that many texts remain valid.
fn edited(text: &str, edits: &[Edit]) -> String {
    let mut lines: Vec<String> = text.lines().map(String::from).collect();
    for &(kind, at, word) in edits.iter().take(edits.len() % 4) {
        let (at, word) = (at as usize % lines.len(), word as usize);
        match kind % 4 {
            0 if lines.len() > 1 => drop(lines.remove(at)),
            1 => lines.insert(word % lines.len(), lines[at].clone()),
            2 => lines.push(WORDS[word % WORDS.len()].into()),
            _ => {
                let is_value = |c: char| c.is_alphanumeric() || matches!(c, '.' | '-' | '+' | '_');
                let mut words: Vec<&str> = lines[at].split_inclusive(|c| !is_value(c)).collect();
                let place = word / WORDS.len() % words.len().max(1);
                let planted = format!("{} ", WORDS[word % WORDS.len()]);
                if let Some(old) = words.get_mut(place) {
                    *old = &planted;
                }
                lines[at] = words.concat();
            }
        }
    }
    lines.join("\n")
}

/// Any number; moderate ones are more frequent.
fn number(bits: u64) -> f64 {
    match bits % 8 {
        0 => f64::from_bits(bits),
        1 => [f64::NAN, f64::INFINITY, -1e308, 1e-320, 0.0][(bits >> 3) as usize % 5],
        _ => bits as f64 / u64::MAX as f64 * 4.0 - 2.0,
    }
}

/// Checks a machine and uses it as the programs do.
fn use_machine(toml: &str, urdf: &str, bits: &[u64]) {
    let spec = MachineSpec::from_toml(toml, "fuzzed.toml");
    let checked = spec.map(|spec| spec.check(urdf, "fuzzed.urdf", LogFacts::default()));
    let Ok(Ok(mut machine)) = checked else { return };
    let mut numbers = bits.iter().map(|&bits| number(bits)).cycle();
    let mut next = || numbers.next().unwrap_or(0.1);
    let posture: Vec<f64> = machine.joints().iter().map(|_| next()).collect();
    let _ = static_outcome(&machine, &posture);
    let _ = machine.set_reference_loads();
    let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
    let mut state = State::<f64>::zero(&machine);
    for (joint, position) in state.joints.iter_mut().zip(&posture) {
        (joint.position, joint.rate, joint.acceleration) = (*position, next(), next());
    }
    state.imu.specific_force.z = machine.gravity();
    evaluate(&machine, &state, &mut workspace);
    for linkage in 0..machine.linkages().len() {
        let _ = actuator_force(&machine, &state, &workspace, linkage);
    }
}

/// Passes samples (sensor, step of the clock, values) to both estimators.
fn use_samples(machine: &Machine, samples: &[(u8, u64, Vec<u64>)]) {
    let names: Vec<String> = machine.joints().iter().map(|j| j.name.clone()).collect();
    let others = OtherSensors {
        imu: true,
        odometry: true,
        tool_wrench: false,
    };
    let sensors = MatchedSensors::new(machine, &[("all", &names)], others)
        .unwrap()
        .sensors;
    let mut recordings: Vec<OwnedSamples> = (sensors.iter())
        .map(|sensor| OwnedSamples {
            sensor,
            stamps_ns: Vec::new(),
            values: Vec::new(),
        })
        .collect();
    let mut estimator = CausalEstimator::new(machine, &sensors, RowClock::JointStates);
    let mut workspace = Workspace::<f64>::new(machine);
    let mut stamp_ns = 0_i64;
    for (sensor, step, bits) in samples {
        stamp_ns = match step % 16 {
            0 => *step as i64,
            1 => stamp_ns.wrapping_sub(7_000_000),
            _ => stamp_ns.wrapping_add(3_000_000),
        };
        let recording = &mut recordings[*sensor as usize % sensors.iter().count()];
        let count = sensors.value_count(recording.sensor).unwrap();
        let numbers = bits.iter().map(|&bits| number(bits)).chain([0.5]);
        let values: Vec<f64> = numbers.cycle().take(count).collect();
        let sample = Sample::new(recording.sensor, stamp_ns, &values);
        let _ = estimator.push(machine, &sample, &mut |row| {
            evaluate(machine, &row.state, &mut workspace);
        });
        recording.stamps_ns.push(stamp_ns);
        recording.values.extend(values);
    }
    let recordings: Vec<_> = recordings.iter().map(OwnedSamples::samples).collect();
    let _ = smooth(machine, &sensors, &recordings, RowClock::Rate(50.0));
}

#[test]
fn any_machine_file_is_read_or_refused() {
    let inputs = bolero::check!().with_type::<(u8, Vec<Edit>, Vec<u64>)>();
    inputs
        .with_test_time(TIME)
        .for_each(|(which, edits, bits)| {
            let [toml, urdf] = MACHINES[*which as usize % MACHINES.len()];
            use_machine(&edited(toml, edits), urdf, bits);
        });
}

#[test]
fn any_urdf_is_read_or_refused() {
    let inputs = bolero::check!().with_type::<(u8, Vec<Edit>, Vec<u64>)>();
    inputs
        .with_test_time(TIME)
        .for_each(|(which, edits, bits)| {
            let [toml, urdf] = MACHINES[*which as usize % MACHINES.len()];
            use_machine(toml, &edited(urdf, edits), bits);
        });
}

#[test]
fn any_samples_pass_through_both_estimators() {
    let machines = MACHINES.map(|[toml, urdf]| {
        let spec = MachineSpec::from_toml(toml, "machine.toml").unwrap();
        spec.check(urdf, "machine.urdf", LogFacts::default())
            .unwrap()
    });
    let inputs = bolero::check!().with_type::<(u8, Vec<(u8, u64, Vec<u64>)>)>();
    inputs.with_test_time(TIME).for_each(|(which, samples)| {
        use_samples(&machines[*which as usize % machines.len()], samples);
    });
}
