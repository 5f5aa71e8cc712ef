//! Finds the topics that carry a machine's sensors.

use std::collections::BTreeMap;

use tipwatch_language::word;

use super::{
    binding::{Binding, bind, bind_joint_states},
    first_messages::{JointNamedTwice, for_each_string, joint_groups_in, sensor_frame},
};
use crate::{
    log::Log,
    message::{Error, SensorKind, Topic},
};

/// The topics that a machine file names; absent ones are found by type.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NamedTopics {
    /// Topics of joint states.
    pub joint_states: Vec<String>,
    /// The topic of the IMU.
    pub imu: Option<String>,
    /// The topic of the odometry.
    pub odometry: Option<String>,
    /// The topic of the tool wrench.
    pub tool_wrench: Option<String>,
    /// `header.frame_id` of the sensor that is meant where several share a topic, by topic.
    pub frames: BTreeMap<String, String>,
    /// Kinds that the machine file binds number by number, which are not searched.
    pub bound_by_number: Vec<SensorKind>,
    /// Whether to search for a tool wrench: only machines with a tool have one.
    pub has_tool: bool,
}

/// The topics that carry a machine's sensors.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SensorTopics {
    /// Joint state topics that name a joint, or parts of them, the one with most messages first.
    pub joint_states: Vec<JointTopic>,
    /// The IMU.
    pub imu: Option<Binding>,
    /// The frame in the first message of the IMU, without a leading slash.
    pub imu_frame: Option<String>,
    /// The odometry.
    pub odometry: Option<Binding>,
    /// The tool wrench.
    pub tool_wrench: Option<Binding>,
    /// The frame in its first message, without a leading slash.
    pub tool_wrench_frame: Option<String>,
}

/// Joints of a topic of joint states that come in the same messages: all of them, or those of one of several
/// publishers that share the topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JointTopic {
    /// The topic.
    pub binding: Binding,
    /// The joints in its first messages, in order of first appearance.
    pub joint_names: Vec<String>,
    /// Number of messages with the joints, if known: all of the topic, or their share of the first messages, extrapolated.
    pub message_count: Option<u64>,
    /// Joints that a message names twice with different positions.
    pub twice: Vec<JointNamedTwice>,
    /// Joints whose position is not a number in any of the first messages.
    pub without_position: Vec<String>,
}

impl SensorTopics {
    /// Finds the topics: the named ones, else the only one of the type with messages.
    ///
    /// # Errors
    /// A named topic is missing or of another type; several could carry one signal; several
    /// sensors share a topic and none of them is named; the log cannot
    /// be read.
    pub fn find(log: &Log, named: &NamedTopics) -> Result<Self, Error> {
        let joint_states = joint_topics(log, &named.joint_states)?;
        let single = |kind, name: &Option<String>| {
            if named.bound_by_number.contains(&kind) {
                return Ok(None);
            }
            let mut found = bind(log.topics(), kind, name.as_deref())?;
            if let Some(binding) = &mut found {
                let wanted = named.frames.get(&log.topic(binding.topic)?.name);
                let wanted = wanted.map(String::as_str);
                binding.frame_id = sensor_frame(log, binding.topic, kind, wanted)?;
            }
            Ok::<_, Error>(found)
        };
        let imu = single(SensorKind::Imu, &named.imu)?;
        let odometry = single(SensorKind::Odometry, &named.odometry)?;
        let tool_wrench = match named.has_tool || named.tool_wrench.is_some() {
            true => single(SensorKind::ToolWrench, &named.tool_wrench)?,
            false => None,
        };
        let frame_of = |binding: &Option<Binding>| {
            let frame = binding.as_ref().and_then(|found| found.frame_id.clone());
            frame.filter(|frame| !frame.is_empty())
        };
        Ok(Self {
            joint_states,
            imu_frame: frame_of(&imu),
            imu,
            odometry,
            tool_wrench_frame: frame_of(&tool_wrench),
            tool_wrench,
        })
    }

    /// All joints that any topic names, each once.
    pub fn joint_names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for name in self
            .joint_states
            .iter()
            .flat_map(|topic| &topic.joint_names)
        {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    }
}

/// A robot description (URDF) in a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RobotDescription {
    /// The name of its topic.
    pub topic: String,
    /// Log time of the last message with it (ns).
    pub log_time_ns: i64,
    /// The text.
    pub text: String,
}

/// The different robot descriptions on `/robot_description`, or on the first topic whose name ends so. The one that was
/// published last comes last.
///
/// # Errors
/// The log cannot be read, or the topic carries no strings.
pub fn robot_descriptions(log: &Log) -> Result<Vec<RobotDescription>, Error> {
    let bare = |topic: &&Topic| topic.name.trim_start_matches('/') == "robot_description";
    let ends_so = |topic: &&Topic| topic.name.ends_with("robot_description");
    let topics = || log.topics().iter();
    let Some(topic) = topics().find(bare).or_else(|| topics().find(ends_so)) else {
        return Ok(Vec::new());
    };
    let mut found: Vec<RobotDescription> = Vec::new();
    for_each_string(log, topic.id, &mut |text, log_time_ns| {
        let known = found
            .iter()
            .position(|description| description.text == text);
        let mut description = match known {
            Some(known) => found.remove(known),
            None => RobotDescription {
                topic: topic.name.clone(),
                log_time_ns,
                text: text.into_owned(),
            },
        };
        description.log_time_ns = log_time_ns;
        found.push(description);
    })?;
    Ok(found)
}

fn joint_topics(log: &Log, named: &[String]) -> Result<Vec<JointTopic>, Error> {
    let mut topics = Vec::new();
    for binding in bind_joint_states(log.topics(), named)? {
        let groups = joint_groups_in(log, binding.topic)?;
        let of_topic = log.topic(binding.topic)?.message_count;
        let several = groups.len();
        topics.extend(groups.into_iter().map(|group| {
            let mut binding = binding.clone();
            if several > 1 {
                binding
                    .why
                    .push_str(word!(", whose messages name joints in parts"));
            }
            JointTopic {
                binding,
                message_count: of_topic.map(|count| group.share_of(count)),
                joint_names: group.joint_names,
                twice: group.twice,
                without_position: group.without_position,
            }
        }));
    }
    topics.sort_by_key(|topic| std::cmp::Reverse(topic.message_count));
    Ok(topics)
}
