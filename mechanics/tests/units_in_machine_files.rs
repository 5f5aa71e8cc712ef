//! Numbers of a machine file that are not finite, or in another unit, are refused, with the key and the likely unit.

use crate::support;
use tipwatch_mechanics::machine::MachineSpec;

/// A machine file with all its tables. What a key means does not matter here.
fn full() -> String {
    let more = r#"
unconfirmed = ["imu"]
[clock]
offset = { "/imu/data" = 0.01 }
[estimator]
max_gap = 0.3
joint_agility = 0.1
[uncertainty]
mass_share = 0.02
com = 0.01
[plausibility]
joint_margin = 0.05
angular_velocity_max = 4.0
[links.base_link]
mass_sigma = 10.0
com_sigma = [0.01, 0.01, 0.01]
[quasi_static]
hold = 30.0
[prediction]
stop_time = 0.5
[signals.joints.slew]
position = { topic = "/a", field = "b", scale = 0.1, offset = 0.2 }
[signals.joints.lift]
position = 0.5
[[payload]]
link = "tool"
mass = 100.0
mass_sigma = 5.0
com = [0.1, 0.2, 0.3]
inertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
from = 1.0
to = 2.0
[supports.jack]
link = "base_link"
xyz = [1.0, 2.0, 3.0]
set = { topic = "/a", field = "b", above = 0.5, max_age = 2.0 }
[weighed]
unit = "N"
sigma = 50.0
wheels = { FL = 10000.0 }
posture = { lift = 0.1 }
[[weighed.sums]]
wheels = ["FL", "FR"]
load = 20000.0
sigma = 60.0
[[weighed.postures]]
slope = [0.1, 0.2]
slope_sigma = 0.1
wheels = { FL = 1.0 }
specific_force = [0.0, 0.0, 9.8]
specific_force_sigma = 0.01
[suspension]
linkages = []
stroke = [0.0, 0.3]
max_velocity = 0.1
max_acceleration = 1.0
"#;
    let (unconfirmed, more) = more.trim_start().split_once('\n').unwrap();
    format!("{unconfirmed}\n{}\n{more}", support::data("rigid.toml"))
}

/// Shows every number of a value by its path, for its replacement.
fn numbers(value: &mut toml::Value, path: &str, visit: &mut dyn FnMut(&str, &mut toml::Value)) {
    match value {
        toml::Value::Table(table) => {
            for (key, value) in table.iter_mut() {
                let is_bare = key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
                let name = if is_bare {
                    key.clone()
                } else {
                    format!("\"{key}\"")
                };
                let path = if path.is_empty() {
                    name
                } else {
                    format!("{path}.{name}")
                };
                numbers(value, &path, visit);
            }
        }
        toml::Value::Array(values) => {
            for (index, value) in values.iter_mut().enumerate() {
                numbers(value, &format!("{path}[{index}]"), visit);
            }
        }
        toml::Value::Float(_) | toml::Value::Integer(_) => visit(path, value),
        _ => {}
    }
}

#[test]
fn no_number_of_a_machine_file_may_be_nan_or_infinite() {
    let file: toml::Table = full().parse().unwrap();
    let mut count = 0;
    numbers(&mut toml::Value::Table(file.clone()), "", &mut |_, _| {
        count += 1;
    });
    assert!(count > 60, "{count}");
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for replaced in 0..count {
            let mut edited = toml::Value::Table(file.clone());
            let (mut at, mut key) = (0, String::new());
            numbers(&mut edited, "", &mut |path, value| {
                if at == replaced {
                    key = path.into();
                    *value = toml::Value::Float(wrong);
                }
                at += 1;
            });
            let text = toml::to_string(&edited).unwrap();
            let error = MachineSpec::from_toml(&text, "m.toml")
                .unwrap_err()
                .to_string();
            assert!(
                error.starts_with(&format!("m.toml: {key}:")),
                "{key} = {wrong}: {error}"
            );
        }
    }
    let overflow = full().replace("max_gap = 0.3", "max_gap = 1e999");
    let error = MachineSpec::from_toml(&overflow, "m.toml")
        .unwrap_err()
        .to_string();
    assert!(error.contains("estimator.max_gap"), "{error}");
}

/// Error for the rigid machine with one replacement in its machine file.
fn refusal(from: &str, to: &str) -> String {
    let found = support::edited("rigid", |text| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    found.expect_err("another unit").to_string()
}

#[test]
fn another_unit_is_refused_with_the_likely_one() {
    let stiffness = "tyre_stiffness = 8.0e5";
    let imu = "xyz = [0.1, 0, 0.05]";
    let posture = "[limits]\nreference_posture = ";
    for (from, to, key, unit) in [
        (
            imu,
            "xyz = [100.0, 0.0, 50.0]",
            "imu.xyz",
            "millimetres: write [0.1, 0, 0.05] (m)",
        ),
        (
            "rpy = [0.0, 0.0, 0.0]",
            "rpy = [0.0, 0.0, 90.0]",
            "imu.rpy",
            "degrees: write [0, 0, 1.570796] (rad)",
        ),
        (
            stiffness,
            "tyre_stiffness = 800.0",
            "contact.tyre_stiffness",
            "N/mm or kN/m: write 8e5 (N/m)",
        ),
        (
            "min_load = 500.0",
            "min_load = 50000.0",
            "limits.min_load",
            "below the weight",
        ),
        (
            "[limits]",
            &format!("{posture}{{ lift = -66.8 }}"),
            "limits.reference_posture.lift",
            "degrees: write -1.16588 (rad)",
        ),
        (
            "[limits]",
            &format!("{posture}{{ extension = 204.0 }}"),
            "limits.reference_posture.extension",
            "millimetres: write 0.204 (m)",
        ),
        (
            "[limits]",
            "[weighed]\nunit = \"N\"\nwheels = { FL = 9000.0 }\nposture = { lift = -66.8 }\n[limits]",
            "weighed.posture.lift",
            "degrees",
        ),
        (
            "[limits]",
            "[[payload]]\nlink = \"tool\"\nmass = 100.0\ncom = [404.0, 0.0, 0.0]\n[limits]",
            "payload 1: com",
            "millimetres",
        ),
    ] {
        let error = refusal(from, to);
        assert!(error.contains(key) && error.contains(unit), "{to}: {error}");
    }
}
