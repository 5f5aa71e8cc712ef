//! Stamps that are years apart, or at the limits of the integer range.

use tipwatch_mechanics::estimation::{CausalEstimator, RowClock, SensorSamples, smooth};
use tipwatch_mechanics::machine::LogFacts;
use tipwatch_mechanics::state::{MatchedSensors, OtherSensors, Reason, Sample, Sensor};
use tipwatch_mechanics::{Machine, MachineSpec};

const TOML: &str = include_str!("data/rigid.toml");
const URDF: &str = include_str!("data/rigid.urdf");

fn machine() -> Machine {
    let spec = MachineSpec::from_toml(TOML, "rigid.toml").unwrap();
    spec.check(URDF, "rigid.urdf", LogFacts::default()).unwrap()
}

#[test]
fn regular_rate_terminates_for_any_stamps() {
    let machine = machine();
    let names: Vec<String> = machine.joints().iter().map(|j| j.name.clone()).collect();
    let others = OtherSensors::default();
    let matched = MatchedSensors::new(&machine, &[("all", &names)], others).unwrap();
    let sensors = &matched.sensors;
    let good = (0..200_i64).map(|k| 1_700_000_000_000_000_000 + k * 10_000_000);
    let wild = [i64::MIN, -1, 0, 1_900_000_000_000_000_000, i64::MAX];
    for stamps in [
        good.clone().collect::<Vec<i64>>(),
        [0].into_iter().chain(good.clone()).collect(),
        good.clone().chain(wild).collect(),
        wild.into_iter().chain(good.clone()).collect(),
    ] {
        // At rest, with zero velocities.
        let values = [vec![0.1; names.len()], vec![0.0; names.len()]].concat();
        for clock in [RowClock::Rate(50.0), RowClock::JointStates] {
            let mut causal = CausalEstimator::new(&machine, sensors, clock);
            let mut rows = 0;
            for &stamp_ns in &stamps {
                let sample = Sample::new(Sensor::Joints(0), stamp_ns, &values);
                let _ = causal.push(&machine, &sample, &mut |_| rows += 1);
            }
            assert!((1..=300).contains(&rows), "{rows}");
            let samples = SensorSamples {
                sensor: Sensor::Joints(0),
                stamps_ns: &stamps,
                values: &values.repeat(stamps.len()),
            };
            let smoothed = smooth(&machine, sensors, &[samples], clock);
            let times = &smoothed.times_ns;
            assert!((90..=210).contains(&times.len()), "{}", times.len());
            assert!(times.is_sorted(), "{times:?}");
            // Apart from the missing IMU, the good samples give valid states.
            let known = smoothed
                .estimated
                .reasons
                .iter()
                .filter(|reasons| !reasons.has(Reason::JointsGap));
            let known = known.count();
            assert!(
                known >= 90,
                "{known} of {}, {clock:?}, from {}",
                times.len(),
                stamps[0]
            );
        }
    }
}
