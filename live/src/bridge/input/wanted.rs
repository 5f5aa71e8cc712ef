//! The topics that a machine file asks for.

use std::collections::{BTreeMap, BTreeSet};

use tipwatch_binding::{MachineFile, named_topics};
use tipwatch_ingest::SensorKind;
use tipwatch_mechanics::machine::{can_signals, number_topics};

/// Topics and kinds of sensors to subscribe to.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Topics that the machine file names.
    pub names: BTreeSet<String>,
    /// Buses that it names; they may also be topics of frames.
    pub buses: BTreeSet<String>,
    /// Whether the machine file has CAN signals.
    pub has_can: bool,
    /// Kind of sensor whose messages a topic must carry, by name of the topic.
    pub kind_of: BTreeMap<String, SensorKind>,
    /// Kinds of sensors for which it names no topic: they are found by the type of their messages, as in a log.
    pub kinds: Vec<SensorKind>,
}

impl Wanted {
    /// Returns the topics and kinds of sensors that a machine file asks for.
    #[must_use]
    pub fn of(file: &MachineFile) -> Self {
        let named = named_topics(&file.spec);
        let mut names: BTreeSet<String> = number_topics(&file.text).into_iter().collect();
        names.extend(named.joint_states.iter().cloned());
        let cans = can_signals(&file.text);
        let has_joints = file.spec.signals.joints.values();
        let has_joints = has_joints.into_iter().any(|joint| joint.position.is_some());
        let mut kinds = Vec::new();
        let mut kind_of: BTreeMap<String, SensorKind> = BTreeMap::new();
        for name in &named.joint_states {
            kind_of.insert(name.clone(), SensorKind::JointStates);
        }
        let by_number = |kind: SensorKind| named.bound_by_number.contains(&kind);
        if named.joint_states.is_empty() && !has_joints {
            kinds.push(SensorKind::JointStates);
        }
        let single = [
            (SensorKind::Imu, &named.imu, true),
            (SensorKind::Odometry, &named.odometry, true),
            (SensorKind::ToolWrench, &named.tool_wrench, named.has_tool),
        ];
        for (kind, topic, is_of_use) in single {
            match topic {
                Some(topic) => {
                    names.insert(topic.clone());
                    kind_of.insert(topic.clone(), kind);
                }
                None if is_of_use && !by_number(kind) => kinds.push(kind),
                None => {}
            }
        }
        Self {
            names,
            buses: cans.iter().filter_map(|can| can.bus.clone()).collect(),
            has_can: !cans.is_empty(),
            kind_of,
            kinds,
        }
    }

    /// The type that a topic must have and has not.
    #[must_use]
    pub fn expected_type(&self, name: &str, type_name: &str) -> Option<&'static str> {
        let kind = self.kind_of.get(name)?;
        (!kind.is_type(type_name)).then(|| kind.type_name())
    }

    /// Whether a topic of ROS is to be subscribed to.
    #[must_use]
    pub fn wants(&self, name: &str, type_name: &str) -> bool {
        let is_frames = matches!(
            type_name,
            "can_msgs/msg/Frame" | "ros2_socketcan_msgs/msg/FdFrame"
        );
        let by_type = self.kinds.iter().any(|kind| kind.is_type(type_name));
        let is_bus =
            is_frames && self.has_can && (self.buses.is_empty() || self.buses.contains(name));
        self.names.contains(name) || by_type || is_bus
    }
}
