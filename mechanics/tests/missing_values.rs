//! A sample with a value that is not finite is a lost one: bridged up to the longest gap, counted, and told.

use tipwatch_mechanics::Machine;
use tipwatch_mechanics::estimation::{CausalEstimator, RowClock, SensorSamples, smooth};
use tipwatch_mechanics::machine::FaultKind;
use tipwatch_mechanics::state::{
    MatchedSensors, OtherSensors, Reason, Reasons, Sample, Sensor, Sensors,
};

use crate::support::machine;

const STEP_NS: i64 = 10_000_000;
const SAMPLES: i64 = 600;

/// Six seconds at rest at 100 Hz, each sensor's stamps and values; `lacks` names the samples without one value.
struct Scene {
    stamps_ns: Vec<i64>,
    joints: Vec<f64>,
    imu: Vec<f64>,
}

impl Scene {
    fn new(machine: &Machine, sensor: Sensor, lacks: impl Fn(i64) -> bool) -> Self {
        let count = machine.joints().len();
        let nan = f64::NAN;
        let (mut joints, mut imu) = (Vec::new(), Vec::new());
        for k in 0..SAMPLES {
            let noise = (k as f64 * 1.7).sin();
            let mut position = vec![0.1 + 1e-5 * noise; count];
            let mut force = [0.02 * noise, 0.01 * noise, machine.gravity()];
            match sensor {
                Sensor::Imu if lacks(k) => force[1] = nan,
                Sensor::Joints(_) if lacks(k) => position[0] = nan,
                _ => {}
            }
            joints.extend(position);
            joints.extend(vec![0.0; count]);
            imu.extend(force);
            imu.extend([
                1e-3 * noise,
                -1e-3 * noise,
                5e-4 * noise,
                nan,
                nan,
                nan,
                nan,
            ]);
        }
        Self {
            stamps_ns: (0..SAMPLES)
                .map(|k| 1_700_000_000_000_000_000 + k * STEP_NS)
                .collect(),
            joints,
            imu,
        }
    }

    fn streams(&self) -> [(Sensor, &[f64]); 2] {
        [(Sensor::Joints(0), &self.joints), (Sensor::Imu, &self.imu)]
    }
}

fn sensors(machine: &Machine) -> Sensors {
    let names: Vec<String> = machine.joints().iter().map(|j| j.name.clone()).collect();
    let others = OtherSensors {
        imu: true,
        ..OtherSensors::default()
    };
    let matched = MatchedSensors::new(machine, &[("all", &names)], others).unwrap();
    matched.sensors
}

/// Returns the reasons of each row by the smoother, which needs later samples, and by the causal estimator.
fn reasons(machine: &Machine, scene: &Scene) -> [Vec<Reasons>; 2] {
    let sensors = sensors(machine);
    let samples: Vec<SensorSamples<'_>> = (scene.streams().into_iter())
        .map(|(sensor, values)| SensorSamples {
            sensor,
            stamps_ns: &scene.stamps_ns,
            values,
        })
        .collect();
    let smoothed = smooth(machine, &sensors, &samples, RowClock::JointStates);
    let mut causal = CausalEstimator::new(machine, &sensors, RowClock::JointStates);
    let mut rows = Vec::new();
    let mut lost = 0;
    for (k, &stamp_ns) in scene.stamps_ns.iter().enumerate() {
        for (sensor, values) in scene.streams() {
            let width = values.len() / scene.stamps_ns.len();
            let values = &values[k * width..(k + 1) * width];
            let sample = Sample::new(sensor, stamp_ns, values);
            let _ = causal.push(machine, &sample, &mut |row| rows.push(row.reasons));
            let findings = causal.findings();
            lost += findings
                .iter()
                .filter(|it| it.kind == FaultKind::NotFinite)
                .count();
        }
    }
    let counted: u64 = causal
        .counts()
        .iter()
        .map(|(_, counts)| counts.not_finite)
        .sum();
    assert_eq!(counted, lost as u64, "each is counted and told");
    [smoothed.estimated.reasons, rows]
}

#[test]
fn single_values_that_are_missing_cost_no_row() {
    let machine = machine("rigid");
    for sensor in [Sensor::Joints(0), Sensor::Imu] {
        let scene = Scene::new(&machine, sensor, |k| k % 20 == 7);
        for rows in reasons(&machine, &scene) {
            assert_eq!(rows.len(), SAMPLES as usize);
            let settled = rows.iter().skip(200);
            let invalid = settled.filter(|reasons| !reasons.leave_valid()).count();
            assert_eq!(invalid, 0, "{sensor:?}");
        }
    }
}

#[test]
fn values_that_stay_missing_are_a_gap() {
    let machine = machine("rigid");
    let longest = (machine.estimator().max_gap * 1e9) as i64 / STEP_NS;
    let missing = |k: i64| (300..300 + 3 * longest).contains(&k);
    let of = [
        (Sensor::Joints(0), Reason::JointsGap),
        (Sensor::Imu, Reason::ImuGap),
    ];
    for (sensor, reason) in of {
        let scene = Scene::new(&machine, sensor, missing);
        for rows in reasons(&machine, &scene) {
            let middle = rows[(300 + 3 * longest / 2) as usize];
            assert!(middle.has(reason), "{sensor:?} {middle:?}");
        }
    }
}
