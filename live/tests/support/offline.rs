//! Analysis of a log, as by `tipwatch analyze`.

use std::path::Path;

use tipwatch_analyze::analysis::{Analysis, run};
use tipwatch_analyze::base::options::{Estimator, Options};
use tipwatch_binding::MachineFile;

/// The analysis with the estimator of the monitor.
pub fn causal(log: &Path, machine: &Path) -> Analysis {
    let options = Options {
        estimator: Estimator::Causal,
        ..Options::default()
    };
    let file = MachineFile::read(machine).unwrap();
    run::analyse(log, &file, options, &mut |_| {}).unwrap()
}
