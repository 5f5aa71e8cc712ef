//! Topics of a recording: names, types and definitions.

use std::fmt::Write;

use tipwatch_binding::monitor_topic::{self, ACTUATOR_FIELD};
use tipwatch_ingest::known_definition;
use tipwatch_mechanics::state::NumberKind;
use tipwatch_suspension::MAX_ACTUATORS;

use crate::wire::names::Names;
use crate::wire::topics::{WireCommand, WireVerdict};

/// A topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Topic {
    pub(crate) name: String,
    pub(crate) type_name: &'static str,
    pub(crate) definition: String,
}

const HEADER: &str = "
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";

/// Joint states of a stream.
pub(super) fn joint_states(stream: usize) -> Topic {
    of_ros(
        monitor_topic::joint_states(stream),
        "sensor_msgs/msg/JointState",
    )
}

/// The inertial measurement unit.
pub(super) fn imu() -> Topic {
    of_ros(monitor_topic::IMU.into(), "sensor_msgs/msg/Imu")
}

/// Odometry.
pub(super) fn odometry() -> Topic {
    of_ros(monitor_topic::ODOMETRY.into(), "nav_msgs/msg/Odometry")
}

/// The tool wrench.
pub(super) fn tool_wrench() -> Topic {
    of_ros(
        monitor_topic::TOOL_WRENCH.into(),
        "geometry_msgs/msg/WrenchStamped",
    )
}

/// A topic of a common type of ROS.
fn of_ros(name: String, type_name: &'static str) -> Topic {
    Topic {
        name,
        type_name,
        definition: known_definition(type_name).expect("a type with a built-in definition"),
    }
}

/// A sensor that measures one number, under the name that offline analysis expects.
pub(super) fn number(kind: NumberKind, name: String) -> Topic {
    Topic {
        name,
        type_name: match kind {
            NumberKind::Actuator | NumberKind::Force => "tipwatch_msgs/msg/ActuatorSignal",
            NumberKind::Switch => "tipwatch_msgs/msg/SupportSwitch",
            NumberKind::Load => "tipwatch_msgs/msg/LoadSensor",
            NumberKind::Command => "tipwatch_msgs/msg/JointCommand",
            NumberKind::Payload => "tipwatch_msgs/msg/PayloadMass",
        },
        definition: format!("std_msgs/Header header\nfloat64 {ACTUATOR_FIELD}{HEADER}"),
    }
}

/// Verdicts: integers as on the wire, then every number under the name of its column in `samples.parquet`.
/// The header's stamp is the time of the row.
pub(crate) fn verdict(names: &Names) -> Topic {
    let mut definition = String::from("std_msgs/Header header\n");
    for (name, _) in VERDICT_INTEGERS {
        let _ = writeln!(definition, "uint32 {name}");
    }
    for (name, _) in VERDICT_COUNTS {
        let _ = writeln!(definition, "uint64 {name}");
    }
    for (name, _) in VERDICT_TIMES {
        let _ = writeln!(definition, "int64 {name}");
    }
    for (name, _) in VERDICT_NUMBERS {
        let _ = writeln!(definition, "float64 {name}");
    }
    for name in names.columns() {
        let _ = writeln!(definition, "float64 {}", field_name(&name));
    }
    Topic {
        name: monitor_topic::NAME.into(),
        type_name: monitor_topic::TYPE_NAME,
        definition: definition.trim_end().to_owned() + HEADER,
    }
}

/// Fields of a message that are recorded as they are on the wire, in order: the name of each, and its value.
pub(super) type Fields<M, N> = &'static [(&'static str, fn(&M) -> N)];

/// [`Fields`] by the names of the message's own fields, and others behind them.
macro_rules! fields {
    ($($field:ident),* $(; $($other:expr),*)?) => {
        &[$((stringify!($field), |message| message.$field),)* $($($other),*)?]
    };
}

pub(super) const VERDICT_INTEGERS: Fields<WireVerdict, u32> = fields![
    event, level, latched_level, faults, cautions, reasons, held_faults, held_cautions, held_reasons, acknowledged, untimed,
    next_wheel, wheel_count, standing, ground_gap, alarm, alarm_acknowledged, inherited_alarm, inherited_acknowledged, basis, inherited_contradiction, load_doubt,
    doubted_load_sensor, load_explanation, exchanged_sensors, doubted_forces, frozen_forces;
    (monitor_topic::ACKNOWLEDGED_SIGNALS_FIELDS[0], |verdict| verdict.acknowledged_signals as u32),
    (monitor_topic::ACKNOWLEDGED_SIGNALS_FIELDS[1], |verdict| (verdict.acknowledged_signals >> 32) as u32)
];
pub(super) const VERDICT_COUNTS: Fields<WireVerdict, u64> = fields![
    sequence, source, sample_sequence, rows, lost, refused, repeated, unproven;
    (monitor_topic::DOUBTED_FIELD, |verdict| verdict.doubted)
];
pub(super) const VERDICT_NUMBERS: Fields<WireVerdict, f64> = fields![
    payload_mass_kg,
    payload_mass_sigma_kg,
    unstated_mass_kg,
    unstated_mass_sigma_kg
];
pub(super) const VERDICT_TIMES: Fields<WireVerdict, i64> =
    fields![published_ns, valid_until_ns, sample_published_ns];

/// Valve commands, as on the wire. Lists have one entry per actuator.
pub(super) fn command() -> Topic {
    let mut definition = String::from("std_msgs/Header header\nstring mode\nstring status\n");
    definition.push_str("string[] hold_reasons\n");
    for (name, _) in COMMAND_INTEGERS {
        let _ = writeln!(definition, "uint32 {name}");
    }
    for (name, _) in COMMAND_COUNTS {
        let _ = writeln!(definition, "uint64 {name}");
    }
    for (name, _) in COMMAND_TIMES {
        let _ = writeln!(definition, "int64 {name}");
    }
    for (name, _) in COMMAND_LISTS {
        let _ = writeln!(definition, "float64[] {name}");
    }
    definition.push_str("float64 cost");
    Topic {
        name: "/tipwatch/command".into(),
        type_name: "tipwatch_msgs/msg/Command",
        definition: definition + HEADER,
    }
}

pub(super) const COMMAND_INTEGERS: Fields<WireCommand, u32> =
    fields![event, level, iterations, evaluations];
pub(super) const COMMAND_COUNTS: Fields<WireCommand, u64> =
    fields![sequence, source, sample_sequence, verdict_sequence];
pub(super) const COMMAND_TIMES: Fields<WireCommand, i64> =
    fields![published_ns, valid_until_ns, sample_published_ns];
/// Fields of a command with one number for each actuator.
pub(super) const COMMAND_LISTS: Fields<WireCommand, [f64; MAX_ACTUATORS]> =
    fields![opening, measured, reference, velocity, target];

/// Returns the topic of the monitor's description of itself: hashes in hexadecimal, empty where unknown. Its message stands at
/// the beginning of every file, and where another monitor goes on. The lists of proofs are in the order of the bits of `unproven`
/// in the verdict; the last bit stands for all from there on.
pub(super) fn program() -> Topic {
    Topic {
        name: monitor_topic::PROGRAM.into(),
        type_name: monitor_topic::PROGRAM_TYPE_NAME,
        definition: format!(
            "std_msgs/Header header\nstring version\nstring options\nstring program_sha256\nstring options_sha256\n\
             string machine_sha256\nstring urdf_sha256\nstring commissioning_sha256\nuint64 source\nuint32 {}\nuint32[] {}\n\
             float64[] {}\nfloat64[] {}\nuint32 {}\nuint32[] {}\nfloat64[] {}\nfloat64[] {}\nstring[] proof_names\n\
             string[] proof_ways{HEADER}",
            monitor_topic::DOUBTED_COUNT_FIELD,
            monitor_topic::DOUBTED_FIELDS[0],
            monitor_topic::DOUBTED_FIELDS[1],
            monitor_topic::DOUBTED_FIELDS[2],
            monitor_topic::KNOWN_COUNT_FIELD,
            monitor_topic::KNOWN_FIELDS[0],
            monitor_topic::KNOWN_FIELDS[1],
            monitor_topic::KNOWN_FIELDS[2],
        ),
    }
}

/// Messages that the recorder lost.
pub(super) fn gap() -> Topic {
    Topic {
        name: monitor_topic::GAPS.into(),
        type_name: monitor_topic::GAPS_TYPE_NAME,
        definition: format!(
            "std_msgs/Header header\n{}{HEADER}",
            monitor_topic::GAPS_FIELDS
                .map(|field| format!("uint64 {field}"))
                .join("\n")
        ),
    }
}

/// A valid name of a field: letters, digits and underscores.
fn field_name(name: &str) -> String {
    let allowed = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    name.to_lowercase().chars().map(allowed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_of_ros_have_definitions_with_all_parts() {
        for topic in [joint_states(1), imu(), odometry(), tool_wrench()] {
            assert!(topic.definition.contains(HEADER));
        }
    }
}
