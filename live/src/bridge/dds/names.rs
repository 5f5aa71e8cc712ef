//! Names of topics and types: those of ROS 2 and what they become in DDS.

/// `/imu/data` of `rt/imu/data`; `None` for what is no topic of ROS 2.
#[must_use]
pub fn ros_topic(dds: &str) -> Option<String> {
    dds.strip_prefix("rt/").map(|rest| format!("/{rest}"))
}

/// The other way round.
#[must_use]
pub fn dds_topic(ros: &str) -> String {
    format!("rt/{}", ros.trim_start_matches('/'))
}

/// `sensor_msgs/msg/Imu` of `sensor_msgs::msg::dds_::Imu_`; any other name as it is.
#[must_use]
pub fn ros_type(dds: &str) -> String {
    let parts: Vec<&str> = dds.split("::").collect();
    match parts.as_slice() {
        [package, kind, "dds_", name] => {
            let name = name.strip_suffix('_').unwrap_or(name);
            format!("{package}/{kind}/{name}")
        }
        _ => dds.to_owned(),
    }
}

/// The other way round.
#[must_use]
pub fn dds_type(ros: &str) -> String {
    let parts: Vec<&str> = ros.split('/').collect();
    match parts.as_slice() {
        [package, kind, name] => format!("{package}::{kind}::dds_::{name}_"),
        [package, name] => format!("{package}::msg::dds_::{name}_"),
        _ => ros.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_go_there_and_back() {
        assert_eq!(ros_topic("rt/imu/data").as_deref(), Some("/imu/data"));
        assert_eq!(ros_topic("ros_discovery_info"), None);
        assert_eq!(dds_topic("/imu/data"), "rt/imu/data");
        let imu = "sensor_msgs::msg::dds_::Imu_";
        assert_eq!(ros_type(imu), "sensor_msgs/msg/Imu");
        assert_eq!(dds_type("sensor_msgs/msg/Imu"), imu);
        assert_eq!(dds_type("sensor_msgs/Imu"), imu);
        assert_eq!(ros_type("Plain"), "Plain");
    }
}
