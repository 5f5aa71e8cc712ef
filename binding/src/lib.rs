//! Binds a machine to a log: which topic carries which sensor.
//!
//! [`tipwatch_ingest`] knows no machine and [`tipwatch_mechanics`] opens no file; offline and live
//! analysis both need this step between them. [`MachineFile`] is read from disk. [`bind`] finds the
//! topics, checks the machine against the log and determines what to read. [`BoundLog::record`]
//! reads it.

#![forbid(unsafe_code)]

mod actuators;
mod machine_file;
pub mod monitor_topic;
mod number_signals;
mod record;

use std::collections::BTreeMap;

use tipwatch_ingest::{
    Binding, JointTopic, Log, NamedTopics, SensorKind, SensorRecording, SensorRequest,
    SensorTopics, Topic, arrival_order, static_frames,
};
use tipwatch_mechanics::MachineError;
use tipwatch_mechanics::machine::{
    LogFacts, Machine, MachineSpec, OneOrMany, SignalSpec, StaticTransform,
};
use tipwatch_mechanics::state::{JointTwice, MatchedSensors, OtherSensors, Sample, Sensor};

pub use machine_file::{MachineFile, MachineFileError, Urdf};
pub use number_signals::number_field;

use number_signals::NumberSignals;

/// A machine bound to a log.
#[derive(Debug)]
pub struct BoundLog {
    /// The machine, checked against the log.
    pub machine: Machine,
    /// Its sensors, in the form that the estimators use.
    pub matched: MatchedSensors,
    /// What to read for each sensor, in the order of
    /// [`Sensors::iter`](tipwatch_mechanics::state::Sensors::iter).
    pub sensors: Vec<BoundSensor>,
    /// All topics found, used or not.
    pub topics: SensorTopics,
    /// Clock offsets from the machine file, to be added to the stamps (s), by topic.
    pub clock_offsets_s: BTreeMap<String, f64>,
    /// Bound signals missing from the log, as sentences.
    pub notes: Vec<String>,
}

/// A sensor and the topic that carries it.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundSensor {
    /// The sensor of the machine.
    pub sensor: Sensor,
    /// What to read.
    pub request: SensorRequest,
    /// Why this topic was chosen.
    pub why: String,
}

/// Why a machine cannot be bound to a log.
#[derive(Debug, thiserror::Error)]
pub enum BindError {
    /// The log cannot be read, or a signal is missing, of the wrong type or ambiguous.
    #[error(transparent)]
    Log(#[from] tipwatch_ingest::Error),
    /// The machine description is invalid, or the log lacks what it needs.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// Two topics measure one joint.
    #[error(transparent)]
    JointTwice(#[from] JointTwice),
    /// No topic carries joint states.
    #[error("{log}: expected joint states ({}), found none; the log has: {topics}", SensorKind::JointStates.type_name())]
    NoJointStates {
        /// The log.
        log: String,
        /// Every topic with its type.
        topics: String,
    },
    /// The machine file states the clock offset of a topic that does not exist.
    #[error("{file}: clock.offset.\"{topic}\": expected a topic of {log}, which has: {topics}")]
    NoTopicOfClock {
        /// The machine file.
        file: String,
        /// The topic.
        topic: String,
        /// The log.
        log: String,
        /// Every topic of the log.
        topics: String,
    },
    /// The joint states contain none of the machine's joints.
    #[error("{log}: expected joint states of the machine's joints, found only: {joints}")]
    NoJointOfTheMachine {
        /// The log.
        log: String,
        /// The joints that the log has.
        joints: String,
    },
}

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
        let place = |stream: &FoundJoints<'_>| {
            let names = &mut named.joint_states.iter();
            names.position(|name| *name == stream.topic.name)
        };
        streams.sort_by_key(place);
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

/// All sources of signals: topics of standard types, and single numbers.
struct Found {
    topics: SensorTopics,
    numbers: NumberSignals,
}

/// Joints measured together on one topic.
struct FoundJoints<'f> {
    topic: &'f Topic,
    joints: Vec<String>,
    source: JointSource<'f>,
}

/// The source of joints.
enum JointSource<'f> {
    Typed(&'f JointTopic),
    Numbers(&'f SensorRequest),
}

impl Found {
    fn has_imu(&self) -> bool {
        self.topics.imu.is_some() || self.numbers.imu.is_some()
    }

    fn has_odometry(&self) -> bool {
        self.topics.odometry.is_some() || self.numbers.odometry.is_some()
    }

    fn has_tool_wrench(&self) -> bool {
        self.topics.tool_wrench.is_some() || self.numbers.tool_wrench.is_some()
    }

    /// The streams of joints, the one with most messages first. Joints that the machine file binds
    /// number by number are removed from the others.
    fn joint_streams<'f>(&'f self, log: &'f Log) -> Vec<FoundJoints<'f>> {
        let is_numbered = |name: &String| self.numbers.joints.iter().any(|j| j.joint == *name);
        let typed = self.topics.joint_states.iter().map(|found| FoundJoints {
            topic: &log.topics()[found.binding.topic.index()],
            joints: (found.joint_names.iter())
                .filter(|name| !is_numbered(name))
                .cloned()
                .collect(),
            source: JointSource::Typed(found),
        });
        let numbered = self.numbers.joints.iter().map(|found| FoundJoints {
            topic: &log.topics()[found.request.topic.index()],
            joints: vec![found.joint.clone()],
            source: JointSource::Numbers(&found.request),
        });
        let mut streams: Vec<FoundJoints<'_>> = typed.chain(numbered).collect();
        streams.sort_by_key(|stream| std::cmp::Reverse(stream.topic.message_count));
        streams
    }
}

/// The static transforms on a log's `/tf_static`.
///
/// # Errors
/// The log cannot be read.
pub fn static_transforms(log: &Log) -> Result<Vec<StaticTransform>, BindError> {
    let frames = static_frames(log)?.into_iter();
    let transform = |f: tipwatch_ingest::StaticFrame| {
        StaticTransform::new(&f.parent, &f.child, f.translation_m, f.rotation_xyzw)
    };
    Ok(frames.map(transform).collect())
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

/// All samples of the sensors with their log times (ns), in the order of arrival at the recorder,
/// as a live system would have seen them.
pub fn arrivals<'a>(
    signals: Vec<(Sensor, &'a SensorRecording)>,
) -> impl Iterator<Item = (Sample<'a>, i64)> {
    let recordings: Vec<&SensorRecording> =
        signals.iter().map(|(_, recording)| *recording).collect();
    arrival_order(&recordings)
        .into_iter()
        .map(move |(signal, index)| {
            let (sensor, recording) = signals[signal];
            let sample = Sample {
                sensor,
                stamp_ns: recording.stamps_ns[index],
                values: recording.sample(index),
            };
            (sample, recording.log_times_ns[index])
        })
}
