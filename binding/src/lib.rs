//! A machine and a log put together: which topic carries which sensor of which machine.
//!
//! [`tipwatch_ingest`] knows no machine and [`tipwatch_mechanics`] opens no file; offline and live
//! analysis both need this one step between them. [`bind`] finds the topics, checks the machine
//! against what the log has, and says what to read; [`tipwatch_ingest::record_sensors`] then reads it.

#![forbid(unsafe_code)]

use tipwatch_ingest::{
    Binding, JointTopic, Log, NamedTopics, SensorKind, SensorRecording, SensorRequest,
    SensorTopics, Topic, arrival_order, static_frames,
};
use tipwatch_mechanics::MachineError;
use tipwatch_mechanics::machine::{LogFacts, Machine, MachineSpec, OneOrMany, StaticTransform};
use tipwatch_mechanics::signal::{JointTwice, MatchedSensors, OtherSensors, Sample, Sensor};

/// A machine bound to a log.
#[derive(Debug)]
pub struct BoundLog {
    /// The machine as checked against the log.
    pub machine: Machine,
    /// Its sensors, as the estimators want them.
    pub matched: MatchedSensors,
    /// What to read for each sensor, in the order of
    /// [`Sensors::iter`](tipwatch_mechanics::signal::Sensors::iter).
    pub sensors: Vec<BoundSensor>,
    /// The topics found, used or not.
    pub topics: SensorTopics,
}

/// A sensor and the topic that carries it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BoundSensor {
    /// Its place among the machine's sensors.
    pub sensor: Sensor,
    /// What to read.
    pub request: SensorRequest,
    /// Why this topic was taken.
    pub why: String,
}

/// Why a machine and a log do not go together.
#[derive(Debug, thiserror::Error)]
pub enum BindError {
    /// The log cannot be read, or a signal is missing, of the wrong type or ambiguous.
    #[error(transparent)]
    Log(#[from] tipwatch_ingest::Error),
    /// The machine is none, or the log lacks what it needs.
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
    /// The joint states are of other joints.
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
        imu: signals.imu.clone(),
        odometry: signals.odometry.clone(),
        tool_wrench: signals.tool_wrench.clone(),
        has_tool: spec.arm.as_ref().is_some_and(|arm| arm.tool.is_some()),
    }
}

/// Binds a machine, given by its file and the text of its URDF (`urdf_name` is for messages), to a log.
///
/// # Errors
/// [`BindError`]: the first thing in which they do not fit.
pub fn bind(
    log: &Log,
    spec: &MachineSpec,
    urdf_text: &str,
    urdf_name: &str,
) -> Result<BoundLog, BindError> {
    let named = named_topics(spec);
    let may_carry_joints = |topic: &Topic| {
        SensorKind::JointStates.is_type(&topic.type_name)
            || named.joint_states.contains(&topic.name)
    };
    if !log.topics().iter().any(may_carry_joints) {
        return Err(no_joint_states(log));
    }
    let topics = SensorTopics::find(log, &named)?;
    if topics.joint_states.is_empty() {
        return Err(no_joint_states(log));
    }
    let joint_names = topics.joint_names();
    let static_transforms = static_transforms(log)?;
    let facts = LogFacts {
        joint_names: Some(&joint_names),
        lacks_imu: topics.imu.is_none(),
        imu_frame: topics.imu_frame.as_deref(),
        static_transforms: &static_transforms,
    };
    let mut machine = spec.check(urdf_text, urdf_name, facts)?;
    let matched = match_sensors(log, &machine, &topics)?;
    let sensors = bound_sensors(&machine, &matched, &topics);
    if !matched.sensors.tool_wrench {
        machine.leave_out_tool();
    }
    Ok(BoundLog {
        machine,
        matched,
        sensors,
        topics,
    })
}

/// The frames that a log's `/tf_static` places.
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
    topics: &SensorTopics,
) -> Result<MatchedSensors, BindError> {
    let name = |t: &JointTopic| log.topic(t.binding.topic).map(|topic| topic.name.clone());
    let names = topics
        .joint_states
        .iter()
        .map(name)
        .collect::<Result<Vec<_>, _>>()?;
    let joints = topics.joint_states.iter().map(|t| t.joint_names.as_slice());
    let streams: Vec<(&str, &[String])> = names.iter().map(String::as_str).zip(joints).collect();
    let others = OtherSensors {
        imu: topics.imu.is_some(),
        odometry: topics.odometry.is_some(),
        tool_wrench: topics.tool_wrench.is_some(),
    };
    let matched = MatchedSensors::new(machine, &streams, others)?;
    if matched.sensors.joints.is_empty() {
        let joints = topics.joint_names().join(", ");
        return Err(BindError::NoJointOfTheMachine {
            log: log.path().display().to_string(),
            joints,
        });
    }
    Ok(matched)
}

fn bound_sensors(
    machine: &Machine,
    matched: &MatchedSensors,
    topics: &SensorTopics,
) -> Vec<BoundSensor> {
    let bound = |sensor: Sensor, binding: &Binding, joint_names: Vec<String>| BoundSensor {
        sensor,
        request: SensorRequest {
            topic: binding.topic,
            kind: binding.kind,
            joint_names,
        },
        why: binding.why.clone(),
    };
    let used = matched.sensors.iter().filter_map(|sensor| match sensor {
        Sensor::Joints(stream) => {
            let binding = &topics.joint_states[matched.streams[stream]].binding;
            Some(bound(sensor, binding, matched.joint_names(machine, stream)))
        }
        Sensor::Imu => Some(bound(sensor, topics.imu.as_ref()?, Vec::new())),
        Sensor::Odometry => Some(bound(sensor, topics.odometry.as_ref()?, Vec::new())),
        Sensor::ToolWrench => Some(bound(sensor, topics.tool_wrench.as_ref()?, Vec::new())),
    });
    used.collect()
}

/// All samples of the sensors and their log times (ns), in the order in which the recorder received
/// them: what a live system would have seen.
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
