//! Signals bound field by field: the same numbers give the same results, whatever message they come from.

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Estimator;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::FaultKind;
use tipwatch_tests::{by, data};

/// `tiny.toml` with different signals.
fn machine_file(signals: &str) -> String {
    let text = std::fs::read_to_string(data("tiny.toml")).unwrap();
    let kept = text.split("[signals]").next().unwrap();
    format!("{kept}{signals}")
}

fn analysed(signals: &str, estimator: Estimator) -> anyhow::Result<Analysis> {
    let file = MachineFile::from_text(&data("tiny.toml"), &machine_file(signals))?;
    let options = by(estimator);
    analyse(&data("tiny.mcap"), &file, options, &mut |_| {})
}

fn joint(name: &str) -> String {
    format!(
        "[signals.joints.{name}]\n\
         position = {{ topic = \"/joint_states\", joint = \"{name}\" }}\n\
         velocity = {{ topic = \"/joint_states\", field = \"velocity\", joint = \"{name}\" }}\n"
    )
}

fn triple(key: &str, topic: &str, field: &str) -> String {
    let numbers = ["x", "y", "z"]
        .map(|axis| format!("{{ topic = \"{topic}\", field = \"{field}.{axis}\" }}"));
    format!("{key} = [{}]\n", numbers.join(", "))
}

fn quaternion(topic: &str, field: &str) -> String {
    let numbers = ["x", "y", "z", "w"]
        .map(|part| format!("{{ topic = \"{topic}\", field = \"{field}.{part}\" }}"));
    format!("orientation = [{}]\n", numbers.join(", "))
}

fn tables() -> String {
    let joints = ["lift", "tilt", "slew", "extension", "steer_fl", "steer_fr"];
    let imu = "/imu/data";
    joints.map(joint).concat()
        + "[signals.imu]\n"
        + &triple("specific_force", imu, "linear_acceleration")
        + &triple("angular_velocity", imu, "angular_velocity")
        + &quaternion(imu, "orientation")
        + "[signals.odometry]\n"
        + &triple("velocity", "/odom", "twist.twist.linear")
}

const BY_TYPE: &str = "[signals]\n";

#[test]
fn single_fields_give_the_results_of_standard_messages() {
    for estimator in [Estimator::Smoother, Estimator::Causal] {
        let by_type = analysed(BY_TYPE, estimator).unwrap();
        let by_number = analysed(&tables(), estimator).unwrap();
        assert!(by_number.rows.len() + 2 >= by_type.rows.len() && by_type.rows.len() > 100);
        assert!(by_number.machine.imu().source == by_type.machine.imu().source);
        let mut compared = 0;
        for row in 0..by_type.rows.len() {
            let time = by_type.rows.times_ns[row];
            let Ok(other) = by_number.rows.times_ns.binary_search(&time) else {
                continue;
            };
            if !(by_type.rows.is_valid(row) && by_number.rows.is_valid(other)) {
                continue;
            }
            for wheel in 0..4 {
                let load = |of: &Analysis, row| {
                    of.rows.whole().outcomes.column(Quantity::Load(wheel))[row]
                };
                let (a, b) = (load(&by_type, row), load(&by_number, other));
                assert!((a - b).abs() < 1e-6, "row {row}: {a} {b}");
                compared += 1;
            }
        }
        assert!(compared > 400, "{compared}");
    }
}

#[test]
fn units_are_converted_and_constants_replace_signals() {
    let typed = analysed(BY_TYPE, Estimator::Smoother).unwrap();
    // an encoder with a wrong zero
    let turned = |offset: f64| {
        joint("lift").replacen(
            "joint = \"lift\" }",
            &format!("joint = \"lift\", scale = 1, offset = {offset:?} }}"),
            1,
        )
    };
    let loads = |analysis: &Analysis| -> Vec<f64> {
        let mean = |wheel| {
            let column = analysis.rows.whole().outcomes.column(Quantity::Load(wheel));
            column.iter().filter(|l| l.is_finite()).sum::<f64>() / column.len() as f64
        };
        (0..4).map(mean).collect()
    };
    let same = analysed(&turned(0.0), Estimator::Smoother).unwrap();
    let other = analysed(&turned(0.3), Estimator::Smoother).unwrap();
    let [typed, same, other] = [&typed, &same, &other].map(loads);
    assert!((typed[0] - same[0]).abs() < 1e-6, "{typed:?} {same:?}");
    assert!((typed[0] - other[0]).abs() > 100.0, "{typed:?} {other:?}");

    let flat = "[signals.odometry]\nvelocity = [{ topic = \"/odom\", field = \"twist.twist.linear.x\" }, 0, 0.0]\n";
    let analysis = analysed(flat, Estimator::Smoother).unwrap();
    let input = analysis.inputs.iter().find(|i| i.signal == "odometry");
    assert_eq!(input.unwrap().why, "numbers named by the machine file");
}

#[test]
fn constants_of_the_machine_file_are_not_frozen() {
    let measured = triple("angular_velocity", "/imu/data", "angular_velocity");
    for constant in [
        "[0, 0, 0]",
        "[0.0, { topic = \"/imu/data\", field = \"angular_velocity.y\" }, 0]",
    ] {
        let signals = tables().replace(&measured, &format!("angular_velocity = {constant}\n"));
        for estimator in [Estimator::Smoother, Estimator::Causal] {
            let analysis = analysed(&signals, estimator).unwrap();
            let frozen: Vec<_> = (analysis.events.iter())
                .filter(|event| {
                    event
                        .fault
                        .as_ref()
                        .is_some_and(|fault| fault.kind == FaultKind::Frozen)
                })
                .collect();
            assert!(frozen.is_empty(), "{constant}: {frozen:?}");
            let valid = (0..analysis.rows.len()).filter(|&row| analysis.rows.is_valid(row));
            assert!(2 * valid.count() > analysis.rows.len(), "{constant}");
        }
    }
}

#[test]
fn what_is_wrong_with_a_number_is_said() {
    let said = |signals: &str| {
        let error = analysed(signals, Estimator::Smoother).unwrap_err();
        format!("{error:#}")
    };
    let lift = |binding: &str| format!("[signals.joints.lift]\n{binding}\n");
    let cases: [(String, &[&str]); 12] = [
        (
            lift("position = { topic = \"/nowhere\", field = \"a\" }"),
            &["/nowhere", "field a", "/joint_states", "/imu/data"],
        ),
        (
            lift("position = { topic = \"/imu/data\", field = \"linear_acceleration.q\" }"),
            &["/imu/data", "linear_acceleration.q", "which has: x, y, z"],
        ),
        (
            lift("position = { topic = \"/imu/data\", field = \"linear_acceleration\" }"),
            &["linear_acceleration: expected a number", "message"],
        ),
        (
            lift("position = { topic = \"/joint_states\", joint = \"boom\" }"),
            &["/joint_states", "field position", "\"boom\"", "lift"],
        ),
        (
            lift("position = { topic = \"/joint_states\", field = \"position[]\" }"),
            &["/joint_states", "the path of one number", "position[]"],
        ),
        (
            lift("position = { topic = \"/joint_states\" }"),
            &["signals.joints.lift.position", "field", "none"],
        ),
        (
            lift("position = { topic = \"/a\", field = \"a\", scale = 0 }"),
            &["/a", "not in the log"],
        ),
        (
            lift("velocity = { topic = \"/joint_states\", joint = \"lift\" }"),
            &["signals.joints.lift", "a position", "none"],
        ),
        (
            "[signals.joints.boom]\nposition = { topic = \"/joint_states\", joint = \"lift\" }\n"
                .into(),
            &["signals.joints.boom", "joint", "tiny.urdf"],
        ),
        (
            "[signals]\nimu = { specific_force = 3 }\n".into(),
            &["specific_force"],
        ),
        (
            "[signals.odometry]\nvelocity = [0, 0, 0]\n".into(),
            &["signals.odometry.velocity", "constants alone"],
        ),
        (
            "[signals.odometry]\nvelocity = [{ topic = \"/odom\", field = \"twist.twist.linear.x\" }, 0, 0]\n\
             roll_pitch_yaw = [{ topic = \"/odom\", field = \"twist.twist.linear.x\" }, \
             { topic = \"/imu/data\", field = \"linear_acceleration.x\" }, 0]\n"
                .into(),
            &["signals.odometry.roll_pitch_yaw[1]", "/odom", "/imu/data"],
        ),
    ];
    for (signals, parts) in cases {
        let said = said(&signals);
        for part in parts {
            assert!(said.contains(part), "\"{part}\" is not in: {said}");
        }
    }
}
