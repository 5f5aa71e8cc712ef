//! Units of the forces and pressures of actuators that carry wheels: together they bear a share of the weight.

use tipwatch_mechanics::state::Sensor;

use super::windows::median;
use super::{GrossInput, GrossInputKind};
use crate::base::number::{percent, short};
use crate::load::LoadedLog;

/// Smallest and largest force of an actuator as a share of the weight: one that carries wheels is within, in
/// kilonewtons or bar none is.
const FORCE_SHARE: [f64; 2] = [0.002, 60.0];

/// Actuators whose logged force cannot be one that carries wheels, one finding for each linkage.
pub(super) fn scales(loaded: &LoadedLog) -> Vec<GrossInput> {
    let machine = &loaded.machine;
    let weight = machine.mass() * machine.gravity();
    let joints = machine.contact().actuated_joints.iter().enumerate();
    joints
        .filter_map(|(index, joint)| {
            // an outrigger carries nothing for most of the time
            joint.linkage()?;
            let mut forces = Vec::new();
            let mut topics = Vec::new();
            for signal in loaded.signals.iter() {
                let Sensor::Actuator(at) = signal.sensor else {
                    continue;
                };
                let of_joint = &loaded.matched.sensors.actuators[at];
                if of_joint.joint == index {
                    let factor = joint.signals[of_joint.signal].abs();
                    let mut reader = signal.recording.reader();
                    let samples = 0..signal.recording.len();
                    let sizes = samples.map(|at| reader.sample(at)[0].abs() * factor);
                    forces.extend(median(sizes));
                    topics.push(signal.topic.as_str());
                }
            }
            // the chamber under pressure counts, not the one that drains
            let force = forces.into_iter().reduce(f64::max)?;
            let [least, largest] = FORCE_SHARE;
            if force == 0.0 || (least..=largest).contains(&(force / weight)) {
                return None;
            }
            let name = joint.name(machine.linkages());
            Some(GrossInput {
                kind: GrossInputKind::ActuatorScale,
                headline: format!(
                    "The force of {name} is {} of the weight: force or pressure is in another unit",
                    percent(force / weight)
                ),
                evidence: vec![format!(
                    "Median {} N, from {}; the machine weighs {} N",
                    short(force),
                    topics.join(", "),
                    short(weight)
                )],
                fix: "add a scale to the bound field: 1000 for kN, 100000 for bar, 1000000 for MPa"
                    .into(),
            })
        })
        .collect()
}
