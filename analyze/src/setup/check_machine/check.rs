//! Computes masses, geometry and static loads of the machine that a file describes.

use std::f64::consts::PI;
use std::path::Path;

use anyhow::{Result, ensure};
use tipwatch_binding::MachineFile;
use tipwatch_calibration::identification::{Data, agreement};
use tipwatch_mechanics::machine::{Machine, MeasuredJoint, MountSource, WeighedSpec, Wheel};
use tipwatch_mechanics::{MassShare, RestingMachine};

use super::document::{MachineCheck, PartMass, SCHEMA, WheelCheck, posture, triple};
use super::geometry::{axles, sums, wheelbase};
use super::readings;
use crate::analysis::posture_in_log;
use crate::base::number::known;
use crate::setup::identify::{AgreementRow, weighings};

/// Widest ranges between limits that say something about a joint: a turn, with room for a rounded pi (rad), and the slide of a
/// long boom (m).
const WIDEST_TURN: f64 = 1.01 * std::f64::consts::TAU;
const WIDEST_SLIDE: f64 = 2.0;
/// A silence (s) that a joint of a heavy machine does not need for its whole range.
const LONG_SILENCE_S: f64 = 1.0;

/// Checks a machine file, in the posture of the log's first valid row if there is a log, else in its reference posture.
///
/// # Errors
/// The machine file does not describe a machine, or the log does not fit it.
pub fn check(file: &MachineFile, log: Option<&Path>) -> Result<MachineCheck> {
    let mut notes = Vec::new();
    let (machine, positions, source) = match log {
        Some(log) => {
            let (machine, positions, gross_inputs) = posture_in_log(log, file)?;
            notes.extend(
                (gross_inputs.iter())
                    .map(|input| format!("{}. Likely correction: {}.", input.headline, input.fix)),
            );
            ensure!(
                positions.iter().all(|p| p.is_finite()),
                "{}: expected a row with the positions of all joints, found none",
                log.display()
            );
            let source = format!("the first valid row of {}", log.display());
            (machine, positions, source)
        }
        None => {
            let machine = file.check_alone()?;
            let reference = machine.reference().posture.clone();
            let source = reference.source().into();
            (machine, reference.positions, source)
        }
    };
    let standing = RestingMachine::new(&machine, &positions);
    let posture = posture(&machine, &positions, source);
    notes.extend(machine.notes().iter().map(ToString::to_string));
    notes.extend(wide_limits(&machine));
    notes.extend(wide_rates(&machine));
    notes.extend(anomalies(&machine, &standing));
    let weighed = file.spec.weighed.as_ref();
    let mut scales = Data::default();
    if let Some(weighed) = weighed {
        notes.extend(weighings::add(&machine, weighed, &positions, &mut scales));
    }
    let mut weighings = weighed.map_or(Vec::new(), |weighed| {
        readings::compare(&machine, weighed, &positions, &posture)
    });
    let has_own = weighed.is_some_and(WeighedSpec::has_own);
    Ok(MachineCheck {
        schema: SCHEMA,
        name: machine.name().into(),
        machine_file: file.path.display().to_string(),
        base_link: machine.base_link().into(),
        gravity_m_s2: machine.gravity(),
        masses: masses(&standing),
        wheelbase_m: wheelbase(&standing),
        axles: axles(&machine, &standing),
        wheels: wheels(&machine, &standing),
        sums: sums(&machine, &standing),
        imu_mounting: imu_mounting(&machine, log.is_some()),
        weighed: has_own.then(|| weighings.remove(0)),
        weighings,
        agreement: agreement(&machine, &scales).map(AgreementRow::from),
        posture,
        notes,
        commissioning: None,
    })
}

/// Without a log the frames of the messages are unknown.
fn imu_mounting(machine: &Machine, has_log: bool) -> String {
    match &machine.imu().source {
        MountSource::Assumed { .. } if !has_log => {
            "not in the machine file; taken from frame_id of the log".into()
        }
        source => source.to_string(),
    }
}

fn masses(standing: &RestingMachine) -> Vec<PartMass> {
    let parts = [
        ("platform", standing.chassis),
        ("wheels", standing.wheels),
        ("arm", standing.arm),
        ("payloads", standing.payloads),
        ("whole", standing.whole()),
    ];
    let part = |(part, share): (_, MassShare)| PartMass {
        part,
        mass_kg: share.mass,
        centre_of_mass_m: Some(triple(&share.com)).filter(|com| com.iter().all(|c| c.is_finite())),
    };
    parts.into_iter().map(part).collect()
}

fn wheels(machine: &Machine, standing: &RestingMachine) -> Vec<WheelCheck> {
    let wheel = |(i, wheel): (usize, &Wheel)| {
        let (load, sigma) = standing.load_of(&[i]);
        WheelCheck {
            wheel: wheel.name.clone(),
            centre_m: triple(&standing.wheel_centres[i]),
            radius_m: wheel.radius,
            static_load_n: known(load),
            sigma_n: known(sigma),
            share: known(load / standing.outcome().normal_force),
        }
    };
    machine.wheels().iter().enumerate().map(wheel).collect()
}

/// Names the sensed joints whose limits leave room for every wrong position. A joint without limits, such as a slewing ring, has
/// no such check by its kind.
fn wide_limits(machine: &Machine) -> Option<String> {
    let is_wide = |(index, joint): &(usize, &MeasuredJoint)| {
        let widest = match machine.joint_slides(*index) {
            true => WIDEST_SLIDE,
            false => WIDEST_TURN,
        };
        let range = joint.limits.map_or(0.0, |[least, most]| most - least);
        range > widest
    };
    let joints = sensed(machine).filter(is_wide);
    let names: Vec<&str> = joints.map(|(_, joint)| joint.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "Limits in the URDF wider than a turn or {WIDEST_SLIDE} m: {}. No position of these joints is beyond them, so a wrong one is \
             not found by its limits. State those of the machine.",
            names.join(", ")
        )
    })
}

fn sensed(machine: &Machine) -> impl Iterator<Item = (usize, &MeasuredJoint)> {
    let is_sensed = |joint: &MeasuredJoint| {
        joint.logged && joint.constant.is_none() && joint.spins_wheel.is_none()
    };
    let joints = machine.joints().iter().enumerate();
    joints.filter(move |(_, joint)| is_sensed(joint))
}

/// Names the joints of the arm that are so fast by the machine file that they may be anywhere after a short silence: an encoder that
/// was set anew, slipped or stopped meanwhile is not told from one that moved.
fn wide_rates(machine: &Machine) -> Option<String> {
    let gap_s = machine.estimator().max_gap;
    let anywhere_after_s = |index: usize, joint: &MeasuredJoint| {
        let range = joint
            .limits
            .map_or(f64::INFINITY, |[least, most]| most - least);
        let farthest = match (machine.joint_turns(index), machine.joint_slides(index)) {
            // the shorter way round
            (true, _) => PI,
            (false, true) => range.min(WIDEST_SLIDE),
            (false, false) => range,
        };
        farthest / machine.greatest_joint_rate(index)
    };
    let [mut after_gap, mut after_silence] = [Vec::new(), Vec::new()];
    for (index, joint) in sensed(machine).filter(|(index, _)| !machine.is_steering(*index)) {
        match anywhere_after_s(index, joint) {
            time_s if time_s <= gap_s => after_gap.push(joint.name.as_str()),
            time_s if time_s <= LONG_SILENCE_S => after_silence.push(joint.name.as_str()),
            _ => {}
        }
    }
    let told = [(gap_s, after_gap), (LONG_SILENCE_S, after_silence)];
    let told = told.into_iter().filter(|(_, names)| !names.is_empty());
    let told = told.map(|(time_s, names)| format!("{time_s} s of {}", names.join(", ")));
    let told: Vec<String> = told.collect();
    (!told.is_empty()).then(|| {
        format!(
            "Greatest velocities (the URDF's limit times joint_rate_margin) that lead anywhere in {}. An encoder that slips, stops or is \
             set anew in such a silence is not told from a joint that moved. State the velocities of the machine.",
            told.join("; in ")
        )
    })
}

/// Anomalies of a static posture.
fn anomalies(machine: &Machine, standing: &RestingMachine) -> Vec<String> {
    let mut notes = Vec::new();
    let loads = &standing.outcome().load;
    if loads.iter().any(|load| !load.is_finite()) {
        notes.push(
            "The static loads cannot be computed, because a linkage cannot close in this posture. Give a log or a posture."
                .into(),
        );
    }
    let names = machine.wheels().iter().map(|wheel| &wheel.name);
    for (name, _) in names.zip(loads).filter(|(_, load)| **load <= 0.0) {
        notes.push(format!(
            "Wheel {name} carries no load in this posture: the centre of mass is outside the support polygon, or the model is wrong."
        ));
    }
    let estimated = machine.payloads().iter().enumerate();
    for (i, _) in estimated.filter(|(_, payload)| payload.is_estimated) {
        notes.push(format!(
            "Payload {}: its mass is estimated from a log; zero here.",
            i + 1
        ));
    }
    notes
}
