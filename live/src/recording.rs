//! The samples of a log that a machine's monitor needs, ready to be sent.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use tipwatch_ingest::{
    JointTopic, Log, Losses, NamedTopics, SensorKind, SensorRecording, SensorRequest, SensorTopics,
    TopicId, arrival_order, record_sensors, robot_description,
};
use tipwatch_mechanics::machine::{LogFacts, Machine, MachineSpec, OneOrMany};
use tipwatch_mechanics::signal::{MatchedSensors, OtherSensors, Sample, Sensor};

use crate::fnv::Fnv;
use crate::machine_file::{MachineFile, Urdf};
use crate::session::Session;

/// The samples of a machine's sensors in a log.
#[derive(Debug)]
pub struct Recording {
    /// What to announce; its identity is not set.
    pub session: Session,
    /// What of the log was lost.
    pub losses: Losses,
    sensors: Vec<Sensor>,
    columns: Vec<SensorRecording>,
    order: Vec<(usize, usize)>,
}

impl Recording {
    /// Reads the samples of the sensors that the machine file binds to.
    ///
    /// # Errors
    /// The log cannot be read, a signal is missing or ambiguous, or the machine does not fit.
    pub fn read(path: &Path, file: &MachineFile, urdf: Option<&Path>) -> Result<Self> {
        let log = Log::open(path)?;
        let topics = SensorTopics::find(&log, &named_topics(&file.spec))?;
        let urdf = match file.urdf(urdf)? {
            Some(urdf) => urdf,
            None => urdf_of(&log, file)?,
        };
        let names = topics.joint_names();
        let facts = LogFacts {
            joint_names: Some(&names),
            lacks_imu: topics.imu.is_none(),
            imu_frame: topics.imu_frame.as_deref(),
        };
        let machine = file.spec.check(&urdf.text, &urdf.name, facts)?;
        let matched = match_sensors(&log, &machine, &topics)?;
        let (sensors, requests) = requests(&machine, &matched, &topics);
        let (columns, losses) = record_sensors(&log, &requests, &mut |_| {})?;
        let order = arrival_order(&columns);
        let joints = 0..matched.streams.len();
        let session = Session {
            id: 0,
            machine_hash: file.hash(&urdf),
            total_samples: order.len() as u64,
            streams: joints
                .map(|stream| matched.joint_names(&machine, stream))
                .collect(),
            imu: matched.sensors.imu,
            odometry: matched.sensors.odometry,
            tool_wrench: matched.sensors.tool_wrench,
            imu_frame: topics.imu_frame,
        };
        // What a reader will do with it works here too, or is told here.
        session.machine(file, &urdf)?;
        Ok(Self {
            session,
            losses,
            sensors,
            columns,
            order,
        })
    }

    /// The samples and their log times, in nanoseconds, in the order in which the recorder received them.
    pub fn samples(&self) -> impl Iterator<Item = (Sample<'_>, i64)> {
        self.order.iter().map(|&(column, index)| {
            let recording = &self.columns[column];
            let sample = Sample {
                sensor: self.sensors[column],
                stamp_ns: recording.stamps_ns[index],
                values: recording.sample(index),
            };
            (sample, recording.log_times_ns[index])
        })
    }

    /// Gives the session an identity of its own: two replays of one log are two sessions.
    pub fn set_identity(&mut self) {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        let nanoseconds = now.map_or(0, |elapsed| elapsed.as_nanos() as u64);
        let hash = Fnv::new()
            .number(self.session.machine_hash)
            .number(nanoseconds);
        self.session.id = hash.number(std::process::id().into()).finish();
    }
}

fn named_topics(spec: &MachineSpec) -> NamedTopics {
    let signals = spec.signals.clone();
    NamedTopics {
        joint_states: signals
            .joint_states
            .as_ref()
            .map_or(&[][..], OneOrMany::names)
            .to_vec(),
        imu: signals.imu,
        odometry: signals.odometry,
        tool_wrench: signals.tool_wrench,
        has_tool: spec.arm.as_ref().is_some_and(|arm| arm.tool.is_some()),
    }
}

fn urdf_of(log: &Log, file: &MachineFile) -> Result<Urdf> {
    let described = robot_description(log)?.with_context(|| {
        format!(
            "{}: expected urdf = \"...\", --urdf or a topic /robot_description in the log, found none",
            file.path.display()
        )
    });
    described.map(|(text, topic)| Urdf {
        name: format!("topic {topic}"),
        text,
    })
}

fn match_sensors(log: &Log, machine: &Machine, topics: &SensorTopics) -> Result<MatchedSensors> {
    let name = |topic: &JointTopic| Ok(log.topic(topic.binding.topic)?.name.clone());
    let names = topics
        .joint_states
        .iter()
        .map(name)
        .collect::<Result<Vec<_>>>()?;
    let streams: Vec<(&str, &[String])> = names
        .iter()
        .zip(&topics.joint_states)
        .map(|(name, topic)| (name.as_str(), topic.joint_names.as_slice()))
        .collect();
    let others = OtherSensors {
        imu: topics.imu.is_some(),
        odometry: topics.odometry.is_some(),
        tool_wrench: topics.tool_wrench.is_some(),
    };
    let matched = MatchedSensors::new(machine, &streams, others)?;
    ensure!(
        !matched.sensors.joints.is_empty(),
        "{}: expected joint states ({}) of the machine's joints, found: {}",
        log.path().display(),
        SensorKind::JointStates.type_name(),
        topics.joint_names().join(", ")
    );
    Ok(matched)
}

fn requests(
    machine: &Machine,
    matched: &MatchedSensors,
    topics: &SensorTopics,
) -> (Vec<Sensor>, Vec<SensorRequest>) {
    let mut wanted: Vec<(Sensor, TopicId, SensorKind, Vec<String>)> = Vec::new();
    for (stream, &index) in matched.streams.iter().enumerate() {
        let topic = topics.joint_states[index].binding.topic;
        let names = matched.joint_names(machine, stream);
        wanted.push((
            Sensor::Joints(stream),
            topic,
            SensorKind::JointStates,
            names,
        ));
    }
    let others = [
        (
            Sensor::Imu,
            SensorKind::Imu,
            &topics.imu,
            matched.sensors.imu,
        ),
        (
            Sensor::Odometry,
            SensorKind::Odometry,
            &topics.odometry,
            matched.sensors.odometry,
        ),
        (
            Sensor::ToolWrench,
            SensorKind::ToolWrench,
            &topics.tool_wrench,
            matched.sensors.tool_wrench,
        ),
    ];
    for (sensor, kind, binding, is_used) in others {
        if let Some(binding) = binding.as_ref().filter(|_| is_used) {
            wanted.push((sensor, binding.topic, kind, Vec::new()));
        }
    }
    let request = |(sensor, topic, kind, joint_names)| {
        (
            sensor,
            SensorRequest {
                topic,
                kind,
                joint_names,
            },
        )
    };
    wanted.into_iter().map(request).unzip()
}
