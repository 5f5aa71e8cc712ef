//! Signals that the machine file binds number by number: turns `[signals]` tables into requests.

use std::slice;

use tipwatch_ingest::{
    Error, Log, NumberField, SampleSpec, SensorKind, SensorRequest, TopicId, ValueSource,
    first_frame, topic_of_field,
};
use tipwatch_language::{message, say, word};
use tipwatch_mechanics::machine::{
    FieldSpec, JointFields, Machine, NumberSpec, SignalSpec, SignalsSpec, SupportId,
};
use tipwatch_mechanics::state::{NumberKind, Sensor};

use crate::bound_log::BoundSensor;

/// The reason given for topics whose numbers the machine file names.
pub(crate) const WHY: &str = message!("numbers named by the machine file");

/// A joint whose position the machine file binds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NumberedJoint {
    pub(crate) joint: String,
    pub(crate) request: SensorRequest,
}

/// The requests for all signals that the machine file binds number by number.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct NumberSignals {
    pub(crate) joints: Vec<NumberedJoint>,
    pub(crate) imu: Option<SensorRequest>,
    pub(crate) odometry: Option<SensorRequest>,
    pub(crate) tool_wrench: Option<SensorRequest>,
    /// The frame in the IMU's messages.
    pub(crate) imu_frame: Option<String>,
    /// The frame in the messages of the tool's wrench.
    pub(crate) tool_wrench_frame: Option<String>,
}

/// The location of a number, for example for [`tipwatch_ingest::record_fields`]. `list` is the
/// default array of numbers if the machine file names only a joint.
#[must_use]
pub fn number_field(spec: &FieldSpec, list: &str) -> NumberField {
    NumberField {
        field: spec.field.clone().unwrap_or_else(|| list.into()),
        joint: spec.joint.clone(),
        scale: spec.scale,
        offset: spec.offset,
    }
}

/// Returns the request for the number in a field.
///
/// # Errors
/// Its topic is not in the log.
pub(crate) fn number_request(log: &Log, field: &FieldSpec) -> Result<SensorRequest, Error> {
    request_in(log, field, "effort")
}

fn request_in(log: &Log, field: &FieldSpec, list: &str) -> Result<SensorRequest, Error> {
    let number = number_field(field, list);
    let topic = topic_of_field(log, &field.topic, &number.field)?.id;
    let sample = SampleSpec::of(vec![ValueSource::Field(number)]);
    Ok(SensorRequest::numbered(topic, SensorKind::Number, sample))
}

/// The signals from which the state is not estimated, as far as their topic is in the log: the switches of supports, the load
/// sensors, the rates that a controller asks of joints, the masses of payloads, the forces of the arm. Whoever uses them says which are
/// missing.
pub(crate) fn beside(log: &Log, machine: &Machine) -> Vec<BoundSensor> {
    let bound = |kind, index, field: &FieldSpec, list: &str, why: String| {
        let request = request_in(log, field, list).ok()?;
        Some(BoundSensor {
            sensor: Sensor::Number(kind, index),
            request,
            why,
        })
    };
    let supports = machine.supports();
    let switches = supports.switches.iter().enumerate().map(|(index, switch)| {
        let name = |support: &SupportId| supports.support(*support).name.as_str();
        let names: Vec<&str> = switch.supports.iter().map(name).collect();
        let why = say!(
            "what tells of support {}, named by the machine file",
            names.join(", ")
        );
        bound(
            NumberKind::Switch,
            index,
            &switch.spec.number,
            "effort",
            why,
        )
    });
    let loads = machine
        .load_sensors()
        .iter()
        .enumerate()
        .map(|(index, load)| {
            let why = say!("load sensor {}, named by the machine file", load.name);
            bound(NumberKind::Load, index, &load.field, "effort", why)
        });
    let commands = machine
        .joint_commands()
        .iter()
        .enumerate()
        .map(|(index, command)| {
            let name = &machine.joints()[command.joint].name;
            let why = say!("rate asked of joint {name}, named by the machine file");
            bound(NumberKind::Command, index, &command.field, "velocity", why)
        });
    let payloads = machine
        .payload_signals()
        .iter()
        .enumerate()
        .map(|(index, payload)| {
            let why = word!("tells the mass of a payload, named by the machine file").into();
            bound(NumberKind::Payload, index, &payload.field, "effort", why)
        });
    let forces = machine
        .force_signals()
        .iter()
        .enumerate()
        .map(|(index, force)| {
            let name = &machine.linkages()[force.linkage].name;
            let why = say!("force of linkage {name}, named by the machine file");
            bound(NumberKind::Force, index, &force.field, "effort", why)
        });
    let all = switches.chain(loads).chain(commands).chain(payloads);
    all.chain(forces).flatten().collect()
}

/// Kinds of sensors that the machine file binds number by number.
pub(crate) fn kinds(signals: &SignalsSpec) -> Vec<SensorKind> {
    fn is_table<T>(signal: Option<&SignalSpec<T>>) -> bool {
        signal.is_some_and(|signal| signal.fields().is_some())
    }
    let tables = [
        (SensorKind::Imu, is_table(signals.imu.as_ref())),
        (SensorKind::Odometry, is_table(signals.odometry.as_ref())),
        (
            SensorKind::ToolWrench,
            is_table(signals.tool_wrench.as_ref()),
        ),
    ];
    let bound = tables.into_iter().filter(|(_, bound)| *bound);
    bound.map(|(kind, _)| kind).collect()
}

impl NumberSignals {
    /// Finds the topics of all numbers.
    ///
    /// # Errors
    /// A topic is not in the log, or the log cannot be read.
    pub(crate) fn find(log: &Log, signals: &SignalsSpec) -> Result<Self, Error> {
        let mut found = Self::default();
        for (joint, fields) in &signals.joints {
            found.joints.extend(numbered_joint(log, joint, fields)?);
        }
        if let Some(imu) = signals.imu.as_ref().and_then(SignalSpec::fields) {
            let parts = Parts {
                first: &imu.specific_force,
                second: Some(&imu.angular_velocity),
                orientation: imu.orientation.as_ref(),
                roll_pitch_yaw: imu.roll_pitch_yaw.as_ref(),
            };
            found.imu = parts.request(log, SensorKind::Imu)?;
            if let Some(request) = &found.imu {
                found.imu_frame = first_frame(log, request.topic)?;
            }
        }
        if let Some(odometry) = signals.odometry.as_ref().and_then(SignalSpec::fields) {
            let parts = Parts {
                first: &odometry.velocity,
                second: odometry.angular_velocity.as_ref(),
                orientation: odometry.orientation.as_ref(),
                roll_pitch_yaw: odometry.roll_pitch_yaw.as_ref(),
            };
            found.odometry = parts.request(log, SensorKind::Odometry)?;
        }
        if let Some(wrench) = signals.tool_wrench.as_ref().and_then(SignalSpec::fields) {
            let parts = Parts {
                first: &wrench.force,
                second: Some(&wrench.moment),
                orientation: None,
                roll_pitch_yaw: None,
            };
            found.tool_wrench = parts.request(log, SensorKind::ToolWrench)?;
            if let Some(request) = &found.tool_wrench {
                found.tool_wrench_frame = first_frame(log, request.topic)?;
            }
        }
        Ok(found)
    }
}

/// The stream of a joint, position and velocity; `None` if no field has its position.
fn numbered_joint(
    log: &Log,
    joint: &str,
    fields: &JointFields,
) -> Result<Option<NumberedJoint>, Error> {
    let Some(position) = fields.position.as_ref().and_then(NumberSpec::field) else {
        // constant, or only its effort is bound
        return Ok(None);
    };
    let velocity = match &fields.velocity {
        Some(velocity) => ValueSource::Field(number_field(velocity, "velocity")),
        None => ValueSource::Absent,
    };
    let position_of = ValueSource::Field(number_field(position, "position"));
    let sample = SampleSpec::of(vec![position_of, velocity]);
    Ok(Some(NumberedJoint {
        joint: joint.into(),
        request: SensorRequest {
            joint_names: vec![joint.into()],
            ..SensorRequest::numbered(topic(log, position)?, SensorKind::JointStates, sample)
        },
    }))
}

fn topic(log: &Log, spec: &FieldSpec) -> Result<TopicId, Error> {
    let wanted = spec.field.as_deref().or(spec.joint.as_deref());
    Ok(topic_of_field(log, &spec.topic, wanted.unwrap_or_default())?.id)
}

/// The parts of a sample. What is on one topic is read together. Samples have the stamps of the
/// first number's topic; what is on other topics is interpolated, each axis of a vector by itself.
struct Parts<'s> {
    first: &'s [NumberSpec; 3],
    second: Option<&'s [NumberSpec; 3]>,
    orientation: Option<&'s [NumberSpec; 4]>,
    roll_pitch_yaw: Option<&'s [NumberSpec; 3]>,
}

/// Start index in the sample of numbers that are on one topic, and the numbers.
type SamplePart<'s> = (usize, &'s [NumberSpec]);

impl Parts<'_> {
    fn request(&self, log: &Log, kind: SensorKind) -> Result<Option<SensorRequest>, Error> {
        let Some(first) = self.first.iter().find_map(NumberSpec::field) else {
            return Ok(None);
        };
        let first = topic(log, first)?;
        let vectors = self.first.iter().chain(self.second.into_iter().flatten());
        let mut parts: Vec<SamplePart<'_>> = vectors.map(slice::from_ref).enumerate().collect();
        parts.extend(self.orientation.map(|numbers| (6, &numbers[..])));
        parts.extend(self.roll_pitch_yaw.map(|numbers| (6, &numbers[..])));
        let mut by_topic: Vec<(TopicId, Vec<SamplePart<'_>>)> = vec![(first, Vec::new())];
        for part in parts {
            let id = match part.1.iter().find_map(NumberSpec::field) {
                Some(field) => topic(log, field)?,
                // constants are known whenever there is a sample
                None => first,
            };
            match by_topic.iter_mut().find(|(topic, _)| *topic == id) {
                Some((_, parts)) => parts.push(part),
                None => by_topic.push((id, vec![part])),
            }
        }
        let samples = by_topic.into_iter().map(|(topic, parts)| {
            let mut values = vec![ValueSource::Absent; kind.value_count(0)];
            let mut has_roll_pitch_yaw = false;
            for (first, numbers) in parts {
                has_roll_pitch_yaw |= first == 6 && numbers.len() == 3;
                let range = first..first + numbers.len();
                for (value, number) in values[range].iter_mut().zip(numbers) {
                    *value = sample_value(number);
                }
            }
            if has_roll_pitch_yaw {
                values.pop();
            }
            let sample = SampleSpec {
                values,
                has_roll_pitch_yaw,
            };
            (topic, sample)
        });
        let mut samples = samples.collect::<Vec<_>>().into_iter();
        Ok(samples.next().map(|(topic, first)| SensorRequest {
            other_parts: samples.collect(),
            ..SensorRequest::numbered(topic, kind, first)
        }))
    }
}

fn sample_value(number: &NumberSpec) -> ValueSource {
    match number {
        NumberSpec::Constant(value) => ValueSource::Constant(*value),
        NumberSpec::Field(field) => ValueSource::Field(number_field(field, "")),
    }
}
