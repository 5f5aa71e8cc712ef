//! The sources of a machine's signals in a log.

use std::collections::BTreeMap;

use tipwatch_ingest::{
    JointTopic, Log, SampleSpec, SensorKind, SensorRequest, SensorTopics, Topic, TopicId,
};
use tipwatch_mechanics::machine::{JointFields, NumberSpec};

use crate::number_signals::NumberSignals;

/// All sources of signals: topics of standard types, and single numbers.
pub(crate) struct Found {
    pub(crate) topics: SensorTopics,
    pub(crate) numbers: NumberSignals,
}

/// Joints measured together on one topic.
pub(crate) struct FoundJoints<'f> {
    pub(crate) topic: &'f Topic,
    pub(crate) joints: Vec<String>,
    pub(crate) source: JointSource<'f>,
    /// Number of messages that have the joints, if known.
    message_count: Option<u64>,
}

/// The source of joints.
pub(crate) enum JointSource<'f> {
    Typed(&'f JointTopic),
    Numbers(&'f SensorRequest),
    /// No joint is measured: rows are at the samples of this sensor.
    Rows(SensorRequest),
}

impl Found {
    pub(crate) fn has_imu(&self) -> bool {
        self.topics.imu.is_some() || self.numbers.imu.is_some()
    }

    pub(crate) fn has_odometry(&self) -> bool {
        self.topics.odometry.is_some() || self.numbers.odometry.is_some()
    }

    pub(crate) fn has_tool_wrench(&self) -> bool {
        self.topics.tool_wrench.is_some() || self.numbers.tool_wrench.is_some()
    }

    /// The streams of joints, the one with most messages first. Joints that the machine file binds
    /// number by number are removed from the others, and those without a position for which it gives a constant.
    pub(crate) fn joint_streams<'f>(
        &'f self,
        log: &'f Log,
        stated: &BTreeMap<String, JointFields>,
    ) -> Vec<FoundJoints<'f>> {
        let is_numbered = |name: &String| self.numbers.joints.iter().any(|j| j.joint == *name);
        let is_constant = |name: &String| {
            let position = stated.get(name).and_then(|fields| fields.position.as_ref());
            matches!(position, Some(NumberSpec::Constant(_)))
        };
        let typed = self.topics.joint_states.iter().map(|found| FoundJoints {
            topic: &log.topics()[found.binding.topic.index()],
            joints: (found.joint_names.iter())
                .filter(|name| !is_numbered(name))
                .filter(|name| !(found.without_position.contains(name) && is_constant(name)))
                .cloned()
                .collect(),
            source: JointSource::Typed(found),
            message_count: found.message_count,
        });
        let numbered = self.numbers.joints.iter().map(|found| {
            let topic = &log.topics()[found.request.topic.index()];
            FoundJoints {
                topic,
                joints: vec![found.joint.clone()],
                source: JointSource::Numbers(&found.request),
                message_count: topic.message_count,
            }
        });
        let mut streams: Vec<FoundJoints<'_>> = typed.chain(numbered).collect();
        streams.sort_by_key(|stream| std::cmp::Reverse(stream.message_count));
        streams
    }

    /// A stream without joints, for a machine none of whose joints is measured: its samples are at the times of the
    /// IMU, or else of the odometry.
    pub(crate) fn rows<'f>(&self, log: &'f Log) -> Option<FoundJoints<'f>> {
        let (topics, numbers) = (&self.topics, &self.numbers);
        let typed = topics.imu.as_ref().map(|imu| imu.topic);
        let imu = typed.or_else(|| numbers.imu.as_ref().map(|request| request.topic));
        let typed = topics.odometry.as_ref().map(|odometry| odometry.topic);
        let odometry = typed.or_else(|| numbers.odometry.as_ref().map(|request| request.topic));
        let topic: TopicId = imu.or(odometry)?;
        Some(FoundJoints {
            topic: &log.topics()[topic.index()],
            joints: Vec::new(),
            source: JointSource::Rows(SensorRequest::numbered(
                topic,
                SensorKind::JointStates,
                SampleSpec::of(Vec::new()),
            )),
            message_count: None,
        })
    }
}
