//! A machine of the test data.

use tipwatch_mechanics::MachineSpec;
use tipwatch_mechanics::machine::{LogFacts, Machine};

/// The machine of `rigid.toml`.
pub(crate) fn rigid() -> Machine {
    let spec = include_str!("../../../mechanics/tests/data/rigid.toml");
    let urdf = include_str!("../../../mechanics/tests/data/rigid.urdf");
    let spec = MachineSpec::from_toml(spec, "rigid.toml").unwrap();
    spec.check(urdf, "rigid.urdf", LogFacts::default()).unwrap()
}
