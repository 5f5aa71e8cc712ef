//! Binds a machine to a log: finds the topics, checks the machine, determines what to read.

use tipwatch_ingest::{Binding, Log, NamedTopics, SensorKind, SensorRequest, SensorTopics, Topic};
use tipwatch_mechanics::machine::{LogFacts, Machine, MachineSpec, OneOrMany, SignalSpec};
use tipwatch_mechanics::state::{MatchedSensors, OtherSensors, Sensor};

use crate::bound_log::{BoundLog, BoundSensor};
use crate::error::BindError;
use crate::number_signals::{self, NumberSignals};
use crate::sources::{Found, FoundJoints, JointSource};
use crate::transforms::static_transforms;
use crate::{actuators, monitor_topic};

/// The topics that a machine file names.
#[must_use]
pub fn named_topics(spec: &MachineSpec) -> NamedTopics {
    let signals = &spec.signals;
    NamedTopics {
        joint_states: signals
            .joint_states
            .as_ref()
            .map_or(&[][..], OneOrMany::names)
            .to_vec(),
        imu: signals.imu.as_ref().and_then(SignalSpec::topic).cloned(),
        odometry: (signals.odometry.as_ref())
            .and_then(SignalSpec::topic)
            .cloned(),
        tool_wrench: (signals.tool_wrench.as_ref())
            .and_then(SignalSpec::topic)
            .cloned(),
        bound_by_number: number_signals::kinds(signals),
        has_tool: spec.arm.as_ref().is_some_and(|arm| arm.tool.is_some()),
    }
}

/// Binds a machine, given by its machine file and the text of its URDF, to a log. `urdf_name` is
/// for error messages.
///
/// # Errors
/// The first mismatch between machine and log.
pub fn bind(
    log: &Log,
    spec: &MachineSpec,
    urdf_text: &str,
    urdf_name: &str,
) -> Result<BoundLog, BindError> {
    let is_recorded = monitor_topic::is_in(log);
    let recorded = is_recorded.then(|| monitor_topic::bound(log, spec));
    let spec = recorded.as_ref().unwrap_or(spec);
    check_clock_topics(log, spec)?;
    let named = named_topics(spec);
    let numbers = NumberSignals::find(log, &spec.signals)?;
    let may_carry_joints = |topic: &Topic| {
        SensorKind::JointStates.is_type(&topic.type_name)
            || named.joint_states.contains(&topic.name)
    };
    if numbers.joints.is_empty() && !log.topics().iter().any(may_carry_joints) {
        return Err(no_joint_states(log));
    }
    let mut topics = SensorTopics::find(log, &named)?;
    if numbers.joints.is_empty() && topics.joint_states.is_empty() {
        return Err(no_joint_states(log));
    }
    if numbers.imu_frame.is_some() {
        topics.imu_frame.clone_from(&numbers.imu_frame);
    }
    let found = Found { topics, numbers };
    let mut streams = found.joint_streams(log);
    if is_recorded {
        // in the monitor's order, whatever was lost
        let rank = |stream: &FoundJoints<'_>| {
            let names = &mut named.joint_states.iter();
            names.position(|name| *name == stream.topic.name)
        };
        streams.sort_by_key(rank);
    }
    let joint_names: Vec<String> = streams.iter().flat_map(|s| s.joints.clone()).collect();
    let static_transforms = static_transforms(log)?;
    let facts = LogFacts {
        joint_names: Some(&joint_names),
        lacks_imu: !found.has_imu(),
        imu_frame: found.topics.imu_frame.as_deref(),
        static_transforms: &static_transforms,
    };
    let mut machine = spec.check(urdf_text, urdf_name, facts)?;
    let mut matched = match_sensors(log, &machine, &found, &streams)?;
    let mut sensors = bound_sensors(&machine, &matched, &found, &streams);
    let actuators = actuators::find(log, spec, &machine)?;
    matched.sensors.actuators = actuators.signals;
    sensors.extend(actuators.sensors);
    if !matched.sensors.tool_wrench {
        machine.leave_out_tool();
    }
    Ok(BoundLog {
        machine,
        matched,
        sensors,
        topics: found.topics,
        clock_offsets_s: spec.clock.offset.clone(),
        notes: actuators.notes,
    })
}

fn check_clock_topics(log: &Log, spec: &MachineSpec) -> Result<(), BindError> {
    let names: Vec<&str> = log.topics().iter().map(|t| t.name.as_str()).collect();
    let mut stated = spec.clock.offset.keys();
    match stated.find(|topic| !names.contains(&topic.as_str())) {
        None => Ok(()),
        Some(topic) => Err(BindError::NoTopicOfClock {
            file: spec.file.clone(),
            topic: topic.clone(),
            log: log.path().display().to_string(),
            topics: names.join(", "),
        }),
    }
}

fn no_joint_states(log: &Log) -> BindError {
    let topics: Vec<_> = log
        .topics()
        .iter()
        .map(|t| format!("{} ({})", t.name, t.type_name))
        .collect();
    let topics = if topics.is_empty() {
        "no topics".into()
    } else {
        topics.join(", ")
    };
    BindError::NoJointStates {
        log: log.path().display().to_string(),
        topics,
    }
}

fn match_sensors(
    log: &Log,
    machine: &Machine,
    found: &Found,
    streams: &[FoundJoints<'_>],
) -> Result<MatchedSensors, BindError> {
    let streams: Vec<(&str, &[String])> = (streams.iter())
        .map(|stream| (stream.topic.name.as_str(), stream.joints.as_slice()))
        .collect();
    let others = OtherSensors {
        imu: found.has_imu(),
        odometry: found.has_odometry(),
        tool_wrench: found.has_tool_wrench(),
    };
    let matched = MatchedSensors::new(machine, &streams, others)?;
    if matched.sensors.joints.is_empty() {
        let joints: Vec<&str> = (streams.iter())
            .flat_map(|(_, joints)| joints.iter().map(String::as_str))
            .collect();
        return Err(BindError::NoJointOfTheMachine {
            log: log.path().display().to_string(),
            joints: joints.join(", "),
        });
    }
    Ok(matched)
}

fn bound_sensors(
    machine: &Machine,
    matched: &MatchedSensors,
    found: &Found,
    streams: &[FoundJoints<'_>],
) -> Vec<BoundSensor> {
    let typed = |sensor: Sensor, binding: &Binding, joint_names: Vec<String>| BoundSensor {
        sensor,
        request: SensorRequest {
            topic: binding.topic,
            kind: binding.kind,
            joint_names,
            numbers: None,
            other_parts: Vec::new(),
        },
        why: binding.why.clone(),
    };
    let numbered = |sensor: Sensor, request: &SensorRequest| BoundSensor {
        sensor,
        request: request.clone(),
        why: number_signals::WHY.into(),
    };
    let (topics, numbers) = (&found.topics, &found.numbers);
    let mut bound = Vec::new();
    for sensor in matched.sensors.iter() {
        let (binding, request) = match sensor {
            Sensor::Joints(stream) => {
                bound.push(match streams[matched.streams[stream]].source {
                    JointSource::Typed(found) => {
                        let names = matched.joint_names(machine, stream);
                        typed(sensor, &found.binding, names)
                    }
                    JointSource::Numbers(request) => numbered(sensor, request),
                });
                continue;
            }
            Sensor::Imu => (&topics.imu, &numbers.imu),
            Sensor::Odometry => (&topics.odometry, &numbers.odometry),
            Sensor::ToolWrench => (&topics.tool_wrench, &numbers.tool_wrench),
            // found later, once the machine is known
            Sensor::Actuator(_) => continue,
        };
        bound.extend(binding.iter().map(|b| typed(sensor, b, Vec::new())));
        bound.extend(request.iter().map(|request| numbered(sensor, request)));
    }
    bound
}
