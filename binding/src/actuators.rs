//! Finds the actuator force signals that determine the load split: numbers from any messages.

use tipwatch_ingest::{
    Error, Log, SampleSpec, SensorKind, SensorRequest, ValueSource, topic_of_field,
};
use tipwatch_mechanics::machine::ActuatorSignal;
use tipwatch_mechanics::machine::{FieldSpec, LinkageSpec, Machine, MachineSpec};
use tipwatch_mechanics::state::Sensor;

use crate::bound_log::BoundSensor;
use crate::number_signals::number_field;

/// The actuator force signals in a log.
#[derive(Debug, Default)]
pub(crate) struct FoundActuators {
    /// For [`Sensors::actuators`](tipwatch_mechanics::state::Sensors::actuators).
    pub(crate) signals: Vec<ActuatorSignal>,
    /// What to read, in the same order.
    pub(crate) sensors: Vec<BoundSensor>,
    /// Bound signals missing from the log, as sentences.
    pub(crate) notes: Vec<String>,
}

/// Finds the signals of all actuated joints of a machine. A joint without its topic in the log is
/// omitted and reported.
///
/// # Errors
/// The log cannot be read.
pub(crate) fn find(
    log: &Log,
    spec: &MachineSpec,
    machine: &Machine,
) -> Result<FoundActuators, Error> {
    let contact = machine.contact();
    let bound: Vec<(&LinkageSpec, Vec<(&FieldSpec, &str)>)> = (contact.actuated_joints.iter())
        .map(|joint| &spec.linkage[joint.linkage])
        .map(|linkage| (linkage, bound_fields(spec, linkage)))
        .collect();
    let lacks =
        |(field, _): &&(&FieldSpec, &str)| !log.topics().iter().any(|t| t.name == field.topic);
    let missing = |joint: usize| bound[joint].1.iter().find(lacks);
    let mut found = FoundActuators {
        signals: contact.actuator_signals(|joint| missing(joint).is_none()),
        ..FoundActuators::default()
    };
    for (index, signal) in found.signals.iter().enumerate() {
        let (linkage, fields) = &bound[signal.joint];
        let (field, description) = fields[signal.signal];
        found.sensors.push(BoundSensor {
            sensor: Sensor::Actuator(index),
            request: request(log, field)?,
            why: format!(
                "{description} of linkage {}, named by the machine file",
                linkage.name
            ),
        });
    }
    for (joint, (linkage, _)) in bound.iter().enumerate() {
        if let Some((field, _)) = missing(joint) {
            found.notes.push(format!(
                "Linkage {}: the log has no topic {}, so its force is unknown and the load split follows the rule alone.",
                linkage.name, field.topic
            ));
        }
    }
    Ok(found)
}

/// The fields of [`ActuatedJoint::signals`](tipwatch_mechanics::machine::ActuatedJoint), in order,
/// each with its description.
fn bound_fields<'s>(
    spec: &'s MachineSpec,
    linkage: &'s LinkageSpec,
) -> Vec<(&'s FieldSpec, &'static str)> {
    match (spec.force_of(linkage), &linkage.pressure) {
        (Some(force), _) => vec![(force, "force")],
        (None, Some(pressure)) => vec![
            (&pressure.piston, "piston-side pressure"),
            (&pressure.rod, "rod-side pressure"),
        ],
        (None, None) => Vec::new(),
    }
}

fn request(log: &Log, field: &FieldSpec) -> Result<SensorRequest, Error> {
    let number = number_field(field, "effort");
    Ok(SensorRequest {
        topic: topic_of_field(log, &field.topic, &number.field)?.id,
        kind: SensorKind::Number,
        joint_names: Vec::new(),
        other_parts: Vec::new(),
        numbers: Some(SampleSpec {
            values: vec![ValueSource::Field(number)],
            has_roll_pitch_yaw: false,
        }),
    })
}
