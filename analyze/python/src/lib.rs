//! The extension module behind the Python package `tipwatch`: NumPy arrays and Arrow tables in and out.
//!
//! The package itself (`analyze/python/tipwatch`) adds what is better said in Python: drawing, progress bars, names.

mod analysis;
mod arrays;
mod call;
mod evaluation;
mod identify;
mod inputs;
mod machine;
mod pose;
mod program;
mod read;
mod screen;
mod settings;
mod studies;
mod table;

use pyo3::prelude::*;
use tipwatch_allocator::Allocator;

/// Freed memory is kept for the next use, as in the programs.
#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

/// The level of x86-64 that this library was compiled for. `tipwatch/_processor.py` finds it in the file: once it is loaded, it is
/// too late.
const PROCESSOR: &str = if cfg!(not(target_arch = "x86_64")) {
    "tipwatch-is-built-for:any;"
} else if cfg!(target_feature = "avx512f") {
    "tipwatch-is-built-for:x86-64-v4;"
} else if cfg!(any(
    target_feature = "avx",
    target_feature = "avx2",
    target_feature = "fma",
    target_feature = "bmi2"
)) {
    "tipwatch-is-built-for:x86-64-v3;"
} else {
    "tipwatch-is-built-for:any;"
};

#[pymodule]
mod _tipwatch {
    #[pymodule_export]
    use super::analysis::{Analysis, analyze};
    #[pymodule_export]
    use super::call::error::TipwatchError;
    #[pymodule_export]
    use super::evaluation::Evaluation;
    #[pymodule_export]
    use super::identify::{Identification, identify};
    #[pymodule_export]
    use super::machine::Machine;
    #[pymodule_export]
    use super::program::main;
    #[pymodule_export]
    use super::read::read;
    #[pymodule_export]
    use super::screen::{Fleet, FleetTask, screen};
    #[pymodule_export]
    use super::settings::{set_read_options, stated_read_options};
    #[pymodule_export]
    use super::studies::{WhatIf, compare, whatif};
    #[pymodule_export]
    use super::table::{Column, Table};

    use pyo3::prelude::*;

    use super::PROCESSOR;
    use super::call::place::Place;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        // of one that a caller makes
        let error = module.py().get_type::<TipwatchError>();
        error.setattr("kind", "error")?;
        module.add("__processor__", PROCESSOR)?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }

    /// States the file of this library: results name it, and not the interpreter, as the program that made them.
    #[pyfunction]
    fn set_program(file: Place) {
        tipwatch_analyze::base::file_hash::set_program(&file);
    }
}
