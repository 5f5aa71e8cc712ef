//! The kinds of sensor that a topic can carry.

use serde::Serialize;

use crate::schema::normal_type_name;

/// Quantity that a topic measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SensorKind {
    /// Positions and velocities of joints.
    JointStates,
    /// Specific force, angular velocity, attitude.
    Imu,
    /// Velocity and attitude of the base.
    Odometry,
    /// Force and moment on the tool.
    ToolWrench,
    /// One number from any message, such as the force of an actuator.
    Number,
}

impl SensorKind {
    /// All kinds that have a message type of their own.
    pub const ALL: [SensorKind; 4] = [
        Self::JointStates,
        Self::Imu,
        Self::Odometry,
        Self::ToolWrench,
    ];

    /// The ROS message type; empty if any type will do.
    pub fn type_name(self) -> &'static str {
        match self {
            Self::JointStates => "sensor_msgs/msg/JointState",
            Self::Imu => "sensor_msgs/msg/Imu",
            Self::Odometry => "nav_msgs/msg/Odometry",
            Self::ToolWrench => "geometry_msgs/msg/WrenchStamped",
            Self::Number => "",
        }
    }

    /// The key under `[signals]` in a machine file; for numbers, the name used in reports.
    pub fn signal_key(self) -> &'static str {
        match self {
            Self::JointStates => "joint_states",
            Self::Imu => "imu",
            Self::Odometry => "odometry",
            Self::ToolWrench => "tool_wrench",
            Self::Number => "actuator",
        }
    }

    /// The number of values in a sample; `joints` matters for joint states only.
    pub fn value_count(self, joints: usize) -> usize {
        match self {
            Self::JointStates => 2 * joints,
            Self::Imu | Self::Odometry => 10,
            Self::ToolWrench => 6,
            Self::Number => 1,
        }
    }

    /// Whether `type_name` is this message type, in the spelling of ROS 1 or ROS 2.
    pub fn is_type(self, type_name: &str) -> bool {
        normal_type_name(type_name) == normal_type_name(self.type_name())
    }
}
