//! A machine whose signals are single numbers of messages.

use std::path::{Path, PathBuf};

use super::data;

const JOINTS: [&str; 6] = ["lift", "tilt", "slew", "extension", "steer_fl", "steer_fr"];

/// `tiny.toml` with every joint but the wheels', the IMU and the odometry bound number by number.
pub fn numbered_machine(folder: &Path) -> PathBuf {
    let number =
        |topic: &str, field: &str| format!("{{ topic = \"{topic}\", field = \"{field}\" }}");
    let triple = |topic: &str, field: &str| {
        let numbers = ["x", "y", "z"].map(|axis| number(topic, &format!("{field}.{axis}")));
        format!("[{}]", numbers.join(", "))
    };
    let orientation = ["x", "y", "z", "w"]
        .map(|part| number("/imu/data", &format!("orientation.{part}")))
        .join(", ");
    let joints = JOINTS.map(|joint| {
        let list = |field: &str| {
            format!("{{ topic = \"/joint_states\", field = \"{field}\", joint = \"{joint}\" }}")
        };
        format!(
            "[signals.joints.{joint}]\nposition = {}\nvelocity = {}\n",
            list("position"),
            list("velocity")
        )
    });
    let text = std::fs::read_to_string(data("tiny.toml")).unwrap();
    let kept = text.split("[signals]").next().unwrap();
    let text = format!(
        "{kept}{}[signals.imu]\nspecific_force = {}\nangular_velocity = {}\norientation = [{orientation}]\n[signals.odometry]\nvelocity = {}\n",
        joints.concat(),
        triple("/imu/data", "linear_acceleration"),
        triple("/imu/data", "angular_velocity"),
        triple("/odom", "twist.twist.linear")
    );
    std::fs::copy(data("tiny.urdf"), folder.join("tiny.urdf")).unwrap();
    let path = folder.join("numbers.toml");
    std::fs::write(&path, text).unwrap();
    path
}
