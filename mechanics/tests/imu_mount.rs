//! Mounting pose of the IMU: machine file, URDF, static transforms, in this order; conflicts are reported.

use crate::support;
use nalgebra::Vector3;
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::machine::{LogFacts, MachineSpec, MountSource, StaticTransform};

const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// The rigid machine with another `[imu]` table, for a log whose IMU messages name `frame`.
fn machine(imu: &str, frame: &str, transforms: &[StaticTransform]) -> Machine {
    let text = support::data("rigid.toml");
    let (before, after) = text.split_once("[imu]").unwrap();
    let after = &after[after.find("\n[").unwrap()..];
    let spec = MachineSpec::from_toml(&format!("{before}{imu}{after}"), "machine.toml").unwrap();
    let facts = LogFacts {
        imu_frame: Some(frame),
        static_transforms: transforms,
        ..LogFacts::default()
    };
    spec.check(&support::data("rigid.urdf"), "machine.urdf", facts)
        .unwrap()
}

fn place(machine: &Machine) -> Vector3<f64> {
    assert_eq!(machine.imu().body, 0);
    machine.imu().body_from_mount.translation.vector
}

#[test]
fn static_transform_chain_places_imu_despite_slashes() {
    // The IMU is in a box mounted on the base, rotated left by a quarter turn.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let box_in_base =
        StaticTransform::new("/base_link", "box", [1.0, 0.0, 0.5], [0.0, 0.0, half, half]);
    let imu_in_box = StaticTransform::new("/box", "/imu", [0.2, 0.0, 0.0], UPRIGHT);
    for frame in ["imu", "/imu"] {
        let found = machine("", frame, &[imu_in_box.clone(), box_in_base.clone()]);
        let source = &found.imu().source;
        assert!(
            matches!(source, MountSource::StaticTransform { .. }),
            "{source}"
        );
        assert!((place(&found) - Vector3::new(1.0, 0.2, 0.5)).norm() < 1e-12);
        let forward = found.imu().body_from_mount.rotation * Vector3::x();
        assert!((forward - Vector3::y()).norm() < 1e-12);
        assert!(found.notes().is_empty(), "{:?}", found.notes());
    }
}

#[test]
fn machine_file_takes_precedence_conflict_is_reported() {
    let elsewhere = StaticTransform::new("base_link", "imu", [0.3, 0.0, 0.05], UPRIGHT);
    let stated = "[imu]\nlink = \"base_link\"\nxyz = [0.1, 0.0, 0.05]\n";
    let found = machine(stated, "imu", std::slice::from_ref(&elsewhere));
    assert!((place(&found) - Vector3::new(0.1, 0.0, 0.05)).norm() < 1e-12);
    let [note] = found.notes() else {
        panic!("{:?}", found.notes());
    };
    assert!(
        note.contains("the pose in the machine file") && note.contains("200.0 mm"),
        "{note}"
    );
    let agreeing = StaticTransform::new("base_link", "imu", [0.1, 0.0, 0.0504], UPRIGHT);
    assert!(machine(stated, "imu", &[agreeing]).notes().is_empty());
    // A link of the URDF takes precedence over the transforms.
    let of_link = StaticTransform::new("base_link", "arm_slew", [0.0; 3], UPRIGHT);
    let source = machine("", "/arm_slew", &[of_link]).imu().source.clone();
    let frame = "arm_slew".into();
    assert_eq!(source, MountSource::MessageFrame { frame });
}

#[test]
fn unknown_imu_frame_is_assumed_at_base_and_reported() {
    let loops = [
        StaticTransform::new("a", "imu", [1.0; 3], UPRIGHT),
        StaticTransform::new("imu", "a", [1.0; 3], UPRIGHT),
    ];
    let found = machine("", "imu", &loops);
    let assumed = MountSource::Assumed {
        base: "base_link".into(),
        frame: Some("imu".into()),
    };
    assert_eq!(found.imu().source, assumed);
    assert!(place(&found).norm() < 1e-12);
}
