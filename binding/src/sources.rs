//! The sources of a machine's signals in a log.

use tipwatch_ingest::{JointTopic, Log, SensorRequest, SensorTopics, Topic};

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
}

/// The source of joints.
pub(crate) enum JointSource<'f> {
    Typed(&'f JointTopic),
    Numbers(&'f SensorRequest),
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
    /// number by number are removed from the others.
    pub(crate) fn joint_streams<'f>(&'f self, log: &'f Log) -> Vec<FoundJoints<'f>> {
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
