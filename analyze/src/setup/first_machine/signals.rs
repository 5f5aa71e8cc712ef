//! Guesses the topics of the sensors.

use std::cmp::Reverse;

use anyhow::Result;
use tipwatch_ingest::{Log, SensorKind, Topic, first_frame, joint_names_in};

use super::can::CanMessages;
use super::joints::NamedJoints;
use super::text::{Text, array, quoted};

/// Candidate topics for sensors.
#[derive(Debug, Default)]
pub(super) struct Topics {
    /// Selected topics of joint states, and their joints.
    pub(super) joint_states: Vec<NamedJoints>,
    /// Skipped topics of joint states, with a joint that a selected topic already has.
    repeated: Vec<(String, String)>,
    imu: Vec<(String, Option<u64>)>,
    odometry: Vec<(String, Option<u64>)>,
    tool_wrench: Vec<(String, Option<u64>)>,
    /// Frames of the IMU and tool wrench messages.
    pub(super) imu_frame: Option<String>,
    pub(super) wrench_frame: Option<String>,
    /// The messages of CAN buses.
    pub(super) can: CanMessages,
}

impl Topics {
    /// Finds the candidate topics of a log.
    ///
    /// # Errors
    /// The log cannot be read.
    pub(super) fn find(log: &Log, can: CanMessages) -> Result<Self> {
        let of_kind = |kind: SensorKind| {
            let fits = |t: &&Topic| kind.is_type(&t.type_name) && t.message_count != Some(0);
            let mut topics: Vec<&Topic> = log.topics().iter().filter(fits).collect();
            topics.sort_by_key(|topic| (is_command(&topic.name), Reverse(topic.message_count)));
            topics
        };
        let named = |topics: &[&Topic]| {
            let with_count = |t: &&Topic| (t.name.clone(), t.message_count);
            topics.iter().map(with_count).collect()
        };
        let frame = |topics: &[&Topic]| match topics.first() {
            Some(topic) => first_frame(log, topic.id),
            None => Ok(None),
        };
        let [imu, odometry, wrench] = [
            SensorKind::Imu,
            SensorKind::Odometry,
            SensorKind::ToolWrench,
        ]
        .map(of_kind);
        let mut found = Self {
            imu_frame: frame(&imu)?,
            wrench_frame: frame(&wrench)?,
            imu: named(&imu),
            odometry: named(&odometry),
            tool_wrench: named(&wrench),
            can,
            ..Self::default()
        };
        for topic in of_kind(SensorKind::JointStates) {
            let joints = joint_names_in(log, topic.id)?;
            let known = found.joints();
            match joints.iter().find(|joint| known.contains(joint)) {
                Some(joint) => found.repeated.push((topic.name.clone(), joint.clone())),
                None if joints.is_empty() => {}
                None => found.joint_states.push((topic.name.clone(), joints)),
            }
        }
        Ok(found)
    }

    /// All joints in the selected joint states.
    pub(super) fn joints(&self) -> Vec<String> {
        let names = self.joint_states.iter().map(|(_, names)| names.clone());
        names.collect::<Vec<_>>().concat()
    }

    /// The topic of the IMU.
    pub(super) fn imu(&self) -> Option<&str> {
        self.imu.first().map(|(topic, _)| topic.as_str())
    }

    /// The topic of the odometry.
    pub(super) fn odometry(&self) -> Option<&str> {
        self.odometry.first().map(|(topic, _)| topic.as_str())
    }

    /// Writes `[signals]`.
    pub(super) fn write(&self, log: &Log, text: &mut Text) {
        let dbc = match log.can_buses().next() {
            Some(_) => " --dbc FILE.dbc",
            None => "",
        };
        text.gap().comment(&format!(
            "What can be bound: `tipwatch inspect {}{dbc}` lists every topic and field with its first and last value.",
            log.path().display()
        ));
        text.line("[signals]");
        let states: Vec<String> = self.joint_states.iter().map(|(t, _)| t.clone()).collect();
        for (topic, names) in &self.joint_states {
            text.comment(&format!("{topic} contains {}.", names.join(", ")));
        }
        for (topic, joint) in &self.repeated {
            text.comment(&format!(
                "Skipped {topic}: another topic also has its joint {joint}."
            ));
        }
        match states.is_empty() {
            true => {
                text.comment("No joint states (sensor_msgs/JointState): bind each joint below.")
            }
            false => text.line(&format!("joint_states = {}", array(&states))),
        };
        for (kind, topics) in [
            (SensorKind::Imu, &self.imu),
            (SensorKind::Odometry, &self.odometry),
            (SensorKind::ToolWrench, &self.tool_wrench),
        ] {
            match (kind, topics.is_empty()) {
                (SensorKind::Imu, true) if self.can.has_imu() => self.can.write_imu(text),
                _ => write_single(text, kind, topics),
            }
            if kind == SensorKind::Odometry && topics.is_empty() {
                self.can.write_speed(text);
            }
        }
    }
}

fn write_single(text: &mut Text, kind: SensorKind, topics: &[(String, Option<u64>)]) {
    let key = kind.signal_key();
    let Some((topic, count)) = topics.first() else {
        text.comment(&format!("No topic of type {}.", kind.type_name()));
        if kind == SensorKind::Imu {
            text.comment(
                "Fields of other messages can replace it, here in g and degrees per second:",
            );
            text.open(
                "imu.specific_force = [ { topic = \"/t\", field = \"ax\", scale = 9.80665 }, ... ]  # x, y, z (m/s^2)\n\
                 imu.angular_velocity = [ { topic = \"/t\", field = \"wx\", scale = 0.0174533 }, ... ]  # x, y, z (rad/s)",
            );
        }
        return;
    };
    let others: Vec<String> = topics[1..].iter().map(with_count).collect();
    let other_counts = || topics[1..].iter().map(|(_, count)| count);
    let why = if others.is_empty() {
        format!("The only topic of type {}.", kind.type_name())
    } else if other_counts().all(|other| other < count) {
        format!(
            "The topic of this type with most messages; others: {}.",
            others.join(", ")
        )
    } else {
        let reason = match other_counts().any(|other| other > count) {
            true => "its name is not that of a command",
            false => "it comes first in the log, and none has more messages",
        };
        format!(
            "One of several topics of this type: {reason}. Check it; others: {}.",
            others.join(", ")
        )
    };
    text.comment(&why);
    text.line(&format!("{key} = {}", quoted(topic)));
}

/// Whether the name of a topic is that of values that are wanted, not measured.
fn is_command(topic: &str) -> bool {
    const WANTED: [&str; 9] = [
        "command",
        "commands",
        "cmd",
        "desired",
        "target",
        "setpoint",
        "reference",
        "goal",
        "planned",
    ];
    let words = topic.split(|c: char| !c.is_ascii_alphanumeric());
    words
        .map(str::to_ascii_lowercase)
        .any(|word| WANTED.contains(&word.as_str()))
}

fn with_count((topic, count): &(String, Option<u64>)) -> String {
    match count {
        Some(count) => format!("{topic} ({count} messages)"),
        None => topic.clone(),
    }
}
