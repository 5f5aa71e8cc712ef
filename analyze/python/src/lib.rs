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
    use super::settings::set_read_options;
    #[pymodule_export]
    use super::studies::{WhatIf, compare, whatif};
    #[pymodule_export]
    use super::table::{Column, Table};

    use pyo3::prelude::*;

    use super::call::place::Place;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }

    /// States the file of this library: results name it, and not the interpreter, as the program that made them.
    #[pyfunction]
    fn set_program(file: Place) {
        tipwatch_analyze::base::file_hash::set_program(&file);
    }
}
