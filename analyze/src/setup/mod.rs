//! Before the first analysis: contents of a log, a first machine file for it or from a data sheet, a check of that file,
//! commissioning, identification, and validation against measured loads.

pub mod check_machine;
pub mod commissioning;
pub mod first_machine;
pub mod from_sheet;
pub mod identify;
pub mod inspect;
pub mod validate;
