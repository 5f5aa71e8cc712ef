//! The health of all sensors of a log.

use std::iter::once;

use rayon::prelude::*;
use tipwatch_mechanics::estimation::sorted_stamps;
use tipwatch_mechanics::state::{Sensor, StreamCounts};

use super::meter::{Meter, Meters};
use super::rate::Rates;
use super::record::SensorHealth;
use crate::load::{LoadedLog, Signal};

/// Samples that are read at a time.
const CHUNK: usize = 4096;
const AXES: [&str; 3] = ["x", "y", "z"];

/// The health of each sensor, in the order of its signals; `counts` are those of the estimator.
pub(crate) fn of(loaded: &LoadedLog, counts: &[(Sensor, StreamCounts)]) -> Vec<SensorHealth> {
    let signals = loaded.signals.par_iter();
    signals
        .map(|signal| of_signal(loaded, signal, counts))
        .collect()
}

fn of_signal(
    loaded: &LoadedLog,
    signal: &Signal,
    counts: &[(Sensor, StreamCounts)],
) -> SensorHealth {
    let recording = &signal.recording;
    let stamps = sorted_stamps(&recording.stamps_ns);
    let rates = Rates::of(&stamps);
    let count = counts.iter().find(|(sensor, _)| *sensor == signal.sensor);
    let correction = &recording.reading.correction;
    let mut meters = Meters::new(meters(loaded, signal.sensor));
    let width = recording.width().max(1);
    let mut values = Vec::new();
    for first in (0..recording.len()).step_by(CHUNK) {
        let samples = first..recording.len().min(first + CHUNK);
        values.resize(samples.len() * width, f64::NAN);
        // the analysis has read them before, and has failed where they cannot be read
        if recording.read(samples.clone(), &mut values).is_err() {
            break;
        }
        let stamps = &recording.stamps_ns[samples];
        for (stamp, values) in stamps.iter().zip(values.chunks_exact(width)) {
            meters.take(*stamp, values);
        }
    }
    SensorHealth {
        signal: signal.name.to_owned(),
        topic: signal.topic.clone(),
        samples: recording.len() as u64,
        implausible: count.map_or(0, |(_, count)| count.implausible),
        rate_hz: rates.rate_hz,
        rate_changes: rates.changes,
        longest_gap_s: rates.longest_gap.map(|(gap_s, _)| gap_s),
        longest_gap_ns: rates.longest_gap.map(|(_, from_ns)| from_ns),
        clock_steps: (correction.restarts + correction.steps + correction.log_time_jumps) as u64,
        numbers: meters.finish(),
    }
}

/// The numbers of a sensor, in the order of its values. Attitudes are no numbers of their own.
fn meters(loaded: &LoadedLog, sensor: Sensor) -> Vec<Meter> {
    let machine = &loaded.machine;
    let vector = |name: &'static str, unit: &'static str| {
        AXES.map(|axis| Meter::new(format!("{name}_{axis}"), unit, false))
    };
    match sensor {
        Sensor::Joints(_) => {
            let joints = loaded.matched.sensors.joints_of(sensor).unwrap_or_default();
            let of_joints = |what: &'static str, units: [&'static str; 2]| {
                joints.iter().map(move |&joint| {
                    let name = &machine.joints()[joint].name;
                    let unit = units[usize::from(machine.joint_slides(joint))];
                    // joints rest at their ends
                    Meter::new(format!("{name}_{what}"), unit, true)
                })
            };
            of_joints("position", ["rad", "m"])
                .chain(of_joints("velocity", ["rad/s", "m/s"]))
                .collect()
        }
        Sensor::Imu => {
            let force = vector("specific_force", "m/s^2").into_iter();
            force.chain(vector("angular_velocity", "rad/s")).collect()
        }
        Sensor::Odometry => {
            // odometry without lateral motion states zero
            let resting = |name: &'static str, unit: &'static str| {
                AXES.map(|axis| Meter::new(format!("{name}_{axis}"), unit, true))
            };
            let velocity = resting("velocity", "m/s").into_iter();
            velocity
                .chain(resting("angular_velocity", "rad/s"))
                .collect()
        }
        Sensor::ToolWrench => {
            let force = vector("force", "N").into_iter();
            force.chain(vector("moment", "N m")).collect()
        }
        Sensor::Number(..) => once(Meter::new("value".to_owned(), "SI", true)).collect(),
    }
}
