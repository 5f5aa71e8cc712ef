//! The command line: one file per command.

mod analyze;
mod chart;
mod check_machine;
mod command_line;
mod compare;
mod demo;
mod exit;
mod first_report;
mod identify;
mod inspect;
mod live_program;
mod machine;
mod machine_file;
mod open_values;
mod options;
mod query;
mod reading;
mod recover;
mod screen;
mod stabilise;
mod validate;
mod verify;
mod whatif;

pub use command_line::{Cli, run};
