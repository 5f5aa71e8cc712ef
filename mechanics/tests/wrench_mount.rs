//! The frame in which a log gives the wrench of the tool: that of its messages, as far as it moves with the tool.

use crate::support;
use nalgebra::Vector3;
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::machine::{
    LogFacts, MachineError, MachineSpec, MountSource, NoteKind, StaticTransform,
};

/// The rigid machine for a log whose wrench messages name `frame`, and a machine file that names their topic or not.
fn machine(
    frame: &str,
    is_named: bool,
    transforms: &[StaticTransform],
) -> Result<Machine, MachineError> {
    let mut text = support::data("rigid.toml");
    if is_named {
        text = text.replacen("[signals]", "[signals]\ntool_wrench = \"/tool_wrench\"", 1);
    }
    let facts = LogFacts {
        tool_wrench_frame: Some(frame),
        static_transforms: transforms,
        ..LogFacts::default()
    };
    let spec = MachineSpec::from_toml(&text, "machine.toml")?;
    spec.check(&support::data("rigid.urdf"), "machine.urdf", facts)
}

#[test]
fn frame_of_the_messages_is_that_of_the_wrench() {
    let of_link = machine("tool", true, &[]).unwrap();
    let tool = of_link.tool().unwrap();
    assert_eq!(tool.source, MountSource::MachineFile);
    assert_eq!(machine("", true, &[]).unwrap().tool(), Some(tool));

    // a link that is fixed to the tool: the tool is 1.2 m in front of it
    let wrist = machine("/extension_rod_link", false, &[]).unwrap();
    let wrist = wrist.tool().unwrap();
    assert_eq!(wrist.body, tool.body);
    let apart = wrist.body_from_mount.inverse() * tool.body_from_mount;
    assert!((apart.translation.vector - Vector3::new(1.2, 0.0, 0.0)).norm() < 1e-12);

    // a sensor that the URDF does not have, a quarter turn about x
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let sensor = StaticTransform::new("tool", "ft", [0.0, 0.0, 0.1], [half, 0.0, 0.0, half]);
    let turned = machine("ft", true, &[sensor]).unwrap();
    let turned = turned.tool().unwrap();
    let apart = tool.body_from_mount.inverse() * turned.body_from_mount;
    assert!((apart.rotation * Vector3::y() - Vector3::z()).norm() < 1e-12);
    assert!((apart.translation.vector - Vector3::new(0.0, 0.0, 0.1)).norm() < 1e-12);
}

#[test]
fn wrench_of_another_body_is_not_that_of_the_tool() {
    let refused = machine("base_link", true, &[]).unwrap_err();
    assert!(
        matches!(&refused, MachineError::Value { place, .. } if place == "signals.tool_wrench"),
        "{refused}"
    );
    let unnamed = machine("base_link", false, &[]).unwrap();
    assert!(unnamed.tool().is_none());
    assert_eq!(unnamed.notes().len(), 1);
}

#[test]
fn unknown_frame_is_assumed_to_be_the_tools_and_told() {
    let assumed = machine("somewhere", false, &[]).unwrap();
    let of_link = machine("tool", false, &[]).unwrap();
    assert_eq!(assumed.tool(), of_link.tool());
    let kinds: Vec<NoteKind> = assumed.notes().iter().map(|note| note.kind).collect();
    assert_eq!(kinds, [NoteKind::Unconfirmed]);
}
