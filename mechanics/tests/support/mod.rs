//! What the tests share: machines from the files in `data/`.

#![allow(dead_code, reason = "every test file uses some of it")]

pub(crate) mod closed_form;

use std::path::Path;

use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::{Machine, MachineError, Motion, State};

/// Text of a file in `data/`.
pub(crate) fn data(name: &str) -> String {
    std::fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/data")
            .join(name),
    )
    .unwrap()
}

/// A machine of `data/`, its file edited by `edit`, with every joint measured that no linkage moves.
pub(crate) fn edited(name: &str, edit: impl Fn(String) -> String) -> Result<Machine, MachineError> {
    let spec = MachineSpec::from_toml(&edit(data(&format!("{name}.toml"))), "machine.toml")?;
    spec.check(
        &data(&format!("{name}.urdf")),
        "machine.urdf",
        LogFacts::default(),
    )
}

/// A machine of `data/` with every joint measured that no linkage moves.
pub(crate) fn machine(name: &str) -> Machine {
    edited(name, |text| text).unwrap()
}

/// Sets the motion of a joint.
pub(crate) fn set_joint(machine: &Machine, state: &mut State<f64>, name: &str, motion: [f64; 3]) {
    let index = machine
        .joints()
        .iter()
        .position(|joint| joint.name == name)
        .unwrap();
    let [position, rate, acceleration] = motion;
    state.joints[index] = Motion {
        position,
        rate,
        acceleration,
    };
}

/// Index of a wheel.
pub(crate) fn wheel(machine: &Machine, name: &str) -> usize {
    machine
        .wheels()
        .iter()
        .position(|wheel| wheel.name == name)
        .unwrap()
}
