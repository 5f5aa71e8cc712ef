//! Finds the actuator force signals that determine the load split: numbers from any messages.

use tipwatch_ingest::{Error, Log};
use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::{ActuatorSignal, ForceSource};
use tipwatch_mechanics::machine::{FieldSpec, Machine, MachineSpec};
use tipwatch_mechanics::state::{NumberKind, Sensor};

use crate::bound_log::BoundSensor;
use crate::number_signals::number_request;

/// The actuator force signals in a log.
#[derive(Debug, Default)]
pub(crate) struct FoundActuators {
    /// Value of [`Sensors::actuators`](tipwatch_mechanics::state::Sensors::actuators).
    pub(crate) signals: Vec<ActuatorSignal>,
    /// Requests for the sensors, in the same order.
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
    let bound: Vec<Bound<'_>> = (contact.actuated_joints.iter())
        .map(|joint| Bound::of(spec, &joint.source))
        .collect();
    let lacks =
        |(field, _): &&(&FieldSpec, &str)| !log.topics().iter().any(|t| t.name == field.topic);
    let missing = |joint: usize| bound[joint].fields.iter().find(lacks);
    let mut found = FoundActuators {
        signals: contact.actuator_signals(|joint| missing(joint).is_none()),
        ..FoundActuators::default()
    };
    for (index, signal) in found.signals.iter().enumerate() {
        let bound = &bound[signal.joint];
        let (field, description) = bound.fields[signal.signal];
        found.sensors.push(BoundSensor {
            sensor: Sensor::Number(NumberKind::Actuator, index),
            request: number_request(log, field)?,
            why: say!("{description} of {}, named by the machine file", bound.of),
        });
    }
    for (joint, bound) in bound.iter().enumerate() {
        if let Some((field, _)) = missing(joint) {
            let (first, rest) = bound.of.split_at(1);
            found.notes.push(say!(
                "{}{rest}: the log has no topic {}, so its force is unknown and the load split follows the rule alone.",
                first.to_uppercase(),
                field.topic
            ));
        }
    }
    Ok(found)
}

/// A measured force: the linkage or joint it acts on, and the fields of the log that measure it.
struct Bound<'s> {
    of: String,
    /// The fields of [`ActuatedJoint::signals`](tipwatch_mechanics::machine::ActuatedJoint), in order, each with its
    /// description.
    fields: Vec<(&'s FieldSpec, &'static str)>,
}

impl<'s> Bound<'s> {
    fn of(spec: &'s MachineSpec, source: &ForceSource) -> Self {
        match source {
            ForceSource::Linkage(linkage) => {
                let linkage = &spec.linkage[*linkage];
                Self {
                    of: say!("linkage {}", linkage.name),
                    fields: match &spec.signals_of(linkage)[..] {
                        &[piston, rod] => {
                            vec![
                                (piston, word!("piston-side pressure")),
                                (rod, word!("rod-side pressure")),
                            ]
                        }
                        force => force.iter().map(|force| (*force, word!("force"))).collect(),
                    },
                }
            }
            ForceSource::Support { name, .. } => {
                let load = spec.wheels.get(name).and_then(|w| w.origin.force.as_ref());
                Self {
                    of: say!("support {name}"),
                    fields: load
                        .iter()
                        .map(|load| (&load.field, word!("load")))
                        .collect(),
                }
            }
        }
    }
}
