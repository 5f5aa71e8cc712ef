//! Forces of actuators that tell how the wheels share the load: numbers of any messages.

use tipwatch_ingest::{
    Error, Log, NumberSample, SampleValue, SensorKind, SensorRequest, topic_of_field,
};
use tipwatch_mechanics::machine::ActuatorSignal;
use tipwatch_mechanics::machine::{FieldSpec, LinkageSpec, Machine, MachineSpec};
use tipwatch_mechanics::state::Sensor;

use crate::BoundSensor;
use crate::number_signals::number_field;

/// What a log has of the actuated joints' forces.
#[derive(Debug, Default)]
pub(crate) struct FoundActuators {
    /// For [`Sensors::actuators`](tipwatch_mechanics::state::Sensors::actuators).
    pub(crate) signals: Vec<ActuatorSignal>,
    /// What to read, in that order.
    pub(crate) sensors: Vec<BoundSensor>,
    /// What is bound and not there, in plain sentences.
    pub(crate) notes: Vec<String>,
}

/// Finds the signals of every actuated joint of a machine. A joint of which the log lacks a topic is left
/// out and told of.
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
    for (place, signal) in found.signals.iter().enumerate() {
        let (linkage, fields) = &bound[signal.joint];
        let (field, what) = fields[signal.signal];
        found.sensors.push(BoundSensor {
            sensor: Sensor::Actuator(place),
            request: request(log, field)?,
            why: format!(
                "{what} of linkage {}, named by the machine file",
                linkage.name
            ),
        });
    }
    for (joint, (linkage, _)) in bound.iter().enumerate() {
        if let Some((field, _)) = missing(joint) {
            found.notes.push(format!(
                "Linkage {}: the log has no topic {}, so its force is unknown and the split rule alone shares the load.",
                linkage.name, field.topic
            ));
        }
    }
    Ok(found)
}

/// The fields of the signals of [`ActuatedJoint::signals`](tipwatch_mechanics::machine::ActuatedJoint),
/// in their order, and what they are.
fn bound_fields<'s>(
    spec: &'s MachineSpec,
    linkage: &'s LinkageSpec,
) -> Vec<(&'s FieldSpec, &'static str)> {
    match (spec.force_of(linkage), &linkage.pressure) {
        (Some(force), _) => vec![(force, "force")],
        (None, Some(pressure)) => vec![
            (&pressure.piston, "pressure on the piston's side"),
            (&pressure.rod, "pressure on the rod's side"),
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
        numbers: Some(NumberSample {
            values: vec![SampleValue::Field(number)],
            has_roll_pitch_yaw: false,
        }),
    })
}
