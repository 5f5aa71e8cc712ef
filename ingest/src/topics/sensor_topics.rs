//! Finds the topics that carry a machine's sensors.

use super::{
    binding::{Binding, bind, bind_joint_states},
    first_messages::{first_frame, first_string, joint_names_in},
};
use crate::{
    log::Log,
    message::{Error, SensorKind, TopicId},
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
    /// Kinds that the machine file binds number by number, which are not searched.
    pub bound_by_number: Vec<SensorKind>,
    /// Whether to search for a tool wrench: only machines with a tool have one.
    pub has_tool: bool,
}

/// The topics that carry a machine's sensors.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SensorTopics {
    /// Joint state topics that name a joint, the one with most messages first.
    pub joint_states: Vec<JointTopic>,
    /// The IMU.
    pub imu: Option<Binding>,
    /// The frame in the first message of the IMU, without a leading slash.
    pub imu_frame: Option<String>,
    /// The odometry.
    pub odometry: Option<Binding>,
    /// The tool wrench.
    pub tool_wrench: Option<Binding>,
}

/// A topic of joint states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JointTopic {
    /// The topic.
    pub binding: Binding,
    /// The joints in its first messages, in order of first appearance.
    pub joint_names: Vec<String>,
}

impl SensorTopics {
    /// Finds the topics: the named ones, else the only one of the type with messages.
    ///
    /// # Errors
    /// A named topic is missing or of another type; several could carry one signal; the log cannot
    /// be read.
    pub fn find(log: &Log, named: &NamedTopics) -> Result<Self, Error> {
        let joint_states = joint_topics(log, &named.joint_states)?;
        let single = |kind, name: &Option<String>| match named.bound_by_number.contains(&kind) {
            true => Ok(None),
            false => bind(log.topics(), kind, name.as_deref()),
        };
        let imu = single(SensorKind::Imu, &named.imu)?;
        let imu_frame = match &imu {
            Some(binding) => first_frame(log, binding.topic)?,
            None => None,
        };
        let odometry = single(SensorKind::Odometry, &named.odometry)?;
        let tool_wrench = match named.has_tool || named.tool_wrench.is_some() {
            true => single(SensorKind::ToolWrench, &named.tool_wrench)?,
            false => None,
        };
        Ok(Self {
            joint_states,
            imu,
            imu_frame,
            odometry,
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

/// The robot description (URDF) on `/robot_description`, and the topic's name.
///
/// # Errors
/// The log cannot be read, or the topic carries no strings.
pub fn robot_description(log: &Log) -> Result<Option<(String, String)>, Error> {
    let is_description = |name: &str| name.trim_start_matches('/').ends_with("robot_description");
    let Some(topic) = log
        .topics()
        .iter()
        .find(|topic| is_description(&topic.name))
    else {
        return Ok(None);
    };
    Ok(first_string(log, topic.id)?.map(|text| (text, topic.name.clone())))
}

fn joint_topics(log: &Log, named: &[String]) -> Result<Vec<JointTopic>, Error> {
    let mut topics = Vec::new();
    for binding in bind_joint_states(log.topics(), named)? {
        let joint_names = joint_names_in(log, binding.topic)?;
        if !joint_names.is_empty() {
            topics.push(JointTopic {
                binding,
                joint_names,
            });
        }
    }
    let count = |topic: TopicId| log.topic(topic).ok().and_then(|topic| topic.message_count);
    topics.sort_by_key(|topic| std::cmp::Reverse(count(topic.binding.topic)));
    Ok(topics)
}
