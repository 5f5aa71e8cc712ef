//! Common parts of the tests: the machine on two bogies that actuators turn.

use std::path::Path;

use proptest::test_runner::{Config, FileFailurePersistence};
use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::{Machine, MachineError};

/// Returns the settings for so many random cases; one that fails is kept beside the test, and is tried first from then on.
pub(crate) fn cases(cases: u32) -> Config {
    let kept = FileFailurePersistence::WithSource("regressions");
    Config {
        failure_persistence: Some(Box::new(kept)),
        ..Config::with_cases(cases)
    }
}

/// Text of a reference file in `data/`.
pub(crate) fn data(name: &str) -> String {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    std::fs::read_to_string(tests.join("data").join(name)).unwrap()
}

/// The machine, its file edited by `edit`, with every joint measured that no linkage moves.
pub(crate) fn bogie(edit: impl Fn(String) -> String) -> Result<Machine, MachineError> {
    let text = edit(include_str!("../../tests/data/bogie.toml").into());
    let spec = MachineSpec::from_toml(&text, "bogie.toml")?;
    let urdf = include_str!("../../tests/data/bogie.urdf");
    spec.check(urdf, "bogie.urdf", LogFacts::default())
}
