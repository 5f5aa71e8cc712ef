//! Machines to which the analytic model does not apply are rejected.

use crate::support;
use tipwatch_mechanics::closed_form::{ClosedFormError, Platform, PlatformParts};
use tipwatch_mechanics::machine::LogFacts;
use tipwatch_mechanics::{Machine, MachineSpec};

#[test]
fn unsupported_machines_are_rejected() {
    let wheels = ClosedFormError::Wheels { found: 6 };
    let six = support::machine("six_wheels");
    assert_eq!(PlatformParts::of(&six).unwrap_err(), wheels);
    let machine = support::machine("petrovic_mattila");
    let count = machine.joints().len();
    let refusal = Platform::of(&machine, &vec![0.0; count - 1]).unwrap_err();
    let positions = ClosedFormError::JointPositions {
        expected: count,
        found: count - 1,
    };
    assert_eq!(refusal, positions);
    let refusal = Platform::of(&machine, &vec![f64::NAN; count]).unwrap_err();
    assert_eq!(refusal, ClosedFormError::Posture);
    let springs = support::edited("petrovic_mattila", |text| {
        let each = "[contact.tyre_stiffness]\nFL = 8e5\nFR = 8e5\nRL = 8e5\nRR = 9e5";
        text.replace("[contact]\nroll_moment_distribution = 0.5", each)
    })
    .unwrap();
    assert_eq!(
        PlatformParts::of(&springs).unwrap_err(),
        ClosedFormError::Split
    );
}

/// The platform of a machine whose front left wheel is at `place`.
fn with_front_left_at(place: &str) -> Result<Platform<f64>, ClosedFormError> {
    let text = support::data("petrovic_mattila.toml");
    let text = text.split("[arm]").next().unwrap();
    let urdf = support::data("petrovic_mattila.urdf");
    let (before, _) = urdf.split_once(" <link name='arm_slew'>").unwrap();
    let urdf = format!("{before}</robot>").replace("'1.15 0.875 -0.1", &format!("'{place}"));
    let spec = MachineSpec::from_toml(text, "machine.toml").unwrap();
    let machine: Machine = spec
        .check(&urdf, "machine.urdf", LogFacts::default())
        .unwrap();
    Platform::of(&machine, &vec![0.0; machine.joints().len()])
}

#[test]
fn wheels_off_a_rectangle_are_rejected() {
    assert!(with_front_left_at("1.18 0.89 -0.1").is_ok());
    let ahead = with_front_left_at("1.25 0.875 -0.1");
    assert!(
        matches!(ahead, Err(ClosedFormError::Axle { axle: "front", .. })),
        "{ahead:?}"
    );
    let aside = with_front_left_at("1.15 0.975 -0.1");
    assert!(
        matches!(aside, Err(ClosedFormError::HalfTrack { side: "left", .. })),
        "{aside:?}"
    );
}

#[test]
fn wheels_fixed_to_the_platform_are_rejected() {
    let text = support::data("petrovic_mattila.toml");
    let urdf = support::data("petrovic_mattila.urdf");
    let urdf = urdf.replace("type='continuous'", "type='fixed'");
    let spec = MachineSpec::from_toml(&text, "machine.toml").unwrap();
    let machine = spec
        .check(&urdf, "machine.urdf", LogFacts::default())
        .unwrap();
    let refusal = PlatformParts::of(&machine).unwrap_err();
    assert!(
        matches!(refusal, ClosedFormError::WeldedWheel { .. }),
        "{refusal}"
    );
}

#[test]
fn without_arm_its_root_is_the_centre_of_mass() {
    let platform = with_front_left_at("1.15 0.875 -0.1").unwrap();
    assert_eq!(platform.arm_base, nalgebra::Vector3::zeros());
}
