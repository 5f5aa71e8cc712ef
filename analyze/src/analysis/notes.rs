//! Notes: what a reader must know about how the results were obtained.

use tipwatch_mechanics::machine::{Axis, Machine, Parameter};
use tipwatch_mechanics::state::Sensor;
use tipwatch_mechanics::{Quantity, State};

use super::clock::{self, ClockOffsets, text::TopicsFinding};
use super::excitation;
use super::payload::EstimatedPayload;
use crate::base::rows::Rows;
use crate::load::LoadedLog;

/// Assumptions, substitutes and anomalies, one note each.
#[must_use]
pub(crate) fn of(
    loaded: &LoadedLog,
    payloads: &[EstimatedPayload],
    clock_findings: &[TopicsFinding],
    clock: &ClockOffsets,
    rows: &Rows,
) -> Vec<String> {
    let mut notes = Vec::new();
    let sensors = &loaded.matched.sensors;
    if !sensors.imu && sensors.odometry {
        notes.push(
            "The log has no IMU. Specific force and angular velocity are computed from the odometry."
                .into(),
        );
    } else if !sensors.imu {
        notes.push("The log has neither IMU nor odometry: wheel loads cannot be computed.".into());
    }
    if loaded.machine.imu().source.starts_with("assumed") {
        notes.push(format!(
            "Position and orientation of the IMU: {}.",
            loaded.machine.imu().source
        ));
    }
    notes.extend(reference_posture(&loaded.machine));
    notes.extend(loaded.machine.notes().iter().cloned());
    notes.extend(missing_wheel_joints(loaded));
    notes.extend(loaded.notes.iter().cloned());
    notes.extend(measured_torques(loaded, rows));
    notes.extend(accelerometer_bias(loaded, rows));
    notes.extend(excitation::note(&loaded.machine, rows));
    for signal in &loaded.signals {
        if signal.recording.without_value > 0 {
            notes.push(format!(
                "{}: skipped {} messages without any of the fields bound to {}.",
                signal.topic, signal.recording.without_value, signal.name
            ));
        }
        if signal.recording.stamps_ns.is_empty() && !matches!(signal.sensor, Sensor::Joints(_)) {
            notes.push(format!("{}: no readable message.", signal.topic));
        }
    }
    notes.extend(clock_findings.iter().map(|finding| format!("{finding}.")));
    notes.extend(clock::text::notes(clock));
    notes.extend(payloads.iter().map(|found| {
        format!(
            "Payload {}: its mass was estimated as {:.0} kg (standard deviation {:.0} kg), from the force of linkage {}.",
            found.payload + 1,
            found.estimate.mass,
            found.estimate.sigma,
            found.linkage
        )
    }));
    notes.extend(loaded.losses.notes.iter().cloned());
    notes.extend(skipped_chunks(loaded.losses.integrity.chunks_passed_over));
    notes.extend(
        loaded
            .losses
            .integrity
            .note()
            .map(|note| format!("{note}; implausible values are flagged instead.")),
    );
    notes
}

/// The assumed posture of the reference loads, where an arm makes a difference.
fn reference_posture(machine: &Machine) -> Option<String> {
    let posture = &machine.reference().posture;
    let has_arm = machine.joints().iter().any(|j| j.spins_wheel.is_none());
    (has_arm && !posture.is_stated).then(|| {
        format!(
            "Static loads, the reference of utilisation and load limits, are those of {}.",
            posture.source()
        )
    })
}

/// The share of rows in which measured torques determined the load split.
fn measured_torques(loaded: &LoadedLog, rows: &Rows) -> Option<String> {
    let sensors = &loaded.matched.sensors;
    let machine = &loaded.machine;
    let mut linkages: Vec<&str> = (sensors.actuators.iter())
        .map(|signal| &machine.contact().actuated_joints[signal.joint])
        .map(|joint| machine.linkages()[joint.linkage].name.as_str())
        .collect();
    linkages.dedup();
    if linkages.is_empty() {
        return None;
    }
    let used = rows.outcomes.column(Quantity::MeasuredTorques);
    let with = used.iter().filter(|&&torques| torques > 0.0).count();
    if with == 0 {
        return Some(format!(
            "The forces of {} were not used: they are missing in every row, or the model cannot use them.",
            linkages.join(", ")
        ));
    }
    Some(format!(
        "In {:.1} % of the rows the measured forces of {} determined the load split (column measured_torques). There \
         the split rule has no effect, and envelope and standard deviations follow from the forces.",
        100.0 * with as f64 / used.len() as f64,
        linkages.join(", ")
    ))
}

/// The bias of the accelerometer that was subtracted, or that none could be estimated.
fn accelerometer_bias(loaded: &LoadedLog, rows: &Rows) -> Option<String> {
    let machine = &loaded.machine;
    let stated = machine.uncertainty().accelerometer_bias;
    if !loaded.matched.sensors.imu || stated <= 0.0 {
        return None;
    }
    let mut state = State::zero(machine);
    let (mut removed, mut variance, mut known) = ([0.0; 3], [0.0; 3], 0.0);
    for row in (0..rows.len()).filter(|&row| rows.is_valid(row)) {
        rows.states.get(row, &mut state);
        let bias = &state.noise.accelerometer_bias;
        if bias.covariance_change == [0.0; 6] {
            continue;
        }
        known += 1.0;
        for (i, axis) in Axis::ALL.into_iter().enumerate() {
            removed[i] += bias.removed[i];
            variance[i] += state.sigma(machine, Parameter::SpecificForce(axis)).powi(2);
        }
    }
    if known == 0.0 {
        return Some(format!(
            "The bias of the accelerometer could not be estimated: there is neither an attitude with odometry nor a standstill, or \
             the IMU is not on the base. Its stated standard deviation of {stated} m/s² remains in every band."
        ));
    }
    let mean = |i: usize| {
        let (removed, sigma) = (removed[i] / known, f64::sqrt(variance[i] / known));
        format!("{} {removed:+.3} ± {sigma:.3}", Axis::ALL[i].name())
    };
    Some(format!(
        "Bias of the accelerometer, estimated from attitude, odometry and standstill and subtracted (mean, IMU axes, ± one \
         standard deviation): {}, {}, {} m/s².",
        mean(0),
        mean(1),
        mean(2)
    ))
}

fn skipped_chunks(chunks: u64) -> Option<String> {
    (chunks > 0).then(|| {
        format!(
            "Skipped {chunks} chunks of the log that contain no used topic according to its index. They were not checked \
             for damage; tipwatch recover checks every byte."
        )
    })
}

fn missing_wheel_joints(loaded: &LoadedLog) -> Option<String> {
    let missing: Vec<_> = loaded
        .machine
        .joints()
        .iter()
        .filter(|j| !j.logged && j.constant.is_none())
        .map(|j| j.name.as_str())
        .collect();
    if missing.is_empty() {
        return None;
    }
    let source = if loaded.matched.sensors.odometry {
        "their velocities follow from odometry, assuming rolling without slip"
    } else {
        "they are assumed at rest, because there is no odometry either"
    };
    Some(format!(
        "Wheel joints missing from the joint states: {}; {source}.",
        missing.join(", ")
    ))
}
