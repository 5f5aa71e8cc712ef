//! Binds a machine to a log: finds the topics, checks the machine, determines the requests.

use std::ops::ControlFlow;

use tipwatch_ingest::{
    Binding, Log, NamedTopics, RobotDescription, SensorKind, SensorRequest, SensorTopics,
    robot_descriptions,
};
use tipwatch_language::{say, told, word};
use tipwatch_mechanics::MachineError;
use tipwatch_mechanics::machine::{LogFacts, Machine, MachineSpec, OneOrMany, SignalSpec};
use tipwatch_mechanics::state::{JointStream, MatchedSensors, OtherSensors, Sensor};

use crate::bound_log::{BoundLog, BoundSensor};
use crate::error::BindError;
use crate::machine_file::{mass_text, other_mass};
use crate::number_signals::{self, NumberSignals};
use crate::sources::{Found, FoundJoints, JointSource};
use crate::transforms::{static_transforms, twice_noted};
use crate::{actuators, monitor_topic};

/// Lost parts of a log that a message lists.
const MOST_LOST_RANGES: usize = 3;

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
        frames: signals.frames.clone(),
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
    let bound = monitor_topic::bound(log, spec);
    let spec = bound.as_ref();
    check_clock_topics(log, spec)?;
    let named = named_topics(spec);
    let numbers = NumberSignals::find(log, &spec.signals)?;
    let mut topics = SensorTopics::find(log, &named)?;
    if numbers.imu_frame.is_some() {
        topics.imu_frame.clone_from(&numbers.imu_frame);
    }
    if numbers.tool_wrench_frame.is_some() {
        topics.tool_wrench_frame = numbers.tool_wrench_frame.clone();
    }
    let found = Found { topics, numbers };
    let mut streams = found.joint_streams(log, &spec.signals.joints);
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
        tool_wrench_frame: found.topics.tool_wrench_frame.as_deref(),
        static_transforms: &static_transforms,
    };
    let mut notes = Vec::new();
    let checked = spec.check(urdf_text, urdf_name, facts);
    let mut machine = checked.map_err(|error| match error {
        MachineError::UnmeasuredJoints { .. } if streams.is_empty() => no_joint_states(log),
        error => error.into(),
    })?;
    let mut matched = match_sensors(&machine, &found, &streams)?;
    if matched.sensors.joints.is_empty() {
        let rows = found.rows(log).ok_or_else(|| no_rows(log, &streams))?;
        notes.extend(other_joints(&streams));
        matched
            .sensors
            .joints
            .push(JointStream { joints: Vec::new() });
        matched.streams.push(streams.len());
        streams.push(rows);
    }
    check_named_once(&machine, &matched, &streams)?;
    let mut sensors = bound_sensors(&machine, &matched, &found, &streams);
    let actuators = actuators::find(log, spec, &machine)?;
    matched.sensors.actuators = actuators.signals;
    sensors.extend(actuators.sensors);
    let beside = number_signals::beside(log, &machine);
    if !matched.sensors.tool_wrench {
        machine.leave_out_tool();
    }
    notes.extend(actuators.notes);
    notes.extend(about_descriptions(log, spec, urdf_text, urdf_name)?);
    notes.extend(twice_noted(&static_transforms));
    Ok(BoundLog {
        machine,
        matched,
        sensors,
        beside,
        topics: found.topics,
        clock_offsets_s: spec.clock.offset.clone(),
        notes,
    })
}

/// Checks that no message names a joint of the machine twice with different positions.
fn check_named_once(
    machine: &Machine,
    matched: &MatchedSensors,
    streams: &[FoundJoints<'_>],
) -> Result<(), BindError> {
    for (stream, &found) in matched.streams.iter().enumerate() {
        let FoundJoints { source, topic, .. } = &streams[found];
        let JointSource::Typed(joints) = source else {
            continue;
        };
        let names = matched.joint_names(machine, stream);
        if let Some(twice) = (joints.twice.iter()).find(|twice| names.contains(&twice.joint)) {
            return Err(BindError::NamedTwice {
                topic: topic.name.clone(),
                joint: twice.joint.clone(),
                positions: twice.positions.clone(),
            });
        }
    }
    Ok(())
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
    let joint_topics = (log.topics().iter())
        .filter(|topic| SensorKind::JointStates.is_type(&topic.type_name))
        .map(|topic| topic.id);
    let joint_topics: Vec<_> = joint_topics.collect();
    let losses = log.read(&joint_topics, &mut |_| ControlFlow::Continue(()));
    let ranges = losses.ok().into_iter().flat_map(|losses| losses.ranges);
    let lost: Vec<String> = ranges
        .map(|range| range.to_string())
        .take(MOST_LOST_RANGES)
        .collect();
    BindError::NoJointStates {
        log: log.path().display().to_string(),
        topics,
        lost: match lost.is_empty() || joint_topics.is_empty() {
            true => String::new(),
            false => format!(" that can be read: {}", lost.join("; ")),
        },
    }
}

/// The joint states of a log are none of the machine's.
fn other_joints(streams: &[FoundJoints<'_>]) -> Option<String> {
    let joints: Vec<&str> = (streams.iter())
        .flat_map(|stream| stream.joints.iter().map(String::as_str))
        .collect();
    (!joints.is_empty()).then(|| {
        say!(
            "No joint of the machine is measured: the joint states of the log name only {}.",
            joints.join(", ")
        )
    })
}

/// Returns the note on the robot descriptions of a log: that earlier ones differ where the last one is the URDF in use, or else
/// that the last one is of another machine than the URDF in use (a wrong machine file, or corrected masses).
fn about_descriptions(
    log: &Log,
    spec: &MachineSpec,
    urdf_text: &str,
    urdf_name: &str,
) -> Result<Option<String>, BindError> {
    let mut described = robot_descriptions(log)?;
    let Some(last) = described.pop() else {
        return Ok(None);
    };
    if spec.urdf.is_none() && last.text == urdf_text {
        return Ok(several(&described, &last));
    }
    let used = RobotDescription {
        topic: urdf_name.into(),
        log_time_ns: last.log_time_ns,
        text: urdf_text.into(),
    };
    Ok(other_mass(&last, &used).map(|masses| {
        let text = |mass: Option<f64>| match mass {
            Some(_) => mass_text(mass),
            None => word!("no mass").into(),
        };
        let (of_log_kg, used_kg) = (text(masses.earlier), text(masses.last));
        say!(
            "The log describes another machine on {} than {urdf_name}: link {} has {of_log_kg} there and {used_kg} here. If the \
             machine file is that of another machine, every load is wrong.",
            last.topic, masses.link
        )
    }))
}

/// The different descriptions of one machine: the last one is used.
fn several(earlier: &[RobotDescription], last: &RobotDescription) -> Option<String> {
    let others = earlier.iter().map(|other| {
        say!(
            "one of {} bytes at log time {} ns",
            other.text.len(),
            other.log_time_ns
        )
    });
    (!earlier.is_empty()).then(|| {
        say!(
            "Topic {} has {} different robot descriptions: the last one is used, of {} bytes at log time {} ns. \
             Before it came {}, without masses or with the same ones.",
            last.topic,
            earlier.len() + 1,
            last.text.len(),
            last.log_time_ns,
            others.collect::<Vec<_>>().join(", ")
        )
    })
}

/// Returns the error for a log without a signal that determines when rows are computed.
fn no_rows(log: &Log, streams: &[FoundJoints<'_>]) -> BindError {
    let joints: Vec<&str> = (streams.iter())
        .flat_map(|stream| stream.joints.iter().map(String::as_str))
        .collect();
    if joints.is_empty() {
        return no_joint_states(log);
    }
    BindError::NoJointOfTheMachine {
        log: log.path().display().to_string(),
        joints: joints.join(", "),
    }
}

fn match_sensors(
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
        tool_wrench: found.has_tool_wrench() && machine.tool().is_some(),
    };
    Ok(MatchedSensors::new(machine, &streams, others)?)
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
            frame_id: binding.frame_id.clone(),
            ..SensorRequest::typed(binding.topic, binding.kind, joint_names)
        },
        why: binding.why.clone(),
    };
    let numbered = |sensor: Sensor, request: &SensorRequest| BoundSensor {
        sensor,
        request: request.clone(),
        why: told(number_signals::WHY).into(),
    };
    let (topics, numbers) = (&found.topics, &found.numbers);
    let mut bound = Vec::new();
    for sensor in matched.sensors.iter() {
        let (binding, request) = match sensor {
            Sensor::Joints(stream) => {
                bound.push(match &streams[matched.streams[stream]].source {
                    JointSource::Typed(found) => {
                        let names = matched.joint_names(machine, stream);
                        typed(sensor, &found.binding, names)
                    }
                    JointSource::Numbers(request) => numbered(sensor, request),
                    JointSource::Rows(request) => BoundSensor {
                        sensor,
                        request: request.clone(),
                        why: word!("no joint is measured: rows are at the times of these messages")
                            .into(),
                    },
                });
                continue;
            }
            Sensor::Imu => (&topics.imu, &numbers.imu),
            Sensor::Odometry => (&topics.odometry, &numbers.odometry),
            Sensor::ToolWrench => (&topics.tool_wrench, &numbers.tool_wrench),
            // found later, once the machine is known
            Sensor::Number(..) => {
                continue;
            }
        };
        bound.extend(binding.iter().map(|b| typed(sensor, b, Vec::new())));
        bound.extend(request.iter().map(|request| numbered(sensor, request)));
    }
    bound
}
