//! Before the first analysis: contents of a log, a first machine file for it or from a data sheet, a check of that file,
//! commissioning, identification, validation against measured loads, and its load chart.

pub mod chart;
pub mod check_machine;
pub mod commissioning;
pub mod first_machine;
pub mod from_sheet;
pub mod identify;
pub mod inspect;
pub mod validate;
