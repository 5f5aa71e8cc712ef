//! Built-in definitions of common message types, for logs without embedded ones.

use std::fmt::Write as _;

use super::types::{Dialect, normal_type_name};

/// Type names with their fields, one per line.
pub(super) const DEFINITIONS: &[(&str, &str)] = &[
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"),
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    (
        "can_msgs/Frame",
        "std_msgs/Header header\nuint32 id\nbool is_rtr\nbool is_extended\nbool is_error\nuint8 dlc\n\
         uint8[8] data\n",
    ),
    (
        "diagnostic_msgs/DiagnosticArray",
        "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n",
    ),
    (
        "diagnostic_msgs/DiagnosticStatus",
        "byte level\nstring name\nstring message\nstring hardware_id\n\
         diagnostic_msgs/KeyValue[] values\n",
    ),
    ("diagnostic_msgs/KeyValue", "string key\nstring value\n"),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
    (
        "geometry_msgs/Pose",
        "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    ),
    (
        "geometry_msgs/PoseStamped",
        "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
    ),
    (
        "geometry_msgs/PoseWithCovariance",
        "geometry_msgs/Pose pose\nfloat64[36] covariance\n",
    ),
    (
        "geometry_msgs/Quaternion",
        "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
    ),
    (
        "geometry_msgs/Transform",
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    ),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    ),
    (
        "geometry_msgs/Twist",
        "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
    ),
    (
        "geometry_msgs/TwistStamped",
        "std_msgs/Header header\ngeometry_msgs/Twist twist\n",
    ),
    (
        "geometry_msgs/TwistWithCovariance",
        "geometry_msgs/Twist twist\nfloat64[36] covariance\n",
    ),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    (
        "geometry_msgs/Vector3Stamped",
        "std_msgs/Header header\ngeometry_msgs/Vector3 vector\n",
    ),
    (
        "geometry_msgs/Wrench",
        "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    ),
    (
        "geometry_msgs/WrenchStamped",
        "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
    ),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n\
         geometry_msgs/TwistWithCovariance twist\n",
    ),
    (
        "ros2_socketcan_msgs/FdFrame",
        "std_msgs/Header header\nuint32 id\nbool is_extended\nbool is_error\nuint8 len\n\
         uint8[<=64] data\n",
    ),
    ("rosgraph_msgs/Clock", "builtin_interfaces/Time clock\n"),
    (
        "sensor_msgs/CompressedImage",
        "std_msgs/Header header\nstring format\nuint8[] data\n",
    ),
    (
        "sensor_msgs/Imu",
        "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n\
         float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n\
         float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n\
         float64[9] linear_acceleration_covariance\n",
    ),
    (
        "sensor_msgs/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n\
         float64[] effort\n",
    ),
    ("std_msgs/Bool", "bool data\n"),
    (
        "std_msgs/ColorRGBA",
        "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n",
    ),
    ("std_msgs/Float32", "float32 data\n"),
    ("std_msgs/Float64", "float64 data\n"),
    (
        "std_msgs/Header",
        "builtin_interfaces/Time stamp\nstring frame_id\n",
    ),
    ("std_msgs/String", "string data\n"),
    (
        "tf2_msgs/TFMessage",
        "geometry_msgs/TransformStamped[] transforms\n",
    ),
    (
        "visualization_msgs/Marker",
        "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n\
         geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n\
         builtin_interfaces/Duration lifetime\nbool frame_locked\ngeometry_msgs/Point[] points\n\
         std_msgs/ColorRGBA[] colors\nstring texture_resource\n\
         sensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] uv_coordinates\n\
         string text\nstring mesh_resource\nvisualization_msgs/MeshFile mesh_file\n\
         bool mesh_use_embedded_materials\n",
    ),
    (
        "visualization_msgs/MarkerArray",
        "visualization_msgs/Marker[] markers\n",
    ),
    (
        "visualization_msgs/MeshFile",
        "string filename\nuint8[] data\n",
    ),
    ("visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"),
];

/// Definitions of ROS 1 that differ from those of ROS 2. The times of ROS 1 are no messages, but are read as if they were those
/// of ROS 2, so that the same paths lead to them.
const ROS1_DEFINITIONS: &[(&str, &str)] = &[
    ("builtin_interfaces/Duration", "int32 sec\nint32 nanosec\n"),
    ("builtin_interfaces/Time", "uint32 sec\nuint32 nanosec\n"),
    (
        "std_msgs/Header",
        "uint32 seq\nbuiltin_interfaces/Time stamp\nstring frame_id\n",
    ),
];

/// The definition of a common message type of ROS 2 such as `sensor_msgs/msg/Imu`, as a recorder would embed it; `None`
/// if it is not built in.
#[must_use]
pub fn known_definition(type_name: &str) -> Option<String> {
    definition(type_name, Dialect::Ros2)
}

/// The definition of a common type with those of its parts, as a recorder would embed it.
pub(crate) fn definition(type_name: &str, dialect: Dialect) -> Option<String> {
    let text = fields(&normal_type_name(type_name), dialect)?;
    with_common_parts(text, dialect)
}

/// A definition with those of the common types that it is made of behind it.
pub(crate) fn with_common_parts(text: &str, dialect: Dialect) -> Option<String> {
    let mut parts = Vec::new();
    collect_parts(text, &mut parts);
    let mut text = text.to_owned();
    for part in parts {
        let part_fields = fields(part, dialect)?;
        let separator = "=".repeat(80);
        // Writing to a string cannot fail.
        let _ = write!(text, "{separator}\nMSG: {part}\n{part_fields}");
    }
    Some(text)
}

/// The fields of one type, without those of nested types.
pub(crate) fn fields(normal_type_name: &str, dialect: Dialect) -> Option<&'static str> {
    if dialect == Dialect::Ros1 {
        let special = ROS1_DEFINITIONS
            .iter()
            .find(|(name, _)| *name == normal_type_name);
        if let Some((_, fields)) = special {
            return Some(fields);
        }
    }
    let known = DEFINITIONS
        .binary_search_by_key(&normal_type_name, |(name, _)| name)
        .ok()?;
    Some(DEFINITIONS[known].1)
}

fn collect_parts(text: &str, parts: &mut Vec<&'static str>) {
    for line in text.lines() {
        let type_name = line.split([' ', '[']).next().unwrap_or_default();
        let known = DEFINITIONS.iter().find(|(name, _)| *name == type_name);
        if let Some((name, fields)) = known
            && !parts.contains(name)
        {
            parts.push(name);
            collect_parts(fields, parts);
        }
    }
}
