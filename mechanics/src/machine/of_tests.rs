//! Machines of the test data.

use super::{LogFacts, Machine, MachineSpec};

/// A machine by the text of its file and its URDF.
pub(crate) fn checked(file: &str, urdf: &str) -> Machine {
    let spec = MachineSpec::from_toml(file, "machine.toml").unwrap();
    spec.check(urdf, "machine.urdf", LogFacts::default())
        .unwrap()
}

/// The machine of `rigid.toml`: its front wheels are steered, on tyres of known stiffness.
pub(crate) fn rigid() -> Machine {
    rigid_with(str::to_owned, str::to_owned)
}

/// The same with its file and its URDF edited.
pub(crate) fn rigid_with(file: impl Fn(&str) -> String, urdf: impl Fn(&str) -> String) -> Machine {
    checked(
        &file(include_str!("../../tests/data/rigid.toml")),
        &urdf(include_str!("../../tests/data/rigid.urdf")),
    )
}
